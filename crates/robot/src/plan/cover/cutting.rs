//! Which place draws which stroke, and where those are cut that none can draw whole.
use std::collections::BTreeMap;

use nalgebra::Point2;

use super::ink::{Ink, InkStroke, Sample};
use super::place::{Cut, CutKind, Piece};

/// A line that turns by more hides a cut, rad.
const CORNER: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// Strokes nearer than this touch, m.
const TOUCH: f64 = 0.5e-3;
/// A cut keeps this far from the ends of its pieces where it can, m.
const CLEAR: f64 = 4e-3;
/// Side of the cells in which neighbours are looked up, m; no sampled step is longer.
const CELL: f64 = 6e-3;

/// What each place draws, and the cuts.
pub(super) struct Shares {
    pub pieces: Vec<Vec<Piece>>,
    pub cuts: Vec<Cut>,
}

/// Shares all strokes out among places that reach `spans` (arc lengths, m). A stroke that a place holds is drawn whole by the
/// nearest such; others go on with each place as far as it holds them, which makes the fewest pieces, and are cut where it shows least
/// in what both hold. The error is a stroke's sample that no place holds.
pub(super) fn share(ink: &Ink, spans: &[[f64; 2]]) -> Result<Shares, (usize, usize)> {
    let mut shares = Shares { pieces: vec![Vec::new(); spans.len()], cuts: Vec::new() };
    let mut neighbours = None;
    for (index, stroke) in ink.strokes.iter().enumerate() {
        let holds = |k: usize, s: &Sample| (spans[k][0] - 1e-9..=spans[k][1] + 1e-9).contains(&s.along);
        let all = |k: &usize| stroke.samples.iter().all(|s| holds(*k, s));
        let end = stroke.samples[stroke.samples.len() - 1].at;
        let middle = |k: usize| 0.5 * (spans[k][0] + spans[k][1]);
        let center = 0.5 * (stroke.samples[0].along + stroke.samples[stroke.samples.len() - 1].along);
        let away = |k: &usize| (middle(*k) - center).abs();
        let whole = (0..spans.len()).filter(all).min_by(|a, b| away(a).total_cmp(&away(b)));
        let piece = |from: f64, to: f64| Piece {
            layer: stroke.layer,
            stroke: stroke.stroke,
            from,
            to,
            cut_before: None,
            cut_after: None,
        };
        if let Some(k) = whole {
            shares.pieces[k].push(piece(0.0, end));
            continue;
        }
        let near = neighbours.get_or_insert_with(|| Neighbours::new(ink));
        let cuts = cut_stroke(index, stroke, spans, near).map_err(|sample| (index, sample))?;
        let mut open = piece(0.0, end);
        let mut place = cuts[0].places[0];
        for mut cut in cuts {
            cut.id = shares.cuts.len();
            shares.pieces[place].push(Piece { to: cut.at, cut_after: Some(cut.id), ..open });
            open = Piece { cut_before: Some(cut.id), ..piece(cut.at, end) };
            place = cut.places[1];
            shares.cuts.push(cut);
        }
        shares.pieces[place].push(open);
    }
    for pieces in &mut shares.pieces {
        // ink by ink; within one the drawing's order stays
        pieces.sort_by_key(|p| p.layer);
    }
    Ok(shares)
}

/// The cuts of a stroke that no place holds whole; the error is a sample that none holds.
fn cut_stroke(index: usize, stroke: &InkStroke, spans: &[[f64; 2]], near: &Neighbours) -> Result<Vec<Cut>, usize> {
    let samples = &stroke.samples;
    let holds = |k: usize, i: usize| (spans[k][0] - 1e-9..=spans[k][1] + 1e-9).contains(&samples[i].along);
    let until = |k: usize, i: usize| (i..samples.len()).take_while(|j| holds(k, *j)).last().unwrap_or(i);
    let farthest = |i: usize| (0..spans.len()).filter(|k| holds(*k, i)).max_by_key(|k| (until(*k, i), usize::MAX - k));
    let mut cuts = Vec::new();
    let (mut begin, mut place) = (0, farthest(0).ok_or(0_usize)?);
    loop {
        let last = until(place, begin);
        if last + 1 == samples.len() {
            return Ok(cuts);
        }
        let next = farthest(last + 1).ok_or(last + 1)?;
        let first = (begin + 1..=last).rev().take_while(|j| holds(next, *j)).last();
        let cut = match first {
            Some(first) => near.least_visible(index, stroke, begin, first..=last),
            None => {
                // between two samples: where both hold, or half-way
                let (a, b) = (&samples[last], &samples[last + 1]);
                let both = 0.5 * (spans[place][0].max(spans[next][0]) + spans[place][1].min(spans[next][1]));
                let share = ((both - a.along) / (b.along - a.along)).clamp(0.0, 1.0);
                let u = if share.is_finite() { share } else { 0.5 };
                let sheet = a.target.sheet + (b.target.sheet - a.target.sheet) * u;
                (last + 1, a.at + (b.at - a.at) * u, sheet, a.along + (b.along - a.along) * u, CutKind::Line)
            }
        };
        let (from, at, sheet, along, kind) = cut;
        cuts.push(Cut {
            id: 0,
            layer: stroke.layer,
            stroke: stroke.stroke,
            at,
            sheet,
            along,
            places: [place, next],
            kind,
        });
        (begin, place) = (from, next);
    }
}

