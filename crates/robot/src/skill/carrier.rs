//! What carries a hand: any arm of six joints or more, or a plain gantry.
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Rotation3, UnitQuaternion, Vector3, Vector6};

use super::{HandModel, last_from_grip};
use crate::control::ImpedanceOptions;
use crate::math::{Pose, rotation_vector};
use crate::robot::{ArmModel, JointKind, JointModel, JointVector, LinkModel, SpatialInertia};

/// An arm with a hand on its flange, the grip frame as its tip, and where it stands.
#[derive(Clone, Debug)]
pub struct Carrier {
    /// The arm with the palm, and what is fixed to it, on its last link; its tip is the grip frame. The fingers are the plant's own.
    pub plant: ArmModel,
    /// The arm with the whole hand on its last link: what the controller believes.
    pub believed: ArmModel,
    /// Gains of the torque law, grip frame.
    pub gains: ImpedanceOptions,
    /// Joints from which a pose is sought, rad or m.
    pub home: JointVector,
}

/// Stiffness of the arm while it changes tools, N/m and N m/rad: stiff enough that the tool's weight moves it by little more than a
/// millimetre, soft enough that a tilted dock does not jam the nose (an error of 3 mm presses with 6 N).
const STIFFNESS: [f64; 2] = [2000.0, 200.0];

impl Carrier {
    /// A hand on the tip frame of `arm` (z out of the flange), its z up where the flange's y is up.
    pub fn new(arm: &ArmModel, hand: &HandModel, home: JointVector) -> Self {
        let last_from_grip = last_from_grip(arm, hand);
        let with = |body: SpatialInertia| {
            let mut arm = arm.clone();
            if let Some(last) = arm.links.last_mut() {
                last.inertia = last.inertia.joined(&body.seen_from(&last_from_grip));
            }
            arm.last_from_tip = last_from_grip;
            arm
        };
        let half = hand.close_angle(0.08);
        Self {
            plant: with(hand.base_inertia()),
            believed: with(hand.inertia(&[[half, 0.0, -half]; 3])),
            gains: ImpedanceOptions {
                stiffness: [STIFFNESS[0]; 3],
                rotational_stiffness: [STIFFNESS[1]; 3],
                damping_ratio: 1.0,
                friction_feedforward: false,
                torque_rate: 1e5,
                ..ImpedanceOptions::default()
            },
            home,
        }
    }

    /// A hand on a gantry: three slides and a wrist of three turns, 9 kg in all, standing with its grip frame at `grip`.
    pub fn gantry(hand: &HandModel, grip: &Pose) -> Self {
        let ball = |mass: f64, radius: f64| SpatialInertia {
            mass,
            com: Point3::origin(),
            inertia: Matrix3::from_diagonal_element(0.4 * mass * radius * radius),
        };
        let link = |name: &str, body| LinkModel {
            name: name.to_string(),
            inertia: body,
            capsules: Vec::new(),
            visuals: Vec::new(),
        };
        let joint = |name: &str, kind, axis| JointModel {
            name: name.to_string(),
            kind,
            axis,
            parent_from_joint: Pose::identity(),
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            velocity: 10.0,
            effort: 1000.0,
            damping: 0.0,
            friction: 0.0,
            armature: 0.0,
        };
        use JointKind::{Prismatic, Revolute};
        let joints = vec![
            joint("x", Prismatic, Vector3::x()),
            joint("y", Prismatic, Vector3::y()),
            joint("z", Prismatic, Vector3::z()),
            joint("yaw", Revolute, Vector3::z()),
            joint("pitch", Revolute, Vector3::y()),
            joint("roll", Revolute, Vector3::x()),
        ];
        let mut links = vec![link("base", SpatialInertia::massless())];
        links.extend(
            joints
                .iter()
                .enumerate()
                .map(|(i, j)| link(&j.name, if i < 3 { ball(2.0, 0.05) } else { ball(1.0, 0.05) })),
        );
        // the flange's z points along the gantry's x, so that the palm does
        let turn = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        let arm = ArmModel {
            name: "gantry".to_string(),
            world_from_base: Pose::identity(),
            joints,
            links,
            last_from_tip: Isometry3::from_parts(Vector3::new(-hand.mount, 0.0, 0.0).into(), rotation(turn)),
        };
        let mut home = JointVector::zeros();
        home.fixed_rows_mut::<3>(0).copy_from(&grip.translation.vector);
        let (roll, pitch, yaw) = grip.rotation.euler_angles();
        home.fixed_rows_mut::<3>(3).copy_from(&Vector3::new(yaw, pitch, roll));
        Self::new(&arm, hand, home)
    }

    /// Joints that put the grip frame at `grip`, sought from `home`; `None` when they are not found.
    pub fn joints_for(&self, grip: &Pose) -> Option<JointVector> {
        let mut q = self.home;
        for _ in 0..200 {
            let (step, off) = toward(&self.believed, &q, grip);
            if off < 1e-9 {
                return Some(q);
            }
            // half a radian at most, so that the search doesn't jump between branches
            q += step * (0.3 / step.amax().max(0.3));
        }
        None
    }
}

fn rotation(columns: Matrix3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
}

/// The damped least-squares step that brings the tip of `arm` at `q` nearer to `target`, and how far off it is (the norm of m and
/// rad): `dq = J^T (J J^T + l^2 1)^-1 e` (Wampler 1986, doi:10.1109/TSMC.1986.289285).
pub fn toward(arm: &ArmModel, q: &JointVector, target: &Pose) -> (JointVector, f64) {
    let k = arm.kinematics(q);
    let at = k.world_from_tip();
    let p = target.translation.vector - at.translation.vector;
    let r = rotation_vector(&(target.rotation * at.rotation.inverse()));
    let e = Vector6::new(p.x, p.y, p.z, r.x, r.y, r.z);
    let j = k.jacobian();
    let mut gram: Matrix6<f64> = j * j.transpose();
    for i in 0..6 {
        gram[(i, i)] += 1e-8;
    }
    let step = gram.cholesky().map_or_else(JointVector::zeros, |f| j.transpose() * f.solve(&e));
    (step, e.norm())
}
