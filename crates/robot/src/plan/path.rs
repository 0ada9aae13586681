//! Path-wise inverse kinematics: joint paths along whole strokes (section VI.B of the dissertation).
use crate::plan::field::{PostureField, Workcell};
use crate::plan::reach::Obstruction;
use crate::plan::redundancy::search;
use crate::plan::waypoint::{Waypoint, separation};
use crate::plan::{IkSolution, Posture};
use crate::robot::JointVector;

/// A continuous joint path over neighbouring waypoints: drawn without lifting the pen.
#[derive(Clone, Debug)]
pub struct Run {
    /// Index of its first waypoint.
    pub first: usize,
    /// One configuration a waypoint.
    pub q: Vec<JointVector>,
}

/// Waypoints that can't be drawn.
#[derive(Clone, Debug)]
pub struct Gap {
    /// Index of the first.
    pub first: usize,
    /// Index of the last.
    pub last: usize,
    /// Why.
    pub reason: Obstruction,
}

/// A stroke as joint paths.
#[derive(Clone, Debug, Default)]
pub struct StrokePath {
    /// In drawing order. More than one where the arm has to change its posture on the way.
    pub runs: Vec<Run>,
    /// In drawing order.
    pub gaps: Vec<Gap>,
    /// How often the redundancy had to be resolved by a global search.
    pub searches: usize,
}

impl Run {
    /// Index of its last waypoint.
    pub fn last(&self) -> usize {
        self.first + self.q.len() - 1
    }
}

/// Distance over which the redundancy relaxes to its reference (m plus 0.2 m per rad).
const RELAXATION: f64 = 0.01;
/// Most that self-motion may turn a joint per distance, rad/m.
const SELF_MOTION_RATE: f64 = 8.0;
/// Most that a joint may turn between waypoints: a constant, rad, and per distance, rad/m.
const JUMP: (f64, f64) = (0.01, 40.0);
/// Waypoints between two checks of dexterity and room, at most.
const CHECK_EVERY: usize = 10;
/// Waypoints before and after an obstacle that a global search looks at.
const SEARCH_WINDOW: usize = 500;
/// Global searches per stroke.
const MOST_SEARCHES: usize = 12;
/// Seeds for a start in none of the drawing's postures.
const FEW_SEEDS: usize = 32;
/// Waypoints that are skipped at once while a stroke is out of reach.
const SKIP: usize = 8;

/// What redundancy is drawn to on the way.
enum Guide<'g> {
    /// One posture everywhere.
    Posture(&'g JointVector),
    /// One posture for each waypoint from the given one on.
    Path(usize, &'g [JointVector]),
}

impl Guide<'_> {
    fn at(&self, i: usize, sep: f64) -> Posture {
        match self {
            Self::Posture(q) => {
                Posture { reference: **q, pull: 1.0 - (-sep / RELAXATION).exp(), most: SELF_MOTION_RATE * sep }
            }
            Self::Path(first, q) => Posture {
                reference: q[(i - first).min(q.len() - 1)],
                pull: 1.0 - (-3.0 * sep / RELAXATION).exp(),
                most: 4.0 * SELF_MOTION_RATE * sep,
            },
        }
    }
}

