//! A cover from start to end: candidates, the sweep, the seams, planning, the drives.
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use rayon::prelude::*;

use super::candidates::{Asked, Candidate, Stretch, axis_of, candidates};
use super::circles::by_circles;
use super::cutting::share;
use super::drive::way;
use super::error::CoverError;
use super::floor::Floor;
use super::ink::{COLUMN, Ink};
use super::options::{BasePose, CoverMethod, CoverOptions};
use super::pen_reach::PenReach;
use super::place::{Coverage, Piece, Place};
use super::raise::raised;
use super::sweep::sweep;
use super::union::{Fewest, fewest};
use super::verify::{Failure, can_wait, verify};
use crate::drawing::Drawing;
use crate::mesh::{MeshError, TriMesh};
use crate::plan::{PlanOptions, ReachGrid, ReachMap, ReachProbe};
use crate::robot::{ArmModel, JointVector};
use crate::surface::{BelievedCanvas, Mapping, Wall};

/// Side of the piece of canvas that is taken to be at each point of the map, m.
const PATCH: f64 = 0.2;
/// Rounds of solving and planning.
const ROUNDS: usize = 40;
/// What can't be drawn from a place can't from others this near, m.
const ALIKE: f64 = 0.04;
/// Most places between which the shortest drive is sought, each time.
const DRIVEN: usize = 400;

/// A drawing on a wall, and the arm that is to draw it.
#[derive(Clone, Copy)]
pub struct CoverJob<'a> {
    /// The arm; where its model stands doesn't matter.
    pub arm: &'a ArmModel,
    /// Where it waits, rad.
    pub home: &'a JointVector,
    /// Where the base starts; nothing is said of the way to the first place without it.
    pub start: Option<BasePose>,
    /// The wall.
    pub wall: &'a Wall,
    /// The same as a mesh.
    pub canvas: &'a BelievedCanvas,
    /// What stands round it, world.
    pub obstacles: &'a [TriMesh],
    /// What is drawn.
    pub drawing: &'a Drawing,
    /// How it is laid on the wall.
    pub mapping: &'a dyn Mapping,
    /// Margins and limits of planning.
    pub plan: &'a PlanOptions,
    /// What is asked.
    pub cover: &'a CoverOptions,
}

/// Makes, or knows, a map of reach.
pub type MapMaker<'a> = dyn FnMut(&ReachProbe, &ReachGrid) -> ReachMap + 'a;

/// A choice of places.
pub(super) struct Chosen {
    pub places: Vec<(BasePose, [f64; 2])>,
    pub optimal: bool,
    pub bound: usize,
}

/// Where to stand to draw all of a drawing on a wall, and what to draw from where.
///
/// The default method takes places whose unbroken stretches of reached ink cover it all. No such cover has fewer places; none with as
/// many cuts fewer strokes; none that cuts as many has fewer seams crossed; and of the places that do for the strokes so shared out,
/// those with the shortest straight way between them are taken. A place that reaches several stretches counts for one of them at a
/// time; [`Coverage::bound`] holds for all of them together. `map` makes the map of reach that is asked for; `hear` is told each stage.
///
/// # Errors
/// See [`CoverError`].
pub fn cover(job: &CoverJob, map: &mut MapMaker, hear: &mut dyn FnMut(&str)) -> Result<Coverage, CoverError> {
    let options = job.cover;
    let ink = Ink::new(job.drawing, job.mapping, job.wall)?;
    let floor = Floor::new(job.wall, job.obstacles, options);
    if let CoverMethod::Circles { radius, offset, base } = options.method {
        return by_circles(job, &ink, [radius, offset, base]);
    }
    hear("reach of the arm");
    let reach = reach_of(job, &ink, map)?;
    hear("places to stand");
    let asked = Asked::new(job.wall, &ink, &reach, options, job.plan.press.largest());
    let mut coverage = match &options.method {
        CoverMethod::Poses(poses) => by_hand(job, &asked, &floor, poses, hear)?,
        _ => {
            let all = candidates(job.wall, &ink, &floor, options);
            match options.raise {
                Some(range) => raised(job, (&ink, &reach), &all, range, hear)?,
                None => by_map(job, &asked, &all, ROUNDS, hear)?,
            }
        }
    };
    hear("drives");
    if let (Some(start), Some(first)) = (&job.start, coverage.places.first()) {
        let no_way = || CoverError::NoWayIn { width: floor.width(), why: narrow(job.wall) };
        coverage.way_in = way(&floor, start, &first.pose).ok_or_else(no_way)?;
    }
    for k in 1..coverage.places.len() {
        let (a, b) = (coverage.places[k - 1].pose, coverage.places[k].pose);
        let no_way = || CoverError::NoWay { from: k, to: k + 1, width: floor.width(), why: narrow(job.wall) };
        coverage.drives.push(way(&floor, &a, &b).ok_or_else(no_way)?);
    }
    Ok(coverage)
}

