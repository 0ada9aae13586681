//! The sections of metrics.json, each from what the stage itself left.
use crate::drawing::{Drawing, InkLayer};
use crate::ink::InkTrace;
use crate::math::Rgb;
use crate::math::stats::Running;
use crate::measure::laid::laid_strokes;
use crate::measure::{
    ContactMetrics, CoverageMetrics, DrawingMetrics, GridShape, LayerMetrics, LineFit, LineMetrics, MappingMetrics,
    PlanFailure, PlanMetrics, ShapeMetrics, SideErrors, SimMetrics, TruthMetrics,
};
use crate::mesh::Distortion;
use crate::plan::cover::Coverage;
use crate::plan::{Plan, ReachReport, SegmentKind};
use crate::surface::SurfaceDrawing;
use crate::truth::TruthReport;
use crate::twin::{PlantKind, Record};

/// Period of the controller, at which joint steps are counted, s.
const CONTROL_PERIOD: f64 = 1e-3;
/// Strokes shorter than this say nothing of length errors, m.
pub(super) const SHORT: f64 = 2e-3;

impl DrawingMetrics {
    /// Figures of the artwork.
    pub fn of(drawing: &Drawing, duration_s: f64) -> Self {
        Self {
            part: None,
            strokes: drawing.stroke_count(),
            points: drawing.point_count(),
            length_m: drawing.length(),
            inks: drawing.layers.len(),
            ink_changes: drawing.ink_changes(),
            estimated_s: None,
            layers: drawing.layers.iter().map(LayerMetrics::of).collect(),
            duration_s: Some(duration_s),
        }
    }
}

impl LayerMetrics {
    fn of(layer: &InkLayer) -> Self {
        let Rgb([r, g, b]) = layer.color;
        Self {
            name: layer.name.clone(),
            color: format!("#{r:02x}{g:02x}{b:02x}"),
            strokes: layer.strokes.len(),
            points: layer.strokes.iter().map(|s| s.points.len()).sum(),
            length_m: layer.strokes.iter().fold(0.0, |sum, s| sum + s.length()),
        }
    }
}

impl MappingMetrics {
    /// With figures of how the canvas stretches the drawing; `flips` of the flattened canvas, where there is one.
    pub fn with(self, distortion: Option<&Distortion>, flips: Option<usize>) -> Self {
        let Some(d) = distortion else { return self };
        Self {
            angle_error_mean: Some(d.angle_error_mean),
            angle_error_p95: Some(d.angle_error_p95),
            area_ratio_p05: Some(d.area_ratio_p05),
            area_ratio_p95: Some(d.area_ratio_p95),
            quasi_conformal_mean: Some(d.quasi_conformal_mean),
            quasi_conformal_max: Some(d.quasi_conformal_max),
            flips,
            ..self
        }
    }

    /// Figures of a mapping: how much strokes are stretched or shrunk on the canvas.
    pub fn of(kind: &str, drawing: &Drawing, mapped: &SurfaceDrawing, duration_s: f64) -> Self {
        let strokes = laid_strokes(drawing, mapped);
        let errors = strokes.iter().filter(|s| s.desired_m >= SHORT).map(|s| (s.laid_m / s.desired_m - 1.0).abs());
        let worst = errors.fold(None, |worst: Option<f64>, e| Some(worst.unwrap_or(0.0).max(e)));
        Self { kind: kind.into(), length_error_max: worst, duration_s: Some(duration_s), ..Default::default() }
    }
}

impl CoverageMetrics {
    /// Figures of a cover.
    pub fn of(c: &Coverage) -> Self {
        Self {
            method: c.method.clone(),
            places: c.places.len(),
            cuts: c.strokes_cut(),
            crossings: c.cuts.len(),
            raise_mm: (c.raise != 0.0).then_some(c.raise * 1e3),
            drive_m: c.drive(),
            drive_s: 0.0,
            estimated_s: None,
            optimal: usize::from(c.optimal),
            bound: (c.bound > 0).then_some(c.bound),
            solver_s: c.solver_s,
            duration_s: None,
        }
    }
}

impl PlanMetrics {
    /// Figures of a plan.
    pub fn of(plan: &Plan, reach: &ReachReport, duration_s: f64) -> Self {
        let count = |kind| plan.arms.iter().flat_map(|a| &a.segments).filter(|s| s.kind == kind).count();
        // a pen that is fetched is brought back, or the run ends
        let changes = count(SegmentKind::ChangePen) + count(SegmentKind::ChangeTool).div_ceil(2);
        Self {
            max_joint_step_rad: Some(max_joint_step(plan)),
            tool_changes: Some(changes),
            estimated_s: Some(plan.duration()),
            ..Self::unreachable(reach, duration_s)
        }
    }

    /// What is known when there is no plan.
    pub fn unreachable(reach: &ReachReport, duration_s: f64) -> Self {
        let failures = reach.unreachable.iter().map(|u| PlanFailure {
            layer: u.layer,
            stroke: u.stroke,
            point: Some(u.first),
            reason: u.reason.to_string(),
        });
        Self {
            reachable_fraction: reach.fraction(),
            failures: failures.collect(),
            duration_s: Some(duration_s),
            ..Default::default()
        }
    }
}

