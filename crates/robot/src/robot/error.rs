//! Why a robot can't be used.
use std::path::PathBuf;

use crate::diagnostic::ConfigError;
use crate::mesh::MeshError;

/// A robot description that can't be used, with the file and line to look at and what would be right.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RobotError {
    /// A robot of several arms, and nobody said which draws.
    #[error("{robot} has the arms {arms}: say which of them draws, as `arm = \"NAME\"`")]
    WhichArm {
        /// Name of the robot.
        robot: String,
        /// Names of its arms.
        arms: String,
    },
    /// The robot has no arm of that name.
    #[error("{robot} has no arm `{name}`, but {arms}")]
    NoSuchArm {
        /// Name of the robot.
        robot: String,
        /// The name asked for.
        name: String,
        /// Names of its arms.
        arms: String,
    },
    /// An arm that stands still makes no solid.
    #[error("arm {arm}: {source}")]
    StandingArm {
        /// Its name.
        arm: String,
        /// Why not.
        source: MeshError,
    },
    /// A thing beside the robot makes no solid.
    #[error("furniture {index} of {robot}: {source}")]
    Furniture {
        /// Name of the robot.
        robot: String,
        /// Index of the thing in the robot file.
        index: usize,
        /// Why not.
        source: MeshError,
    },
    /// A file can't be read at all.
    #[error("{}: {source}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The text is not well-formed XML, or not the XML of a robot.
    #[error("{}:{line}: {message}", file.display())]
    Xml {
        /// The file.
        file: PathBuf,
        /// 1-based line.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// An element is there but wrong, or lacks something that physics needs.
    #[error("{}:{line}: {element}: {message}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// 1-based line of the element.
        line: usize,
        /// The element, such as "link `link_3`".
        element: String,
        /// What is wrong and what would be right.
        message: String,
    },
    /// An element is valid URDF that a serial arm of this program can't honour.
    #[error("{}:{line}: {element} can't be honoured: {reason}", file.display())]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// 1-based line of the element.
        line: usize,
        /// The element, such as "joint `finger_1`".
        element: String,
        /// Why, and what would do instead.
        reason: String,
    },
    /// The options name a link or joint that the file doesn't have.
    #[error("{}: there is no {kind} `{name}`{hint}", file.display())]
    NoSuchName {
        /// The URDF.
        file: PathBuf,
        /// The option: `base_link`, `tip_link` or `freeze`.
        option: &'static str,
        /// "link" or "joint".
        kind: &'static str,
        /// The name that was asked for.
        name: String,
        /// "; did you mean ...?", or nothing.
        hint: String,
    },
    /// A mesh that a link refers to can't be used.
    #[error("{}:{line}: {element}: mesh `{mesh}`: {reason}", file.display())]
    Mesh {
        /// The URDF.
        file: PathBuf,
        /// 1-based line of the link.
        line: usize,
        /// The link.
        element: String,
        /// The mesh as the URDF names it.
        mesh: String,
        /// Why.
        reason: String,
    },
    /// A robot file (TOML) is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
}
