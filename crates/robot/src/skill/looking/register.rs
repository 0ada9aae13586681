//! Where the base and its camera stand, by least squares over all that was seen and felt.
//!
//! Unknown are the base's place along the wall and off it and its heading, and six numbers of the camera's mount. Gauss-Newton with
//! weights of Huber (doi:10.1214/aoms/1177703732) on distances in the picture across the lines; what was believed before counts as so
//! many measurements (maximum a posteriori), so that what a picture can't tell stays as it was.
use nalgebra::{Matrix3, Matrix6, Point2, Point3, SMatrix, SVector, Translation3, UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::CameraModel;
use crate::math::Pose;
use crate::mesh::TriMesh;

/// Unknowns: along the wall, off it, heading; shift and turn of the camera in its own frame.
pub(super) const UNKNOWNS: usize = 9;
/// What the unknowns are counted in: m and rad.
const UNITS: [f64; UNKNOWNS] = [1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3];
/// Standard deviation of a point of a line in a picture, px. Errors of neighbours on a line are alike, so this is more than each has.
const POINT_PX: f64 = 1.0;
/// Residual from which on a point counts less, standard deviations.
const HUBER: f64 = 1.0;
/// Standard deviation of a felt point across the wall, m.
const FELT: f64 = 1e-4;
/// Rounds of Gauss-Newton.
const ROUNDS: usize = 8;

pub(super) type Unknowns = SVector<f64, UNKNOWNS>;
pub(super) type Information = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// A point of a line as it was to be drawn, on the believed canvas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawnPoint {
    /// Where, m, world.
    pub position: Point3<f64>,
    /// Direction of the line, unit, world.
    pub along: Vector3<f64>,
    /// Outward normal of the canvas, unit, world.
    pub normal: Vector3<f64>,
    /// Width of the line, m.
    pub width: f64,
    /// Whether it was drawn from where the base stands now: then it moves along the canvas with what is believed of that place.
    pub own: bool,
}

/// A point of a drawn line and where a picture shows its line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeenPoint {
    /// As it was to be drawn.
    pub drawn: DrawnPoint,
    /// A point of the line in the picture, px.
    pub place: Point2<f64>,
    /// Across the line in the picture, unit.
    pub across: Vector2<f64>,
}

/// What a picture shows of the lines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sighting {
    /// Where the camera is believed to have been, in the base's frame.
    pub base_from_camera: Pose,
    /// Points of lines.
    pub points: Vec<SeenPoint>,
}

/// What is known of how the camera is mounted, against its model: shift (m) and turn (rad) in the camera's frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MountBelief {
    /// Best guess.
    pub mean: [f64; 6],
    /// Covariance, row by row.
    pub covariance: Vec<f64>,
}

impl MountBelief {
    /// As calibrated: errors of these standard deviations, m and rad, along and about each axis.
    pub fn calibrated(shift: f64, turn: f64) -> Self {
        let sd = [shift, shift, shift, turn, turn, turn];
        let covariance = (0..36).map(|i| if i / 6 == i % 6 { sd[i / 6] * sd[i / 6] } else { 0.0 }).collect();
        Self { mean: [0.0; 6], covariance }
    }

    pub(super) fn information(&self) -> Matrix6<f64> {
        let covariance = Matrix6::from_row_slice(&self.covariance) + Matrix6::identity() * 1e-14;
        covariance.try_inverse().unwrap_or_else(Matrix6::identity)
    }
}

/// A wall where it is looked at: what the base's corrections are counted along and about.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WallFrame {
    /// The point about which the base is turned, m, world.
    pub middle: Point3<f64>,
    /// Level along the wall, to the left of who faces it, unit, world.
    pub along: Vector3<f64>,
    /// Level and off the wall, unit, world.
    pub off: Vector3<f64>,
}

impl WallFrame {
    /// The frame at a point with this outward normal; `None` where the canvas lies flat.
    pub fn at(middle: Point3<f64>, normal: &Vector3<f64>) -> Option<Self> {
        let off = Vector3::new(normal.x, normal.y, 0.0).try_normalize(0.2)?;
        Some(Self { middle, along: off.cross(&Vector3::z()), off })
    }

    /// The motion of the world's frame that these unknowns say.
    pub(super) fn correction(&self, x: &Unknowns) -> Pose {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), x[2]);
        let shift = self.along * x[0] + self.off * x[1];
        let place = self.middle.coords + shift - turn * self.middle.coords;
        Pose::from_parts(Translation3::from(place), turn)
    }
}

/// What was seen and felt at a place, and what was believed before.
#[derive(Clone, Copy)]
pub(super) struct Evidence<'a> {
    pub camera: &'a CameraModel,
    pub mount: &'a MountBelief,
    /// Where the base is believed to stand.
    pub world_from_base: Pose,
    pub wall: WallFrame,
    /// Standard deviations of the base's place along the wall and off it (m) and of its heading (rad).
    pub spread: [f64; 3],
    pub sightings: &'a [Sighting],
    /// Points of the canvas that were felt, base frame, m.
    pub felt: &'a [Point3<f64>],
    pub canvas: &'a TriMesh,
}

/// The best guess and how sure it is.
pub(super) struct Estimate {
    pub x: Unknowns,
    pub information: Information,
    /// Root of the mean square of what is left across the lines, px.
    pub rms_px: f64,
}

