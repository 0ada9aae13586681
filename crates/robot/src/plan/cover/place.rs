//! A cover as a value: where to stand, and what to draw from there.
use std::collections::BTreeMap;

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use super::options::BasePose;
use crate::drawing::{Drawing, InkLayer, Stroke, StrokeRef};

/// Nearer than this to a point of a stroke, a cut is at the point; in parts of a side.
const AT_POINT: f64 = 1e-9;

/// A stroke, or a part of one, that is drawn from one place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Index of the layer.
    pub layer: usize,
    /// Index of the stroke in its layer.
    pub stroke: usize,
    /// Where it begins: 2.5 is half-way from the third point of the stroke to the fourth.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// The cut that it begins at; absent at the stroke's own beginning.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_before: Option<usize>,
    /// The cut that it ends at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_after: Option<usize>,
}

impl Piece {
    /// The piece of `stroke`, its ends included.
    pub fn of(&self, stroke: &Stroke) -> Stroke {
        let (first, last) = (self.from.ceil() as usize, self.to.floor() as usize);
        let mut points = Vec::new();
        let mut widths = Vec::new();
        let mut take = |at: f64| {
            let (i, u) = (at.floor() as usize, at.fract());
            let next = (i + 1).min(stroke.points.len() - 1);
            points.push(stroke.points[i] + (stroke.points[next] - stroke.points[i]) * u);
            if let Some(w) = stroke.width_at(i) {
                widths.push(w + (stroke.width_at(next).unwrap_or(w) - w) * u);
            }
        };
        if (first as f64) - self.from > AT_POINT {
            take(self.from);
        }
        for i in first..=last.min(stroke.points.len() - 1) {
            take(i as f64);
        }
        if self.to - last as f64 > AT_POINT {
            take(self.to);
        }
        Stroke { points, widths }
    }
}

/// A place to stand at, and all that is drawn from there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Where the base stands.
    pub pose: BasePose,
    /// Arc lengths of the wall between which the arm reaches all ink, m.
    pub stretch: [f64; 2],
    /// What is drawn from here, ink by ink, in the drawing's order.
    pub pieces: Vec<Piece>,
}

/// What hides a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CutKind {
    /// Another stroke begins or ends there.
    Lift,
    /// The line turns there.
    Corner,
    /// Another stroke crosses there.
    Crossing,
    /// Nothing.
    Line,
}

/// Where a stroke passes from one place to another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cut {
    /// Number of the cut, from 0.
    pub id: usize,
    /// Index of the layer.
    pub layer: usize,
    /// Index of the stroke in its layer.
    pub stroke: usize,
    /// Where in the stroke, as [`Piece::from`].
    pub at: f64,
    /// The same on the sheet, m.
    pub sheet: Point2<f64>,
    /// Arc length of the wall there, m.
    pub along: f64,
    /// Index of the place that draws up to it, and of the one that goes on.
    pub places: [usize; 2],
    /// What hides it.
    pub kind: CutKind,
}

/// Where to stand and what to draw from where: drive to each place in turn, and draw its pieces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// `map`, `circles` or `poses`.
    pub method: String,
    /// How far the drawing is moved up its wall for it, m.
    #[serde(default)]
    pub raise: f64,
    /// In the order of drawing.
    pub places: Vec<Place>,
    /// In the order of the drawing's strokes.
    pub cuts: Vec<Cut>,
    /// The way from where the base starts to the first place, poses a straight motion apart; empty where no start was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub way_in: Vec<BasePose>,
    /// The ways between places: from each to the next, poses a straight motion apart.
    pub drives: Vec<Vec<BasePose>>,
    /// Arc lengths at which seams are straight, m; empty where they are free.
    pub borders: Vec<f64>,
    /// Whether no cover over the same candidates has fewer places.
    pub optimal: bool,
    /// No cover over the candidates has fewer places than this; 0 where that wasn't asked.
    pub bound: usize,
    /// Times that it was solved, until all could be planned.
    pub rounds: usize,
    /// Wall-clock time of the solver, s.
    pub solver_s: f64,
}

impl Coverage {
    /// Strokes that are cut.
    pub fn strokes_cut(&self) -> usize {
        let mut cut: Vec<(usize, usize)> = self.cuts.iter().map(|c| (c.layer, c.stroke)).collect();
        cut.dedup();
        cut.len()
    }

    /// Length of all drives between places, m.
    pub fn drive(&self) -> f64 {
        let length = |way: &Vec<BasePose>| way.windows(2).map(|w| (w[1].center() - w[0].center()).norm()).sum::<f64>();
        // an empty sum is -0
        self.drives.iter().map(length).sum::<f64>() + 0.0
    }

    /// `drawing` cut into what is drawn in one go, and for each place its strokes of it. Strokes of a layer follow the places.
    pub fn cut(&self, drawing: &Drawing) -> (Drawing, Vec<Vec<StrokeRef>>) {
        let places = self.numbered().into_iter().map(|pieces| pieces.into_iter().map(|(_, r)| r).collect());
        (drawn(drawing, self.places.iter().flat_map(|p| &p.pieces)), places.collect())
    }

    /// For each cut, by its number, the strokes of the cut drawing that end and begin at it.
    pub fn ends(&self) -> Vec<[StrokeRef; 2]> {
        let none = StrokeRef { layer: 0, stroke: usize::MAX };
        let mut ends = vec![[none; 2]; self.cuts.len()];
        for (piece, own) in self.numbered().into_iter().flatten() {
            for (end, cut) in [piece.cut_after, piece.cut_before].into_iter().enumerate() {
                if let Some(cut) = cut {
                    ends[cut][end] = own;
                }
            }
        }
        ends
    }

    /// What of `drawing` is drawn from place `index`: the layers of the drawing, with its pieces as strokes in drawing order.
    pub fn part(&self, drawing: &Drawing, index: usize) -> Drawing {
        drawn(drawing, &self.places[index].pieces)
    }

    /// The pieces of each place, with their strokes in the cut drawing.
    fn numbered(&self) -> Vec<Vec<(Piece, StrokeRef)>> {
        let mut counts = BTreeMap::<usize, usize>::new();
        let mut number = |piece: &Piece| {
            let count = counts.entry(piece.layer).or_default();
            *count += 1;
            (*piece, StrokeRef { layer: piece.layer, stroke: *count - 1 })
        };
        self.places.iter().map(|p| p.pieces.iter().map(&mut number).collect()).collect()
    }
}

/// The layers of a drawing with these pieces of it as strokes.
fn drawn<'a>(drawing: &Drawing, pieces: impl IntoIterator<Item = &'a Piece>) -> Drawing {
    let mut layers: Vec<InkLayer> =
        drawing.layers.iter().map(|l| InkLayer { strokes: Vec::new(), ..l.clone() }).collect();
    for piece in pieces {
        layers[piece.layer].strokes.push(piece.of(&drawing.layers[piece.layer].strokes[piece.stroke]));
    }
    Drawing { layers, order: Vec::new(), ..*drawing }
}

/// Whether the inks `used` at a place are drawn the other way round, as the last of them is in the holder already.
pub fn turned_round(used: &[usize], pen: Option<usize>) -> bool {
    used.len() > 1 && pen == used.last().copied()
}
