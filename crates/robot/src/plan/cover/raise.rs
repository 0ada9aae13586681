//! The height at which a drawing takes the fewest places, where it may be moved up or down its wall.
use std::collections::BTreeSet;

use rayon::prelude::*;

use super::candidates::{Asked, Candidate, Stretch};
use super::error::CoverError;
use super::ink::{COLUMN, Ink};
use super::pen_reach::PenReach;
use super::place::Coverage;
use super::solve::{CoverJob, by_map};
use super::sweep::{fewest_stretches, sweep};
use crate::surface::Wall;

/// Rounds of solving and planning at a height: where the map tells more than can be planned, others are nearer.
const ROUNDS: usize = 10;
/// Room between ink and the edges of the wall, m.
const EDGE: f64 = 0.005;

/// A height, and what no cover there can be better than.
struct Tried {
    raise: f64,
    /// Places that unbroken stretches take, and strokes that are then cut, before anything is planned.
    places: usize,
    cuts: usize,
    /// Passes of cut strokes from place to place.
    crossings: usize,
    /// Places that no choice can be below.
    bound: usize,
}

/// Raises that are tried, m: those nearest to 0 first. The map of reach tells no finer than its spacing.
fn raises([low, high]: [f64; 2], spacing: f64) -> Vec<f64> {
    let (first, last) = ((low / spacing - 1e-9).ceil() as i64, (high / spacing + 1e-9).floor() as i64);
    let mut all: Vec<i64> = (first..=last).collect();
    all.sort_by_key(|k| (k.abs(), *k));
    all.into_iter().map(|k| k as f64 * spacing).collect()
}

/// Whether all ink is on the wall when it is raised.
fn is_on_wall(ink: &Ink, wall: &Wall, raise: f64) -> bool {
    raise == 0.0
        || ink.strokes.iter().flat_map(|s| &s.samples).all(|s| {
            let z = s.target.position.z + raise;
            wall.has(s.along, z - EDGE) && wall.has(s.along, z + EDGE)
        })
}

/// The cover of the height between the two of `range` (m) that takes the fewest places, of these the one that cuts the fewest
/// strokes, of these the one with the fewest passes, of these the one nearest to where the drawing lies.
///
/// Planning takes stretches away and never adds any, so that a height is planned only while it may still be better than the best.
pub(super) fn raised(
    job: &CoverJob,
    (ink, reach): (&Ink, &PenReach),
    all: &[Candidate],
    range: [f64; 2],
    hear: &mut dyn FnMut(&str),
) -> Result<Coverage, CoverError> {
    let press = job.plan.press.largest();
    let mut raises = raises(range, job.cover.map_spacing);
    raises.retain(|r| is_on_wall(ink, job.wall, *r));
    let Some(nearest) = raises.first().copied() else { return Err(off_the_wall(job.wall, ink, range)) };
    let tried = raises.into_iter().filter_map(|raise| {
        let asked = Asked::new(job.wall, ink, reach, job.cover, press).raised(raise);
        let none = BTreeSet::new();
        let stretches: Vec<Vec<Stretch>> =
            (0..all.len()).into_par_iter().map(|k| asked.stretches(&all[k], k, &none)).collect();
        let flat: Vec<Stretch> = stretches.iter().flatten().copied().collect();
        let places = fewest_stretches(ink, &flat)?;
        let hull = |s: &Vec<Stretch>| Some(Stretch { last: s.last()?.last, ..*s.first()? });
        let hulls: Vec<Stretch> = stretches.iter().filter_map(hull).collect();
        let bound = fewest_stretches(ink, &hulls).unwrap_or(0);
        Some((Tried { raise, places, cuts: 0, crossings: 0, bound }, flat))
    });
    let tried: Vec<(Tried, Vec<Stretch>)> = tried.collect();
    let fewest = tried.iter().map(|t| t.0.places).min();
    let bound = tried.iter().map(|t| t.0.bound).min().unwrap_or(0);
    let mut ranked: Vec<Tried> = tried
        .into_iter()
        .map(|(t, flat)| {
            // cuts are counted where they may decide
            let swept = if Some(t.places) == fewest { sweep(ink, &flat).ok() } else { None };
            let (cuts, crossings) = swept.map_or((0, 0), |s| (s.cut, s.crossings));
            Tried { cuts, crossings, ..t }
        })
        .collect();
    // equal ones stay in the order of their distance
    ranked.sort_by_key(|t| (t.places, t.cuts, t.crossings));
    let mut best: Option<Coverage> = None;
    let mut refused = None;
    let score = |c: &Coverage| (c.places.len(), c.strokes_cut());
    for t in ranked {
        if best.as_ref().is_some_and(|b| score(b) <= (t.places, t.cuts)) {
            break;
        }
        match at(job, (ink, reach), all, t.raise, hear) {
            Ok(c) if best.as_ref().is_none_or(|b| score(&c) < score(b)) => best = Some(c),
            Ok(_) => {}
            Err(e) => refused = refused.or(Some(e)),
        }
    }
    match best {
        Some(c) => Ok(Coverage { bound: bound.min(c.bound), optimal: c.places.len() == bound, ..c }),
        None => match refused {
            Some(e) => Err(e),
            // no height does: what is wrong is told of the one nearest to where the drawing lies
            None => at(job, (ink, reach), all, nearest, hear),
        },
    }
}

/// That there is no wall behind the drawing at any height.
fn off_the_wall(wall: &Wall, ink: &Ink, [low, high]: [f64; 2]) -> CoverError {
    let ([bottom, top], (first, last)) = (ink.band(), ink.ends());
    let missing = format!("the wall is from {:.0} to {:.0} mm high there", wall.bottom * 1e3, wall.top * 1e3);
    let along = [first as f64 * COLUMN, (last + 1) as f64 * COLUMN];
    CoverError::NoPlace { along, heights: [bottom + low, top + high], missing }
}

/// The cover of a drawing that is raised by `raise` (m).
fn at(
    job: &CoverJob,
    (ink, reach): (&Ink, &PenReach),
    all: &[Candidate],
    raise: f64,
    hear: &mut dyn FnMut(&str),
) -> Result<Coverage, CoverError> {
    let moved = ink.raised(raise);
    let asked = Asked::new(job.wall, &moved, reach, job.cover, job.plan.press.largest());
    Ok(Coverage { raise, ..by_map(job, &asked, all, ROUNDS, hear)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raises_are_whole_steps_within_the_range_and_the_nearest_come_first() {
        assert_eq!(raises([-0.05, 0.03], 0.025), vec![0.0, -0.025, 0.025, -0.05]);
        assert_eq!(raises([0.0, 0.0], 0.025), vec![0.0]);
        assert_eq!(raises([0.03, 0.06], 0.025), vec![0.05]);
    }
}
