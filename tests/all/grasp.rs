//! A three-finger hand takes a pen tool out of its dock and puts it back, by contact and friction alone.
use std::path::Path;
use std::sync::OnceLock;

use calamus::math::Pose;
use calamus::robot::{JointVector, UrdfOptions, urdf};
use calamus::skill::{ChangeError, ChangeOptions, GraspMode, HandCommand, OPEN, Order, Stage, ToolChange};
use calamus::tool::ToolSet;
use calamus::twin::grasp::{
    DockError, ErrorRanges, FailureClass, SensorNoise, TrialOutcome, TrialSetup, Variation, tool_change_trial,
};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

fn set() -> ToolSet {
    ToolSet::pen_tool().unwrap()
}

/// Corners of +-3 mm, +-1 mm in height, +-3 degrees of tilt, +-5 degrees of yaw.
fn corners() -> Vec<DockError> {
    [[1, 1, 1, 1, 1, 1], [-1, 1, -1, -1, 1, -1], [1, -1, -1, 1, -1, -1], [-1, -1, 1, -1, -1, 1], [1, 1, -1, -1, -1, 1]]
        .iter()
        .map(|s| {
            let s = s.map(f64::from);
            let (tilt, yaw) = (3.0_f64.to_radians(), 5.0_f64.to_radians());
            DockError { xyz: [3e-3 * s[0], 3e-3 * s[1], 1e-3 * s[2]], rpy: [tilt * s[3], tilt * s[4], yaw * s[5]] }
        })
        .collect()
}

/// Trials at the corners, made once.
fn trials() -> &'static [TrialOutcome] {
    static TRIALS: OnceLock<Vec<TrialOutcome>> = OnceLock::new();
    TRIALS.get_or_init(|| {
        let setup = TrialSetup::gantry(set());
        corners().par_iter().map(|error| setup.run(error).unwrap()).collect()
    })
}

/// Standard deviations of x, y, z (m), roll, pitch, yaw (rad) of the tool in the hand after a stage.
fn spread(stage: Stage) -> [f64; 6] {
    let poses: Vec<[f64; 6]> = trials()
        .iter()
        .flat_map(|t| t.stages.iter().filter(|p| p.stage == stage))
        .map(|p| [p.xyz[0], p.xyz[1], p.xyz[2], p.rpy[0], p.rpy[1], p.rpy[2]])
        .collect();
    let n = poses.len() as f64;
    std::array::from_fn(|i| {
        let mean = poses.iter().map(|p| p[i]).sum::<f64>() / n;
        (poses.iter().map(|p| (p[i] - mean).powi(2)).sum::<f64>() / n).sqrt()
    })
}

#[test]
fn the_tool_is_picked_and_returned_from_every_corner_of_the_usual_errors() {
    for trial in trials() {
        assert!(trial.success(), "{trial:?}");
        let tip = Vector3::from(trial.pen_tip.unwrap()).norm();
        assert!(tip < 0.2e-3, "the pen tip is {:.3} mm off", tip * 1e3);
    }
}

#[test]
fn yaw_falls_in_the_half_grasp_tilt_in_the_lift_and_all_in_the_full_grasp() {
    let [before, half, lift, full] = [Stage::Approach, Stage::HalfGrasp, Stage::Lift, Stage::FullGrasp].map(spread);
    assert!(half[5] < 0.9 * before[5], "yaw {} rad, then {}", before[5], half[5]);
    for tilt in [3, 4] {
        assert!(before[tilt] > 0.02 && lift[tilt] < 2e-3, "tilt {} rad, then {}", before[tilt], lift[tilt]);
    }
    assert!(lift[2] < 0.1e-3, "height {} m", lift[2]);
    for (i, sd) in full.iter().enumerate() {
        let most = if i < 3 { 0.05e-3 } else { 1e-3 };
        assert!(*sd < most, "coordinate {i} of the tool in the hand has a deviation of {sd}");
    }
}

#[test]
fn a_trial_repeats_to_the_last_bit() {
    // with noise in all that it senses
    let mut setup = TrialSetup::gantry(set());
    setup.variation.noise = SensorNoise { force: 0.5, torque: 0.05, fingers: 2e-3 };
    let once = || tool_change_trial(7, &ErrorRanges::usual(), &setup).unwrap();
    let (a, b) = rayon::join(once, once);
    assert_eq!(a, b);
}

