//! Planning piece by piece, where what is believed of the canvas changes on the way.
//!
//! Every motion begins at rest where the one before it ended. Postures come from one field over the whole drawing, as in
//! [`plan`](super::plan()), so that pieces planned apart fit together.
use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use crate::math::Pose;
use crate::mesh::TriMesh;
use crate::plan::field::{PostureField, Workcell};
use crate::plan::motion::travel;
use crate::plan::path::solve;
use crate::plan::reach::Obstruction;
use crate::plan::stroke::draw;
use crate::plan::surroundings::{PenUse, Surroundings};
use crate::plan::timing::{Piece, straight};
use crate::plan::waypoint::waypoints;
use crate::plan::{
    DepthProfile, IkSolver, Knot, MotionLimits, MotionSample, PenTarget, PlanOptions, Posture, Trajectory, dexterity,
};
use crate::robot::{ArmModel, JointVector};
use crate::surface::{BelievedCanvas, SurfaceTarget};

/// Distance between poses of a straight motion along the pen's axis, m.
const AXIAL_STEP: f64 = 0.0015;
/// Largest turn of a joint while the pen stays on the canvas between two pieces, rad: more is another posture.
const SAME_POSTURE: f64 = 0.2;
/// Rest after a motion on the canvas, s.
const SETTLING: f64 = 0.15;
/// Turns of the hand from which a posture is sought, and configurations from which it is if none of them leads to one.
const TURNS: usize = 8;
const STANDS: usize = 48;
/// Time in which a motion that met something is braked, s.
const BRAKING: f64 = 0.06;

/// What plans the pieces: the arm, its furniture, and postures for all of the drawing.
pub struct StepPlanner {
    arm: Arc<ArmModel>,
    home: JointVector,
    obstacles: Arc<Vec<TriMesh>>,
    options: Arc<PlanOptions>,
    limits: MotionLimits,
    field: PostureField,
}

/// A motion straight down on a place, heights over it in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descent {
    /// Where it begins.
    pub high: f64,
    /// Where it becomes slow.
    pub slow_from: f64,
    /// Where it ends if it meets nothing.
    pub low: f64,
    /// Speed of the slow part, m/s.
    pub speed: f64,
}

/// A piece of a stroke as motion.
#[derive(Clone, Debug)]
pub struct DrawnPiece {
    /// From where the arm stood, on the canvas, to the piece's beginning at its press depth.
    pub enter: Trajectory,
    /// Along the line.
    pub draw: Trajectory,
    /// Press depth on the way along the line.
    pub depth: DepthProfile,
    /// Straight up from its end.
    pub lift: Trajectory,
    /// Index of the last target that it reaches.
    pub reached: usize,
    /// Why it reaches no farther, if it doesn't reach the last.
    pub stopped: Option<Obstruction>,
}

impl StepPlanner {
    /// A planner for places like `targets`, on a canvas believed to be like `canvas`.
    pub fn new(
        arm: &Arc<ArmModel>,
        home: &JointVector,
        targets: &[SurfaceTarget],
        canvas: &BelievedCanvas,
        obstacles: &Arc<Vec<TriMesh>>,
        options: &Arc<PlanOptions>,
    ) -> Self {
        let limits = MotionLimits::new(arm, options);
        let (arm, obstacles, options) = (Arc::clone(arm), Arc::clone(obstacles), Arc::clone(options));
        let mut planner = Self { arm, home: *home, obstacles, options, limits, field: PostureField::default() };
        let poses: Vec<PenTarget> = targets.iter().map(pose).collect();
        let field = PostureField::new(&planner.cell(canvas), &poses);
        planner.field = field;
        planner
    }

    fn cell<'c>(&'c self, canvas: &'c BelievedCanvas) -> Workcell<'c> {
        Workcell {
            solver: IkSolver::new(&self.arm, self.options.limit_margin),
            surroundings: Surroundings::new(&self.arm, &canvas.mesh, &self.obstacles, &self.options),
            options: &self.options,
            home: self.home,
        }
    }

