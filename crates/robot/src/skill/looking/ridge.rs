//! Dark lines in a picture, found to a fraction of a pixel.
use nalgebra::{Point2, Vector2};

use super::Picture;

/// Side of the blocks whose light is taken for the bare wall's, px.
const BLOCK: usize = 32;
/// Share of a block's pixels that are no lighter than its bare wall.
const BARE: f64 = 0.8;
/// Distance between looks across a line, px.
const STEP: f64 = 0.5;
/// Least darkness that is taken for ink.
const INK: f32 = 0.15;

/// How dark each pixel is against the bare wall round it: 0 bare, 1 black.
pub struct Darkness {
    size_px: [usize; 2],
    values: Vec<f32>,
}

impl Darkness {
    /// Takes the fall-off of the light out of a picture. Of red, green and blue the darkest counts.
    pub fn of(picture: &Picture) -> Self {
        let [w, h] = picture.size_px;
        let darkest = |i: usize| picture.pixels[3 * i..3 * i + 3].iter().copied().min().map_or(0.0, f32::from);
        let raw: Vec<f32> = (0..w * h).map(darkest).collect();
        let blocks = [w.div_ceil(BLOCK), h.div_ceil(BLOCK)];
        let bare: Vec<f32> = (0..blocks[0] * blocks[1])
            .map(|b| {
                let (left, top) = (b % blocks[0] * BLOCK, b / blocks[0] * BLOCK);
                let rows = top..(top + BLOCK).min(h);
                let mut light: Vec<f32> =
                    rows.flat_map(|y| raw[y * w + left..y * w + (left + BLOCK).min(w)].iter().copied()).collect();
                let at = ((light.len() - 1) as f64 * BARE) as usize;
                *light.select_nth_unstable_by(at, f32::total_cmp).1
            })
            .collect();
        let between = |x: usize, count: usize| {
            let place = ((x as f32 + 0.5) / BLOCK as f32 - 0.5).clamp(0.0, (count - 1) as f32);
            let low = (place as usize).min(count.saturating_sub(2));
            (low, (low + 1).min(count - 1), place - low as f32)
        };
        let mut values = raw;
        for y in 0..h {
            let (y0, y1, v) = between(y, blocks[1]);
            for x in 0..w {
                let (x0, x1, u) = between(x, blocks[0]);
                let row = |y: usize| bare[y * blocks[0] + x0] * (1.0 - u) + bare[y * blocks[0] + x1] * u;
                let light = row(y0) * (1.0 - v) + row(y1) * v;
                let value = &mut values[y * w + x];
                *value = if light > 4.0 { (1.0 - *value / light).clamp(0.0, 1.0) } else { 0.0 };
            }
        }
        Self { size_px: picture.size_px, values }
    }

    /// Darkness at a place, px from the upper left corner, between pixels; 0 beside the picture.
    pub fn at(&self, place: &Point2<f64>) -> f32 {
        let [w, h] = self.size_px;
        let (x, y) = (place.x - 0.5, place.y - 0.5);
        if !(x >= 0.0 && y >= 0.0 && x < (w - 1) as f64 && y < (h - 1) as f64) {
            return 0.0;
        }
        let (i, j) = (x as usize, y as usize);
        let (u, v) = ((x - i as f64) as f32, (y - j as f64) as f32);
        let at = |i: usize, j: usize| self.values[j * w + i];
        (at(i, j) * (1.0 - u) + at(i + 1, j) * u) * (1.0 - v) + (at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u) * v
    }

    /// How far from `place` (px) along `across` (unit) the middle of the nearest dark line of about `width` px is, px, at most `reach`.
    /// `None` where none is, and where another crosses it.
    pub fn line_across(&self, place: &Point2<f64>, across: &Vector2<f64>, width: f64, reach: f64) -> Option<f64> {
        let half = (0.5 * width / STEP).round().max(1.0) as usize;
        let n = ((reach + 2.0 * width + 2.0) / STEP).ceil() as usize;
        let seen: Vec<f32> = (0..=2 * n)
            .map(|i| self.at(&(place + across * ((i as f64 - n as f64) * STEP))))
            .map(|d| if d < INK { 0.0 } else { d })
            .collect();
        let sum = |i: usize| seen[i.saturating_sub(half)..=(i + half).min(2 * n)].iter().sum::<f32>();
        let smooth: Vec<f32> = (0..=2 * n).map(sum).collect();
        let most = (reach / STEP).floor() as usize;
        let peak = |i: usize| {
            let (low, high) = (i.saturating_sub(half), (i + half).min(2 * n));
            smooth[i] > INK * half as f32 && (low..=high).all(|j| smooth[j] <= smooth[i])
        };
        let found = (n - most..=n + most).filter(|i| peak(*i)).min_by_key(|i| i.abs_diff(n))?;
        // its centre of darkness, in a window that follows it
        let mut middle = found as f64;
        for _ in 0..3 {
            let window = width / STEP + 2.0;
            let (low, high) =
                ((middle - window).max(0.0).ceil() as usize, (middle + window).min(2.0 * n as f64) as usize);
            let (mut weight, mut moment) = (0.0, 0.0);
            for (i, d) in seen.iter().enumerate().take(high + 1).skip(low) {
                weight += f64::from(*d);
                moment += f64::from(*d) * i as f64;
            }
            middle = if weight > 0.0 { moment / weight } else { return None };
        }
        // a line that crosses it, or a second one at its side, would pull it over
        let flank = width / STEP + 3.0;
        let dark = |at: f64| if (0.0..=2.0 * n as f64).contains(&at) { seen[at as usize] } else { 0.0 };
        let clear = [-flank, flank].iter().all(|f| dark(middle + f) < 0.5 * dark(middle).max(INK));
        let off = (middle - n as f64) * STEP;
        (clear && off.abs() <= reach + 0.5 * width).then_some(off)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::JointVector;

    /// A line of darkness 0.8 and 3 px wide through `(x, 60)` px, leaning by `slope`, on a wall that grows darker to the right.
    fn picture(x: f64, slope: f64) -> Picture {
        let size_px = [160, 120];
        let mut pixels = Vec::new();
        for v in 0..120 {
            for u in 0..160 {
                let middle = x + slope * (f64::from(v) + 0.5 - 60.0);
                let off = (f64::from(u) + 0.5 - middle).abs();
                let cover = (2.0 - off).clamp(0.0, 1.0);
                let light = 200.0 - 0.5 * f64::from(u);
                pixels.extend([(light * (1.0 - 0.8 * cover)).round() as u8; 3]);
            }
        }
        Picture { size_px, pixels, q: JointVector::zeros() }
    }

    #[test]
    fn a_line_is_found_to_a_twentieth_of_a_pixel() {
        for x in [80.0, 80.3, 80.5, 81.7] {
            let dark = Darkness::of(&picture(x, 0.2));
            let off = dark.line_across(&Point2::new(79.0, 60.0), &Vector2::x(), 3.0, 6.0).expect("is there");
            assert!((off - (x - 79.0)).abs() < 0.05, "{off} for {}", x - 79.0);
        }
    }

    #[test]
    fn where_no_line_is_none_is_found() {
        let dark = Darkness::of(&picture(80.0, 0.0));
        assert!(dark.line_across(&Point2::new(40.0, 60.0), &Vector2::x(), 3.0, 6.0).is_none());
        assert!(dark.line_across(&Point2::new(-40.0, 60.0), &Vector2::x(), 3.0, 6.0).is_none());
    }
}
