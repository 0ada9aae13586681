//! Flat colour pictures for walls: broad painted letters, and a bed of flowers.
use crate::page::{P, smooth};

pub struct Mural {
    pub width: usize,
    pub height: usize,
    /// sRGB, 0 to 1.
    pixels: Vec<[f64; 3]>,
}

type Rgb = [f64; 3];

fn mix(a: Rgb, b: Rgb, t: f64) -> Rgb {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t.clamp(0.0, 1.0))
}

/// Distance of a point from a polyline, and how far along it (0 to 1) the nearest place is.
fn near(line: &[P], x: f64, y: f64) -> (f64, f64) {
    let mut best = (f64::INFINITY, 0.0);
    for (i, w) in line.windows(2).enumerate() {
        let (dx, dy) = (w[1].0 - w[0].0, w[1].1 - w[0].1);
        let u = (((x - w[0].0) * dx + (y - w[0].1) * dy) / (dx * dx + dy * dy).max(1e-12)).clamp(0.0, 1.0);
        let d = (x - w[0].0 - u * dx).hypot(y - w[0].1 - u * dy);
        if d < best.0 {
            best = (d, (i as f64 + u) / (line.len() - 1) as f64);
        }
    }
    best
}

impl Mural {
    fn new(width: usize, height: usize, ground: impl Fn(f64, f64) -> Rgb) -> Self {
        let at = |i: usize| ground((i % width) as f64 / height as f64, 1.0 - (i / width) as f64 / height as f64);
        Self { width, height, pixels: (0..width * height).map(at).collect() }
    }

    /// Paints where `cover` (0 to 1) says, within `reach` of the box of `line`. Units: the picture's height; y up.
    fn paint(&mut self, line: &[P], reach: f64, color: impl Fn(f64, f64, f64, f64) -> (Rgb, f64)) {
        let h = self.height as f64;
        let fold =
            |f: fn(f64, f64) -> f64, d: usize, s: f64| line.iter().map(|p| if d == 0 { p.0 } else { p.1 }).fold(s, f);
        let (x0, x1) = (fold(f64::min, 0, f64::INFINITY) - reach, fold(f64::max, 0, f64::NEG_INFINITY) + reach);
        let (y0, y1) = (fold(f64::min, 1, f64::INFINITY) - reach, fold(f64::max, 1, f64::NEG_INFINITY) + reach);
        let columns = ((x0 * h).max(0.0) as usize, ((x1 * h).max(0.0) as usize).min(self.width - 1));
        let rows = (((1.0 - y1) * h).max(0.0) as usize, (((1.0 - y0) * h).max(0.0) as usize).min(self.height - 1));
        for j in rows.0..=rows.1 {
            for i in columns.0..=columns.1 {
                let (x, y) = ((i as f64 + 0.5) / h, 1.0 - (j as f64 + 0.5) / h);
                let (d, u) = near(line, x, y);
                let (rgb, cover) = color(x, y, d, u);
                let pixel = &mut self.pixels[j * self.width + i];
                *pixel = mix(*pixel, rgb, cover);
            }
        }
    }

    /// 8-bit sRGB in steps of 4, row by row.
    pub fn bytes(&self) -> Vec<u8> {
        self.pixels.iter().flatten().map(|c| ((c * 63.75).round() * 4.0).clamp(0.0, 255.0) as u8).collect()
    }
}

/// 1 inside a distance, 0 outside, over a soft edge.
fn inside(d: f64, r: f64) -> f64 {
    ((r - d) / 0.006 + 0.5).clamp(0.0, 1.0)
}

