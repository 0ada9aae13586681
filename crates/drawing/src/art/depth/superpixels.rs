//! Superpixels: small regions of one colour that keep to the picture's edges.
//!
//! Simple linear iterative clustering (Achanta et al., "SLIC superpixels compared to state-of-the-art superpixel methods",
//! 2012, doi:10.1109/TPAMI.2012.120) in Oklab.
use rayon::prelude::*;

/// Oklab lightness runs over 0..=1, the CIELAB lightness that compactness is commonly given for over 0..=100.
const LAB_SCALE: f32 = 100.0;
/// Rows that one task sums up. It is fixed, so that the sums are the same at any thread count.
const ROWS: usize = 32;
/// No superpixel is near.
const NONE: u32 = u32::MAX;

/// How superpixels are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlicOptions {
    /// Desired number of superpixels in the picture.
    pub count: usize,
    /// Weight of the distance in the plane against the distance in colour: 1 follows the finest edges, 40 gives squares.
    pub compactness: f32,
    /// Rounds of assignment and update.
    pub iterations: usize,
}

impl Default for SlicOptions {
    fn default() -> Self {
        Self { count: 1000, compactness: 10.0, iterations: 8 }
    }
}

/// One superpixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Superpixel {
    /// Centroid, px from the left.
    pub x: f64,
    /// Centroid, px from the top.
    pub y: f64,
    /// Number of pixels.
    pub area: usize,
    /// Mean colour, Oklab.
    pub lab: [f32; 3],
    /// The region that it lies in; 0 where none were given.
    pub region: u16,
}

/// A picture cut into superpixels, each one connected over pixel sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Superpixels {
    /// `width * height` indices into `cells`, row by row.
    pub labels: Vec<u32>,
    /// The superpixels, in the order of their first pixels.
    pub cells: Vec<Superpixel>,
}

/// Pixels in Oklab, row by row.
#[derive(Clone, Copy)]
struct Pixels<'a> {
    lab: &'a [[f32; 3]],
    width: usize,
    height: usize,
}

#[derive(Clone, Copy)]
struct Center {
    x: f32,
    y: f32,
    lab: [f32; 3],
    region: u16,
}

/// Cuts a picture of `width` columns into superpixels; `lab` holds its pixels in Oklab, row by row. With `regions` (one
/// number a pixel) no superpixel reaches over a region's border. A picture without pixels has none.
pub fn slic(lab: &[[f32; 3]], width: usize, regions: Option<&[u16]>, options: &SlicOptions) -> Superpixels {
    let height = lab.len().checked_div(width).unwrap_or(0);
    if height == 0 {
        return Superpixels { labels: Vec::new(), cells: Vec::new() };
    }
    let region = |i: usize| regions.and_then(|r| r.get(i)).copied().unwrap_or(0);
    let step = ((lab.len() as f64 / options.count.max(1) as f64).sqrt() as f32).max(1.0);
    let mut centers = seeds(lab, width, height, step, &region);
    let mut labels = vec![NONE; lab.len()];
    for _ in 0..options.iterations.max(1) {
        assign(Pixels { lab, width, height }, step, options.compactness, &region, &centers, &mut labels);
        update(lab, width, &labels, &mut centers);
    }
    let smallest = ((step * step * 0.25) as usize).max(1);
    connect(lab, width, height, &region, &labels, smallest)
}

/// Centres on a grid, each moved to the flattest of its nine pixels so that it starts on no edge.
fn seeds(
    lab: &[[f32; 3]],
    width: usize,
    height: usize,
    step: f32,
    region: &(impl Fn(usize) -> u16 + Sync),
) -> Vec<Center> {
    let slope = |x: usize, y: usize| {
        let at = |x: usize, y: usize| lab[y * width + x];
        let (l, r) = (at(x.saturating_sub(1), y), at((x + 1).min(width - 1), y));
        let (u, d) = (at(x, y.saturating_sub(1)), at(x, (y + 1).min(height - 1)));
        distance2(l, r) + distance2(u, d)
    };
    let (columns, rows) =
        (((width as f32 / step).round() as usize).max(1), ((height as f32 / step).round() as usize).max(1));
    let mut centers = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        for column in 0..columns {
            let x = ((column as f32 + 0.5) * width as f32 / columns as f32) as usize;
            let y = ((row as f32 + 0.5) * height as f32 / rows as f32) as usize;
            let (x, y) = (x.min(width - 1), y.min(height - 1));
            let mut best = (x, y, slope(x, y));
            for ny in y.saturating_sub(1)..=(y + 1).min(height - 1) {
                for nx in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                    let s = slope(nx, ny);
                    if s < best.2 {
                        best = (nx, ny, s);
                    }
                }
            }
            let i = best.1 * width + best.0;
            centers.push(Center { x: best.0 as f32, y: best.1 as f32, lab: lab[i], region: region(i) });
        }
    }
    centers
}

fn distance2(a: [f32; 3], b: [f32; 3]) -> f32 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

