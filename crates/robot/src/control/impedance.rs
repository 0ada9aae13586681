//! The Cartesian impedance law at 1 kHz.
use nalgebra::{Matrix3, Matrix6, Point3, SMatrix, Vector3, Vector6};

use crate::control::limits::TorqueLimits;
use crate::control::{ImpedanceOptions, design_damping};
use crate::math::rotation_vector;
use crate::robot::{ArmModel, Jacobian, JointMatrix, JointVector, Kinematics, MAX_DOF};

/// Steps between two designs of the damping matrix: it follows the slowly changing inertia of the hand.
const DAMPING_PERIOD: u64 = 10;
/// Inverse of the hand's inertia, 1/kg or 1/(kg m2), below which a posture counts as singular: that of 20 kg.
const SINGULAR: f64 = 0.05;
/// Natural frequency with which joints follow their reference where the hand can't, rad/s.
const JOINT_FREQUENCY: f64 = 25.0;
/// Speed over which the friction feed-forward grows to its full value, m/s.
const FRICTION_SPEED: f64 = 0.002;

/// What the joint sensors tell.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MeasuredState {
    /// Joint positions, rad.
    pub q: JointVector,
    /// Joint speeds, rad/s.
    pub qd: JointVector,
}

/// What is desired at this instant.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Reference {
    /// Joint positions, rad; the tip's set point is where they put it.
    pub q: JointVector,
    /// Joint speeds, rad/s.
    pub qd: JointVector,
    /// Joint accelerations, rad/s2.
    pub qdd: JointVector,
    /// How the set point is pressed into the canvas.
    pub press: Press,
    /// Share with which each joint follows its own reference in place of the hand: 1 on the way through a singular posture.
    pub by_joint: f64,
}

impl Reference {
    /// Standing at `q`, pen in the air.
    pub fn rest(q: JointVector) -> Self {
        Self { q, qd: JointVector::zeros(), qdd: JointVector::zeros(), press: Press::default(), by_joint: 0.0 }
    }
}

/// How the set point is pressed into the canvas, which the pen's tip can't follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Press {
    /// Force with which the pen is expected to press, N; 0 in the air.
    pub expected_force: f64,
    /// How fast the press depth grows, m/s.
    pub rate: f64,
    /// How fast that grows, m/s2.
    pub acceleration: f64,
}

impl Press {
    /// A steady press with this force, N.
    pub fn steady(expected_force: f64) -> Self {
        Self { expected_force, ..Self::default() }
    }
}

/// The law's answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueCommand {
    /// Joint torques after limits, N m.
    pub torque: JointVector,
    /// Whether a torque or rate limit cut them.
    pub saturated: bool,
}

/// The controller of one arm: the robot's own model, settings, and what it remembers from step to step.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct ImpedanceController {
    model: ArmModel,
    options: ImpedanceOptions,
    damping: Matrix6<f64>,
    set_point: Point3<f64>,
    limits: TorqueLimits,
    step: u64,
}

impl ImpedanceController {
    /// A controller that believes the arm to be `model`.
    pub fn new(model: ArmModel, options: ImpedanceOptions) -> Self {
        Self {
            model,
            options,
            damping: Matrix6::zeros(),
            set_point: Point3::origin(),
            limits: TorqueLimits::default(),
            step: 0,
        }
    }

    /// The settings.
    pub fn options(&self) -> &ImpedanceOptions {
        &self.options
    }

    /// The robot's model of itself.
    pub fn model(&self) -> &ArmModel {
        &self.model
    }

    /// Where the law desired the pen tip to be at its last call, m, world.
    pub fn set_point(&self) -> Point3<f64> {
        self.set_point
    }

    /// Whether the hand can't be moved every way, or hardly, with the joints at `q` (rad).
    pub fn is_singular(&self, q: &JointVector) -> bool {
        let k = self.model.kinematics(q);
        let (mass, _) = self.model.mass_and_bias(&k, &JointVector::zeros());
        let (_, lambda_inverse) = mobility(&mass, &k.jacobian(), self.model.dof());
        lambda_inverse.cholesky().is_none_or(|c| {
            let l = c.l_dirty();
            (0..6).any(|i| l[(i, i)] * l[(i, i)] < SINGULAR)
        })
    }

