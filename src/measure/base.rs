//! Figures of a base that drives: where it stood, how far it drove, how it swayed under its arm.
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::math::{Pose, rotation_vector};
use crate::plan::SegmentKind;
use crate::twin::{ArmRecord, BaseSample};

/// A base that drives from place to place.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct BaseMetrics {
    /// Places that were drawn from.
    pub places: usize,
    /// Drives, those included by which the base came nearer to a place.
    pub drives: usize,
    /// Length of all drives, as truly driven.
    pub drive_m: f64,
    /// Time of all drives.
    pub drive_s: f64,
    /// How far the base stood from where it was believed to stand, mean over the places drawn from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_error_mm: Option<f64>,
    /// How far its heading was from what was believed, mean over the places drawn from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_error_mrad: Option<f64>,
    /// Motion of the arm's foot while lines were drawn, about its mean at each place, root of the mean square.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sway_rms_mm: Option<f64>,
    /// Motion of the arm's foot while lines were drawn, about its mean at each place, at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sway_peak_mm: Option<f64>,
    /// How far the base crept over the floor from its arrival at a place to its leaving, at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub creep_mm: Option<f64>,
}

impl BaseMetrics {
    /// Figures of an arm's base; `base_from_arm` is where the arm stands on it. `None` of an arm on none.
    pub fn of(record: &ArmRecord, base_from_arm: &Pose) -> Option<Self> {
        if record.base.is_empty() {
            return None;
        }
        let mut figures = Self::default();
        let (mut errors, mut turns, mut sway, mut creep) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        // an arm that stopped on its way isn't folded: what it weighs on the base would be taken for creep
        let folded = record.samples.first().is_some_and(|s| apart(&s.q, &record.final_q) < FOLDED);
        let runs: Vec<&[BaseSample]> = record.base.chunk_by(|a, b| a.driving == b.driving).collect();
        for (i, run) in runs.iter().enumerate() {
            if run[0].driving {
                figures.drives += 1;
                figures.drive_m +=
                    run.windows(2).map(|w| (place(&w[1].pose) - place(&w[0].pose)).xy().norm()).sum::<f64>();
                figures.drive_s += run[run.len() - 1].time - run[0].time;
                continue;
            }
            let drawn: Vec<&BaseSample> = run.iter().filter(|s| s.segment == SegmentKind::Draw).collect();
            let Some(first) = drawn.first() else { continue };
            figures.places += 1;
            if let Some(stand) = record.stands.iter().rev().find(|s| s.time <= first.time) {
                errors.push((place(&stand.pose) - place(&stand.believed)).xy().norm() * 1e3);
                turns.push(rotation_vector(&(stand.pose.rotation * stand.believed.rotation.inverse())).z.abs() * 1e3);
            }
            let feet: Vec<Point3<f64>> = drawn.iter().map(|s| place(&(s.pose * base_from_arm))).collect();
            let mean = feet.iter().fold(Vector3::zeros(), |a, p| a + p.coords) / feet.len() as f64;
            sway.extend(feet.iter().map(|p| (p.coords - mean).norm() * 1e3));
            creep.extend(crept(run).filter(|_| folded || i + 1 < runs.len()));
        }
        let mean = |v: &[f64]| (!v.is_empty()).then(|| v.iter().sum::<f64>() / v.len() as f64);
        let most = |v: &[f64]| v.iter().copied().reduce(f64::max);
        let squares: Vec<f64> = sway.iter().map(|s| s * s).collect();
        Some(Self {
            pose_error_mm: mean(&errors),
            pose_error_mrad: mean(&turns),
            sway_rms_mm: mean(&squares).map(f64::sqrt),
            sway_peak_mm: most(&sway),
            creep_mm: most(&creep),
            ..figures
        })
    }
}

fn place(pose: &Pose) -> Point3<f64> {
    pose.translation.vector.into()
}

/// Largest difference of two postures, rad.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// How far a base stood from where it had come to rest when it left, mm: both times its arm is folded.
fn crept(run: &[BaseSample]) -> Option<f64> {
    let arrived = run.iter().rev().find(|s| s.segment == SegmentKind::Wait && s.time < run[0].time + REST)?;
    Some((place(&run[run.len() - 1].pose) - place(&arrived.pose)).xy().norm() * 1e3)
}

/// Within this of the posture in which it began an arm is folded, rad.
const FOLDED: f64 = 0.02;
/// Longest time after a drive at which a base is still at rest with its arm folded, s.
const REST: f64 = 0.9;