/// Gives each pixel the nearest centre in colour and place, among those of its region within a step.
fn assign(
    Pixels { lab, width, height }: Pixels,
    step: f32,
    compactness: f32,
    region: &(impl Fn(usize) -> u16 + Sync),
    centers: &[Center],
    labels: &mut [u32],
) {
    let (columns, rows) = ((width as f32 / step) as usize + 1, (height as f32 / step) as usize + 1);
    let mut buckets: Vec<Vec<u32>> = vec![Vec::new(); columns * rows];
    for (i, c) in centers.iter().enumerate() {
        let (column, row) = ((c.x / step) as usize, (c.y / step) as usize);
        buckets[row.min(rows - 1) * columns + column.min(columns - 1)].push(i as u32);
    }
    let nearness = (compactness / step / LAB_SCALE).powi(2);
    labels.par_chunks_mut(width).enumerate().for_each(|(y, line)| {
        let row = ((y as f32 / step) as usize).min(rows - 1);
        for (x, label) in line.iter_mut().enumerate() {
            let column = ((x as f32 / step) as usize).min(columns - 1);
            let i = y * width + x;
            let (color, own) = (lab[i], region(i));
            let mut best = (f32::INFINITY, NONE);
            for r in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
                for bucket in
                    &buckets[r * columns + column.saturating_sub(1)..=r * columns + (column + 1).min(columns - 1)]
                {
                    for at in bucket {
                        let c = &centers[*at as usize];
                        if c.region != own {
                            continue;
                        }
                        let (dx, dy) = (c.x - x as f32, c.y - y as f32);
                        let d = distance2(color, c.lab) + nearness * (dx * dx + dy * dy);
                        if d < best.0 || (d == best.0 && *at < best.1) {
                            best = (d, *at);
                        }
                    }
                }
            }
            *label = best.1;
        }
    });
}

/// Moves each centre to the mean of its pixels.
fn update(lab: &[[f32; 3]], width: usize, labels: &[u32], centers: &mut [Center]) {
    type Sums = Vec<(u32, [f64; 6])>;
    let chunk = ROWS * width;
    let parts: Vec<Sums> = labels
        .par_chunks(chunk)
        .enumerate()
        .map(|(part, labels)| {
            let mut slot = std::collections::BTreeMap::new();
            let mut sums: Sums = Vec::new();
            let mut last = (NONE, 0);
            for (i, label) in labels.iter().enumerate().filter(|(_, l)| **l != NONE) {
                if last.0 != *label {
                    let at = *slot.entry(*label).or_insert_with(|| {
                        sums.push((*label, [0.0; 6]));
                        sums.len() - 1
                    });
                    last = (*label, at);
                }
                let at = part * chunk + i;
                let (p, s) = (lab[at], &mut sums[last.1].1);
                let values = [(at % width) as f64, (at / width) as f64, p[0].into(), p[1].into(), p[2].into(), 1.0];
                s.iter_mut().zip(values).for_each(|(s, v)| *s += v);
            }
            sums
        })
        .collect();
    let mut total = vec![[0.0; 6]; centers.len()];
    for (label, sums) in parts.into_iter().flatten() {
        total[label as usize].iter_mut().zip(sums).for_each(|(t, s)| *t += s);
    }
    for (c, t) in centers.iter_mut().zip(total).filter(|(_, t)| t[5] > 0.0) {
        let mean = |i: usize| (t[i] / t[5]) as f32;
        *c = Center { x: mean(0), y: mean(1), lab: [mean(2), mean(3), mean(4)], region: c.region };
    }
}

