//! Places tried in earnest: the strokes of each are planned with the arm standing there.
use std::collections::BTreeSet;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::ink::Ink;
use super::options::BasePose;
use super::pen_reach::PenReach;
use super::place::Piece;
use super::solve::CoverJob;
use crate::math::Pose;
use crate::mesh::{MeshError, TriMesh};
use crate::plan::field::{PostureField, Workcell};
use crate::plan::path::solve;
use crate::plan::reach::Obstruction;
use crate::plan::surroundings::{PenUse, Surroundings};
use crate::plan::waypoint::{Waypoint, waypoints};
use crate::plan::{IkSolver, PenTarget, PlanOptions};
use crate::robot::ArmModel;

/// Distance between poses that are tried along a stroke, m.
const STEP: f64 = 0.01;

/// What can't be drawn from a place.
#[derive(Clone, Debug)]
pub(super) struct Failure {
    /// Columns of the wall where it lies; all of the place's when the arm can't even wait there.
    pub columns: BTreeSet<usize>,
    /// How much line, m.
    pub length: f64,
    /// The arm can't even wait there.
    pub waiting: bool,
    /// Why the first of it can't.
    pub reason: Obstruction,
}

/// The arm on a base at `pose`, and all that stands round it.
fn standing(job: &CoverJob, pose: &BasePose) -> Result<(ArmModel, Vec<TriMesh>), MeshError> {
    let world = Pose::from_parts(
        Translation3::new(pose.x, pose.y, 0.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.heading),
    );
    let [x, y, z] = job.cover.mount;
    let arm = ArmModel { world_from_base: world * Isometry3::translation(x, y, z), ..job.arm.clone() };
    let mut obstacles: Vec<TriMesh> = job.obstacles.to_vec();
    obstacles.push(PenReach::body(job.cover)?.transformed(&(world * Isometry3::translation(x, y, 0.0))));
    Ok((arm, obstacles))
}

/// Whether the arm can wait in its home posture on a base at `pose`.
pub(super) fn can_wait(job: &CoverJob, pose: &BasePose) -> Result<bool, MeshError> {
    let (arm, obstacles) = standing(job, pose)?;
    let surroundings = Surroundings::new(&arm, &job.canvas.mesh, &obstacles, job.plan);
    Ok(surroundings.clearance(&arm.kinematics(job.home), PenUse::Travelling).is_clear())
}

/// What of `pieces` can't be drawn from a base at `pose`; `None` when all can.
pub(super) fn verify(
    job: &CoverJob,
    ink: &Ink,
    pose: &BasePose,
    pieces: &[Piece],
) -> Result<Option<Failure>, MeshError> {
    let (arm, obstacles) = standing(job, pose)?;
    let options = PlanOptions { step: STEP, partial: true, ..job.plan.clone() };
    let cell = Workcell {
        solver: IkSolver::new(&arm, options.limit_margin),
        surroundings: Surroundings::new(&arm, &job.canvas.mesh, &obstacles, &options),
        options: &options,
        home: *job.home,
    };
    let ways: Vec<(usize, Vec<usize>, Vec<Waypoint>)> = pieces.iter().filter_map(|p| way(ink, p, &options)).collect();
    let waits = cell.surroundings.clearance(&arm.kinematics(job.home), PenUse::Travelling);
    if !waits.is_clear() {
        let columns = ways.iter().flat_map(|w| w.1.iter().copied()).collect();
        let step = |w: &[Waypoint]| (w[1].target.position - w[0].target.position).norm();
        let length = ways.iter().flat_map(|w| w.2.windows(2)).map(step).sum();
        let reason = Obstruction::from_clearance(&arm, &waits);
        return Ok(Some(Failure { columns, length, waiting: true, reason }));
    }
    let targets: Vec<PenTarget> = ways.iter().flat_map(|w| &w.2).map(|w| w.target).collect();
    let field = PostureField::new(&cell, &targets);
    let gaps: Vec<(BTreeSet<usize>, f64, Obstruction)> = ways
        .par_iter()
        .flat_map_iter(|(_, columns, way)| {
            let found = solve(&cell, &field, way).gaps;
            found.into_iter().map(|g| {
                let ends = way[g.first].source.floor() as usize..=way[g.last].source.ceil() as usize;
                let touched = columns[*ends.start()..=(*ends.end()).min(columns.len() - 1)].iter().copied().collect();
                let length =
                    (g.first..g.last).map(|i| (way[i + 1].target.position - way[i].target.position).norm()).sum();
                (touched, length, g.reason)
            })
        })
        .collect();
    let Some((_, _, reason)) = gaps.first().cloned() else { return Ok(None) };
    let length = gaps.iter().map(|g| g.1).sum();
    let columns = gaps.into_iter().flat_map(|g| g.0).collect();
    Ok(Some(Failure { columns, length, waiting: false, reason }))
}

/// A piece's poses, and the column of each of its targets.
fn way(ink: &Ink, piece: &Piece, options: &PlanOptions) -> Option<(usize, Vec<usize>, Vec<Waypoint>)> {
    let stroke = ink.strokes.iter().find(|s| s.layer == piece.layer && s.stroke == piece.stroke)?;
    let within: Vec<_> =
        stroke.samples.iter().filter(|s| s.at >= piece.from - 1e-9 && s.at <= piece.to + 1e-9).collect();
    let mut kept: Vec<usize> = Vec::new();
    for (i, s) in within.iter().enumerate() {
        let far = kept.last().is_none_or(|k| (within[*k].target.position - s.target.position).norm() > 0.3 * STEP);
        if far || i + 1 == within.len() {
            kept.push(i);
        }
    }
    let targets: Vec<_> = kept.iter().map(|i| within[*i].target).collect();
    let columns = kept.iter().map(|i| within[*i].column).collect();
    (!targets.is_empty()).then(|| (piece.stroke, columns, waypoints(&targets, piece.layer, options)))
}
