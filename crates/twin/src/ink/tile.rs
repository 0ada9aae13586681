//! The pixels of a tile while ink is laid on them, and what the ink does to light.
use crate::ink::segment::{Segment, TILE};
use crate::math::SrgbTable;

/// What light does.
pub(super) struct Colours {
    pub(super) inks: Vec<Absorber>,
    /// Linear light of the paper.
    pub(super) paper: [f32; 3],
    pub(super) srgb: SrgbTable,
}

/// The share of light that an ink takes, tabulated over density: a picture asks for it at every inked pixel.
pub(super) struct Absorber {
    absorbance: [f32; 3],
    table: Vec<[f32; 3]>,
}

impl Absorber {
    /// Entries per unit of density. Interpolation is off by at most `(a / STEPS)^2 / 8`, an eighth of a step of sRGB for the
    /// blackest ink.
    const STEPS: f32 = 512.0;
    /// Largest tabulated density.
    const LAST: f32 = 4.0;

    pub(super) fn new(absorbance: [f64; 3]) -> Self {
        let absorbance = absorbance.map(|a| a as f32);
        let exact = |density: f32| absorbance.map(|a| 1.0 - (-density * a).exp());
        let table = (0..=(Self::LAST * Self::STEPS) as u32 + 1).map(|i| exact(i as f32 / Self::STEPS)).collect();
        Self { absorbance, table }
    }

    /// `1 - exp(-D a)` for red, green, blue.
    fn taken(&self, density: f32) -> [f32; 3] {
        if density >= Self::LAST {
            return self.absorbance.map(|a| 1.0 - (-density * a).exp());
        }
        let place = density * Self::STEPS;
        let low = place as usize;
        let part = place - low as f32;
        let (low, high) = (&self.table[low], &self.table[low + 1]);
        std::array::from_fn(|k| low[k] + part * (high[k] - low[k]))
    }
}

/// One stroke's wet ink on a pixel.
#[derive(Clone, Copy, Default)]
struct Wet {
    /// Largest coverage, 0..=1.
    cover: f32,
    /// Largest coverage times density.
    tone: f32,
    /// Length of the stroke at its last visit, px.
    arc: f32,
}

/// The pixels of a tile while it is drawn.
pub(super) struct Tile {
    left: f32,
    top: f32,
    /// Ink of the current stroke.
    wet: Vec<Wet>,
    /// Share of light let through by what is dry, for red, green, blue.
    light: Vec<[f32; 3]>,
    /// Pixels that the current stroke has touched: columns and rows, ends exclusive.
    touched: [usize; 4],
}

/// Untouched: the ends before the starts.
const NOTHING: [usize; 4] = [TILE, 0, TILE, 0];

impl Tile {
    pub(super) fn new() -> Self {
        let pixels = TILE * TILE;
        Self { left: 0.0, top: 0.0, wet: vec![Wet::default(); pixels], light: vec![[1.0; 3]; pixels], touched: NOTHING }
    }

    /// Fresh paper, whose top left corner is here, px. There is no wet ink: every stroke ends by drying.
    pub(super) fn clear(&mut self, left: f32, top: f32) {
        (self.left, self.top) = (left, top);
        self.light.fill([1.0; 3]);
    }

