//! The ink on a wall: where along it, how high, stroke by stroke.
use nalgebra::Point2;

use super::error::CoverError;
use crate::drawing::Drawing;
use crate::surface::{Mapping, SurfaceTarget, Wall};

/// Width of the columns that the wall is cut into, m.
pub(super) const COLUMN: f64 = 0.01;
/// Largest distance between two samples of a stroke, m.
const STEP: f64 = 0.005;

/// A place on a stroke.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Where in the stroke: 2.5 is half-way from the third point to the fourth.
    pub at: f64,
    /// On the wall.
    pub target: SurfaceTarget,
    /// Arc length of the wall, m.
    pub along: f64,
    /// Index of its column.
    pub column: usize,
}

/// A stroke as it lies on the wall.
#[derive(Clone, Debug)]
pub(super) struct InkStroke {
    /// Index of the layer.
    pub layer: usize,
    /// Index in the layer.
    pub stroke: usize,
    pub samples: Vec<Sample>,
    /// First and last column.
    pub low: usize,
    pub high: usize,
    /// The columns where it turns back, its ends included.
    pub turns: Vec<usize>,
}

/// All ink.
pub(super) struct Ink {
    pub strokes: Vec<InkStroke>,
    /// Lowest and highest ink of each column, m; `None` where there is none.
    pub columns: Vec<Option<[f64; 2]>>,
}

impl Ink {
    /// Samples a drawing on a wall.
    pub fn new(drawing: &Drawing, mapping: &dyn Mapping, wall: &Wall) -> Result<Self, CoverError> {
        let count = (wall.profile.length() / COLUMN).ceil().max(1.0) as usize;
        let mut columns: Vec<Option<[f64; 2]>> = vec![None; count];
        let mut strokes = Vec::new();
        for r in drawing.sequence() {
            let points = &drawing.layers[r.layer].strokes[r.stroke].points;
            let mut samples = Vec::new();
            for (at, sheet) in places(points) {
                let off = || CoverError::OffWall {
                    layer: drawing.layers[r.layer].name.clone(),
                    stroke: r.stroke,
                    at: [sheet.x, sheet.y],
                };
                let hit = mapping.to_surface(&sheet).ok_or_else(off)?;
                let (along, distance) = wall.profile.nearest(&hit.position.xy());
                if distance > 0.02 {
                    return Err(off());
                }
                let column = ((along / COLUMN) as usize).min(count - 1);
                let z = hit.position.z;
                let held = columns[column].get_or_insert([z, z]);
                *held = [held[0].min(z), held[1].max(z)];
                let target = SurfaceTarget { position: hit.position, normal: hit.normal, sheet, width: None };
                samples.push(Sample { at, target, along, column });
            }
            let Some(first) = samples.first() else { continue };
            let mut turns = vec![first.column];
            for s in &samples[1..] {
                let n = turns.len();
                if s.column == turns[n - 1] {
                    continue;
                }
                // going on in the same direction only moves the last turn
                let same = n >= 2 && (s.column > turns[n - 1]) == (turns[n - 1] > turns[n - 2]);
                if same { turns[n - 1] = s.column } else { turns.push(s.column) }
            }
            let low = samples.iter().map(|s| s.column).min().unwrap_or(0);
            let high = samples.iter().map(|s| s.column).max().unwrap_or(0);
            strokes.push(InkStroke { layer: r.layer, stroke: r.stroke, samples, low, high, turns });
        }
        if strokes.is_empty() { Err(CoverError::NoInk) } else { Ok(Self { strokes, columns }) }
    }

    /// The same ink, `raise` m higher.
    pub fn raised(&self, raise: f64) -> Self {
        let mut strokes = self.strokes.clone();
        strokes.iter_mut().flat_map(|s| &mut s.samples).for_each(|s| s.target.position.z += raise);
        Self { strokes, columns: self.columns.iter().map(|c| c.map(|h| h.map(|z| z + raise))).collect() }
    }

    /// First and last column with ink.
    pub fn ends(&self) -> (usize, usize) {
        let inked = |c: &Option<[f64; 2]>| c.is_some();
        (self.columns.iter().position(inked).unwrap_or(0), self.columns.iter().rposition(inked).unwrap_or(0))
    }

    /// The first column from `from` on that has ink.
    pub fn next(&self, from: usize) -> Option<usize> {
        (from..self.columns.len()).find(|c| self.columns[*c].is_some())
    }

    /// Lowest and highest ink, m.
    pub fn band(&self) -> [f64; 2] {
        let fold = self.columns.iter().flatten();
        fold.fold([f64::INFINITY, f64::NEG_INFINITY], |b, c| [b[0].min(c[0]), b[1].max(c[1])])
    }
}

/// The points of a stroke and enough between them.
fn places(points: &[Point2<f64>]) -> Vec<(f64, Point2<f64>)> {
    let mut places = Vec::new();
    for (i, p) in points.iter().enumerate() {
        if i > 0 {
            let before = points[i - 1];
            let n = ((p - before).norm() / STEP - 1e-9).ceil().max(1.0) as usize;
            let share = |k: usize| k as f64 / n as f64;
            places.extend((1..n).map(|k| ((i - 1) as f64 + share(k), before + (p - before) * share(k))));
        }
        places.push((i as f64, *p));
    }
    places
}
