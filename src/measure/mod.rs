//! Figures of a run: from the drawn ink and the recorded force, never from the plan.

mod line;
mod segments;

pub use line::{LineFit, line_fit};
//! Figures of a run, from what was drawn and felt, never from the plan.

mod metrics;

pub use metrics::{
    ContactMetrics, DrawingMetrics, ImageMetrics, LineMetrics, MappingMetrics, MetricPath, Metrics, PlanFailure,
    PlanMetrics, RenderMetrics, ShapeMetrics, SimMetrics, ToolMetrics,
};
