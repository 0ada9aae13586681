//! The flow of a picture: at each place the direction along which it changes least.
//!
//! Directions have no head or tail, so they are averaged as vectors of twice their angle. What Kyprianidis and Döllner
//! (2008, doi:10.2312/LocalChapterEvents/TPCG/TPCG08/051-058) do at one scale, a Gaussian mean of the structure tensor,
//! is done here at many scales at once: the finest one that sees an edge decides, and flat areas take the direction of
//! the edges around them, as edge tangent flow (Kang et al. 2007, doi:10.1145/1274871.1274878) has it along edges only.
use crate::picture::Plane;

/// Weight of the fallback direction, against 1 for a strong edge at hand. Edges weigh less the farther they are.
const FALLBACK_WEIGHT: f32 = 1e-5;
/// Weight of each mean against the next finer one.
const DECAY: f32 = 0.3;
/// Side of the largest grid on which wide blurs are made, px: nothing finer is left in them.
const COARSE: usize = 96;

/// How the flow is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowOptions {
    /// Standard deviation of the finest mean, px: smaller follows details, larger gives calmer lines.
    pub scale: f64,
    /// Change of lightness (0..=1) over a pixel that counts half as an edge; weaker ones are mostly noise.
    pub contrast: f64,
    /// Direction where there is no edge near or far, rad, counter-clockwise from x as the picture is seen.
    pub fallback: f64,
}

/// A field of directions over a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Flow {
    /// Cosine of twice the angle, from x to the right towards y **down**.
    cos2: Plane,
    /// Sine of twice the angle.
    sin2: Plane,
    /// How well the edges around agree, 0..=1.
    coherence: Plane,
}

impl Flow {
    /// The flow of a picture's lightness, at each pixel.
    pub fn of(lightness: &Plane, options: &FlowOptions) -> Self {
        let (w, h) = (lightness.width(), lightness.height());
        let (right, down) = lightness.blurred((0.4 * options.scale).max(0.7) as f32).gradient();
        let (mut cos2, mut sin2, mut weight) =
            (Plane::filled(w, h, 0.0), Plane::filled(w, h, 0.0), Plane::filled(w, h, 0.0));
        let half = (options.contrast * options.contrast).max(1e-12) as f32;
        for at in 0..w * h {
            let (gx, gy) = (right.values[at], down.values[at]);
            let m2 = gx * gx + gy * gy;
            let share = m2 / (m2 + half);
            if m2 > 1e-14 {
                // The tangent is a quarter turn from the gradient: half a turn for the doubled angle.
                cos2.values[at] = -(gx * gx - gy * gy) / m2 * share;
                sin2.values[at] = -2.0 * gx * gy / m2 * share;
                weight.values[at] = share;
            }
        }
        Self::spread(cos2, sin2, weight, options)
    }

    /// Sums means over scales that double until they span the picture.
    fn spread(cos2: Plane, sin2: Plane, weight: Plane, options: &FlowOptions) -> Self {
        let (w, h) = (weight.width(), weight.height());
        let turned = -2.0 * options.fallback;
        let start = |v: f64| Plane::filled(w, h, v as f32 * FALLBACK_WEIGHT);
        let mut sums = [start(turned.cos()), start(turned.sin()), start(1.0)];
        let (mut sigma, mut share) = (options.scale.max(0.5), 1.0f32);
        while share > 1e-4 && (share == 1.0 || sigma < w.max(h) as f64) {
            let means = [&cos2, &sin2, &weight].map(|part| wide_blur(part, sigma));
            for i in 0..w * h {
                let [c, s, all] = [0, 1, 2].map(|k| means[k].values[i]);
                // Where edges disagree, as in noise, wider means decide.
                let agree = (c * c + s * s).sqrt() / all.max(1e-20);
                for (sum, mean) in sums.iter_mut().zip([c, s, all]) {
                    sum.values[i] += share * agree * mean;
                }
            }
            sigma *= 2.0;
            share *= DECAY;
        }
        let [cos2, sin2, weight] = sums;
        let mut flow = Self { coherence: Plane::filled(w, h, 0.0), cos2, sin2 };
        for i in 0..w * h {
            let length = flow.cos2.values[i].hypot(flow.sin2.values[i]);
            flow.coherence.values[i] = (length / weight.values[i]).min(1.0);
            flow.cos2.values[i] /= length.max(1e-20);
            flow.sin2.values[i] /= length.max(1e-20);
        }
        // Where scales meet the direction may turn fast: smooth it once more, as unit vectors.
        flow.cos2 = flow.cos2.blurred(options.scale as f32);
        flow.sin2 = flow.sin2.blurred(options.scale as f32);
        flow
    }

