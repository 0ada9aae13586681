//! A robot file: which arms stand where, with which tool, and what stands beside them.
//!
//! ```toml
//! name = "iiwa_fixed"
//!
//! [[arm]]
//! urdf = "iiwa7.urdf"
//! base_link = "link_0"
//! flange_link = "link_ee"
//! pose = { xyz_mm = [0, 0, 300], rpy_deg = [0, 0, 0] }
//! tool = { urdf = "pen_holder.urdf", tip_link = "pen_tip" }
//! home_deg = [0, 25, 0, -110, 0, 45, 0]
//! service_deg = [-90, 0, 0, -90, 0, 45, 0]
//! friction_rejection = 0.95
//!
//! # or, in the tool's place, a gripper with the docks that its pen tools stand in
//! [arm.gripper]
//! kind = "robotiq_3f"
//! tool = "../tools/pen_tool.toml"
//! docks = [{ xyz_mm = [600, 500, 432], rpy_deg = [0, 0, 0] }]
//!
//! # or, in the pose's place, a driven base; see `base.rs`
//! [base]
//! urdf = "ridgeback.urdf"
//!
//! [[furniture]]
//! box_mm = [240, 240, 300]
//! pose = { xyz_mm = [0, 0, 150] }
//! color = [70, 74, 78]
//! ```
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::base::{BaseFile, BaseModel};
use super::gripper::{Gripper, GripperFile};
use super::urdf::{UrdfArm, load_with_notes};
use super::{ArmModel, JointKind, JointVector, RobotError, UrdfOptions, Visual, VisualShape};
use crate::diagnostic::{self, Changes, ConfigError};
use crate::files;
use crate::math::{Pose, Rgb};

/// Rotor inertia felt at a joint when the file gives none, kg m2.
///
/// MuJoCo Menagerie gives its UR5e 0.1. The inertia that a motor shows through its gear is far larger (1.4 to 4.4 kg m2 for
/// an LWR-like arm), but a loop on link-side torque hides most of it.
const ARMATURE: f64 = 0.1;

/// A robot: one arm or more, and what stands beside them.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Name, as in the file.
    pub name: String,
    /// The arms, in the order of the file.
    pub arms: Vec<Arm>,
    /// Boxes that stand beside the arms, such as a pedestal; `link_from_visual` is the pose in the world. Planners keep
    /// clear of them, the physics doesn't know them.
    pub furniture: Vec<Visual>,
}

/// An arm that stands in the world with its tool mounted.
#[derive(Clone, Debug)]
pub struct Arm {
    /// The model: base placed in the world, the tool's mass and shapes merged into the last link, tip at the tool's tip.
    pub model: ArmModel,
    /// Posture from which it starts and to which its redundancy leans.
    pub home: JointVector,
    /// Posture in which a person changes the pen, clear of the canvas.
    pub service: JointVector,
    /// Pose of the flange in the frame of the last link.
    pub last_from_flange: Pose,
    /// Three fingers in a tool's place, when there are.
    pub gripper: Option<Gripper>,
    /// The driven base on which it stands, when there is one; the model's link 0 has it as part.
    pub base: Option<BaseModel>,
    /// What the URDF files said that is not used.
    pub notes: Vec<String>,
    /// Numbers in them that can hardly be meant.
    pub warnings: Vec<String>,
}

