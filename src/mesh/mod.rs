//! Triangle meshes and point clouds: smooth normals, closest-point and ray queries, file formats and generated shapes.

mod cloud;
mod crease;
mod file;
mod obj;
mod ply;
mod polygon;
pub mod shapes;
mod stl;
mod triangle;
mod trimesh;

pub use cloud::{PointCloud, read_cloud};
pub use file::{MeshFileError, ply_bytes, read, write};
pub use trimesh::{MeshError, SurfacePoint, TriMesh};
