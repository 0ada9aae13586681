//! Whole drawings, planned and looked at from outside.
use nalgebra::{Point2, Point3, Vector3};

use crate::math::{Pose, Rgb, frame_from_axes};
use crate::mesh::TriMesh;
use crate::plan::{
    MotionLimits, MotionSample, PenUse, PlanError, PlanJob, PlanOptions, Planned, SegmentKind, Surroundings, arms, plan,
};
use crate::robot::{ArmModel, JointVector};
use crate::surface::{BelievedCanvas, Canvas, SheetFrame, SurfaceDrawing, SurfaceLayer, SurfaceStroke, SurfaceTarget};

/// A sheet of `size` m about `center` that faces `normal`, bulging by `bulge(r)` towards it, as a mesh of 5 mm cells.
fn canvas(center: [f64; 3], normal: [f64; 3], size: f64, bulge: impl Fn(f64) -> f64) -> BelievedCanvas {
    let world_from_sheet = Pose::from_parts(
        Point3::from(center).coords.into(),
        frame_from_axes(&Vector3::from(normal), &Vector3::new(0.0, if normal[2] > 0.5 { -1.0 } else { 0.0 }, 0.0)),
    );
    let n = (size / 0.005).round() as u32;
    let at = |i: u32| -0.5 * size + size * f64::from(i) / f64::from(n);
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            let (x, y) = (at(i), at(j));
            vertices.push(world_from_sheet * Point3::new(x, y, bulge(x.hypot(y))));
            if i < n && j < n {
                let k = j * (n + 1) + i;
                triangles.push([k, k + 1, k + n + 2]);
                triangles.push([k, k + n + 2, k + n + 1]);
            }
        }
    }
    let mesh = TriMesh::new(vertices, triangles).unwrap_or_else(|e| panic!("{e}"));
    BelievedCanvas(Canvas { name: "test".into(), mesh, sheet: SheetFrame { world_from_sheet } })
}

/// A wall 0.7 m in front of the arm.
fn wall() -> BelievedCanvas {
    canvas([0.72, 0.0, 0.75], [-1.0, 0.0, 0.0], 0.6, |_| 0.0)
}

/// The cap of a sphere of 0.15 m radius on a table.
fn dome() -> BelievedCanvas {
    canvas([0.6, 0.0, 0.35], [0.0, 0.0, 1.0], 0.5, |r| {
        let radius = 0.15;
        let flat = radius - 0.12;
        if r < radius { ((radius * radius - r * r).sqrt() - flat).max(0.0) } else { 0.0 }
    })
}

/// Strokes in sheet coordinates, projected along the sheet's z, one layer per entry.
fn laid(canvas: &BelievedCanvas, layers: &[Vec<Vec<(f64, f64)>>]) -> SurfaceDrawing {
    let frame = canvas.sheet.world_from_sheet;
    let project = |(x, y): &(f64, f64)| {
        let origin = frame * Point3::new(*x, *y, 0.5);
        let hit = canvas.mesh.cast_ray(&origin, &(frame.rotation * -Vector3::z()), 2.0);
        let hit = hit.unwrap_or_else(|| panic!("({x}, {y}) is beside the canvas"));
        SurfaceTarget { position: hit.position, normal: hit.normal, sheet: Point2::new(*x, *y), width: None }
    };
    let layers = layers
        .iter()
        .enumerate()
        .map(|(l, strokes)| SurfaceLayer {
            name: format!("ink {l}"),
            color: Rgb([0, 0, 0]),
            strokes: strokes
                .iter()
                .enumerate()
                .map(|(index, s)| SurfaceStroke { index, targets: s.iter().map(project).collect() })
                .collect(),
        })
        .collect();
    SurfaceDrawing { layers, order: Vec::new() }
}

fn curve(n: usize, f: impl Fn(f64) -> (f64, f64)) -> Vec<(f64, f64)> {
    (0..=n).map(|i| f(i as f64 / n as f64)).collect()
}

fn line(n: usize, a: (f64, f64), b: (f64, f64)) -> Vec<(f64, f64)> {
    curve(n, |u| (a.0 + u * (b.0 - a.0), a.1 + u * (b.1 - a.1)))
}

