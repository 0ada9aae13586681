//! How a canvas is made of points, and what was found out of them.
use super::ReconstructError;
use crate::mesh::PointCloud;

/// How a cloud is cleaned and made a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshingOptions {
    /// What is kept round the sheet on each side, m.
    pub margin: f64,
    /// Points in a cube of this edge (m) become one; 0 keeps all.
    pub voxel: f64,
    /// Points whose neighbours are farther than usual by more standard deviations than this are dropped; 0 keeps all.
    pub outlier_deviations: f64,
    /// Mean edge of the triangles, m.
    pub triangle: f64,
    /// Radius of the neighbourhoods that the surface is fitted to, m; chosen by spacing and noise when absent.
    pub radius: Option<f64>,
    /// Holes up to this extent are closed, m.
    pub hole: f64,
}

impl Default for MeshingOptions {
    fn default() -> Self {
        Self { margin: 0.06, voxel: 0.002, outlier_deviations: 3.0, triangle: 0.0045, radius: None, hole: 0.03 }
    }
}

/// What a scan found out.
#[derive(Clone, Debug)]
pub struct ScanReport {
    /// Points that were measured.
    pub measured: usize,
    /// The cloud that the mesh was made of, world, with its normals.
    pub cloud: PointCloud,
    /// Spread of those points about the surface, m.
    pub noise: f64,
    /// Radius of the neighbourhoods that the surface was fitted to, m.
    pub radius: f64,
    /// Loops of the mesh's boundary: 1 for a disc, more when holes are left.
    pub boundary_loops: usize,
    /// Largest movement of a camera by registration, m.
    pub registered_by: f64,
}

/// An option in its range, or the error that names it.
fn check(name: &'static str, value: f64, holds: bool, right: &'static str) -> Result<(), ReconstructError> {
    if value.is_finite() && holds { Ok(()) } else { Err(ReconstructError::BadOption { name, value, right }) }
}

impl MeshingOptions {
    /// Every number in its range.
    ///
    /// # Errors
    /// The first that isn't.
    pub fn check(&self) -> Result<(), ReconstructError> {
        check("margin", self.margin, (0.0..=10.0).contains(&self.margin), "from 0 to 10 m")?;
        check("voxel", self.voxel, (0.0..=1.0).contains(&self.voxel), "from 0 to 1 m")?;
        check("outlier_deviations", self.outlier_deviations, self.outlier_deviations >= 0.0, "0 or more")?;
        check("triangle", self.triangle, (1e-5..=1.0).contains(&self.triangle), "from 1e-5 to 1 m")?;
        check("hole", self.hole, (0.0..=1.0).contains(&self.hole), "from 0 to 1 m")?;
        let radius = self.radius.unwrap_or(1.0);
        check("radius", radius, radius > 0.0 && radius <= 1.0, "above 0 and at most 1 m")
    }
}
