//! Visual and collision geometry of one URDF link.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use urdf_rs::Geometry;

use super::source::Source;
use super::tree::pose_of;
use super::{RobotError, UrdfOptions};
use crate::math::{Pose, Rgb};
use crate::mesh::{self, TriMesh};
use crate::robot::enclose::{around_cylinder, enclosing_capsule};
use crate::robot::{Capsule, Visual, VisualShape};

/// Colour of a visual without a material.
const PLAIN: Rgb = Rgb([200, 203, 206]);

/// Reads shapes, each mesh file once.
pub(super) struct Shapes<'s> {
    source: &'s Source,
    options: &'s UrdfOptions,
    colors: BTreeMap<String, Rgb>,
    /// By name and scale.
    meshes: BTreeMap<(String, [u64; 3]), TriMesh>,
}

impl<'s> Shapes<'s> {
    /// Collects the named materials.
    pub fn new(source: &'s Source, options: &'s UrdfOptions) -> Self {
        let mut colors = BTreeMap::new();
        let inline = source.robot.links.iter().flat_map(|l| &l.visual).filter_map(|v| v.material.as_ref());
        for material in source.robot.materials.iter().chain(inline) {
            if let Some(color) = &material.color {
                colors.entry(material.name.clone()).or_insert_with(|| rgb(&color.rgba));
            }
        }
        Self { source, options, colors, meshes: BTreeMap::new() }
    }

    /// The visuals of link `i`, in its own frame.
    pub fn visuals(&mut self, i: usize) -> Result<Vec<Visual>, RobotError> {
        let mut visuals = Vec::new();
        for visual in &self.source.robot.links[i].visual {
            let color = visual.material.as_ref().map_or(PLAIN, |m| {
                m.color.as_ref().map(|c| rgb(&c.rgba)).or_else(|| self.colors.get(&m.name).copied()).unwrap_or(PLAIN)
            });
            let at = pose_of(&visual.origin);
            self.positive(i, &visual.geometry)?;
            let mut add = |link_from_visual: Pose, shape| visuals.push(Visual { link_from_visual, shape, color });
            match &visual.geometry {
                Geometry::Box { size } => add(at, VisualShape::Cuboid { size: Vector3::from(**size) }),
                Geometry::Sphere { radius } => add(at, VisualShape::Sphere { radius: *radius }),
                Geometry::Cylinder { radius, length } => {
                    add(at, VisualShape::Cylinder { radius: *radius, length: *length });
                }
                Geometry::Capsule { radius, length } => {
                    add(at, VisualShape::Cylinder { radius: *radius, length: *length });
                    for end in [-0.5, 0.5] {
                        add(at * Pose::translation(0.0, 0.0, end * length), VisualShape::Sphere { radius: *radius });
                    }
                }
                Geometry::Mesh { filename, scale } => {
                    let mesh = self.mesh(i, filename, scale.map_or([1.0; 3], |s| *s))?;
                    let vertices = Arc::new(mesh.vertices().to_vec());
                    add(at, VisualShape::Mesh { vertices, triangles: Arc::new(mesh.triangles().to_vec()) });
                }
            }
        }
        Ok(visuals)
    }

    /// A capsule around each collision shape of link `i`, in its own frame.
    pub fn capsules(&mut self, i: usize) -> Result<Vec<Capsule>, RobotError> {
        let mut capsules = Vec::new();
        for collision in &self.source.robot.links[i].collision {
            self.positive(i, &collision.geometry)?;
            let along_z = |radius: f64, length: f64| Capsule {
                a: Point3::new(0.0, 0.0, -0.5 * length),
                b: Point3::new(0.0, 0.0, 0.5 * length),
                radius,
            };
            let capsule = match &collision.geometry {
                Geometry::Capsule { radius, length } => Some(along_z(*radius, *length)),
                Geometry::Sphere { radius } => Some(along_z(*radius, 0.0)),
                Geometry::Cylinder { radius, length } => Some(around_cylinder(*radius, *length)),
                Geometry::Box { size } => enclosing_capsule(&corners(size)),
                Geometry::Mesh { filename, scale } => {
                    enclosing_capsule(self.mesh(i, filename, scale.map_or([1.0; 3], |s| *s))?.vertices())
                }
            };
            capsules.extend(capsule.map(|c| c.seen_from(&pose_of(&collision.origin))));
        }
        Ok(capsules)
    }