    /// Configurations along the pen's axis over a place, `from` (m) to `to` (m) over it, as far as the arm can go; at 0 it must be
    /// able to stand.
    fn axis(
        &self,
        cell: &Workcell,
        place: &SurfaceTarget,
        near: Option<&JointVector>,
        from: f64,
        to: f64,
    ) -> Result<Vec<(f64, JointVector)>, Obstruction> {
        let target = pose(place);
        let mut why = None;
        let near = near.and_then(|q| {
            let still = Posture { reference: *q, pull: 0.0, most: 0.0 };
            cell.solver.follow(&target, q, &still).ok()
        });
        let mut references = self.field.references().iter();
        let start = near.or_else(|| references.find_map(|r| r.start(cell, &target).map_err(|e| why = Some(e)).ok()));
        let start = start.ok_or_else(|| why.unwrap_or(Obstruction::NoApproach))?.q;
        let walk = |end: f64| {
            let steps = (end.abs() / AXIAL_STEP).ceil() as usize;
            let still = Posture { reference: start, pull: 0.0, most: 0.0 };
            let mut way = vec![(0.0, start)];
            for i in 1..=steps {
                let height = end * i as f64 / steps as f64;
                let at = PenTarget { position: target.position - target.axis * height, axis: target.axis };
                let Ok(s) = cell.solver.follow(&at, &way[i - 1].1, &still) else { break };
                way.push((height, s.q));
            }
            way
        };
        let (mut up, down) = (walk(from.max(to)), walk(from.min(to)));
        up.reverse();
        up.extend(down.into_iter().skip(1));
        if from < to {
            up.reverse();
        }
        // what lies before `from` is only the way to where the arm can stand
        up.retain(|(h, _)| (from.min(to) - 1e-9..=from.max(to) + 1e-9).contains(h));
        if up.len() > 1 { Ok(up) } else { Err(Obstruction::NoApproach) }
    }

    /// From rest at `from` through the air to over a place, and from there straight down, in the posture `near` if given. `clear` is what the way through the air keeps clear of; where that can't be done, `canvas`.
    ///
    /// # Errors
    /// What is in the way.
    pub fn approach(
        &self,
        canvas: &BelievedCanvas,
        clear: &BelievedCanvas,
        place: &SurfaceTarget,
        near: Option<&JointVector>,
        from: &JointVector,
        descent: &Descent,
    ) -> Result<[Trajectory; 2], Obstruction> {
        let cell = self.cell(canvas);
        let way = self.axis(&cell, place, near, descent.high, descent.low)?;
        let over = self
            .travel(clear, from, &way[0].1)
            .or_else(|| self.travel(canvas, from, &way[0].1))
            .ok_or(Obstruction::NoApproach)?;
        let (positions, q): (Vec<Vector3<f64>>, Vec<JointVector>) =
            way.iter().map(|(h, q)| (Vector3::new(0.0, 0.0, *h), *q)).unzip();
        let mut piece = Piece::new(q, &positions, self.options.travel_speed);
        for (speed, (height, _)) in piece.speed.iter_mut().zip(&way) {
            if *height <= descent.slow_from {
                *speed = descent.speed;
            }
        }
        Ok([over, Trajectory::new(piece.time(&self.limits))])
    }

    /// Name of the arm.
    pub fn arm(&self) -> &str {
        &self.arm.name
    }

    /// Where the arm stands, pressed in, when it begins to draw these targets.
    ///
    /// # Errors
    /// What is in the way there.
    pub fn posture(
        &self,
        canvas: &BelievedCanvas,
        targets: &[SurfaceTarget],
        layer: usize,
    ) -> Result<JointVector, Obstruction> {
        let way = waypoints(targets, layer, &self.options);
        let path = solve(&self.cell(canvas), &self.field, &way);
        match path.runs.first() {
            Some(run) if run.first == 0 => Ok(run.q[0]),
            _ => Err(path.gaps.first().map_or(Obstruction::NoApproach, |g| g.reason.clone())),
        }
    }

