//! One shape of a scene file: which, how large, where, and of what colour.
use std::path::{Path, PathBuf};

use nalgebra::{Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::scene::SceneError;
use super::wall::{OpeningFile, ProfileFile, Wall, wall};
use crate::diagnostic::{self, ConfigError};
use crate::math::{Pose, Rgb};
use crate::mesh::shapes::{self, Bumps};
use crate::mesh::{self, MeshError, MeshFileError, TriMesh};

/// Wall of a bucket unless the scene says otherwise, mm.
const WALL_MM: f64 = 3.0;
/// From bump to bump of a column unless the scene says otherwise, mm.
const BUMP_WAVELENGTH_MM: f64 = 140.0;

/// Longest side, m, below which a mesh is taken to be in a wrong unit: a grain.
const LEAST_MESH: f64 = 5e-3;
/// The same, above which it is: a building.
const MOST_MESH: f64 = 50.0;

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ShapeKind {
    Plane,
    Dome,
    Column,
    Cone,
    Bucket,
    Box,
    Cylinder,
    Extrusion,
    Mesh,
}

impl ShapeKind {
    fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Dome => "dome",
            Self::Column => "column",
            Self::Cone => "cone",
            Self::Bucket => "bucket",
            Self::Box => "box",
            Self::Cylinder => "cylinder",
            Self::Extrusion => "extrusion",
            Self::Mesh => "mesh",
        }
    }
}

/// All keys that any shape has. Which of them a shape takes is checked by hand, because the lines of errors are lost
/// when serde chooses between variants.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShapeFile {
    shape: ShapeKind,
    width_mm: Option<f64>,
    height_mm: Option<f64>,
    thickness_mm: Option<f64>,
    radius_mm: Option<f64>,
    bottom_radius_mm: Option<f64>,
    top_radius_mm: Option<f64>,
    wall_mm: Option<f64>,
    bump_amplitude_mm: Option<f64>,
    bump_wavelength_mm: Option<f64>,
    size_mm: Option<[f64; 3]>,
    mesh: Option<PathBuf>,
    /// Metres per unit of the mesh file.
    scale: Option<f64>,
    /// Of an extrusion: the curve that is pulled upwards.
    profile: Option<ProfileFile>,
    bottom_mm: Option<f64>,
    #[serde(default)]
    openings: Vec<OpeningFile>,
    triangle_mm: Option<f64>,
    #[serde(default)]
    pose: PoseFile,
    pub color: Option<Rgb>,
}

/// A pose in a file: translation and fixed-axis roll, pitch, yaw.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct PoseFile {
    xyz_mm: [f64; 3],
    rpy_deg: [f64; 3],
}

impl PoseFile {
    /// `None` when a number is not finite.
    fn pose(&self) -> Option<Pose> {
        let [r, p, y] = self.rpy_deg.map(f64::to_radians);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_euler_angles(r, p, y));
        let finite = self.xyz_mm.iter().chain(&self.rpy_deg).all(|v| v.is_finite());
        finite.then(|| Pose::from_parts(Translation3::from(Vector3::from(self.xyz_mm) / 1000.0), rotation))
    }
}