    /// Width of the field, px.
    pub fn width(&self) -> usize {
        self.cos2.width()
    }

    /// Height of the field, px.
    pub fn height(&self) -> usize {
        self.cos2.height()
    }

    /// The direction at a place in the picture (px, centres at halves): a unit vector, x right, y **down**, of either
    /// sense.
    pub fn direction(&self, x: f64, y: f64) -> [f64; 2] {
        let [c, s] = self.doubled(x, y);
        let half = 0.5 * s.atan2(c);
        [half.cos(), half.sin()]
    }

    /// Cosine and sine of twice the direction's angle, shorter than 1 where the direction turns fast.
    pub(super) fn doubled(&self, x: f64, y: f64) -> [f64; 2] {
        [f64::from(self.cos2.sample(x, y)), f64::from(self.sin2.sample(x, y))]
    }

    /// How well the edges around a place agree, 0..=1: 1 along a straight edge, 0 where every direction is as good.
    pub fn coherence(&self, x: f64, y: f64) -> f64 {
        f64::from(self.coherence.sample(x, y))
    }
}

/// A blur that is made on a smaller grid where it is wide, which costs next to nothing.
fn wide_blur(plane: &Plane, sigma: f64) -> Plane {
    let (w, h) = (plane.width(), plane.height());
    let step = (sigma / 6.0).floor().min((w.max(h) as f64 / COARSE as f64).floor()).max(1.0);
    if step <= 1.0 {
        return plane.blurred(sigma as f32);
    }
    let small = |n: usize| (n as f64 / step).ceil().max(1.0) as usize;
    let coarse = plane.resized(small(w), small(h));
    coarse.blurred((sigma * small(w) as f64 / w as f64) as f32).resized(w, h)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const OPTIONS: FlowOptions = FlowOptions { scale: 3.0, contrast: 0.02, fallback: 0.6 };

    fn angle_between(a: [f64; 2], b: [f64; 2]) -> f64 {
        (a[0] * b[0] + a[1] * b[1]).abs().min(1.0).acos()
    }

    #[test]
    fn flow_runs_round_a_disc_and_far_beyond_it() {
        let disc = Plane::from_fn(120, 120, |x, y| {
            let r = (x as f64 - 59.5).hypot(y as f64 - 59.5);
            (1.0 / (1.0 + (r - 30.0).exp())) as f32
        });
        let flow = Flow::of(&disc, &OPTIONS);
        for k in 0..24 {
            let a = f64::from(k) * PI / 12.0 + 0.1;
            for (r, within) in [(30.0, 0.03), (40.0, 0.12), (18.0, 0.12)] {
                let d = flow.direction(60.0 + r * a.cos(), 60.0 + r * a.sin());
                let off = angle_between(d, [-a.sin(), a.cos()]);
                assert!(off < within, "{off} rad off at {a} rad, radius {r}");
            }
            assert!(flow.coherence(60.0 + 30.0 * a.cos(), 60.0 + 30.0 * a.sin()) > 0.8);
        }
    }

    #[test]
    fn a_flat_picture_has_the_fallback_direction_and_a_pixel_is_no_trouble() {
        for (w, h) in [(40, 30), (1, 1), (2, 1)] {
            let flow = Flow::of(&Plane::filled(w, h, 0.5), &OPTIONS);
            // Counter-clockwise as seen is negative with y down.
            assert!(angle_between(flow.direction(0.5, 0.5), [0.6f64.cos(), -0.6f64.sin()]) < 1e-3);
        }
    }

    #[test]
    fn flow_turns_smoothly_between_two_edges() {
        // A vertical edge at the left, a horizontal one at the top right.
        let plane = Plane::from_fn(200, 200, |x, y| if x < 30 || (x > 120 && y < 30) { 0.0 } else { 1.0 });
        let flow = Flow::of(&plane, &OPTIONS);
        for y in (20..190).step_by(7) {
            for x in 40..190 {
                let (a, b) = (flow.direction(x as f64, y as f64), flow.direction(x as f64 + 1.0, y as f64));
                let turn = angle_between(a, b);
                assert!(turn < 0.35 || flow.coherence(x as f64, y as f64) < 0.5, "{turn} rad at {x}, {y}");
            }
        }
    }
}
