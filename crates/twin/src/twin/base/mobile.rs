//! An arm on a driven base as one plant.
use nalgebra::{Matrix6, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use super::floating::{Acting, FloatingPlant, tip_wrench};
use super::{Undercarriage, Wheel, WheelCommand};
use crate::control::MeasuredState;
use crate::math::Pose;
use crate::robot::{ArmModel, BaseModel, BasePose, JointVector, Kinematics, MountModel, WHEELS};
use crate::twin::{PlantKind, RapierPlant, TipForce};

/// Base and arm, wheels and springs. Link 0 of the arm's model is the base's body.
///
/// The momentum of the whole about the world's origin is part of the state: outer forces change it, and after each step the base's
/// twist is what gives it at the new pose. An integrator in joint coordinates alone would let it stray by first order in the step.
#[derive(Clone, Serialize, Deserialize)]
pub struct MobilePlant {
    arm: ArmModel,
    arm_from_base: Pose,
    under: Undercarriage,
    engine: Engine,
    /// Linear and angular momentum about the world's origin, N s and N m s.
    momentum: Vector6<f64>,
    /// The base's motion about the world's origin, m/s and rad/s.
    twist: Vector6<f64>,
    /// Weight of the whole about the world's origin, N and N m.
    weight: Vector6<f64>,
    dt: f64,
    #[serde(skip)]
    kinematics: Option<Kinematics>,
}

#[derive(Clone, Serialize, Deserialize)]
enum Engine {
    Rapier(Box<RapierPlant>),
    Articulated(Box<FloatingPlant>),
}

impl MobilePlant {
    /// A base that stands level at `pose` with its arm at rest at `start`, springs loaded so that nothing moves. `None` when rapier
    /// refuses the chain.
    pub fn new(
        arm: &ArmModel,
        base: &BaseModel,
        pose: &BasePose,
        start: &JointVector,
        kind: PlantKind,
        dt: f64,
    ) -> Option<Self> {
        let mut arm = arm.clone();
        base.stand(&mut arm, pose);
        let rest = MeasuredState { q: *start, qd: JointVector::zeros() };
        let engine = match kind {
            PlantKind::Rapier => Engine::Rapier(Box::new(RapierPlant::on_base(&arm, &rest, dt)?)),
            PlantKind::Articulated => Engine::Articulated(Box::new(FloatingPlant::new(&arm, &rest, dt))),
        };
        let kinematics = arm.kinematics(start);
        let whole = arm.whole_momentum(&kinematics, &rest.qd);
        // seen from the base's own frame
        let mut at_origin = arm.clone();
        base.stand(&mut at_origin, &BasePose::default());
        let own = at_origin.whole_momentum(&at_origin.kinematics(start), &rest.qd);
        let mount = MountModel::new(base, &own.whole);
        let under =
            Undercarriage::new(base, &own.weight(), mount.damping_by_stiffness(&own.whole, base.springs.damping_ratio));
        Some(Self {
            arm_from_base: base.base_from_arm.inverse(),
            under,
            engine,
            momentum: Vector6::zeros(),
            twist: Vector6::zeros(),
            weight: whole.weight(),
            dt,
            kinematics: Some(kinematics),
            arm,
        })
    }

    /// True joint state.
    pub fn state(&self) -> &MeasuredState {
        match &self.engine {
            Engine::Rapier(p) => p.arm_state(),
            Engine::Articulated(p) => &p.state,
        }
    }

    /// The true arm, standing where the base is.
    pub fn arm(&self) -> &ArmModel {
        &self.arm
    }

    /// True pose of the base's frame, world.
    pub fn base_pose(&self) -> Pose {
        self.arm.world_from_base * self.arm_from_base
    }

    /// Motion of the base about the world's origin, m/s and rad/s, world axes.
    pub fn twist(&self) -> &Vector6<f64> {
        &self.twist
    }

    /// Velocity that the base's motion gives a point, m/s, world.
    pub fn carried_velocity(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let (lin, ang): (Vector3<f64>, Vector3<f64>) =
            (self.twist.fixed_rows::<3>(0).into(), self.twist.fixed_rows::<3>(3).into());
        lin + ang.cross(point)
    }

    /// The wheels: front left, front right, rear left, rear right.
    pub fn wheels(&self) -> &[Wheel; WHEELS] {
        self.under.wheels()
    }

    /// Loads of the wheels in the last step, N.
    pub fn loads(&self) -> [f64; WHEELS] {
        self.under.loads()
    }

    /// Where everything is now.
    pub fn kinematics(&self) -> Kinematics {
        self.kinematics.unwrap_or_else(|| self.arm.kinematics(&self.state().q))
    }

    /// Inertia of the whole about the world's origin.
    pub fn whole(&self) -> Matrix6<f64> {
        self.arm.whole_momentum(&self.kinematics(), &self.state().qd).whole
    }

    /// One step under joint torques (N m), the pen's force and what the wheels are asked to do. False when something stopped being
    /// finite.
    pub fn step(&mut self, torque: &JointVector, tip: &TipForce, command: &WheelCommand) -> bool {
        let k = self.kinematics();
        let floor = self.under.step(&self.base_pose(), &self.twist, command, self.dt);
        if !floor.iter().chain(torque.iter()).chain(tip.force.iter()).all(|x| x.is_finite()) {
            return false;
        }
        self.momentum += (floor + tip_wrench(tip) + self.weight) * self.dt;
        let finite = match &mut self.engine {
            Engine::Rapier(p) => p.step_on_base(torque, tip, &k, &floor),
            Engine::Articulated(p) => {
                let acting = Acting { torque, tip, base: &floor, momentum: &self.momentum, twist: &self.twist };
                p.step(&self.arm, &k, &acting)
            }
        };
        finite && self.settle()
    }

    /// Reads where all stands and gives the base the twist that the momentum asks for.
    fn settle(&mut self) -> bool {
        let (pose, state) = match &self.engine {
            Engine::Rapier(p) => (p.base_link_pose(), *p.arm_state()),
            Engine::Articulated(p) => (p.base, p.state),
        };
        self.arm.world_from_base = pose;
        let k = self.arm.kinematics(&state.q);
        let whole = self.arm.whole_momentum(&k, &state.qd);
        let Some(twist) = whole.base_twist(&self.momentum) else { return false };
        (self.twist, self.weight, self.kinematics) = (twist, whole.weight(), Some(k));
        if let Engine::Rapier(p) = &mut self.engine {
            p.set_base_twist(&twist);
        }
        self.twist.iter().all(|x| x.is_finite())
    }
}
