//! The tool change as a machine of stages: what to do next, from what the robot senses alone.
//!
//! Picking is the dissertation's sequence (section VII.B.2): approach, half-grasp, vertical lift, full grasp. Returning is its exact
//! reverse. Where hand or tool may touch the dock, the hand gives way to what the wrist feels. Every stage has its own check; a stage
//! that fails sets the pen down in its dock, opens and backs off, and the whole is tried again or given up with the pen left
//! standing. A pen that does not find its dock is kept in the hand.
use std::collections::VecDeque;

use nalgebra::{Translation3, Vector3};

use super::change_options::grip_at;
use super::compliance::Compliance;
use super::{ChangeError, ChangeOptions, HandCommand, HandModel, OPEN, Order, Senses, Stage};
use crate::math::Pose;
use crate::robot::GRAVITY;
use crate::tool::ToolSet;

/// How far first joints may stand off where they are expected, rad.
const FINGER_TOLERANCE: f64 = 0.06;
/// How far first joints may in the half-grasp, where a tilted tool stops one finger early, rad: 10 mm at the second joint.
const HALF_TOLERANCE: f64 = 0.18;
/// How far second joints may, rad.
const WRAP_TOLERANCE: f64 = 0.12;
/// Share of the speed at which a pen is pushed against its dock: the arm's mass strikes what it meets.
const PUSHING: f64 = 0.15;
/// Share of the speed at which a pen goes down to a dock that it may meet beside the mouth.
const LOWERING: f64 = 0.5;
/// How far a lowered pen is pushed sideways, m, to feel that it stands in its dock, and the least force there, N. Outside it at most
/// one of two opposite pushes meets a wall; in the guide's clearance both press 4 mm against some 1800 N/m, less what the nose leaned
/// already.
const PUSH: f64 = 6e-3;
const WALL: f64 = 2.0;
/// A lowered pen that presses the hand up with more than this stands on something else than its dock, N: three times the usual
/// errors are felt with 19 N, the rim of the dock with 36 N or more.
const STANDING: f64 = 25.0;
/// Time for which a pen that is being set down may be pressed with more than the limit, s: shocks are shorter.
const PATIENCE: f64 = 0.1;

#[derive(Clone, Copy, Debug)]
struct Step {
    stage: Stage,
    to: Pose,
    hand: HandCommand,
    /// Whether the stage goes on in the next step: nothing is checked yet.
    goes_on: bool,
    /// A direction, world, in which the dock's wall must be felt.
    wall: Option<Vector3<f64>>,
}

impl Step {
    fn new(stage: Stage, to: Pose, hand: HandCommand) -> Self {
        Self { stage, to, hand, goes_on: false, wall: None }
    }

    /// Whether the hand gives way: the tool is between fingers and dock.
    fn yields(&self) -> bool {
        use Stage::{HalfGrasp, HalfRelease, Lift, Lower, Seat};
        self.wall.is_none() && matches!(self.stage, HalfGrasp | Lift | Lower | HalfRelease | Seat)
    }

    /// A push from here in a direction (world) in which a wall must be felt.
    fn pushed(self, way: Vector3<f64>) -> Self {
        let to = Translation3::from(way * PUSH) * self.to;
        Self { to, goes_on: true, wall: Some(way), ..self }
    }

    /// The same, to go on in the next step.
    fn unchecked(self) -> Self {
        Self { goes_on: true, ..self }
    }
}

/// What was sensed while arm and fingers have been where they is to be: means outvote noise.
#[derive(Clone, Copy, Debug, Default)]
struct Rest {
    time: f64,
    samples: f64,
    /// Sums of the force, N, world, and of the finger joints, rad.
    force: Vector3<f64>,
    fingers: [[f64; 3]; 3],
}

impl Rest {
    fn add(&mut self, force: &Vector3<f64>, fingers: &[[f64; 3]; 3], dt: f64) {
        self.time += dt;
        self.samples += 1.0;
        self.force += force;
        for (sum, q) in self.fingers.iter_mut().flatten().zip(fingers.iter().flatten()) {
            *sum += q;
        }
    }
}

