//! Triangle meshes and point clouds: smooth normals, closest-point and ray queries, file formats, generated shapes, and flat
//! maps of pieces of meshes.

mod bff;
mod chart;
mod clip;
mod cloud;
mod crease;
mod distortion;
mod extrusion;
mod file;
mod flat_error;
mod flatten;
mod grown;
mod hausdorff;
mod laplacian;
mod lscm;
mod obj;
mod patch;
#[cfg(test)]
mod patch_tests;
mod planks;
mod ply;
mod polygon;
mod profile;
mod relief;
mod repair;
mod seam;
pub mod shapes;
mod stl;
mod topology;
mod triangle;
mod trimesh;

pub use chart::Chart;
pub use cloud::{PointCloud, read_cloud};
pub use distortion::{Distortion, Stretch};
pub use extrusion::{Opening, extrusion};
pub use file::{MeshFileError, ply_bytes, read, write};
pub use flat_error::FlatError;
pub use flatten::Flattening;
pub use hausdorff::hausdorff;
pub use patch::{Extent, Patch, PatchError};
pub use planks::{Boards, clad};
pub use profile::{ProfileCurve, ProfileError, ProfileShape};
pub use relief::{Dent, RandomField, ReliefError, dented, rough};
pub use repair::Repairs;
pub use trimesh::{MeshError, SurfacePoint, TriMesh};
