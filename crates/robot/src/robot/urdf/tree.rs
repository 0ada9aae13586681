//! From a heap of links and joints to the tree below the base, with held joints told apart from moving ones.
use std::collections::BTreeMap;

use nalgebra::{Translation3, Unit, UnitQuaternion, Vector3};
use urdf_rs::{Joint, JointType};

use super::source::Source;
use super::{RobotError, UrdfOptions};
use crate::diagnostic::nearest;
use crate::math::Pose;

/// The tree of links, as indices into the source's links and joints.
pub(super) struct Tree<'s> {
    source: &'s Source,
    /// Joint above each link.
    above: Vec<Option<usize>>,
    /// Joints below each link, in the order of the file.
    below: Vec<Vec<usize>>,
    /// Parent link of each joint.
    parent: Vec<usize>,
    /// Child link of each joint.
    child: Vec<usize>,
}

impl<'s> Tree<'s> {
    /// Checks names and parentage: every name once, every joint between known links, one root, no cycle.
    pub fn new(source: &'s Source) -> Result<Self, RobotError> {
        let (links, joints) = (&source.robot.links, &source.robot.joints);
        let mut link_of: BTreeMap<&str, usize> = BTreeMap::new();
        for (i, link) in links.iter().enumerate() {
            if let Some(first) = link_of.insert(&link.name, i) {
                let line = source.links[first].line;
                return Err(source.bad_link(i, format!("this name is taken by the link on line {line}")));
            }
        }
        let mut joint_of: BTreeMap<&str, usize> = BTreeMap::new();
        for (j, joint) in joints.iter().enumerate() {
            if let Some(first) = joint_of.insert(&joint.name, j) {
                let line = source.joints[first].line;
                return Err(source.bad_joint(j, format!("this name is taken by the joint on line {line}")));
            }
        }
        let mut tree = Self {
            source,
            above: vec![None; links.len()],
            below: vec![Vec::new(); links.len()],
            parent: Vec::with_capacity(joints.len()),
            child: Vec::with_capacity(joints.len()),
        };
        for (j, joint) in joints.iter().enumerate() {
            let find = |role: &str, name: &str| {
                link_of.get(name).copied().ok_or_else(|| {
                    let hint = nearest(name, link_of.keys().copied())
                        .map_or(String::new(), |n| format!("; did you mean `{n}`?"));
                    source.bad_joint(j, format!("its {role} link `{name}` is not in this file{hint}"))
                })
            };
            let (parent, child) = (find("parent", &joint.parent.link)?, find("child", &joint.child.link)?);
            if let Some(other) = tree.above[child] {
                let message = format!(
                    "link `{}` already hangs on joint `{}` (line {}); a link has one parent",
                    links[child].name, joints[other].name, source.joints[other].line
                );
                return Err(source.bad_joint(j, message));
            }
            tree.above[child] = Some(j);
            tree.below[parent].push(j);
            tree.parent.push(parent);
            tree.child.push(child);
        }
        tree.one_root()?;
        Ok(tree)
    }

    /// Exactly one link has no parent, and every link hangs on it.
    fn one_root(&self) -> Result<usize, RobotError> {
        let file = || self.source.file.clone();
        let roots: Vec<usize> = (0..self.above.len()).filter(|i| self.above[*i].is_none()).collect();
        match roots[..] {
            [] if self.above.is_empty() => {
                Err(RobotError::Xml { file: file(), line: 1, message: "the robot has no links".to_string() })
            }
            [] => Err(self.cyclic(0)),
            [root] => {
                let mut reached = vec![false; self.above.len()];
                let mut stack = vec![root];
                while let Some(i) = stack.pop() {
                    reached[i] = true;
                    stack.extend(self.below[i].iter().map(|j| self.child[*j]));
                }
                reached.iter().position(|r| !r).map_or(Ok(root), |i| Err(self.cyclic(i)))
            }
            [first, second, ..] => {
                let name = &self.source.robot.links[first].name;
                Err(self
                    .source
                    .bad_link(second, format!("hangs on nothing, and neither does link `{name}`; one root is meant")))
            }
        }
    }

    fn cyclic(&self, i: usize) -> RobotError {
        self.source.bad_link(i, "its parents form a cycle; one link must have no parent")
    }

    /// The link named in `wanted`, or the root.
    pub fn base(&self, wanted: Option<&str>) -> Result<usize, RobotError> {
        wanted.map_or_else(|| self.one_root(), |name| self.named(name, "base_link"))
    }

    /// The link named in `wanted`, or the only link below `base` that carries nothing.
    pub fn tip(&self, wanted: Option<&str>, base: usize) -> Result<usize, RobotError> {
        if let Some(name) = wanted {
            return self.named(name, "tip_link");
        }
        let leaves: Vec<usize> = self.links_below(base).into_iter().filter(|i| self.below[*i].is_empty()).collect();
        match leaves[..] {
            [tip] => Ok(tip),
            _ => {
                let names: Vec<&str> = leaves.iter().map(|i| self.source.robot.links[*i].name.as_str()).collect();
                Err(self.source.bad_link(base, format!("name the tip link: it could be any of {}", names.join(", "))))
            }
        }
    }

