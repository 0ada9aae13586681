//! What a base does to find out where it stands once it has arrived, and what it does before it leaves: looks, and feels the wall.
use std::sync::Arc;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::CameraModel;
use super::find::{Look, LookRefused, useful};
use super::register::{DrawnPoint, Evidence, MountBelief, Sighting, WallFrame};
use super::view::{View, drawn_points, probes, views};
use crate::math::Pose;
use crate::plan::{Descent, MotionSample, PenTarget, PlanError, SagModel, SegmentKind, StepPlanner, Trajectory};
use crate::robot::{ArmModel, JointVector};
use crate::skill::{DriveJob, Felt, Outcome, Picture, PolicyError, Task};
use crate::surface::{SurfaceDrawing, SurfaceTarget};

/// How long the pen rests where it met the wall, s.
const DWELL: f64 = 0.12;
/// Touches of that rest that are averaged.
const AVERAGED: usize = 6;
/// Angles to the wall's normal from which it looks, rad: the first that the arm can take.
const TILTS: [f64; 4] = [0.0, 0.35, 0.6, -0.35];
/// How sure a base is of where its wall is once it has felt it: off it (m) and of its heading (rad).
const FELT_SPREAD: [f64; 2] = [1.5e-4, 3e-4];

/// How a base aligns itself.
#[derive(Clone, Debug, PartialEq)]
pub struct LookOptions {
    /// The camera as the robot knows it.
    pub camera: CameraModel,
    /// How well it is calibrated: standard deviations along (m) and about (rad) each axis.
    pub mount: [f64; 2],
    /// Distance from which it looks at the canvas, m.
    pub distance: f64,
    /// Time for which the arm stands before a picture is taken, s.
    pub settle: f64,
    /// How far off the belief may be: along the wall and off it (m), and in heading (rad).
    pub search: [f64; 2],
    /// Whether it looks back at its own lines before it leaves, and learns from them how the camera is mounted.
    pub look_back: bool,
    /// How it feels the wall; `None` where it doesn't.
    pub feel: Option<FeelOptions>,
    /// Width of each layer's line, m.
    pub widths: Vec<f64>,
    /// Lines that are printed on the canvas, as they are believed to lie on it.
    pub marks: Option<SurfaceDrawing>,
}

impl LookOptions {
    /// What is known of the camera's mount before anything is seen.
    pub(in crate::skill) fn calibrated(&self) -> MountBelief {
        MountBelief::calibrated(self.mount[0], self.mount[1])
    }
}

/// How the wall is felt.
#[derive(Clone, Debug, PartialEq)]
pub struct FeelOptions {
    /// Force along the pen that means contact, N.
    pub force: f64,
    /// Speed at which the pen comes down, m/s.
    pub speed: f64,
    /// Stiffness of each layer's nib, N/m.
    pub springs: Vec<f64>,
}

/// What a base found out about itself at a place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Aligned {
    /// Number of the place.
    pub place: usize,
    /// When, s.
    pub time: f64,
    /// Whether it was about to leave, and learned how its camera is mounted.
    pub leaving: bool,
    /// Pictures taken.
    pub pictures: usize,
    /// Points of lines that were used.
    pub points: usize,
    /// What is left across the lines, root of the mean square, px; 0 without a picture.
    pub rms_px: f64,
    /// Points at which the wall was felt.
    pub felt: usize,
    /// By how much the believed place was moved, m, and the heading turned, rad.
    pub correction: [f64; 2],
    /// Why a picture was of no use.
    pub refused: Option<LookRefused>,
}

/// What changes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(in crate::skill) struct AlignmentState {
    step: Step,
    leaving: bool,
    /// Where the arm was commanded to be last, and how, rad.
    last: MotionSample,
    sightings: Vec<Sighting>,
    /// Points of the wall that were felt, base frame, m.
    felt: Vec<Point3<f64>>,
    /// The view that is looked at.
    middle: Option<(Point3<f64>, Vector3<f64>)>,
    /// Whether that is of what is printed.
    printed: bool,
    /// Where the base stands by what was seen: the pen feels where lines are to be, against those that are there.
    seen: Option<Pose>,
    down: Option<Trajectory>,
    mount: MountBelief,
    /// Whether the wall was felt at this place.
    sure: bool,
    now: Option<Aligned>,
    done: Vec<Aligned>,
}

