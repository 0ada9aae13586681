//! `[scan]` in the terms of the stages: SI units.
use nalgebra::{Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::camera::{DepthCamera, ScanOptions, Viewpoint, Viewpoints};
use crate::math::Pose;
use crate::reconstruct::{MeshingOptions, Placement};

use super::{ScanCamera, ScanPose, ScanSettings};

impl ScanPose {
    /// The pose of the cloud's frame, m, world.
    pub(crate) fn pose(self) -> Pose {
        let [roll, pitch, yaw] = self.rpy_deg.map(f64::to_radians);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_euler_angles(roll, pitch, yaw));
        Pose::from_parts(Translation3::from(Vector3::from(self.xyz_mm) * 1e-3), rotation)
    }
}

impl ScanSettings {
    /// How well the canvas's place is known beforehand, and marks are measured.
    pub(crate) fn placement(&self) -> Placement {
        let s = self;
        Placement {
            shift: s.placement_mm * 1e-3,
            turn: s.placement_deg.to_radians(),
            mark_noise: s.marks_noise_mm * 1e-3,
        }
    }

    /// How a mesh is made of the cloud.
    pub(crate) fn meshing(&self) -> MeshingOptions {
        let s = self;
        MeshingOptions {
            margin: s.margin_mm * 1e-3,
            voxel: s.voxel_mm * 1e-3,
            outlier_deviations: s.outlier_deviations,
            triangle: s.triangle_mm * 1e-3,
            radius: s.smooth_mm.map(|mm| mm * 1e-3),
            hole: s.hole_mm * 1e-3,
        }
    }

    /// Settings of the simulated camera and what is made of its pictures.
    pub(crate) fn scan_options(&self) -> ScanOptions {
        let s = self;
        let point = |mm: [f64; 3]| Point3::from(mm.map(|x| x * 1e-3));
        let views = if s.cameras.is_empty() {
            Viewpoints::Around {
                count: s.views as usize,
                distance: s.distance_mm * 1e-3,
                slant: s.slant_deg.to_radians(),
            }
        } else {
            let view = |c: &ScanCamera| Viewpoint { eye: point(c.eye_mm), target: point(c.target_mm) };
            Viewpoints::At(s.cameras.iter().map(view).collect())
        };
        ScanOptions {
            camera: DepthCamera {
                size_px: s.image_px.map(|px| px as usize),
                field_of_view: s.field_of_view_deg.map(f64::to_radians),
                baseline: s.baseline_mm * 1e-3,
                range: s.range_mm.map(|mm| mm * 1e-3),
                noise_px: s.noise_px,
                window_px: s.window_px as usize,
                disparity_step_px: s.disparity_step_px,
                dropout: s.dropout,
                mismatches: s.mismatches,
                grazing: s.grazing_deg.to_radians(),
            },
            views,
            calibration: s.calibration_mm * 1e-3,
            calibration_angle: s.calibration_deg.to_radians(),
            register: s.register,
            meshing: s.meshing(),
        }
    }
}
