//! An arm with a gripper and its docks as the robot knows them.
use nalgebra::Vector3;

use super::{Carrier, ChangeOptions, HandModel, OPEN, grip_from_held, holding, with_hand};
use crate::diagnostic::ConfigError;
use crate::math::{Pose, Rgb};
use crate::mesh::{MeshError, TriMesh, shapes};
use crate::robot::{Arm, ArmModel, JointVector, LinkPairs};
use crate::tool::ToolSet;

use super::PolicyError;

/// Turns of the first joint from which ways to a dock are sought, rad.
const TURNS: [f64; 7] = [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0];
/// Room that links must have from each other before a dock, m.
const SELF_ROOM: f64 = 0.01;
/// Room that a tool needs between the open fingers, m.
const FINGER_ROOM: f64 = 0.006;

/// How the design of pen tools is changed for a run, and how often a change is tried. `None` leaves a number as designed.
#[derive(Clone, Debug, PartialEq)]
pub struct GripperOptions {
    /// Whether tools have the plates that rest on the fingers.
    pub plates: bool,
    /// Whether they have bevels that the fingers wrap around.
    pub bevels: bool,
    /// Friction between fingers and tool.
    pub finger_friction: Option<f64>,
    /// Friction between tool and dock.
    pub dock_friction: Option<f64>,
    /// Play between plates and fingers, m.
    pub plate_gap: Option<f64>,
    /// Angle of the bevels, rad.
    pub bevel: Option<f64>,
    /// Most attempts at a change.
    pub attempts: u32,
}

/// Why an arm can't change tools.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KitError {
    /// The tool's file can't be used.
    #[error(transparent)]
    Tool(#[from] ConfigError),
    /// A tool doesn't go into the hand.
    #[error(
        "the pen tool is {width_mm:.1} mm wide, more than the open hand's {widest_mm:.1} mm less 6 mm of room; make it narrower"
    )]
    TooWide {
        /// Width of the tool, mm.
        width_mm: f64,
        /// Room between the fingers, mm.
        widest_mm: f64,
    },
}

/// What is known of one arm and its pens.
#[derive(Clone, Debug)]
pub struct GripperKit {
    /// Index among the robot's arms that draw.
    pub index: usize,
    /// The arm without a hand; its tip is the flange.
    pub arm: ArmModel,
    /// Posture in which it waits, rad.
    pub home: JointVector,
    /// Its hand.
    pub hand: HandModel,
    /// Design of its tools and docks.
    pub set: ToolSet,
    /// The arm with an open hand, tip at the grip frame.
    pub bare: ArmModel,
    /// Poses of seated tools, world.
    pub docks: Vec<Pose>,
    /// Indices of the docks that hold a pen.
    pub pens: Vec<usize>,
    /// Distances, times and limits of tool changes.
    pub change: ChangeOptions,
}

impl GripperKit {
    /// The kit of `arm`, number `index` of those that draw; `None` when it has no gripper.
    ///
    /// # Errors
    /// Its tool can't be used.
    pub fn new(index: usize, arm: &Arm, options: &GripperOptions) -> Result<Option<Self>, KitError> {
        let Some(gripper) = &arm.gripper else { return Ok(None) };
        let set = designed(ToolSet::read(&gripper.tool)?, options);
        let hand = HandModel::robotiq_3f();
        let (widest, width) = (hand.widest(), set.tool.width);
        if width > widest - FINGER_ROOM {
            return Err(KitError::TooWide { width_mm: width * 1e3, widest_mm: widest * 1e3 });
        }
        let bare = with_hand(&arm.model, &hand, &open_fingers());
        Ok(Some(Self {
            index,
            arm: arm.model.clone(),
            home: arm.home,
            hand,
            set,
            bare,
            docks: gripper.docks.clone(),
            pens: (0..gripper.docks.len()).filter(|i| gripper.full[*i]).collect(),
            change: ChangeOptions { attempts: options.attempts, ..ChangeOptions::default() },
        }))
    }

