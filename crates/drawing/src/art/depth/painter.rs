//! The choice of strokes: which of all that superpixels suggest bring the canvas nearest to the picture.
use nalgebra::{Point2, Vector2};
use rand_chacha::rand_core::Rng;

use crate::art::PenBrush;
use crate::art::depth::canvas::Canvas;
use crate::art::depth::estimate::rim_distance;
use crate::art::depth::form::Form;
use crate::art::depth::layered::paper_color;
use crate::art::depth::trace::{Habit, grow, outline_strokes};
use crate::art::depth::{LayeredOptions, Semantics, SlicOptions, Superpixels, slic};
use crate::math::stream;
use crate::picture::{Flat, Ink, Picture, Plane, oklab_from_linear, oklab_from_rgb};

/// Squares as wide as the broadest brush that would fill the picture, as a share of the strokes.
const BROADEST: f64 = 0.15;
/// Radius of each pass's brush, as a share of that of the pass before.
const FINER: f64 = 0.55;

/// Shortest spine of a stroke, in radii of its brush, unless it is the pen's line alone.
const SLENDER: f64 = 2.5;

/// Most rounds over the gaps that the passes leave.
const GAPS: usize = 6;

/// A stroke and why it is where it is in the order.
#[derive(Clone, Debug)]
pub(super) struct Planned {
    /// Place of its segment in the drawing order.
    pub rank: usize,
    /// 0 for an outline, then 1 + the layer of depth, from the back.
    pub layer: usize,
    /// Pass of the brushes, the broadest first.
    pub pass: usize,
    /// Index of its ink.
    pub ink: usize,
    /// The pen's way, px.
    pub line: Vec<Point2<f64>>,
}

/// Everything that the choice of strokes looks at.
pub(super) struct Painter<'a> {
    flat: &'a Flat,
    semantics: &'a Semantics,
    lines: &'a [f64],
    options: &'a LayeredOptions,
    lab: Vec<[f32; 3]>,
    form: Form,
    /// Distance of each pixel from where its segment or its ink ends, px.
    room: Vec<f32>,
    /// Layer of depth of each pixel within its segment, from the back.
    bands: Vec<u8>,
    canvas: Canvas,
    /// Segments in drawing order, and the place of each in it.
    order: Vec<usize>,
    rank: Vec<usize>,
    planned: Vec<Planned>,
    /// Those of the second pass, if there is one: neither the coarsest nor the finest.
    pub superpixels: Option<Superpixels>,
    /// Radius of the broadest brush, px.
    broadest: f64,
    seed: u64,
}

impl<'a> Painter<'a> {
    /// A painter before bare paper; `lines` holds the width of each ink's line, px.
    pub fn new(
        flat: &'a Flat,
        original: &'a Picture,
        semantics: &'a Semantics,
        lines: &'a [f64],
        options: &'a LayeredOptions,
        seed: u64,
    ) -> Self {
        let (width, height) = (flat.width(), flat.height());
        let lab: Vec<[f32; 3]> = original.pixels.iter().map(|p| oklab_from_linear(*p)).collect();
        let lightness = Plane::from_values(width, height, lab.iter().map(|p| p[0]).collect()).unwrap_or_default();
        let form = Form::new(&lightness, semantics.labels(), semantics.depth());
        let drawn = flat.labels.iter().filter(|l| Some(usize::from(**l)) != flat.paper).count();
        let areas: Vec<u32> =
            semantics.labels().iter().zip(&flat.labels).map(|(s, l)| u32::from(*s) << 8 | u32::from(*l)).collect();
        let order = semantics.drawing_order();
        let mut rank = vec![0; semantics.segments().len()];
        order.iter().enumerate().for_each(|(r, s)| rank[*s] = r);
        Self {
            flat,
            semantics,
            lines,
            options,
            lab,
            form,
            room: rim_distance(&areas, width, height),
            bands: bands(semantics, options.layers),
            canvas: Canvas::new(&flat.picture(), paper_color(flat), &flat.inks),
            order,
            rank,
            planned: Vec::new(),
            superpixels: None,
            broadest: 0.5 * (drawn as f64 / (BROADEST * options.strokes as f64)).sqrt(),
            seed,
        }
    }

