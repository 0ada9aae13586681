//! Triangle meshes: smooth normals, closest-point and ray queries, file formats and generated shapes.

mod crease;
mod file;
mod obj;
mod ply;
mod polygon;
pub mod shapes;
mod stl;
mod triangle;
mod trimesh;

pub use file::{MeshFileError, read, write};
pub use trimesh::{MeshError, SurfacePoint, TriMesh};
