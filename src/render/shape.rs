//! Surfaces to be seen: triangles with a shading normal at each corner.
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Point3, Vector3};

use crate::mesh::TriMesh;

/// Angle between two facets above which the edge between them is drawn sharp, rad.
pub const DEFAULT_CREASE: f64 = 0.6;

/// Triangles with unit normals, one a vertex, in the item's frame, m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Vertices.
    pub positions: Vec<Point3<f64>>,
    /// Unit shading normals, as many as vertices.
    pub normals: Vec<Vector3<f64>>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Normals smoothed over edges that bend less than `crease` (rad) and kept sharp over others.
    ///
    /// Vertices at the same place count as one whatever their index, since STL files repeat them. A corner's normal is
    /// the mean of the facets round its vertex within the crease angle of its own facet, weighted by their angle there.
    /// Triangles without area, and those that name vertices that aren't there, are left out.
    pub fn smoothed(vertices: &[Point3<f64>], triangles: &[[u32; 3]], crease: f64) -> Self {
        let mut place_of = HashMap::new();
        let place: Vec<usize> = vertices
            .iter()
            .map(|v| {
                let next = place_of.len();
                // adding zero makes -0 and 0 the same place
                *place_of.entry([v.x, v.y, v.z].map(|c| (c + 0.0).to_bits())).or_insert(next)
            })
            .collect();
        let facets: Vec<([u32; 3], Vector3<f64>)> = triangles
            .iter()
            .filter_map(|t| {
                let [a, b, c] = t.map(|i| vertices.get(i as usize));
                let n = (b? - a?).cross(&(c? - a?));
                n.try_normalize(1e-30).map(|n| (*t, n))
            })
            .collect();
        let mut round: Vec<Vec<(usize, f64)>> = vec![Vec::new(); place_of.len()];
        for (f, (t, _)) in facets.iter().enumerate() {
            for k in 0..3 {
                let [p, q, r] = [0, 1, 2].map(|j| vertices[t[(k + j) % 3] as usize]);
                round[place[t[k] as usize]].push((f, (q - p).angle(&(r - p))));
            }
        }
        let mut out = Surface::default();
        let mut known = HashMap::new();
        let least = crease.cos();
        for (t, n) in &facets {
            let corner = t.map(|i| {
                let at = place[i as usize];
                let sum: Vector3<f64> = round[at]
                    .iter()
                    .map(|(f, angle)| (facets[*f].1, angle))
                    .filter(|(m, _)| m.dot(n) >= least)
                    .map(|(m, a)| m * *a)
                    .sum();
                let normal = sum.try_normalize(1e-12).unwrap_or(*n);
                let key = (at, [normal.x, normal.y, normal.z].map(|c| (c * 1e4).round() as i32));
                *known.entry(key).or_insert_with(|| {
                    out.positions.push(vertices[i as usize]);
                    out.normals.push(normal);
                    (out.positions.len() - 1) as u32
                })
            });
            out.triangles.push(corner);
        }
        out
    }

    /// A mesh with its own smooth normals.
    pub fn from_mesh(mesh: &TriMesh) -> Self {
        Surface {
            positions: mesh.vertices().to_vec(),
            normals: mesh.vertex_normals().to_vec(),
            triangles: mesh.triangles().to_vec(),
        }
    }

    /// A centred cylinder along z with a small chamfer, which catches light as real edges do.
    pub fn cylinder(radius: f64, length: f64) -> Self {
        let chamfer = (0.06 * radius).min(0.1 * length).min(0.002);
        let h = 0.5 * length;
        let profile = [
            (0.0, -h),
            (radius - chamfer, -h),
            (radius, -h + chamfer),
            (radius, h - chamfer),
            (radius - chamfer, h),
            (0.0, h),
        ];
        Self::turned(&profile, 64)
    }

    /// A centred sphere.
    pub fn sphere(radius: f64) -> Self {
        let profile: Vec<(f64, f64)> = (0..=32)
            .map(|i| {
                let (s, c) = (f64::from(i) / 32.0 * 2.0 * FRAC_PI_2 - FRAC_PI_2).sin_cos();
                (if i % 32 == 0 { 0.0 } else { radius * c }, radius * s)
            })
            .collect();
        Self::turned(&profile, 64)
    }

    /// A profile (radius, height), from below to above, turned about z.
    pub fn turned(profile: &[(f64, f64)], sides: u32) -> Self {
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        for (r, z) in profile {
            for k in 0..sides {
                let (s, c) = (f64::from(k) / f64::from(sides) * TAU).sin_cos();
                vertices.push(Point3::new(r * c, r * s, *z));
            }
        }
        for i in 0..profile.len().saturating_sub(1) as u32 {
            for k in 0..sides {
                let at = |row: u32, k: u32| (i + row) * sides + k % sides;
                triangles.push([at(0, k), at(0, k + 1), at(1, k + 1)]);
                triangles.push([at(0, k), at(1, k + 1), at(1, k)]);
            }
        }
        Self::smoothed(&vertices, &triangles, DEFAULT_CREASE)
    }

    /// A centred box with a small chamfer.
    pub fn cuboid(size: Vector3<f64>) -> Self {
        let half = size * 0.5;
        let chamfer = (0.1 * half.min()).min(0.0015);
        // each corner of the box has three vertices, one for each face; faces, edges and corners are filled between
        let corner = |axis: usize, s: [f64; 3]| {
            let mut p = Vector3::new(s[0] * half.x, s[1] * half.y, s[2] * half.z);
            for k in (0..3).filter(|k| *k != axis) {
                p[k] -= s[k] * chamfer;
            }
            Point3::from(p)
        };
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        let mut add = |points: &[Point3<f64>]| {
            let first = vertices.len() as u32;
            let middle = points.iter().map(|p| p.coords).sum::<Vector3<f64>>();
            let outward = (points[1] - points[0]).cross(&(points[2] - points[0])).dot(&middle) > 0.0;
            vertices.extend_from_slice(points);
            for k in 1..points.len() as u32 - 1 {
                let (b, c) = if outward { (k, k + 1) } else { (k + 1, k) };
                triangles.push([first, first + b, first + c]);
            }
        };
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for s in [-1.0, 1.0] {
                let at = |axis: usize, su: f64, sv: f64, s: f64| {
                    let mut signs = [0.0; 3];
                    (signs[u], signs[v], signs[3 - u - v]) = (su, sv, s);
                    corner(axis, signs)
                };
                add(&[at(axis, -1.0, -1.0, s), at(axis, 1.0, -1.0, s), at(axis, 1.0, 1.0, s), at(axis, -1.0, 1.0, s)]);
                // the edge between the faces u and v that runs along `axis`
                for t in [-1.0, 1.0] {
                    add(&[at(u, s, t, -1.0), at(v, s, t, -1.0), at(v, s, t, 1.0), at(u, s, t, 1.0)]);
                }
            }
        }
        for i in 0..8 {
            let signs = [0, 1, 2].map(|k| if i >> k & 1 == 0 { -1.0 } else { 1.0 });
            add(&[corner(0, signs), corner(1, signs), corner(2, signs)]);
        }
        Self::smoothed(&vertices, &triangles, DEFAULT_CREASE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(s: &Surface) -> f64 {
        let part = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| s.positions[i as usize].coords);
            a.dot(&b.cross(&c)) / 6.0
        };
        s.triangles.iter().map(part).sum()
    }

    #[test]
    fn shapes_are_closed_and_wind_outwards() {
        let cylinder = volume(&Surface::cylinder(0.1, 0.4));
        let sphere = volume(&Surface::sphere(0.2));
        let cuboid = volume(&Surface::cuboid(Vector3::new(0.2, 0.3, 0.5)));
        assert!((cylinder / (0.5 * TAU * 0.01 * 0.4) - 1.0).abs() < 0.01, "{cylinder}");
        assert!((sphere / (2.0 / 3.0 * TAU * 0.008) - 1.0).abs() < 0.02, "{sphere}");
        assert!((cuboid / 0.03 - 1.0).abs() < 0.01, "{cuboid}");
    }

    #[test]
    fn a_sphere_is_smooth_and_a_box_is_sharp() {
        let s = Surface::sphere(1.0);
        for (p, n) in s.positions.iter().zip(&s.normals) {
            assert!(p.coords.normalize().dot(n) > 0.999);
        }
        let corners: Vec<Point3<f64>> =
            (0..8).map(|i| Point3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect();
        let top = Surface::smoothed(&corners, &[[4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4]], DEFAULT_CREASE);
        assert!(top.normals.iter().all(|n| n.max() > 0.999 || n.min() < -0.999), "{:?}", top.normals);
    }

    #[test]
    fn indices_past_the_vertices_are_left_out() {
        let s = Surface::smoothed(&[Point3::origin()], &[[0, 1, 2]], DEFAULT_CREASE);
        assert!(s.triangles.is_empty());
    }
}