/// Connected pieces; those smaller than `smallest` join the neighbour in their region with which they share the longest
/// border.
fn connect(
    lab: &[[f32; 3]],
    width: usize,
    height: usize,
    region: &impl Fn(usize) -> u16,
    labels: &[u32],
    smallest: usize,
) -> Superpixels {
    let neighbours = |i: usize| {
        let (x, y) = (i % width, i / width);
        [
            (x > 0).then(|| i - 1),
            (x + 1 < width).then_some(i + 1),
            (y > 0).then(|| i - width),
            (y + 1 < height).then_some(i + width),
        ]
        .into_iter()
        .flatten()
    };
    let mut piece = vec![NONE; labels.len()];
    let mut pixels: Vec<usize> = Vec::with_capacity(labels.len());
    let mut pieces: Vec<std::ops::Range<usize>> = Vec::new();
    for first in 0..labels.len() {
        if piece[first] != NONE {
            continue;
        }
        let (id, start) = (pieces.len() as u32, pixels.len());
        piece[first] = id;
        pixels.push(first);
        let mut next = start;
        while let Some(&i) = pixels.get(next) {
            next += 1;
            for n in neighbours(i) {
                if piece[n] == NONE && labels[n] == labels[i] && region(n) == region(i) {
                    piece[n] = id;
                    pixels.push(n);
                }
            }
        }
        pieces.push(start..pixels.len());
    }
    let mut owner: Vec<u32> = (0..pieces.len() as u32).collect();
    let mut area: Vec<usize> = pieces.iter().map(|p| p.len()).collect();
    for id in 0..pieces.len() {
        let own = root(&mut owner, id as u32);
        if area[own as usize] >= smallest {
            continue;
        }
        // A small piece has few neighbours: a list is quicker than a map.
        let mut shared: Vec<(u32, usize)> = Vec::new();
        for &i in &pixels[pieces[id].clone()] {
            for n in neighbours(i).filter(|n| region(*n) == region(i)) {
                let other = root(&mut owner, piece[n]);
                if other != own {
                    match shared.iter_mut().find(|s| s.0 == other) {
                        Some(s) => s.1 += 1,
                        None => shared.push((other, 1)),
                    }
                }
            }
        }
        if let Some((other, _)) = shared.into_iter().max_by_key(|(other, border)| (*border, std::cmp::Reverse(*other)))
        {
            owner[own as usize] = other;
            area[other as usize] += area[own as usize];
        }
    }
    let mut name = vec![NONE; pieces.len()];
    let mut sums: Vec<([f64; 5], usize, u16)> = Vec::new();
    let mut joined = vec![0; labels.len()];
    for (i, joined) in joined.iter_mut().enumerate() {
        let own = root(&mut owner, piece[i]) as usize;
        if name[own] == NONE {
            name[own] = sums.len() as u32;
            sums.push(([0.0; 5], 0, region(i)));
        }
        *joined = name[own];
        let (sum, count, _) = &mut sums[name[own] as usize];
        let (p, x, y) = (lab[i], (i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        sum.iter_mut().zip([x, y, p[0].into(), p[1].into(), p[2].into()]).for_each(|(s, v)| *s += v);
        *count += 1;
    }
    let cell = |(sum, area, region): ([f64; 5], usize, u16)| {
        let m = sum.map(|s| s / area as f64);
        Superpixel { x: m[0], y: m[1], area, lab: [m[2] as f32, m[3] as f32, m[4] as f32], region }
    };
    Superpixels { labels: joined, cells: sums.into_iter().map(cell).collect() }
}

/// The piece that a piece has joined, directly or through others.
fn root(owner: &mut [u32], mut id: u32) -> u32 {
    while owner[id as usize] != id {
        owner[id as usize] = owner[owner[id as usize] as usize];
        id = owner[id as usize];
    }
    id
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Pixels reached from the first one of each superpixel over pixel sides.
    fn reached(s: &Superpixels, width: usize) -> usize {
        let height = s.labels.len() / width;
        let mut seen = vec![false; s.labels.len()];
        let mut started = vec![false; s.cells.len()];
        let mut count = 0;
        for first in 0..s.labels.len() {
            if std::mem::replace(&mut started[s.labels[first] as usize], true) {
                continue;
            }
            let mut todo = vec![first];
            seen[first] = true;
            while let Some(i) = todo.pop() {
                count += 1;
                let (x, y) = (i % width, i / width);
                let around = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
                for (nx, ny) in around.into_iter().filter(|n| n.0 < width && n.1 < height) {
                    let n = ny * width + nx;
                    if !seen[n] && s.labels[n] == s.labels[i] {
                        seen[n] = true;
                        todo.push(n);
                    }
                }
            }
        }
        count
    }

    proptest! {
        #[test]
        fn superpixels_cover_the_picture_and_are_connected(
            width in 1usize..50, height in 1usize..50, count in 1usize..80, noise in any::<u64>(), striped in any::<bool>(),
        ) {
            let value = |i: usize| ((noise.rotate_left(i as u32 % 64) ^ i as u64) % 251) as f32 / 250.0;
            let lab: Vec<[f32; 3]> = (0..width * height).map(|i| [value(i), value(i + 7) * 0.1, 0.0]).collect();
            let regions: Vec<u16> = (0..width * height).map(|i| u16::from(striped && (i % width) % 9 < 3)).collect();
            let s = slic(&lab, width, Some(&regions), &SlicOptions { count, ..SlicOptions::default() });
            prop_assert_eq!(s.labels.len(), width * height);
            prop_assert_eq!(s.cells.iter().map(|c| c.area).sum::<usize>(), width * height);
            prop_assert_eq!(reached(&s, width), width * height);
            for (label, region) in s.labels.iter().zip(&regions) {
                prop_assert_eq!(s.cells[*label as usize].region, *region);
            }
        }
    }

    #[test]
    fn superpixels_keep_to_an_edge_and_are_as_many_as_desired() {
        let (width, height) = (120, 90);
        let lab: Vec<[f32; 3]> =
            (0..width * height).map(|i| if i % width < 47 { [0.2, 0.0, 0.0] } else { [0.8, 0.0, 0.05] }).collect();
        let s = slic(&lab, width, None, &SlicOptions { count: 108, ..SlicOptions::default() });
        assert!((80..140).contains(&s.cells.len()), "{}", s.cells.len());
        for (i, label) in s.labels.iter().enumerate() {
            assert!((s.cells[*label as usize].lab[0] < 0.5) == (i % width < 47));
        }
    }

    #[test]
    fn any_thread_count_gives_the_same_superpixels() {
        let lab: Vec<[f32; 3]> = (0..200 * 150).map(|i| [(i * 7919 % 257) as f32 / 256.0, 0.0, 0.1]).collect();
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| slic(&lab, 200, None, &SlicOptions::default()))
        };
        assert_eq!(run(1), run(4));
    }
}