/// Two inks: a flower, a square, hatches and a dot.
fn artwork(scale: f64) -> Vec<Vec<Vec<(f64, f64)>>> {
    let turn = std::f64::consts::TAU;
    let flower = curve(600, |u| {
        let r = scale * (0.7 + 0.3 * (5.0 * turn * u).cos());
        (r * (turn * u).cos(), r * (turn * u).sin())
    });
    let h = 0.5 * scale;
    let mut square = line(60, (-h, -h), (h, -h));
    square.extend(line(60, (h, -h), (h, h)).into_iter().skip(1));
    square.extend(line(60, (h, h), (-h, h)).into_iter().skip(1));
    square.extend(line(60, (-h, h), (-h, -h)).into_iter().skip(1));
    let hatches = (0..8).map(|k| {
        let y = scale * (-0.7 + 0.2 * f64::from(k));
        line(40, (-0.3 * scale, y), (0.4 * scale, y + 0.1 * scale))
    });
    vec![vec![flower, square], hatches.chain([vec![(0.0, 0.0)]]).collect()]
}

fn planned(
    arm: &ArmModel,
    home: &JointVector,
    drawing: &SurfaceDrawing,
    canvas: &BelievedCanvas,
    o: &PlanOptions,
) -> Planned {
    let mut heard = Vec::new();
    let result =
        plan(&PlanJob { arm_index: 0, arm, home, service: home, drawing, canvas, obstacles: &[] }, o, &mut |p| {
            heard.push(p)
        });
    assert!(heard.windows(2).all(|w| w[1] >= w[0]) && heard.last().is_none_or(|p| *p <= 1.0));
    result.unwrap_or_else(|e| panic!("{e}"))
}

/// Distance (m) of `p` from the polyline through the pressed targets, and angle (rad) of `axis` from the desired one there.
fn error(targets: &[SurfaceTarget], depth: f64, p: &Point3<f64>, axis: &Vector3<f64>) -> (f64, f64) {
    let pressed = |t: &SurfaceTarget| t.position - t.normal * depth;
    let mut best = (f64::INFINITY, 0.0);
    let mut judge = |q: Point3<f64>, n: Vector3<f64>| {
        let d = (p - q).norm();
        if d < best.0 {
            best = (d, axis.cross(&-n.normalize()).norm().asin());
        }
    };
    judge(pressed(&targets[0]), targets[0].normal);
    for w in targets.windows(2) {
        let (a, b) = (pressed(&w[0]), pressed(&w[1]));
        let u = ((p - a).dot(&(b - a)) / (b - a).norm_squared().max(1e-18)).clamp(0.0, 1.0);
        judge(a + (b - a) * u, w[0].normal * (1.0 - u) + w[1].normal * u);
    }
    best
}

/// Looks at every segment closely.
fn assert_sound(
    arm: &ArmModel,
    home: &JointVector,
    drawing: &SurfaceDrawing,
    canvas: &BelievedCanvas,
    o: &PlanOptions,
    p: &Planned,
) {
    let limits = MotionLimits::new(arm, o);
    let surroundings = Surroundings::new(arm, &canvas.mesh, &[], o);
    let mut at: (f64, JointVector) = (0.0, *home);
    for s in &p.plan.segments {
        let t = &s.trajectory;
        assert!((s.start - at.0).abs() < 1e-9 && (t.knots()[0].q - at.1).amax() < 1e-9, "{:?} at {}", s.kind, s.start);
        at = (s.end(), t.knots()[t.knots().len() - 1].q);
        for k in [&t.knots()[0], &t.knots()[t.knots().len() - 1]] {
            assert!(k.qd.amax() == 0.0 && k.qdd.amax() == 0.0);
        }
        let (dt, mut cursor) = (0.002, 0);
        let mut before: Option<MotionSample> = None;
        let targets = s.stroke.map(|k| &drawing.layers[s.layer].strokes[k].targets);
        for i in 0..=(t.duration() / dt) as usize {
            let m = t.sample(i as f64 * dt, &mut cursor);
            for j in 0..arm.dof() {
                assert!(m.qd[j].abs() < 1.01 * limits.speed[j], "{:?} speed {}", s.kind, m.qd[j]);
                assert!(m.qdd[j].abs() < 1.01 * limits.acceleration[j], "{:?} acceleration {}", s.kind, m.qdd[j]);
                let jerk = before.map_or(0.0, |b| (m.qdd[j] - b.qdd[j]).abs() / dt);
                assert!(jerk < 1.02 * limits.jerk[j], "{:?} jerk {jerk}", s.kind);
                assert!(m.q[j] > arm.joints[j].lower && m.q[j] < arm.joints[j].upper);
            }
            before = Some(m);
            if i % 5 != 0 {
                continue;
            }
            let k = arm.kinematics(&m.q);
            let tip = k.world_from_tip();
            let (position, axis) = (Point3::from(tip.translation.vector), tip.rotation * Vector3::z());
            let pen_use = if s.kind == SegmentKind::Travel { PenUse::Travelling } else { PenUse::Drawing };
            let clearance = surroundings.clearance(&k, pen_use);
            // between two looks the margin itself may be touched, but no more
            assert!(clearance.excess > -0.002, "{:?} {i}: {clearance:?}", s.kind);
            if let (SegmentKind::Draw, Some(targets)) = (s.kind, targets) {
                let (distance, angle) = error(targets, o.press.default, &position, &axis);
                assert!(distance < 5e-5, "off by {distance}");
                assert!(angle < 0.1f64.to_radians(), "tilted by {} deg", angle.to_degrees());
            }
            if let (SegmentKind::Press, Some(targets)) = (s.kind, targets) {
                let height = (position - targets[0].position).dot(&targets[0].normal);
                let lateral = (position - targets[0].position) - targets[0].normal * height;
                assert!(lateral.norm() < 1e-4, "press {}", lateral.norm());
                let speed = (arm.kinematics(&m.q).jacobian() * m.qd).fixed_rows::<3>(0).norm();
                assert!(height.abs() > 2e-4 || speed < 1.02 * o.landing_speed, "lands at {speed}");
            }
        }
    }
    assert!((at.1 - home).amax() < 1e-9, "ends at home");
}

