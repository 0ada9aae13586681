//! The pixels under a brush that follows a line.
use nalgebra::Point2;

/// The shares of pixels under a brush. Made once and used for many strokes.
pub(super) struct Mask {
    width: usize,
    height: usize,
    /// Share of each pixel; 0 outside of the stroke.
    coverage: Vec<f32>,
    touched: Vec<u32>,
}

impl Mask {
    pub fn new(width: usize, height: usize) -> Self {
        let n = width * height;
        Self { width, height, coverage: vec![0.0; n], touched: Vec::new() }
    }

    /// Covers what a round brush of this radius touches on its way along a polyline, all in px with pixel centres at halves.
    /// The share falls evenly from 1 to 0 from `soft` within the radius to `soft` without, at least half a pixel each; a line
    /// thinner than a pixel covers its share.
    pub fn sweep(&mut self, path: &[Point2<f64>], radius: f64, soft: f64) {
        for at in self.touched.drain(..) {
            self.coverage[at as usize] = 0.0;
        }
        if let [dot] = path {
            self.capsule(*dot, *dot, radius, soft);
        }
        for w in path.windows(2) {
            self.capsule(w[0], w[1], radius, soft);
        }
    }

    /// The covered pixels with their shares, in the order in which they were first touched.
    pub fn pixels(&self) -> impl Iterator<Item = (usize, f32)> {
        self.touched.iter().map(|at| (*at as usize, self.coverage[*at as usize]))
    }

    fn capsule(&mut self, a: Point2<f64>, b: Point2<f64>, radius: f64, soft: f64) {
        let soft = soft.max(0.5);
        let reach = radius + soft;
        let rows = |v: f64, n: usize| (v.max(0.0) as usize).min(n);
        let (y0, y1) = (rows(a.y.min(b.y) - reach, self.height), rows(a.y.max(b.y) + reach + 1.0, self.height));
        let (ax, ay, dx, dy) = (a.x as f32, a.y as f32, (b.x - a.x) as f32, (b.y - a.y) as f32);
        let inverse = 1.0 / (dx * dx + dy * dy).max(1e-12);
        let (reach, most) = (reach as f32, (2.0 * radius).min(1.0) as f32);
        let slope = 0.5 / soft as f32;
        for y in y0..y1 {
            let py = y as f32 + 0.5 - ay;
            // The part of the segment whose disc can reach this row bounds the columns.
            let (t0, t1) = if dy.abs() < 1e-6 {
                (0.0, 1.0)
            } else {
                let (u, v) = ((py - reach) / dy, (py + reach) / dy);
                (u.min(v).clamp(0.0, 1.0), u.max(v).clamp(0.0, 1.0))
            };
            let (u, v) = (ax + t0 * dx, ax + t1 * dx);
            let x0 = rows(f64::from(u.min(v) - reach), self.width);
            let x1 = rows(f64::from(u.max(v) + reach + 1.0), self.width);
            for x in x0..x1 {
                let px = x as f32 + 0.5 - ax;
                let t = ((px * dx + py * dy) * inverse).clamp(0.0, 1.0);
                let (ex, ey) = (px - t * dx, py - t * dy);
                let square = ex * ex + ey * ey;
                if square >= reach * reach {
                    continue;
                }
                let share = (slope * (reach - square.sqrt())).min(most);
                let at = y * self.width + x;
                let old = self.coverage[at];
                if share > old {
                    if old == 0.0 {
                        self.touched.push(at as u32);
                    }
                    self.coverage[at] = share;
                }
            }
        }
    }
}
