//! What surrounds an arm in truth.
use crate::pen::{LayerPen, NibSpring};
use crate::surface::Mapping;
use crate::truth::{TrueCanvas, Truth};

/// The true canvas, and the pens that draw on it.
pub struct TrueScene {
    /// The true canvas.
    pub canvas: TrueCanvas,
    /// Coulomb friction of the canvas; that of a pen on it is the geometric mean of both.
    pub friction: f64,
    /// How far the canvas gives way to the pen, m/N.
    pub compliance: f64,
    /// Map between the true canvas and the sheet.
    pub mapping: Box<dyn Mapping>,
    /// The pen of each layer.
    pub pens: Vec<LayerPen>,
}

impl TrueScene {
    /// What surrounds an arm in `truth`; `mapping` leads from its canvas to the sheet.
    pub fn new(truth: &Truth, mapping: Box<dyn Mapping>, pens: Vec<LayerPen>) -> Self {
        let (canvas, friction, compliance) = (truth.canvas().clone(), truth.friction(), truth.compliance());
        Self { canvas, friction, compliance, mapping, pens }
    }

    /// The nib of a layer's pen and the canvas as one spring: a canvas that gives way is in series with the nib.
    pub(super) fn spring(&self, layer: usize) -> NibSpring {
        let nib = &self.pens[layer].pen.spring;
        if self.compliance <= 0.0 {
            return *nib;
        }
        NibSpring { stiffness: nib.stiffness / (1.0 + nib.stiffness * self.compliance), ..*nib }
    }
}
