//! From a cleaned cloud to a mesh: one manifold patch with a boundary, smooth to the noise.
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::ReconstructError;
use super::cloud::{Cloud, spacing};
use super::fit::PointSurface;
use super::kdtree::KdTree;
use super::nets::{Net, surface_net};
use super::normals::normals;
use super::patch;
use crate::math::stats::quantile;
use crate::mesh::{MeshError, PointCloud, TriMesh};
use crate::surface::SheetFrame;

/// Rounds of evening out the triangles on the surface.
const ROUNDS: usize = 5;
/// Share of the way to its neighbours' middle that a vertex goes in a round.
const PULL: f64 = 0.6;
/// Neighbourhoods are this many triangles wide, at least, where there is no noise.
const RADIUS_TRIANGLES: f64 = 2.0;
/// ... and this many distances between points.
const RADIUS_SPACINGS: f64 = 4.0;
/// Neighbourhoods grow by this much for each unit of noise, and to no more than [`RADIUS_MOST`] times their least size: what they
/// average over, they also flatten.
const RADIUS_NOISE: f64 = 25.0;
/// See [`RADIUS_NOISE`].
const RADIUS_MOST: f64 = 4.0;

/// What is desired of the mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshOptions {
    /// Edge of the triangles, m.
    pub triangle: f64,
    /// Radius of the fitted neighbourhoods, m; chosen by spacing and noise of the points when absent.
    pub radius: Option<f64>,
    /// Holes up to this extent are closed, m.
    pub hole: f64,
}

/// A mesh and what was found out about the points on the way.
#[derive(Clone, Debug)]
pub(super) struct Built {
    pub mesh: TriMesh,
    /// The points that the mesh was fitted to, with their normals.
    pub cloud: PointCloud,
    /// Spread of the points about the surface, m.
    pub noise: f64,
    /// Radius of the neighbourhoods, m.
    pub radius: f64,
    /// Loops of the boundary: 1 for a disc.
    pub loops: usize,
}

/// Builds the mesh of what lies behind the sheet's centre.
pub(super) fn reconstruct(cloud: &Cloud, sheet: &SheetFrame, options: MeshOptions) -> Result<Built, ReconstructError> {
    check_extent(cloud, options.triangle)?;
    let tree = KdTree::new(&cloud.points);
    let gap = spacing(&cloud.points, &tree);
    let least = (RADIUS_TRIANGLES * options.triangle).max(RADIUS_SPACINGS * gap);
    // a neighbourhood smaller than the noise sees only a part of it, so the two are found in turns
    let mut radius = options.radius.unwrap_or(least);
    let mut noise = 0.0;
    let mut thin = Fine::new(cloud, radius);
    for _ in 0..4 {
        noise = spread(&thin.surface(radius));
        let wider = (least + RADIUS_NOISE * noise).min(RADIUS_MOST * least);
        if options.radius.is_some() || wider <= radius * 1.05 {
            break;
        }
        radius = wider;
        thin = Fine::new(cloud, radius);
    }
    let Fine { cloud, normals, tree } = &thin;
    let surface = thin.surface(radius);

    // a cell is a little smaller than its triangles' mean edge: a quad's diagonal is longer
    let cell = (options.triangle / 1.1).max(gap);
    // the net only gives the topology
    let coarse = thin.coarser((0.7 * cell).max(radius / 8.0));
    let layers = ((0.5 * options.hole / cell).ceil() as i64).clamp(1, 6);
    let reach = cell * (layers as f64 + 2.0) * 3f64.sqrt();
    let mut net =
        surface_net(&cloud.points, cell, layers, |x| coarse.surface(radius.max(2.5 * cell)).signed_distance(x, reach))?;
    // a triangle is borne out when points are no farther from its corners than from one to the next, or than they scatter
    let near = (0.75 * cell).max(1.5 * gap).max(1.5 * noise);
    let borne_out: Vec<bool> = net.vertices.par_iter().map(|v| tree.nearest(v, near).is_some()).collect();
    patch::trim(&mut net, &borne_out, options.hole);
    let sheet_from_world = sheet.world_from_sheet.inverse();
    let off_centre = |v: &Point3<f64>| {
        let p = sheet_from_world * v;
        // of pieces behind the centre, the foremost
        (p.x.hypot(p.y) - 2.0 * cell).max(0.0) * 1e3 - p.z
    };
    patch::one_piece(&mut net, off_centre);
    patch::without_teeth(&mut net);
    patch::one_piece(&mut net, off_centre);
    even_out(&mut net, &surface);
    let loops = patch::boundary_loops(&net);
    let mesh = TriMesh::new(net.vertices, net.triangles).map_err(|e| match e {
        MeshError::NotFinite { index } => ReconstructError::NotFinite { index },
        _ => ReconstructError::NoSurface,
    })?;
    let cloud = PointCloud { points: cloud.points.clone(), normals: normals.clone(), colors: vec![] };
    Ok(Built { mesh, cloud, noise, radius, loops })
}