    fn named(&self, name: &str, option: &'static str) -> Result<usize, RobotError> {
        let links = &self.source.robot.links;
        links.iter().position(|l| l.name == name).ok_or_else(|| {
            let hint = nearest(name, links.iter().map(|l| l.name.as_str()));
            RobotError::NoSuchName {
                file: self.source.file.clone(),
                option,
                kind: "link",
                name: name.to_string(),
                hint: hint.map_or(String::new(), |n| format!("; did you mean `{n}`?")),
            }
        })
    }

    /// `base` and all links below it, parents first, siblings in the order of the file.
    pub fn links_below(&self, base: usize) -> Vec<usize> {
        let (mut order, mut stack) = (Vec::new(), vec![base]);
        while let Some(i) = stack.pop() {
            order.push(i);
            stack.extend(self.below[i].iter().rev().map(|j| self.child[*j]));
        }
        order
    }

    /// The joint above a link and the link above that.
    pub fn up(&self, link: usize) -> Option<(usize, usize)> {
        self.above[link].map(|j| (j, self.parent[j]))
    }

    /// Joints on the way from `base` to `tip`, base first.
    pub fn path(&self, base: usize, tip: usize) -> Result<Vec<usize>, RobotError> {
        let (mut path, mut link) = (Vec::new(), tip);
        while link != base {
            let Some((joint, parent)) = self.up(link) else {
                let name = &self.source.robot.links[base].name;
                return Err(self.source.bad_link(tip, format!("the tip does not hang below the base `{name}`")));
            };
            path.push(joint);
            link = parent;
        }
        path.reverse();
        Ok(path)
    }

    /// Where joint `j` stands still: 0 for a fixed joint, the given position for a frozen one, and for a mimic of a
    /// joint that stands still, what it follows to. `None` for a joint that moves.
    pub fn held(&self, j: usize, options: &UrdfOptions) -> Result<Option<f64>, RobotError> {
        let (mut scale, mut offset, mut at) = (1.0, 0.0, j);
        for _ in 0..=self.parent.len() {
            let joint = &self.source.robot.joints[at];
            let here = match (&joint.joint_type, options.freeze.get(&joint.name)) {
                (JointType::Fixed, _) => Some(0.0),
                (JointType::Floating | JointType::Planar | JointType::Spherical, _) => {
                    let reason = "it has more than one degree of freedom; a serial arm needs revolute, continuous, prismatic or fixed joints";
                    return Err(self.source.unsupported_joint(at, reason));
                }
                (_, frozen) => frozen.copied(),
            };
            if let Some(position) = here {
                return self.within_limits(j, scale * position + offset).map(Some);
            }
            let Some(mimic) = &joint.mimic else { return Ok(None) };
            offset += scale * mimic.offset.unwrap_or(0.0);
            scale *= mimic.multiplier.unwrap_or(1.0);
            at = self.source.robot.joints.iter().position(|other| other.name == mimic.joint).ok_or_else(|| {
                self.source.bad_joint(at, format!("mimics joint `{}`, which is not in this file", mimic.joint))
            })?;
        }
        Err(self.source.bad_joint(j, "mimics itself in a circle"))
    }

    fn within_limits(&self, j: usize, position: f64) -> Result<f64, RobotError> {
        let joint = &self.source.robot.joints[j];
        let bounded = matches!(joint.joint_type, JointType::Revolute | JointType::Prismatic);
        if !position.is_finite() || bounded && !(joint.limit.lower..=joint.limit.upper).contains(&position) {
            let (lower, upper) = (joint.limit.lower, joint.limit.upper);
            return Err(self
                .source
                .bad_joint(j, format!("is held at {position}, outside its limits {lower} to {upper}")));
        }
        Ok(position)
    }
}

/// The pose of an `<origin>`.
pub(super) fn pose_of(origin: &urdf_rs::Pose) -> Pose {
    let [x, y, z] = *origin.xyz;
    let [roll, pitch, yaw] = *origin.rpy;
    Pose::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

/// The unit axis of a joint, `None` when it has no length.
pub(super) fn axis_of(joint: &Joint) -> Option<Vector3<f64>> {
    Unit::try_new(Vector3::from(*joint.axis.xyz), 1e-6).map(Unit::into_inner)
}

/// Pose of the child link in the parent link with the joint held at `position`.
pub(super) fn held_pose(joint: &Joint, position: f64) -> Pose {
    let axis = axis_of(joint).unwrap_or_else(Vector3::zeros);
    let motion = match joint.joint_type {
        JointType::Prismatic => Pose::translation(axis.x * position, axis.y * position, axis.z * position),
        JointType::Revolute | JointType::Continuous => Pose::rotation(axis * position),
        _ => Pose::identity(),
    };
    pose_of(&joint.origin) * motion
}
