//! Why a run couldn't be done.
use std::path::PathBuf;
use std::sync::Arc;

use crate::artwork::{ArtworkError, PartError};
use crate::camera::ScanError;
use crate::canvas::CanvasError;
use crate::cover::CoverageError;
use crate::diagnostic::ConfigError;
use crate::exec::{ExecError, JournalError};
use crate::ink::InkError;
use crate::inputs::InputError;
use crate::mesh::{MeshError, MeshFileError};
use crate::picture::PictureError;
use crate::plan::PlanError;
use crate::render::RenderError;
use crate::report::{OutputError, RecordFileError};
use crate::robot::RobotError;
use crate::scenario::ScenarioError;
use crate::skill::{KitError, PolicyError};
use crate::surface::MapError;
use crate::truth::TruthError;
use crate::twin::TwinError;

/// Why a run couldn't be done. Each says in one line what is wrong and what would be right.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// A file that the scenario names can't be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The base would have to drive.
    #[error(
        "{what} is for a robot that drives from place to place, and {robot} has no base: take robot = \"iiwa_ridgeback\""
    )]
    NoBase {
        /// What asks for it.
        what: &'static str,
        /// Name of the robot.
        robot: String,
    },
    /// A wall wider than a robot that stands can draw on.
    #[error(
        "{robot} stands before the wall and has no base to drive along it, as robot = \"iiwa_ridgeback\" has: {source}"
    )]
    WallTooWide {
        /// Name of the robot.
        robot: String,
        /// What it can't draw.
        source: PlanError,
    },
    /// A base that drives, and something that goes with a robot that stands.
    #[error("{what} doesn't go with a base that drives from place to place")]
    NotWhileDriving {
        /// What.
        what: &'static str,
    },
    /// The base has no places.
    #[error(transparent)]
    Coverage(Box<CoverageError>),
    /// There is no canvas to draw on.
    #[error(transparent)]
    Canvas(#[from] CanvasError),
    /// An output can't be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The scenario can't be written out.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The artwork can't be drawn.
    #[error(transparent)]
    Artwork(#[from] ArtworkError),
    /// The true canvas can't be made.
    #[error(transparent)]
    Truth(#[from] TruthError),
    /// The robot can't be used.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// An arm can't change tools.
    #[error(transparent)]
    Kit(#[from] KitError),
    /// A tool or a dock makes no solid.
    #[error("the pen tool: {0}")]
    Tool(#[source] MeshError),
    /// The next task can't be found.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// The run can't go on.
    #[error(transparent)]
    Exec(#[from] ExecError),
    /// What is done can't be kept.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The part that is asked for isn't there.
    #[error(transparent)]
    Part(#[from] PartError),
    /// No arm that is to draw has a gripper.
    #[error("`[tools]` needs arms with a gripper, and {robot} has none that draws; give it `[arm.gripper]`")]
    NoGripper {
        /// Name of the robot.
        robot: String,
    },
    /// A robot whose arms have empty hands.
    #[error("arm {arm} has a gripper and no pen: say `[tools]` to let it fetch one")]
    EmptyHand {
        /// Name of the arm.
        arm: String,
    },
    /// More inks than pens.
    #[error(
        "{inks} inks, but in the docks of the arms that draw stand only {pens} pens; use fewer inks, or give the robot more"
    )]
    TooManyInks {
        /// Inks that are drawn with.
        inks: usize,
        /// Pens in the docks of all arms that draw.
        pens: usize,
    },
    /// `tools.arms` names an arm that doesn't draw.
    #[error("tools.arms gives ink {ink} to arm {arm}, which doesn't draw; arms that do: {arms}")]
    ArmOfInk {
        /// The ink.
        ink: String,
        /// The arm.
        arm: String,
        /// Names of those that draw.
        arms: String,
    },
    /// Two arms would come too near to each other.
    #[error(
        "the arms would come within {distance_mm:.1} mm of each other, {time:.1} s into the run, nearer than tools.margin_mm = {margin_mm}"
    )]
    TooNear {
        /// Least distance, mm.
        distance_mm: f64,
        /// When, s.
        time: f64,
        /// What is desired, mm.
        margin_mm: f64,
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
    /// A canvas known by touch alone has neither map nor plan before it is drawn on.
    #[error("with `belief = \"touch\"` the drawing is mapped and planned while it is drawn: run it to the end")]
    WhileDrawing,
    /// A base that drives plans where it comes to stand.
    #[error("a base plans where it comes to stand: run it to the end, or see `calamus cover` for its places")]
    WhileDriving,
    /// A pen tool can't be used.
    #[error(transparent)]
    Pen(#[from] ConfigError),
    /// The drawing doesn't fit on the canvas.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The drawing can't be planned.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The simulation failed.
    #[error(transparent)]
    Twin(#[from] TwinError),
    /// The flat picture can't be made.
    #[error(transparent)]
    Ink(#[from] InkError),
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
    #[error(transparent)]
    Shared(Arc<RunError>),
    /// Figures can't be written as JSON.
    #[error("figures can't be written: {0}")]
    Json(#[from] serde_json::Error),
}

impl From<CoverageError> for RunError {
    fn from(error: CoverageError) -> Self {
        Self::Coverage(Box::new(error))
    }
}
