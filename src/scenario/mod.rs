//! Scenarios: one TOML file says everything about a run.
//!
//! [`ScenarioFile`] is the file as typed; [`Scenario`] is what it means: every default filled in, every number in its
//! range, every path absolute and there. Numbers keep the units of the file, which stand in their names.

mod accept;
mod assets;
mod check;
mod file;
mod overrides;
mod resolve;
mod settings;

pub use accept::Unmet;
pub use assets::{Asset, AssetKind, Assets};
pub use file::{CanvasFile, DrawingFile, PatternFile, PatternKind, PenFile, ScenarioFile, Threshold};
pub use overrides::Override;
pub use resolve::{Artwork, CanvasSpec, DrawingSpec, Pattern, PenSpec, Scenario, ScenarioError};
pub use settings::{BeliefKind, Camera, ControlSettings, Fill, PlanSettings, RenderSettings, SimSettings, VIEWS};

#[cfg(test)]
mod tests;