/// Follows `way` from waypoint `first`, where the arm stands at `start`, as far as it goes up to waypoint `end`
/// (exclusive). Returns a configuration for each waypoint passed, and what stopped it.
fn follow(
    cell: &Workcell,
    way: &[Waypoint],
    first: usize,
    end: usize,
    start: &IkSolution,
    guide: &Guide,
) -> (Vec<JointVector>, Option<Obstruction>) {
    let arm = cell.surroundings.arm();
    let mut q = vec![start.q];
    let mut room = match cell.check(start) {
        Ok(room) => room,
        Err(reason) => return (Vec::new(), Some(reason)),
    };
    let (mut moved, mut unchecked) = (0.0, 0);
    for i in first + 1..end {
        let before = q[q.len() - 1];
        let sep = separation(&way[i - 1].target, &way[i].target);
        let next = match cell.solver.follow(&way[i].target, &before, &guide.at(i, sep)) {
            Ok(s) => s,
            Err(failure) => {
                q.truncate(q.len() - unchecked);
                return (q, Some(Obstruction::from_failure(arm, &failure)));
            }
        };
        let step = next.q - before;
        let (joint, largest) =
            step.iter().enumerate().fold((0, 0.0), |m, (j, d)| if d.abs() > m.1 { (j, d.abs()) } else { m });
        if largest > JUMP.0 + JUMP.1 * sep {
            q.truncate(q.len() - unchecked);
            return (q, Some(Obstruction::Jump { joint: arm.joints[joint].name.clone(), step: largest }));
        }
        moved += cell.surroundings.motion_bound(&step);
        unchecked += 1;
        // no link can have come nearer than `room` before it has moved as far
        if moved >= room || unchecked >= CHECK_EVERY || i + 1 == end {
            match cell.check(&next) {
                Ok(r) => (room, moved, unchecked) = (r, 0.0, 0),
                Err(reason) => {
                    // the ones passed since the last look are given up with it: the stroke is cut a little early
                    q.truncate(q.len() - (unchecked - 1));
                    return (q, Some(reason));
                }
            }
        }
        q.push(next.q);
    }
    (q, None)
}

/// The joint paths of one stroke: in the field's best posture if that reaches its end, else in another, else by a
/// global search over the redundancy, else in several runs between which the pen is lifted.
pub fn solve(cell: &Workcell, field: &PostureField, way: &[Waypoint]) -> StrokePath {
    let mut path = StrokePath::default();
    let mut i = 0;
    while i < way.len() {
        match run_from(cell, field, way, i, &mut path.searches) {
            Ok(run) => {
                // the next run begins where this one ends, so that the line has no hole
                i = if run.last() + 1 == way.len() { way.len() } else { run.last() };
                path.runs.push(run);
            }
            Err(reason) => {
                let drawn = path.runs.last().is_some_and(|r| r.last() == i);
                let first = i + usize::from(drawn);
                let next = next_start(cell, field, way, first + 1);
                match path.gaps.last_mut() {
                    Some(gap) if gap.last + 1 == first => gap.last = next - 1,
                    _ => path.gaps.push(Gap { first, last: next - 1, reason }),
                }
                i = next;
            }
        }
    }
    path
}

/// The first waypoint from `from` on at which the arm can stand in one of the field's postures, found in strides and
/// then exactly; the end of the stroke when there is none.
fn next_start(cell: &Workcell, field: &PostureField, way: &[Waypoint], from: usize) -> usize {
    let reaches = |k: usize| field.references().iter().any(|r| r.start(cell, &way[k].target).is_ok());
    let mut at = from.min(way.len());
    while at < way.len() && !reaches(at) {
        let next = (at + SKIP).min(way.len());
        if next == way.len() || reaches(next) {
            return (at + 1..next).find(|k| reaches(*k)).unwrap_or(next);
        }
        at = next;
    }
    at
}