    /// Finger joints around a tool, rad, as designed.
    pub fn closed(&self) -> [[f64; 3]; 3] {
        let close = self.hand.close_angle(self.set.tool.width);
        [[close, self.set.tool.bevel.map_or(0.9, |b| b.angle), -close]; 3]
    }

    /// The arm holding a tool with a pen of this colour as designed: what planner and law believe.
    ///
    /// # Errors
    /// The tool makes no solid.
    pub fn holding(&self, pen: Rgb) -> Result<ArmModel, MeshError> {
        holding(&self.arm, &self.hand, &self.closed(), &self.set, &grip_from_held(&self.set), pen)
    }

    /// The arm and its hand as they change tools.
    pub fn carrier(&self) -> Carrier {
        Carrier::new(&self.arm, &self.hand, self.home)
    }

    /// Joints that put the open hand ready before a dock: of those that are found from all around, the ones nearest home.
    ///
    /// # Errors
    /// No posture does.
    pub fn before(&self, dock: usize) -> Result<JointVector, PolicyError> {
        let ready = self.change.ready(&self.docks[dock]);
        let pairs = LinkPairs::new(&self.bare);
        let carrier = self.carrier();
        let mut best: Option<(f64, JointVector)> = None;
        for turn in TURNS {
            let mut from = carrier.clone();
            from.home[0] += turn;
            let Some(q) = from.joints_for(&ready) else { continue };
            let within = self.bare.joints.iter().enumerate().all(|(i, j)| (j.lower..=j.upper).contains(&q[i]));
            let clearance = pairs.clearance(&self.bare, &self.bare.kinematics(&q)).distance;
            let far = (q - self.home).norm();
            if within && clearance > SELF_ROOM && best.as_ref().is_none_or(|(d, _)| far < *d) {
                best = Some((far, q));
            }
        }
        let unreached = || PolicyError::DockOutOfReach { arm: self.arm.name.clone(), dock };
        best.map(|(_, q)| q).ok_or_else(unreached)
    }

    /// The docks of this arm and the tools in them as coarse solids, world, to keep clear of; but for the tool in `empty`.
    ///
    /// # Errors
    /// A tool or a dock makes no solid.
    pub fn solids(&self, empty: Option<usize>) -> Result<Vec<TriMesh>, MeshError> {
        let (t, d) = (&self.set.tool, &self.set.dock);
        let low = t.nose_end();
        let (top, bottom) = (low + t.nose.cone + d.guide + d.flare, t.pen_tip().z - 0.008);
        let dock = shapes::cylinder(d.flare_radius + d.wall, top - bottom, 0.03)?;
        let dock = dock.transformed(&Pose::translation(t.nose.axis, 0.0, bottom));
        let depth = t.flat + 0.3 * t.width;
        let reach = t.width + 2.0 * t.plates.map_or(0.0, |p| p.reach);
        let body = shapes::cuboid(&Vector3::new(depth, reach, t.height), 0.06)?;
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

/// Finger joints of an open hand, rad.
pub fn open_fingers() -> [[f64; 3]; 3] {
    [[OPEN, 0.0, -OPEN]; 3]
}

fn designed(mut set: ToolSet, options: &GripperOptions) -> ToolSet {
    if !options.plates {
        set = set.without_plates();
    }
    if !options.bevels {
        set = set.without_bevels();
    }
    let t = &mut set.tool;
    t.friction_fingers = options.finger_friction.unwrap_or(t.friction_fingers);
    t.friction_dock = options.dock_friction.unwrap_or(t.friction_dock);
    if let (Some(plates), Some(gap)) = (&mut t.plates, options.plate_gap) {
        plates.gap = gap;
    }
    if let (Some(bevel), Some(angle)) = (&mut t.bevel, options.bevel) {
        bevel.angle = angle;
    }
    set
}
