//! Evenly spaced lines along a field of directions, as dense as desired.
//!
//! Lines traced one beside another (Jobard and Lefer 1997) leave gaps and crowds where they converge. Here all lines are
//! found at once, as the crests of a wave whose wave vector stands across the direction and is as long as the desired
//! density: the phases at grid points that agree best with their neighbours (Knöppel et al. 2015,
//! doi:10.1145/2767000), relaxed from coarse grids to fine ones as Jakob et al. 2015 (doi:10.1145/2816795.2818078) do.
//! Where lines converge or the density falls, a line simply ends between its neighbours.
use std::f32::consts::{PI, TAU};

use nalgebra::Point2;
use rand::RngExt;

use crate::math::stream;

/// Sweeps of relaxation on each grid; later ones change little.
const SWEEPS: usize = 12;
/// Grids are halved until the shorter side has fewer points than this.
const COARSEST: usize = 6;

/// What lines are desired on a grid of points: `columns * rows`, row by row.
#[derive(Clone, Debug)]
pub(super) struct Stripes {
    pub columns: usize,
    pub rows: usize,
    /// Distance between grid points; lines come in units of it.
    pub cell: f32,
    /// Unit normals to the lines, of either sense.
    pub normal: Vec<[f32; 2]>,
    /// Lines per length across them.
    pub density: Vec<f32>,
}

/// A step between neighbouring grid points: how the wave advances, seen from the first one's normal.
#[derive(Clone, Copy, Default)]
struct Step {
    cos: f32,
    sin: f32,
    /// 1, or -1 where the second point's normal has the other sense.
    sense: f32,
}

impl Stripes {
    /// The lines, in grid units (the first point at the origin), as polylines of about a point a cell.
    pub fn lines(&self, seed: u64, index: u64) -> Vec<Vec<Point2<f64>>> {
        if self.columns < 2 || self.rows < 2 {
            return Vec::new();
        }
        trace(self, &self.phases(seed, index))
    }

    /// The wave at each point as cosine and sine, seen from its own normal.
    fn phases(&self, seed: u64, index: u64) -> Vec<[f32; 2]> {
        let mut grids = vec![];
        let mut last = self.clone();
        while last.columns.min(last.rows) > COARSEST {
            let next = last.halved();
            grids.push(last);
            last = next;
        }
        let first: f32 = stream(seed, "stripes", index).random_range(-PI..PI);
        let mut wave = vec![[first.cos(), first.sin()]; last.normal.len()];
        last.relax(&mut wave);
        while let Some(grid) = grids.pop() {
            wave = grid.refined(&last, &wave);
            grid.relax(&mut wave);
            last = grid;
        }
        wave
    }

    /// The grid of every second point each way.
    fn halved(&self) -> Self {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let (mut normal, mut density) = (Vec::with_capacity(columns * rows), Vec::with_capacity(columns * rows));
        for row in 0..rows {
            for column in 0..columns {
                let own = self.normal[2 * row * self.columns + 2 * column];
                let (mut n, mut d, mut weight) = ([0.0f32; 2], 0.0, 0.0);
                for (dy, wy) in [(0usize, 1.0f32), (1, 2.0), (2, 1.0)] {
                    for (dx, wx) in [(0usize, 1.0f32), (1, 2.0), (2, 1.0)] {
                        let (x, y) = ((2 * column + dx).wrapping_sub(1), (2 * row + dy).wrapping_sub(1));
                        if x >= self.columns || y >= self.rows {
                            continue;
                        }
                        let at = y * self.columns + x;
                        let m = self.normal[at];
                        let w = wx * wy;
                        let sense = if m[0] * own[0] + m[1] * own[1] < 0.0 { -w } else { w };
                        n = [n[0] + sense * m[0], n[1] + sense * m[1]];
                        d += w * self.density[at];
                        weight += w;
                    }
                }
                let length = n[0].hypot(n[1]);
                normal.push(if length > 1e-6 { [n[0] / length, n[1] / length] } else { own });
                density.push(d / weight);
            }
        }
        Self { columns, rows, cell: 2.0 * self.cell, normal, density }
    }

