//! The lines of a trace as segments in picture coordinates, and which tile sees which.
use crate::ink::{InkStroke, RasterOptions};

/// Side of a tile, px. A tile's buffers (24 bytes a pixel) stay in the second-level cache.
pub(super) const TILE: usize = 64;

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

/// An end of a segment in picture coordinates: px, x right, y down, from the top left corner.
#[derive(Clone, Copy)]
pub(super) struct Node {
    pub(super) x: f32,
    pub(super) y: f32,
    /// Half the width of the line, px.
    pub(super) radius: f32,
    pub(super) density: f32,
    /// Length of the stroke up to here, px.
    pub(super) arc: f32,
}

/// A round-capped piece of a line.
#[derive(Clone, Copy)]
pub(super) struct Segment {
    pub(super) a: Node,
    pub(super) b: Node,
    /// How far it is drawn beyond `a` and `b`, px; a whole round cap unless the neighbour covers it.
    pub(super) caps: [f32; 2],
    /// A return to a pixel after more than this length, px, is a crossing and not a joint.
    pub(super) gap: f32,
    pub(super) stroke: u32,
    pub(super) ink: u32,
}

/// The segments of a stroke: neighbours on a straight line of even width and density made one.
pub(super) fn stroke_segments(index: u32, stroke: &InkStroke, options: &RasterOptions) -> Vec<Segment> {
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
pub(super) struct Bins {
    pub(super) columns: usize,
    /// Where each tile's indices start; one more than there are tiles.
    starts: Vec<u32>,
    indices: Vec<u32>,
}

impl Bins {
    /// Sorts by counting: once to know how many, once to place.
    pub(super) fn new(segments: &[Segment], columns: usize, rows: usize) -> Self {
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

    pub(super) fn of(&self, column: usize, row: usize) -> &[u32] {
        let tile = row * self.columns + column;
        &self.indices[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }
}