#[test]
fn a_held_tool_stays_under_load_and_slips_out_of_frictionless_fingers() {
    let mut picked = TrialSetup::gantry(set()).pick(&corners()[0]).unwrap();
    assert!(picked.change.succeeded());
    // the nib is pressed along the pen and dragged across, any way
    let mut before = picked.world.pen_tip();
    for way in [Vector3::x(), Vector3::y(), -Vector3::x(), -Vector3::y()] {
        picked.world.pull(5.0 * way + Vector3::new(0.0, 0.0, 5.0));
        picked.hold(300).unwrap();
        before = picked.world.pen_tip();
        for _ in 0..10 {
            picked.hold(100).unwrap();
            let slip = (picked.world.pen_tip() - before).norm();
            assert!(slip <= 0.02e-3, "slipped by {:.4} mm", slip * 1e3);
        }
    }

    // shape alone doesn't hold it: nothing stands over the plates
    picked.world.pull(Vector3::new(0.0, 0.0, 8.0));
    picked.hold(300).unwrap();
    assert!((picked.world.pen_tip() - before).norm() < 0.2e-3);
    picked.world.set_grip_friction(0.0);
    picked.hold(300).unwrap();
    let slip = (picked.world.pen_tip() - before).norm();
    assert!(slip > 20e-3, "without friction it moved by {:.1} mm only", slip * 1e3);
}

#[test]
fn a_tool_falls_when_the_fingers_open_in_mid_air() {
    let mut picked = TrialSetup::gantry(set()).pick(&DockError::default()).unwrap();
    assert!(picked.change.succeeded());
    picked.world.remove_dock();
    picked.hold(200).unwrap();
    let (grip, start) = (picked.world.world_from_grip(), picked.world.world_from_tool());
    for _ in 0..1500 {
        picked.world.step(&grip, &HandCommand::open()).unwrap();
    }
    let fall = start.translation.z - picked.world.world_from_tool().translation.z;
    assert!(fall > 0.05, "fell by {:.1} mm only", fall * 1e3);
}

/// Whether another tool is picked at the first corner at the first attempt.
fn is_picked(set: ToolSet) -> bool {
    let mut setup = TrialSetup::gantry(set);
    setup.options.attempts = 1;
    setup.run(&corners()[0]).unwrap().success()
}

#[test]
fn without_plates_the_tool_is_not_picked() {
    assert!(!is_picked(set().without_plates()));
}

#[test]
fn without_bevels_the_tool_is_not_held_where_it_should_be() {
    assert!(!is_picked(set().without_bevels()));
}

#[test]
fn an_empty_dock_is_noticed_and_given_up() {
    let mut setup = TrialSetup::gantry(set());
    setup.options.attempts = 1;
    let (mut world, mut change) = setup.world(&DockError::default()).unwrap();
    world.place_tool(&Pose::translation(2.0, 0.0, 1000.0));
    while change.stage().is_some() {
        let (grip, hand) = change.update(&world.senses(), calamus::twin::grasp::DT);
        world.step(&grip, &hand).unwrap();
    }
    assert!(!change.succeeded());
    assert_eq!(change.failures()[0].stage(), Stage::Lift, "{:?}", change.failures());
}

#[test]
fn a_dock_far_from_where_it_is_believed_is_noticed_and_no_pen_is_dropped() {
    let mut setup = TrialSetup::gantry(set());
    setup.options.attempts = 1;
    // the body stands in the way of a finger; the plates stand below the fingers
    for xyz in [[0.0, -0.03, 0.0], [0.0, 0.0, -0.03]] {
        let outcome = setup.run(&DockError { xyz, ..DockError::default() }).unwrap();
        assert_eq!(outcome.failure, Some(FailureClass::PickGivenUp), "{outcome:?}");
        assert!(!outcome.reports.is_empty());
    }
}

#[test]
fn a_pen_whose_dock_is_gone_is_kept_in_the_hand() {
    let setup = TrialSetup::gantry(set());
    let mut picked = setup.pick(&DockError::default()).unwrap();
    assert!(picked.change.succeeded());
    picked.world.remove_dock();
    let grip = picked.world.world_from_grip();
    let options = ChangeOptions { attempts: 1, ..setup.options.clone() };
    let mut back = ToolChange::new(Order::Return, &setup.hand, &setup.set, &setup.world_from_dock, &grip, &options);
    while back.stage().is_some() {
        let (grip, hand) = back.update(&picked.world.senses(), calamus::twin::grasp::DT);
        picked.world.step(&grip, &hand).unwrap();
    }
    assert!(matches!(back.failures(), [ChangeError::NoWall { .. }]), "{:?}", back.failures());
    let held = setup.grip_from_held() * setup.set.tool.pen_tip();
    assert!((picked.world.pen_tip() - held).norm() < 1e-3);
}