#[test]
fn a_drawing_on_a_wall_is_sound() {
    let (arm, home, o) = (arms::iiwa(), arms::iiwa_home(), PlanOptions::default());
    let canvas = wall();
    let drawing = laid(&canvas, &artwork(0.12));
    let p = planned(&arm, &home, &drawing, &canvas, &o);
    assert_sound(&arm, &home, &drawing, &canvas, &o, &p);
    assert_eq!(p.reach.fraction(), 1.0);
    assert_eq!((p.statistics.runs, p.statistics.pen_changes, p.statistics.extra_lifts), (11, 1, 0));
    let kinds = |k| p.plan.segments.iter().filter(|s| s.kind == k).count();
    assert_eq!((kinds(SegmentKind::Draw), kinds(SegmentKind::ChangePen)), (11, 1));
    assert!(p.statistics.max_deviation < 5e-5 && p.statistics.max_joint_step < 0.03, "{:?}", p.statistics);
}

#[test]
fn a_drawing_on_a_dome_is_sound() {
    let (arm, home, o) = (arms::iiwa(), arms::iiwa_home(), PlanOptions::default());
    let canvas = dome();
    let drawing = laid(&canvas, &artwork(0.065));
    let p = planned(&arm, &home, &drawing, &canvas, &o);
    assert_sound(&arm, &home, &drawing, &canvas, &o, &p);
    assert_eq!(p.reach.fraction(), 1.0);
}

#[test]
fn six_joints_draw_too() {
    let (arm, home, o) = (arms::ur5e(), arms::ur5e_home(), PlanOptions::default());
    let canvas = canvas([0.45, 0.1, 0.1], [0.0, 0.0, 1.0], 0.5, |_| 0.0);
    let drawing = laid(&canvas, &artwork(0.1));
    let p = planned(&arm, &home, &drawing, &canvas, &o);
    assert_sound(&arm, &home, &drawing, &canvas, &o, &p);
    assert_eq!(p.reach.fraction(), 1.0);
}

#[test]
fn the_plan_is_the_same_at_any_thread_count() {
    let (arm, home, o) = (arms::iiwa(), arms::iiwa_home(), PlanOptions::default());
    let canvas = dome();
    let drawing = laid(&canvas, &artwork(0.06));
    let with = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap_or_else(|e| panic!("{e}"));
        pool.install(|| planned(&arm, &home, &drawing, &canvas, &o))
    };
    let (a, b) = (with(1), with(2));
    assert!(a.plan == b.plan && a.statistics == b.statistics && a.reach == b.reach);
}