    /// Lays a segment of the current stroke.
    pub(super) fn draw(&mut self, segment: &Segment, ink: &Absorber) {
        let (mut a, mut b) = (segment.a, segment.b);
        let growth = b.radius - a.radius;
        let mut length = (b.x - a.x).hypot(b.y - a.y);
        if growth.abs() >= 0.999 * length {
            // One end lies within the other, or as good as, or both are one point: a dot.
            (a, b, length) = if growth > 0.0 { (b, b, 0.0) } else { (a, a, 0.0) };
        }
        let (ax, ay, lx, ly) = (a.x - self.left, a.y - self.top, b.x - a.x, b.y - a.y);
        let reach = a.radius.max(b.radius) + 0.5;
        let per_length = if length > 0.0 { 1.0 / length } else { 0.0 };
        let (ux, uy) = (lx * per_length, ly * per_length);
        // The edge of a widening line leans outwards, so the disc that reaches a pixel farthest sits this much further
        // along per unit of distance from the axis: sin/cos of the lean.
        let sine = growth * per_length;
        let lean = if length > 0.0 { sine / (1.0 - sine * sine).sqrt() } else { 0.0 };
        let (start, end) = (-segment.caps[0].min(reach), length + segment.caps[1].min(reach));
        let sides = reach * ux.abs();
        let top = (ay.min(ay + ly) - reach).max(ay + (start * uy).min(end * uy) - sides);
        let bottom = (ay.max(ay + ly) + reach).min(ay + (start * uy).max(end * uy) + sides);
        let (top, bottom) = if length > 0.0 { (top, bottom) } else { (ay - reach, ay + reach) };
        let Some(rows) = pixels(top, bottom) else { return };
        let (left, right) = (ax.min(ax + lx) - reach, ax.max(ax + lx) + reach);
        // What a row sees of the strip along the axis, and of the strip between the caps: a middle that moves from row to
        // row, and a half width that stays.
        let strip = |moves: f32, half: f32, by: f32| {
            if by.abs() > 1e-3 { (moves / by, half / by.abs()) } else { (0.0, f32::INFINITY) }
        };
        let (along_slope, along_half) = strip(ux, reach, uy);
        let (across_slope, across_half) = strip(-uy, (end - start) / 2.0, ux);
        let across_middle = if ux.abs() > 1e-3 { (start + end) / 2.0 / ux } else { 0.0 };
        for y in rows.clone() {
            let dy = y as f32 + 0.5 - ay;
            let (along, across) = (ax + dy * along_slope, ax + across_middle + dy * across_slope);
            let from = left.max(along - along_half).max(across - across_half);
            let to = right.min(along + along_half).min(across + across_half);
            let Some(columns) = pixels(from, to) else { continue };
            self.touched[0] = self.touched[0].min(columns.start);
            self.touched[1] = self.touched[1].max(columns.end);
            let at = y * TILE;
            let wet = &mut self.wet[at + columns.start..at + columns.end];
            let light = &mut self.light[at + columns.start..at + columns.end];
            for ((x, wet), light) in columns.zip(wet).zip(light) {
                let dx = x as f32 + 0.5 - ax;
                let (along, off) = (dx * ux + dy * uy, (dx * uy - dy * ux).abs());
                let t = ((along + lean * off) * per_length).clamp(0.0, 1.0);
                let (ex, ey) = (dx - t * lx, dy - t * ly);
                let distance = (ex * ex + ey * ey).sqrt();
                let radius = a.radius + t * (b.radius - a.radius);
                // How much of the pixel, one px long across the line, lies between the line's edges.
                let cover = (distance + 0.5).min(radius) - (distance - 0.5).max(-radius);
                if cover <= 0.0 {
                    continue;
                }
                let arc = a.arc + t * length;
                if wet.cover > 0.0 && arc - wet.arc > segment.gap {
                    wet.dry(light, ink);
                }
                let tone = cover * (a.density + t * (b.density - a.density));
                wet.cover = wet.cover.max(cover);
                wet.tone = wet.tone.max(tone);
                wet.arc = arc;
            }
        }
        self.touched[2] = self.touched[2].min(rows.start);
        self.touched[3] = self.touched[3].max(rows.end);
    }

    /// Ends the current stroke: all its ink dries.
    pub(super) fn dry(&mut self, ink: &Absorber) {
        let [left, right, top, bottom] = std::mem::replace(&mut self.touched, NOTHING);
        for y in top..bottom {
            for i in y * TILE + left.min(right)..y * TILE + right {
                if self.wet[i].cover > 0.0 {
                    self.wet[i].dry(&mut self.light[i], ink);
                }
            }
        }
    }

    /// Writes the tile's colours into its band of the picture, `left` px from its left edge.
    pub(super) fn show(&self, colours: &Colours, band: &mut [u8], width: usize, left: usize) {
        let columns = TILE.min(width - left);
        for (row, light) in band.chunks_exact_mut(3 * width).zip(self.light.chunks_exact(TILE)) {
            for (pixel, light) in row[3 * left..3 * (left + columns)].chunks_exact_mut(3).zip(light) {
                if *light != [1.0; 3] {
                    for k in 0..3 {
                        pixel[k] = colours.srgb.get(colours.paper[k] * light[k]);
                    }
                }
            }
        }
    }
}

impl Wet {
    /// Turns wet ink into absorbed light.
    fn dry(&mut self, light: &mut [f32; 3], ink: &Absorber) {
        let taken = ink.taken(self.tone / self.cover);
        for (light, taken) in light.iter_mut().zip(taken) {
            *light *= 1.0 - self.cover * taken;
        }
        self.cover = 0.0;
        self.tone = 0.0;
    }
}

/// The pixels of a tile whose centres lie between two coordinates; `None` when there are none.
fn pixels(low: f32, high: f32) -> Option<std::ops::Range<usize>> {
    // Casts round down and saturate; the margin of 0.01 keeps rounding from losing a pixel.
    let first = (low + 0.49).max(0.0) as usize;
    let end = ((high + 0.51).max(0.0) as usize).min(TILE);
    (first < end).then_some(first..end)
}
