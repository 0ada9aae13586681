//! Walls: canvases that are pulled straight up from a profile, and what of them stands in a base's way.
use std::path::{Path, PathBuf};

use nalgebra::{Isometry2, Point2};
use serde::Deserialize;

use super::random_profile::RandomFile;
use super::shape::ShapeError;
use crate::files;
use crate::math::Pose;
use crate::mesh::{Opening, ProfileCurve, ProfileShape, TriMesh, extrusion};

/// A robot drives through an opening that begins at most this high over the floor edge, m.
const SILL: f64 = 0.02;
/// A robot with its arm folded drives through an opening that ends at least this high over the floor edge, m.
const LINTEL: f64 = 1.9;

/// A wall: a profile in the x-y plane pulled upwards, m, world.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// From left to right as an artist before the wall sees it.
    pub profile: ProfileCurve,
    /// z of the floor edge.
    pub bottom: f64,
    /// z of the upper edge.
    pub top: f64,
    /// Doors, windows, niches: where there is no wall.
    pub openings: Vec<Opening>,
}

impl Wall {
    /// Whether there is wall at arc length `s` and height `z`, m.
    pub fn has(&self, s: f64, z: f64) -> bool {
        (0.0..=self.profile.length()).contains(&s)
            && (self.bottom..=self.top).contains(&z)
            && !self.openings.iter().any(|o| o.contains(s, z))
    }

    /// The openings that a robot drives through: from the floor up, and as high as a man.
    pub fn doors(&self) -> impl Iterator<Item = &Opening> {
        let drives = |o: &&Opening| o.bottom <= self.bottom + SILL && o.top >= self.bottom + LINTEL;
        self.openings.iter().filter(drives)
    }

    /// The straight pieces of wall that stop a base on the floor, in order.
    pub fn barriers(&self) -> Vec<[Point2<f64>; 2]> {
        let mut cuts: Vec<f64> = self.profile.along().to_vec();
        cuts.extend(self.doors().flat_map(|o| [o.left, o.right]));
        cuts.retain(|s| (0.0..=self.profile.length()).contains(s));
        cuts.sort_by(f64::total_cmp);
        let open = |s: f64| self.doors().any(|o| (o.left..=o.right).contains(&s));
        let solid = |w: &&[f64]| w[1] - w[0] > 1e-9 && !open(0.5 * (w[0] + w[1]));
        cuts.windows(2).filter(solid).map(|w| [self.profile.at(w[0]), self.profile.at(w[1])]).collect()
    }
}

/// A profile in a scene file: one of the five.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProfileFile {
    points_mm: Option<Vec<[f64; 2]>>,
    #[serde(default)]
    fillet_mm: f64,
    spline_mm: Option<Vec<[f64; 2]>>,
    arc: Option<ArcFile>,
    file: Option<PathBuf>,
    random: Option<RandomFile>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ArcFile {
    center_mm: [f64; 2],
    radius_mm: f64,
    from_deg: f64,
    to_deg: f64,
}

/// An opening in a scene file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OpeningFile {
    left_mm: f64,
    right_mm: f64,
    #[serde(default)]
    bottom_mm: f64,
    top_mm: f64,
}

fn metres(points: &[[f64; 2]]) -> Vec<Point2<f64>> {
    points.iter().map(|[x, y]| Point2::new(x / 1000.0, y / 1000.0)).collect()
}

pub(super) fn wrong(key: &'static str, message: impl Into<String>) -> ShapeError {
    ShapeError::Key { key, message: message.into() }
}