/// The doors, for who can't get through.
fn narrow(wall: &Wall) -> String {
    let doors: Vec<String> = wall.doors().map(|d| format!("{:.0} mm", (d.right - d.left) * 1e3)).collect();
    match doors.len() {
        0 => ": what stands on the floor leaves no way".into(),
        1 => format!(": the door is {} wide", doors[0]),
        _ => format!(": the doors are {} wide", doors.join(", ")),
    }
}

fn reach_of(job: &CoverJob, ink: &Ink, map: &mut MapMaker) -> Result<PenReach, CoverError> {
    let arm = PenReach::arm(job.arm, job.cover);
    let body = [PenReach::body(job.cover)?];
    let ([low, high], [down, up]) = (ink.band(), job.cover.raise.unwrap_or([0.0, 0.0]));
    let grid = PenReach::grid(job.cover, [low + down.min(0.0), high + up.max(0.0)]);
    let probe = ReachProbe::new(&arm, job.home, &body, &grid.axis, job.plan, PATCH)?;
    Ok(PenReach::new(&map(&probe, &grid)))
}

/// Strokes shared out among the chosen places, with straight seams where there are borders.
pub(super) fn told(
    job: &CoverJob,
    ink: &Ink,
    method: &str,
    chosen: Chosen,
    borders: &[f64],
) -> Result<Coverage, CoverError> {
    let Chosen { places, optimal, bound } = chosen;
    let mut spans: Vec<[f64; 2]> = places.iter().map(|p| p.1).collect();
    if !borders.is_empty() {
        let wrong = || CoverError::Borders { places: places.len(), borders: borders.len() };
        let rising = borders.windows(2).all(|w| w[0] <= w[1]);
        if borders.len() + 1 != places.len() || !(rising || borders.windows(2).all(|w| w[0] >= w[1])) {
            return Err(wrong());
        }
        let length = job.wall.profile.length();
        let ends = if rising { [0.0, length] } else { [length, 0.0] };
        let edge = |k: usize| if k == 0 { ends[0] } else { borders.get(k - 1).copied().unwrap_or(ends[1]) };
        spans = (0..places.len()).map(|k| [edge(k).min(edge(k + 1)), edge(k).max(edge(k + 1))]).collect();
    }
    let shares = share(ink, &spans).map_err(|(stroke, sample)| {
        let s = &ink.strokes[stroke].samples[sample];
        let z = s.target.position.z;
        let missing = "none of the places holds it".into();
        CoverError::NoPlace { along: [s.along, s.along], heights: [z, z], missing }
    })?;
    let places = places.iter().zip(shares.pieces);
    Ok(Coverage {
        method: method.into(),
        places: places.map(|((pose, stretch), pieces)| Place { pose: *pose, stretch: *stretch, pieces }).collect(),
        cuts: shares.cuts,
        raise: 0.0,
        way_in: Vec::new(),
        drives: Vec::new(),
        borders: borders.to_vec(),
        optimal,
        bound,
        rounds: 1,
        solver_s: 0.0,
    })
}

