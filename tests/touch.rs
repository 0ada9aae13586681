//! A simulation that goes on from plan to plan, and what an arm feels in it.
mod support;

use calamus::control::{ImpedanceController, ImpedanceOptions};
use calamus::math::Rgb;
use calamus::mesh::TriMesh;
use calamus::pen::LayerPen;
use calamus::pen::PenModel;
use calamus::plan::{ArmPlan, Plan, Segment, SegmentKind, Trajectory};
use calamus::twin::{
    Executed, Feeling, Guard, PlantKind, Record, Simulation, Surroundings, TwinArm, TwinOptions, simulate,
};
use nalgebra::{Point3, Vector3};
use support::{FromAbove, canvas, follow, iiwa, inverse_kinematics, pen_pose, smooth};

/// Surface height of the test plane, m.
const TABLE: f64 = 0.45;

fn table() -> TriMesh {
    let corner = |x: f64, y: f64| Point3::new(x, y, TABLE);
    let corners = vec![corner(0.2, -0.4), corner(1.0, -0.4), corner(1.0, 0.4), corner(0.2, 0.4)];
    TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

/// Down from `high` to `low` over the table, then along it by 40 mm, each in 1 s.
fn segments(high: f64, low: f64) -> Vec<Segment> {
    let (arm, q) = iiwa();
    let at = |y: f64, height: f64| pen_pose(Point3::new(0.55, y, TABLE + height), -Vector3::z());
    let q = inverse_kinematics(&arm, &at(0.0, high), &q);
    let down = follow(&arm, &q, SegmentKind::Press, 0.0, 1.0, |t| at(0.0, high + (low - high) * smooth(t)));
    let end = down.trajectory.knots()[down.trajectory.knots().len() - 1].q;
    let along = follow(&arm, &end, SegmentKind::Draw, 1.0, 1.0, |t| at(0.04 * smooth(t), low));
    vec![down, along]
}

/// Executes plans one after another, all with the guard; a plan without segments is a rest of 0.5 s where motion ended.
fn execute(plans: &[Vec<Segment>], guard: Option<Guard>) -> (Vec<Executed>, Record) {
    let (arm, _) = iiwa();
    let pens = [LayerPen { pen: PenModel::named("fineliner_08").unwrap(), ink: "black".into() }];
    let canvas = canvas(table());
    let world = Surroundings { canvas: &canvas, friction: 0.3, compliance: 0.0, mapping: &FromAbove, pens: &pens };
    let twin = || TwinArm {
        model: arm.clone(),
        controller: ImpedanceController::new(arm.clone(), ImpedanceOptions::default()).into(),
        start: plans[0][0].trajectory.knots()[0].q,
    };
    let plan = |segments: &Vec<Segment>| {
        let start = segments[0].start;
        let segments = segments.iter().map(|s| Segment { start: s.start - start, ..s.clone() }).collect();
        Plan { arms: vec![ArmPlan { arm: 0, segments }] }
    };
    let options = TwinOptions { plant: PlantKind::Articulated, ..Default::default() };
    let mut simulation = Simulation::new(vec![twin()], &[0], &world, &options).unwrap();
    simulation.feel(Feeling { force_noise: 0.01, contact_force: 0.1, stride: 10 });
    let mut executed: Vec<Executed> = Vec::new();
    for p in plans {
        let rest = |e: &Executed| {
            let trajectory = Trajectory::rest(e.arms[0].reference.q, 0.5);
            vec![Segment { trajectory, start: 0.0, ..plans[0][0].clone() }]
        };
        // nothing stops a rest
        let (segments, guard) = match executed.last() {
            Some(last) if p.is_empty() => (rest(last), None),
            _ => (p.clone(), guard),
        };
        executed.push(simulation.execute(&plan(&segments), guard, &mut |_| ()).unwrap());
    }
    let record = simulation.finish(&[Rgb([0; 3])]);
    if plans.len() == 1 && guard.is_none() {
        let whole = simulate(vec![twin()], &plan(&plans[0]), &world, &[Rgb([0; 3])], &options, &mut |_| ()).unwrap();
        assert_eq!(whole.digest, record.digest, "feeling changes nothing");
    }
    (executed, record)
}

#[test]
fn a_plan_in_two_parts_draws_what_it_draws_in_one() {
    let parts = segments(0.01, -0.003);
    let (_, whole) = execute(std::slice::from_ref(&parts), None);
    let (executed, halves) = execute(&[vec![parts[0].clone()], vec![parts[1].clone()]], None);
    assert!(executed.iter().all(|e| e.stopped.is_none()));
    assert_eq!(halves.arms[0].strokes.len(), 1);
    // the second part begins when the first has wholly ended: one step later
    assert_eq!(halves.steps, whole.steps + 1);
    for (a, b) in whole.arms[0].final_q.iter().zip(&halves.arms[0].final_q) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
    let force = |r: &Record| r.arms[0].strokes[0].force.mean;
    assert!((force(&whole) - force(&halves)).abs() < 0.01);
}

#[test]
fn a_guarded_motion_stops_at_its_force_and_tells_where_the_surface_is() {
    let (free, _) = execute(&[vec![segments(0.02, 0.002)[0].clone()]], Some(Guard { force: 0.5 }));
    assert!(free[0].stopped.is_none() && free[0].arms[0].felt.is_empty());

    let down = segments(0.006, -0.004)[0].clone();
    // it stays where it stopped: the pen gives way by its spring, and the robot knows how much
    let (met, record) = execute(&[vec![down.clone()], vec![]], Some(Guard { force: 0.5 }));
    assert!(met[0].stopped == Some(0) && met[0].time < down.end() && met[1].time > met[0].time + 0.4);
    assert!(record.arms[0].max_force > 0.5 && record.arms[0].max_force < 8.0, "{} N", record.arms[0].max_force);
    let felt = met[1].arms[0].felt.last().unwrap();
    let pen = PenModel::named("fineliner_08").unwrap();
    let surface = felt.tip - felt.axis * (felt.force / pen.spring.stiffness);
    assert!((surface.z - TABLE).abs() < 4e-5, "{} m", surface.z - TABLE);
}
