//! Figures of a run, from what was drawn and felt, never from the plan.

mod base;
mod belief;
mod figures;
mod heights;
mod laid;
mod line;
mod look;
mod metrics;
mod paths;
mod seam;
mod segments;
mod shape;
mod tool_changes;
mod tools;
mod touchable;
mod width;

pub use base::BaseMetrics;
pub use heights::StrokeHeights;
pub use laid::{Laid, LaidStroke, laid_strokes};
pub use line::{LineFit, line_fit, tip_error};
pub use look::LookMetrics;
pub use metrics::{
    BeliefMetrics, ContactMetrics, CoverageMetrics, DrawingMetrics, ImageMetrics, LayerMetrics, LineMetrics,
    MappingMetrics, Metrics, PlanFailure, PlanMetrics, RenderMetrics, ShapeMetrics, SimMetrics, TruthMetrics,
};
pub use paths::MetricPath;
pub use seam::{Seam, SeamMetrics, seams};
pub use shape::{GridShape, SideErrors, grid_shape, side_errors};
pub use tool_changes::tool_metrics;
pub use tools::{ScheduleMetrics, ToolMetrics, ToolPose, ToolStages};
pub use touchable::Touchable;
pub use width::width_error;