    /// Chooses the strokes.
    pub fn paint(&mut self) -> Vec<Planned> {
        let total: f64 = self.canvas.difference().iter().map(|d| f64::from(*d)).sum();
        // what a stroke must gain to be worth one of the budget
        let floor = 0.02 * total / self.options.strokes as f64;
        self.outlines(floor);
        for pass in 0..self.options.passes.len() {
            self.pass(pass, pass, floor);
        }
        // what is left goes into the gaps, as long as that is worth it
        let last = self.options.passes.len() - 1;
        for round in 1..=GAPS {
            let before = self.planned.len();
            self.pass(last, last + round, 0.3 * floor);
            if self.planned.len() < before + self.options.strokes / 100 {
                break;
            }
        }
        std::mem::take(&mut self.planned)
    }

    /// The pen's way over a brush stroke, cut off at the picture's edge.
    fn pen_line(&self, brush: &PenBrush, spine: &[Point2<f64>]) -> Vec<Point2<f64>> {
        let middle = 0.5 * Vector2::new(self.flat.width() as f64, self.flat.height() as f64);
        let centred: Vec<Point2<f64>> = spine.iter().map(|p| p - middle).collect();
        brush.pen_line(&centred, [middle.x, middle.y]).into_iter().map(|p| p + middle).collect()
    }

    fn left(&self) -> usize {
        self.options.strokes - self.planned.len()
    }

    /// A budget shared among the segments by what they still lack, those that are things counting more.
    fn shares(&self, budget: f64) -> Vec<f64> {
        let mut lack = vec![0.0; self.order.len()];
        for (d, s) in self.canvas.difference().iter().zip(self.semantics.labels()) {
            lack[self.rank[usize::from(*s)]] += f64::from(*d);
        }
        let weights = self.semantics.weights();
        for (lack, s) in lack.iter_mut().zip(&self.order) {
            if weights[*s] > 0.0 {
                *lack *= self.options.emphasis;
            }
            // a small segment needs strokes even if a large one needs more
            *lack = lack.powf(0.75);
        }
        let all: f64 = lack.iter().sum::<f64>().max(1e-300);
        lack.into_iter().map(|l| budget * l / all).collect()
    }

    fn outlines(&mut self, floor: f64) {
        let shares = self.shares(self.options.strokes as f64 * self.options.outline);
        for (rank, share) in shares.into_iter().enumerate() {
            let mut found = outline_strokes(self.flat, self.semantics, self.order[rank], self.lines);
            let mut gains: Vec<(f64, usize)> = Vec::new();
            for (i, (ink, line)) in found.iter().enumerate() {
                gains.push((self.canvas.gain(line, self.lines[*ink], *ink, self.options.harm), i));
            }
            gains.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for (_, i) in gains.into_iter().take((share.ceil() as usize).min(self.left())) {
                let (ink, line) = (found[i].0, std::mem::take(&mut found[i].1));
                // again: outlines of neighbours run side by side
                if self.canvas.gain(&line, self.lines[ink], ink, self.options.harm) > 0.25 * floor {
                    self.canvas.draw(&line, self.lines[ink], ink);
                    self.planned.push(Planned { rank, layer: 0, pass: 0, ink, line });
                }
            }
        }
    }