/// The word CALAMUS in broad rounded letters that shade from one colour to the next, with shadow, outline and shine: 9 to 1.
pub fn letters() -> Mural {
    const TOP: [Rgb; 7] = [
        [0.98, 0.80, 0.12],
        [0.97, 0.55, 0.10],
        [0.92, 0.26, 0.22],
        [0.86, 0.16, 0.50],
        [0.50, 0.24, 0.68],
        [0.16, 0.42, 0.80],
        [0.08, 0.64, 0.72],
    ];
    const LOW: [Rgb; 7] = [
        [0.93, 0.40, 0.10],
        [0.86, 0.18, 0.22],
        [0.74, 0.08, 0.42],
        [0.48, 0.10, 0.58],
        [0.16, 0.22, 0.66],
        [0.04, 0.50, 0.66],
        [0.10, 0.58, 0.30],
    ];
    let mut m = Mural::new(2700, 300, |_, _| [1.0, 1.0, 1.0]);
    let letters: [Vec<Vec<P>>; 7] = [
        vec![vec![(0.86, 0.76), (0.62, 0.88), (0.32, 0.82), (0.14, 0.5), (0.32, 0.18), (0.62, 0.12), (0.88, 0.26)]],
        vec![
            vec![(0.08, 0.12), (0.30, 0.55), (0.48, 0.88), (0.66, 0.55), (0.90, 0.12)],
            vec![(0.27, 0.40), (0.72, 0.40)],
        ],
        vec![vec![(0.22, 0.88), (0.20, 0.50), (0.22, 0.14), (0.52, 0.13), (0.86, 0.18)]],
        vec![
            vec![(0.08, 0.12), (0.30, 0.55), (0.48, 0.88), (0.66, 0.55), (0.90, 0.12)],
            vec![(0.27, 0.40), (0.72, 0.40)],
        ],
        vec![vec![(0.10, 0.12), (0.16, 0.86), (0.50, 0.36), (0.86, 0.86), (0.92, 0.12)]],
        vec![vec![(0.14, 0.88), (0.13, 0.42), (0.30, 0.15), (0.60, 0.14), (0.82, 0.40), (0.84, 0.88)]],
        vec![vec![
            (0.84, 0.78),
            (0.56, 0.89),
            (0.24, 0.80),
            (0.24, 0.60),
            (0.54, 0.50),
            (0.82, 0.38),
            (0.80, 0.20),
            (0.50, 0.11),
            (0.14, 0.22),
        ]],
    ];
    let sharp = |k: usize, i: usize| matches!((k, i), (1 | 3, _) | (4, _));
    let lines: Vec<(usize, Vec<P>)> = letters
        .iter()
        .enumerate()
        .flat_map(|(k, parts)| parts.iter().enumerate().map(move |(i, part)| (k, i, part)))
        .map(|(k, i, part)| {
            let at: Vec<P> = part.iter().map(|(x, y)| (0.18 + 1.25 * k as f64 + 1.08 * x, 0.07 + 0.86 * y)).collect();
            (k, if sharp(k, i) { at } else { smooth_fine(&at) })
        })
        .collect();
    // bubbles behind
    for k in 0..46 {
        let (x, y) = (0.15 + 0.192 * f64::from(k), 0.5 + 0.42 * (2.4 * f64::from(k)).sin());
        let r = 0.03 + 0.045 * (0.5 + 0.5 * (1.7 * f64::from(k)).sin());
        let tint = mix(TOP[(k as usize * 7 / 46).min(6)], [1.0; 3], 0.55);
        m.paint(&[(x, y), (x + 1e-6, y)], r + 0.02, |px, py, d, _| {
            let shine = inside((px - x + 0.3 * r).hypot(py - y - 0.3 * r), 0.25 * r);
            (mix(tint, [1.0; 3], shine), inside(d, r))
        });
    }
    for (_, line) in &lines {
        let shadow: Vec<P> = line.iter().map(|p| (p.0 + 0.035, p.1 - 0.035)).collect();
        m.paint(&shadow, 0.16, |_, _, d, _| ([0.12, 0.11, 0.20], inside(d, 0.128)));
    }
    for (_, line) in &lines {
        m.paint(line, 0.16, |_, _, d, _| ([0.10, 0.09, 0.12], inside(d, 0.128)));
    }
    for (k, line) in &lines {
        m.paint(line, 0.13, |_, y, d, _| {
            let t = (0.95 - y) / 0.85;
            let body = mix(TOP[*k], LOW[*k], t);
            let lit = mix(body, [1.0, 1.0, 0.96], 0.65 * inside((d - 0.052).abs(), 0.010) * (1.0 - 1.3 * t).max(0.0));
            (mix(lit, LOW[*k], 0.5 * ((d - 0.07) / 0.05).clamp(0.0, 1.0)), inside(d, 0.108))
        });
    }
    m
}

fn smooth_fine(points: &[P]) -> Vec<P> {
    smooth(&points.iter().map(|p| (p.0 * 100.0, p.1 * 100.0)).collect::<Vec<_>>(), false)
        .into_iter()
        .map(|p| (p.0 / 100.0, p.1 / 100.0))
        .collect()
}