    /// A posture near home in which something on the last link, at `last_from_tool`, is at `target`, with room round the arm and its pen.
    pub fn stand(&self, canvas: &BelievedCanvas, last_from_tool: &Pose, target: &PenTarget) -> Option<JointVector> {
        let arm = ArmModel { last_from_tip: *last_from_tool, ..(*self.arm).clone() };
        let solver = IkSolver::new(&arm, self.options.limit_margin);
        let cell = self.cell(canvas);
        let last = self.arm.dof() - 1;
        let turned = (0..TURNS).map(|i| {
            let mut q = self.home;
            q[last] += std::f64::consts::TAU * i as f64 / TURNS as f64;
            solver.clamp(&q)
        });
        let free = |seed: JointVector| {
            let q = solver.reach(target, &seed).ok()?.q;
            let k = self.arm.kinematics(&q);
            let clear = cell.surroundings.clearance(&k, PenUse::Travelling).is_clear();
            (clear && dexterity(&k) >= self.options.singularity_margin).then_some(q)
        };
        let far = |q: &JointVector| solver.distance_squared(q, &self.home);
        let nearest = |found: Vec<JointVector>| found.into_iter().min_by(|a, b| far(a).total_cmp(&far(b)));
        let near_home = nearest(turned.filter_map(free).collect());
        near_home.or_else(|| nearest((1..STANDS).map(|k| cell.configuration(k)).filter_map(free).collect()))
    }

    /// From rest at `from` to rest at `to` through the air.
    pub fn travel(&self, canvas: &BelievedCanvas, from: &JointVector, to: &JointVector) -> Option<Trajectory> {
        travel(&self.cell(canvas), from, to, &self.limits).map(|(t, _)| t)
    }

    /// From rest at `from` straight back along the pen's axis by `height` (m), or as far as the arm can.
    pub fn retreat(&self, from: &JointVector, height: f64) -> Trajectory {
        let solver = IkSolver::new(&self.arm, self.options.limit_margin);
        let tip = *self.arm.kinematics(from).world_from_tip();
        let axis = tip.rotation * Vector3::z();
        let still = Posture { reference: *from, pull: 0.0, most: 0.0 };
        let steps = (height / AXIAL_STEP).ceil().max(1.0) as usize;
        let (mut q, mut positions) = (vec![*from], vec![Vector3::zeros()]);
        for i in 1..=steps {
            let up = height * i as f64 / steps as f64;
            let at = PenTarget { position: Point3::from(tip.translation.vector - axis * up), axis };
            let Ok(s) = solver.follow(&at, &q[i - 1], &still) else { break };
            q.push(s.q);
            positions.push(Vector3::new(0.0, 0.0, up));
        }
        if q.len() < 2 {
            return Trajectory::rest(*from, 0.0);
        }
        Trajectory::new(Piece::new(q, &positions, self.options.pen_speed).time(&self.limits))
    }

    /// From what was desired last, in motion, to rest, and a wait of `wait` s there.
    pub fn brake(&self, last: &MotionSample, wait: f64) -> Trajectory {
        let (first, zero) = (Knot { time: 0.0, q: last.q, qd: last.qd, qdd: last.qdd }, JointVector::zeros());
        let q = last.q + last.qd * (0.5 * BRAKING);
        let rest = |time| Knot { time, q, qd: zero, qdd: zero };
        let mut knots = vec![first, rest(BRAKING)];
        if wait > 0.0 {
            knots.push(rest(BRAKING + wait));
        }
        Trajectory::new(knots)
    }

    /// A piece of a stroke of `layer` from where the arm stands, pen on the canvas. `None` where it would have to take
    /// another posture, for which the pen must be lifted.
    ///
    /// # Errors
    /// What is in the way at its beginning.
    pub fn piece(
        &self,
        canvas: &BelievedCanvas,
        targets: &[SurfaceTarget],
        layer: usize,
        from: &JointVector,
    ) -> Result<Option<DrawnPiece>, Obstruction> {
        let cell = self.cell(canvas);
        let way = waypoints(targets, layer, &self.options);
        let mut path = solve(&cell, &self.field, &way);
        let gap = path.gaps.first().map(|g| g.reason.clone());
        if path.runs.first().is_none_or(|r| r.first > 0) {
            return Err(gap.unwrap_or(Obstruction::NoApproach));
        }
        let run = path.runs.remove(0);
        let start = run.q[0];
        if (start - from).amax() > SAME_POSTURE {
            return Ok(None);
        }
        let drawn = draw(&cell, &way, &run, &self.limits)?;
        let tip = |q: &JointVector| self.arm.kinematics(q).world_from_tip().translation.vector;
        let slowest = 1.875 * (tip(&start) - tip(from)).norm() / self.options.landing_speed;
        let mut knots = straight(from, &start, &self.limits, slowest.max(0.05));
        let end = knots[knots.len() - 1];
        knots.push(Knot { time: end.time + SETTLING, ..end });
        let last = run.last();
        let whole = last + 1 == way.len();
        Ok(Some(DrawnPiece {
            enter: Trajectory::new(knots),
            draw: drawn.draw,
            depth: drawn.depth,
            lift: drawn.lift,
            reached: if whole { targets.len() - 1 } else { way[last].source.floor() as usize },
            stopped: if whole { None } else { Some(gap.unwrap_or(Obstruction::NoApproach)) },
        }))
    }
}