/// The longest run that starts at waypoint `first`: at least one step long, unless the stroke is a dot.
fn run_from(
    cell: &Workcell,
    field: &PostureField,
    way: &[Waypoint],
    first: usize,
    searches: &mut usize,
) -> Result<Run, Obstruction> {
    let mut best: Vec<JointVector> = Vec::new();
    let mut reason: Option<Obstruction> = None;
    for r in field.references() {
        let (q, stop) = match r.start(cell, &way[first].target) {
            Ok(start) => follow(cell, way, first, way.len(), &start, &Guide::Posture(&r.posture)),
            Err(e) => (Vec::new(), Some(e)),
        };
        match stop {
            None => return Ok(Run { first, q }),
            Some(stop) if q.len() > best.len() || reason.is_none() => {
                (best, reason) = (q, Some(stop));
            }
            Some(_) => {}
        }
    }
    if best.is_empty() {
        // not in any of the drawing's postures: as a single pose
        let solutions = cell.solutions(&way[first].target, FEW_SEEDS)?;
        for s in &solutions {
            let (q, stop) = follow(cell, way, first, way.len(), s, &Guide::Posture(&s.q));
            if stop.is_none() {
                return Ok(Run { first, q });
            }
            if q.len() > best.len() {
                (best, reason) = (q, stop);
            }
        }
    }
    while first + best.len() < way.len() && *searches < MOST_SEARCHES && !best.is_empty() {
        *searches += 1;
        let stop = first + best.len();
        let from = stop.saturating_sub(SEARCH_WINDOW).max(first);
        let to = (stop + SEARCH_WINDOW).min(way.len() - 1);
        let fixed = (from > first).then(|| best[from - first]);
        let ladder = search(cell, way, from, to, fixed.as_ref());
        let guide = ladder.guide(way);
        let Some(start) = ladder.q.first() else { break };
        let Ok(start) = cell.solver.reach(&way[from].target, start) else { break };
        let end = ladder.rungs.last().map_or(from, |r| r + 1);
        let (q, stopped) = follow(cell, way, from, end, &start, &Guide::Path(from, &guide));
        if from + q.len() <= stop {
            reason = stopped.or(reason);
            break;
        }
        best.truncate(from - first);
        best.extend(q);
        if stopped.is_some() || first + best.len() == way.len() {
            break;
        }
        // on from the window's end, in the posture that the search found there
        let here = first + best.len() - 1;
        let Some(last) = best.pop() else { break };
        let Ok(start) = cell.solver.reach(&way[here].target, &last) else { break };
        let (q, stopped) = follow(cell, way, here, way.len(), &start, &Guide::Posture(&last));
        best.extend(if q.is_empty() { vec![last] } else { q });
        reason = stopped;
    }
    if best.len() > 1 || (best.len() == 1 && way.len() == 1) {
        Ok(Run { first, q: best })
    } else {
        Err(reason.unwrap_or(Obstruction::NoApproach))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;
    use crate::plan::field::SEEDS;
    use crate::plan::surroundings::Surroundings;
    use crate::plan::waypoint::waypoints;
    use crate::plan::{IkSolver, PenTarget, PlanOptions, arms};
    use crate::robot::ArmModel;
    use crate::surface::SurfaceTarget;
    use nalgebra::{Point2, Point3, Vector3};

    /// A horizontal square of 2 m at height `z`.
    fn table(z: f64) -> TriMesh {
        let v = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Point3::new(x, y, z)).to_vec();
        TriMesh::new(v, vec![[0, 1, 2], [0, 2, 3]]).unwrap_or_else(|e| panic!("{e}"))
    }

    fn cell<'a>(arm: &'a ArmModel, home: JointVector, canvas: &'a TriMesh, options: &'a PlanOptions) -> Workcell<'a> {
        Workcell {
            solver: IkSolver::new(arm, options.limit_margin),
            surroundings: Surroundings::new(arm, canvas, &[], options),
            options,
            home,
        }
    }

    /// Points on the table along `f`, u in [0, 1].
    fn targets(z: f64, n: usize, f: impl Fn(f64) -> (f64, f64)) -> Vec<SurfaceTarget> {
        (0..=n)
            .map(|i| {
                let (x, y) = f(i as f64 / n as f64);
                SurfaceTarget {
                    position: Point3::new(x, y, z),
                    normal: Vector3::z(),
                    sheet: Point2::new(x, y),
                    width: None,
                }
            })
            .collect()
    }

    fn all(way: &[Waypoint]) -> Vec<PenTarget> {
        way.iter().map(|w| w.target).collect()
    }

    fn assert_continuous(arm: &ArmModel, way: &[Waypoint], run: &Run) {
        for (k, q) in run.q.iter().enumerate() {
            let tip = *arm.kinematics(q).world_from_tip();
            assert!((tip.translation.vector - way[run.first + k].target.position.coords).norm() < 2e-6);
            assert!((tip.rotation * Vector3::z()).dot(&way[run.first + k].target.axis) > 1.0 - 1e-9);
        }
        assert!(run.q.windows(2).all(|w| (w[1] - w[0]).amax() < 0.05));
    }

    #[test]
    fn a_spiral_on_a_table_is_one_run_for_seven_and_for_six_joints() {
        for (arm, home, z) in [(arms::iiwa(), arms::iiwa_home(), 0.3), (arms::ur5e(), arms::ur5e_home(), 0.05)] {
            let (canvas, options) = (table(z), PlanOptions::default());
            let cell = cell(&arm, home, &canvas, &options);
            let way = waypoints(
                &targets(z, 2000, |u| (0.5 + 0.1 * u * (25.0 * u).cos(), 0.1 * u * (25.0 * u).sin())),
                0,
                &options,
            );
            let field = PostureField::new(&cell, &all(&way));
            assert!(!field.references().is_empty(), "{}: nothing found", arm.name);
            let path = solve(&cell, &field, &way);
            assert_eq!((path.runs.len(), path.gaps.len(), path.searches), (1, 0, 0), "{}", arm.name);
            assert_eq!(path.runs[0].q.len(), way.len());
            assert_continuous(&arm, &way, &path.runs[0]);
        }
    }

    #[test]
    fn a_closed_stroke_closes_in_joint_space() {
        let (arm, options) = (arms::iiwa(), PlanOptions::default());
        let canvas = table(0.3);
        let cell = cell(&arm, arms::iiwa_home(), &canvas, &options);
        let turn = std::f64::consts::TAU;
        let way =
            waypoints(&targets(0.3, 900, |u| (0.5 + 0.08 * (u * turn).cos(), 0.08 * (u * turn).sin())), 0, &options);
        let field = PostureField::new(&cell, &all(&way));
        let run = &solve(&cell, &field, &way).runs[0];
        let gap = (run.q[run.q.len() - 1] - run.q[0]).amax();
        assert!(gap < 0.02, "{gap}");
    }

    #[test]
    fn what_is_out_of_reach_is_told_with_the_reason() {
        let (arm, options) = (arms::iiwa(), PlanOptions::default());
        let canvas = table(0.3);
        let cell = cell(&arm, arms::iiwa_home(), &canvas, &options);
        let way = waypoints(&targets(0.3, 600, |u| (0.45 + 0.55 * u, 0.0)), 0, &options);
        let field = PostureField::new(&cell, &all(&way));
        let path = solve(&cell, &field, &way);
        assert_eq!((path.runs.len(), path.gaps.len()), (1, 1), "{:?}", path.gaps);
        let (run, gap) = (&path.runs[0], &path.gaps[0]);
        assert_eq!((run.first, gap.last), (0, way.len() - 1));
        assert!(gap.first == run.last() + 1);
        // 0.8 m from shoulder to wrist, tip 0.2535 m below the wrist, shoulder 0.34 m over the table
        let x = way[run.last()].target.position.x;
        assert!(x > 0.75 && x < 0.81, "{x}");
        assert!(matches!(gap.reason, Obstruction::OutOfReach { .. } | Obstruction::Singular { .. }), "{}", gap.reason);
    }

    #[test]
    fn a_path_that_a_greedy_follower_loses_is_found_by_the_search() {
        let (mut arm, options) = (arms::iiwa_with_bent_pen(), PlanOptions::default());
        arm.joints[6].lower = -1.2;
        arm.joints[6].upper = 1.2;
        let canvas = table(0.3);
        let cell = cell(&arm, arms::iiwa_home(), &canvas, &options);
        // an arc round the base: whoever starts with the wrist turned one way runs into a limit on the way
        let way = waypoints(
            &targets(0.3, 1500, |u| {
                let a = -1.9 + 3.8 * u;
                (0.5 * a.cos(), 0.5 * a.sin())
            }),
            0,
            &options,
        );
        let solutions = cell.solutions(&way[0].target, SEEDS).unwrap_or_else(|e| panic!("{e}"));
        let lost = solutions.iter().find_map(|s| {
            let (q, stop) = follow(&cell, &way, 0, way.len(), s, &Guide::Posture(&s.q));
            stop.is_some().then_some((s.q, q.len()))
        });
        let Some((start, length)) = lost else { panic!("the path is too easy") };
        assert!(length < way.len());
        let field = PostureField::alone(start, way[0].target);
        let path = solve(&cell, &field, &way);
        assert!(path.searches > 0 && path.gaps.is_empty(), "{:?}", path.gaps);
        assert_eq!(path.runs.len(), 1, "{:?}", path.runs.iter().map(|r| (r.first, r.q.len())).collect::<Vec<_>>());
        assert_continuous(&arm, &way, &path.runs[0]);
    }
}