/// What is wrong with a shape, and at which of its keys (empty: the table itself).
#[derive(Debug)]
pub(super) enum ShapeError {
    Key { key: &'static str, message: String },
    MeshFile(MeshFileError),
}

impl From<MeshError> for ShapeError {
    fn from(e: MeshError) -> Self {
        Self::Key { key: "shape", message: e.to_string() }
    }
}

impl ShapeError {
    /// Places the error in the `nth` table (from 0) named `table`.
    pub fn in_table(self, text: &str, file: &Path, table: &str, nth: usize) -> SceneError {
        let (key, message) = match self {
            Self::MeshFile(e) => return e.into(),
            Self::Key { key, message } => (key, message),
        };
        let is_header = |line: &str| line.trim().trim_matches(|c| c == '[' || c == ']').trim() == table;
        let above = text.lines().enumerate().filter(|(_, l)| is_header(l)).nth(nth).map_or(0, |(i, _)| i);
        let rest: Vec<&str> = text.lines().skip(above).collect();
        let path = if key.is_empty() { table.to_string() } else { format!("{table}.{key}") };
        let line = above + diagnostic::line_of_key(&rest.join("\n"), &path);
        ConfigError::Invalid { file: file.to_path_buf(), line, message }.into()
    }
}

/// Refuses a mesh of a size at which the wrong unit is likelier than the thing.
fn believable(mesh: &TriMesh, scale: f64) -> Result<(), ShapeError> {
    let (low, high) = mesh.bounds();
    let size = high - low;
    if (LEAST_MESH..MOST_MESH).contains(&size.max()) {
        return Ok(());
    }
    let [x, y, z] = [size.x, size.y, size.z].map(|c| 1e3 * c);
    let message = format!(
        "the mesh is {x:.3} x {y:.3} x {z:.3} mm: is `scale` right? {scale} is the metres a unit of the file; 1 is for a file in \
         metres, 0.001 for one in millimetres"
    );
    Err(ShapeError::Key { key: "scale", message })
}

impl ShapeFile {
    /// The mesh, m, at its pose. `scene` gives the folder of mesh files; `triangle_mm` is the usual triangle size.
    pub fn mesh(&self, scene: &Path, triangle_mm: f64) -> Result<TriMesh, ShapeError> {
        Ok(self.made(scene, triangle_mm)?.0)
    }

    /// The same with the wall that it is, of an extrusion.
    pub fn made(&self, scene: &Path, triangle_mm: f64) -> Result<(TriMesh, Option<Wall>), ShapeError> {
        self.refuse_foreign_keys()?;
        let wrong_pose = || ShapeError::Key { key: "pose", message: "a pose must be finite and within 1 km".into() };
        let pose = self.pose.pose().filter(|p| p.translation.vector.amax() < 1e3).ok_or_else(wrong_pose)?;
        if self.shape == ShapeKind::Extrusion {
            let size = self.positive("triangle_mm", Some(self.triangle_mm.unwrap_or(triangle_mm)))? / 1000.0;
            let profile = self.profile.as_ref().ok_or_else(|| self.missing("profile"))?;
            let heights =
                (self.bottom_mm.unwrap_or(0.0) / 1000.0, self.positive("height_mm", self.height_mm)? / 1000.0);
            let (wall, mesh) = wall(scene, (profile, &self.openings), heights, size, &pose)?;
            return Ok((mesh, Some(wall)));
        }
        Ok((self.solid(scene, triangle_mm)?.transformed(&pose), None))
    }