    /// One pass with a brush over all segments; `round` counts them all.
    fn pass(&mut self, pass: usize, round: usize, floor: f64) {
        let last = pass + 1 == self.options.passes.len();
        let budget = if last {
            self.left()
        } else {
            ((self.options.strokes as f64 * self.options.passes[pass]) as usize).min(self.left())
        };
        if budget == 0 {
            return;
        }
        let drawn = self.flat.labels.iter().filter(|l| Some(usize::from(**l)) != self.flat.paper).count();
        // each pass has about three seeds for each stroke it may place: many are covered already, or find no room
        let seeds = (3.0 * budget as f64 * self.flat.labels.len() as f64 / drawn as f64).max(1.0);
        let superpixels = slic(
            &self.lab,
            self.flat.width(),
            Some(self.semantics.labels()),
            &SlicOptions {
                count: (seeds as usize).min(self.flat.labels.len()),
                compactness: self.options.compactness,
                ..SlicOptions::default()
            },
        );
        let radius = self.broadest * FINER.powi(pass as i32);
        let mut seeds = self.seeds(&superpixels);
        let lack: Vec<f64> = {
            let mut lack = vec![0.0; superpixels.cells.len()];
            let difference = self.canvas.difference();
            superpixels.labels.iter().zip(difference).for_each(|(l, d)| lack[*l as usize] += f64::from(*d));
            lack
        };
        seeds.sort_by(|a, b| lack[b.0].total_cmp(&lack[a.0]).then(a.0.cmp(&b.0)));
        let mut shares: Vec<usize> = self.shares(budget as f64).into_iter().map(|s| s.round() as usize).collect();
        let mut random = stream(self.seed, "layered depth", round as u64);
        let mut left = budget;
        for (_, pixel) in seeds {
            let rank = self.rank[usize::from(self.semantics.labels()[pixel])];
            if shares[rank] == 0 || left == 0 {
                continue;
            }
            let luck = 0.75 + 0.5 * f64::from(random.next_u32()) / f64::from(u32::MAX);
            if let Some((ink, line)) = self.stroke(pixel, radius, luck, floor) {
                let layer = 1 + usize::from(self.bands[pixel]);
                self.canvas.draw(&line, self.lines[ink], ink);
                self.planned.push(Planned { rank, layer, pass, ink, line });
                shares[rank] -= 1;
                left -= 1;
            }
        }
        if self.superpixels.is_none() || round == 1 {
            self.superpixels = Some(superpixels);
        }
    }

    /// For each superpixel whose commonest ink isn't the paper, the pixel in that ink with the most room, near its centre.
    fn seeds(&self, superpixels: &Superpixels) -> Vec<(usize, usize)> {
        let inks = self.flat.inks.len();
        let mut votes = vec![0u32; inks * superpixels.cells.len()];
        for (cell, ink) in superpixels.labels.iter().zip(&self.flat.labels) {
            votes[*cell as usize * inks + usize::from(*ink)] += 1;
        }
        // the commonest ink that isn't paper; of paper alone there is none
        let winner: Vec<Option<usize>> = votes
            .chunks(inks)
            .map(|v| (0..inks).filter(|i| Some(*i) != self.flat.paper && v[*i] > 0).max_by_key(|i| (v[*i], inks - i)))
            .collect();
        let mut best: Vec<Option<(f64, usize)>> = vec![None; superpixels.cells.len()];
        let width = self.flat.width();
        for (i, cell) in superpixels.labels.iter().enumerate() {
            let cell = *cell as usize;
            if winner[cell] != Some(usize::from(self.flat.labels[i])) {
                continue;
            }
            let c = &superpixels.cells[cell];
            let off = ((i % width) as f64 + 0.5 - c.x).hypot((i / width) as f64 + 0.5 - c.y);
            let score = f64::from(self.room[i]) - 0.5 * off;
            if best[cell].is_none_or(|b| score > b.0) {
                best[cell] = Some((score, i));
            }
        }
        best.into_iter().enumerate().filter_map(|(cell, b)| Some((cell, b?.1))).collect()
    }

