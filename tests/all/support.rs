//! What several tests of the physics need: the robot, exact inverse kinematics, and plans written by hand.
use std::sync::Arc;

use calamus::control::{ImpedanceOptions, LawOptions};
use calamus::math::{Pose, Rgb, frame_from_axes, rotation_vector};
use calamus::mesh::TriMesh;
use calamus::pen::LayerPen;
use calamus::pen::PenModel;
use calamus::plan::{DepthProfile, Knot, Segment, SegmentKind, Trajectory};
use calamus::robot::{ArmModel, JointVector, UrdfOptions, urdf};
use calamus::surface::{Canvas, Mapping, SheetFrame};
use calamus::truth::TrueCanvas;
use calamus::twin::{ArmSetup, Record, TrueScene, TwinOptions, simulate};
use nalgebra::{Point2, Point3, Vector3, Vector6};

/// Exact inverse kinematics by Newton's method with the least joint motion from `q0`.
pub fn inverse_kinematics(arm: &ArmModel, target: &Pose, q0: &JointVector) -> JointVector {
    let mut q = *q0;
    for _ in 0..100 {
        let k = arm.kinematics(&q);
        let tip = k.world_from_tip();
        let p = target.translation.vector - tip.translation.vector;
        let r = rotation_vector(&(target.rotation * tip.rotation.inverse()));
        let error = Vector6::new(p.x, p.y, p.z, r.x, r.y, r.z);
        if error.norm() < 1e-13 {
            break;
        }
        let j = k.jacobian();
        let a = j * j.transpose();
        q += j.transpose() * a.lu().solve(&error).expect("the pose is not singular");
    }
    q
}

/// The pen at `p` with its axis along `axis`, turned as near to `x_hint` as can be.
pub fn pen_pose(p: Point3<f64>, axis: Vector3<f64>) -> Pose {
    // the comfortable postures of the tests have the tip's x axis down or towards the robot
    let hint = if axis.z < -0.7 { -Vector3::x() } else { -Vector3::z() };
    Pose::from_parts(p.coords.into(), frame_from_axes(&axis, &hint))
}

/// A segment whose tip follows `pose(t)`, by inverse kinematics every 4 ms.
pub fn follow(
    arm: &ArmModel,
    q0: &JointVector,
    kind: SegmentKind,
    start: f64,
    duration: f64,
    pose: impl Fn(f64) -> Pose,
) -> Segment {
    let n = (duration / 0.004).round() as usize;
    let h = 1e-3;
    let mut q = *q0;
    let knots = (0..=n)
        .map(|i| {
            let t = duration * i as f64 / n as f64;
            q = inverse_kinematics(arm, &pose(t), &q);
            let (a, b) = (inverse_kinematics(arm, &pose(t - h), &q), inverse_kinematics(arm, &pose(t + h), &q));
            Knot { time: t, q, qd: (b - a) / (2.0 * h), qdd: (a + b - q * 2.0) / (h * h) }
        })
        .collect();
    let stroke = (kind != SegmentKind::Travel).then_some(0);
    Segment { kind, layer: 0, stroke, start, trajectory: Trajectory::new(knots), depth: DepthProfile::constant(0.003) }
}

/// Sheet coordinates that are world x and y.
pub struct FromAbove;

impl Mapping for FromAbove {
    fn to_surface(&self, _: &Point2<f64>) -> Option<calamus::mesh::SurfacePoint> {
        None
    }
    fn to_sheet(&self, p: &Point3<f64>) -> Option<Point2<f64>> {
        Some(Point2::new(p.x, p.y))
    }
    fn kind(&self) -> &'static str {
        "above"
    }
}

/// A true canvas without a sheet.
pub fn canvas(mesh: TriMesh) -> TrueCanvas {
    TrueCanvas::nominal(Canvas { name: "test".into(), mesh, sheet: SheetFrame { world_from_sheet: Pose::identity() } })
}

/// Runs hand-written segments on a true arm (which the controller may believe to be another).
pub fn run(
    truth: &ArmModel,
    belief: &ArmModel,
    control: ImpedanceOptions,
    start: JointVector,
    segments: Vec<Segment>,
    canvas: &TrueCanvas,
    options: &TwinOptions,
) -> Record {
    run_by([truth, belief], LawOptions::Impedance(control), start, segments, canvas, options)
}

/// The same by any law; the arm is the first of `arms`, and believes itself to be the second.
pub fn run_by(
    arms: [&ArmModel; 2],
    law: LawOptions,
    start: JointVector,
    segments: Vec<Segment>,
    canvas: &TrueCanvas,
    options: &TwinOptions,
) -> Record {
    simulate(setup(arms, start), &segments, &scene(canvas), law, options).expect("the simulation runs")
}

/// An arm with a black pen; it is the first of `arms`, and believes itself to be the second.
pub fn setup([model, believed]: [&ArmModel; 2], start: JointVector) -> ArmSetup {
    let (model, believed, colors) = (model.clone(), believed.clone(), vec![Rgb([0; 3])]);
    ArmSetup { index: 0, model, believed, start, layer: 0, gripper: None, colors }
}

/// A canvas seen from above, and a fineliner.
pub fn scene(canvas: &TrueCanvas) -> Arc<TrueScene> {
    let pen = PenModel::named("fineliner_08").expect("a known pen");
    let pens = vec![LayerPen { pen, ink: "black".into() }];
    let mapping = Box::new(FromAbove);
    Arc::new(TrueScene { canvas: canvas.clone(), friction: 0.3, compliance: 0.0, mapping, pens })
}

/// A smooth rise from 0 to 1 over `[0, 1]` with no speed or acceleration at its ends.
pub fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (-15.0 + 6.0 * t))
}

/// The drawing iiwa on its pedestal, and a comfortable posture with the pen pointing down.
pub fn iiwa() -> (ArmModel, JointVector) {
    let robots = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("robots");
    let options =
        UrdfOptions { base_link: Some("link_0".into()), tip_link: Some("link_ee".into()), ..Default::default() };
    let mut arm = urdf::load(&robots.join("iiwa7.urdf"), &options).expect("the robot loads");
    arm.world_from_base = Pose::translation(0.0, 0.0, 0.3);
    for joint in &mut arm.joints {
        (joint.damping, joint.friction, joint.armature) = (0.0, 0.0, 0.1);
    }
    arm.last_from_tip *= Pose::translation(0.0, 0.0, 0.1275);
    (arm, posture([0.0, 40.0, 0.0, -80.0, 0.0, 60.0, 0.0]))
}

/// Joint positions from degrees.
pub fn posture(degrees: [f64; 7]) -> JointVector {
    JointVector::from_fn(|i, _| degrees.get(i).map_or(0.0, |d| d.to_radians()))
}
