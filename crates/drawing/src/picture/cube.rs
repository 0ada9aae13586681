//! A costly function of colour, computed on a lattice and interpolated for each pixel.
use rayon::prelude::*;

use crate::picture::{Picture, Plane};

/// Values on a lattice over the colours, `outputs` of them at each node.
///
/// The lattice is even in the square root of linear light: about even to the eye, and cheap to find one's place in.
pub(super) struct Cube {
    side: usize,
    outputs: usize,
    nodes: Vec<f32>,
}

impl Cube {
    /// Computes `f(color, values)` at `side^3` colours in linear light, `side` at least 2.
    pub(super) fn new(side: usize, outputs: usize, f: impl Fn([f32; 3], &mut [f32]) + Send + Sync) -> Self {
        let mut nodes = vec![0.0; side * side * side * outputs];
        let light = |i: usize| (i as f32 / (side - 1) as f32).powi(2);
        nodes.par_chunks_mut(outputs.max(1)).enumerate().for_each(|(at, values)| {
            f([light(at / (side * side)), light(at / side % side), light(at % side)], values);
        });
        Self { side, outputs, nodes }
    }

    /// The values at a colour, interpolated in one of six tetrahedra (which keeps the line of greys exact).
    fn at(&self, color: [f32; 3], values: &mut [f32]) {
        let last = (self.side - 1) as f32;
        let place = color.map(|v| v.clamp(0.0, 1.0).sqrt() * last);
        let cell = place.map(|p| (p as usize).min(self.side - 2));
        let rest = [0, 1, 2].map(|k| (place[k] - cell[k] as f32, k));
        let strides = [self.side * self.side, self.side, 1];
        // From the cell's darkest corner towards the channels in the order of how far the colour lies along them.
        let [a, b, c] = sorted(rest);
        let mut node = cell[0] * strides[0] + cell[1] * strides[1] + cell[2];
        let steps = [(1.0 - a.0, 0), (a.0 - b.0, strides[a.1]), (b.0 - c.0, strides[b.1]), (c.0, strides[c.1])];
        values.fill(0.0);
        for (weight, step) in steps {
            node += step;
            let corner = &self.nodes[node * self.outputs..][..self.outputs];
            values.iter_mut().zip(corner).for_each(|(v, n)| *v += weight * n);
        }
    }

    /// One plane for each output, of all pixels of a picture.
    pub(super) fn planes(&self, picture: &Picture) -> Vec<Plane> {
        let (w, h) = (picture.width(), picture.height());
        let mut all = vec![0.0; w * h * self.outputs];
        all.par_chunks_mut(self.outputs.max(1))
            .zip(&picture.pixels)
            .with_min_len(4096)
            .for_each(|(values, color)| self.at(*color, values));
        (0..self.outputs)
            .map(|k| {
                let values = all.iter().skip(k).step_by(self.outputs).copied().collect();
                Plane::from_values(w, h, values).unwrap_or_default()
            })
            .collect()
    }
}

/// Largest first.
fn sorted([mut a, mut b, mut c]: [(f32, usize); 3]) -> [(f32, usize); 3] {
    if a.0 < b.0 {
        std::mem::swap(&mut a, &mut b);
    }
    if b.0 < c.0 {
        std::mem::swap(&mut b, &mut c);
    }
    if a.0 < b.0 {
        std::mem::swap(&mut a, &mut b);
    }
    [a, b, c]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_even_in_the_roots_is_met_exactly(r in 0.0f32..=1.0, g in 0.0f32..=1.0, b in 0.0f32..=1.0) {
            let f = |c: [f32; 3]| [c[0].sqrt() - 2.0 * c[1].sqrt() + 0.5, c[2].sqrt()];
            let cube = Cube::new(5, 2, |c, v| v.copy_from_slice(&f(c)));
            let planes = cube.planes(&Picture::from_pixels(1, 1, vec![[r, g, b]]).unwrap());
            let want = f([r, g, b]);
            prop_assert!((planes[0].values[0] - want[0]).abs() < 1e-5 && (planes[1].values[0] - want[1]).abs() < 1e-5);
        }
    }
}