#[test]
fn a_robot_that_knows_its_hand_badly_and_senses_badly_still_picks_the_tool() {
    let mut setup = TrialSetup::gantry(set());
    setup.variation = Variation {
        mass: 1.2,
        hand_error: Pose::translation(1e-3, -1e-3, 1e-3),
        noise: SensorNoise { force: 0.5, torque: 0.05, fingers: 2e-3 },
        ..Variation::default()
    };
    let outcome = setup.run(&corners()[3]).unwrap();
    assert!(outcome.success(), "{outcome:?}");
}

#[test]
fn the_hand_does_what_it_is_told() {
    let run = |command: HandCommand, steps: u32| {
        let (mut world, _) = TrialSetup::gantry(set()).world(&DockError::default()).unwrap();
        world.place_tool(&Pose::translation(2.0, 0.0, 1000.0));
        let grip = world.world_from_grip();
        for _ in 0..steps {
            world.step(&grip, &command).unwrap();
        }
        world.senses().hand
    };
    let open = HandCommand { speed: 0.11, ..HandCommand::open() };
    // the two fingers turn on their knuckles, outwards and inwards; the thumb has none
    for (mode, spread) in [(GraspMode::Basic, 0.0), (GraspMode::Wide, 0.19), (GraspMode::Pinch, -0.19)] {
        let hand = run(HandCommand { mode, close: 0.4, ..open }, 700);
        assert!((hand.scissor[0] + hand.scissor[1]).abs() < 1e-3, "{mode:?}: {:?}", hand.scissor);
        assert!((hand.scissor[0].abs() - f64::abs(spread)).abs() < 2e-3, "{mode:?}: {:?}", hand.scissor);
        assert!(hand.q.iter().all(|q| (q[0] - 0.4).abs() < 0.02), "{mode:?}: {:?}", hand.q);
    }
    let outwards = |mode| run(HandCommand { mode, ..open }, 400).scissor[0];
    assert!(outwards(GraspMode::Wide) * outwards(GraspMode::Pinch) < 0.0);
    // a scissor grip closes the fingers on each other and bends none
    let scissor = |close| run(HandCommand { mode: GraspMode::Scissor, close, ..open }, 700);
    let (apart, together) = (scissor(OPEN), scissor(1.22));
    assert!(apart.scissor[0] * together.scissor[0] < 0.0, "{:?} {:?}", apart.scissor, together.scissor);
    assert!(together.q.iter().all(|q| (q[0] - OPEN).abs() < 0.02), "{:?}", together.q);
    // half the speed, half the way
    let way = |speed| run(HandCommand { close: 1.0, speed, ..open }, 300).q[0][0] - OPEN;
    let ratio = way(0.044) / way(0.022);
    assert!((1.8..2.2).contains(&ratio), "{ratio}");
}

#[test]
fn a_weak_grip_lets_go_of_what_a_strong_one_holds() {
    let slip = |grip: f64| {
        let mut setup = TrialSetup::gantry(set());
        setup.options.grip[1] = grip;
        let mut picked = setup.pick(&DockError::default()).unwrap();
        assert!(picked.change.succeeded(), "{grip} N");
        let before = picked.world.pen_tip();
        // up along the pen, where nothing but friction holds it
        picked.world.pull(Vector3::new(0.0, 0.0, 45.0));
        picked.hold(300).unwrap();
        (picked.world.pen_tip() - before).norm()
    };
    let (weak, strong) = (slip(15.0), slip(35.0));
    assert!(weak > 5e-3 && strong < 1e-3, "15 N: {:.3} mm, 35 N: {:.3} mm", weak * 1e3, strong * 1e3);
}

#[test]
fn a_ur5e_picks_the_tool_under_its_torque_law() {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/robots/ur5e.urdf"));
    let options =
        UrdfOptions { base_link: Some("base_link".into()), tip_link: Some("tool0".into()), ..UrdfOptions::default() };
    let mut arm = urdf::load(file, &options).unwrap();
    arm.world_from_base = Pose::translation(0.0, 0.0, 0.3);
    let mut home = JointVector::zeros();
    for (q, deg) in home.iter_mut().zip([180.0_f64, -76.0, -140.0, -144.0, -89.0, 0.0]) {
        *q = deg.to_radians();
    }
    let setup = TrialSetup::on_arm(set(), &arm, home, Pose::translation(0.55, -0.13, 0.55));
    let picked = setup.pick(&corners()[1]).unwrap();
    assert!(picked.change.succeeded(), "{:?}", picked.change.failures());
    let held = setup.grip_from_held() * setup.set.tool.pen_tip();
    let off: Vector3<f64> = picked.world.pen_tip() - Point3::from(held);
    assert!(off.norm() < 0.2e-3, "the pen tip is {:.3} mm off", off.norm() * 1e3);
}
