//! Which pen draws what.
use super::PenModel;

/// The pen that draws a layer.
#[derive(Clone, Debug)]
pub struct LayerPen {
    /// The pen.
    pub pen: PenModel,
    /// Name of its ink, as events tell it.
    pub ink: String,
}
