//! The trace as a flat picture, by a tile rasteriser on the CPU.
//!
//! Lines are chains of round-capped segments of varying width, anti-aliased by the overlap of a pixel with the line across
//! it. Within a stroke the strongest coverage of a pixel counts, so joints don't darken. Between strokes, and where a stroke
//! comes back to a pixel later, light is absorbed once more: a layer of coverage `c` and density `D` lets `1 - c (1 -
//! exp(-D a))` of the light through, so whole pixels show `paper exp(-sum D a)` and crossings darken.
//!
//! Tiles are rendered independently and each in the order of the trace, so the picture is the same at any number of threads.
use rayon::prelude::*;

use crate::ink::image::MAX_SIDE;
use crate::ink::optics::{PAPER, SrgbTable, absorbance, linear_from_srgb};
use crate::ink::{Image, InkError, InkStroke, InkTrace};
use crate::math::Rgb;

/// Side of a tile, px. A tile's buffers (24 bytes a pixel) stay in the second-level cache.
const TILE: usize = 64;
/// A stroke that comes back to a pixel after this many of its mean widths of its own length absorbs again; nearer, it is a
/// joint.
const RETURN_WIDTHS: f32 = 3.0;
/// But not nearer than this, px, which a pixel may take to pass.
const RETURN_PX: f32 = 3.0;
/// Points nearer than this to the segment that replaces them, px, are left out, and so are changes of width this small.
const TOLERANCE: f32 = 0.03;
/// Changes of density this small make no new segment.
const DENSITY_TOLERANCE: f32 = 0.004;
/// Most points that one segment replaces: bounds the work of the search.
const RUN: usize = 32;

/// What the picture of a trace looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RasterOptions {
    /// Width of the sheet, m. The picture shows all of the sheet and no more.
    pub width: f64,
    /// Height of the sheet, m.
    pub height: f64,
    /// Resolution, px/mm.
    pub px_per_mm: f64,
    /// Colour of the paper.
    pub paper: Rgb,
}

impl RasterOptions {
    /// A sheet of `width` x `height`, m, on [`PAPER`], its longer side `px` pixels long.
    pub fn with_long_side(width: f64, height: f64, px: u32) -> Self {
        Self { width, height, px_per_mm: f64::from(px) / (1000.0 * width.max(height)), paper: PAPER }
    }

    /// Columns and rows of the picture.
    ///
    /// # Errors
    /// [`InkError::Size`] when a side has no pixel, or more than 32768.
    pub fn size(&self) -> Result<(u32, u32), InkError> {
        let side = |m: f64| {
            // A hair less than a pixel too much is rounding, not sheet.
            let px = (m * 1000.0 * self.px_per_mm - 1e-6).ceil();
            (1.0..=f64::from(MAX_SIDE)).contains(&px).then_some(px as u32)
        };
        match (side(self.width), side(self.height)) {
            (Some(columns), Some(rows)) => Ok((columns, rows)),
            _ => Err(InkError::Size {
                width_mm: self.width * 1e3,
                height_mm: self.height * 1e3,
                px_per_mm: self.px_per_mm,
                max_px: MAX_SIDE,
            }),
        }
    }
}

/// Draws the trace as it lies on the sheet. Widths are those on the surface.
///
/// # Errors
/// [`InkError::Size`], [`InkError::UnknownInk`] or [`InkError::BadPoint`].
pub fn rasterise(trace: &InkTrace, options: &RasterOptions) -> Result<Image, InkError> {
    let (columns, rows) = options.size()?;
    check(trace)?;
    let segments: Vec<Segment> = trace
        .strokes
        .par_iter()
        .enumerate()
        .map(|(i, stroke)| stroke_segments(i as u32, stroke, options))
        .collect::<Vec<_>>()
        .concat();
    paint(&segments, trace, options, (columns, rows))
}

