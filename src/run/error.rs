//! Why a run couldn't be done.
use std::path::PathBuf;
use std::sync::Arc;

use crate::art::ArtError;
use crate::art::depth::SemanticsError;
use crate::config::ConfigError;
use crate::drawing::DrawingError;
use crate::ink::InkError;
use crate::mesh::{MeshError, MeshFileError};
use crate::picture::PictureError;
use crate::plan::PlanError;
use crate::render::RenderError;
use crate::report::{OutputError, RecordFileError};
use crate::robot::RobotError;
use crate::run::reach::ReachError;
use crate::scan::ScanError;
use crate::scenario::ScenarioError;
use crate::surface::{FlattenError, MapError, SceneError, TruthError};
use crate::twin::TwinError;

/// Why a run couldn't be done. Each says in one line what is wrong and what would be right.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// An output can't be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The scenario can't be written out.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The artwork can't be drawn.
    #[error(transparent)]
    Drawing(#[from] DrawingError),
    /// The scene can't be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The true canvas can't be made.
    #[error(transparent)]
    Truth(#[from] TruthError),
    /// The robot can't be used.
    #[error(transparent)]
    Robot(#[from] RobotError),
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
    /// There is no reachability to tell of.
    #[error(transparent)]
    Reach(#[from] ReachError),
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
    /// The border of a scan has no extent.
    #[error("the border of the scanned canvas: {0}")]
    Skirt(#[source] MeshError),
    /// The scan gives no canvas.
    #[error("{}: {source}", cloud.as_ref().map_or("scan".into(), |c| c.display().to_string()))]
    Scan {
        /// The cloud's file; none when a simulated camera scanned.
        cloud: Option<PathBuf>,
        /// Why not.
        source: ScanError,
    },
    /// The cloud can't be read.
    #[error(transparent)]
    Cloud(#[from] MeshFileError),
    /// Probes found no canvas.
    #[error(
        "none of {probes} probes met the canvas between {} and {} mm over the sheet; widen `touch.range_mm`",
        range_mm[0],
        range_mm[1]
    )]
    NothingMet {
        /// Probes made.
        probes: usize,
        /// Where they sought, mm over the sheet's plane.
        range_mm: [f64; 2],
    },
    /// The touched heights make no surface.
    #[error("touched heights make no surface: {0}")]
    Touched(MeshError),
    /// A canvas known by touch alone has neither map nor plan before it is drawn on.
    #[error("with `belief = \"touch\"` the drawing is mapped and planned while it is drawn: run it to the end")]
    WhileDrawing,
    /// A pen can't be used.
    #[error(transparent)]
    Pen(#[from] ConfigError),
    /// The drawing doesn't fit on the canvas.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The canvas can't be flattened for the drawing.
    #[error(transparent)]
    Flatten(#[from] FlattenError),
    /// The drawing can't be planned.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The simulation failed.
    #[error(transparent)]
    Twin(#[from] TwinError),
    /// The flat picture can't be made.
    #[error(transparent)]
    Ink(#[from] InkError),
    /// A picture makes no strokes.
    #[error("{}: {source}", picture.display())]
    Art {
        /// The picture.
        picture: PathBuf,
        /// Why not.
        source: ArtError,
    },
    /// Segments or depth can't be used.
    #[error(transparent)]
    Semantics(#[from] SemanticsError),
    /// A model is asked for, but the program can't run one.
    #[error("{}: this program was built without ONNX models: build it with `--features onnx`, or give images", model.display())]
    NoModels {
        /// The model.
        model: PathBuf,
    },
    /// A picture can't be read or written.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A view can't be made.
    #[error(transparent)]
    View(#[from] RenderError),
    /// The record can't be written.
    #[error(transparent)]
    Record(#[from] RecordFileError),
    /// What trials share couldn't be made, as the first of them found.
    #[error("{0}")]
    Shared(Arc<RunError>),
    /// Figures can't be written as JSON.
    #[error("figures can't be written: {0}")]
    Json(#[from] serde_json::Error),
}