/// A cloud with normals, thinned out as far as its neighbourhoods allow.
struct Fine {
    cloud: Cloud,
    normals: Vec<Vector3<f64>>,
    tree: KdTree,
}

impl Fine {
    /// A seventh of the radius is fine enough where all of a neighbourhood is averaged; weights keep count of the measurements.
    fn new(all: &Cloud, radius: f64) -> Self {
        let thin = all.downsampled(radius / 7.0);
        let cloud = if thin.len() < all.len() { thin } else { all.clone() };
        let tree = KdTree::new(&cloud.points);
        Self { normals: normals(&cloud, &tree, radius), cloud, tree }
    }

    /// Still fewer points, with the mean normals of these.
    fn coarser(&self, voxel: f64) -> Self {
        // normals travel in place of the directions to the eye
        let cloud = Cloud { toward_eye: self.normals.clone(), ..self.cloud.clone() }.downsampled(voxel);
        let tree = KdTree::new(&cloud.points);
        Self { normals: cloud.toward_eye.clone(), cloud, tree }
    }

    fn surface(&self, radius: f64) -> PointSurface<'_> {
        PointSurface { cloud: &self.cloud, tree: &self.tree, normals: &self.normals, radius }
    }
}

/// Refuses clouds without extent in two directions.
fn check_extent(cloud: &Cloud, triangle: f64) -> Result<(), ReconstructError> {
    let n = cloud.len().max(1) as f64;
    let mean = cloud.points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / n;
    let spread: nalgebra::Matrix3<f64> =
        cloud.points.iter().map(|p| (p.coords - mean) * (p.coords - mean).transpose()).sum::<nalgebra::Matrix3<f64>>()
            / n;
    let mut extents: Vec<f64> = spread.symmetric_eigenvalues().iter().map(|e| e.max(0.0).sqrt()).collect();
    extents.sort_by(f64::total_cmp);
    // an even line of length l has a deviation of l / sqrt(12)
    let [across, along] = [extents[1], extents[2]].map(|d| d * 12f64.sqrt());
    if across < 3.0 * triangle {
        let [extent_mm, across_mm, triangle_mm] = [along, across, triangle].map(|x| x * 1e3);
        return Err(ReconstructError::NoExtent { extent_mm, across_mm, triangle_mm });
    }
    Ok(())
}

/// Median spread of the points about patches fitted to them, m, at some hundred places.
fn spread(surface: &PointSurface) -> f64 {
    let n = surface.cloud.len();
    let places: Vec<usize> = (0..n).step_by(n.div_ceil(300).max(1)).collect();
    let spreads: Vec<f64> = places
        .par_iter()
        .filter_map(|&i| surface.foot(&surface.cloud.points[i], &surface.normals[i]).map(|f| f.spread))
        .collect();
    quantile(&spreads, 0.5).unwrap_or(0.0)
}

/// Moves vertices along the surface until triangles are even, and onto the surface. Vertices of the boundary keep to it.
fn even_out(net: &mut Net, surface: &PointSurface) {
    let edges = patch::Edges::new(&net.triangles);
    let on_boundary = edges.boundary(net.vertices.len());
    let mut along = vec![Vec::new(); net.vertices.len()];
    for g in edges.groups().filter(|g| g.len() == 1) {
        along[g[0][0] as usize].push(g[0][1]);
        along[g[0][1] as usize].push(g[0][0]);
    }
    let near = patch::neighbours(net);
    for round in 0..ROUNDS {
        let normals = patch::vertex_normals(net);
        let vertices = &net.vertices;
        let moved: Vec<Point3<f64>> = (0..vertices.len())
            .into_par_iter()
            .map(|v| {
                let (p, n) = (vertices[v], normals[v]);
                let friends = if on_boundary[v] { &along[v] } else { &near[v] };
                let mean =
                    friends.iter().map(|&w| vertices[w as usize].coords).sum::<Vector3<f64>>() / friends.len() as f64;
                let step = (mean - p.coords) * PULL;
                let q = p + (step - n * n.dot(&step));
                // sliding along the mesh hardly leaves the surface, so the fit can wait for the last rounds
                if round + 2 < ROUNDS {
                    return q;
                }
                let Some(foot) = surface.foot(&q, &n) else { return p + step };
                // along the fitted normal it comes out nearer than along the mesh's
                surface.foot(&foot.position, &foot.normal).unwrap_or(foot).position
            })
            .collect();
        net.vertices = moved;
    }
}
