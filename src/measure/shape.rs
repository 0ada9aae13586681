//! The shape of drawn patterns, from the ink on the true surface: the crossings of a grid, its sides and corners, and the lengths of sides.
use std::collections::BTreeMap;

use nalgebra::{Point2, Point3, Vector3};

use crate::drawing::Drawing;
use crate::ink::InkTrace;
use crate::math::stats;
use crate::surface::SurfaceDrawing;

/// Lines of a grid nearer to each other than this on the flat sheet are one line, m.
const SAME_LINE: f64 = 1e-4;
/// Points of a drawn line nearer than this to the one before are left out, m, so that its jitter adds no length.
const SPACING: f64 = 3e-4;
/// A line without ink for longer than this has a gap; a crossing in a gap is missing, m.
const GAP: f64 = 2e-3;
/// Lines that end this short of each other still have a corner there, m.
const REACH: f64 = 2e-3;
/// The direction of a line at a crossing is that from so far before to so far after it, m.
const TANGENT: f64 = 2e-3;
/// A stroke that turns by less than this has no corner there, rad.
const CORNER: f64 = 0.1;
/// A corner is looked for in the ink within this of its place on the sheet, or half a side where that is longer, m.
const CORNER_REACH: f64 = 3e-3;
/// Sides shorter than this on the flat sheet aren't measured, m.
const SHORT: f64 = 2e-3;

/// How a drawn grid deviates from the desired one on the nominal surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridShape {
    /// Mean relative deviation of the ratio of two adjacent sides of a cell, over all cells and their four corners.
    pub aspect_deviation: f64,
    /// Mean deviation of the angle between two sides of a cell, rad, over all cells and their four corners.
    pub angle_deviation: f64,
    /// Crossings of the desired grid.
    pub crossings: usize,
    /// Those that the ink doesn't have.
    pub missing: usize,
    /// Relative errors of the cells' sides against their flat length.
    pub sides: Option<SideErrors>,
}

/// Relative errors of drawn sides against their desired flat lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SideErrors {
    /// Mean.
    pub mean: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Largest.
    pub max: f64,
    /// Sides that were measured.
    pub sides: usize,
}

impl SideErrors {
    fn of(errors: &[f64]) -> Option<Self> {
        Some(Self {
            mean: stats::mean(errors)?,
            p95: stats::quantile(errors, 0.95)?,
            max: errors.iter().copied().fold(0.0, f64::max),
            sides: errors.len(),
        })
    }
}

/// A point of a line: on the surface, and on the sheet.
type Place = (Point3<f64>, Point2<f64>);

/// Compares a drawn grid with the desired one (`desired`: laid on the nominal surface). Sides are measured along the drawn lines on the
/// true surface; the corners are the crossings of the drawn lines. `None` when the drawing is no grid, or when the ink has no whole cell.
pub fn grid_shape(drawing: &Drawing, desired: &SurfaceDrawing, ink: &InkTrace) -> Option<GridShape> {
    let levels = Levels::of(drawing)?;
    let desired = Crossings::of(&levels, &levels.lines(drawing, desired_parts(desired)));
    let drawn = Crossings::of(&levels, &levels.lines(drawing, ink_parts(ink)));
    let [columns, rows] = levels.0.each_ref().map(Vec::len);
    let (mut aspects, mut angles, mut sides) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..rows - 1 {
        for j in 0..columns - 1 {
            let (Some(w), Some(d)) = (desired.cell(i, j), drawn.cell(i, j)) else { continue };
            for k in 0..4 {
                let ratio = |c: &Cell| c.sides[k] / c.sides[(k + 1) % 4];
                aspects.push((ratio(&d) / ratio(&w) - 1.0).abs());
                angles.push((d.angles[k] - w.angles[k]).abs());
            }
        }
    }
    let [x, y] = &levels.0;
    for i in 0..rows {
        for j in 0..columns {
            if let (true, Some(along)) = (j + 1 < columns, drawn.along(i, j)) {
                sides.push((along / (x[j + 1] - x[j]) - 1.0).abs());
            }
            if let (true, Some(up)) = (i + 1 < rows, drawn.up(i, j)) {
                sides.push((up / (y[i + 1] - y[i]) - 1.0).abs());
            }
        }
    }
    Some(GridShape {
        aspect_deviation: stats::mean(&aspects)?,
        angle_deviation: stats::mean(&angles)?,
        crossings: rows * columns,
        missing: drawn.at.iter().filter(|c| c.is_none()).count(),
        sides: SideErrors::of(&sides),
    })
}