/// The robot file as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CellFile {
    name: String,
    arm: Vec<ArmFile>,
    base: Option<BaseFile>,
    #[serde(default)]
    furniture: Vec<FurnitureFile>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ArmFile {
    /// Name in events and files; the URDF's when absent.
    name: Option<String>,
    urdf: PathBuf,
    base_link: Option<String>,
    flange_link: Option<String>,
    pose: Option<PoseFile>,
    tool: Option<ToolFile>,
    /// In a tool's place.
    gripper: Option<GripperFile>,
    /// Degrees; mm for a sliding joint.
    home_deg: Vec<f64>,
    /// Degrees; mm for a sliding joint.
    service_deg: Vec<f64>,
    /// One a joint.
    armature_kg_m2: Option<Vec<f64>>,
    /// Share of the URDF's joint friction, viscous and Coulomb, that the arm's own torque loop takes away, 0..=1.
    #[serde(default)]
    friction_rejection: f64,
    /// Folder of each `package://` name, relative to this file.
    #[serde(default)]
    packages: BTreeMap<String, PathBuf>,
    /// Joints held still, rad or m.
    #[serde(default)]
    freeze: BTreeMap<String, f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolFile {
    urdf: PathBuf,
    base_link: Option<String>,
    tip_link: Option<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PoseFile {
    #[serde(default)]
    pub(super) xyz_mm: [f64; 3],
    #[serde(default)]
    pub(super) rpy_deg: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FurnitureFile {
    box_mm: [f64; 3],
    #[serde(default)]
    pose: PoseFile,
    color: Rgb,
}

impl PoseFile {
    pub(super) fn pose(&self) -> Pose {
        let [x, y, z] = self.xyz_mm.map(|v| v * 1e-3);
        let [roll, pitch, yaw] = self.rpy_deg.map(f64::to_radians);
        Pose::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
    }

    pub(super) fn is_finite(&self) -> bool {
        self.xyz_mm.iter().chain(&self.rpy_deg).all(|v| v.is_finite())
    }
}

impl Cell {
    /// Reads a robot file and the URDFs it names, relative to it.
    pub fn load(file: &Path) -> Result<Self, RobotError> {
        Self::load_changed(file, &Changes::default())
    }

    /// The same with values of the robot file changed.
    pub fn load_changed(file: &Path, changes: &Changes) -> Result<Self, RobotError> {
        let unreadable = |source| ConfigError::Unreadable { file: file.to_path_buf(), source };
        let text = files::read_text(file).map_err(unreadable)?;
        let config = |e| match e {
            RobotError::Config(c) => Ok(c),
            other => Err(other),
        };
        changes.with(&text, file, |text| Self::parse(text, file), config)
    }

    /// Reads a robot from TOML text; paths are relative to `file`, which is named in errors.
    pub fn parse(text: &str, file: &Path) -> Result<Self, RobotError> {
        let raw: CellFile = diagnostic::parse(text, file)?;
        if raw.arm.is_empty() {
            return Err(diagnostic::invalid(text, file, "arm", "a robot needs at least one [[arm]]").into());
        }
        let mut arms: Vec<Arm> = Vec::with_capacity(raw.arm.len());
        for (i, arm) in raw.arm.iter().enumerate() {
            let place = Place { text, file, arm: i };
            let read = arm.read(&place)?;
            if arms.iter().any(|other| other.model.name == read.model.name) {
                let message =
                    format!("there is an arm called `{}` already; give each arm its own name", read.model.name);
                return Err(place.invalid("name", message));
            }
            arms.push(read);
        }
        if let Some(base) = &raw.base {
            ride(base, &raw.arm, &mut arms, text, file)?;
        }
        let mut furniture = Vec::with_capacity(raw.furniture.len());
        for thing in &raw.furniture {
            let finite = thing.pose.is_finite() && thing.box_mm.iter().all(|s| s.is_finite() && *s > 0.0);
            if !finite {
                let message = "furniture needs three positive sizes in mm and a finite pose";
                return Err(diagnostic::invalid(text, file, "furniture.box_mm", message).into());
            }
            let size = Vector3::from(thing.box_mm) * 1e-3;
            let shape = VisualShape::Cuboid { size };
            furniture.push(Visual { link_from_visual: thing.pose.pose(), shape, color: thing.color });
        }
        Ok(Self { name: raw.name, arms, furniture })
    }
}

/// Puts the only arm on the driven base.
fn ride(base: &BaseFile, files: &[ArmFile], arms: &mut [Arm], text: &str, file: &Path) -> Result<(), RobotError> {
    let wrong = |key: &str, message: &str| RobotError::from(diagnostic::invalid(text, file, key, message));
    let ([arm], [written]) = (arms, files) else {
        return Err(wrong("base", "a driven base carries one arm: give one [[arm]]"));
    };
    if arm.gripper.is_some() {
        return Err(wrong("base", "an arm on a driven base draws with a `tool`; a `gripper` can't be simulated there"));
    }
    if written.pose.is_some() {
        return Err(wrong(
            "arm.pose",
            "the base's mount says where the arm stands: leave out `pose`, or give the base's in `[base]`",
        ));
    }
    let transport =
        posture(&base.transport_deg, &arm.model).map_err(|message| wrong("base.transport_deg", &message))?;
    let (model, notes) = base.read(text, file, transport)?;
    model.carry(&mut arm.model);
    arm.notes.extend(notes);
    arm.base = Some(model);
    Ok(())
}

/// Where in the robot file an arm stands, for errors.
struct Place<'t> {
    text: &'t str,
    file: &'t Path,
    arm: usize,
}

impl Place<'_> {
    /// An error at `key` of this arm's table.
    fn invalid(&self, key: &str, message: impl Into<String>) -> RobotError {
        let headers = self.text.lines().enumerate().filter(|(_, l)| l.trim() == "[[arm]]").map(|(i, _)| i);
        let mut headers = headers.skip(self.arm);
        let start = headers.next().unwrap_or(0);
        let end = headers.next().unwrap_or(usize::MAX);
        let sets_key = |l: &str| l.split_once('=').is_some_and(|(name, _)| name.trim() == key);
        let line = self.text.lines().enumerate().skip(start).take_while(|(i, _)| *i < end).find(|(_, l)| sets_key(l));
        let line = line.map_or(start, |(i, _)| i) + 1;
        ConfigError::Invalid { file: self.file.to_path_buf(), line, message: message.into() }.into()
    }

    /// A name that the URDF doesn't have is this file's mistake: it is shown at the key that gives the name.
    fn misnamed(&self, error: RobotError, key_of: impl Fn(&str) -> String) -> RobotError {
        match &error {
            RobotError::NoSuchName { option, .. } => self.invalid(&key_of(option), error.to_string()),
            _ => error,
        }
    }
}

impl ArmFile {
    fn read(&self, place: &Place) -> Result<Arm, RobotError> {
        let folder = place.file.parent().unwrap_or(Path::new("."));
        let options = UrdfOptions {
            base_link: self.base_link.clone(),
            tip_link: self.flange_link.clone(),
            packages: self.packages.iter().map(|(name, dir)| (name.clone(), folder.join(dir))).collect(),
            freeze: self.freeze.clone(),
        };
        let UrdfArm { mut model, mut notes, mut warnings } = load_with_notes(&folder.join(&self.urdf), &options)
            .map_err(|e| place.misnamed(e, |option| option.replace("tip_", "flange_")))?;
        if let Some(name) = &self.name {
            model.name.clone_from(name);
        }
        if let Some(pose) = &self.pose {
            if !pose.is_finite() {
                return Err(place.invalid("pose", "the pose must be made of finite numbers"));
            }
            model.world_from_base = pose.pose();
        }
        if !(0.0..=1.0).contains(&self.friction_rejection) {
            let message = format!("friction_rejection {} must lie between 0 and 1", self.friction_rejection);
            return Err(place.invalid("friction_rejection", message));
        }
        let armature = self.armature_kg_m2.clone().unwrap_or_else(|| vec![ARMATURE; model.dof()]);
        if armature.len() != model.dof() || armature.iter().any(|a| !a.is_finite() || *a < 0.0) {
            let message = format!("armature_kg_m2 needs {} numbers that are not negative, one a joint", model.dof());
            return Err(place.invalid("armature_kg_m2", message));
        }
        for (joint, armature) in model.joints.iter_mut().zip(armature) {
            joint.armature = armature;
            joint.damping *= 1.0 - self.friction_rejection;
            joint.friction *= 1.0 - self.friction_rejection;
        }
        let last_from_flange = model.last_from_tip;
        if let Some(tool) = &self.tool {
            let options = UrdfOptions {
                base_link: tool.base_link.clone(),
                tip_link: tool.tip_link.clone(),
                ..UrdfOptions::default()
            };
            let loaded = load_with_notes(&folder.join(&tool.urdf), &options)
                .map_err(|e| place.misnamed(e, |_| "tool".to_string()))?;
            if loaded.model.dof() > 0 {
                let joint = &loaded.model.joints[0].name;
                return Err(
                    place.invalid("tool", format!("a tool is one rigid body, but joint `{joint}` of this one moves"))
                );
            }
            notes.extend(loaded.notes);
            warnings.extend(loaded.warnings);
            mount(&mut model, &loaded.model);
        }
        let gripper = match &self.gripper {
            Some(_) if self.tool.is_some() => {
                return Err(place.invalid("tool", "an arm has a `tool` or a `gripper`, not both"));
            }
            Some(gripper) => Some(gripper.read(folder).map_err(|(key, message)| place.invalid(key, message))?),
            None => None,
        };
        let home = posture(&self.home_deg, &model).map_err(|message| place.invalid("home_deg", message))?;
        let service = posture(&self.service_deg, &model).map_err(|message| place.invalid("service_deg", message))?;
        Ok(Arm { model, home, service, last_from_flange, gripper, base: None, notes, warnings })
    }
}

/// Bolts a rigid tool to the arm's tip frame: mass, capsules and visuals go to the last link, and the tip becomes the
/// tool's.
fn mount(arm: &mut ArmModel, tool: &ArmModel) {
    let last_from_tool = arm.last_from_tip;
    if let (Some(last), Some(body)) = (arm.links.last_mut(), tool.links.first()) {
        last.inertia = last.inertia.joined(&body.inertia.seen_from(&last_from_tool));
        last.capsules.extend(body.capsules.iter().map(|c| c.seen_from(&last_from_tool)));
        last.visuals.extend(body.visuals.iter().cloned().map(|mut v| {
            v.link_from_visual = last_from_tool * v.link_from_visual;
            v
        }));
    }
    arm.last_from_tip = last_from_tool * tool.last_from_tip;
}

/// A posture from degrees (mm for sliding joints): one number a joint, within the limits.
fn posture(values: &[f64], model: &ArmModel) -> Result<JointVector, String> {
    if values.len() != model.dof() {
        return Err(format!("{} has {} joints, and this gives {} numbers", model.name, model.dof(), values.len()));
    }
    let mut q = JointVector::zeros();
    for (i, (value, joint)) in values.iter().zip(&model.joints).enumerate() {
        let (unit, scale) = match joint.kind {
            JointKind::Revolute => ("deg", 1f64.to_radians()),
            JointKind::Prismatic => ("mm", 1e-3),
        };
        q[i] = value * scale;
        if !(joint.lower..=joint.upper).contains(&q[i]) {
            let (lower, upper) = (joint.lower / scale, joint.upper / scale);
            return Err(format!(
                "joint `{}` at {value} {unit} is outside its limits, {lower:.1} to {upper:.1}",
                joint.name
            ));
        }
    }
    Ok(q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn robots() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots")
    }

    fn given(name: &str) -> String {
        std::fs::read_to_string(robots().join(name)).expect("is there")
    }

    /// World poses of the joints and, last, of the tip.
    fn frames(arm: &ArmModel, q: &JointVector) -> Vec<Pose> {
        let mut pose = arm.world_from_base;
        let mut frames = Vec::new();
        for (joint, q) in arm.joints.iter().zip(q.iter()) {
            pose = pose * joint.parent_from_joint * Pose::rotation(joint.axis * *q);
            frames.push(pose);
        }
        frames.push(pose * arm.last_from_tip);
        frames
    }

    #[test]
    fn given_robots_stand_over_the_canvas_and_step_aside_for_service() {
        for name in ["iiwa_fixed", "ur5e_fixed"] {
            let cell = Cell::load(&robots().join(format!("{name}.toml"))).expect("loads");
            assert_eq!((cell.name.as_str(), cell.arms.len()), (name, 1));
            let arm = &cell.arms[0];
            let home = frames(&arm.model, &arm.home);
            let tip = home.last().expect("has a tip");
            assert!((tip * Vector3::z() + Vector3::z()).norm() < 1e-6, "{name}: the pen looks down");
            assert!((0.35..0.6).contains(&tip.translation.x) && tip.translation.y.abs() < 0.02, "{name}: {tip}");
            for pose in frames(&arm.model, &arm.service).iter().skip(3) {
                assert!(pose.translation.x < 0.2 && pose.translation.z > 0.45, "{name}: {pose}");
            }
            assert!(arm.model.joints.iter().all(|j| j.armature == 0.1));
            assert!(!cell.furniture.is_empty());
        }
    }

    #[test]
    fn the_tool_is_part_of_the_last_link() {
        let cell = Cell::load(&robots().join("iiwa_fixed.toml")).expect("loads");
        let arm = &cell.arms[0];
        let last = arm.model.links.last().expect("has links");
        assert!((last.inertia.mass - 0.459474).abs() < 1e-9);
        let beyond = arm.last_from_flange.inverse() * arm.model.last_from_tip;
        assert!((beyond.translation.vector - Vector3::new(0.0, 0.0, 0.1275)).norm() < 1e-12);
        assert!((arm.model.joints[0].friction - 0.05 * 0.319088).abs() < 1e-12);
        assert!(last.inertia.defect().is_none());
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let text = given("iiwa_fixed.toml");
        for (from, to, say) in [
            (
                "home_deg = [0, 25,",
                "home_deg = [25,",
                "iiwa_fixed.toml:11: iiwa7 has 7 joints, and this gives 6 numbers",
            ),
            ("home_deg = [0, 25,", "home_deg = [0, 125,", "iiwa_fixed.toml:11: joint `A2` at 125 deg is outside"),
            ("friction_rejection = 0.95", "friction_rejection = 1.5", "iiwa_fixed.toml:15: friction_rejection 1.5"),
            ("flange_link = \"link_ee\"", "flange_link = \"link_ees\"", "iiwa_fixed.toml:7: "),
            ("flange_link", "flnge_link", "iiwa_fixed.toml:7: unknown key `flnge_link`: did you mean `flange_link`?"),
            ("pen_holder.urdf\"", "iiwa7.urdf\", base_link = \"link_0\"", "iiwa_fixed.toml:9: "),
            ("iiwa7.urdf", "iiwa8.urdf", "iiwa8.urdf"),
        ] {
            assert!(text.contains(from), "{from}");
            let error = Cell::parse(&text.replacen(from, to, 1), &robots().join("iiwa_fixed.toml")).unwrap_err();
            assert!(error.to_string().contains(say), "`{error}` should say `{say}`");
        }
    }

    #[test]
    fn two_arms_need_two_names() {
        let text = given("iiwa_fixed.toml");
        let arm = &text[text.find("[[arm]]").expect("arm")..text.find("[[furniture]]").expect("furniture")];
        let file = robots().join("two.toml");
        let error = Cell::parse(&format!("{text}\n{arm}"), &file).unwrap_err();
        assert!(error.to_string().contains("already"), "{error}");
        let cell = Cell::parse(&format!("{text}\n{arm}name = \"right\"\n"), &file).expect("loads");
        assert_eq!(cell.arms[1].model.name, "right");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]
        #[test]
        fn arbitrary_text_never_panics(text in ".{0,200}") {
            let _ = Cell::parse(&text, &robots().join("x.toml"));
        }
    }
}
