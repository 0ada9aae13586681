//! An arm with a gripper, as it is needed for fetching pens and for drawing with them.
use nalgebra::{Translation3, UnitQuaternion, Vector3};

use crate::math::{Pose, Rgb, stream, unit};
use crate::mesh::{TriMesh, shapes};
use crate::robot::{Arm, ArmModel, JointVector, LinkPairs};
use crate::run::RunError;
use crate::scenario::ToolSettings;
use crate::skill::{Carrier, ChangeOptions, HandModel, OPEN, grip_from_held, holding, with_hand};
use crate::tool::ToolSet;
use crate::twin::grasp::{DockError, ErrorRanges, SensorNoise, TrialSetup, Variation};

/// Turns of the first joint from which ways to a dock are sought, rad.
const TURNS: [f64; 7] = [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0];
/// Room that links must have from each other before a dock, m.
const SELF_ROOM: f64 = 0.01;

/// What is known of one arm and its pens.
pub(super) struct Kit<'a> {
    /// Index among the robot's arms that draw.
    pub index: usize,
    pub arm: &'a Arm,
    pub hand: HandModel,
    pub set: ToolSet,
    /// The arm with an open hand, tip at the grip frame.
    pub bare: ArmModel,
    /// Poses of seated tools, as believed.
    pub docks: &'a [Pose],
    /// Indices of the docks that hold a pen.
    pub pens: Vec<usize>,
}

/// A number that is the same for the same words.
fn drawn(seed: u64, what: &str, index: usize, half: f64) -> f64 {
    half * (2.0 * unit(&mut stream(seed, what, index as u64)) - 1.0)
}

impl<'a> Kit<'a> {
    /// The kit of `arm`, number `index` of those that draw; `None` when it has no gripper.
    pub fn new(index: usize, arm: &'a Arm, tools: &ToolSettings) -> Result<Option<Self>, RunError> {
        let Some(gripper) = &arm.gripper else { return Ok(None) };
        let mut set = ToolSet::read(&gripper.tool)?;
        if !tools.plates {
            set = set.without_plates();
        }
        if !tools.bevels {
            set = set.without_bevels();
        }
        let t = &mut set.tool;
        t.friction_fingers = tools.finger_friction.unwrap_or(t.friction_fingers);
        t.friction_dock = tools.dock_friction.unwrap_or(t.friction_dock);
        if let (Some(plates), Some(gap)) = (&mut t.plates, tools.plate_gap_mm) {
            plates.gap = gap * 1e-3;
        }
        if let (Some(bevel), Some(angle)) = (&mut t.bevel, tools.bevel_deg) {
            bevel.angle = angle.to_radians();
        }
        let hand = HandModel::robotiq_3f();
        let (widest, width) = (hand.widest(), set.tool.width);
        if width > widest - 0.006 {
            return Err(RunError::TooWide { width_mm: width * 1e3, widest_mm: widest * 1e3 });
        }
        let bare = with_hand(&arm.model, &hand, &[[OPEN, 0.0, -OPEN]; 3]);
        let pens = (0..gripper.docks.len()).filter(|i| gripper.full[*i]).collect();
        Ok(Some(Self { index, arm, hand, set, bare, docks: &gripper.docks, pens }))
    }

    /// Finger joints round a tool, rad, as designed.
    fn closed(&self) -> [[f64; 3]; 3] {
        let close = self.hand.close_angle(self.set.tool.width);
        [[close, self.set.tool.bevel.map_or(0.9, |b| b.angle), -close]; 3]
    }

    /// The arm holding a tool with a pen of this colour as designed: what planner and law believe.
    pub fn believed(&self, pen: Rgb) -> Result<ArmModel, RunError> {
        holding(&self.arm.model, &self.hand, &self.closed(), &self.set, &grip_from_held(&self.set), pen)
            .map_err(RunError::Tool)
    }

    /// The arm holding it as it really does: the tool at `last_from_tool` in the last link's frame.
    pub fn truly(&self, believed: &ArmModel, last_from_tool: &Pose) -> ArmModel {
        let mut arm = believed.clone();
        let nominal = self.bare.last_from_tip * grip_from_held(&self.set);
        arm.last_from_tip = last_from_tool * nominal.inverse() * believed.last_from_tip;
        arm
    }

    /// The pen's tip in the hand, seen from where a perfect grasp holds it, with the tool at `grip_from_tool`.
    pub fn tip_error(&self, grip_from_tool: &Pose) -> Pose {
        let tip = Translation3::from(self.set.tool.pen_tip().coords);
        (grip_from_held(&self.set) * tip).inverse() * grip_from_tool * tip
    }

