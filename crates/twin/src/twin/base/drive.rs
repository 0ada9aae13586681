//! What drives a base, and a base among the tasks of a simulation.
use serde::{Deserialize, Serialize};

use super::{Localiser, MobilePlant, WheelCommand};
use crate::control::{DriveFollower, DrivePath, DriveStep};
use crate::math::Pose;
use crate::robot::{BaseModel, BasePose, Mecanum, Odometry, WheelSpeeds};
use crate::skill::BaseBelief;
use crate::truth::TrueBase;
use crate::twin::simulation::{ArmSetup, Simulation, TwinError, standing};
use crate::twin::{ArmPlant, BaseStand, TrueScene, TwinOptions};

/// A base as a simulation begins with it.
pub struct BaseSetup {
    /// The true base.
    pub base: BaseModel,
    /// The base as it believes itself to be: what its odometry is worked out from.
    pub believed: BaseModel,
    /// Where it stands.
    pub pose: BasePose,
    /// Where it believes to stand.
    pub believed_pose: BasePose,
    /// What measures where it stands.
    pub localiser: Option<Localiser>,
}

/// All that changes in the driving of a base, but for the wheels.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DriveState {
    /// What the wheels are asked to do.
    pub(crate) command: WheelCommand,
    /// The base as it believes itself to be.
    model: BaseModel,
    /// Its wheels as it knows them.
    wheels: Mecanum,
    odometry: Odometry,
    localiser: Option<Localiser>,
    /// The path under way.
    follower: Option<DriveFollower>,
}

impl DriveState {
    /// Whether a path is under way.
    pub(crate) fn is_driving(&self) -> bool {
        self.follower.is_some()
    }

    /// Reads the wheels after a step of `dt` s.
    pub(crate) fn read(&mut self, plant: &MobilePlant, dt: f64) {
        let turned: WheelSpeeds = plant.wheels().map(|w| w.angle).into();
        self.odometry.read(&self.wheels, &turned, dt);
    }
}

/// How a drive ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Driven {
    /// Whether the wheels tell that it came to the path's end.
    pub arrived: bool,
    /// Where it stands, as it knows.
    pub belief: BaseBelief,
}

/// Time for which a base stands after its last stop, so that it and its arm come to rest, s.
const SETTLING: f64 = 1.0;
/// Longest drive, s: a path's patience ends it long before.
const LONGEST: f64 = 1e6;

impl Simulation {
    /// An arm at rest on a driven base.
    ///
    /// # Errors
    /// rapier refuses the chain, or the wheels can't drive the base.
    pub fn on_base(
        setup: ArmSetup,
        mobile: BaseSetup,
        scene: std::sync::Arc<TrueScene>,
        law: crate::control::LawOptions,
        options: &TwinOptions,
    ) -> Result<Self, TwinError> {
        let BaseSetup { base, believed, pose, believed_pose, localiser } = mobile;
        let wheels = Mecanum::new(&believed).ok_or(TwinError::NoWheels)?;
        let plant = MobilePlant::new(&setup.model, &base, &pose, &setup.start, options.plant, options.dt);
        let plant = plant.ok_or(TwinError::Refused)?;
        let mut setup = setup;
        believed.stand(&mut setup.believed, &believed_pose);
        let mut simulation = Self::new(setup, scene, law, options)?;
        simulation.state.plant = ArmPlant::Mobile(Box::new(plant));
        simulation.state.arm.stand_on_base();
        simulation.state.base = Some(DriveState {
            command: WheelCommand::Hold,
            model: believed,
            wheels,
            odometry: Odometry::at(believed_pose),
            localiser,
            follower: None,
        });
        simulation.refresh();
        Ok(simulation)
    }

    /// Drives along a path for at most `most` steps, the arm held in its posture: how it ended, or `None` while it is under way. A base
    /// that has arrived stands for a second with its wheels held.
    ///
    /// # Errors
    /// The arm stands on no base; the physics blew up.
    pub fn drive(&mut self, path: &DrivePath, most: u64) -> Result<Option<Driven>, TwinError> {
        let (posture, layer) = (self.desired().q, self.state.arm.layer());
        let Some(base) = &mut self.state.base else { return Err(self.no_base()) };
        if base.follower.is_none() {
            let options = path.options.within(&base.model.limits);
            base.follower = Some(DriveFollower::new(DrivePath { options, ..path.clone() }));
        }
        let stand = |time| standing(posture, layer, time);
        let movement = stand(LONGEST);
        for _ in 0..most {
            let Some(base) = &mut self.state.base else { return Err(self.no_base()) };
            let Some(follower) = &mut base.follower else { return Err(self.no_base()) };
            let step = follower.step(&base.odometry.pose, self.options.dt);
            if let DriveStep::Go(twist) = step {
                let w = base.wheels.wheels(&twist);
                base.command = WheelCommand::Turn([w[0], w[1], w[2], w[3]]);
                let _ = self.execute(&movement, None, 1, None)?;
                continue;
            }
            base.command = WheelCommand::Hold;
            base.follower = None;
            if let Some(localiser) = &mut base.localiser {
                localiser.moved();
            }
            self.end_standing();
            while self.execute(&stand(SETTLING), None, u64::MAX, None)?.is_none() {}
            let arrived = step == DriveStep::Arrived;
            let Some(belief) = self.locate() else { return Err(self.no_base()) };
            return Ok(Some(Driven { arrived, belief }));
        }
        Ok(None)
    }

    /// Where the base believes to stand, with what its sensor measures now; `None` without a base.
    pub fn locate(&mut self) -> Option<BaseBelief> {
        let time = self.time();
        let ArmPlant::Mobile(plant) = &self.state.plant else { return None };
        let base = self.state.base.as_mut()?;
        let measured = base.localiser.as_mut().map(|l| l.measure(time, &plant.base_pose(), plant.twist()));
        Some(BaseBelief { by_wheels: base.odometry.pose, measured })
    }

    /// From now on the robot believes its base to stand at `pose`, world, tilt included: odometry and law go on from there.
    pub fn believe_base(&mut self, pose: &Pose) {
        let Some(base) = &mut self.state.base else { return };
        base.odometry.correct(BasePose::of(pose));
        if let Some(truth) = self.true_base() {
            self.log.stands.push(BaseStand { time: self.time(), pose: *truth.reveal(), believed: *pose });
        }
        let Some(base) = &self.state.base else { return };
        let mut believed = self.state.arm.controller.model().clone();
        believed.world_from_base = pose * base.model.base_from_arm;
        self.state.arm.controller = self.law.controller(believed);
    }

    /// Where the base stands, for who measures; `None` without one.
    pub fn true_base(&self) -> Option<TrueBase> {
        match &self.state.plant {
            ArmPlant::Mobile(p) => Some(TrueBase::new(p.base_pose())),
            _ => None,
        }
    }

    fn no_base(&self) -> TwinError {
        TwinError::NoBase { arm: self.name().to_string() }
    }
}