/// Arc lengths of a stretch, m.
fn span(s: &Stretch) -> [f64; 2] {
    [s.first as f64 * COLUMN, (s.last + 1) as f64 * COLUMN]
}

/// The best cover by the candidates `all`, planned until all of it can be drawn, `rounds` times at most.
pub(super) fn by_map(
    job: &CoverJob,
    asked: &Asked,
    all: &[Candidate],
    rounds: usize,
    hear: &mut dyn FnMut(&str),
) -> Result<Coverage, CoverError> {
    let none = BTreeSet::new();
    let of = |k: usize, blocked: &BTreeSet<usize>| asked.stretches(&all[k], k, blocked);
    let mut stretches: Vec<Vec<Stretch>> = (0..all.len()).into_par_iter().map(|k| of(k, &none)).collect();
    let mut blocked: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    let mut solver_s = 0.0;
    let mut bound = 0;
    let mut waits = false;
    let mut failed: Option<Failure> = None;
    for round in 1..=rounds {
        let started = Instant::now();
        let flat: Vec<Stretch> = stretches.iter().flatten().copied().collect();
        let swept = sweep(asked.ink, &flat).map_err(|column| no_place(asked, all, &flat, column, failed.as_ref()))?;
        if round == 1 {
            // were what each place misses between its ends reached too, no cover could need more
            let hull = |s: &Vec<Stretch>| Some(Stretch { last: s.last()?.last, ..*s.first()? });
            let hulls: Vec<Stretch> = stretches.iter().filter_map(hull).collect();
            bound = sweep(asked.ink, &hulls).map_or(0, |s| s.stretches.len());
        }
        // where places reach several stretches, one may do for two of them
        let whole = swept.stretches.len() == bound || !job.cover.borders.is_empty();
        let union = if whole { None } else { fewest(asked.ink, &stretches) };
        bound = union.as_ref().map_or(bound, |u| bound.max(if round == 1 { u.bound } else { 0 }));
        let (mut coverage, used) = match union {
            Some(u) if u.places.len() < swept.stretches.len() => joined(job, asked.ink, all, &stretches, u)?,
            _ => {
                let places: Vec<(BasePose, [f64; 2])> =
                    swept.stretches.iter().map(|s| (all[s.place].pose, span(s))).collect();
                let chosen = Chosen { optimal: places.len() == bound, places, bound };
                let mut coverage = told(job, asked.ink, "map", chosen, &job.cover.borders)?;
                let used = shortest(asked.ink, &mut coverage, all, &flat);
                (coverage, used)
            }
        };
        solver_s += started.elapsed().as_secs_f64();
        (coverage.rounds, coverage.solver_s) = (round, solver_s);
        if !job.cover.verify {
            return Ok(coverage);
        }
        failed = None;
        hear(&format!("planning from {} places", coverage.places.len()));
        for (place, candidate) in coverage.places.iter().zip(used) {
            let Some(failure) = verify(job, asked.ink, &place.pose, &place.pieces)? else { continue };
            for k in (0..all.len()).filter(|k| (all[*k].axis - all[candidate].axis).norm() < ALIKE) {
                let columns = blocked.entry(k).or_default();
                columns.extend(&failure.columns);
                stretches[k] = of(k, columns);
            }
            failed = Some(failure);
        }
        if failed.as_ref().is_some_and(|f| f.waiting) && !waits {
            waits = true;
            for k in no_places_to_wait(job, all)? {
                blocked.entry(k).or_default().extend(0..asked.ink.columns.len());
                stretches[k] = Vec::new();
            }
        }
        match &failed {
            None => return Ok(coverage),
            Some(f) if round == rounds => return Err(unplanned(f, rounds)),
            Some(_) => {}
        }
    }
    Err(CoverError::NoInk)
}

/// The candidates, by index, where the arm can't even wait. They are asked for where planning has met one: most covers meet none.
fn no_places_to_wait(job: &CoverJob, all: &[Candidate]) -> Result<Vec<usize>, MeshError> {
    let clear = all.par_iter().map(|c| can_wait(job, &c.pose)).collect::<Result<Vec<bool>, MeshError>>()?;
    Ok((0..all.len()).filter(|k| !clear[*k]).collect())
}