    /// The advance of the wave (rad) from point `a` to `b`, `(dx, dy)` apart, seen from `a`, and the sense of `b`.
    fn advance(&self, a: usize, b: usize, dx: f32, dy: f32) -> (f32, f32) {
        self.advance_to(a, self, b, dx, dy)
    }

    fn advance_to(&self, a: usize, other: &Self, b: usize, dx: f32, dy: f32) -> (f32, f32) {
        let (n, m) = (self.normal[a], other.normal[b]);
        let sense = if n[0] * m[0] + n[1] * m[1] < 0.0 { -1.0 } else { 1.0 };
        let (k, l) = (PI * self.density[a], sense * PI * other.density[b]);
        ((k * n[0] + l * m[0]) * dx + (k * n[1] + l * m[1]) * dy, sense)
    }

    fn steps(&self, dx: usize, dy: usize) -> Vec<Step> {
        let mut steps = vec![Step::default(); self.normal.len()];
        for row in 0..self.rows - dy {
            for column in 0..self.columns - dx {
                let a = row * self.columns + column;
                let (advance, sense) =
                    self.advance(a, a + dy * self.columns + dx, dx as f32 * self.cell, dy as f32 * self.cell);
                let (sin, cos) = advance.sin_cos();
                steps[a] = Step { cos, sin, sense };
            }
        }
        steps
    }

    /// Lets each point agree with its four neighbours, back and forth over the grid.
    fn relax(&self, wave: &mut [[f32; 2]]) {
        let (w, h) = (self.columns, self.rows);
        let (right, down) = (self.steps(1, 0), self.steps(0, 1));
        for sweep in 0..SWEEPS {
            for k in 0..w * h {
                let i = if sweep.is_multiple_of(2) { k } else { w * h - 1 - k };
                let (row, column) = (i / w, i % w);
                let mut sum = [0.0f32; 2];
                let mut ahead = |s: Step, v: [f32; 2]| {
                    // Back along the step: the neighbour's phase in our sense, less the advance.
                    let v = [v[0], s.sense * v[1]];
                    sum = [sum[0] + v[0] * s.cos + v[1] * s.sin, sum[1] + v[1] * s.cos - v[0] * s.sin];
                };
                if column + 1 < w {
                    ahead(right[i], wave[i + 1]);
                }
                if row + 1 < h {
                    ahead(down[i], wave[i + w]);
                }
                let mut behind = |s: Step, v: [f32; 2]| {
                    let t = [v[0] * s.cos - v[1] * s.sin, v[1] * s.cos + v[0] * s.sin];
                    sum = [sum[0] + t[0], sum[1] + s.sense * t[1]];
                };
                if column > 0 {
                    behind(right[i - 1], wave[i - 1]);
                }
                if row > 0 {
                    behind(down[i - w], wave[i - w]);
                }
                let length = (sum[0] * sum[0] + sum[1] * sum[1]).sqrt();
                if length > 1e-6 {
                    wave[i] = [sum[0] / length, sum[1] / length];
                }
            }
        }
    }

    /// The wave of the coarser grid carried to this one.
    fn refined(&self, coarse: &Self, wave: &[[f32; 2]]) -> Vec<[f32; 2]> {
        let mut out = Vec::with_capacity(self.normal.len());
        for row in 0..self.rows {
            for column in 0..self.columns {
                let a = row * self.columns + column;
                let mut sum = [0.0f32; 2];
                for y in row / 2..=row.div_ceil(2).min(coarse.rows - 1) {
                    for x in column / 2..=column.div_ceil(2).min(coarse.columns - 1) {
                        let b = y * coarse.columns + x;
                        let dx = (2 * x) as f32 - column as f32;
                        let dy = (2 * y) as f32 - row as f32;
                        let (advance, sense) = self.advance_to(a, coarse, b, dx * self.cell, dy * self.cell);
                        let (sin, cos) = advance.sin_cos();
                        let v = [wave[b][0], sense * wave[b][1]];
                        sum = [sum[0] + v[0] * cos + v[1] * sin, sum[1] + v[1] * cos - v[0] * sin];
                    }
                }
                let length = (sum[0] * sum[0] + sum[1] * sum[1]).sqrt();
                out.push(if length > 1e-6 { [sum[0] / length, sum[1] / length] } else { [1.0, 0.0] });
            }
        }
        out
    }
}