impl Estimate {
    /// How well the place along the wall is told by what was seen, if the camera sits as it is taken to: standard deviation, m.
    pub fn sd_along(&self) -> f64 {
        let own: Matrix3<f64> = self.information.fixed_view::<3, 3>(0, 0).into_owned();
        own.try_inverse().map_or(f64::INFINITY, |c| c[(0, 0)].max(0.0).sqrt() * UNITS[0])
    }

    /// What is known of the camera's mount now.
    pub fn mount(&self) -> Option<MountBelief> {
        let covariance = self.information.try_inverse()?;
        let c = |i: usize| covariance[(3 + i / 6, 3 + i % 6)] * UNITS[3 + i / 6] * UNITS[3 + i % 6];
        let mean = std::array::from_fn(|i| self.x[3 + i]);
        Some(MountBelief { mean, covariance: (0..36).map(c).collect() })
    }
}

impl Evidence<'_> {
    /// What is believed before anything is seen.
    pub fn prior(&self) -> Unknowns {
        let m = &self.mount.mean;
        Unknowns::from_fn(|i, _| if i < 3 { 0.0 } else { m[i - 3] })
    }

    /// Where a drawn point is in a picture taken from `base_from_camera`, px.
    pub fn project(&self, base_from_camera: &Pose, p: &DrawnPoint, x: &Unknowns) -> Option<Point2<f64>> {
        let moved = self.wall.correction(x);
        let mount = Pose::new(Vector3::new(x[3], x[4], x[5]), Vector3::new(x[6], x[7], x[8]));
        let world_from_camera = moved * self.world_from_base * base_from_camera * mount;
        let position = if p.own {
            let way = moved * p.position - p.position;
            p.position + (way - p.normal * way.dot(&p.normal))
        } else {
            p.position
        };
        self.camera.project(&(world_from_camera.inverse() * position))
    }

    /// Residuals in standard deviations: of points in pictures first, then of felt points.
    fn residuals(&self, x: &Unknowns) -> (Vec<f64>, Vec<f64>) {
        let seen = self.sightings.iter().flat_map(|s| s.points.iter().map(move |p| (s, p)));
        let seen = seen.map(|(s, p)| {
            let at = self.project(&s.base_from_camera, &p.drawn, x);
            at.map_or(0.0, |at| p.across.dot(&(at - p.place)) / POINT_PX)
        });
        let base = self.wall.correction(x) * self.world_from_base;
        let felt = self.felt.iter().map(|p| {
            let p = base * p;
            let wall = self.canvas.closest_point(&p);
            (p - wall.position).dot(&wall.normal) / FELT
        });
        (seen.collect(), felt.collect())
    }

    /// What was believed before, as information about the unknowns in their units.
    fn prior_information(&self) -> Information {
        let mut information = Information::zeros();
        for (i, sd) in self.spread.iter().enumerate() {
            information[(i, i)] = (UNITS[i] / sd).powi(2);
        }
        let mount = self.mount.information();
        for i in 0..6 {
            for j in 0..6 {
                information[(3 + i, 3 + j)] = mount[(i, j)] * UNITS[3 + i] * UNITS[3 + j];
            }
        }
        information
    }

    /// The best guess from `start` on.
    pub fn solve(&self, start: Unknowns) -> Estimate {
        let (prior, known) = (self.prior(), self.prior_information());
        let mut x = start;
        let mut estimate = Estimate { x, information: known, rms_px: 0.0 };
        for _ in 0..ROUNDS {
            let (seen, felt) = self.residuals(&x);
            let moved: Vec<(Vec<f64>, Vec<f64>)> = (0..UNKNOWNS)
                .map(|i| {
                    let mut x = x;
                    x[i] += 1e-3 * UNITS[i];
                    self.residuals(&x)
                })
                .collect();
            let far = prior - x;
            let apart = Unknowns::from_fn(|i, _| far[i] / UNITS[i]);
            let (mut information, mut pull) = (known, known * apart);
            let mut squares = (0.0, 0.0);
            let mut add = |residual: f64, slope: Unknowns, weight: f64| {
                information += slope * slope.transpose() * weight;
                pull -= slope * (residual * weight);
            };
            for (k, r) in seen.iter().enumerate() {
                let slope = Unknowns::from_fn(|i, _| (moved[i].0[k] - r) / 1e-3);
                let weight = (HUBER / r.abs().max(1e-12)).min(1.0);
                squares = (squares.0 + r * r, squares.1 + 1.0);
                add(*r, slope, weight);
            }
            for (k, r) in felt.iter().enumerate() {
                add(*r, Unknowns::from_fn(|i, _| (moved[i].1[k] - r) / 1e-3), 1.0);
            }
            let step = information.cholesky().map_or_else(Unknowns::zeros, |c| c.solve(&pull));
            x += Unknowns::from_fn(|i, _| step[i] * UNITS[i]);
            let rms_px = if squares.1 > 0.0 { (squares.0 / squares.1).sqrt() * POINT_PX } else { 0.0 };
            estimate = Estimate { x, information, rms_px };
            if step.amax() < 1e-6 {
                break;
            }
        }
        estimate
    }
}