/// A tool change that is under way.
pub struct ToolChange {
    order: Order,
    options: ChangeOptions,
    world_from_dock: Pose,
    weight: f64,
    gap: f64,
    lift: f64,
    half_angle: f64,
    loose_angle: f64,
    flat_angle: f64,
    bevel: Option<f64>,
    queue: VecDeque<Step>,
    from: Pose,
    /// Where the hand is to be, and where it would be if it did not give way.
    goal: Pose,
    way: Pose,
    compliance: Compliance,
    hand: HandCommand,
    time: f64,
    rest: Rest,
    /// Time for which the wrist has felt more than it may, s.
    pressed: f64,
    attempt: u32,
    failures: Vec<ChangeError>,
    recovering: bool,
    finished: Vec<Stage>,
}

impl ToolChange {
    /// A change of the tool of `set` at a dock believed to be at `world_from_dock` (pose of the seated tool). The hand stands at
    /// `grip`: for a pick somewhere before the dock, for a return somewhere above it.
    pub fn new(
        order: Order,
        hand: &HandModel,
        set: &ToolSet,
        world_from_dock: &Pose,
        grip: &Pose,
        options: &ChangeOptions,
    ) -> Self {
        let mut change = Self {
            order,
            world_from_dock: *world_from_dock,
            weight: set.tool.mass * GRAVITY,
            gap: set.tool.plates.map_or(0.0, |p| p.gap),
            lift: set.clear_lift() + options.clearance,
            half_angle: hand.close_angle(set.tool.width + 2.0 * options.slack),
            loose_angle: hand.close_angle(set.tool.width + 2.0 * options.looseness),
            flat_angle: hand.close_angle(set.tool.width),
            bevel: set.tool.bevel.map(|b| b.angle),
            queue: VecDeque::new(),
            from: *grip,
            goal: *grip,
            way: *grip,
            compliance: Compliance::new(),
            hand: HandCommand::open(),
            time: 0.0,
            rest: Rest::default(),
            pressed: 0.0,
            attempt: 1,
            failures: Vec::new(),
            recovering: false,
            finished: Vec::new(),
            options: options.clone(),
        };
        if order == Order::Return {
            change.hand = change.full();
        }
        change.enqueue();
        change
    }

    fn grip_at(&self, back: f64, up: f64) -> Pose {
        grip_at(&self.world_from_dock, back, up)
    }

    fn open(&self) -> HandCommand {
        HandCommand { close: OPEN, wrap: 0.0, ..self.half() }
    }

    fn half(&self) -> HandCommand {
        let o = &self.options;
        HandCommand { close: self.half_angle, force: o.grip[0], speed: o.finger_speed, ..HandCommand::open() }
    }

    fn full(&self) -> HandCommand {
        let [close, wrap] = self.options.squeeze;
        HandCommand {
            close: self.flat_angle + close,
            wrap: (self.bevel.unwrap_or(std::f64::consts::FRAC_PI_2) + wrap).min(1.5),
            force: self.options.grip[1],
            ..self.half()
        }
    }

    /// Pads off the flat sides, still under the plates.
    fn loose(&self) -> HandCommand {
        HandCommand { close: self.loose_angle, ..self.half() }
    }

    /// Flat sides pressed, bevels free.
    fn squeezed(&self) -> HandCommand {
        HandCommand { wrap: 0.0, ..self.full() }
    }

    fn enqueue(&mut self) {
        let o = self.options.clone();
        let lifted = self.lifted();
        let steps = match self.order {
            Order::Pick => vec![
                Step::new(Stage::Approach, self.grip_at(o.standoff, -o.below), self.open()),
                Step::new(Stage::HalfGrasp, self.grip_at(o.standoff, -o.below), self.half()),
                // loosened, a tilted tool neither jams in the guide nor sticks between the pads: it hangs on the fingers
                Step::new(Stage::Lift, lifted, self.loose()).unchecked(),
                Step::new(Stage::Lift, lifted, self.half()),
                // flat sides first: while nothing rubs on the palm, they find the middle
                Step::new(Stage::FullGrasp, lifted, self.squeezed()).unchecked(),
                Step::new(Stage::FullGrasp, lifted, self.full()),
            ],
            Order::Return => {
                let low = self.grip_at(0.0, self.gap + o.drop);
                let lower = Step::new(Stage::Lower, low, self.full());
                let [x, y] = [Vector3::x(), Vector3::y()].map(|v| self.world_from_dock.rotation * v);
                // twice: what leans on the guide still gives way in the first rest
                let mut steps = vec![lower.unchecked(); 2];
                steps.extend([x, -x, y, -y].map(|way| lower.pushed(way)));
                steps.extend([lower, Step::new(Stage::HalfRelease, low, self.half())]);
                steps.extend(self.letting_go());
                steps
            }
        };
        self.queue = steps.into();
    }