/// What is done next; after it is given as a task, what is under way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
enum Step {
    /// Nothing.
    Idle,
    /// Going to where the camera looks.
    View,
    /// The picture.
    Shoot,
    /// Going over the place of a probe.
    Probe(usize),
    /// Down until the wall is felt.
    Down(usize),
    /// Resting on it.
    Rest(usize),
    /// Off the wall.
    Leave(usize),
    /// Folding the arm.
    Fold,
}

/// What surrounds it: the job, the place, and where the base stands.
pub(in crate::skill) struct Surrounds<'a> {
    pub job: &'a DriveJob,
    pub options: &'a LookOptions,
    pub place: usize,
    /// Where the base stands, as the law believes.
    pub stands: Pose,
    /// Layer of the pen in the holder.
    pub layer: usize,
    /// What is known of the camera's mount before anything is seen.
    pub calibrated: MountBelief,
}

/// Aligns a base, place after place.
pub(in crate::skill) struct Alignment {
    pub state: AlignmentState,
    planner: Option<StepPlanner>,
}

impl Alignment {
    /// One that has found out nothing yet.
    pub fn new(options: &LookOptions, folded: &JointVector) -> Self {
        let zero = JointVector::zeros();
        let state = AlignmentState {
            step: Step::Idle,
            leaving: false,
            last: MotionSample { q: *folded, qd: zero, qdd: zero },
            sightings: Vec::new(),
            felt: Vec::new(),
            middle: None,
            printed: false,
            seen: None,
            down: None,
            mount: options.calibrated(),
            sure: false,
            now: None,
            done: Vec::new(),
        };
        Self { state, planner: None }
    }

    /// Goes on from a saved state.
    pub fn restore(&mut self, state: AlignmentState) {
        (self.state, self.planner) = (state, None);
    }

    /// What was found out, place after place.
    pub fn done(&self) -> &[Aligned] {
        &self.state.done
    }

    /// Begins at a place: when it has arrived, or when it is about to leave. The arm is folded.
    pub fn begin(&mut self, place: usize, leaving: bool, folded: &JointVector) {
        let s = &mut self.state;
        let zero = JointVector::zeros();
        s.last = MotionSample { q: *folded, qd: zero, qdd: zero };
        (s.step, s.leaving, s.middle, s.seen, s.down) = (Step::View, leaving, None, None, None);
        s.sightings.clear();
        s.felt.clear();
        if !leaving {
            s.sure = false;
        }
        s.now = Some(Aligned {
            place,
            time: 0.0,
            leaving,
            pictures: 0,
            points: 0,
            rms_px: 0.0,
            felt: 0,
            correction: [0.0; 2],
            refused: None,
        });
        self.planner = None;
    }

