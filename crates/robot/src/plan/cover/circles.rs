//! The dissertation's own method, to compare: circles on the plan of the wall, chosen greedily (section VII.A.3, algorithm 1).
//!
//! US 12,569,997 B2 claims it. Candidates lie on a lattice, where the dissertation draws them at random.
use std::time::Instant;

use nalgebra::{Point2, Vector2};

use super::error::CoverError;
use super::ink::Ink;
use super::options::BasePose;
use super::place::Coverage;
use super::solve::{Chosen, CoverJob, told};
use crate::surface::Wall;

/// Distance between points of the wall, m.
const POINTS: f64 = 0.01;

/// The dissertation's circles: neither planned, nor kept clear of on the drive.
pub(super) fn by_circles(job: &CoverJob, ink: &Ink, [radius, offset, base]: [f64; 3]) -> Result<Coverage, CoverError> {
    let started = Instant::now();
    let found = circles(job.wall, radius, offset, base, job.cover.candidate_spacing);
    let found = found.map_err(|s| CoverError::NoPlace {
        along: [s, s],
        heights: ink.band(),
        missing: "no circle with a clear base covers the wall there".into(),
    })?;
    let solver_s = started.elapsed().as_secs_f64();
    let places: Vec<_> = found.iter().map(|c| (c.pose, c.span)).collect();
    let seams = borders(&found.iter().map(|c| c.span).collect::<Vec<_>>());
    let mut coverage = told(job, ink, "circles", Chosen { places, optimal: false, bound: 0 }, &seams)?;
    without_idle(&mut coverage);
    let first = coverage.places.first().map(|p| p.pose);
    let way_in = job.start.into_iter().zip(first).flat_map(|(start, first)| [start, first]).collect();
    let drives = coverage.places.windows(2).map(|w| vec![w[0].pose, w[1].pose]).collect();
    Ok(Coverage { way_in, drives, solver_s, ..coverage })
}

/// Leaves out places that draw nothing.
fn without_idle(coverage: &mut Coverage) {
    let kept: Vec<usize> = (0..coverage.places.len()).filter(|k| !coverage.places[*k].pieces.is_empty()).collect();
    coverage.places = kept.iter().map(|k| coverage.places[*k].clone()).collect();
    for cut in &mut coverage.cuts {
        cut.places = cut.places.map(|p| kept.binary_search(&p).unwrap_or(0));
    }
}

/// A circle: where its base stands, and the arc lengths of the wall between its outermost points, m.
struct Circle {
    pub pose: BasePose,
    pub span: [f64; 2],
}

/// Circles of `radius` that cover all of the wall, each with a base `offset` behind its centre whose circle `base` is clear of
/// the wall; in their order along it. The error is the arc length of a point that none covers.
fn circles(wall: &Wall, radius: f64, offset: f64, base: f64, spacing: f64) -> Result<Vec<Circle>, f64> {
    let length = wall.profile.length();
    let n = (length / POINTS).floor() as usize;
    let along: Vec<f64> = (0..=n).map(|k| k as f64 * length / n.max(1) as f64).collect();
    let points: Vec<Point2<f64>> = along.iter().map(|s| wall.profile.at(*s)).collect();
    let mut covered = vec![false; points.len()];
    let mut centers = lattice(&points, radius, spacing);
    let inside =
        |c: &Point2<f64>| -> Vec<usize> { (0..points.len()).filter(|k| (points[*k] - c).norm() <= radius).collect() };
    let mut held: Vec<Vec<usize>> = centers.iter().map(inside).collect();
    let mut chosen = Vec::new();
    while let Some(open) = covered.iter().position(|c| !c) {
        let gain = |k: usize| held[k].iter().filter(|p| !covered[**p]).count();
        let best = (0..centers.len()).max_by_key(|k| (gain(*k), usize::MAX - k)).filter(|k| gain(*k) > 0);
        let Some(best) = best else { return Err(along[open]) };
        let (center, set) = (centers.swap_remove(best), held.swap_remove(best));
        let (first, last) = (set[0], set[set.len() - 1]);
        let chord = points[last] - points[first];
        let Some(chord) = chord.try_normalize(1e-9) else { continue };
        let front = Vector2::new(chord.y, -chord.x);
        let stand = center + front * offset;
        if points.iter().all(|p| (p - stand).norm() > base) {
            set.iter().for_each(|p| covered[*p] = true);
            let pose = BasePose { x: stand.x, y: stand.y, heading: (-front.y).atan2(-front.x) };
            chosen.push(Circle { pose, span: [along[first], along[last]] });
        }
    }
    let middle = |c: &Circle| c.span[0] + c.span[1];
    chosen.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
    Ok(chosen)
}

/// Centres on a lattice that are no farther than `radius` from the wall.
fn lattice(points: &[Point2<f64>], radius: f64, spacing: f64) -> Vec<Point2<f64>> {
    let bound = |d: usize| {
        let low = points.iter().map(|p| p[d]).fold(f64::INFINITY, f64::min) - radius;
        let high = points.iter().map(|p| p[d]).fold(f64::NEG_INFINITY, f64::max) + radius;
        ((low / spacing).floor() as i64, (high / spacing).ceil() as i64)
    };
    let ((x0, x1), (y0, y1)) = (bound(0), bound(1));
    let all = (x0..=x1).flat_map(|i| (y0..=y1).map(move |j| Point2::new(i as f64 * spacing, j as f64 * spacing)));
    all.filter(|c| points.iter().any(|p| (p - c).norm() <= radius)).collect()
}

/// Straight borders half-way between where one circle ends and the next begins, rising.
fn borders(spans: &[[f64; 2]]) -> Vec<f64> {
    let mut borders: Vec<f64> = spans.windows(2).map(|w| 0.5 * (w[0][1] + w[1][0])).collect();
    for k in 1..borders.len() {
        borders[k] = borders[k].max(borders[k - 1]);
    }
    borders
}