/// Every straight side of the artwork, from corner to corner, as drawn, against its flat length. Corners are found in the ink by
/// their place on the sheet, in the order of the stroke. `None` when no side can be measured.
pub fn side_errors(drawing: &Drawing, ink: &InkTrace) -> Option<SideErrors> {
    let mut drawn: BTreeMap<(usize, usize), Vec<Place>> = BTreeMap::new();
    for (layer, index, part) in ink_parts(ink) {
        drawn.entry((layer, index)).or_default().extend(part);
    }
    let mut errors = Vec::new();
    for (layer, l) in drawing.layers.iter().enumerate() {
        for (index, stroke) in l.strokes.iter().enumerate() {
            let Some(places) = drawn.get(&(layer, index)) else { continue };
            let line = Line::new(places.clone());
            let corners = corners(&stroke.points);
            let mut last: Option<(usize, f64)> = None;
            let mut from = 0;
            for (k, (corner, way)) in corners.iter().enumerate() {
                let next = corners.get(k + 1).map_or(*way, |c| c.1);
                let reach = CORNER_REACH.max(0.5 * way.min(next));
                // a stroke that ends where it began has its first and its last corner in one place
                let least = if last.is_some() { 0.5 * way } else { 0.0 };
                let found = line.nearest(from, corner, [least, 2.0 * way + 2.0 * reach], reach);
                if let (Some(at), Some((before, s))) = (found, last)
                    && before + 1 == k
                    && *way >= SHORT
                {
                    errors.push(((line.length[at] - s) / way - 1.0).abs());
                }
                if let Some(at) = found {
                    from = at;
                    last = Some((k, line.length[at]));
                }
            }
        }
    }
    SideErrors::of(&errors)
}

/// The corners of a stroke, its ends included, each with the length of the way from the corner before (of the first: to the next).
fn corners(points: &[Point2<f64>]) -> Vec<(Point2<f64>, f64)> {
    let mut out: Vec<(Point2<f64>, f64)> = Vec::new();
    let mut way = 0.0;
    for (k, p) in points.iter().enumerate() {
        if k > 0 {
            way += (p - points[k - 1]).norm();
        }
        let inner = k > 0 && k + 1 < points.len();
        if inner && (p - points[k - 1]).angle(&(points[k + 1] - p)) < CORNER {
            continue;
        }
        out.push((*p, way));
        way = 0.0;
    }
    if out.len() > 1 {
        out[0].1 = out[1].1;
    }
    out
}

/// The unbroken parts of desired strokes: layer, stroke, places.
fn desired_parts(desired: &SurfaceDrawing) -> Vec<(usize, usize, Vec<Place>)> {
    let mut parts = Vec::new();
    for (layer, l) in desired.layers.iter().enumerate() {
        for s in &l.strokes {
            parts.push((layer, s.index, s.targets.iter().map(|t| (t.position, t.sheet)).collect()));
        }
    }
    parts
}

/// The unbroken parts of drawn strokes, in order of drawing.
fn ink_parts(ink: &InkTrace) -> Vec<(usize, usize, Vec<Place>)> {
    let part = |s: &crate::ink::InkStroke| {
        let id = s.stroke?;
        Some((id.layer as usize, id.index as usize, s.points.iter().map(|p| (p.position, p.sheet)).collect()))
    };
    ink.strokes.iter().filter_map(part).collect()
}

/// A line on the surface, by length along it.
#[derive(Default)]
struct Line {
    places: Vec<Place>,
    /// Way from the beginning to each place, m.
    length: Vec<f64>,
}

impl Line {
    fn new(all: Vec<Place>) -> Self {
        let (mut places, mut length): (Vec<Place>, Vec<f64>) = (Vec::new(), Vec::new());
        let count = all.len();
        for (i, p) in all.into_iter().enumerate() {
            let Some(last) = places.last() else {
                places.push(p);
                length.push(0.0);
                continue;
            };
            let step = (p.0 - last.0).norm();
            if step >= SPACING || (i + 1 == count && step > 0.0) {
                length.push(length[length.len() - 1] + step);
                places.push(p);
            }
        }
        Self { places, length }
    }

    /// The place at a length, beyond the ends the end.
    fn at(&self, s: f64) -> Point3<f64> {
        let i = self.length.partition_point(|l| *l < s).clamp(1, self.length.len() - 1);
        let share = ((s - self.length[i - 1]) / (self.length[i] - self.length[i - 1])).clamp(0.0, 1.0);
        self.places[i - 1].0 + (self.places[i].0 - self.places[i - 1].0) * share
    }

    /// The direction at a length.
    fn tangent(&self, s: f64) -> Vector3<f64> {
        let end = self.length[self.length.len() - 1];
        self.at((s + TANGENT).min(end)) - self.at((s - TANGENT).max(0.0))
    }

