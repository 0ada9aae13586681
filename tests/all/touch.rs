//! A simulation that goes on from plan to plan, and what an arm feels in it.
use crate::support::{canvas, follow, iiwa, inverse_kinematics, pen_pose, scene, setup, smooth};
use calamus::control::{ImpedanceOptions, LawOptions};
use calamus::ink::TraceInk;
use calamus::math::Rgb;
use calamus::mesh::TriMesh;
use calamus::pen::PenModel;
use calamus::plan::{Segment, SegmentKind, Trajectory};
use calamus::skill::Move;
use calamus::twin::{ArmLog, ArmStory, Ended, Feeling, PlantKind, Record, Simulation, TwinOptions, simulate};
use nalgebra::{Point3, Vector3};

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

/// The tasks of a timeline that is one of `plans`, each with the guard.
fn moves(segments: &[Segment]) -> Vec<Move> {
    let start = segments[0].start;
    let count = segments.len();
    let one = |(i, s): (usize, &Segment)| Move {
        segment: Segment { start: s.start - start, ..s.clone() },
        begins: i == 0,
        ends: i + 1 == count,
        planned: None,
        visit: None,
    };
    segments.iter().enumerate().map(one).collect()
}

/// Executes plans one after another, all with the guard (N); a plan without segments is a rest of 0.5 s where motion ended.
fn execute(plans: &[Vec<Segment>], guard: Option<f64>) -> (Vec<Ended>, Record) {
    let (arm, _) = iiwa();
    let scene = scene(&canvas(table()));
    let start = plans[0][0].trajectory.knots()[0].q;
    let options = TwinOptions::default();
    let law = LawOptions::Impedance(ImpedanceOptions::default());
    let mut simulation = Simulation::new(setup([&arm, &arm], start), scene.clone(), law.clone(), &options).unwrap();
    simulation.feel(Feeling { force_noise: 0.01, contact_force: 0.1, stride: 10 }, 0);
    let mut executed: Vec<Ended> = Vec::new();
    for p in plans {
        let rest = |e: &Ended| {
            let trajectory = Trajectory::rest(e.reference.q, 0.5);
            vec![Segment { trajectory, start: 0.0, ..plans[0][0].clone() }]
        };
        // nothing stops a rest
        let (segments, guard) = match executed.last() {
            Some(last) if p.is_empty() => (rest(last), None),
            _ => (p.clone(), guard),
        };
        for m in moves(&segments) {
            // in slices, as whoever watches would
            let ended = loop {
                if let Some(ended) = simulation.execute(&m, guard, 77, None).unwrap() {
                    break ended;
                }
            };
            executed.push(ended);
        }
    }
    let (log, ending) = (simulation.take_log(), simulation.ending());
    let story = ArmStory { name: "arm".into(), joints: Vec::new(), sample_period: 0.01, log, ending };
    let record = Record::of(vec![story], vec![TraceInk { name: "black".into(), color: Rgb([0; 3]) }], 0.0);
    if plans.len() == 1 && guard.is_none() {
        let whole = simulate(setup([&arm, &arm], start), &plans[0], &scene, law, &options).unwrap();
        assert_eq!(whole.digest, record.digest, "feeling changes nothing");
    }
    (executed, record)
}

#[test]
fn a_state_that_was_saved_goes_on_to_the_same_bits() {
    let (arm, _) = iiwa();
    let scene = scene(&canvas(table()));
    let plan = segments(0.01, -0.003);
    let start = plan[0].trajectory.knots()[0].q;
    for plant in [PlantKind::Rapier, PlantKind::Articulated] {
        let options = TwinOptions { plant, torque_noise: 0.05, delay: 0.003, ..Default::default() };
        let law = LawOptions::Impedance(ImpedanceOptions::default());
        let new = || {
            let mut s = Simulation::new(setup([&arm, &arm], start), scene.clone(), law.clone(), &options).unwrap();
            s.feel(Feeling { force_noise: 0.01, contact_force: 0.1, stride: 10 }, 0);
            s
        };
        // saved in the middle of the line, and gone on with by a simulation that knows nothing else
        let tasks = moves(&plan);
        let run = |save_at: Option<u64>| {
            let (mut simulation, mut log) = (new(), ArmLog::default());
            for m in &tasks {
                while simulation.execute(m, None, 100, None).unwrap().is_none() {
                    if save_at == Some(simulation.step()) {
                        simulation.drain();
                        log.append(simulation.take_log());
                        let bytes = postcard::to_stdvec(simulation.state()).unwrap();
                        simulation = new();
                        simulation.restore(postcard::from_bytes(&bytes).unwrap());
                    }
                }
            }
            log.append(simulation.take_log());
            (log, simulation.ending())
        };
        let whole = run(None);
        for at in [300, 1500] {
            assert_eq!(run(Some(at)), whole, "{plant:?} at step {at}");
        }
    }
}

#[test]
fn a_plan_in_two_parts_draws_what_it_draws_in_one() {
    let parts = segments(0.01, -0.003);
    let (_, whole) = execute(std::slice::from_ref(&parts), None);
    let (executed, halves) = execute(&[vec![parts[0].clone()], vec![parts[1].clone()]], None);
    assert!(executed.iter().all(|e| !e.stopped));
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
    let (free, _) = execute(&[vec![segments(0.02, 0.002)[0].clone()]], Some(0.5));
    assert!(!free[0].stopped && free[0].felt.is_empty());

    let down = segments(0.006, -0.004)[0].clone();
    // it stays where it stopped: the pen gives way by its spring, and the robot knows how much
    let (met, record) = execute(&[vec![down.clone()], vec![]], Some(0.5));
    assert!(met[0].stopped && met[0].time < down.end() && met[1].time > met[0].time + 0.4);
    assert!(record.arms[0].max_force > 0.5 && record.arms[0].max_force < 8.0, "{} N", record.arms[0].max_force);
    let felt = met[1].felt.last().unwrap();
    let pen = PenModel::named("fineliner_08").unwrap();
    let surface = felt.tip - felt.axis * (felt.force / pen.spring.stiffness);
    assert!((surface.z - TABLE).abs() < 4e-5, "{} m", surface.z - TABLE);
}
