//! Paper under strokes of transparent ink, and how far it still is from the picture.
use nalgebra::Point2;

use crate::art::wash::{Wash, washed};
use crate::math::Rgb;
use crate::picture::{Ink, Picture, linear_from_rgb, oklab_difference2, oklab_from_linear};

/// Share of the paper's light that comes through a full line of ink.
pub(super) fn through(ink: Rgb, paper: Rgb) -> Wash {
    let (ink, paper) = (linear_from_rgb(ink), linear_from_rgb(paper));
    std::array::from_fn(|k| (ink[k] / paper[k].max(1e-3)).clamp(0.0, 1.0))
}

/// Paper that takes strokes.
pub(super) struct Paper {
    width: usize,
    height: usize,
    /// Linear light of each pixel, row by row.
    pub light: Vec<[f32; 3]>,
    cover: Vec<f32>,
    touched: Vec<u32>,
}

impl Paper {
    /// Bare paper.
    pub fn new(width: usize, height: usize, color: Rgb) -> Self {
        let n = width * height;
        Self { width, height, light: vec![linear_from_rgb(color); n], cover: vec![0.0; n], touched: Vec::new() }
    }

    /// Lays a line of a width (px) along a polyline (px) over the paper, without inking it yet. Within one stroke the
    /// larger cover counts: a line that touches itself is no darker there.
    pub fn lay(&mut self, line: &[Point2<f64>], line_width: f64) {
        for i in std::mem::take(&mut self.touched) {
            self.cover[i as usize] = 0.0;
        }
        let half = 0.5 * line_width;
        // a line thinner than a pixel covers a part of it
        let full = line_width.min(1.0) as f32;
        let reach = half + 0.5;
        let single = [line.first().copied(), line.first().copied()];
        let pairs = line.windows(2).map(|w| [w[0], w[1]]);
        let dot = single[0].zip(single[1]).filter(|_| line.len() == 1).map(|(a, b)| [a, b]);
        for [a, b] in pairs.chain(dot) {
            let along = b - a;
            let length2 = along.norm_squared().max(1e-12);
            let span = |lo: f64, hi: f64, n: usize| {
                ((lo - reach - 0.5).ceil().max(0.0) as usize)..((hi + reach + 0.5).floor().max(0.0) as usize).min(n)
            };
            for y in span(a.y.min(b.y), a.y.max(b.y), self.height) {
                for x in span(a.x.min(b.x), a.x.max(b.x), self.width) {
                    let p = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let t = ((p - a).dot(&along) / length2).clamp(0.0, 1.0);
                    let d = (p - (a + t * along)).norm();
                    let c = ((reach - d) as f32).clamp(0.0, full);
                    let at = y * self.width + x;
                    if c > self.cover[at] {
                        if self.cover[at] == 0.0 {
                            self.touched.push(at as u32);
                        }
                        self.cover[at] = c;
                    }
                }
            }
        }
    }

    /// Inks the line that was laid.
    pub fn ink(&mut self, through: [f32; 3]) {
        for i in &self.touched {
            let i = *i as usize;
            self.light[i] = washed(self.light[i], through, self.cover[i]);
        }
    }

    /// The paper as a picture.
    pub fn picture(&self) -> Picture {
        Picture::from_pixels(self.width, self.height, self.light.clone()).unwrap_or_default()
    }
}

/// A canvas `C` on its way to a picture `I`: it knows `|I - C|^2`, in Oklab.
pub(super) struct Canvas {
    paper: Paper,
    target: Vec<[f32; 3]>,
    difference: Vec<f32>,
    through: Vec<[f32; 3]>,
}

fn difference(light: [f32; 3], target: [f32; 3]) -> f32 {
    oklab_difference2(oklab_from_linear(light), target)
}

