//! A small made-up record for tests.
use nalgebra::{Point3, Vector3};

use crate::drawing::StrokeId;
use crate::ink::InkTrace;
use crate::math::stats::Running;
use crate::plan::SegmentKind;
use crate::twin::{ArmRecord, ArmSample, Event, EventKind, Record, StrokeRecord};

/// Sixty seconds of an arm that draws four strokes, 10 Hz.
pub(super) fn record() -> Record {
    let sample = |i: u32| {
        let time = f64::from(i) * 0.1;
        let drawing = i % 150 > 30;
        let normal_force = if drawing { 1.05 + 0.03 * (time * 7.0).sin() } else { 0.0 };
        ArmSample {
            time,
            segment: if drawing { SegmentKind::Draw } else { SegmentKind::Travel },
            q: (0..7).map(|j| 0.3 * f64::from(j) + 0.1 * (time * 0.2 + f64::from(j)).sin()).collect(),
            qd: vec![0.0; 7],
            torque: Some(vec![1.0; 7]),
            tip: Point3::new(0.6, 0.01 * time, 0.2),
            tip_desired: Some(Point3::new(0.6, 0.01 * time, 0.197)),
            force: Some(Vector3::new(0.0, 0.0, normal_force)),
            normal_force: Some(normal_force),
        }
    };
    let stroke = |index: u32| {
        let start = f64::from(index) * 15.0 + 3.1;
        let mut lateral_error = Running::default();
        (0..50).for_each(|i| lateral_error.push(5e-5 + 2e-5 * f64::from(i + index).sin()));
        let (end, steps) = (start + 11.8, 11_800);
        let id = StrokeId { layer: index / 2, index: index % 2 };
        StrokeRecord {
            stroke: id,
            start,
            end,
            steps,
            contact_steps: steps,
            lost_contacts: 0,
            force: Running::default(),
            target: Running::default(),
            force_error: Running::default(),
            saturated_steps: 0,
            lateral_error,
        }
    };
    let arm = ArmRecord {
        name: "iiwa".into(),
        joints: (1..=7).map(|i| format!("iiwa_joint_{i}")).collect(),
        sample_period: 0.1,
        samples: (0..600).map(sample).collect(),
        strokes: (0..4).map(stroke).collect(),
        max_joint_step: 1e-4,
        max_force: 1.3,
        pen_up_contact_steps: 0,
        final_q: vec![0.0; 7],
        final_qd: vec![0.0; 7],
        base: Vec::new(),
        stands: Vec::new(),
        final_base: None,
    };
    let event = |time, kind| Event { time, arm: 0, stroke: None, kind };
    Record {
        arms: vec![arm],
        events: vec![
            event(0.0, EventKind::Segment { kind: SegmentKind::Travel }),
            event(3.1, EventKind::Touch),
            event(14.9, EventKind::Leave),
            event(30.0, EventKind::PenChanged { ink: "blue & <grey>".into() }),
        ],
        ink: InkTrace::default(),
        steps: 60_000,
        simulated: 60.0,
        wall: 1.0,
        digest: "0".repeat(32),
    }
}
