//! Triangle meshes: adjacency, closest-point and ray queries, file formats and generated shapes.

mod crease;
mod triangle;
mod trimesh;

pub use trimesh::{MeshError, SurfacePoint, TriMesh};