    /// The best stroke from a seed, of brushes up to a radius, px; `None` when none gains enough.
    fn stroke(&mut self, pixel: usize, radius: f64, luck: f64, floor: f64) -> Option<(usize, Vec<Point2<f64>>)> {
        let (flat, semantics) = (self.flat, self.semantics);
        let ink = usize::from(flat.labels[pixel]);
        let segment = semantics.labels()[pixel];
        if self.canvas.pixel_gain(pixel, ink) <= 0.0 {
            return None;
        }
        let width = flat.width();
        let finest = 0.5 * self.lines[ink];
        let room = f64::from(self.room[pixel]).max(finest);
        let mut best: Option<(f64, Vec<Point2<f64>>)> = None;
        for share in [1.0, 0.6, 0.36] {
            let brush = PenBrush {
                radius: (share * radius).min(room).max(finest),
                line: self.lines[ink],
                coverage: self.options.coverage,
                fill: self.options.fill,
            };
            let habit = Habit {
                radius: brush.drawn_radius(),
                // finer strokes are shorter, but not by as much as they are finer
                longest: 2.0 * self.options.length * luck * (brush.radius * radius.max(self.broadest)).sqrt(),
                curvature: self.options.curvature,
            };
            let canvas = &self.canvas;
            let (labels, room) = (&semantics.labels(), &self.room);
            let welcome = |i: usize| {
                labels[i] == segment
                    && usize::from(flat.labels[i]) == ink
                    && f64::from(room[i]) > 0.5 * habit.radius.min(radius) - 0.5
                    && canvas.pixel_gain(i, ink) > 0.0
            };
            let at = Point2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
            let spine = grow(&self.form, at, width, flat.height(), &habit, welcome);
            // a stroke that is shorter than it is wide is a blot
            let length: f64 = spine.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
            if length < SLENDER * habit.radius && brush.radius > finest {
                continue;
            }
            let line = self.pen_line(&brush, &spine);
            let gain = self.canvas.gain(&line, self.lines[ink], ink, self.options.harm);
            if gain > floor && best.as_ref().is_none_or(|b| gain > b.0) {
                best = Some((gain, line));
            }
            if brush.radius <= finest {
                break;
            }
        }
        best.map(|(_, line)| (ink, line))
    }
}

/// The layer of depth of each pixel within its segment, from the back: the histogram of the segment's depths, equalised.
fn bands(semantics: &Semantics, layers: usize) -> Vec<u8> {
    const BINS: usize = 256;
    let bin = |d: f32| ((d * BINS as f32) as usize).min(BINS - 1);
    let mut histogram = vec![[0u32; BINS]; semantics.segments().len()];
    for (s, d) in semantics.labels().iter().zip(&semantics.depth().values) {
        histogram[usize::from(*s)][bin(*d)] += 1;
    }
    let band: Vec<Vec<u8>> = histogram
        .iter()
        .map(|bins| {
            let all: f64 = bins.iter().map(|b| f64::from(*b)).sum::<f64>().max(1.0);
            let mut below = 0.0;
            bins.iter()
                .map(|b| {
                    // the middle of a bin, so that a segment of one depth is one layer in the middle
                    let share = (below + 0.5 * f64::from(*b)) / all;
                    below += f64::from(*b);
                    ((share * layers as f64) as usize).min(layers - 1) as u8
                })
                .collect()
        })
        .collect();
    semantics.labels().iter().zip(&semantics.depth().values).map(|(s, d)| band[usize::from(*s)][bin(*d)]).collect()
}

/// Strokes in the order in which they are drawn: by segment, outline, then layer from the back, then from the broadest brush
/// to the finest, and in each of these from the lightest ink to the darkest, with short ways between.
pub(super) fn in_order(mut planned: Vec<Planned>, inks: &[Ink]) -> Vec<Planned> {
    let lightness = |ink: usize| oklab_from_rgb(inks[ink].color)[0];
    let mut by_light: Vec<usize> = (0..inks.len()).collect();
    by_light.sort_by(|a, b| lightness(*b).total_cmp(&lightness(*a)).then(a.cmp(b)));
    let mut shade = vec![0; inks.len()];
    by_light.into_iter().enumerate().for_each(|(k, i)| shade[i] = k);
    let key = |p: &Planned| (p.rank, p.layer, p.pass, shade[p.ink]);
    planned.sort_by_key(key);
    let mut at = Point2::origin();
    let mut start = 0;
    while start < planned.len() {
        let same = |p: &Planned| key(p) == key(&planned[start]);
        let end = start + planned[start..].iter().take_while(|p| same(p)).count();
        for next in start..end {
            let way = |p: &Planned| {
                let (a, b) = (p.line.first(), p.line.last());
                let d = |q: Option<&Point2<f64>>| q.map_or(f64::MAX, |q| (q - at).norm());
                (d(a).min(d(b)), d(b) < d(a))
            };
            let nearest =
                (next..end).min_by(|a, b| way(&planned[*a]).0.total_cmp(&way(&planned[*b]).0)).unwrap_or(next);
            planned.swap(next, nearest);
            if way(&planned[next]).1 {
                planned[next].line.reverse();
            }
            at = planned[next].line.last().copied().unwrap_or(at);
        }
        start = end;
    }
    planned
}