#[test]
fn what_can_not_be_reached_is_named_and_the_rest_drawn_on_request() {
    let (arm, home) = (arms::iiwa(), arms::iiwa_home());
    let canvas = canvas([0.72, 0.0, 0.75], [-1.0, 0.0, 0.0], 2.4, |_| 0.0);
    // the second stroke runs off to the side, the third lies far out
    let strokes = vec![
        line(50, (-0.05, 0.0), (0.05, 0.0)),
        line(400, (0.0, 0.05), (0.8, 0.05)),
        line(50, (1.0, 0.0), (1.05, 0.0)),
    ];
    let drawing = laid(&canvas, &[strokes]);
    let refused = plan(
        &PlanJob {
            arm_index: 0,
            arm: &arm,
            home: &home,
            service: &home,
            drawing: &drawing,
            canvas: &canvas,
            obstacles: &[],
        },
        &PlanOptions::default(),
        &mut |_| (),
    );
    let Err(PlanError::Unreachable { report }) = refused else { panic!("not refused: {:?}", refused.map(|p| p.reach)) };
    assert_eq!(report.unreachable.iter().map(|u| u.stroke).collect::<Vec<_>>(), vec![1, 2]);
    assert_eq!((report.unreachable[1].first, report.unreachable[1].last), (0, 50));
    let message = PlanError::Unreachable { report: report.clone() }.to_string();
    assert!(message.contains("layer ink 0 stroke 2 points 0 to 50 (x 1000.0 mm, y 0.0 mm)"), "{message}");
    assert!(message.contains("partial = true"), "{message}");
    let o = PlanOptions { partial: true, ..PlanOptions::default() };
    let p = planned(&arm, &home, &drawing, &canvas, &o);
    assert_eq!(p.reach, *report);
    assert!(p.reach.fraction() > 0.3 && p.reach.fraction() < 0.9, "{}", p.reach.fraction());
    assert_eq!(p.plan.segments.iter().filter(|s| s.kind == SegmentKind::Draw).count(), 2);
    assert_sound(&arm, &home, &drawing, &canvas, &o, &p);
}

#[test]
fn travel_goes_round_furniture() {
    let (arm, home, o) = (arms::iiwa(), arms::iiwa_home(), PlanOptions::default());
    let canvas = wall();
    let drawing = laid(&canvas, &[vec![line(20, (-0.15, 0.0), (-0.13, 0.0)), line(20, (0.13, 0.0), (0.15, 0.0))]]);
    // a board that stands out from the wall between the two strokes
    let board = |x: f64, z: f64| Point3::new(x, 0.0, z);
    let corners = vec![board(0.64, 0.6), board(0.72, 0.6), board(0.72, 0.9), board(0.64, 0.9)];
    let obstacle = TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap_or_else(|e| panic!("{e}"));
    let mut away = home;
    away[3] -= 0.17;
    away[1] -= 0.4;
    let p = plan(
        &PlanJob {
            arm_index: 0,
            arm: &arm,
            home: &away,
            service: &away,
            drawing: &drawing,
            canvas: &canvas,
            obstacles: std::slice::from_ref(&obstacle),
        },
        &o,
        &mut |_| (),
    )
    .unwrap_or_else(|e| panic!("{e}"));
    assert!(p.statistics.travels_raised + p.statistics.travels_searched > 0, "{:?}", p.statistics);
    let obstacles = [obstacle];
    let surroundings = Surroundings::new(&arm, &canvas.mesh, &obstacles, &o);
    for s in p.plan.segments.iter().filter(|s| s.kind == SegmentKind::Travel) {
        let mut cursor = 0;
        for i in 0..=(s.trajectory.duration() / 0.01) as usize {
            let k = arm.kinematics(&s.trajectory.sample(i as f64 * 0.01, &mut cursor).q);
            assert!(surroundings.clearance(&k, PenUse::Travelling).excess > -0.002);
        }
    }
}

#[test]
fn poses_and_options_that_make_no_sense_are_refused_with_numbers() {
    let (arm, home) = (arms::iiwa(), arms::iiwa_home());
    let canvas = wall();
    let drawing = laid(&canvas, &[vec![line(20, (0.0, 0.0), (0.02, 0.0))]]);
    let attempt = |home: &JointVector, o: &PlanOptions| {
        plan(
            &PlanJob {
                arm_index: 0,
                arm: &arm,
                home,
                service: home,
                drawing: &drawing,
                canvas: &canvas,
                obstacles: &[],
            },
            o,
            &mut |_| (),
        )
        .map(|_| ())
        .map_err(|e| e.to_string())
    };
    let mut far = home;
    far[1] = 2.5;
    assert!(attempt(&far, &PlanOptions::default()).is_err_and(|e| e.contains("joint_2 at 2.500")));
    let mut through = JointVector::zeros();
    through[1] = 1.3;
    assert!(attempt(&through, &PlanOptions::default()).is_err_and(|e| e.contains("too near to canvas")));
    let o = PlanOptions { step: 0.0, ..PlanOptions::default() };
    assert!(attempt(&home, &o).is_err_and(|e| e.contains("step is 0, but must be positive")));
}
