//! A page of pen strokes in inks: curves, hatching clipped to outlines, and an SVG of it.
use std::fmt::Write as _;

pub type P = (f64, f64);

/// Strokes of several inks, mm, y up.
pub struct Page {
    pub width: f64,
    pub height: f64,
    inks: Vec<(&'static str, &'static str, Vec<Vec<P>>)>,
    seed: u64,
}

impl Page {
    /// An empty page; an ink is a name and a colour.
    pub fn new(width: f64, height: f64, inks: &[(&'static str, &'static str)]) -> Self {
        Self { width, height, inks: inks.iter().map(|(n, c)| (*n, *c, Vec::new())).collect(), seed: 7 }
    }

    /// The next number of an even sequence in 0 to 1 (splitmix64).
    pub fn random(&mut self) -> f64 {
        self.seed = self.seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.seed;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A polyline.
    pub fn line(&mut self, ink: usize, points: &[P]) {
        let inside = |p: &P| (0.0..=self.width).contains(&p.0) && (0.0..=self.height).contains(&p.1);
        if points.len() > 1 && points.iter().all(inside) {
            self.inks[ink].2.push(points.to_vec());
        }
    }

    /// A smooth curve through points.
    pub fn curve(&mut self, ink: usize, points: &[P]) {
        self.line(ink, &smooth(points, false));
    }

    /// An outline filled with straight hatching, `angle` in degrees; with or without its own line.
    pub fn hatched(&mut self, ink: usize, outline: &[P], angle: f64, spacing: f64) {
        for (a, b) in hatch(outline, angle, spacing) {
            if (a.0 - b.0).hypot(a.1 - b.1) > 1.5 {
                self.line(ink, &[a, b]);
            }
        }
    }

    /// Part of a circle, degrees.
    pub fn arc(&mut self, ink: usize, (x, y): P, radius: f64, from: f64, to: f64) {
        let n = ((to - from).abs() / 6.0).ceil().max(2.0) as usize;
        let at = |k: usize| (from + (to - from) * k as f64 / n as f64).to_radians();
        let points: Vec<P> = (0..=n).map(|k| (x + radius * at(k).cos(), y + radius * at(k).sin())).collect();
        self.line(ink, &points);
    }

    #[cfg(test)]
    pub fn strokes(&self) -> usize {
        self.inks.iter().map(|i| i.2.len()).sum()
    }

    /// The page as SVG, a group an ink.
    pub fn svg(&self, title: &str) -> String {
        let (w, h) = (self.width, self.height);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
             width=\"{w}mm\" height=\"{h}mm\" viewBox=\"0 0 {w} {h}\">\n<title>{title}</title>\n"
        );
        for (name, color, strokes) in &self.inks {
            let _ = writeln!(
                svg,
                "<g inkscape:groupmode=\"layer\" inkscape:label=\"{name}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"0.8\">"
            );
            for stroke in strokes {
                let mut d = String::new();
                for (k, (x, y)) in stroke.iter().enumerate() {
                    let _ = write!(d, "{}{:.1} {:.1}", if k == 0 { "M" } else { "L" }, x, h - y);
                }
                let _ = writeln!(svg, "<path d=\"{d}\"/>");
            }
            svg += "</g>\n";
        }
        svg + "</svg>\n"
    }
}

/// Points along a Catmull-Rom curve.
pub fn smooth(points: &[P], closed: bool) -> Vec<P> {
    let n = points.len() as i64;
    let at = |i: i64| points[if closed { i.rem_euclid(n) } else { i.clamp(0, n - 1) } as usize];
    let spans = if closed { n } else { n - 1 };
    let mut out = vec![points[0]];
    for i in 0..spans {
        let (a, b, c, d) = (at(i - 1), at(i), at(i + 1), at(i + 2));
        let steps = ((c.0 - b.0).hypot(c.1 - b.1) / 3.0).ceil().clamp(1.0, 12.0) as usize;
        for k in 1..=steps {
            let t = k as f64 / steps as f64;
            let mix = |a: f64, b: f64, c: f64, d: f64| {
                let (t2, t3) = (t * t, t * t * t);
                0.5 * (2.0 * b
                    + (c - a) * t
                    + (2.0 * a - 5.0 * b + 4.0 * c - d) * t2
                    + (3.0 * b - a - 3.0 * c + d) * t3)
            };
            out.push((mix(a.0, b.0, c.0, d.0), mix(a.1, b.1, c.1, d.1)));
        }
    }
    out
}

/// Lines at an angle inside a closed outline (even-odd), the ends a little short of it.
pub fn hatch(outline: &[P], angle: f64, spacing: f64) -> Vec<(P, P)> {
    let (s, c) = angle.to_radians().sin_cos();
    let turned: Vec<P> = outline.iter().map(|(x, y)| (x * c + y * s, y * c - x * s)).collect();
    let low = turned.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    let high = turned.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
    let mut lines = Vec::new();
    let mut y = (low / spacing).ceil() * spacing + 0.37 * spacing;
    while y < high {
        let mut hits: Vec<f64> = (0..turned.len())
            .filter_map(|i| {
                let (a, b) = (turned[i], turned[(i + 1) % turned.len()]);
                ((a.1 > y) != (b.1 > y)).then(|| a.0 + (b.0 - a.0) * (y - a.1) / (b.1 - a.1))
            })
            .collect();
        hits.sort_by(f64::total_cmp);
        for pair in hits.chunks_exact(2) {
            let (a, b) = (pair[0] + 1.0, pair[1] - 1.0);
            if b > a {
                lines.push(((a * c - y * s, a * s + y * c), (b * c - y * s, b * s + y * c)));
            }
        }
        y += spacing;
    }
    lines
}

/// Points scaled, mirrored when `scale` is negative in x, and moved.
pub fn placed(points: &[P], (x, y): P, scale: f64, mirrored: bool) -> Vec<P> {
    let sign = if mirrored { -1.0 } else { 1.0 };
    points.iter().map(|(px, py)| (x + sign * scale * px, y + scale * py)).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_frieze_is_rich_and_the_same_every_time() {
        let (a, b) = (crate::frieze::page(), crate::frieze::page());
        assert!(a.strokes() > 1200 && a.svg("x") == b.svg("x"));
        assert!(crate::skyline::page().strokes() > 1000);
    }
}