fn unplanned(failure: &Failure, rounds: usize) -> CoverError {
    let column = |c: Option<&usize>| c.map_or(0.0, |c| *c as f64 * COLUMN);
    let along = [column(failure.columns.first()), column(failure.columns.last()) + COLUMN];
    CoverError::Unplanned { rounds, along, length: failure.length, reason: failure.reason.to_string() }
}

/// A cover by places that hold several stretches each, in the order of where they begin along the wall; and their candidates.
fn joined(
    job: &CoverJob,
    ink: &Ink,
    all: &[Candidate],
    stretches: &[Vec<Stretch>],
    union: Fewest,
) -> Result<(Coverage, Vec<usize>), CoverError> {
    let mut used = union.places;
    used.sort_by_key(|k| (stretches[*k].first().map(|s| s.first), *k));
    let owners: Vec<(usize, Stretch)> =
        used.iter().enumerate().flat_map(|(i, k)| stretches[*k].iter().map(move |s| (i, *s))).collect();
    let places = owners.iter().map(|(_, s)| (all[s.place].pose, span(s))).collect();
    let chosen = Chosen { optimal: used.len() == union.bound, places, bound: union.bound };
    let mut coverage = told(job, ink, "map", chosen, &[])?;
    let mut merged: Vec<Option<Place>> = vec![None; used.len()];
    for (place, (owner, _)) in std::mem::take(&mut coverage.places).into_iter().zip(&owners) {
        match &mut merged[*owner] {
            Some(known) => {
                known.stretch[1] = place.stretch[1];
                known.pieces.extend(place.pieces);
                known.pieces.sort_by_key(|p| (p.layer, p.stroke));
            }
            empty => *empty = Some(place),
        }
    }
    coverage.places = merged.into_iter().flatten().collect();
    for cut in &mut coverage.cuts {
        cut.places = cut.places.map(|p| owners[p].0);
    }
    Ok((coverage, used))
}

/// Takes for each place the candidate among those that reach all its pieces by which the way through all is shortest. Returns their
/// indices.
fn shortest(ink: &Ink, coverage: &mut Coverage, all: &[Candidate], flat: &[Stretch]) -> Vec<usize> {
    let needed = |pieces: &[Piece]| {
        let mut ends = (usize::MAX, 0);
        for p in pieces {
            let stroke = ink.strokes.iter().find(|s| s.layer == p.layer && s.stroke == p.stroke);
            for s in stroke.iter().flat_map(|s| &s.samples) {
                if s.at >= p.from - 1e-9 && s.at <= p.to + 1e-9 {
                    ends = (ends.0.min(s.column), ends.1.max(s.column));
                }
            }
        }
        ends
    };
    let layers: Vec<Vec<Stretch>> = coverage
        .places
        .iter()
        .map(|place| {
            let (first, last) = needed(&place.pieces);
            let mut fit: Vec<Stretch> = flat.iter().filter(|s| s.first <= first && s.last >= last).copied().collect();
            // those with most room to spare on the tighter side
            fit.sort_by_key(|s| std::cmp::Reverse(((first - s.first.min(first)).min(s.last - last), s.last - s.first)));
            fit.truncate(DRIVEN);
            fit
        })
        .collect();
    let mut cost: Vec<Vec<(f64, usize)>> = vec![layers[0].iter().map(|_| (0.0, 0)).collect()];
    for k in 1..layers.len() {
        let far = |s: &Stretch, b: &Stretch| (all[s.place].pose.center() - all[b.place].pose.center()).norm();
        let best = |s: &Stretch| {
            let ways = layers[k - 1].iter().enumerate().map(|(i, b)| (cost[k - 1][i].0 + far(s, b), i));
            ways.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::INFINITY, 0))
        };
        cost.push(layers[k].iter().map(best).collect());
    }
    let last = layers.len() - 1;
    let mut at = (0..layers[last].len()).min_by(|a, b| cost[last][*a].0.total_cmp(&cost[last][*b].0)).unwrap_or(0);
    let mut used = vec![0; layers.len()];
    for k in (0..layers.len()).rev() {
        let Some(stretch) = layers[k].get(at) else { continue };
        coverage.places[k].pose = all[stretch.place].pose;
        coverage.places[k].stretch = span(stretch);
        used[k] = stretch.place;
        at = cost[k][at].1;
    }
    used
}