    /// Joint torques for this step (`dt` s long):
    ///
    /// `tau = J^T (K e + D edot + Lambda (a_d - Jdot qd) + f_mu) + N (M qdd_d + k_n (q_d - q) + D_n (qd_d - qd)) + C qd + g`
    ///
    /// with `e = x_d - x` (rotation part by the logarithm of `R_d R^T`), `K` turned from the pen frame into the world,
    /// `Lambda = (J M^-1 J^T)^-1`, `N = 1 - J^T Lambda J M^-1` and `f_mu` the friction that the moving pen will feel.
    /// A press depth that changes is no motion of the tip: what it adds to the set point's speed and acceleration is taken
    /// out again, so that the force is `K` times the depth (equation 6.1) also while it changes.
    /// On the way through a singular posture, as the reference says, each joint follows its own in place of that:
    /// `M (qdd_d + w^2 (q_d - q) + 2 z w (qd_d - qd)) + C qd + g`. The hand alone would leave it to chance on which side the arm comes out.
    /// So the hand answers an outer force `F` as `Lambda edd + D edot + K e = -F` (dissertation section VI.C; Ott 2008,
    /// doi:10.1007/978-3-540-69255-3). Torques are then held within effort and rate limits.
    pub fn torque(
        &mut self,
        measured: &MeasuredState,
        k: &Kinematics,
        reference: &Reference,
        dt: f64,
    ) -> TorqueCommand {
        let n = self.model.dof();
        let o = &self.options;
        let (mass, bias) = self.model.mass_and_bias(k, &measured.qd);
        let jacobian = k.jacobian();
        let zero = JointVector::zeros();
        let (v, drift) = k.tip_motion(&measured.qd, &zero);
        let kd = self.model.kinematics(&reference.q);
        let (mut v_d, mut a_d) = kd.tip_motion(&reference.qd, &reference.qdd);
        let r = *kd.world_from_tip().rotation.to_rotation_matrix().matrix();
        // the set point sinks, the tip stays on the canvas: damping and inertia must not push it in
        if reference.press.rate != 0.0 || reference.press.acceleration != 0.0 {
            let axis = r.column(2);
            for i in 0..3 {
                v_d[i] -= axis[i] * reference.press.rate;
                a_d[i] -= axis[i] * reference.press.acceleration;
            }
        }

        let (x, mut lambda_inverse) = mobility(&mass, &jacobian, n);
        // keeps Lambda finite where the arm is singular: no line is drawn there, and a travel through it goes joint by joint
        for i in 0..6 {
            lambda_inverse[(i, i)] += 1e-9;
        }
        let Some(factor) = lambda_inverse.cholesky() else {
            return self.limits.hold(&self.model, bias, o.torque_rate, dt);
        };

        self.set_point = Point3::from(kd.world_from_tip().translation.vector);
        let (pose, pose_d) = (k.world_from_tip(), kd.world_from_tip());
        let e_p = pose_d.translation.vector - pose.translation.vector;
        let e_r = rotation_vector(&(pose_d.rotation * pose.rotation.inverse()));
        let translational = turned(&r, &o.stiffness);
        let rotational = turned(&r, &o.rotational_stiffness);
        if self.step.is_multiple_of(DAMPING_PERIOD) {
            let mut stiffness = Matrix6::zeros();
            stiffness.fixed_view_mut::<3, 3>(0, 0).copy_from(&translational);
            stiffness.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotational);
            if let Some(d) = design_damping(&factor.inverse(), &stiffness, o.damping_ratio) {
                self.damping = d;
            }
        }
        self.step += 1;

        let (f, m) = (translational * e_p, rotational * e_r);
        let mut wrench = Vector6::new(f.x, f.y, f.z, m.x, m.y, m.z) + self.damping * (v_d - v);
        if o.friction_feedforward && reference.press.expected_force > 0.0 {
            let axis = r.column(2);
            let v_lin = Vector3::new(v_d[0], v_d[1], v_d[2]);
            let slip = v_lin - axis * axis.dot(&v_lin);
            let along = slip / (slip.norm_squared() + FRICTION_SPEED * FRICTION_SPEED).sqrt();
            let push = along * (o.believed_friction * reference.press.expected_force);
            for i in 0..3 {
                wrench[i] += push[i];
            }
        }
        wrench += factor.solve(&(a_d - drift));

        // motion that doesn't move the hand: N t = t - J^T Lambda (J M^-1 t)
        let mut posture = mass * reference.qdd;
        for i in 0..n {
            let damping = 2.0 * o.nullspace_damping_ratio * (o.nullspace_stiffness * mass[(i, i)]).sqrt();
            posture[i] +=
                o.nullspace_stiffness * (reference.q[i] - measured.q[i]) + damping * (reference.qd[i] - measured.qd[i]);
        }
        let leak = factor.solve(&(x.transpose() * posture));
        let mut tau = jacobian.transpose() * (wrench - leak) + posture + bias;
        if reference.by_joint > 0.0 {
            let (w, zeta) = (JOINT_FREQUENCY, o.nullspace_damping_ratio);
            let pull = (reference.q - measured.q) * (w * w) + (reference.qd - measured.qd) * (2.0 * zeta * w);
            tau += (mass * (reference.qdd + pull) + bias - tau) * reference.by_joint;
        }
        self.limits.hold(&self.model, tau, o.torque_rate, dt)
    }
}

/// `X = M^-1 J^T` and `Lambda^-1 = J X` of an arm of `n` joints.
fn mobility(mass: &JointMatrix, jacobian: &Jacobian, n: usize) -> (SMatrix<f64, MAX_DOF, 6>, Matrix6<f64>) {
    let solved = Solved::new(mass, n);
    let mut x = jacobian.transpose();
    for mut column in x.column_iter_mut() {
        solved.solve(column.as_mut_slice());
    }
    (x, jacobian * x)
}

/// `R diag(k) R^T`.
fn turned(r: &Matrix3<f64>, k: &[f64; 3]) -> Matrix3<f64> {
    r * Matrix3::from_diagonal(&Vector3::from(*k)) * r.transpose()
}

/// The Cholesky factor of the leading `n x n` block of a joint-space matrix.
struct Solved {
    l: JointMatrix,
    n: usize,
}

impl Solved {
    fn new(m: &JointMatrix, n: usize) -> Self {
        let mut l = *m;
        for j in 0..n {
            for k in 0..j {
                let f = l[(j, k)];
                for i in j..n {
                    l[(i, j)] -= f * l[(i, k)];
                }
            }
            // a joint-space inertia is positive definite; the floor only guards against rounding
            let d = l[(j, j)].max(1e-12).sqrt();
            for i in j..n {
                l[(i, j)] /= d;
            }
        }
        Self { l, n }
    }

    /// Solves `M x = b` in place.
    fn solve(&self, b: &mut [f64]) {
        let (l, n) = (&self.l, self.n);
        for i in 0..n {
            let mut s = b[i];
            for j in 0..i {
                s -= l[(i, j)] * b[j];
            }
            b[i] = s / l[(i, i)];
        }
        for i in (0..n).rev() {
            let mut s = b[i];
            for j in i + 1..n {
                s -= l[(j, i)] * b[j];
            }
            b[i] = s / l[(i, i)];
        }
    }
}
