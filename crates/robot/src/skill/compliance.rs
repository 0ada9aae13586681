//! How a hand gives way to what it feels: it yields sideways and in turn, and slows down when pressed.
use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::Senses;
use crate::math::Pose;

/// Rates at which the pace follows force and torque, m/s/N and rad/s/(N m): against something rigid an arm of 2000 N/m and 200 N m/rad
/// has given way in a quarter of a second, slowly against its own 20 ms of sensing.
const RATES: [f64; 2] = [0.002, 0.02];
/// Force (N) and torque (N m) that are not followed: a hanging tool's own.
const DEAD: [f64; 2] = [1.0, 0.3];
/// Farthest that a hand yields, m and rad.
const MOST: [f64; 2] = [0.03, 0.14];
/// Forces (N) between which a motion slows from its speed to a crawl.
const SLOW: [f64; 2] = [8.0, 25.0];
/// The crawl, as a share of the speed: what is stuck for good is pressed up to the wrist's limit, and so noticed.
const CRAWL: f64 = 0.05;
/// Time in which the pace follows the force, s.
const REACTION: f64 = 0.02;
/// Samples of which the wrist's zero is made.
const TARE: u32 = 50;

/// What a tool change has felt, and by how much it has given way.
#[derive(Clone, Debug)]
pub(super) struct Compliance {
    /// Sums of force (N) and torque (N m) while nothing touched, world, and their number.
    tare: (Vector3<f64>, Vector3<f64>, u32),
    shift: Vector3<f64>,
    turn: Vector3<f64>,
    pace: f64,
}

impl Compliance {
    pub fn new() -> Self {
        Self {
            tare: (Vector3::zeros(), Vector3::zeros(), 0),
            shift: Vector3::zeros(),
            turn: Vector3::zeros(),
            pace: 1.0,
        }
    }

    /// Force and torque beyond those at the start of the order; the first samples make the zero.
    pub fn feel(&mut self, senses: &Senses) -> (Vector3<f64>, Vector3<f64>) {
        let (force, torque, n) = &mut self.tare;
        if *n < TARE {
            *force += senses.force;
            *torque += senses.torque;
            *n += 1;
        }
        let n = f64::from(*n);
        (senses.force - *force / n, senses.torque - *torque / n)
    }

    /// Gives way for `dt` s, across `up` only: along it the hand is led.
    pub fn give_way(&mut self, force: &Vector3<f64>, torque: &Vector3<f64>, up: &Vector3<f64>, dt: f64) {
        let beyond = |v: Vector3<f64>, dead: f64| v * (1.0 - dead / v.norm().max(dead));
        let across = force - up * force.dot(up);
        self.shift = (self.shift + beyond(across, DEAD[0]) * (RATES[0] * dt)).cap_magnitude(MOST[0]);
        self.turn = (self.turn + beyond(*torque, DEAD[1]) * (RATES[1] * dt)).cap_magnitude(MOST[1]);
    }

    /// How fast a motion goes on under this force, as a share of its speed.
    pub fn pace(&mut self, force: f64, dt: f64) -> f64 {
        let [free, slow] = SLOW;
        let pace = ((slow - force) / (slow - free)).clamp(CRAWL, 1.0);
        self.pace += (pace - self.pace) * (dt / REACTION).min(1.0);
        self.pace
    }

    /// Forgets by how much it has given way.
    pub fn straighten(&mut self) {
        (self.shift, self.turn) = (Vector3::zeros(), Vector3::zeros());
    }

    /// Stands off to the other side by as much as it has given way.
    pub fn mirror(&mut self) {
        self.shift = -self.shift;
        self.turn = Vector3::zeros();
    }

    /// Where the hand is to be instead of `pose`.
    pub fn yielded(&self, pose: &Pose) -> Pose {
        let turn = UnitQuaternion::from_scaled_axis(self.turn);
        Pose::from_parts(Translation3::from(pose.translation.vector + self.shift), turn * pose.rotation)
    }

    /// The pose of which [`yielded`](Self::yielded) makes `pose`.
    pub fn unyielded(&self, pose: &Pose) -> Pose {
        let turn = UnitQuaternion::from_scaled_axis(self.turn);
        Pose::from_parts(Translation3::from(pose.translation.vector - self.shift), turn.inverse() * pose.rotation)
    }
}