/// Largest turn of a joint between two control periods, rad, in all of a plan.
fn max_joint_step(plan: &Plan) -> f64 {
    let mut largest = 0.0f64;
    for segment in plan.arms.iter().flat_map(|a| &a.segments) {
        if segment.kind == SegmentKind::ChangePen {
            continue;
        }
        let (mut cursor, mut last) = (0, None);
        for i in 0..=(segment.trajectory.duration() / CONTROL_PERIOD).ceil() as u64 {
            let q = segment.trajectory.sample(i as f64 * CONTROL_PERIOD, &mut cursor).q;
            if let Some(last) = last.replace(q) {
                largest = largest.max((q - last).amax());
            }
        }
    }
    largest
}

impl SimMetrics {
    /// Figures of a simulation.
    pub fn of(record: &Record, plant: PlantKind) -> Self {
        let strokes = || record.arms.iter().flat_map(|a| &a.strokes);
        let steps: u64 = strokes().map(|s| s.steps).sum();
        let saturated: u64 = strokes().map(|s| s.saturated_steps).sum();
        Self {
            plant: match plant {
                PlantKind::Rapier => "rapier".into(),
                PlantKind::Articulated => "articulated".into(),
            },
            steps: record.steps,
            simulated_s: record.simulated,
            wall_s: record.wall,
            real_time_factor: (record.wall > 0.0).then(|| record.simulated / record.wall),
            saturated_fraction: (steps > 0).then(|| saturated as f64 / steps as f64),
            max_joint_step_rad: Some(record.arms.iter().map(|a| a.max_joint_step).fold(0.0, f64::max)),
        }
    }
}

impl ContactMetrics {
    /// Force and contact over every physics step of every drawn stroke.
    pub fn of(record: &Record) -> Self {
        let (mut target, mut error) = (Running::default(), Running::default());
        let (mut force, mut steps, mut contact, mut lost) = (Running::default(), 0u64, 0u64, 0u64);
        for s in record.arms.iter().flat_map(|a| &a.strokes) {
            force.merge(&s.force);
            target.merge(&s.target);
            error.merge(&s.force_error);
            steps += s.steps;
            contact += s.contact_steps;
            lost += s.lost_contacts;
        }
        let seen = steps > 0;
        Self {
            force_target_n: seen.then_some(target.mean),
            force_mean_n: seen.then_some(force.mean),
            // where the target stays, its difference from the force varies as the force does
            force_sd_n: seen.then(|| if target.min == target.max { force.sd() } else { error.sd() }),
            force_max_n: Some(record.arms.iter().map(|a| a.max_force).fold(0.0, f64::max)),
            contact_fraction: seen.then(|| contact as f64 / steps as f64),
            lost_contacts: Some(lost),
            pen_up_contact_steps: Some(record.arms.iter().map(|a| a.pen_up_contact_steps).sum()),
        }
    }
}

impl LineMetrics {
    /// Of a line of which nothing was drawn.
    pub fn nothing_drawn() -> Self {
        Self { coverage: Some(0.0), inked_length_m: Some(0.0), ..Self::default() }
    }

    /// Figures of the drawn line, in the units of metrics.json.
    pub fn of(fit: &LineFit, trace: &InkTrace) -> Self {
        let (mut length, mut area) = (0.0, 0.0);
        for w in trace.strokes.iter().flat_map(|s| s.points.windows(2)) {
            let d = (w[1].position - w[0].position).norm();
            length += d;
            area += d * 0.5 * (w[0].width + w[1].width);
        }
        Self {
            error_mean_mm: Some(fit.error_mean * 1e3),
            error_p95_mm: Some(fit.error_p95 * 1e3),
            error_max_mm: Some(fit.error_max * 1e3),
            stroke_error_max_mm: fit.stroke_error_max.map(|m| m * 1e3),
            tip_error_max_mm: None,
            coverage: Some(fit.coverage),
            touchable: None,
            excess: Some(fit.excess),
            width_mean_mm: (length > 0.0).then(|| area / length * 1e3),
            inked_length_m: Some(length),
            width_error_p90: None,
        }
    }
}

impl ShapeMetrics {
    /// Figures of a pattern's shape: of a grid, and of the sides of any pattern; a grid's own sides go from crossing to crossing.
    /// `None` where nothing could be measured.
    pub fn of(grid: Option<&GridShape>, sides: Option<&SideErrors>) -> Option<Self> {
        let sides = grid.and_then(|g| g.sides.as_ref()).or(sides);
        (grid.is_some() || sides.is_some()).then(|| Self {
            aspect_deviation: grid.map(|g| g.aspect_deviation),
            angle_deviation: grid.map(|g| g.angle_deviation / std::f64::consts::FRAC_PI_2),
            angle_deviation_deg: grid.map(|g| g.angle_deviation.to_degrees()),
            missing_crossings: grid.map(|g| g.missing),
            side_error_mean: sides.map(|s| s.mean),
            side_error_p95: sides.map(|s| s.p95),
            side_error_max: sides.map(|s| s.max),
        })
    }
}

impl TruthMetrics {
    /// Figures of a true canvas, in the units of metrics.json.
    pub fn of(report: &TruthReport) -> Self {
        Self {
            hausdorff_mm: Some(report.hausdorff * 1e3),
            hausdorff_percent: Some(report.hausdorff / report.size * 1e2),
            offset_mm: Some(report.offset.norm() * 1e3),
            turn_deg: Some(report.turn.to_degrees()),
            scale_percent: Some(report.scale * 1e2),
        }
    }
}