    /// The next task; `None` when the arm is folded again and all is found out.
    pub fn next(&mut self, around: &Surrounds) -> Result<Option<Task>, PolicyError> {
        loop {
            match self.state.step {
                Step::Idle => return Ok(None),
                Step::View => match self.way_to_view(around) {
                    Some(way) => return Ok(Some(self.alone(around, SegmentKind::Travel, way))),
                    None => self.state.step = self.after_look(),
                },
                Step::Shoot => return Ok(Some(Task::Look(around.options.settle))),
                Step::Probe(i) => match self.way_to_probe(around, i) {
                    Some(way) => return Ok(Some(self.alone(around, SegmentKind::Travel, way))),
                    None if i < self.places(around).len() => self.state.step = Step::Probe(i + 1),
                    None => self.state.step = Step::Fold,
                },
                Step::Down(i) => {
                    let Some(down) = self.state.down.take() else {
                        self.state.step = Step::Probe(i + 1);
                        continue;
                    };
                    let force = around.options.feel.as_ref().map_or(1.0, |f| f.force);
                    let Task::Press(down) = self.alone(around, SegmentKind::Press, down) else { continue };
                    return Ok(Some(Task::Probe(down, force)));
                }
                Step::Rest(_) => {
                    let last = self.state.last;
                    let rest = self.planner(around).brake(&last, DWELL);
                    return Ok(Some(self.alone(around, SegmentKind::Press, rest)));
                }
                Step::Leave(_) => {
                    let (last, height) = (self.state.last.q, 2.0 * around.options.search[0] + around.job.options.hover);
                    let up = self.planner(around).retreat(&last, height);
                    return Ok(Some(self.alone(around, SegmentKind::Lift, up)));
                }
                Step::Fold => {
                    let (last, folded) = (self.state.last.q, around.job.base.transport);
                    if (last - folded).amax() == 0.0 {
                        self.state.step = Step::Idle;
                        continue;
                    }
                    let canvas = &around.job.canvas;
                    let way = self.planner(around).travel(canvas, &last, &folded);
                    let no_way = || PlanError::NoWay { arm: around.job.arm.name.clone(), leg: "back from looking" };
                    return Ok(Some(self.alone(around, SegmentKind::Travel, way.ok_or_else(no_way)?)));
                }
            }
        }
    }

    /// Hears how a task has ended.
    pub fn ended(&mut self, around: &Surrounds, outcome: &Outcome) {
        self.state.last = outcome.reference;
        if let Some(now) = &mut self.state.now {
            now.time = outcome.time;
        }
        self.state.step = match self.state.step {
            Step::View => Step::Shoot,
            Step::Shoot => {
                if let Some(picture) = &outcome.picture {
                    self.look(around, picture);
                }
                self.after_look()
            }
            Step::Probe(i) => Step::Down(i),
            Step::Down(i) if outcome.failure.is_none() => Step::Rest(i),
            Step::Down(i) => Step::Leave(i),
            Step::Rest(i) => {
                self.feel(around, outcome);
                Step::Leave(i)
            }
            Step::Leave(i) => Step::Probe(i + 1),
            Step::Fold | Step::Idle => Step::Idle,
        };
    }

    fn after_look(&self) -> Step {
        if self.state.leaving { Step::Fold } else { Step::Probe(0) }
    }

    fn alone(&self, around: &Surrounds, kind: SegmentKind, trajectory: Trajectory) -> Task {
        Task::alone(kind, around.layer, None, trajectory)
    }

    fn planner(&mut self, around: &Surrounds) -> &StepPlanner {
        let targets = self.places(around).into_iter().flatten().collect::<Vec<_>>();
        let stands = self.state.seen.unwrap_or(around.stands);
        self.planner.get_or_insert_with(|| {
            let job = around.job;
            let mut arm = job.arm.clone();
            arm.world_from_base = stands * job.base.base_from_arm;
            StepPlanner::new(&Arc::new(arm), &job.home, &targets, &job.canvas, &job.obstacles, &job.options)
        })
    }

    /// What is looked at: lines of this place when it looks back, else lines of earlier places, or what is printed.
    fn drawn(&self, around: &Surrounds, printed: bool) -> Vec<DrawnPoint> {
        let (places, widths) = (&around.job.places, &around.options.widths);
        if self.state.leaving {
            return drawn_points(&places[around.place].drawing, widths, true);
        }
        if printed {
            return around.options.marks.iter().flat_map(|m| drawn_points(m, widths, false)).collect();
        }
        places[..around.place].iter().flat_map(|p| drawn_points(&p.drawing, widths, false)).collect()
    }

    /// The way to where the camera looks at drawn lines near what is to be drawn next; at what is printed where there are none.
    fn way_to_view(&mut self, around: &Surrounds) -> Option<Trajectory> {
        let way = self.view_of(around, false);
        let printed = way.is_none() && !self.state.leaving;
        self.state.printed = printed;
        if printed { self.view_of(around, true) } else { way }
    }