fn pose(target: &SurfaceTarget) -> PenTarget {
    PenTarget { position: target.position, axis: -target.normal }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::arms;
    use crate::surface::{Canvas, SheetFrame};
    use nalgebra::Point2;

    /// A horizontal square of 2 m at height `z`.
    fn table(z: f64) -> BelievedCanvas {
        let v = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Point3::new(x, y, z)).to_vec();
        let mesh = TriMesh::new(v, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let sheet = SheetFrame { world_from_sheet: Pose::identity() };
        BelievedCanvas(Canvas { name: "table".into(), mesh, sheet })
    }

    fn place(x: f64, y: f64, z: f64) -> SurfaceTarget {
        SurfaceTarget { position: Point3::new(x, y, z), normal: Vector3::z(), sheet: Point2::new(x, y), width: None }
    }

    #[test]
    fn steps_follow_each_other_and_the_pen_stays_down_between_pieces() {
        let (arm, home, options) = (arms::iiwa(), arms::iiwa_home(), PlanOptions::default());
        let line = |a: usize, z: f64| -> Vec<SurfaceTarget> {
            (a..=a + 20).map(|i| place(0.5, 0.002 * i as f64 - 0.04, z)).collect()
        };
        let all: Vec<SurfaceTarget> = (0..=40).map(|i| place(0.5, 0.002 * f64::from(i) - 0.04, 0.3)).collect();
        let (canvas, clear) = (table(0.3), table(0.305));
        let (arm, options) = (Arc::new(arm), Arc::new(options));
        let planner = StepPlanner::new(&arm, &home, &all, &canvas, &Arc::default(), &options);
        let tip = |q: &JointVector| arm.kinematics(q).world_from_tip().translation.vector;
        let end = |t: &Trajectory| t.knots()[t.knots().len() - 1].q;

        let fall = Descent { high: 0.012, slow_from: 0.005, low: -0.01, speed: 0.008 };
        let [over, down] = planner.approach(&canvas, &clear, &all[0], None, &home, &fall).unwrap();
        assert_eq!((over.knots()[0].q, end(&over)), (home, down.knots()[0].q));
        assert!((tip(&end(&over)).z - 0.312).abs() < 1e-5 && (tip(&end(&down)).z - 0.29).abs() < 1e-5);
        // it touches a little higher than was believed
        let times = (0..).map(|i| 1e-3 * f64::from(i));
        let m = times.map(|t| down.sample(t, &mut 0)).find(|m| tip(&m.q).z < 0.3005).unwrap();
        let rest = end(&planner.brake(&m, 0.1));
        let met = table(0.3008);
        let first = planner.piece(&met, &line(0, 0.3008), 0, &rest).unwrap().unwrap();
        assert_eq!((first.enter.knots()[0].q, first.reached, first.stopped.is_none()), (rest, 20, true));
        assert!((tip(&end(&first.enter)).z - (0.3008 - options.press.default)).abs() < 1e-5);
        let second = planner.piece(&met, &line(20, 0.3008), 0, &end(&first.draw)).unwrap().unwrap();
        assert!((second.enter.knots()[0].q - second.draw.knots()[0].q).amax() < 5e-3);
        let up = planner.retreat(&end(&second.draw), 0.02);
        assert!((tip(&end(&up)).z - tip(&end(&second.draw)).z - 0.02).abs() < 1e-5);
    }
}