/// A bed of flowers on stems against a light sky: 17 to 6.
pub fn flowers() -> Mural {
    let (w, h) = (1700, 600);
    let mut m = Mural::new(w, h, |_, y| mix([0.97, 0.95, 0.86], [0.86, 0.92, 0.95], y));
    let span = w as f64 / h as f64;
    for k in 0..90 {
        let x = span * (f64::from(k) + 0.5) / 90.0 + 0.02 * (3.7 * f64::from(k)).sin();
        let tall = 0.22 + 0.14 * (1.9 * f64::from(k)).sin().abs();
        let lean = 0.10 * (2.3 * f64::from(k)).sin();
        let blade = smooth_fine(&[(x, -0.03), (x + 0.3 * lean, 0.5 * tall), (x + lean, tall)]);
        m.paint(&blade, 0.02, |_, y, d, u| {
            (mix([0.10, 0.30, 0.12], [0.45, 0.62, 0.22], y / tall), inside(d, 0.012 * (1.0 - 0.9 * u)))
        });
    }
    let heads: [(f64, f64, f64, usize); 13] = [
        (0.20, 0.62, 0.13, 0),
        (0.42, 0.80, 0.11, 1),
        (0.60, 0.50, 0.12, 2),
        (0.83, 0.72, 0.15, 0),
        (1.06, 0.46, 0.11, 3),
        (1.20, 0.80, 0.12, 2),
        (1.43, 0.60, 0.16, 1),
        (1.68, 0.82, 0.11, 0),
        (1.80, 0.50, 0.12, 2),
        (2.04, 0.72, 0.15, 3),
        (2.28, 0.48, 0.11, 0),
        (2.42, 0.80, 0.12, 1),
        (2.62, 0.58, 0.14, 2),
    ];
    const PETAL: [[Rgb; 2]; 4] = [
        [[0.50, 0.22, 0.66], [0.78, 0.60, 0.90]],
        [[0.86, 0.20, 0.24], [0.98, 0.62, 0.50]],
        [[0.20, 0.34, 0.74], [0.58, 0.72, 0.94]],
        [[0.94, 0.62, 0.08], [0.99, 0.88, 0.48]],
    ];
    for (k, (x, y, r, _)) in heads.iter().enumerate() {
        let bend = 0.06 * (1.3 * k as f64).sin();
        let stem = smooth_fine(&[(x + 0.5 * bend, -0.03), (x + bend, 0.5 * y), (*x, *y)]);
        m.paint(&stem, 0.03, |px, _, d, u| {
            (mix([0.12, 0.34, 0.14], [0.42, 0.60, 0.24], 0.5 + 60.0 * (px - x) + 0.2 * u), inside(d, 0.011))
        });
        for side in [-1.0, 1.0] {
            let base = (x + 0.8 * bend, (0.28 + 0.04 * side) * y + 0.06);
            let leaf = smooth_fine(&[
                base,
                (base.0 + side * 0.5 * r, base.1 + 0.4 * r),
                (base.0 + side * 1.1 * r, base.1 + 0.35 * r),
            ]);
            m.paint(&leaf, 0.06, |_, _, d, u| {
                let rib = inside(d, 0.003);
                (
                    mix(mix([0.14, 0.40, 0.16], [0.50, 0.68, 0.28], d / 0.03), [0.08, 0.24, 0.10], rib),
                    inside(d, 0.032 * (4.0 * u * (1.0 - u)).sqrt()),
                )
            });
        }
    }
    for (x, y, r, kind) in heads {
        let [deep, pale] = PETAL[kind];
        for ring in [0, 1] {
            let n = if ring == 0 { 11 } else { 8 };
            let length = if ring == 0 { r } else { 0.66 * r };
            for p in 0..n {
                let a = std::f64::consts::TAU * (f64::from(p) + 0.5 * f64::from(ring)) / f64::from(n) + x;
                let tip = (x + length * a.cos(), y + length * a.sin());
                m.paint(&[(x, y), tip], 0.5 * r, |px, py, d, u| {
                    let wide = 0.27 * length * (u * (1.25 - u) * 3.2).max(0.0).sqrt() * (1.0 - u.powi(6)).max(0.0);
                    let edge = (d / wide.max(1e-9)).clamp(0.0, 1.0);
                    let tone = mix(deep, pale, 0.15 + 0.85 * u - 0.35 * edge);
                    let vein = 0.18 * (0.5 + 0.5 * (34.0 * ((px - x).hypot(py - y) / r)).sin()) * (1.0 - edge);
                    (
                        mix(
                            mix(tone, deep, vein),
                            [0.12, 0.06, 0.16],
                            0.75 * inside(1.0 - edge, 0.07) * f64::from(u < 0.98),
                        ),
                        inside(d, wide),
                    )
                });
            }
        }
        m.paint(&[(x, y), (x + 1e-6, y)], 0.3 * r, |px, py, d, _| {
            let seed = 0.5 + 0.5 * (260.0 * px).sin() * (260.0 * py).sin();
            (mix([0.42, 0.22, 0.06], [0.98, 0.80, 0.24], seed * (1.0 - d / (0.3 * r))), inside(d, 0.22 * r))
        });
    }
    m
}
