//! The name of a stroke in what is felt, drawn and recorded.
use serde::{Deserialize, Serialize};

/// Which stroke of the drawing the arm was busy with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct StrokeId {
    /// Index of the layer (ink).
    pub layer: u32,
    /// Index of the stroke within the layer.
    pub index: u32,
}
