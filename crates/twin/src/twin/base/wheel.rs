//! One mecanum wheel on the floor: its motor, and the roller that stands on it.
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::robot::{BaseModel, Tyre, WheelModel, WheelMotor};

/// How far a wheel rolls to and fro without new bristles coming into its contact, m: those at the edge, which come and go as a parked
/// base sways under its arm, bear no load after the first time.
const TO_AND_FRO: f64 = 5e-4;
/// Stiffness and damping of a roller's bearing before it turns, N/m and N s/m.
const PRESLIDING: [f64; 2] = [2e5, 100.0];

/// What the wheels are asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum WheelCommand {
    /// Stand where they are.
    Hold,
    /// Turn at these speeds, rad/s: front left, front right, rear left, rear right.
    Turn([f64; 4]),
}

impl WheelCommand {
    /// The speed of wheel `i`, or `None` where it is held.
    fn speed(&self, i: usize) -> Option<f64> {
        match self {
            Self::Hold => None,
            Self::Turn(speeds) => Some(speeds[i]),
        }
    }
}

/// What of a wheel changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wheel {
    /// Turn since the beginning, rad, forward positive.
    pub angle: f64,
    /// Speed, rad/s.
    pub speed: f64,
    /// How far the roller's bristles are bent along its axis, m.
    bristle: f64,
    /// How far the roller is turned before it rolls, m.
    rolled: f64,
    /// How far the wheel has rolled, less what it rolled to and fro, m.
    way: f64,
    /// Integral of the speed's error, rad.
    behind: f64,
    /// Whether it was held in the last step.
    held: bool,
}

/// How a wheel meets the floor in one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footing {
    /// Velocity of the base's point over the contact, m/s, base frame.
    pub velocity: Vector2<f64>,
    /// Load, N.
    pub load: f64,
}

/// What a wheel does to the base.
#[derive(Clone, Copy, Debug)]
pub(super) struct WheelForce {
    /// Force of the floor, N, base frame.
    pub force: Vector2<f64>,
    /// Torque about the axle that speeding the wheel up takes, N m, on the base.
    pub reaction: f64,
}

impl Wheel {
    /// One step of `dt` s of wheel `i` of `base`.
    ///
    /// Along the roller's axis a brush holds (bristles of stiffness `sigma` over a contact of half length `a`, renewed by travel:
    /// `z' = s - |v| z / a`, force `sigma z + sigma1 s` cut to `mu N`; Deur, Asgari and Hrovat, A 3D brush-type dynamic tire friction
    /// model, Vehicle System Dynamics 42(3), 2004, doi:10.1080/00423110412331282887). Across it the roller rolls against `c N`.
    pub(super) fn step(
        &mut self,
        base: &BaseModel,
        i: usize,
        command: &WheelCommand,
        footing: &Footing,
        dt: f64,
    ) -> WheelForce {
        let WheelModel { roller, .. } = base.wheels[i];
        let across = Vector2::new(-roller.y, roller.x);
        let rim = footing.velocity - Vector2::new(self.speed * base.radius, 0.0);
        let (roll, turned) = self.bearing(&base.tyre, across.dot(&rim), footing.load, dt);
        let at = self.angle * base.radius;
        let way = self.way.clamp(at - TO_AND_FRO, at + TO_AND_FRO);
        // a roller at 45 degrees turns the square root of two times as far as its wheel where both do
        let travel = (way - self.way).abs().max(turned * std::f64::consts::FRAC_1_SQRT_2);
        self.way = way;
        let hold = self.brush(&base.tyre, roller.dot(&rim), travel, footing.load, dt);
        let force = roller * hold + across * roll;
        let torque = self.motor(&base.motor, command.speed(i), dt);
        let gain = (torque - base.radius * force.x) / base.motor.inertia;
        self.speed += gain * dt;
        self.angle += self.speed * dt;
        WheelForce { force, reaction: -base.motor.inertia * gain }
    }

    /// `travel`: how far the wheel or its roller rolled, m.
    fn brush(&mut self, tyre: &Tyre, slip: f64, travel: f64, load: f64, dt: f64) -> f64 {
        let most = tyre.friction * load;
        // renewal is taken at the step's end, so that fast travel over a short contact stays stable
        self.bristle = (self.bristle + slip * dt) / (1.0 + travel / tyre.half_length);
        let force = tyre.stiffness * self.bristle + tyre.damping * slip;
        if force.abs() > most {
            let bend = most / tyre.stiffness;
            self.bristle = self.bristle.clamp(-bend, bend);
        }
        -force.clamp(-most, most)
    }

    /// The force of the roller's bearing, N, and how far the roller turned, m.
    fn bearing(&mut self, tyre: &Tyre, speed: f64, load: f64, dt: f64) -> (f64, f64) {
        let [stiffness, damping] = PRESLIDING;
        let most = tyre.rolling_resistance * load;
        let bend = most / stiffness;
        let free = self.rolled + speed * dt;
        self.rolled = free.clamp(-bend, bend);
        (-(stiffness * self.rolled + damping * speed).clamp(-most, most), (free - self.rolled).abs())
    }

    /// The motor's torque: a velocity loop with an integral, which holds the wheel's place where it is to stand.
    fn motor(&mut self, motor: &WheelMotor, speed: Option<f64>, dt: f64) -> f64 {
        let gain = if speed.is_none() { motor.hold_gain } else { motor.integral_gain };
        if self.held != speed.is_none() {
            // the torque goes on without a jump
            let before = if self.held { motor.hold_gain } else { motor.integral_gain };
            self.behind = if gain > 0.0 { self.behind * before / gain } else { 0.0 };
            self.held = speed.is_none();
        }
        let error = speed.unwrap_or(0.0) - self.speed;
        let asked = motor.velocity_gain * error + gain * (self.behind + error * dt);
        let torque = asked.clamp(-motor.torque, motor.torque);
        // the integral stands still while the motor gives all that it can
        if torque == asked || asked * error < 0.0 {
            self.behind += error * dt;
        }
        torque
    }
}
