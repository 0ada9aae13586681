//! From a drawing on a believed surface to everything that one arm does.
use rayon::prelude::*;

use crate::mesh::TriMesh;
use crate::plan::assembly::{Assembly, BATCH, PlanStatistics, Solved, length};
use crate::plan::field::{PostureField, Workcell};
use crate::plan::path::solve;
use crate::plan::reach::{Obstruction, ReachReport};
use crate::plan::stroke::draw;
use crate::plan::surroundings::{PenUse, Surroundings};
use crate::plan::waypoint::{Waypoint, waypoints};
use crate::plan::{ArmPlan, IkSolver, MotionLimits, PenTarget, PlanError, PlanOptions};
use crate::robot::{ArmModel, JointVector};
use crate::surface::{BelievedCanvas, SurfaceDrawing};

/// What an arm does, what it can't do, and figures.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Segments from home to the service pose.
    pub plan: ArmPlan,
    /// What is drawn and what is not.
    pub reach: ReachReport,
    /// Figures.
    pub statistics: PlanStatistics,
}

/// What is to be planned: a drawing, and the arm that draws it.
#[derive(Clone, Copy)]
pub struct PlanJob<'a> {
    /// Number of the arm in the cell.
    pub arm_index: usize,
    /// The arm as it believes itself to be.
    pub arm: &'a ArmModel,
    /// Where it starts at rest, with the first ink's pen in its holder, rad.
    pub home: &'a JointVector,
    /// Where pens are changed, and where it ends, clear of the drawing, rad.
    pub service: &'a JointVector,
    /// The drawing on the believed canvas.
    pub drawing: &'a SurfaceDrawing,
    /// The believed canvas.
    pub canvas: &'a BelievedCanvas,
    /// The furniture, world.
    pub obstacles: &'a [TriMesh],
}

/// Plans all of a drawing for one arm.
///
/// `progress` hears the done share, from 0 to 1. Strokes are solved in parallel, each
/// apart from the others in postures that are common to the drawing, so the plan is the same bits at any thread count.
///
/// # Errors
/// [`PlanError::Unreachable`] when something can't be drawn and `options.partial` is false; others for poses and
/// options that can't be used.
pub fn plan(job: &PlanJob, options: &PlanOptions, progress: &mut dyn FnMut(f64)) -> Result<Planned, PlanError> {
    let PlanJob { arm_index, arm, home, service, drawing, canvas, obstacles } = *job;
    if let Some((name, value, wanted)) = options.invalid() {
        return Err(PlanError::Option { name, value, wanted });
    }
    let cell = Workcell {
        solver: IkSolver::new(arm, options.limit_margin),
        surroundings: Surroundings::new(arm, &canvas.mesh, obstacles, options),
        options,
        home: *home,
    };
    let limits = MotionLimits::new(arm, options);
    check_pose(&cell, "home", home)?;
    check_pose(&cell, "service", service)?;

    let strokes = drawing.sequence();
    let ways: Vec<Vec<Waypoint>> =
        strokes.par_iter().map(|(l, s)| waypoints(&drawing.layers[*l].strokes[*s].targets, *l, options)).collect();
    let targets: Vec<PenTarget> = ways.iter().flatten().map(|w| w.target).collect();
    let field = PostureField::new(&cell, &targets);
    drop(targets);
    progress(0.05);

    let mut assembly = Assembly::new(&cell, service, &limits, drawing);
    let mut done = 0;
    for batch in ways.chunks(BATCH) {
        let solved: Vec<Solved> = batch.par_iter().map(|way| solve_stroke(&cell, &field, way, &limits)).collect();
        for s in solved {
            let (layer, stroke) = strokes[done];
            assembly.collect(layer, stroke, s);
            done += 1;
        }
        progress(0.05 + 0.75 * done as f64 / ways.len() as f64);
    }
    if !options.partial && !assembly.reach.unreachable.is_empty() {
        return Err(PlanError::Unreachable { report: Box::new(assembly.reach) });
    }

    let segments = assembly.join(progress)?;
    let Assembly { reach, statistics, .. } = assembly;
    if !options.partial && !reach.unreachable.is_empty() {
        return Err(PlanError::Unreachable { report: Box::new(reach) });
    }
    progress(1.0);
    Ok(Planned { plan: ArmPlan { arm: arm_index, segments }, reach, statistics })
}

/// A pose must be within the limits and free.
fn check_pose(cell: &Workcell, pose: &'static str, q: &JointVector) -> Result<(), PlanError> {
    let arm = cell.solver.arm();
    for (i, joint) in arm.joints.iter().enumerate() {
        if !(q[i] >= joint.lower && q[i] <= joint.upper) {
            return Err(PlanError::PoseOutsideLimits {
                arm: arm.name.clone(),
                pose,
                joint: joint.name.clone(),
                value: q[i],
                lower: joint.lower,
                upper: joint.upper,
            });
        }
    }
    let clearance = cell.surroundings.clearance(&arm.kinematics(q), PenUse::Travelling);
    if clearance.is_clear() {
        return Ok(());
    }
    Err(PlanError::PoseObstructed { arm: arm.name.clone(), pose, reason: Obstruction::from_clearance(arm, &clearance) })
}

fn solve_stroke(cell: &Workcell, field: &PostureField, way: &[Waypoint], limits: &MotionLimits) -> Solved {
    let mut path = solve(cell, field, way);
    let mut drawn = Vec::new();
    for run in std::mem::take(&mut path.runs) {
        match draw(cell, way, &run, limits) {
            Ok(d) => drawn.push((run, d)),
            Err(reason) => path.gaps.push(crate::plan::path::Gap { first: run.first, last: run.last(), reason }),
        }
    }
    path.gaps.sort_by_key(|g| g.first);
    let whole = length(way, 0, way.len().saturating_sub(1));
    let drawn_length = drawn.iter().map(|(r, _)| length(way, r.first, r.last())).sum();
    Solved { path, drawn, length: whole, drawn_length, way: way.to_vec() }
}
