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
mod doubt;
mod shape;
mod source;
mod tree;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Point3, Vector3};
use urdf_rs::JointType;

use self::doubt::Doubt;
use self::shape::Shapes;
use self::source::Source;
use self::tree::{Tree, axis_of, held_pose, pose_of};
use super::{ArmModel, JointKind, JointModel, LinkModel, MAX_DOF, RobotError, SpatialInertia};
use crate::diagnostic::nearest;
use crate::files;
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
    /// One line for each number that can hardly be meant, such as a limit in degrees.
    pub warnings: Vec<String>,
}

/// Reads the arm of a URDF file.
pub fn load(file: &Path, options: &UrdfOptions) -> Result<ArmModel, RobotError> {
    load_with_notes(file, options).map(|arm| arm.model)
}

/// Reads the arm of a URDF file and what of the file is not used.
pub fn load_with_notes(file: &Path, options: &UrdfOptions) -> Result<UrdfArm, RobotError> {
    parse(&read_text(file)?, file, options)
}

/// The text of a URDF file.
fn read_text(file: &Path) -> Result<String, RobotError> {
    let unreadable = |source| RobotError::Unreadable { file: file.to_path_buf(), source };
    let bytes = files::read(file).map_err(unreadable)?;
    String::from_utf8(bytes).map_err(|e| {
        let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        RobotError::Xml { file: file.to_path_buf(), line, message: "the text is not UTF-8".to_string() }
    })
}

/// Reads the arm from URDF text; meshes are looked for beside `file`, which is named in errors.
pub fn parse(text: &str, file: &Path, options: &UrdfOptions) -> Result<UrdfArm, RobotError> {
    let source = Source::parse(text, file)?;
    let tree = Tree::new(&source)?;
    for name in options.freeze.keys() {
        let joints = || source.robot.joints.iter().map(|j| j.name.as_str());
        if !joints().any(|j| j == name) {
            let hint = nearest(name, joints()).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
            let file = file.to_path_buf();
            return Err(RobotError::NoSuchName { file, option: "freeze", kind: "joint", name: name.clone(), hint });
        }
    }
    let base = tree.base(options.base_link.as_deref())?;
    let tip = tree.tip(options.tip_link.as_deref(), base)?;
    let path = tree.path(base, tip)?;
    let mut builder =
        Builder { source: &source, options, tree: &tree, shapes: Shapes::new(&source, options), warnings: Vec::new() };
    let mut model = builder.arm(base, tip, &path)?;
    model.name.clone_from(&source.robot.name);
    let warnings = builder.warnings;
    let mut notes = source.notes.clone();
    let mut link = base;
    while let Some((_, parent)) = tree.up(link) {
        notes.push(format!("link `{}` is above the base and left out", source.robot.links[parent].name));
        link = parent;
    }
    Ok(UrdfArm { model, notes, warnings })
}