/// Draws segments, ordered by stroke, on a picture of so many columns and rows.
fn paint(
    segments: &[Segment],
    trace: &InkTrace,
    options: &RasterOptions,
    (columns, rows): (u32, u32),
) -> Result<Image, InkError> {
    let (width, height) = (columns as usize, rows as usize);
    let bins = Bins::new(segments, width.div_ceil(TILE), height.div_ceil(TILE));
    let colours = Colours {
        inks: trace.inks.iter().map(|ink| Absorber::new(absorbance(ink.color, options.paper))).collect(),
        paper: options.paper.0.map(|v| linear_from_srgb(v) as f32),
        srgb: SrgbTable::new(),
    };
    let mut rgb: Vec<u8> = options.paper.0.repeat(width * height);
    rgb.par_chunks_mut(3 * width * TILE).enumerate().for_each_init(Tile::new, |tile, (row, band)| {
        for column in 0..bins.columns {
            let segments_here = bins.of(column, row);
            if segments_here.is_empty() {
                continue;
            }
            tile.clear((column * TILE) as f32, (row * TILE) as f32);
            let mut current: Option<&Segment> = None;
            for segment in segments_here.iter().map(|i| &segments[*i as usize]) {
                if let Some(last) = current.filter(|last| last.stroke != segment.stroke) {
                    tile.dry(&colours.inks[last.ink as usize]);
                }
                tile.draw(segment, &colours.inks[segment.ink as usize]);
                current = Some(segment);
            }
            if let Some(last) = current {
                tile.dry(&colours.inks[last.ink as usize]);
            }
            tile.show(&colours, band, width, column * TILE);
        }
    });
    Image::new(columns, rows, rgb)
}

/// Refuses inks that aren't there and numbers that can't be drawn.
fn check(trace: &InkTrace) -> Result<(), InkError> {
    for (stroke, s) in trace.strokes.iter().enumerate() {
        if s.ink as usize >= trace.inks.len() {
            return Err(InkError::UnknownInk { stroke, ink: s.ink, inks: trace.inks.len() });
        }
        let bad = |p: &crate::ink::InkPoint| {
            let place = p.sheet.x.is_finite() && p.sheet.y.is_finite();
            !(place && p.width >= 0.0 && p.width.is_finite() && p.density >= 0.0 && p.density.is_finite())
        };
        if let Some(point) = s.points.iter().position(bad) {
            return Err(InkError::BadPoint { stroke, point });
        }
    }
    Ok(())
}

/// What light does.
struct Colours {
    inks: Vec<Absorber>,
    /// Linear light of the paper.
    paper: [f32; 3],
    srgb: SrgbTable,
}

/// The share of light that an ink takes, tabulated over density: a picture asks for it at every inked pixel.
struct Absorber {
    absorbance: [f32; 3],
    table: Vec<[f32; 3]>,
}

impl Absorber {
    /// Entries per unit of density. Interpolation is off by at most `(a / STEPS)^2 / 8`, an eighth of a step of sRGB for the
    /// blackest ink.
    const STEPS: f32 = 512.0;
    /// Largest tabulated density.
    const LAST: f32 = 4.0;