    /// Sizes must be positive: a negative radius turns a shape inside out.
    fn positive(&self, i: usize, geometry: &Geometry) -> Result<(), RobotError> {
        let (shape, sizes): (&str, Vec<f64>) = match geometry {
            Geometry::Box { size } => ("box", size.to_vec()),
            Geometry::Cylinder { radius, length } => ("cylinder", vec![*radius, *length]),
            Geometry::Capsule { radius, length } => ("capsule", vec![*radius, length + radius]),
            Geometry::Sphere { radius } => ("sphere", vec![*radius]),
            Geometry::Mesh { scale, .. } => {
                ("mesh scale", scale.map_or(vec![], |s| s.iter().map(|x| x.abs()).collect()))
            }
        };
        match sizes.iter().find(|s| !(1e-9..1e6).contains(*s)) {
            Some(bad) => Err(self.source.bad_link(i, format!("a {shape} size of {bad} must be positive, in m"))),
            None => Ok(()),
        }
    }

    /// A mesh file, scaled. A mirroring scale turns the triangles so that they still face out.
    fn mesh(&mut self, i: usize, name: &str, scale: [f64; 3]) -> Result<TriMesh, RobotError> {
        let key = (name.to_string(), scale.map(f64::to_bits));
        if let Some(mesh) = self.meshes.get(&key) {
            return Ok(mesh.clone());
        }
        let fail = |reason: String| RobotError::Mesh {
            file: self.source.file.clone(),
            line: self.source.links[i].line,
            element: format!("link `{}`", self.source.robot.links[i].name),
            mesh: name.to_string(),
            reason,
        };
        let path = resolve(name, &self.source.file, self.options).map_err(&fail)?;
        let [x, y, z] = scale;
        let mesh = if x == y && y == z && x > 0.0 {
            mesh::read(&path, x).map_err(|e| fail(e.to_string()))?
        } else {
            let file = mesh::read(&path, 1.0).map_err(|e| fail(e.to_string()))?;
            let vertices = file.vertices().iter().map(|p| Point3::new(p.x * x, p.y * y, p.z * z)).collect();
            let mirrored = x * y * z < 0.0;
            let turn = |t: &[u32; 3]| if mirrored { [t[0], t[2], t[1]] } else { *t };
            TriMesh::new(vertices, file.triangles().iter().map(turn).collect()).map_err(|e| fail(e.to_string()))?
        };
        self.meshes.insert(key, mesh.clone());
        Ok(mesh)
    }
}

impl Capsule {
    /// The same capsule seen from frame a.
    pub fn seen_from(&self, a_from_b: &Pose) -> Self {
        Self { a: a_from_b * self.a, b: a_from_b * self.b, radius: self.radius }
    }
}

fn rgb(rgba: &urdf_rs::Vec4) -> Rgb {
    let byte = |x: f64| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
    Rgb([byte(rgba[0]), byte(rgba[1]), byte(rgba[2])])
}

fn corners(size: &[f64; 3]) -> Vec<Point3<f64>> {
    let side = |bit: usize, k: usize| if bit >> k & 1 == 0 { -0.5 * size[k] } else { 0.5 * size[k] };
    (0..8).map(|bit| Point3::new(side(bit, 0), side(bit, 1), side(bit, 2))).collect()
}

/// The file that a URDF means by a mesh name: `package://name/rest` through the given map, else upwards from the URDF
/// (a folder `name` beside any of its parents, or a parent called `name`); `file://` and plain paths relative to the URDF.
fn resolve(name: &str, urdf: &Path, options: &UrdfOptions) -> Result<PathBuf, String> {
    let folder = urdf.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let existing =
        |path: PathBuf| if path.is_file() { Ok(path) } else { Err(format!("{} is not a file", path.display())) };
    let Some(in_package) = name.strip_prefix("package://") else {
        let plain = name.strip_prefix("file://").unwrap_or(name);
        if plain.contains("://") {
            return Err("only package://, file:// and plain paths are read".to_string());
        }
        return existing(folder.join(plain));
    };
    let (package, rest) = in_package.split_once('/').ok_or("a package path needs package://name/file")?;
    if let Some(dir) = options.packages.get(package) {
        return existing(dir.join(rest));
    }
    let absolute = std::path::absolute(folder).map_err(|e| e.to_string())?;
    for parent in absolute.ancestors() {
        let beside = parent.join(package).join(rest);
        if beside.is_file() {
            return Ok(beside);
        }
        let inside = parent.join(rest);
        if parent.file_name().is_some_and(|n| n == package) && inside.is_file() {
            return Ok(inside);
        }
    }
    Err(format!(
        "no folder above {} holds {package}/{rest}; give the folder of package `{package}` under `packages`",
        folder.display()
    ))
}