impl Canvas {
    /// Bare paper before a picture that is to be painted in these inks.
    pub fn new(target: &Picture, paper: Rgb, inks: &[Ink]) -> Self {
        let target_lab: Vec<[f32; 3]> = target.pixels.iter().map(|p| oklab_from_linear(*p)).collect();
        let paper_light = linear_from_rgb(paper);
        let difference = target_lab.iter().map(|t| difference(paper_light, *t)).collect();
        Self {
            paper: Paper::new(target.width(), target.height(), paper),
            target: target_lab,
            difference,
            through: inks.iter().map(|i| through(i.color, paper)).collect(),
        }
    }

    /// The difference of each pixel, row by row.
    pub fn difference(&self) -> &[f32] {
        &self.difference
    }

    /// By how much a pixel's difference would fall if an ink covered it.
    pub fn pixel_gain(&self, pixel: usize, ink: usize) -> f32 {
        let covered = washed(self.paper.light[pixel], self.through[ink], 1.0);
        self.difference[pixel] - difference(covered, self.target[pixel])
    }

    /// By how much the difference of all pixels would fall if this line were drawn; line and width in px. Where it would
    /// rise counts `harm` times: ink can't be taken away again.
    pub fn gain(&mut self, line: &[Point2<f64>], line_width: f64, ink: usize, harm: f64) -> f64 {
        self.paper.lay(line, line_width);
        let gain = |i: &u32| {
            let i = *i as usize;
            let after = washed(self.paper.light[i], self.through[ink], self.paper.cover[i]);
            let fall = f64::from(self.difference[i] - difference(after, self.target[i]));
            if fall < 0.0 { harm * fall } else { fall }
        };
        self.paper.touched.iter().map(gain).sum()
    }

    /// Draws a line.
    pub fn draw(&mut self, line: &[Point2<f64>], line_width: f64, ink: usize) {
        self.paper.lay(line, line_width);
        self.paper.ink(self.through[ink]);
        for i in &self.paper.touched {
            let i = *i as usize;
            self.difference[i] = difference(self.paper.light[i], self.target[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::PAPER;

    fn black() -> Ink {
        Ink { name: "black".into(), color: Rgb([0, 0, 0]) }
    }

    #[test]
    fn the_gain_of_a_line_is_what_drawing_it_gains() {
        let mut pixels = vec![linear_from_rgb(PAPER); 400];
        pixels[150..250].iter_mut().for_each(|p| *p = [0.0; 3]);
        let mut canvas = Canvas::new(&Picture::from_pixels(20, 20, pixels).unwrap(), PAPER, &[black()]);
        let total = |c: &Canvas| c.difference().iter().map(|v| f64::from(*v)).sum::<f64>();
        let line = [Point2::new(2.0, 10.2), Point2::new(17.0, 9.5), Point2::new(10.0, 12.0)];
        let before = total(&canvas);
        let gain = canvas.gain(&line, 3.0, 0, 1.0);
        assert!(gain > 1.0);
        canvas.draw(&line, 3.0, 0);
        assert!((before - gain - total(&canvas)).abs() < 1e-4);
        // only the soft rim of the line is left to gain
        assert!(canvas.gain(&line, 3.0, 0, 1.0) < 0.6 * gain);
        assert!(canvas.gain(&[Point2::new(3.0, 3.0)], 2.0, 0, 1.0) < 0.0);
    }

    #[test]
    fn ink_is_transparent_and_a_thin_line_covers_in_part() {
        let mut paper = Paper::new(11, 11, Rgb([255; 3]));
        let line = [Point2::new(0.0, 5.5), Point2::new(11.0, 5.5)];
        paper.lay(&line, 0.5);
        paper.ink([0.2, 0.5, 1.0]);
        let p = paper.picture().at(5, 5);
        assert!((p[0] - 0.6).abs() < 1e-6 && (p[1] - 0.75).abs() < 1e-6 && p[2] == 1.0, "{p:?}");
        paper.lay(&line, 0.5);
        paper.ink([0.2, 0.5, 1.0]);
        assert!((paper.picture().at(5, 5)[0] - 0.36).abs() < 1e-6);
        paper.lay(&[Point2::new(-900.0, -5.0), Point2::new(-800.0, 1e6)], 3.0);
    }
}
