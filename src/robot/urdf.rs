//! URDF to [`ArmModel`]: strict, for any serial arm.
//!
//! Everything that hangs below the base link is part of the arm: the joints from base to tip move, and whatever hangs on
//! fixed joints, beside the chain or beyond the tip, is merged into the link that carries it (mass, centre of mass,
//! inertia, capsules and visuals, all in that link's frame). Links above the base link are left out and noted.
//!
//! A joint that moves but is not between base and tip (a gripper's finger) is refused, unless
//! [`UrdfOptions::freeze`] holds it; a mimic joint is honoured when the joint that it follows stands still, and refused
//! with the reason otherwise. Mass is never invented: a link with a shape that moves needs an `<inertial>`; only bare
//! frames may go without, and whatever is bolted to the base.
//!
//! Collision shapes become capsules: capsules and spheres exactly (`length` of a capsule is that of its cylinder), boxes,
//! cylinders and meshes by a capsule around them, which is never too small. Meshes are STL or OBJ.
mod shape;
mod source;
mod tree;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Point3, Vector3};
use urdf_rs::JointType;

use self::shape::Shapes;
use self::source::Source;
use self::tree::{Tree, axis_of, held_pose, pose_of};
use super::{ArmModel, JointKind, JointModel, LinkModel, MAX_DOF, RobotError, SpatialInertia};
use crate::math::Pose;

/// Which part of a URDF is the arm, and how to find its meshes.
#[derive(Clone, Debug, Default)]
pub struct UrdfOptions {
    /// First link of the arm; the root when `None`.
    pub base_link: Option<String>,
    /// Link whose frame is the tip; the only leaf when `None`.
    pub tip_link: Option<String>,
    /// Folder of each `package://` name.
    pub packages: BTreeMap<String, PathBuf>,
    /// Joints held at a position (rad or m): they count as fixed.
    pub freeze: BTreeMap<String, f64>,
}

/// An arm and what its file said that is not used.
#[derive(Clone, Debug)]
pub struct UrdfArm {
    /// The arm, base at the world's origin.
    pub model: ArmModel,
    /// One line for each kind of element that was read over (`<gazebo>`, `<transmission>`, ...) and for links above the
    /// base.
    pub notes: Vec<String>,
}

/// Reads the arm of a URDF file.
pub fn load(file: &Path, options: &UrdfOptions) -> Result<ArmModel, RobotError> {
    load_with_notes(file, options).map(|arm| arm.model)
}

/// Reads the arm of a URDF file and what of the file is not used.
pub fn load_with_notes(file: &Path, options: &UrdfOptions) -> Result<UrdfArm, RobotError> {
    let unreadable = |source| RobotError::Unreadable { file: file.to_path_buf(), source };
    let bytes = std::fs::read(file).map_err(unreadable)?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        RobotError::Xml { file: file.to_path_buf(), line, message: "the text is not UTF-8".to_string() }
    })?;
    parse(&text, file, options)
}

/// Reads the arm from URDF text; meshes are looked for beside `file`, which is named in errors.
pub fn parse(text: &str, file: &Path, options: &UrdfOptions) -> Result<UrdfArm, RobotError> {
    let source = Source::parse(text, file)?;
    let tree = Tree::new(&source)?;
    for name in options.freeze.keys() {
        if !source.robot.joints.iter().any(|j| j.name == *name) {
            let message = format!("there is no joint `{name}` to freeze");
            return Err(RobotError::Xml { file: file.to_path_buf(), line: 1, message });
        }
    }
    let base = tree.base(options.base_link.as_deref())?;
    let tip = tree.tip(options.tip_link.as_deref(), base)?;
    let path = tree.path(base, tip)?;
    let mut builder = Builder { source: &source, options, tree: &tree, shapes: Shapes::new(&source, options) };
    let mut model = builder.arm(base, tip, &path)?;
    model.name.clone_from(&source.robot.name);
    let mut notes = source.notes.clone();
    let mut link = base;
    while let Some((_, parent)) = tree.up(link) {
        notes.push(format!("link `{}` is above the base and left out", source.robot.links[parent].name));
        link = parent;
    }
    Ok(UrdfArm { model, notes })
}

/// Where a URDF link ended up: which link of the model it moves with, and its pose there.
#[derive(Clone, Copy)]
struct Carried {
    body: usize,
    body_from_link: Pose,
}

struct Builder<'s> {
    source: &'s Source,
    options: &'s UrdfOptions,
    tree: &'s Tree<'s>,
    shapes: Shapes<'s>,
}