/// Where strokes come near each other.
struct Neighbours<'a> {
    ink: &'a Ink,
    /// Sampled steps, as stroke and first sample, by the cells that their boxes touch.
    cells: BTreeMap<(i32, i32), Vec<(u32, u32)>>,
}

fn cell(p: &Point2<f64>) -> (i32, i32) {
    ((p.x / CELL).floor() as i32, (p.y / CELL).floor() as i32)
}

impl<'a> Neighbours<'a> {
    fn new(ink: &'a Ink) -> Self {
        let mut cells: BTreeMap<(i32, i32), Vec<(u32, u32)>> = BTreeMap::new();
        for (k, stroke) in ink.strokes.iter().enumerate() {
            for (i, s) in stroke.samples.iter().enumerate() {
                cells.entry(cell(&s.target.sheet)).or_default().push((k as u32, i as u32));
            }
        }
        Self { ink, cells }
    }

    /// Samples of other strokes in the cells round a point.
    fn around(&self, own: usize, p: &Point2<f64>) -> impl Iterator<Item = (usize, usize)> + '_ {
        let (x, y) = cell(p);
        let cells = (x - 1..=x + 1).flat_map(move |i| (y - 1..=y + 1).map(move |j| (i, j)));
        let found = cells.filter_map(|c| self.cells.get(&c)).flatten();
        found.map(|(k, i)| (*k as usize, *i as usize)).filter(move |(k, _)| *k != own)
    }

    /// The sample in `window` of a stroke, whose piece begins at sample `begin`, where a cut shows least: its index, its place in
    /// the stroke, on the sheet and along the wall, and what hides it.
    fn least_visible(
        &self,
        index: usize,
        stroke: &InkStroke,
        begin: usize,
        window: std::ops::RangeInclusive<usize>,
    ) -> (usize, f64, Point2<f64>, f64, CutKind) {
        let samples = &stroke.samples;
        let (first, last) = (*window.start(), *window.end());
        let middle = 0.5 * (first + last) as f64;
        let end = samples[samples.len() - 1].target.sheet;
        let score = |i: usize| {
            let s = &samples[i];
            let (kind, sharpness) = self.kind(index, samples, i);
            let cramped = [samples[begin].target.sheet, end].iter().any(|e| (e - s.target.sheet).norm() < CLEAR);
            let rank = kind as u8;
            (cramped, rank, -sharpness, (i as f64 - middle).abs())
        };
        let mut best = (last, score(last));
        for i in first..last {
            let here = score(i);
            let order = here.0.cmp(&best.1.0).then(here.1.cmp(&best.1.1));
            let order = order.then(here.2.total_cmp(&best.1.2)).then(here.3.total_cmp(&best.1.3));
            if order.is_lt() {
                best = (i, here);
            }
        }
        let s = &samples[best.0];
        (best.0, s.at, s.target.sheet, s.along, self.kind(index, samples, best.0).0)
    }

    /// What would hide a cut at a sample, and how sharply the line turns there (in steps of 10 degrees).
    fn kind(&self, index: usize, samples: &[Sample], i: usize) -> (CutKind, f64) {
        let p = samples[i].target.sheet;
        let vertex = samples[i].at.fract() == 0.0;
        let is_end = |(k, j): (usize, usize)| {
            let other = &self.ink.strokes[k].samples;
            (j == 0 || j + 1 == other.len()) && (other[j].target.sheet - p).norm() < TOUCH
        };
        if self.around(index, &p).any(is_end) {
            return (CutKind::Lift, 0.0);
        }
        if vertex && i > 0 && i + 1 < samples.len() {
            let turn = (p - samples[i - 1].target.sheet).angle(&(samples[i + 1].target.sheet - p));
            if turn > CORNER {
                return (CutKind::Corner, (turn.to_degrees() / 10.0).floor());
            }
        }
        let crosses = |(k, j): (usize, usize)| {
            let other = &self.ink.strokes[k].samples;
            let to = other[(j + 1).min(other.len() - 1)].target.sheet;
            distance(&p, &other[j].target.sheet, &to) < TOUCH
        };
        if self.around(index, &p).any(crosses) { (CutKind::Crossing, 0.0) } else { (CutKind::Line, 0.0) }
    }
}

