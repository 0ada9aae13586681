//! Scenarios: one TOML file says everything about a run.
//!
//! [`ScenarioFile`] is the file as typed; [`Scenario`] is what it means: every default filled in, every number in its
//! range, every path absolute and there. Numbers keep the units of the file, which stand in their names.

mod accept;
mod assets;
mod change;
mod check;
mod coverage;
mod drawing;
mod drive;
mod file;
mod localisation;
mod looking;
pub(crate) mod options;
mod overrides;
mod picture;
mod ranges;
mod resolve;
mod scan;
mod scan_options;
mod settings;
mod tools;
mod touch;
mod truth;

pub use accept::{Unmet, told_apart};
pub use assets::{Asset, AssetKind, Assets};
pub use change::ChangeSettings;
pub use coverage::{CircleSettings, CoverKind, CoverageSettings};
pub use drawing::{Artwork, DrawingSpec, Generator, Pattern, PictureSpec, parse_color};
pub use drive::DriveSettings;
pub use file::{CanvasFile, DrawingFile, Overlay, PatternFile, PatternKind, PenFile, ScenarioFile, Threshold};
pub use localisation::LocalisationSettings;
pub use looking::LookingSettings;
pub use overrides::Override;
pub use picture::{
    ColorSettings, EdgeSettings, HatchingSettings, InkOrder, LayeredDepthSettings, PainterStyle, PainterlySettings,
    Separation, StippleSettings, Style, TspSettings,
};
pub(crate) use ranges::check_ranges;
#[cfg(test)]
pub(crate) use ranges::unbounded;
pub use resolve::{CanvasSpec, PenSpec, Scenario, ScenarioError, Sketch};
pub use scan::{ScanCamera, ScanPose, ScanSettings};
pub use settings::{BeliefKind, Camera, ControlSettings, Fill, PlanSettings, RenderSettings, SimSettings, VIEWS};
pub use tools::{Hold, ToolSettings};
pub use touch::TouchSettings;
pub use truth::TruthSettings;

#[cfg(test)]
mod tests;
