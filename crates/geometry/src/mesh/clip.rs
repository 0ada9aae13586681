//! Cutting a mesh along a level of a function on its vertices.
use std::collections::HashMap;

use nalgebra::Point3;

/// Vertices nearer to the level than this share of an edge's drop are on it: no sliver is cut off between them.
const ON_LEVEL: f64 = 1e-6;

/// The part of the mesh where `field` (one value a vertex, linear on triangles) is not negative. Triangles are cut exactly
/// along its zero; both sides of a shared edge get the same new vertex, and copies of an edge at the same place get
/// new vertices at the same place. Old vertices keep their order and numbers, even where nothing uses them any more.
pub(super) fn clip(
    vertices: &mut Vec<Point3<f64>>,
    triangles: &[[u32; 3]],
    mut field: impl FnMut(usize, &Point3<f64>) -> f64,
) -> Vec<[u32; 3]> {
    let values: Vec<f64> = vertices.iter().enumerate().map(|(i, p)| field(i, p)).collect();
    let mut cuts: HashMap<(u32, u32), u32> = HashMap::new();
    let mut kept = Vec::with_capacity(triangles.len());
    for t in triangles {
        let value = t.map(|i| values[i as usize]);
        let range = value.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let inside = value.map(|v| v >= -ON_LEVEL * range);
        match inside.iter().filter(|i| **i).count() {
            3 => kept.push(*t),
            0 => {}
            _ => {
                let mut polygon = [0; 4];
                let mut corners = 0;
                for k in 0..3 {
                    let j = (k + 1) % 3;
                    if inside[k] {
                        polygon[corners] = t[k];
                        corners += 1;
                    }
                    let (u, v) = (value[k], value[j]);
                    if inside[k] != inside[j] && u.abs().min(v.abs()) > ON_LEVEL * range {
                        let key = (t[k].min(t[j]), t[k].max(t[j]));
                        polygon[corners] = *cuts.entry(key).or_insert_with(|| {
                            vertices.push(crossing(vertices[t[k] as usize], u, vertices[t[j] as usize], v));
                            vertices.len() as u32 - 1
                        });
                        corners += 1;
                    }
                }
                push(&polygon[..corners], vertices, &mut kept);
            }
        }
    }
    kept
}

/// Where the line from `a` to `b` crosses zero; the same bits whichever end comes first.
fn crossing(a: Point3<f64>, u: f64, b: Point3<f64>, v: f64) -> Point3<f64> {
    let key = |p: &Point3<f64>| [p.x, p.y, p.z];
    let (a, u, b, v) = if key(&a) <= key(&b) { (a, u, b, v) } else { (b, v, a, u) };
    a + (b - a) * (u / (u - v))
}

/// Appends a triangle, or a quadrilateral cut along its shorter diagonal.
fn push(polygon: &[u32], vertices: &[Point3<f64>], out: &mut Vec<[u32; 3]>) {
    match *polygon {
        [a, b, c] => out.push([a, b, c]),
        [a, b, c, d] => {
            let length = |i: u32, j: u32| (vertices[j as usize] - vertices[i as usize]).norm_squared();
            if length(a, c) <= length(b, d) {
                out.extend([[a, b, c], [a, c, d]]);
            } else {
                out.extend([[a, b, d], [b, c, d]]);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::repair::weld;
    use crate::mesh::topology::Gluing;
    use crate::mesh::{TriMesh, shapes};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_two_sides_of_a_cut_make_the_whole(angle in 0.0..6.3f64, offset in -0.4..0.4f64) {
            let sheet = shapes::rectangle(1.0, 1.0, 0.0, 0.07).unwrap();
            let field = |p: &Point3<f64>| p.x * angle.cos() + p.y * angle.sin() - offset;
            let mut area = 0.0;
            for sign in [1.0, -1.0] {
                let mut vertices = sheet.vertices().to_vec();
                let triangles = clip(&mut vertices, sheet.triangles(), |_, p| sign * field(p));
                let part = TriMesh::new(vertices, triangles).unwrap();
                prop_assert!(part.vertices().iter().all(|p| sign * field(p) > -1e-6));
                area += part.area();
                let (v, t) = weld(part.vertices(), part.triangles());
                let gluing = Gluing::new(&v, &t);
                prop_assert_eq!(gluing.euler(gluing.fans(&t).1), 1);
                prop_assert_eq!(gluing.loops().len(), 1);
            }
            prop_assert!((area - 1.0).abs() < 1e-5, "{}", area);
        }
    }
}