/// Distance of a point from a straight piece, m.
fn distance(p: &Point2<f64>, a: &Point2<f64>, b: &Point2<f64>) -> f64 {
    let d = b - a;
    let u = if d.norm_squared() > 0.0 { ((p - a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0) } else { 0.0 };
    (a + d * u - p).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::{Drawing, InkLayer, Stroke};
    use crate::math::Rgb;
    use crate::mesh::{ProfileCurve, ProfileShape, SurfacePoint};
    use crate::plan::cover::{BasePose, Coverage, Place};
    use crate::surface::{Mapping, Wall};
    use nalgebra::{Point3, Vector3};
    use proptest::prelude::*;

    /// The sheet laid flat on a wall that faces -x.
    struct Flat;
    impl Mapping for Flat {
        fn to_surface(&self, p: &Point2<f64>) -> Option<SurfacePoint> {
            let position = Point3::new(1.0, -p.x, 1.2 + p.y);
            let normal = -Vector3::x();
            Some(SurfacePoint { position, normal, face_normal: normal, triangle: 0, barycentric: [1.0, 0.0, 0.0] })
        }
        fn to_sheet(&self, w: &Point3<f64>) -> Option<Point2<f64>> {
            Some(Point2::new(-w.y, w.z - 1.2))
        }
        fn kind(&self) -> &'static str {
            "projection"
        }
    }

    fn wall() -> Wall {
        let points = vec![Point2::new(1.0, 1.0), Point2::new(1.0, -1.0)];
        let profile = ProfileCurve::new(&ProfileShape::Polyline { points, fillet: 0.0 }, 0.1).unwrap();
        Wall { profile, bottom: 0.0, top: 2.0, openings: vec![] }
    }

    fn drawing(strokes: Vec<Vec<(f64, f64)>>) -> Drawing {
        let stroke = |s: Vec<(f64, f64)>| Stroke::new(s.into_iter().map(|(x, y)| Point2::new(x, y)).collect());
        let layer = InkLayer {
            name: "k".into(),
            color: Rgb([0; 3]),
            width_hint: None,
            strokes: strokes.into_iter().map(stroke).collect(),
        };
        Drawing::new(2.0, 0.4, vec![layer])
    }

    fn cover(drawing: &Drawing, spans: &[[f64; 2]]) -> Coverage {
        let shares = share(&Ink::new(drawing, &Flat, &wall()).unwrap(), spans).unwrap();
        let pose = BasePose { x: 0.0, y: 0.0, heading: 0.0 };
        let places = shares.pieces.into_iter().zip(spans).map(|(pieces, s)| Place { pose, stretch: *s, pieces });
        Coverage {
            raise: 0.0,
            way_in: Vec::new(),
            method: "map".into(),
            places: places.collect(),
            cuts: shares.cuts,
            drives: vec![],
            borders: vec![],
            optimal: true,
            bound: 1,
            rounds: 1,
            solver_s: 0.0,
        }
    }

    #[test]
    fn the_overlap_keeps_strokes_whole_and_a_cut_hides_in_a_corner() {
        // the first fits into the left place, the second needs both and has a corner in the overlap
        let d =
            drawing(vec![vec![(-0.5, 0.0), (0.08, 0.0)], vec![(-0.5, 0.1), (0.03, 0.1), (0.03, 0.15), (0.6, 0.15)]]);
        let c = cover(&d, &[[0.0, 1.1], [0.9, 2.0]]);
        assert_eq!((c.strokes_cut(), c.cuts.len()), (1, 1));
        assert_eq!((c.cuts[0].at, c.cuts[0].kind, c.cuts[0].places), (1.0, CutKind::Corner, [0, 1]));
        assert_eq!(c.part(&d, 0).layers[0].strokes[1].points.len(), 2);
        assert_eq!(c.part(&d, 1).layers[0].strokes[0].points[0], Point2::new(0.03, 0.1));
    }

    #[test]
    fn without_an_overlap_a_line_is_cut_at_the_border() {
        let c = cover(&drawing(vec![vec![(-0.5, 0.0), (0.5, 0.0)]]), &[[0.0, 1.0625], [1.0625, 2.0]]);
        assert_eq!(c.cuts.len(), 1);
        assert!((c.cuts[0].sheet.x - 0.0625).abs() < 1e-9 && (c.cuts[0].at - 0.5625).abs() < 1e-9);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn no_ink_is_lost_and_none_drawn_twice(
            strokes in prop::collection::vec(prop::collection::vec((-0.95..0.95f64, -0.2..0.2f64), 2..12), 1..6),
            low in 0.6..1.0f64, overlap in 0.0..0.3f64
        ) {
            let d = drawing(strokes);
            let c = cover(&d, &[[0.0, low + overlap], [low, 2.0]]);
            let lengths = (0..2).map(|k| c.part(&d, k).length()).sum::<f64>();
            prop_assert!((lengths - d.length()).abs() < 1e-9 * (1.0 + d.length()), "{lengths} {}", d.length());
            // every vertex is in a piece, and pieces of a stroke join end to end
            for (k, stroke) in d.layers[0].strokes.iter().enumerate() {
                let mut own: Vec<&Piece> = c.places.iter().flat_map(|p| &p.pieces).filter(|p| p.stroke == k).collect();
                own.sort_by(|a, b| a.from.total_cmp(&b.from));
                prop_assert_eq!((own[0].from, own[own.len() - 1].to), (0.0, (stroke.points.len() - 1) as f64));
                prop_assert!(own.windows(2).all(|w| w[0].to == w[1].from && w[0].cut_after == w[1].cut_before));
            }
        }
    }
}