    /// Above the dock, nose clear of it.
    fn lifted(&self) -> Pose {
        let back = if self.order == Order::Pick { self.options.standoff } else { 0.0 };
        self.grip_at(back, self.gap + self.lift)
    }

    /// The end of a return, and of every failed attempt: pen in its seat, hand open and away.
    fn letting_go(&self) -> [Step; 3] {
        let (back, low) = (self.options.standoff, -self.options.below);
        [
            Step::new(Stage::Seat, self.grip_at(back, low), self.half()),
            Step::new(Stage::Release, self.grip_at(back, low), self.open()),
            self.retreat(),
        ]
    }

    fn retreat(&self) -> Step {
        Step::new(Stage::Retreat, self.options.ready(&self.world_from_dock), self.open())
    }

    /// The stage under way; `None` when all is done or given up.
    pub fn stage(&self) -> Option<Stage> {
        self.queue.front().map(|s| s.stage)
    }

    /// Stages that ended well, in order; one of a failed attempt stays.
    pub fn finished(&self) -> &[Stage] {
        &self.finished
    }

    /// Whether all stages of the order passed their checks.
    pub fn succeeded(&self) -> bool {
        self.queue.is_empty() && !self.recovering
    }

    /// What failed, in order.
    pub fn failures(&self) -> &[ChangeError] {
        &self.failures
    }

    /// Attempts made, the current one included.
    pub fn attempts(&self) -> u32 {
        self.attempt
    }

    /// Goes on by `dt` s: where the grip frame is to be, and what the hand shall do.
    pub fn update(&mut self, senses: &Senses, dt: f64) -> (Pose, HandCommand) {
        let Some(step) = self.queue.front().copied() else { return (self.goal, self.hand) };
        let up = self.world_from_dock.rotation * Vector3::z();
        let (force, torque) = self.compliance.feel(senses);
        if self.time == 0.0 {
            self.from = self.way;
            self.rest = Rest::default();
        }
        if step.yields() {
            self.compliance.give_way(&force, &torque, &up, dt);
        }
        self.time += dt * self.compliance.pace(force.norm(), dt);
        self.hand = step.hand;
        let length = (step.to.translation.vector - self.from.translation.vector).norm();
        let share = match (step.wall, step.stage) {
            (Some(_), _) => PUSHING,
            (None, Stage::Lower) => LOWERING,
            _ => 1.0,
        };
        let duration = (length / (share * self.options.speed)).max(0.05);
        self.way = self.from.lerp_slerp(&step.to, minimum_jerk((self.time / duration).min(1.0)));
        self.goal = self.compliance.yielded(&self.way);
        if self.time >= duration && senses.hand_arrived {
            self.rest.add(&force, &senses.hand.q, dt);
        }
        let [force_limit, torque_limit] = self.options.limits;
        let (force, torque) = (force.norm(), torque.norm());
        let much = force > force_limit || torque > torque_limit;
        self.pressed = if much { self.pressed + dt } else { 0.0 };
        if much && !self.recovering {
            self.fail(ChangeError::Collision { stage: step.stage, force, torque, force_limit, torque_limit }, senses);
        } else if self.recovering && self.pressed > PATIENCE && step.stage == Stage::Lower {
            // the dock isn't there: better kept than dropped
            self.queue.clear();
        } else if self.rest.time >= self.options.settle || (self.recovering && self.pressed > PATIENCE) {
            self.pressed = 0.0;
            let held = step.wall.map(|way| -self.rest.force.dot(&way) / self.rest.samples.max(1.0));
            if let Some(force) = held.filter(|f| *f < WALL && !self.recovering) {
                self.fail(ChangeError::NoWall { stage: step.stage, force, least: WALL }, senses);
            } else {
                let passed = if step.goes_on && step.stage != Stage::Lower { Ok(()) } else { self.check(step.stage) };
                match passed {
                    Err(e) if !self.recovering => self.fail(e, senses),
                    _ if step.goes_on => {
                        self.queue.pop_front();
                        self.time = 0.0;
                    }
                    _ => self.advance(step.stage),
                }
            }
        }
        (self.goal, self.hand)
    }