    /// The mesh of any other shape, m, in its own frame.
    fn solid(&self, scene: &Path, triangle_mm: f64) -> Result<TriMesh, ShapeError> {
        let metres = |key, value: Option<f64>| self.positive(key, value).map(|v| v / 1000.0);
        let size = metres("triangle_mm", Some(self.triangle_mm.unwrap_or(triangle_mm)))?;
        let mesh = match self.shape {
            ShapeKind::Plane => {
                let thickness = match self.thickness_mm {
                    Some(0.0) | None => 0.0,
                    thickness => metres("thickness_mm", thickness)?,
                };
                let (width, height) = (metres("width_mm", self.width_mm)?, metres("height_mm", self.height_mm)?);
                shapes::rectangle(width, height, thickness, size)?
            }
            ShapeKind::Dome => shapes::dome(metres("radius_mm", self.radius_mm)?, size)?,
            ShapeKind::Column => {
                let amplitude = self.bump_amplitude_mm.unwrap_or(0.0) / 1000.0;
                let wavelength = Some(self.bump_wavelength_mm.unwrap_or(BUMP_WAVELENGTH_MM));
                let bumps = Bumps { amplitude, wavelength: metres("bump_wavelength_mm", wavelength)? };
                shapes::column(
                    metres("radius_mm", self.radius_mm)?,
                    metres("height_mm", self.height_mm)?,
                    &bumps,
                    size,
                )?
            }
            ShapeKind::Cone => shapes::frustum(
                metres("bottom_radius_mm", self.bottom_radius_mm)?,
                metres("top_radius_mm", self.top_radius_mm)?,
                metres("height_mm", self.height_mm)?,
                size,
            )?,
            ShapeKind::Bucket => shapes::bucket(
                metres("bottom_radius_mm", self.bottom_radius_mm)?,
                metres("top_radius_mm", self.top_radius_mm)?,
                metres("height_mm", self.height_mm)?,
                metres("wall_mm", Some(self.wall_mm.unwrap_or(WALL_MM)))?,
                size,
            )?,
            ShapeKind::Cylinder => {
                shapes::cylinder(metres("radius_mm", self.radius_mm)?, metres("height_mm", self.height_mm)?, size)?
            }
            ShapeKind::Box => {
                let [x, y, z] = self.size_mm.ok_or_else(|| self.missing("size_mm"))?;
                let edge = |v| metres("size_mm", Some(v));
                shapes::cuboid(&Vector3::new(edge(x)?, edge(y)?, edge(z)?), size)?
            }
            ShapeKind::Extrusion | ShapeKind::Mesh => {
                let file = self.mesh.as_ref().ok_or_else(|| self.missing("mesh"))?;
                let file = scene.parent().unwrap_or(Path::new("")).join(file);
                let scale = self.positive("scale", Some(self.scale.unwrap_or(1.0)))?;
                let mesh = mesh::read(&file, scale).map_err(ShapeError::MeshFile)?;
                believable(&mesh, scale)?;
                mesh
            }
        };
        Ok(mesh)
    }

    fn positive(&self, key: &'static str, value: Option<f64>) -> Result<f64, ShapeError> {
        let value = value.ok_or_else(|| self.missing(key))?;
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            Err(ShapeError::Key { key, message: format!("{key} is {value}, but must be above 0") })
        }
    }

    fn noun(&self) -> String {
        let article = if self.shape == ShapeKind::Extrusion { "an" } else { "a" };
        format!("{article} {}", self.shape.name())
    }

    fn missing(&self, key: &str) -> ShapeError {
        ShapeError::Key { key: "", message: format!("{} needs {key}", self.noun()) }
    }

    fn refuse_foreign_keys(&self) -> Result<(), ShapeError> {
        use ShapeKind::{Box, Bucket, Column, Cone, Cylinder, Dome, Extrusion, Mesh, Plane};
        let keys: [(&'static str, bool, &[ShapeKind]); 15] = [
            ("width_mm", self.width_mm.is_some(), &[Plane]),
            ("height_mm", self.height_mm.is_some(), &[Plane, Column, Cone, Bucket, Cylinder, Extrusion]),
            ("thickness_mm", self.thickness_mm.is_some(), &[Plane]),
            ("radius_mm", self.radius_mm.is_some(), &[Dome, Column, Cylinder]),
            ("bottom_radius_mm", self.bottom_radius_mm.is_some(), &[Cone, Bucket]),
            ("top_radius_mm", self.top_radius_mm.is_some(), &[Cone, Bucket]),
            ("wall_mm", self.wall_mm.is_some(), &[Bucket]),
            ("bump_amplitude_mm", self.bump_amplitude_mm.is_some(), &[Column]),
            ("bump_wavelength_mm", self.bump_wavelength_mm.is_some(), &[Column]),
            ("size_mm", self.size_mm.is_some(), &[Box]),
            ("profile", self.profile.is_some(), &[Extrusion]),
            ("bottom_mm", self.bottom_mm.is_some(), &[Extrusion]),
            ("openings", !self.openings.is_empty(), &[Extrusion]),
            ("mesh", self.mesh.is_some(), &[Mesh]),
            ("scale", self.scale.is_some(), &[Mesh]),
        ];
        match keys.iter().find(|(_, given, shapes)| *given && !shapes.contains(&self.shape)) {
            Some(&(key, ..)) => Err(ShapeError::Key { key, message: format!("{} has no {key}", self.noun()) }),
            None => Ok(()),
        }
    }
}
