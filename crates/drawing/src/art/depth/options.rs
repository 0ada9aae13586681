//! How a picture is painted in layers.
use crate::art::{ArtError, BrushFill};

/// How a picture is painted in layers.
#[derive(Clone, Debug, PartialEq)]
pub struct LayeredOptions {
    /// Most strokes.
    pub strokes: usize,
    /// Layers of depth in each segment.
    pub layers: usize,
    /// Share of a segment's strokes that may go into its outline, 0..=1.
    pub outline: f64,
    /// How much more a thing's difference from the picture counts than that of stuff, when strokes are shared out.
    pub emphasis: f64,
    /// Share of the strokes in each pass of the brushes, from the broadest to the finest; what one leaves goes to the
    /// next.
    pub passes: Vec<f64>,
    /// Longest stroke, in widths of the brush.
    pub length: f64,
    /// 1 follows the picture's form, less keeps to the stroke's own direction, 0 draws straight lines.
    pub curvature: f64,
    /// Compactness of the superpixels (see [`SlicOptions`](crate::art::depth::SlicOptions)).
    pub compactness: f32,
    /// Lines that fill a brush stroke: 1 sets them edge to edge, less leaves paper between.
    pub coverage: f64,
    /// How wide brush strokes are filled.
    pub fill: BrushFill,
    /// How much more making the canvas worse somewhere counts than making it better elsewhere; at least 1.
    pub harm: f64,
    /// Pictures of the growing painting.
    pub frames: usize,
}

impl Default for LayeredOptions {
    fn default() -> Self {
        Self {
            strokes: 1500,
            layers: 5,
            outline: 0.2,
            emphasis: 2.0,
            passes: vec![0.2, 0.35, 0.45, 1.0],
            length: 8.0,
            curvature: 0.8,
            compactness: 12.0,
            coverage: 1.0,
            fill: BrushFill::Bundle,
            harm: 2.0,
            frames: 8,
        }
    }
}

impl LayeredOptions {
    pub(super) fn check(&self) -> Result<(), ArtError> {
        let bad = |name, value, message: &str| Err(ArtError::BadOption { name, value, message: message.to_string() });
        let share = |v: f64| (0.0..=1.0).contains(&v);
        if self.strokes == 0 {
            return bad("strokes", 0.0, "at least 1 stroke is needed");
        }
        if !(1..=255).contains(&self.layers) {
            return bad("layers", self.layers as f64, "1 to 255 layers of depth");
        }
        if !share(self.outline) {
            return bad("outline", self.outline, "a share of the strokes lies in 0..=1");
        }
        if !(self.emphasis > 0.0 && self.emphasis <= 1e3) {
            return bad("emphasis", self.emphasis, "1 treats things like stuff; at most 1000");
        }
        if let Some(v) = self.passes.iter().find(|v| !share(**v)) {
            return bad("passes", *v, "a share of the strokes lies in 0..=1");
        }
        if !(1..=6).contains(&self.passes.len()) {
            return bad("passes", self.passes.len() as f64, "1 to 6 passes");
        }
        if !(0.5..=100.0).contains(&self.length) {
            return bad("length", self.length, "0.5 to 100 widths of the brush");
        }
        if !share(self.curvature) {
            return bad("curvature", self.curvature, "it lies in 0..=1");
        }
        if !(0.1..=1e3).contains(&self.compactness) {
            return bad("compactness", f64::from(self.compactness), "0.1 to 1000, commonly 10");
        }
        if !(1.0..=1e3).contains(&self.harm) {
            return bad("harm", self.harm, "1 treats worse like better; at most 1000");
        }
        if !(0.1..=4.0).contains(&self.coverage) {
            return bad("coverage", self.coverage, "0.1 to 4 lines to a line's width");
        }
        Ok(())
    }
}