impl ProfileFile {
    /// The curve, m; `scene` gives the folder of its file.
    fn curve(&self, scene: &Path, step: f64) -> Result<ProfileCurve, ShapeError> {
        let curved = self.spline_mm.is_some() || self.arc.is_some() || self.random.is_some();
        let given = [
            self.points_mm.is_some(),
            self.spline_mm.is_some(),
            self.arc.is_some(),
            self.file.is_some(),
            self.random.is_some(),
        ];
        if given.iter().filter(|g| **g).count() != 1 {
            return Err(wrong("profile", "a profile is one of points_mm, spline_mm, arc, file and random"));
        }
        if self.fillet_mm != 0.0 && curved {
            return Err(wrong("profile.fillet_mm", "fillet_mm rounds the corners of points_mm or of a file alone"));
        }
        let fillet = self.fillet_mm / 1000.0;
        let shape = if let Some(points) = &self.points_mm {
            ProfileShape::Polyline { points: metres(points), fillet }
        } else if let Some(points) = &self.spline_mm {
            ProfileShape::Spline { points: metres(points) }
        } else if let Some(arc) = &self.arc {
            let center = metres(&[arc.center_mm])[0];
            let (from, to) = (arc.from_deg.to_radians(), arc.to_deg.to_radians());
            ProfileShape::Arc { center, radius: arc.radius_mm / 1000.0, from, to }
        } else if let Some(random) = &self.random {
            random.shape()?
        } else {
            let file = self.file.as_deref().unwrap_or(Path::new(""));
            let file = scene.parent().unwrap_or(Path::new("")).join(file);
            ProfileShape::Polyline { points: metres(&read_points(&file)?), fillet }
        };
        ProfileCurve::new(&shape, step).map_err(|e| wrong("profile", e.to_string()))
    }
}

/// Points of a text file: two numbers a line, mm, with a comma or blanks between them; `#` begins a comment.
fn read_points(file: &Path) -> Result<Vec<[f64; 2]>, ShapeError> {
    let text = files::read_text(file).map_err(|e| wrong("profile.file", format!("{}: {e}", file.display())))?;
    let mut points = Vec::new();
    for (n, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let numbers: Option<Vec<f64>> = line
            .split(|c: char| c == ',' || c.is_whitespace())
            .filter(|w| !w.is_empty())
            .map(|w| w.parse().ok())
            .collect();
        let pair: Option<[f64; 2]> = numbers.and_then(|n| n.try_into().ok());
        let bad = || wrong("profile.file", format!("{}:{}: should be two numbers, mm", file.display(), n + 1));
        points.push(pair.ok_or_else(bad)?);
    }
    Ok(points)
}

/// The wall of a scene file and its mesh, at `pose`. Sizes in m.
pub(super) fn wall(
    scene: &Path,
    (profile, openings): (&ProfileFile, &[OpeningFile]),
    (bottom, height): (f64, f64),
    size: f64,
    pose: &Pose,
) -> Result<(Wall, TriMesh), ShapeError> {
    let curve = profile.curve(scene, size)?;
    if !(bottom.is_finite() && bottom.abs() < 1e3) {
        return Err(wrong("bottom_mm", "bottom_mm must be finite and within 1 km"));
    }
    if (pose.rotation * nalgebra::Vector3::z() - nalgebra::Vector3::z()).norm() > 1e-9 {
        return Err(wrong("pose", "an extrusion stands upright: only the third of rpy_deg may differ from 0"));
    }
    let mut holes = Vec::new();
    for o in openings {
        let [left, right, low, high] = [o.left_mm, o.right_mm, o.bottom_mm, o.top_mm].map(|mm| mm / 1000.0);
        if !(left.is_finite() && right.is_finite() && low.is_finite() && high.is_finite() && left < right && low < high)
        {
            return Err(wrong("openings", "an opening needs left_mm below right_mm and bottom_mm below top_mm"));
        }
        if left >= curve.length() || right <= 0.0 || low >= bottom + height || high <= bottom {
            let message = format!(
                "the opening from {} to {} mm isn't in the wall, which is {:.0} mm long",
                o.left_mm,
                o.right_mm,
                curve.length() * 1e3
            );
            return Err(wrong("openings", message));
        }
        holes.push(Opening { left, right, bottom: low, top: high });
    }
    let mesh = extrusion(&curve, bottom, bottom + height, &holes, size)?.transformed(pose);
    let shift = pose.translation.vector;
    let yaw = pose.rotation.euler_angles().2;
    let profile = curve.transformed(&Isometry2::new(shift.xy(), yaw));
    let raise = |z: f64| z + shift.z;
    let openings = holes.iter().map(|o| Opening { bottom: raise(o.bottom), top: raise(o.top), ..*o }).collect();
    Ok((Wall { profile, bottom: raise(bottom), top: raise(bottom + height), openings }, mesh))
}