    fn view_of(&mut self, around: &Surrounds, printed: bool) -> Option<Trajectory> {
        let drawn = self.drawn(around, printed);
        let next = around.place + usize::from(self.state.leaving);
        let near: Vec<Point3<f64>> = targets(&around.job.places.get(next)?.drawing).map(|t| t.position).collect();
        let (camera, distance) = (&around.options.camera, around.options.distance);
        let tool = camera.last_from_camera * Pose::translation(0.0, 0.0, distance);
        let from = self.state.last.q;
        for View { middle, normal } in views(&drawn, &near, camera.half_view(distance)) {
            let canvas = &around.job.canvas;
            let Some(wall) = WallFrame::at(middle, &normal) else { continue };
            // an eye that can't be straight before the wall may be nearer to the arm
            let aside = (around.stands.translation.vector - middle.coords).dot(&wall.along).signum();
            for tilt in TILTS {
                let turn = UnitQuaternion::from_scaled_axis(wall.off.cross(&wall.along) * (aside * tilt));
                let target = PenTarget { position: middle, axis: turn * -normal };
                let planner = self.planner(around);
                let Some(q) = planner.stand(canvas, &tool, &target) else { continue };
                if let Some(way) = planner.travel(canvas, &from, &q) {
                    self.state.middle = Some((middle, normal));
                    return Some(way);
                }
            }
        }
        None
    }

    /// Reads a picture.
    fn look(&mut self, around: &Surrounds, picture: &Picture) {
        let drawn = self.drawn(around, self.state.printed);
        let Some(wall) = self.state.middle.and_then(|(m, n)| WallFrame::at(m, &n)) else { return };
        let at = around.base_from_hand(&picture.q) * around.options.camera.last_from_camera;
        let e = self.evidence(around, wall);
        let look = Look::new(picture, at, &drawn, &e);
        let largest = around.options.search.map(|s| 2.0 * s);
        let leaving = self.state.leaving;
        let found = look.find(&e).and_then(|(sighting, estimate)| {
            if leaving { Ok(()) } else { useful(&estimate, largest) }.map(|()| (sighting, estimate))
        });
        let Some(now) = &mut self.state.now else { return };
        now.pictures += 1;
        match found {
            Ok((sighting, estimate)) => {
                (now.points, now.rms_px) = (sighting.points.len(), estimate.rms_px);
                if leaving {
                    self.state.mount = estimate.mount().unwrap_or_else(|| self.state.mount.clone());
                } else {
                    self.state.sightings.push(sighting);
                    self.state.seen = Some(wall.correction(&estimate.x) * around.stands);
                    self.planner = None;
                }
            }
            Err(refused) => now.refused = Some(refused),
        }
    }

    /// All that is known now.
    fn evidence<'a>(&'a self, around: &'a Surrounds, wall: WallFrame) -> Evidence<'a> {
        let [place, turn] = around.options.search.map(|s| 0.5 * s);
        let spread = match (self.state.leaving, self.state.sure) {
            (true, true) => [place, FELT_SPREAD[0], FELT_SPREAD[1]],
            _ => [place, place, turn],
        };
        Evidence {
            camera: &around.options.camera,
            // learned anew each time, so that no error of one place is carried on for good
            mount: if self.state.leaving { &around.calibrated } else { &self.state.mount },
            world_from_base: around.stands,
            wall,
            spread,
            sightings: &self.state.sightings,
            felt: &self.state.felt,
            canvas: &around.job.canvas.mesh,
        }
    }

    /// Places at which the wall is felt, each with places to go to instead.
    fn places(&self, around: &Surrounds) -> Vec<Vec<SurfaceTarget>> {
        if around.options.feel.is_none() || self.state.leaving {
            return Vec::new();
        }
        let drawing = &around.job.places[around.place].drawing;
        // a touch leaves a dot: it is made on a line of the same ink, if there is one
        let own: Vec<SurfaceTarget> = drawing
            .layers
            .get(around.layer)
            .map_or_else(Vec::new, |l| l.strokes.iter().flat_map(|s| s.targets.iter().copied()).collect());
        if own.is_empty() { probes(&targets(drawing).copied().collect::<Vec<_>>()) } else { probes(&own) }
    }