    /// How this dock and this arm really are: errors of place and calibration, strength, weight and friction.
    pub fn setup(&self, dock: usize, tools: &ToolSettings, seed: u64) -> Result<(TrialSetup, DockError), RunError> {
        let place = self.docks[dock];
        let name = &self.arm.model.name;
        let key = |what: &str| format!("{what} of {name}");
        let one = |what: &str, spread: f64| 1.0 + drawn(seed, &key(what), dock, spread);
        let hand = |what: &str| {
            let axes = [0, 1, 2].map(|i| drawn(seed, &key(what), i, 1.0));
            Vector3::from(axes)
        };
        let turn = hand("hand angle") * tools.hand_deg.to_radians();
        let hand_error = Pose::from_parts(
            Translation3::from(hand("hand place") * tools.hand_mm * 1e-3),
            UnitQuaternion::from_scaled_axis(turn),
        );
        let variation = Variation {
            friction_fingers: one("friction of fingers", tools.friction_spread),
            friction_dock: one("friction of docks", tools.friction_spread),
            mass: one("tool's mass", tools.mass_spread),
            strength: one("strength", tools.strength_spread),
            hand_error,
            noise: SensorNoise {
                force: tools.force_noise_n,
                fingers: tools.finger_noise_deg.to_radians(),
                seed: seed ^ dock as u64,
                ..SensorNoise::default()
            },
        };
        let options = ChangeOptions { attempts: tools.attempts, ..ChangeOptions::default() };
        let mut carrier = Carrier::new(&self.arm.model, &self.hand, self.arm.home);
        carrier.home = self.before(dock, &carrier, &options)?;
        let setup = TrialSetup {
            set: self.set.clone(),
            hand: self.hand.clone(),
            carrier,
            world_from_dock: place,
            options,
            variation,
        };
        let ranges = ErrorRanges {
            xy: tools.dock_xy_mm * 1e-3,
            z: tools.dock_z_mm * 1e-3,
            tilt: tools.dock_tilt_deg.to_radians(),
            yaw: tools.dock_yaw_deg.to_radians(),
        }
        .scaled(tools.error_scale);
        let error = ranges.draw(seed.wrapping_mul(1000).wrapping_add((100 * self.index + dock) as u64));
        Ok((setup, error))
    }

    /// Joints that put the open hand ready before a dock: of those that are found from all round, the ones nearest home.
    fn before(&self, dock: usize, carrier: &Carrier, options: &ChangeOptions) -> Result<JointVector, RunError> {
        let ready = options.ready(&self.docks[dock]);
        let pairs = LinkPairs::new(&self.bare);
        let mut best: Option<(f64, JointVector)> = None;
        for turn in TURNS {
            let mut from = carrier.clone();
            from.home[0] += turn;
            let Some(q) = from.joints_for(&ready) else { continue };
            let within = self.bare.joints.iter().enumerate().all(|(i, j)| (j.lower..=j.upper).contains(&q[i]));
            let room = pairs.clearance(&self.bare, &self.bare.kinematics(&q)).distance;
            let far = (q - self.arm.home).norm();
            if within && room > SELF_ROOM && best.as_ref().is_none_or(|(d, _)| far < *d) {
                best = Some((far, q));
            }
        }
        best.map(|(_, q)| q).ok_or_else(|| RunError::DockOutOfReach { arm: self.arm.model.name.clone(), dock })
    }

    /// The docks of this arm and the tools in them as coarse solids, world, to keep clear of; but for the tool in `empty`.
    pub fn solids(&self, empty: Option<usize>) -> Result<Vec<TriMesh>, RunError> {
        let (t, d) = (&self.set.tool, &self.set.dock);
        let low = t.nose_end();
        let (top, bottom) = (low + t.nose.cone + d.guide + d.flare, t.pen_tip().z - 0.008);
        let dock = shapes::cylinder(d.flare_radius + d.wall, top - bottom, 0.03).map_err(RunError::Tool)?;
        let dock = dock.transformed(&Pose::translation(t.nose.axis, 0.0, bottom));
        let depth = t.flat + 0.3 * t.width;
        let reach = t.width + 2.0 * t.plates.map_or(0.0, |p| p.reach);
        let body = shapes::cuboid(&Vector3::new(depth, reach, t.height), 0.06).map_err(RunError::Tool)?;
        let body = body.transformed(&Pose::translation(0.5 * depth, 0.0, 0.0));
        let mut solids = Vec::new();
        for (i, place) in self.docks.iter().enumerate() {
            solids.push(dock.transformed(place));
            if empty != Some(i) && self.pens.contains(&i) {
                solids.push(body.transformed(place));
            }
        }
        Ok(solids)
    }
}