    /// The place nearest to a place on the sheet whose way from place `from` is within `window` (m), and no farther off than `reach`.
    fn nearest(&self, from: usize, sheet: &Point2<f64>, window: [f64; 2], reach: f64) -> Option<usize> {
        let start = *self.length.get(from)?;
        let mut best: Option<(f64, usize)> = None;
        for i in from..self.places.len() {
            if self.length[i] > start + window[1] {
                break;
            }
            if self.length[i] < start + window[0] {
                continue;
            }
            let off = (self.places[i].1 - sheet).norm();
            if off <= reach && best.is_none_or(|(b, _)| off < b) {
                best = Some((off, i));
            }
        }
        best.map(|b| b.1)
    }
}

/// x of the upright lines and y of the level lines of a flat grid, each rising.
struct Levels([Vec<f64>; 2]);

/// 0 for a piece that runs upright (one x), 1 for a level one, and its place.
fn level(a: &Point2<f64>, b: &Point2<f64>) -> Option<(usize, f64)> {
    let d = (b - a).abs();
    if d.x < SAME_LINE && d.y > SAME_LINE {
        Some((0, 0.5 * (a.x + b.x)))
    } else if d.y < SAME_LINE && d.x > SAME_LINE {
        Some((1, 0.5 * (a.y + b.y)))
    } else {
        None
    }
}

impl Levels {
    /// `None` when the drawing has other lines than upright and level ones, or fewer than two of either.
    fn of(drawing: &Drawing) -> Option<Self> {
        let mut all = [Vec::new(), Vec::new()];
        for w in drawing.layers.iter().flat_map(|l| &l.strokes).flat_map(|s| s.points.windows(2)) {
            let (axis, x) = level(&w[0], &w[1])?;
            all[axis].push(x);
        }
        for x in &mut all {
            x.sort_by(f64::total_cmp);
            x.dedup_by(|b, a| (*b - *a).abs() < SAME_LINE);
        }
        (all[0].len() > 1 && all[1].len() > 1).then_some(Self(all))
    }