/// Which ink no place reaches, and by how much it is missed, or why it can't be `planned`.
fn no_place(
    asked: &Asked,
    all: &[Candidate],
    flat: &[Stretch],
    column: usize,
    planned: Option<&Failure>,
) -> CoverError {
    let held = |c: usize| flat.iter().any(|s| (s.first..=s.last).contains(&c));
    let mut last = column;
    while last + 1 < asked.ink.columns.len() && asked.ink.columns[last + 1].is_some() && !held(last + 1) {
        last += 1;
    }
    let mut heights = [f64::INFINITY, f64::NEG_INFINITY];
    for c in asked.ink.columns[column..=last].iter().flatten() {
        heights = [heights[0].min(c[0]), heights[1].max(c[1])];
    }
    let missing = match (asked.missing((column + last) / 2, all), asked.reach.heights()) {
        (None, _) => "the base can't stand before it".to_string(),
        (_, None) => "the arm can't draw on an upright wall".to_string(),
        (Some(gap), _) if gap > 1e-3 => {
            format!("the best place misses it by {:.0} mm; {}", gap * 1e3, asked.too_high(heights))
        }
        _ => match planned {
            Some(failure) => format!("it is reached, but can't be planned from there: {}", failure.reason),
            None => format!("it is reached, but not with a margin of {:.0} mm", asked.options.margin * 1e3),
        },
    };
    let along = [column as f64 * COLUMN, (last + 1) as f64 * COLUMN];
    CoverError::NoPlace { along, heights, missing }
}

fn by_hand(
    job: &CoverJob,
    asked: &Asked,
    floor: &Floor,
    poses: &[BasePose],
    hear: &mut dyn FnMut(&str),
) -> Result<Coverage, CoverError> {
    let mut places = Vec::new();
    for (k, pose) in poses.iter().enumerate() {
        if let Some(m) = floor.meeting(pose) {
            let pose = [pose.x, pose.y, pose.heading];
            return Err(CoverError::Collides { place: k + 1, pose, what: m.what, missing: m.missing });
        }
        let candidate = Candidate { pose: *pose, axis: axis_of(pose, job.cover) };
        let stretches = asked.stretches(&candidate, k, &BTreeSet::new());
        // the longest; a place that reaches nothing draws nothing
        let best = stretches.iter().max_by_key(|s| s.last - s.first);
        places.push((*pose, best.map_or([0.0, 0.0], span), best.copied()));
    }
    let flat: Vec<Stretch> = places.iter().filter_map(|p| p.2).collect();
    let held = |c: &usize| flat.iter().any(|s| (s.first..=s.last).contains(c));
    let ink = asked.ink;
    if let Some(column) = (0..ink.columns.len()).filter(|c| ink.columns[*c].is_some()).find(|c| !held(c)) {
        let all: Vec<Candidate> = poses.iter().map(|p| Candidate { pose: *p, axis: axis_of(p, job.cover) }).collect();
        return Err(no_place(asked, &all, &flat, column, None));
    }
    let chosen = Chosen { places: places.iter().map(|p| (p.0, p.1)).collect(), optimal: false, bound: 0 };
    let coverage = told(job, ink, "poses", chosen, &job.cover.borders)?;
    if job.cover.verify {
        hear("planning");
        for (k, place) in coverage.places.iter().enumerate() {
            if let Some(f) = verify(job, ink, &place.pose, &place.pieces)? {
                let reason = f.reason.to_string();
                return Err(CoverError::NotDrawn { place: k + 1, length_mm: f.length * 1e3, reason });
            }
        }
    }
    Ok(coverage)
}