    fn new(absorbance: [f64; 3]) -> Self {
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

/// An end of a segment in picture coordinates: px, x right, y down, from the top left corner.
#[derive(Clone, Copy)]
struct Node {
    x: f32,
    y: f32,
    /// Half the width of the line, px.
    radius: f32,
    density: f32,
    /// Length of the stroke up to here, px.
    arc: f32,
}

/// A round-capped piece of a line.
#[derive(Clone, Copy)]
struct Segment {
    a: Node,
    b: Node,
    /// How far it is drawn beyond `a` and `b`, px; a whole round cap unless the neighbour covers it.
    caps: [f32; 2],
    /// A return to a pixel after more than this length, px, is a crossing and not a joint.
    gap: f32,
    stroke: u32,
    ink: u32,
}

/// The segments of a stroke: neighbours on a straight line of even width and density made one.
fn stroke_segments(index: u32, stroke: &InkStroke, options: &RasterOptions) -> Vec<Segment> {
    let scale = 1000.0 * options.px_per_mm;
    let mut arc = 0.0;
    let mut last = None;
    let nodes: Vec<Node> = stroke
        .points
        .iter()
        .map(|p| {
            let (x, y) = ((p.sheet.x + options.width / 2.0) * scale, (options.height / 2.0 - p.sheet.y) * scale);
            arc += last.map_or(0.0, |(lx, ly): (f64, f64)| (x - lx).hypot(y - ly));
            last = Some((x, y));
            Node {
                x: x as f32,
                y: y as f32,
                radius: (p.width * scale / 2.0) as f32,
                density: p.density as f32,
                arc: arc as f32,
            }
        })
        .collect();
    let mean_width = 2.0 * nodes.iter().map(|n| n.radius).sum::<f32>() / nodes.len().max(1) as f32;
    let gap = (RETURN_WIDTHS * mean_width).max(RETURN_PX);
    let segment = |a: Node, b: Node| Segment { a, b, gap, caps: [f32::INFINITY; 2], stroke: index, ink: stroke.ink };
    if let [dot] = nodes[..] {
        return vec![segment(dot, dot)];
    }
    let mut segments = Vec::new();
    let mut from = 0;
    while from + 1 < nodes.len() {
        let mut to = from + 1;
        let farthest = (from + RUN).min(nodes.len() - 1);
        while to < farthest && replaces(&nodes[from..=to + 1]) {
            to += 1;
        }
        segments.push(segment(nodes[from], nodes[to]));
        from = to;
    }
    trim_caps(&mut segments);
    segments
}

/// Leaves out what neighbours draw anyway: where a line of even width runs on at a small turn, the round cap lies inside the
/// next segment but for a wedge outside the turn. Without this, broad lines of short segments would be drawn many times over.
fn trim_caps(segments: &mut [Segment]) {
    for i in 1..segments.len() {
        let (before, after) = (&segments[i - 1], &segments[i]);
        let (Some([px, py]), Some([qx, qy])) = (before.even_direction(), after.even_direction()) else { continue };
        let (cosine, sine) = (px * qx + py * qy, (px * qy - py * qx).abs());
        if cosine > 0.7 {
            // The wedge, and a pixel for the edge's anti-aliasing.
            let cap = sine * (after.a.radius + 0.5) + 1.0;
            segments[i - 1].caps[1] = cap;
            segments[i].caps[0] = cap;
        }
    }
}

impl Segment {
    /// Unit direction, if the segment has one and its width changes little.
    fn even_direction(&self) -> Option<[f32; 2]> {
        let Self { a, b, .. } = self;
        let (lx, ly) = (b.x - a.x, b.y - a.y);
        let length = (lx * lx + ly * ly).sqrt();
        (length > 1e-3 && (b.radius - a.radius).abs() < 0.1 * length).then(|| [lx / length, ly / length])
    }
}

/// Whether one segment from the first node to the last looks like them all.
fn replaces(nodes: &[Node]) -> bool {
    let [a, between @ .., b] = nodes else { return false };
    let (lx, ly) = (b.x - a.x, b.y - a.y);
    let length = (lx * lx + ly * ly).sqrt();
    // A chain that doubles back is longer than its chord.
    if length < 1e-3 || b.arc - a.arc > length + TOLERANCE {
        return false;
    }
    between.iter().all(|n| {
        let (dx, dy) = (n.x - a.x, n.y - a.y);
        let t = (dx * lx + dy * ly) / (length * length);
        let off = |from: f32, to: f32, value: f32| (value - (from + t * (to - from))).abs();
        (dx * ly - dy * lx).abs() <= TOLERANCE * length
            && off(a.radius, b.radius, n.radius) <= TOLERANCE / 2.0
            && off(a.density, b.density, n.density) <= DENSITY_TOLERANCE
    })
}

/// Which segments touch which tile, in the order of the trace.
struct Bins {
    columns: usize,
    /// Where each tile's indices start; one more than there are tiles.
    starts: Vec<u32>,
    indices: Vec<u32>,
}

impl Bins {
    /// Sorts by counting: once to know how many, once to place.
    fn new(segments: &[Segment], columns: usize, rows: usize) -> Self {
        let mut starts = vec![0u32; columns * rows + 1];
        for segment in segments {
            Self::tiles(segment, columns, rows, |tile| starts[tile + 1] += 1);
        }
        for tile in 1..starts.len() {
            starts[tile] += starts[tile - 1];
        }
        let mut next = starts.clone();
        let mut indices = vec![0; starts[columns * rows] as usize];
        for (i, segment) in segments.iter().enumerate() {
            Self::tiles(segment, columns, rows, |tile| {
                indices[next[tile] as usize] = i as u32;
                next[tile] += 1;
            });
        }
        Self { columns, starts, indices }
    }

    /// The tiles that a segment may touch.
    fn tiles(segment: &Segment, columns: usize, rows: usize, mut found: impl FnMut(usize)) {
        let Segment { a, b, .. } = segment;
        let reach = a.radius.max(b.radius) + 0.5;
        let range = |low: f32, high: f32, count: usize| {
            // Casts clamp: what lies off the picture has an empty range or ends at its edge.
            let first = ((low - reach).max(0.0) / TILE as f32) as usize;
            let end = if high + reach < 0.0 { 0 } else { ((high + reach) / TILE as f32) as usize + 1 };
            first..end.min(count)
        };
        let across = range(a.x.min(b.x), a.x.max(b.x), columns);
        let (lx, ly) = (b.x - a.x, b.y - a.y);
        let length = (lx * lx + ly * ly).sqrt();
        let circumradius = TILE as f32 * std::f32::consts::FRAC_1_SQRT_2 + reach + 0.5;
        for row in range(a.y.min(b.y), a.y.max(b.y), rows) {
            for column in across.clone() {
                let centre = |i: usize| (i as f32 + 0.5) * TILE as f32;
                let off_axis = ((centre(column) - a.x) * ly - (centre(row) - a.y) * lx).abs();
                if off_axis <= circumradius * length || length < TILE as f32 {
                    found(row * columns + column);
                }
            }
        }
    }

    fn of(&self, column: usize, row: usize) -> &[u32] {
        let tile = row * self.columns + column;
        &self.indices[self.starts[tile] as usize..self.starts[tile + 1] as usize]
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
struct Tile {
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
    fn new() -> Self {
        let pixels = TILE * TILE;
        Self { left: 0.0, top: 0.0, wet: vec![Wet::default(); pixels], light: vec![[1.0; 3]; pixels], touched: NOTHING }
    }

    /// Fresh paper, whose top left corner is here, px. There is no wet ink: every stroke ends by drying.
    fn clear(&mut self, left: f32, top: f32) {
        (self.left, self.top) = (left, top);
        self.light.fill([1.0; 3]);
    }

    /// Lays a segment of the current stroke.
    fn draw(&mut self, segment: &Segment, ink: &Absorber) {
        let (mut a, mut b) = (segment.a, segment.b);
        let growth = b.radius - a.radius;
        let mut length = (b.x - a.x).hypot(b.y - a.y);
        if growth.abs() >= length {
            // One end lies within the other, or both are one point: a dot.
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
    fn dry(&mut self, ink: &Absorber) {
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
    fn show(&self, colours: &Colours, band: &mut [u8], width: usize, left: usize) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ink::optics::srgb_from_linear;
    use crate::ink::{InkPoint, TraceInk};
    use nalgebra::{Point2, Point3, Vector3};
    use proptest::prelude::*;
    use rayon::ThreadPoolBuilder;

    const BLACK: Rgb = Rgb([0, 0, 0]);
    const BLUE: Rgb = Rgb([40, 80, 200]);

    /// A stroke through points in mm, of one width in mm.
    fn stroke(ink: u32, width: f64, points: &[(f64, f64)]) -> InkStroke {
        let point = |&(x, y): &(f64, f64)| InkPoint {
            position: Point3::new(x * 1e-3, y * 1e-3, 0.0),
            normal: Vector3::z(),
            sheet: Point2::new(x * 1e-3, y * 1e-3),
            width: width * 1e-3,
            density: 1.0,
            time: 0.0,
        };
        InkStroke { ink, stroke: None, arm: 0, points: points.iter().map(point).collect() }
    }

    fn trace(strokes: Vec<InkStroke>) -> InkTrace {
        let ink = |color| TraceInk { name: "ink".to_string(), color };
        InkTrace { inks: vec![ink(BLACK), ink(BLUE)], strokes }
    }

    /// A sheet of 20 mm x 10 mm at 16 px/mm.
    fn picture(strokes: Vec<InkStroke>) -> Image {
        let options = RasterOptions { width: 0.02, height: 0.01, px_per_mm: 16.0, paper: PAPER };
        rasterise(&trace(strokes), &options).unwrap()
    }

    /// The pixel at a place on the sheet, mm.
    fn at(image: &Image, x: f64, y: f64) -> Rgb {
        image.pixel(((x + 10.0) * 16.0) as u32, ((5.0 - y) * 16.0) as u32).unwrap()
    }

    /// Inked area in mm^2: how much of the paper's light is gone, as a share of what full ink takes.
    fn area(image: &Image, ink: Rgb, px_per_mm: f64) -> f64 {
        let light = |v: u8| linear_from_srgb(v);
        let full = light(PAPER.0[0]) - light(ink.0[0]);
        let gone: f64 = image.bytes().chunks(3).map(|p| light(PAPER.0[0]) - light(p[0])).sum();
        gone / full / (px_per_mm * px_per_mm)
    }

    #[test]
    fn a_line_shows_its_inks_colour_and_leaves_the_rest_paper() {
        let image = picture(vec![stroke(1, 0.8, &[(-8.0, 0.3), (8.0, 0.3)])]);
        assert_eq!(at(&image, 0.0, 0.3), BLUE);
        assert_eq!(at(&image, 0.0, 0.8), PAPER);
        assert_eq!(at(&image, 8.6, 0.3), PAPER);
        assert_eq!(at(&image, 8.3, 0.3), BLUE, "a round cap");
        assert_eq!(at(&image, 0.0, -0.3), PAPER, "y is up");
    }

    #[test]
    fn crossings_darken_and_joints_do_not() {
        let corner = stroke(1, 0.8, &[(-8.0, 2.0), (-4.0, 2.0), (-4.0, -2.0), (-2.0, 3.0)]);
        let cross = [stroke(1, 0.8, &[(2.0, 0.0), (8.0, 0.0)]), stroke(1, 0.8, &[(5.0, -3.0), (5.0, 3.0)])];
        let looped = stroke(1, 0.8, &[(0.0, -4.5), (0.0, 4.0), (3.0, 4.0), (3.0, -3.0), (-1.0, -3.0)]);
        let image = picture([corner, looped].into_iter().chain(cross).collect());
        for joint in [(-4.0, 2.0), (-4.3, 2.3), (-3.7, 1.7), (-4.0, -2.0), (-3.8, -1.6), (0.0, 4.0), (3.0, -3.0)] {
            assert_eq!(at(&image, joint.0, joint.1), BLUE, "the joint at {joint:?}");
        }
        let a = absorbance(BLUE, PAPER);
        let twice: Vec<u8> =
            (0..3).map(|k| srgb_from_linear(linear_from_srgb(PAPER.0[k]) * (-2.0 * a[k]).exp())).collect();
        for crossing in [(5.0, 0.0), (0.0, -3.0)] {
            assert_eq!(at(&image, crossing.0, crossing.1).0[..], twice[..], "the crossing at {crossing:?}");
        }
    }

    #[test]
    fn two_inks_absorb_one_after_the_other_in_any_order() {
        let (a, b) = (stroke(0, 0.8, &[(-5.0, 0.0), (5.0, 0.0)]), stroke(1, 0.8, &[(0.0, -3.0), (0.0, 3.0)]));
        let (one, other) = (picture(vec![a.clone(), b.clone()]), picture(vec![b, a]));
        assert_eq!(one, other);
        assert_eq!(at(&one, 0.0, 0.0), BLACK);
    }

    #[test]
    fn a_fading_line_grows_lighter() {
        let mut fading = stroke(0, 0.8, &[(-8.0, 0.0), (8.0, 0.0)]);
        fading.points[1].density = 0.0;
        let image = picture(vec![fading]);
        let values: Vec<u8> = (-7..8).map(|x| at(&image, f64::from(x), 0.0).0[0]).collect();
        assert!(values.windows(2).all(|v| v[1] >= v[0]) && values[14] > 150 && values[0] < 20, "{values:?}");
    }

    #[test]
    fn trimming_caps_changes_nothing_that_can_be_seen() {
        let points: Vec<(f64, f64)> = (0..=600)
            .map(|i| f64::from(i) * 0.02)
            .map(|a| (1.2 * a - 7.0 + 2.0 * (2.1 * a).sin(), 3.5 * (1.3 * a).cos()))
            .collect();
        let options = RasterOptions { width: 0.02, height: 0.01, px_per_mm: 16.0, paper: PAPER };
        for width in [0.2, 0.8, 1.6] {
            let mut line = stroke(1, width, &points);
            for (i, p) in line.points.iter_mut().enumerate() {
                p.width *= 1.0 + 0.3 * (i as f64 * 0.1).sin();
            }
            let mut trimmed = stroke_segments(0, &line, &options);
            // What is a return hangs on the length between visits, which caps change a little.
            trimmed.iter_mut().for_each(|s| s.gap = f32::INFINITY);
            let mut whole = trimmed.clone();
            whole.iter_mut().for_each(|s| s.caps = [f32::INFINITY; 2]);
            assert!(trimmed.iter().any(|s| s.caps[0] < s.a.radius) || width < 0.5);
            let size = options.size().unwrap();
            let trace = trace(vec![line]);
            let [a, b] = [trimmed, whole].map(|s| paint(&s, &trace, &options, size).unwrap());
            let worst = a.bytes().iter().zip(b.bytes()).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(worst <= Some(2), "{width} mm: {worst:?}");
        }
    }

    #[test]
    fn a_blot_is_round_where_a_line_leaves_it() {
        let mut blot = stroke(1, 0.5, &[(0.0, 0.0), (0.1, 0.0), (3.0, 0.0)]);
        blot.points[0].width = 3e-3;
        let image = picture(vec![blot]);
        for degrees in (0..360).step_by(15) {
            let (y, x) = f64::from(degrees).to_radians().sin_cos();
            assert_eq!(at(&image, 1.4 * x, 1.4 * y), BLUE, "inside at {degrees} degrees");
            if degrees > 20 && degrees < 340 {
                assert_eq!(at(&image, 1.6 * x, 1.6 * y), PAPER, "outside at {degrees} degrees");
            }
        }
    }

    #[test]
    fn a_widening_line_has_the_area_of_its_outline() {
        let mut cone = stroke(1, 1.0, &[(-6.0, 0.2), (5.0, -0.3)]);
        cone.points[1].width = 4e-3;
        let (a, b, length) = (0.5f64, 2.0f64, 11.0f64.hypot(0.5));
        // Two sectors and a trapezium, joined where the common tangents touch; `lean` is the tangents' slope.
        let lean = ((b - a) / length).asin();
        let half = std::f64::consts::FRAC_PI_2;
        let wished = a * a * (half - lean) + b * b * (half + lean) + (a + b) * length * lean.cos();
        let got = area(&picture(vec![cone]), BLUE, 16.0);
        assert!((got / wished - 1.0).abs() < 0.005, "{got} mm^2 of {wished}");
    }

    #[test]
    fn the_area_of_a_line_is_its_width_times_its_length() {
        for (width, angle) in [(0.1, 0.0), (0.4, 0.3), (0.8, 0.785), (0.8, 1.2), (1.5, 1.5707)] {
            let (dx, dy) = (40.0 * f64::cos(angle), 40.0 * f64::sin(angle));
            let points: Vec<(f64, f64)> =
                (0..=400).map(|i| (f64::from(i) / 200.0 - 1.0, 0.013)).map(|(t, o)| (t * dx + o, t * dy)).collect();
            let options = RasterOptions::with_long_side(0.1, 0.1, 1000);
            let image = rasterise(&trace(vec![stroke(1, width, &points)]), &options).unwrap();
            let wished = 80.0 * width + std::f64::consts::FRAC_PI_4 * width * width;
            let got = area(&image, BLUE, options.px_per_mm);
            assert!((got / wished - 1.0).abs() < 0.005, "{width} mm at {angle} rad: {got} mm^2 of {wished}");
        }
    }

    #[test]
    fn the_picture_is_the_same_at_any_number_of_threads_and_points_on_a_line_may_be_many() {
        let spiral = |n: u32, ink| {
            let points: Vec<(f64, f64)> = (0..=n)
                .map(|i| 60.0 * f64::from(i) / f64::from(n))
                .map(|a| (0.07 * a * a.cos(), 0.07 * a * a.sin()))
                .collect();
            stroke(ink, 0.3, &points)
        };
        let strokes = vec![spiral(5000, 0), stroke(1, 2.0, &[(-9.0, -4.0), (12.0, 4.0)]), spiral(900, 1)];
        let with = |threads| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| picture(strokes.clone()))
        };
        let one = with(1);
        assert!(one == with(2) && one == with(3));
        let dense = picture(vec![stroke(0, 0.8, &(0..=999).map(|i| (f64::from(i) * 0.01, 1.0)).collect::<Vec<_>>())]);
        assert_eq!(dense, picture(vec![stroke(0, 0.8, &[(0.0, 1.0), (9.99, 1.0)])]));
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        let options = RasterOptions { width: 0.1, height: 0.0, px_per_mm: 10.0, paper: PAPER };
        assert!(matches!(rasterise(&trace(vec![]), &options), Err(InkError::Size { .. })));
        let options = RasterOptions::with_long_side(0.2, 0.1, 100);
        assert_eq!(options.size().unwrap(), (100, 50));
        let alien = rasterise(&trace(vec![stroke(7, 0.8, &[(0.0, 0.0)])]), &options).unwrap_err();
        assert_eq!(alien.to_string(), "stroke 0 of the trace is drawn in ink 7, but the trace has 2 inks");
        let nowhere = trace(vec![stroke(0, 0.8, &[(0.0, 0.0), (f64::NAN, 0.0)])]);
        assert!(matches!(rasterise(&nowhere, &options), Err(InkError::BadPoint { stroke: 0, point: 1 })));
    }

    proptest! {
        #[test]
        fn any_finite_stroke_can_be_drawn(
            points in proptest::collection::vec((-1e5..1e5f64, -100.0..100.0f64), 1..20), width in 0.0..50.0f64,
        ) {
            let image = picture(vec![stroke(0, width, &points)]);
            prop_assert_eq!((image.width(), image.height()), (320, 160));
        }
    }
}