    fn index(&self, axis: usize, x: f64) -> usize {
        let off = |i: &usize| (self.0[axis][*i] - x).abs();
        (0..self.0[axis].len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    }

    /// The lines of the grid, upright ones first, each from left to right or from below upwards.
    fn lines(&self, drawing: &Drawing, parts: Vec<(usize, usize, Vec<Place>)>) -> [Vec<Line>; 2] {
        let mut pieces: [Vec<Vec<Vec<Place>>>; 2] = self.0.each_ref().map(|x| vec![Vec::new(); x.len()]);
        for (layer, index, places) in parts {
            let Some(stroke) = drawing.layers.get(layer).and_then(|l| l.strokes.get(index)) else { continue };
            // strokes that were joined at corners run along several lines: each place belongs to the nearest
            let mut run: Option<(usize, usize)> = None;
            for place in places {
                let off = |w: &[Point2<f64>]| off_segment(&w[0], &w[1], &place.1);
                let Some(w) = stroke.points.windows(2).min_by(|a, b| off(a).total_cmp(&off(b))) else { continue };
                let Some((axis, x)) = level(&w[0], &w[1]) else { continue };
                let own = (axis, self.index(axis, x));
                let line = &mut pieces[own.0][own.1];
                if run != Some(own) || line.is_empty() {
                    line.push(Vec::new());
                    run = Some(own);
                }
                if let Some(piece) = line.last_mut() {
                    piece.push(place);
                }
            }
        }
        let mut axis = 0;
        pieces.map(|lines| {
            // upright lines run along y, level ones along x
            let along = 1 - axis;
            axis += 1;
            let line = |mut pieces: Vec<Vec<Place>>| {
                for p in &mut pieces {
                    if p.last().zip(p.first()).is_some_and(|(b, a)| b.1[along] < a.1[along]) {
                        p.reverse();
                    }
                }
                pieces.sort_by(|a, b| a[0].1[along].total_cmp(&b[0].1[along]));
                Line::new(pieces.concat())
            };
            lines.into_iter().map(line).collect()
        })
    }
}

fn off_segment(a: &Point2<f64>, b: &Point2<f64>, p: &Point2<f64>) -> f64 {
    let d = b - a;
    let share = ((p - a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
    (a + d * share - p).norm()
}

/// Where a level line crosses an upright one: how far along each.
#[derive(Clone, Copy)]
struct Crossing {
    along: f64,
    up: f64,
    angle: f64,
}

/// The sides of a cell, from below counter-clockwise, and its angles, each between a side and the next.
struct Cell {
    sides: [f64; 4],
    angles: [f64; 4],
}

/// The crossings of a grid, row by row from below.
struct Crossings {
    columns: usize,
    at: Vec<Option<Crossing>>,
}

impl Crossings {
    fn of(levels: &Levels, [upright, level]: &[Vec<Line>; 2]) -> Self {
        let columns = upright.len();
        let mut at = Vec::with_capacity(columns * level.len());
        for (i, h) in level.iter().enumerate() {
            for (j, v) in upright.iter().enumerate() {
                at.push(crossing(h, levels.0[0][j], v, levels.0[1][i], levels.spacing()));
            }
        }
        Self { columns, at }
    }

    fn get(&self, i: usize, j: usize) -> Option<Crossing> {
        if j >= self.columns {
            return None;
        }
        self.at.get(i * self.columns + j).copied().flatten()
    }

    /// Length of the level side from crossing (i, j) to the right.
    fn along(&self, i: usize, j: usize) -> Option<f64> {
        Some(self.get(i, j + 1)?.along - self.get(i, j)?.along).filter(|l| *l > 0.0)
    }

    /// Length of the upright side from crossing (i, j) upwards.
    fn up(&self, i: usize, j: usize) -> Option<f64> {
        Some(self.get(i + 1, j)?.up - self.get(i, j)?.up).filter(|l| *l > 0.0)
    }

    fn cell(&self, i: usize, j: usize) -> Option<Cell> {
        let sides = [self.along(i, j)?, self.up(i, j + 1)?, self.along(i + 1, j)?, self.up(i, j)?];
        let inner = |i, j| self.get(i, j).map(|c| c.angle);
        let outer = |i, j| self.get(i, j).map(|c| std::f64::consts::PI - c.angle);
        Some(Cell { sides, angles: [outer(i, j + 1)?, inner(i + 1, j + 1)?, outer(i + 1, j)?, inner(i, j)?] })
    }
}

impl Levels {
    /// The widest cell, m.
    fn spacing(&self) -> f64 {
        self.0.iter().flat_map(|x| x.windows(2)).map(|w| w[1] - w[0]).fold(0.0, f64::max)
    }
}

/// Where the level line `h` crosses the upright line `v` on the sheet. Lines that end just short of each other are drawn out.
fn crossing(h: &Line, x: f64, v: &Line, y: f64, spacing: f64) -> Option<Crossing> {
    if h.places.len() < 2 || v.places.len() < 2 {
        return None;
    }
    let near = |line: &Line, axis: usize, level: f64| -> Vec<usize> {
        let within = |i: &usize| (line.places[*i].1[axis] - level).abs() < spacing;
        (0..line.places.len() - 1).filter(|i| within(i) || within(&(i + 1))).collect()
    };
    let (hs, vs) = (near(h, 0, x), near(v, 1, y));
    let mut found: Option<(f64, f64, f64)> = None;
    for &i in &hs {
        for &j in &vs {
            let (p, r) = (h.places[i].1, h.places[i + 1].1 - h.places[i].1);
            let (q, s) = (v.places[j].1, v.places[j + 1].1 - v.places[j].1);
            let cross = r.perp(&s);
            // lines that only touch are near to parallel there: no crossing
            if cross.abs() < 1e-6 * r.norm() * s.norm() {
                continue;
            }
            let (t, u) = ((q - p).perp(&s) / cross, (q - p).perp(&r) / cross);
            let beyond = |share: f64, way: f64, first: bool, last: bool| {
                let over = (-share).max(share - 1.0).max(0.0) * way;
                let may = (share < 0.0 && first) || (share > 1.0 && last);
                if over == 0.0 || (may && over <= REACH) { Some(over) } else { None }
            };
            let over_h = beyond(t, r.norm(), i == 0, i + 2 == h.places.len());
            let over_v = beyond(u, s.norm(), j == 0, j + 2 == v.places.len());
            let (Some(a), Some(b)) = (over_h, over_v) else { continue };
            let (step_h, step_v) = (h.length[i + 1] - h.length[i], v.length[j + 1] - v.length[j]);
            if step_h > GAP || step_v > GAP {
                continue;
            }
            if found.is_none_or(|f| a + b < f.2) {
                found = Some((h.length[i] + t * step_h, v.length[j] + u * step_v, a + b));
            }
        }
    }
    let (along, up, _) = found?;
    Some(Crossing { along, up, angle: h.tangent(along).angle(&v.tangent(up)) })
}

#[cfg(test)]
#[path = "shape_tests.rs"]
mod tests;
