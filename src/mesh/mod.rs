//! Triangle meshes: smooth normals, closest-point and ray queries, file formats and generated shapes.

mod crease;
mod file;
mod hausdorff;
mod obj;
mod planks;
mod ply;
mod polygon;
mod relief;
pub mod shapes;
mod stl;
mod triangle;
mod trimesh;

pub use file::{MeshFileError, read, write};
pub use hausdorff::hausdorff;
pub use planks::{Boards, clad};
pub use relief::{Dent, RandomField, ReliefError, dented, rough};
pub use trimesh::{MeshError, SurfacePoint, TriMesh};
