//! The gripper on an arm's flange, and the docks that its pen tools stand in, as a robot file gives them.
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::cell::PoseFile;
use crate::math::Pose;

/// Kinds of gripper that are known.
const KINDS: [&str; 1] = ["robotiq_3f"];

/// A three-finger gripper, and where its tools are.
#[derive(Clone, Debug)]
pub struct Gripper {
    /// File of the pen tool and its dock; one design for all docks.
    pub tool: PathBuf,
    /// Pose of the tool seated in each dock, world: x away from the palm that comes for it, z up.
    pub docks: Vec<Pose>,
    /// Whether a pen stands in each dock.
    pub full: Vec<bool>,
}

/// `[arm.gripper]` as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GripperFile {
    kind: String,
    /// Relative to the robot file.
    tool: PathBuf,
    #[serde(default)]
    docks: Vec<DockFile>,
}

/// A dock as written: where, and whether there is no pen in it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct DockFile {
    xyz_mm: [f64; 3],
    #[serde(default)]
    rpy_deg: [f64; 3],
    #[serde(default)]
    empty: bool,
}

impl DockFile {
    fn place(&self) -> PoseFile {
        PoseFile { xyz_mm: self.xyz_mm, rpy_deg: self.rpy_deg }
    }
}

impl GripperFile {
    /// The gripper, paths seen from `folder`; else the key that is wrong, and why.
    pub(super) fn read(&self, folder: &Path) -> Result<Gripper, (&'static str, String)> {
        if !KINDS.contains(&self.kind.as_str()) {
            return Err(("kind", format!("no gripper `{}`: known is {}", self.kind, KINDS.join(", "))));
        }
        if self.docks.iter().any(|d| !d.place().is_finite()) {
            return Err(("docks", "every dock needs a pose of finite numbers".into()));
        }
        Ok(Gripper {
            tool: folder.join(&self.tool),
            docks: self.docks.iter().map(|d| d.place().pose()).collect(),
            full: self.docks.iter().map(|d| !d.empty).collect(),
        })
    }
}