/// Reads a URDF as one rigid body, all its joints held at 0, with the poses of some of its links in the frame of the base link.
pub(super) fn load_rigid(
    file: &Path,
    options: &UrdfOptions,
    links: &[&str],
) -> Result<(UrdfArm, Vec<Pose>), RobotError> {
    let text = read_text(file)?;
    let mut options = options.clone();
    {
        let source = Source::parse(&text, file)?;
        let moving = source.robot.joints.iter().filter(|j| j.joint_type != JointType::Fixed);
        options.freeze.extend(moving.map(|j| (j.name.clone(), 0.0)));
    }
    let body = parse(&text, file, &options)?;
    let source = Source::parse(&text, file)?;
    let tree = Tree::new(&source)?;
    let base = tree.base(options.base_link.as_deref())?;
    let mut poses = Vec::with_capacity(links.len());
    for name in links {
        let link = tree.tip(Some(name), base)?;
        let on_the_way = tree.path(base, link)?;
        let held = |pose: Pose, j: &usize| pose * held_pose(&source.robot.joints[*j], 0.0);
        poses.push(on_the_way.iter().fold(Pose::identity(), held));
    }
    Ok((body, poses))
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
    warnings: Vec<String>,
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
                self.doubt(doubt::of_joint(joint), |source, message| source.bad_joint(j, message))?;
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
        self.doubt(doubt::of_shapes(&capsules), |source, message| source.bad_link(i, message))?;
        if self.source.links[i].has_inertial {
            let inertia = self.inertia(i)?;
            if place.body > 0 {
                let odd = doubt::of_inertia(&inertia, &capsules, &visuals);
                self.doubt(odd, |source, message| source.bad_link(i, message))?;
            }
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

    /// Refuses what can't be, and keeps what may be meant as a warning; `error` places the words in the file.
    fn doubt(
        &mut self,
        doubts: impl IntoIterator<Item = Doubt>,
        error: impl Fn(&Source, String) -> RobotError,
    ) -> Result<(), RobotError> {
        for doubt in doubts {
            match doubt {
                Doubt::Odd(message) => self.warnings.push(error(self.source, message).to_string()),
                Doubt::Absurd(message) => return Err(error(self.source, message)),
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn robots(file: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(file)
    }

    fn chain(base: &str, tip: &str) -> UrdfOptions {
        UrdfOptions { base_link: Some(base.into()), tip_link: Some(tip.into()), ..UrdfOptions::default() }
    }

    fn tip_at_zero(arm: &ArmModel) -> Pose {
        arm.joints.iter().fold(Pose::identity(), |pose, j| pose * j.parent_from_joint) * arm.last_from_tip
    }

    fn total_mass(arm: &ArmModel) -> f64 {
        arm.links.iter().map(|l| l.inertia.mass).sum()
    }

    #[test]
    fn the_iiwa_has_its_mass_height_and_limits() {
        let arm = load(&robots("iiwa7.urdf"), &chain("link_0", "link_ee")).expect("loads");
        assert_eq!((arm.dof(), arm.links.len()), (7, 8));
        assert!((total_mass(&arm) - 23.899999).abs() < 1e-9);
        let tip = tip_at_zero(&arm);
        assert!((tip.translation.vector - Vector3::new(0.0, 0.0, 1.266)).norm() < 1e-12);
        assert!(tip.rotation.angle() < 1e-12);
        assert!((arm.joints[3].upper - 120f64.to_radians()).abs() < 1e-9 && arm.joints[3].axis.y == -1.0);
        assert!((arm.joints[6].effort, arm.joints[0].friction) == (40.0, 0.319088));
        assert!(arm.links.iter().all(|l| l.capsules.len() == 1 && !l.visuals.is_empty()));
    }

    #[test]
    fn the_ur5e_has_its_mass_and_reach() {
        let arm = load(&robots("ur5e.urdf"), &chain("base_link", "tool0")).expect("loads");
        assert_eq!((arm.dof(), arm.links.len()), (6, 7));
        assert!((total_mass(&arm) - 21.7).abs() < 1e-9);
        let tip = tip_at_zero(&arm);
        assert!((tip.translation.vector - Vector3::new(0.8172, 0.2329, 0.0628)).norm() < 1e-12);
        // tool0 looks along +y of the base at q = 0.
        assert!((tip * Vector3::z() - Vector3::y()).norm() < 1e-12);
    }

    #[test]
    fn the_pen_tip_is_beyond_the_holder_and_free_of_capsules() {
        let pen = load(&robots("pen_holder.urdf"), &UrdfOptions::default()).expect("loads");
        assert_eq!(pen.dof(), 0);
        assert!((total_mass(&pen) - 0.2).abs() < 1e-12);
        assert!((pen.last_from_tip.translation.vector - Vector3::new(0.0, 0.0, 0.1275)).norm() < 1e-12);
        let reach = pen.links[0].capsules.iter().map(|c| c.a.z.max(c.b.z) + c.radius).fold(0.0, f64::max);
        assert!(reach < 0.1275 - 0.015, "capsules reach {reach}");
    }

    /// Farthest that a mesh vertex lies outside all capsules of its link, m.
    fn leak(link: &LinkModel) -> f64 {
        let outside = |p: &Point3<f64>| {
            let depth = |c: &crate::robot::Capsule| {
                let (p, ab) = (p - c.a, c.b - c.a);
                let t = (p.dot(&ab) / ab.norm_squared().max(1e-12)).clamp(0.0, 1.0);
                (p - ab * t).norm() - c.radius
            };
            link.capsules.iter().map(depth).fold(f64::INFINITY, f64::min)
        };
        let mut worst = 0.0;
        for visual in &link.visuals {
            if let crate::robot::VisualShape::Mesh { vertices, .. } = &visual.shape {
                worst = vertices.iter().map(|p| outside(&(visual.link_from_visual * p))).fold(worst, f64::max);
            }
        }
        worst
    }

    #[test]
    fn what_is_seen_lies_within_what_is_kept_clear() {
        for (file, base, tip) in [("iiwa7.urdf", "link_0", "link_ee"), ("ur5e.urdf", "base_link", "tool0")] {
            let arm = load(&robots(file), &chain(base, tip)).expect("loads");
            for link in &arm.links {
                let allowed = 0.014;
                assert!(leak(link) < allowed, "{} of {file} sticks out by {:.4} m", link.name, leak(link));
                let size = |v: &crate::robot::Visual| match &v.shape {
                    crate::robot::VisualShape::Mesh { vertices, .. } => vertices.len(),
                    _ => 0,
                };
                assert!(link.visuals.iter().map(size).sum::<usize>() > 300, "{} of {file} has a shape", link.name);
            }
        }
    }

    #[test]
    fn meshes_are_small_and_all_used() {
        let urdfs: String = ["iiwa7.urdf", "ur5e.urdf", "pen_holder.urdf", "ridgeback.urdf"]
            .map(|f| std::fs::read_to_string(robots(f)).expect("is there"))
            .concat();
        let mut total = 0;
        for entry in std::fs::read_dir(robots("meshes")).expect("is there") {
            let entry = entry.expect("readable");
            let (name, size) = (entry.file_name().into_string().expect("UTF-8"), entry.metadata().expect("size").len());
            assert!(urdfs.contains(&format!("meshes/{name}")), "{name} is used");
            assert!(size < 60_000, "{name} has {size} bytes");
            total += size;
        }
        assert!(total < 750_000, "{total} bytes in all");
    }

    /// An arm of two joints with a flange; tests break it one piece at a time.
    const ARM: &str = r#"<robot name="arm">
  <link name="world"/>
  <joint name="stand" type="fixed"><parent link="world"/><child link="base"/></joint>
  <link name="base"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
  <joint name="turn" type="revolute">
    <origin xyz="0 0 0.2"/><parent link="base"/><child link="upper"/><axis xyz="0 0 2"/>
    <limit lower="-1" upper="1" effort="10" velocity="2"/>
  </joint>
  <link name="upper">
    <inertial><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <collision><geometry><box size="0.1 0.1 0.4"/></geometry></collision>
  </link>
  <joint name="slide" type="prismatic">
    <parent link="upper"/><child link="lower"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.3" effort="20" velocity="1"/><dynamics damping="3" friction="0.5"/>
  </joint>
  <link name="lower">
    <inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
  </link>
  <joint name="mount" type="fixed">
    <origin xyz="0 0 0.1" rpy="0 1.5707963267948966 0"/><parent link="lower"/><child link="cup"/>
  </joint>
  <link name="cup">
    <inertial><origin xyz="0 0 0.1"/><mass value="1"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial>
    <collision><origin xyz="0 0 0.1"/><geometry><sphere radius="0.05"/></geometry></collision>
  </link>
</robot>"#;

    fn read(text: &str) -> Result<UrdfArm, RobotError> {
        parse(text, Path::new("arm.urdf"), &chain("base", "lower"))
    }

    /// The message when `from` in the arm is replaced by `to`.
    fn refusal(from: &str, to: &str) -> String {
        assert!(ARM.contains(from), "{from}");
        read(&ARM.replacen(from, to, 1)).err().unwrap_or_else(|| panic!("accepted {to}")).to_string()
    }

    #[test]
    fn links_on_fixed_joints_are_merged_into_their_carrier() {
        let UrdfArm { model, notes, .. } = read(ARM).expect("loads");
        assert_eq!(model.dof(), 2);
        assert_eq!(model.joints[0].axis, Vector3::z());
        assert_eq!(model.joints[1].kind, JointKind::Prismatic);
        let last = &model.links[2];
        assert_eq!(last.inertia.mass, 2.0);
        // The cup's mass sits 0.1 along its own z, which is x of the carrier: com (0.1, 0, 0.1), half the mass.
        assert!((last.inertia.com - Point3::new(0.05, 0.0, 0.05)).norm() < 1e-15);
        // About the joint com: each body's own inertia and 0.005 or 0.01 kg m2 of offset.
        assert!((last.inertia.inertia[(0, 0)] - (0.01 + 0.01 + 2.0 * 0.0025)).abs() < 1e-12);
        assert!((last.inertia.inertia[(1, 1)] - (0.01 + 0.02 + 2.0 * 0.005)).abs() < 1e-12);
        assert!((last.inertia.inertia[(0, 2)] + 2.0 * 0.0025).abs() < 1e-12);
        assert!((last.capsules[0].a - Point3::new(0.1, 0.0, 0.1)).norm() < 1e-15);
        assert_eq!(notes, ["link `world` is above the base and left out"]);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        for (from, to, line, say) in [
            ("<mass value=\"2\"/>", "", 10, "link `upper`: <inertial> lacks <mass>"),
            ("<mass value=\"2\"/>", "<mass value=\"0\"/>", 9, "mass 0 kg must be positive"),
            ("<mass value=\"2\"/>", "<mass value=\"NaN\"/>", 10, "must be a finite number"),
            ("ixx=\"0.1\"", "ixx=\"0.3\"", 9, "triangle"),
            ("ixx=\"0.1\"", "ixx=\"-0.1\"", 9, "positive definite"),
            ("upper=\"1\"", "", 5, "needs <limit upper"),
            ("effort=\"10\"", "effort=\"0\"", 5, "effort limit 0 must be positive"),
            ("lower=\"-1\"", "lower=\"1\"", 5, "must be below"),
            ("xyz=\"0 0 2\"", "xyz=\"0 0 0\"", 5, "axis has no length"),
            ("xyz=\"0 0 2\"", "xyz=\"0 0 x 2\"", 6, "must be 3 finite numbers"),
            ("damping=\"3\"", "damping=\"-3\"", 13, "must not be negative"),
            ("type=\"revolute\"", "type=\"revolut\"", 5, "did you mean `revolute`?"),
            ("type=\"revolute\"", "type=\"floating\"", 5, "more than one degree of freedom"),
            ("<child link=\"cup\"/>", "<child link=\"cap\"/>", 20, "did you mean `cup`?"),
            ("<child link=\"cup\"/>", "<child link=\"upper\"/>", 20, "a link has one parent"),
            ("<link name=\"world\"/>", "<link name=\"cup\"/>", 23, "name is taken by the link on line 2"),
            ("name=\"slide\"", "name=\"turn\"", 13, "name is taken by the joint on line 5"),
            ("<parent link=\"world\"/>", "<parent link=\"cup\"/>", 4, "form a cycle"),
            ("<robot name=\"arm\">", "<robot><link name=\"stray\"/>", 2, "one root is meant"),
            ("radius=\"0.05\"", "radius=\"-0.05\"", 23, "must be positive"),
            ("<sphere radius=\"0.05\"/>", "<mesh filename=\"no.stl\"/>", 23, "is not a file"),
            ("<sphere radius=\"0.05\"/>", "<mesh filename=\"package://p/no.stl\"/>", 23, "package `p`"),
            ("</collision>", "</colision>", 11, "not well-formed XML"),
            ("<robot name=\"arm\">", "<sdf>", 1, ""),
        ] {
            let message = refusal(from, to);
            assert!(message.contains(say), "`{message}` should say `{say}`");
            if !say.is_empty() {
                assert!(message.starts_with(&format!("arm.urdf:{line}:")), "`{message}` should be at line {line}");
            }
        }
    }

    #[test]
    fn numbers_that_can_hardly_be_meant_are_named() {
        let warned = |from: &str, to: &str| {
            assert!(ARM.contains(from), "{from}");
            read(&ARM.replacen(from, to, 1)).unwrap_or_else(|e| panic!("{e}")).warnings.join("\n")
        };
        // the cup's mass lies outside its small ball
        let warnings = read(ARM).unwrap().warnings;
        let [cup] = &warnings[..] else { panic!("one is meant: {warnings:?}") };
        assert!(
            cup.contains("link `cup`: an inertia of up to 0.020000 kg m2 on 1.000 kg puts its mass 158.1 mm"),
            "{cup}"
        );
        let upper = "<mass value=\"2\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/>";
        let of = |i: &str| upper.replace("0.1", i);
        for (from, to, says) in [
            (
                upper,
                &of("5")[..],
                "arm.urdf:9: link `upper`: an inertia of up to 5.000000 kg m2 on 2.000 kg puts its mass 1936.5 mm",
            ),
            (upper, &of("1e-7"), "link `upper`: an inertia"),
            (
                "lower=\"-1\" upper=\"1\"",
                "lower=\"-120\" upper=\"120\"",
                "joint `turn`: its limits -120 to 120 rad are 38.2 turns",
            ),
            ("velocity=\"2\"", "velocity=\"180\"", "give 3.1416"),
            ("upper=\"0.3\"", "upper=\"300\"", "joint `slide`: its limits 0 to 300 m"),
            ("xyz=\"0 0 0.2\"", "xyz=\"0 0 5\"", "joint `turn`: it lies 5.00 m from"),
            ("rpy=\"0 1.57", "rpy=\"0 91.57", "joint `mount`: its origin turns by 91.57"),
            (
                "<collision><geometry><box",
                "<collision><origin xyz=\"4 0 0\"/><geometry><box",
                "link `upper`: a collision shape reaches 4.",
            ),
        ] {
            let said = warned(from, to);
            assert!(said.contains(says), "`{said}` should say `{says}`");
        }
        // a thousand times too large can't be at all
        assert!(refusal(upper, &of("50000")).contains("link `upper`: an inertia of up to 50000.000000 kg m2"));
        assert!(refusal("xyz=\"0 0 0.2\"", "xyz=\"0 0 200\"").contains("200.00 m"));
        assert!(
            refusal("<collision><geometry><box", "<collision><origin xyz=\"400 0 0\"/><geometry><box").contains("in m")
        );
    }

    #[test]
    fn the_projects_own_robots_are_believed() {
        for (file, base, tip) in [("iiwa7.urdf", "link_0", "link_ee"), ("ur5e.urdf", "base_link", "tool0")] {
            let arm = load_with_notes(&robots(file), &chain(base, tip)).expect("loads");
            assert_eq!(arm.warnings, Vec::<String>::new(), "{file}");
        }
    }

    #[test]
    fn a_moving_link_with_a_shape_needs_mass() {
        let inertial =
            r#"<inertial><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>"#;
        assert!(
            refusal(inertial, "").starts_with("arm.urdf:9: link `upper`: has a shape and moves, but no <inertial>")
        );
        let bare = ARM.replacen(inertial, "", 1).replacen(
            "<collision><geometry><box size=\"0.1 0.1 0.4\"/></geometry></collision>",
            "",
            1,
        );
        assert!(read(&bare).unwrap_err().to_string().contains("link `upper`: moves and has no <inertial>"));
    }

    #[test]
    fn a_cycle_is_refused() {
        let message =
            read(&ARM.replacen("<parent link=\"base\"/>", "<parent link=\"cup\"/>", 1)).unwrap_err().to_string();
        assert!(message.contains("cycle"), "{message}");
    }

    #[test]
    fn a_finger_is_refused_unless_held_and_its_mimic_follows() {
        let fingers = r#"<joint name="finger" type="revolute"><origin xyz="0 0.1 0"/><parent link="lower"/><child link="f"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <link name="f"><inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="other" type="revolute"><parent link="lower"/><child link="g"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/><mimic joint="finger" multiplier="-1" offset="0.1"/></joint>
  <link name="g"><visual><origin xyz="0.2 0 0"/><geometry><sphere radius="0.01"/></geometry></visual>
    <inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
</robot>"#;
        let text = ARM.replacen("</robot>", fingers, 1);
        assert!(read(&text).unwrap_err().to_string().contains("hold it with `freeze`"));
        let mut options = chain("base", "lower");
        options.freeze.insert("finger".into(), 0.5);
        let model = parse(&text, Path::new("arm.urdf"), &options).expect("loads").model;
        assert_eq!(model.links[2].inertia.mass, 4.0);
        let at = model.links[2].visuals[0].link_from_visual.translation.vector;
        assert!((at - Vector3::new(0.2 * 0.4f64.cos(), -0.2 * 0.4f64.sin(), 0.0)).norm() < 1e-12, "{at}");
        options.freeze.insert("finger".into(), 1.5);
        assert!(parse(&text, Path::new("arm.urdf"), &options).unwrap_err().to_string().contains("outside its limits"));
    }

    #[test]
    fn a_mimic_in_the_chain_is_refused_with_its_reason() {
        let message = refusal("<dynamics", "<mimic joint=\"turn\"/><dynamics");
        assert!(message.contains("mimics joint `turn`, which moves"), "{message}");
        let message = refusal("<dynamics", "<mimic joint=\"slide\"/><dynamics");
        assert!(message.contains("mimics itself in a circle"), "{message}");
    }

    #[test]
    fn unused_elements_are_noted_once() {
        let text = ARM.replacen("</robot>", "<gazebo/><gazebo/><transmission name=\"t\"/></robot>", 1);
        assert_eq!(read(&text).expect("loads").notes.len(), 3);
    }

    #[test]
    fn meshes_become_visuals_and_enclosing_capsules() {
        let dir = tempfile::tempdir().expect("a folder");
        let meshes = dir.path().join("my_arm/meshes");
        std::fs::create_dir_all(&meshes).expect("folders");
        std::fs::write(
            meshes.join("t.obj"),
            "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 400\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
        )
        .expect("written");
        let urdf = dir.path().join("my_arm/urdf/arm.urdf");
        let mesh = r#"<mesh filename="package://my_arm/meshes/t.obj" scale="0.001 0.001 0.001"/>"#;
        let text = ARM.replacen("<sphere radius=\"0.05\"/>", mesh, 1);
        std::fs::create_dir_all(dir.path().join("my_arm/urdf")).expect("folder");
        let arm = parse(&text, &urdf, &chain("base", "lower")).expect("found by walking up").model;
        let c = arm.links[2].capsules[0];
        assert!(c.radius > 0.04 && c.radius < 0.12 && (c.b - c.a).norm() < 0.5, "{c:?}");
        let mut options = chain("base", "lower");
        options.packages.insert("my_arm".into(), dir.path().join("elsewhere"));
        assert!(parse(&text, &urdf, &options).unwrap_err().to_string().contains("elsewhere"), "the map goes first");
    }

    #[test]
    fn deep_nesting_is_refused() {
        let text = format!("<robot name='a'>{}", "<link name='b'>".repeat(50_000));
        assert!(read(&text).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn arbitrary_text_never_panics(text in ".{0,300}") {
            let _ = read(&text);
        }

        #[test]
        fn mutated_urdf_never_panics(
            edits in proptest::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0..3u8), 1..4),
        ) {
            // Words of the file are deleted, doubled or swapped, which keeps most of it well formed.
            let mut words: Vec<&str> = ARM.split_inclusive([' ', '>', '"']).collect();
            for (a, b, kind) in edits {
                let (i, j) = (a.index(words.len()), b.index(words.len()));
                match kind {
                    0 => { words.remove(i); }
                    1 => words.insert(i, words[j]),
                    _ => words.swap(i, j),
                }
            }
            if let Ok(arm) = read(&words.concat()) {
                prop_assert!(arm.model.links.iter().all(|l| l.inertia.mass.is_finite()));
                prop_assert_eq!(arm.model.links.len(), arm.model.dof() + 1);
            }
        }
    }
}