/// An angle brought to `-pi..=pi`.
fn wrapped(angle: f32) -> f32 {
    angle - TAU * (angle / TAU).round()
}

/// No crossing, or no neighbour.
const NONE: u32 = u32::MAX;

/// The crests of the wave. A crest crosses a grid edge at most once; crossings are linked through the cells, except
/// through those where the wave is torn, and there lines end.
fn trace(stripes: &Stripes, wave: &[[f32; 2]]) -> Vec<Vec<Point2<f64>>> {
    let (w, h) = (stripes.columns, stripes.rows);
    let phase: Vec<f32> = wave.iter().map(|v| v[1].atan2(v[0])).collect();
    // The unwrapped phase from a to b, seen from a.
    let gain = |a: usize, b: usize, dx: f32, dy: f32| {
        let (advance, sense) = stripes.advance(a, b, dx * stripes.cell, dy * stripes.cell);
        (advance + wrapped(sense * phase[b] - phase[a] - advance), sense)
    };
    // Edge 2 i runs from point i to the right, 2 i + 1 down.
    let mut gains = vec![(0.0f32, 1.0f32); 2 * w * h];
    let mut place = vec![f32::NAN; 2 * w * h];
    for i in 0..w * h {
        for (down, step) in [(0, 1), (1, w)] {
            if (down == 0 && i % w + 1 == w) || (down == 1 && i + w >= w * h) {
                continue;
            }
            let (g, sense) = gain(i, i + step, (1 - down) as f32, down as f32);
            gains[2 * i + down] = (g, sense);
            let (from, to) = (phase[i].min(phase[i] + g), phase[i].max(phase[i] + g));
            let crest = TAU * (from / TAU).ceil();
            // Half open, so that a crest through a point belongs to one edge on either side.
            if crest < to {
                place[2 * i + down] = ((crest - phase[i]) / g).clamp(0.0, 1.0);
            }
        }
    }
    let mut links = vec![[NONE; 2]; 2 * w * h];
    for row in 0..h - 1 {
        for column in 0..w - 1 {
            let i = row * w + column;
            // Round the cell: top, right, bottom, left, unwrapped from the first point on.
            let (top, top_sense) = gains[2 * i];
            let (left, left_sense) = gains[2 * i + 1];
            let (right, right_sense) = gains[2 * (i + 1) + 1];
            let (bottom, bottom_sense) = gains[2 * (i + w)];
            let at = [
                phase[i],
                phase[i] + top,
                phase[i] + top + top_sense * right,
                phase[i] + left + left_sense * bottom,
                phase[i] + left,
            ];
            // Both ways round to the far corner agree, or the wave is torn here.
            let torn = (at[2] - at[3]).abs() > 0.5 || top_sense * right_sense != left_sense * bottom_sense;
            if torn {
                continue;
            }
            let edges = [
                (2 * i, at[0], at[1]),
                (2 * (i + 1) + 1, at[1], at[2]),
                (2 * (i + w), at[4], at[2]),
                (2 * i + 1, at[0], at[4]),
            ];
            // The crest that crosses each edge, by its number.
            let crest = |(edge, a, b): (usize, f32, f32)| {
                let share = place[edge];
                (!share.is_nan()).then(|| (((a + share * (b - a)) / TAU).round() as i32, edge as u32))
            };
            let crests = edges.map(crest);
            for k in 0..4 {
                let Some((number, edge)) = crests[k] else { continue };
                if let Some((_, other)) = crests[k + 1..].iter().flatten().find(|c| c.0 == number)
                    && crests[..k].iter().flatten().all(|c| c.0 != number)
                {
                    for (a, b) in [(edge, *other), (*other, edge)] {
                        let slot = &mut links[a as usize];
                        *if slot[0] == NONE { &mut slot[0] } else { &mut slot[1] } = b;
                    }
                }
            }
        }
    }
    let point = |edge: u32| {
        let (i, share) = (edge as usize / 2, f64::from(place[edge as usize]));
        let (x, y) = ((i % w) as f64, (i / w) as f64);
        let p = if edge.is_multiple_of(2) { Point2::new(x + share, y) } else { Point2::new(x, y + share) };
        p * f64::from(stripes.cell)
    };
    let mut seen = vec![false; links.len()];
    let mut lines = Vec::new();
    // Lines from their ends first; what is left are rings.
    for ends in [true, false] {
        for start in 0..links.len() {
            if seen[start] || links[start][0] == NONE || (ends && links[start][1] != NONE) {
                continue;
            }
            let mut line = Vec::new();
            let (mut before, mut here) = (NONE, start as u32);
            while here != NONE && !seen[here as usize] {
                seen[here as usize] = true;
                line.push(point(here));
                let next = links[here as usize];
                let onwards = if next[0] == before { next[1] } else { next[0] };
                (before, here) = (here, onwards);
            }
            if here == start as u32 && line.len() > 2 {
                line.push(line[0]);
            }
            lines.push(line);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stripes(columns: usize, rows: usize, field: impl Fn(f32, f32) -> ([f32; 2], f32)) -> Stripes {
        let at = |i: usize| field((i % columns) as f32, (i / columns) as f32);
        let (normal, density) = (0..columns * rows).map(at).unzip();
        Stripes { columns, rows, cell: 1.0, normal, density }
    }

    fn length(line: &[Point2<f64>]) -> f64 {
        line.windows(2).map(|p| (p[1] - p[0]).norm()).sum()
    }

    #[test]
    fn straight_lines_stand_evenly_whatever_the_sense_of_their_normals() {
        let (c, s) = (0.8f32, 0.6f32);
        let field = stripes(160, 120, |x, y| {
            let flip = if (x * 7.3 + y * 3.1).sin() > 0.0 { 1.0 } else { -1.0 };
            ([flip * c, flip * s], 0.2)
        });
        let lines = field.lines(7, 0);
        let total: f64 = lines.iter().map(|l| length(l)).sum();
        assert!((total / (159.0 * 119.0) - 0.2).abs() < 0.004, "{total}");
        for line in &lines {
            let across: Vec<f64> = line.iter().map(|p| 0.8 * p.x + 0.6 * p.y).collect();
            let (low, high) = across.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
            assert!(high - low < 0.05, "a line wavers by {}", high - low);
        }
    }

    #[test]
    fn density_grows_by_lines_that_begin_between_others() {
        let field = stripes(300, 200, |x, _| ([0.0, 1.0], 0.08 + 0.17 * x / 300.0));
        let lines = field.lines(1, 0);
        for (from, to) in [(20.0, 80.0), (110.0, 170.0), (220.0, 280.0)] {
            let within: f64 = lines
                .iter()
                .flat_map(|l| l.windows(2))
                .filter(|p| p[0].x >= from && p[0].x < to)
                .map(|p| (p[1] - p[0]).norm())
                .sum();
            let desired = 0.08 + 0.17 * 0.5 * (from + to) / 300.0;
            let got = within / (60.0 * 199.0);
            assert!((got / desired - 1.0).abs() < 0.06, "{got} for {desired}");
        }
    }

    #[test]
    fn rings_close() {
        let field = stripes(101, 101, |x, y| {
            let (x, y) = (x - 50.0, y - 50.0);
            let r = x.hypot(y).max(1e-3);
            ([x / r, y / r], 0.125)
        });
        let rings = field.lines(3, 0).into_iter().filter(|l| l.len() > 20 && l.first() == l.last()).count();
        assert!((4..=7).contains(&rings), "{rings} rings");
    }
}
