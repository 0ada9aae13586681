//! Triangle meshes: smooth normals, closest-point and ray queries, file formats, generated shapes,
//! and flat maps of pieces of them.

mod bff;
mod chart;
mod clip;
mod crease;
mod distortion;
mod file;
mod flatten;
mod laplacian;
mod lscm;
mod obj;
mod patch;
#[cfg(test)]
mod patch_tests;
mod ply;
mod polygon;
mod repair;
mod seam;
pub mod shapes;
mod stl;
mod topology;
mod triangle;
mod trimesh;

pub use chart::Chart;
pub use distortion::{Distortion, Stretch};
pub use file::{MeshFileError, read, write};
pub use flatten::{FlatError, Flattening};
pub use patch::{Extent, Patch, PatchError};
pub use repair::Repairs;
pub use trimesh::{MeshError, SurfacePoint, TriMesh};