impl Builder<'_> {
    fn arm(&mut self, base: usize, tip: usize, path: &[usize]) -> Result<ArmModel, RobotError> {
        let mut arm = ArmModel {
            name: String::new(),
            world_from_base: Pose::identity(),
            joints: Vec::new(),
            links: vec![self.bare_link(base)],
            last_from_tip: Pose::identity(),
        };
        let mut carried: Vec<Option<Carried>> = vec![None; self.source.robot.links.len()];
        carried[base] = Some(Carried { body: 0, body_from_link: Pose::identity() });
        // URDF link that names each body, for errors.
        let mut named_by = vec![base];
        for (i, on_path) in self.in_order(base, path) {
            if i != base {
                let Some((j, parent)) = self.tree.up(i) else { continue };
                let Some(up) = carried[parent] else { continue };
                let joint = &self.source.robot.joints[j];
                carried[i] = Some(match self.tree.held(j, self.options)? {
                    Some(position) => {
                        let body_from_link = up.body_from_link * held_pose(joint, position);
                        Carried { body: up.body, body_from_link }
                    }
                    None if on_path => {
                        if arm.joints.len() == MAX_DOF {
                            let reason = format!("it would be moving joint {} of at most {MAX_DOF}", MAX_DOF + 1);
                            return Err(self.source.unsupported_joint(j, reason));
                        }
                        arm.joints.push(self.moving_joint(j, up.body_from_link)?);
                        arm.links.push(self.bare_link(i));
                        named_by.push(i);
                        Carried { body: arm.links.len() - 1, body_from_link: Pose::identity() }
                    }
                    None => {
                        let reason = "it moves but is not between the base and the tip; hold it with `freeze`";
                        return Err(self.source.unsupported_joint(j, reason));
                    }
                });
            }
            let Some(place) = carried[i] else { continue };
            self.merge(i, &place, &mut arm.links[place.body])?;
        }
        for (body, link) in arm.links.iter().enumerate().skip(1) {
            if link.inertia.mass <= 0.0 {
                let message = "moves and has no <inertial>, nor has anything fixed to it; give it a mass (kg) and inertia (kg m2)";
                return Err(self.source.bad_link(named_by[body], message));
            }
        }
        arm.last_from_tip = carried[tip].map_or_else(Pose::identity, |c| c.body_from_link);
        Ok(arm)
    }

    /// Links below the base, parents first; true for those on the way to the tip.
    fn in_order(&self, base: usize, path: &[usize]) -> Vec<(usize, bool)> {
        let on_path = |i: usize| self.tree.up(i).is_some_and(|(j, _)| path.contains(&j));
        let below = self.tree.links_below(base);
        // The chain first: its bodies are numbered from base to tip, whatever the order in the file.
        let chain = below.iter().filter(|i| **i == base || on_path(**i)).map(|i| (*i, true));
        chain.chain(below.iter().filter(|i| **i != base && !on_path(**i)).map(|i| (*i, false))).collect()
    }

    fn bare_link(&self, i: usize) -> LinkModel {
        LinkModel {
            name: self.source.robot.links[i].name.clone(),
            inertia: SpatialInertia::massless(),
            capsules: Vec::new(),
            visuals: Vec::new(),
        }
    }

    /// Adds URDF link `i` to the body that carries it.
    fn merge(&mut self, i: usize, place: &Carried, body: &mut LinkModel) -> Result<(), RobotError> {
        let (visuals, capsules) = (self.shapes.visuals(i)?, self.shapes.capsules(i)?);
        if self.source.links[i].has_inertial {
            let inertia = self.inertia(i)?;
            body.inertia = body.inertia.joined(&inertia.seen_from(&place.body_from_link));
        } else if place.body > 0 && !(visuals.is_empty() && capsules.is_empty()) {
            let message = "has a shape and moves, but no <inertial>; give it a mass (kg) and inertia (kg m2), or remove its shape";
            return Err(self.source.bad_link(i, message));
        }
        body.capsules.extend(capsules.iter().map(|c| c.seen_from(&place.body_from_link)));
        body.visuals.extend(visuals.into_iter().map(|mut v| {
            v.link_from_visual = place.body_from_link * v.link_from_visual;
            v
        }));
        Ok(())
    }

    /// The inertia of URDF link `i` in its own frame, checked.
    fn inertia(&self, i: usize) -> Result<SpatialInertia, RobotError> {
        let inertial = &self.source.robot.links[i].inertial;
        let m = &inertial.inertia;
        let at_com = SpatialInertia {
            mass: inertial.mass.value,
            com: Point3::origin(),
            inertia: Matrix3::new(m.ixx, m.ixy, m.ixz, m.ixy, m.iyy, m.iyz, m.ixz, m.iyz, m.izz),
        };
        match at_com.defect() {
            Some(defect) => Err(self.source.bad_link(i, defect)),
            None => Ok(at_com.seen_from(&pose_of(&inertial.origin))),
        }
    }

    /// Joint `j` of the chain, whose parent link sits at `body_from_parent`.
    fn moving_joint(&self, j: usize, body_from_parent: Pose) -> Result<JointModel, RobotError> {
        let joint = &self.source.robot.joints[j];
        let bad = |message: String| self.source.bad_joint(j, message);
        if let Some(mimic) = &joint.mimic {
            let reason = format!(
                "it mimics joint `{}`, which moves; the joints of a serial arm are driven one by one",
                mimic.joint
            );
            return Err(self.source.unsupported_joint(j, reason));
        }
        let kind = if joint.joint_type == JointType::Prismatic { JointKind::Prismatic } else { JointKind::Revolute };
        let (lower, upper) = match joint.joint_type {
            JointType::Continuous => (f64::NEG_INFINITY, f64::INFINITY),
            _ => (joint.limit.lower, joint.limit.upper),
        };
        let axis: Vector3<f64> =
            axis_of(joint).ok_or_else(|| bad("its axis has no length; give a direction".to_string()))?;
        if lower >= upper {
            return Err(bad(format!("its lower limit {lower} must be below its upper limit {upper}")));
        }
        let (velocity, effort) = (joint.limit.velocity, joint.limit.effort);
        for (name, value) in [("velocity", velocity), ("effort", effort)] {
            if value <= 0.0 {
                return Err(bad(format!("its {name} limit {value} must be positive")));
            }
        }
        let (damping, friction) = joint.dynamics.as_ref().map_or((0.0, 0.0), |d| (d.damping, d.friction));
        for (name, value) in [("damping", damping), ("friction", friction)] {
            if value < 0.0 {
                return Err(bad(format!("its {name} {value} must not be negative")));
            }
        }
        Ok(JointModel {
            name: joint.name.clone(),
            kind,
            axis,
            parent_from_joint: body_from_parent * pose_of(&joint.origin),
            lower,
            upper,
            velocity,
            effort,
            damping,
            friction,
            armature: 0.0,
        })
    }
}