    /// The way to over a probe; the way down is kept.
    fn way_to_probe(&mut self, around: &Surrounds, i: usize) -> Option<Trajectory> {
        let feel = around.options.feel.as_ref()?;
        let places = self.places(around).get(i)?.clone();
        let (from, search, canvas) = (self.state.last.q, around.options.search[0], &around.job.canvas);
        let high = search + around.job.options.hover;
        let descent = Descent { high, slow_from: high, low: -search, speed: feel.speed };
        let planner = self.planner(around);
        let way = places.iter().find_map(|p| planner.approach(canvas, canvas, p, None, &from, &descent).ok());
        let [over, down] = way?;
        self.state.down = Some(down);
        Some(over)
    }

    /// Learns where the wall is from what the pen felt as it rested on it.
    fn feel(&mut self, around: &Surrounds, outcome: &Outcome) {
        let Some(feel) = &around.options.feel else { return };
        let spring = feel.springs.get(around.layer).copied().unwrap_or(f64::INFINITY);
        let surface = |f: &Felt| f.tip - f.axis * (f.force / spring);
        let last: Vec<Point3<f64>> = outcome.felt.iter().rev().take(AVERAGED).map(surface).collect();
        if last.is_empty() {
            return;
        }
        let mean = Point3::from(last.iter().map(|p| p.coords).sum::<Vector3<f64>>() / last.len() as f64);
        // the robot's own kinematics put it on a base that doesn't give way
        let sag = around.sag(&outcome.reference.q);
        self.state.felt.push(sag * (around.stands.inverse() * mean));
    }

    /// Where the base stands, by all that was found out; `None` where nothing was.
    pub fn conclude(&mut self, around: &Surrounds) -> Option<Pose> {
        let mut now = self.state.now.take()?;
        let middle = Point3::from(
            self.state.felt.iter().map(|p| p.coords).sum::<Vector3<f64>>() / self.state.felt.len().max(1) as f64,
        );
        let middle = around.job.canvas.mesh.closest_point(&(around.stands * middle));
        let wall = match (self.state.sightings.is_empty(), self.state.middle) {
            (false, Some((m, n))) => WallFrame::at(m, &n),
            _ => WallFrame::at(middle.position, &middle.normal),
        };
        let nothing = self.state.sightings.is_empty() && self.state.felt.is_empty();
        let known = !(self.state.leaving || nothing);
        let stands = wall.filter(|_| known).map(|wall| {
            let e = self.evidence(around, wall);
            let estimate = e.solve(e.prior());
            now.correction = [estimate.x[0].hypot(estimate.x[1]), estimate.x[2].abs()];
            wall.correction(&estimate.x) * around.stands
        });
        now.felt = self.state.felt.len();
        if !self.state.leaving {
            self.state.sure = now.felt >= 3;
        }
        if now.pictures > 0 || now.felt > 0 {
            self.state.done.push(now);
        }
        stands
    }
}

impl Surrounds<'_> {
    /// The arm on a base that stands at the origin.
    fn arm(&self) -> ArmModel {
        let mut arm = self.job.arm.clone();
        arm.world_from_base = self.job.base.base_from_arm;
        arm
    }

    /// How the base gives way under the arm at `q`, as far as the robot knows: a pose in the frame in which it was measured.
    fn sag(&self, q: &JointVector) -> Pose {
        let DriveJob { arm, base, sag_known, hand, .. } = self.job;
        if *sag_known <= 0.0 {
            return Pose::identity();
        }
        SagModel::new(base, arm, &base.transport, *sag_known, *hand).sag(q).unwrap_or_else(Pose::identity)
    }

    /// The arm's last link at `q` (rad), in the frame of the base as it was measured.
    fn base_from_hand(&self, q: &JointVector) -> Pose {
        let arm = self.arm();
        self.sag(q) * arm.kinematics(q).world_from_link(arm.dof())
    }
}

fn targets(drawing: &SurfaceDrawing) -> impl Iterator<Item = &SurfaceTarget> {
    drawing.layers.iter().flat_map(|l| &l.strokes).flat_map(|s| &s.targets)
}