    fn advance(&mut self, stage: Stage) {
        self.queue.pop_front();
        self.time = 0.0;
        if !self.recovering {
            self.finished.push(stage);
        } else if self.queue.is_empty() && self.attempt < self.options.attempts && self.may_try_again() {
            self.attempt += 1;
            self.recovering = false;
            self.enqueue();
        }
    }

    /// Whether the tool is where the order found it. After a return that let go, what is in the dock stays there.
    fn may_try_again(&self) -> bool {
        self.order == Order::Pick || self.failures.last().is_some_and(|e| e.stage() == Stage::Lower)
    }

    /// Puts the pen down and backs off, or takes it up again when it has not found its dock. By how much the hand has given way since
    /// it met the tool, it stands off also when it tries again.
    fn fail(&mut self, error: ChangeError, senses: &Senses) {
        // what slid off the dock's rim finds the mouth on the other side
        if matches!(error, ChangeError::NoWall { .. }) {
            self.compliance.mirror();
        }
        self.failures.push(error);
        self.recovering = true;
        self.time = 0.0;
        self.pressed = 0.0;
        let stage = error.stage();
        if self.order == Order::Pick && stage <= Stage::HalfGrasp {
            self.compliance.straighten();
        }
        self.goal = senses.world_from_grip;
        self.way = self.compliance.unyielded(&self.goal);
        self.queue = match (self.order, stage) {
            (_, Stage::Approach) => vec![self.retreat()],
            (_, Stage::HalfGrasp) => vec![Step::new(Stage::Release, self.way, self.open()), self.retreat()],
            (Order::Return, Stage::Lower) => vec![Step::new(Stage::Lift, self.lifted(), self.full())],
            // above the dock: straight down first, with what the fingers hold held as it is
            (Order::Pick, _) if self.hand.wrap > 0.0 => {
                let low = self.grip_at(self.options.standoff, self.gap + self.options.drop);
                [&[Step::new(Stage::Lower, low, self.hand)][..], &self.letting_go()].concat()
            }
            _ => self.letting_go().to_vec(),
        }
        .into();
    }

    fn check(&self, stage: Stage) -> Result<(), ChangeError> {
        let n = self.rest.samples.max(1.0);
        let within = |joint: usize, low: f64, high: f64| match self
            .rest
            .fingers
            .iter()
            .map(|q| q[joint] / n)
            .find(|a| !(low..=high).contains(a))
        {
            Some(angle) => Err(ChangeError::Fingers { stage, angle, low, high }),
            None => Ok(()),
        };
        let loaded = |load: f64, low: f64, high: f64| {
            if (low..=high).contains(&load) { Ok(()) } else { Err(ChangeError::Load { stage, load, low, high }) }
        };
        // more than when the order was taken: in a pick the tool, hanging on the hand, in a return its absence
        let felt = self.rest.force.dot(&(self.world_from_dock.rotation * Vector3::z())) / n;
        match stage {
            Stage::Lower => loaded(-felt, -STANDING, f64::INFINITY),
            Stage::Seat => Ok(()),
            Stage::HalfGrasp => within(0, self.half_angle - HALF_TOLERANCE, self.half_angle + HALF_TOLERANCE),
            Stage::Lift => loaded(-felt, 0.5 * self.weight, 1.5 * self.weight),
            Stage::FullGrasp => {
                match self.bevel {
                    Some(angle) => {
                        within(0, self.flat_angle - FINGER_TOLERANCE, self.flat_angle + FINGER_TOLERANCE)?;
                        within(1, angle - WRAP_TOLERANCE, angle + WRAP_TOLERANCE)?;
                    }
                    // round the corners of a square front, fingers are only known to be stopped by something
                    None => within(1, WRAP_TOLERANCE, self.full().wrap - 0.03)?,
                }
                loaded(-felt, 0.5 * self.weight, 1.5 * self.weight)
            }
            Stage::HalfRelease => within(1, -FINGER_TOLERANCE, FINGER_TOLERANCE),
            Stage::Approach | Stage::Release => within(0, OPEN - FINGER_TOLERANCE, OPEN + FINGER_TOLERANCE),
            Stage::Retreat => loaded(felt, 0.5 * self.weight, 1.5 * self.weight),
        }
    }
}

/// `10 s^3 - 15 s^4 + 6 s^5` (Flash and Hogan 1985, doi:10.1523/JNEUROSCI.05-07-01688.1985).
fn minimum_jerk(s: f64) -> f64 {
    s * s * s * (10.0 + s * (6.0 * s - 15.0))
}
