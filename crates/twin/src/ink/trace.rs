//! The ink trace: what the pen left on the true surface, as vector data. The primary product of a run.
use nalgebra::{Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::drawing::StrokeId;
use crate::math::{Digest, Rgb};

/// One point of an inked line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InkPoint {
    /// Contact point on the true surface, m, world.
    pub position: Point3<f64>,
    /// Smooth unit normal there.
    pub normal: Vector3<f64>,
    /// The same point on the sheet, m.
    pub sheet: Point2<f64>,
    /// Width of the line, m.
    pub width: f64,
    /// Optical density of the deposit in units of the ink's full density; 1 is a normal line, 0 is dry.
    pub density: f64,
    /// Time of the deposit, s.
    pub time: f64,
}

/// An unbroken inked line: from first contact to loss of contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InkStroke {
    /// Index into [`InkTrace::inks`].
    pub ink: u32,
    /// The stroke that was being drawn; `None` is ink where none was desired.
    pub stroke: Option<StrokeId>,
    /// Index of the arm that drew it.
    pub arm: u32,
    /// Points in order of drawing, at most a small fraction of the width apart. One point is a dot.
    pub points: Vec<InkPoint>,
}

/// One of the inks in a trace.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceInk {
    /// Name of the ink.
    pub name: String,
    /// Colour of a full-density line on white paper, sRGB 0..=255.
    pub color: Rgb,
}

/// Everything drawn in a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InkTrace {
    /// The inks.
    pub inks: Vec<TraceInk>,
    /// Inked lines in the order in which they were begun.
    pub strokes: Vec<InkStroke>,
}

impl InkStroke {
    /// Length on the surface, m.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum()
    }
}

impl InkTrace {
    /// Adds every bit of the trace to a digest.
    pub fn digest(&self, digest: &mut Digest) {
        for s in &self.strokes {
            digest.bytes(&s.ink.to_le_bytes()).bytes(&s.arm.to_le_bytes());
            if let Some(id) = s.stroke {
                digest.bytes(&id.layer.to_le_bytes()).bytes(&id.index.to_le_bytes());
            }
            for p in &s.points {
                digest.numbers(p.position.coords.iter()).numbers(p.normal.iter()).numbers(p.sheet.coords.iter());
                digest.numbers([&p.width, &p.density, &p.time]);
            }
        }
    }
}
