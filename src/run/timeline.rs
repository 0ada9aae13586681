//! What all arms did as one plan, in the time of the run.
use super::belief::Believed;
use super::setup::Setup;
use crate::exec::{Done, Made, cut};
use crate::plan::{ArmPlan, Plan, Segment, SegmentKind, Trajectory};
use crate::robot::JointVector;

/// A pause longer than this is a wait, s: motions settle for a step or two between them.
const PAUSE: f64 = 3e-3;

/// All motion that was carried out, with the waits between.
pub(super) fn plan<P>(setup: &Setup, believed: &Believed, done: &[Done<P>]) -> Plan {
    let arms = done.iter().zip(&setup.cell.arms).enumerate();
    Plan { arms: arms.map(|(i, (d, arm))| arm_plan(i, believed, d, &arm.home)).collect() }
}

fn arm_plan<P>(arm: usize, believed: &Believed, done: &Done<P>, home: &JointVector) -> ArmPlan {
    let planned: Vec<&Segment> = believed.planning.iter().flat_map(|p| &p.timelines[arm]).flatten().collect();
    let mut segments: Vec<Segment> = Vec::new();
    for made in &done.made {
        let segment = match made {
            Made::Own(segment) => segment.clone(),
            Made::Planned { index, start, until } => cut(Segment { start: *start, ..planned[*index].clone() }, *until),
        };
        let end = segments.last().map_or(0.0, Segment::end);
        if segment.start - end > PAUSE {
            let at = segments.last().and_then(|s| s.trajectory.knots().last()).map_or(*home, |k| k.q);
            let trajectory = Trajectory::rest(at, segment.start - end);
            let (kind, depth) = (SegmentKind::Wait, Default::default());
            segments.push(Segment { kind, layer: segment.layer, stroke: None, start: end, trajectory, depth });
        }
        segments.push(segment);
    }
    ArmPlan { arm, segments }
}
