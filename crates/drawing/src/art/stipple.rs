//! Stippling: a density becomes points, each of which stands for the same ink.
//!
//! Weighted Linde-Buzo-Gray stippling (Deussen, Spicker, Zheng 2017, doi:10.1145/3130800.3130819): cells with too much ink
//! split, cells with too little merge with their neighbours, and sites move to the centroids of their cells. Then the cells
//! become those of a power diagram whose powers are raised where ink is missing and lowered where there is too much (after
//! de Goes et al. 2012, doi:10.1145/2366145.2366190, with one Jacobi step a round), until all hold the same ink: what makes
//! the tone of the dots the tone of the picture.
use std::borrow::Cow;

use rayon::join;
use rayon::prelude::*;

use crate::art::voronoi::{Cell, Site, cells};
use crate::picture::Plane;

/// Most dots of one stippling.
pub const MAX_DOTS: usize = 4_000_000;

/// Samples that the cells of the darkest parts have at least: with fewer, dots would show the raster.
const SAMPLES: f64 = 10.0;

/// Samples of these cells that are enough: a picture with more is made coarser.
const ENOUGH: f64 = 40.0;

/// Most samples that a picture is made finer to.
const MAX_SAMPLES: usize = 1 << 24;

/// A stippled dot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// Column, px from the picture's left edge: pixel centres are at halves.
    pub x: f64,
    /// Row, px from the picture's top edge.
    pub y: f64,
    /// Ink of the dot's cell in dots: 1 where every dot stands for the same ink.
    pub weight: f64,
}

/// How many dots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DotCount {
    /// As many as the picture needs when a dot has this ink, px of full density.
    Ink(f64),
    /// This many, whatever their ink.
    Points(usize),
}

/// How to stipple.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StippleOptions {
    /// How many dots.
    pub count: DotCount,
    /// Rounds of Linde-Buzo-Gray: split, merge, move.
    pub rounds: usize,
    /// Rounds that equalise the ink of the cells.
    pub equal_rounds: usize,
}

impl StippleOptions {
    /// The options for as many dots, with the usual rounds.
    pub fn new(count: DotCount) -> Self {
        Self { count, rounds: 5, equal_rounds: 12 }
    }
}

/// Dots whose local number follows the density (desired ink of each pixel, 0..=1; what is not a number above 0 is none).
///
/// The number of dots is the density's sum divided by a dot's ink, rounded, or the number asked for. None lies on a pixel
/// of density 0. The result depends on the seed, not on the number of threads. Empty when there is no ink.
pub fn stipple(density: &Plane, options: &StippleOptions, seed: u64) -> Vec<Dot> {
    let clean = |d: &f32| if d.is_finite() { d.max(0.0) } else { 0.0 };
    let values: Vec<f32> = density.values.iter().map(clean).collect();
    let total: f64 = values.iter().map(|d| f64::from(*d)).sum();
    let darkest = f64::from(values.iter().fold(0.0f32, |a, b| a.max(*b)));
    let count = match options.count {
        DotCount::Ink(ink) if ink > 0.0 => (total / ink).round() as usize,
        DotCount::Ink(_) => 0,
        DotCount::Points(points) => points,
    };
    let count = count.min(MAX_DOTS);
    let Some(plane) = Plane::from_values(density.width(), density.height(), values) else { return Vec::new() };
    if count == 0 || total <= 0.0 {
        return Vec::new();
    }
    let target = total / count as f64;
    let (grid, pixel) = sampled(&plane, target / darkest);
    let mut sites = Vec::with_capacity(count);
    bisect(&grid, Tile { x: 0, y: 0, width: grid.width(), height: grid.height() }, count, hash(seed, 0), &mut sites);
    let mut found = cells(&grid, &sites);
    for round in 0..options.rounds {
        let right = (round + 1 == options.rounds).then_some(count);
        sites = breed(&found, target, round, right, hash(seed, 1 + round as u64));
        found = cells(&grid, &sites);
    }
    for round in 0..options.equal_rounds {
        for (site, cell) in sites.iter_mut().zip(&found) {
            equalise(site, cell, target, round + 1 < options.equal_rounds);
        }
        found = cells(&grid, &sites);
    }
    let dots = sites.iter().zip(&found).map(|(site, cell)| {
        let (x, y) = if cell.ink > 0.0 { (cell.x, cell.y) } else { (f64::from(site.x), f64::from(site.y)) };
        let (x, y) = inked(&plane, x * pixel, y * pixel);
        Dot { x, y, weight: cell.ink / target }
    });
    dots.collect()
}

/// The density on a grid that suits cells which are at least so large, px, and the side of its samples, px.
fn sampled(plane: &Plane, smallest: f64) -> (Cow<'_, Plane>, f64) {
    let pixels = plane.width() * plane.height();
    let most = ((MAX_SAMPLES / pixels.max(1)) as f64).sqrt().floor().max(1.0);
    let finer_by = (SAMPLES / smallest).sqrt().ceil().clamp(1.0, most) as usize;
    let coarser_by = (smallest / ENOUGH).sqrt().floor().max(1.0) as usize;
    if finer_by > 1 {
        (Cow::Owned(finer(plane, finer_by)), 1.0 / finer_by as f64)
    } else if coarser_by > 1 {
        (Cow::Owned(coarser(plane, coarser_by)), coarser_by as f64)
    } else {
        (Cow::Borrowed(plane), 1.0)
    }
}

/// Next round's sites: cells of too little ink go, cells of too much become two, all others move to their centroid.
///
/// A cell splits above `1 + h` dots of ink and goes below `1 - h`, where the hysteresis `h` shrinks from 0.9 to 0.5: what
/// has split doesn't go at once. Where the right number is given, the emptiest cells go or the fullest split until it is
/// reached.
fn breed(found: &[Cell], target: f64, round: usize, right: Option<usize>, seed: u64) -> Vec<Site> {
    let hysteresis = (0.9 - 0.1 * round as f64).max(0.5);
    let offspring = match right {
        Some(right) => selected(found, right),
        None => found
            .iter()
            .map(|c| match c.ink / target {
                ink if ink < 1.0 - hysteresis => 0,
                ink if ink > 1.0 + hysteresis => 2,
                _ => 1,
            })
            .collect(),
    };
    let mut sites = Vec::new();
    for (i, (cell, n)) in found.iter().zip(&offspring).enumerate() {
        let (long, short) = axes(cell);
        let mut push = |a: f64, b: f64| {
            let (x, y) = (cell.x + a * long.0 + b * short.0, cell.y + a * long.1 + b * short.1);
            sites.push(Site { x: x as f32, y: y as f32, power: 0.0 });
        };
        match n {
            0 => {}
            1 => push(0.0, 0.0),
            2 => {
                let turn = 0.25 * (2.0 * unit(hash(seed, i as u64)) - 1.0);
                push(-0.8, -turn);
                push(0.8, turn);
            }
            _ => {
                let random = hash(seed, i as u64);
                (0..u64::from(*n)).for_each(|k| {
                    push(2.0 * unit(hash(random, 2 * k)) - 1.0, 2.0 * unit(hash(random, 2 * k + 1)) - 1.0);
                });
            }
        }
    }
    sites
}

/// How many sites follow each cell, so that there are `right`: the emptiest have none, or the fullest two or more.
fn selected(found: &[Cell], right: usize) -> Vec<u32> {
    let mut order: Vec<usize> = (0..found.len()).collect();
    order.sort_by(|a, b| found[*a].ink.total_cmp(&found[*b].ink).then(a.cmp(b)));
    let mut offspring = vec![1; found.len()];
    for i in order.iter().take(found.len().saturating_sub(right)) {
        offspring[*i] = 0;
    }
    let full = order.iter().rev().filter(|i| found[**i].ink > 0.0).cycle();
    for i in full.take(right.saturating_sub(found.len())) {
        offspring[*i] += 1;
    }
    offspring
}

/// Standard deviations of a cell's ink along its principal axes, as vectors.
fn axes(cell: &Cell) -> ((f64, f64), (f64, f64)) {
    let (mean, half) = ((cell.xx + cell.yy) / 2.0, (cell.xx - cell.yy) / 2.0);
    let spread = half.hypot(cell.xy);
    // a cell of one sample still has that sample's size
    let deviation = |variance: f64| variance.max(1.0 / 12.0).sqrt();
    let (sin, cos) = (0.5 * cell.xy.atan2(half)).sin_cos();
    let (long, short) = (deviation(mean + spread), deviation(mean - spread));
    ((long * cos, long * sin), (-short * sin, short * cos))
}

/// Moves a site to its centroid and its power to what would give the cell the ink of a dot.
///
/// In a honeycomb of spacing `d` and density `rho`, a site's ink grows by `sqrt(3) rho` per unit of power, while its six
/// neighbours lose it. A Jacobi step overshoots by up to 1.5 in that graph, hence the damping.
fn equalise(site: &mut Site, cell: &Cell, target: f64, shift: bool) {
    if cell.ink <= 0.0 {
        site.power = 0.0;
        return;
    }
    let spacing2 = 2.0 / 3f64.sqrt() * target / cell.density;
    let step = 0.5 * (target - cell.ink) / (3f64.sqrt() * cell.density);
    let power = f64::from(site.power) + step.clamp(-0.25 * spacing2, 0.25 * spacing2);
    site.power = power.clamp(-spacing2, spacing2) as f32;
    if shift {
        (site.x, site.y) = (cell.x as f32, cell.y as f32);
    }
}

/// The place, or the nearest place on a pixel with ink.
fn inked(plane: &Plane, x: f64, y: f64) -> (f64, f64) {
    let (width, height) = (plane.width() as isize, plane.height() as isize);
    let (column, row) = ((x as isize).min(width - 1), (y as isize).min(height - 1));
    let ink =
        |i: isize, j: isize| i >= 0 && j >= 0 && i < width && j < height && plane.at(i as usize, j as usize) > 0.0;
    if ink(column, row) {
        return (x, y);
    }
    let mut best = (f64::INFINITY, x, y);
    let mut ring = 1;
    // a ring's pixels are at least `ring - 1` away
    while (ring - 1) as f64 <= best.0 && ring <= width.max(height) {
        for j in row - ring..=row + ring {
            let step = if (j - row).abs() == ring { 1 } else { 2 * ring };
            for i in (column - ring..=column + ring).step_by(step as usize) {
                if ink(i, j) {
                    let (px, py) =
                        (x.clamp(i as f64 + 0.01, i as f64 + 0.99), y.clamp(j as f64 + 0.01, j as f64 + 0.99));
                    let d = (px - x).hypot(py - y);
                    if d < best.0 {
                        best = (d, px, py);
                    }
                }
            }
        }
        ring += 1;
    }
    (best.1, best.2)
}

/// The density on a grid `zoom` times finer: bilinear, but with each pixel's ink kept.
fn finer(plane: &Plane, zoom: usize) -> Plane {
    let width = plane.width() * zoom;
    let mut values = vec![0.0f32; width * plane.height() * zoom];
    values.par_chunks_mut(width * zoom).enumerate().for_each(|(row, band)| {
        let mut patch = vec![0.0f32; zoom * zoom];
        for column in 0..plane.width() {
            let ink = plane.at(column, row);
            if ink <= 0.0 {
                continue;
            }
            let at = |k: usize, i: usize| k as f64 + (i as f64 + 0.5) / zoom as f64;
            for (k, v) in patch.iter_mut().enumerate() {
                *v = plane.sample(at(column, k % zoom), at(row, k / zoom));
            }
            let scale = ink / patch.iter().sum::<f32>();
            for (k, v) in patch.iter().enumerate() {
                band[k / zoom * width + column * zoom + k % zoom] = v * scale;
            }
        }
    });
    Plane::from_values(width, plane.height() * zoom, values).unwrap_or_default()
}

/// The density on a grid of samples of `side x side` px, which hold their ink.
fn coarser(plane: &Plane, side: usize) -> Plane {
    let (width, height) = (plane.width().div_ceil(side), plane.height().div_ceil(side));
    let mut sums = Plane::filled(width, height, 0.0);
    for (row, values) in plane.values.chunks_exact(plane.width()).enumerate() {
        for (column, d) in values.iter().enumerate() {
            sums.values[row / side * width + column / side] += d;
        }
    }
    sums
}

/// A part of the density, samples.
#[derive(Clone, Copy)]
struct Tile {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

/// Sites for `count` dots: the tile is cut across its longer side, at random near the middle of its ink, and each part has
/// dots for its ink. Cells start with about the right ink, and no two rows of them in line.
fn bisect(density: &Plane, tile: Tile, count: usize, seed: u64, sites: &mut Vec<Site>) {
    if count == 0 {
        return;
    }
    let wide = tile.width >= tile.height;
    let rows =
        (tile.y..tile.y + tile.height).map(|row| &density.values[row * density.width() + tile.x..][..tile.width]);
    let sums: Vec<f64> = if wide {
        let mut sums = vec![0.0; tile.width];
        for row in rows {
            for (sum, d) in sums.iter_mut().zip(row) {
                *sum += f64::from(*d);
            }
        }
        sums
    } else {
        rows.map(|row| row.iter().map(|d| f64::from(*d)).sum()).collect()
    };
    let total: f64 = sums.iter().sum();
    if count == 1 || sums.len() == 1 {
        for i in 0..count {
            let h = hash(seed, i as u64);
            let (u, v) = (unit(h), unit(hash(h, 1)));
            let (x, y) = (tile.x as f64 + u * tile.width as f64, tile.y as f64 + v * tile.height as f64);
            sites.push(Site { x: x as f32, y: y as f32, power: 0.0 });
        }
        return;
    }
    let desired = total * (0.35 + 0.3 * unit(seed));
    let (mut cut, mut before) = (1, sums[0]);
    while cut < sums.len() - 1 && before + 0.5 * sums[cut] < desired {
        before += sums[cut];
        cut += 1;
    }
    let share = if total > 0.0 { before / total } else { 0.5 };
    let first = ((count as f64 * share).round() as usize).min(count);
    let (a, b) = if wide {
        (Tile { width: cut, ..tile }, Tile { x: tile.x + cut, width: tile.width - cut, ..tile })
    } else {
        (Tile { height: cut, ..tile }, Tile { y: tile.y + cut, height: tile.height - cut, ..tile })
    };
    if count < 1000 {
        bisect(density, a, first, hash(seed, 1), sites);
        bisect(density, b, count - first, hash(seed, 2), sites);
    } else {
        let mut right = Vec::new();
        join(
            || bisect(density, a, first, hash(seed, 1), sites),
            || bisect(density, b, count - first, hash(seed, 2), &mut right),
        );
        sites.append(&mut right);
    }
}

/// A well-mixed number of a seed and an index (the finaliser of SplitMix64, doi:10.1145/2714064.2660195).
fn hash(seed: u64, index: u64) -> u64 {
    let mut z = seed.wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in [0, 1) of a hash.
fn unit(hash: u64) -> f64 {
    (hash >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::{psnr, ssim};

    /// Ink that grows to the right, with a white disc in it.
    fn ramp(width: usize, height: usize) -> Plane {
        let (cx, cy, r) = (0.6 * width as f64, 0.5 * height as f64, 0.2 * height as f64);
        Plane::from_fn(width, height, |x, y| {
            let white = (x as f64 - cx).hypot(y as f64 - cy) < r;
            if white { 0.0 } else { x as f32 / width as f32 }
        })
    }

    #[test]
    fn a_blurred_stippling_is_the_blurred_picture() {
        // as many dots to the area as 80,000 on 2000 x 1500
        let (w, h) = (500, 375);
        let density = Plane::from_fn(w, h, |x, y| {
            let (u, v) = (x as f32 / w as f32, y as f32 / h as f32);
            let edge = if u + 0.5 * v > 0.9 { 0.25 } else { 0.0 };
            (0.35 + 0.3 * (9.0 * u).sin() * (7.0 * v).cos() + edge).clamp(0.0, 1.0)
        });
        let dots = stipple(&density, &StippleOptions::new(DotCount::Points(5000)), 3);
        let ink = density.values.iter().sum::<f32>() / dots.len() as f32;
        let mut drawn = Plane::filled(w, h, 0.0);
        for dot in &dots {
            drawn.values[(dot.y as usize).min(h - 1) * w + (dot.x as usize).min(w - 1)] += ink;
        }
        let (drawn, desired) = (drawn.blurred(8.0), density.blurred(8.0));
        let (psnr, ssim) = (psnr(&drawn, &desired).unwrap(), ssim(&drawn, &desired).unwrap());
        assert!(psnr > 32.5 && ssim > 0.975, "{psnr} dB, SSIM {ssim}");
    }

    #[test]
    fn dots_lie_on_ink_and_stand_for_the_same_ink() {
        let density = ramp(300, 200);
        let dots = stipple(&density, &StippleOptions::new(DotCount::Points(2000)), 7);
        assert_eq!(dots.len(), 2000);
        for d in &dots {
            assert!(density.at(d.x as usize, d.y as usize) > 0.0, "{d:?}");
        }
        let deviation = (dots.iter().map(|d| (d.weight - 1.0).powi(2)).sum::<f64>() / 2000.0).sqrt();
        assert!(deviation < 0.08, "{deviation}");
        assert!((dots.iter().map(|d| d.weight).sum::<f64>() - 2000.0).abs() < 0.1);
    }

    #[test]
    fn bands_hold_as_many_dots_as_their_ink() {
        let density = ramp(300, 200);
        let total: f64 = density.values.iter().map(|d| f64::from(*d)).sum();
        let dots = stipple(&density, &StippleOptions::new(DotCount::Ink(total / 3000.0)), 7);
        assert_eq!(dots.len(), 3000);
        for band in 0..6 {
            let columns = 50 * band..50 * (band + 1);
            let ink: f64 = columns
                .clone()
                .flat_map(|x| (0..200).map(move |y| (x, y)))
                .map(|(x, y)| f64::from(density.at(x, y)))
                .sum();
            let desired = 3000.0 * ink / total;
            let count = dots.iter().filter(|d| columns.contains(&(d.x as usize))).count() as f64;
            // a dot across a band's edge, every other spacing of its two edges
            assert!((count - desired).abs() < 0.02 * desired + 10.0, "band {band}: {count} instead of {desired}");
        }
    }

    #[test]
    fn even_grey_has_no_clumps() {
        let dots = stipple(&Plane::filled(100, 100, 0.5), &StippleOptions::new(DotCount::Points(1000)), 3);
        let nearest = |a: &Dot| {
            dots.iter().filter(|b| *b != a).map(|b| (a.x - b.x).hypot(a.y - b.y)).fold(f64::INFINITY, f64::min)
        };
        // a honeycomb of this density has a spacing of 3.4 px
        let least = dots.iter().map(nearest).fold(f64::INFINITY, f64::min);
        assert!(least > 2.0, "{least}");
        assert!(dots.iter().all(|d| d.x > 0.5 && d.y > 0.5 && d.x < 99.5 && d.y < 99.5));
    }

    #[test]
    fn any_number_of_threads_gives_the_same_dots() {
        let density = ramp(250, 190);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| stipple(&density, &StippleOptions::new(DotCount::Points(3000)), 11))
        };
        assert_eq!(run(1), run(2));
        assert_ne!(run(1), stipple(&density, &StippleOptions::new(DotCount::Points(3000)), 12));
    }

    #[test]
    fn small_and_odd_pictures_have_their_dots_too() {
        let dots = |plane: &Plane, n| stipple(plane, &StippleOptions::new(DotCount::Points(n)), 1);
        assert_eq!(dots(&Plane::filled(1, 1, 1.0), 1).len(), 1);
        let pixel = dots(&Plane::filled(1, 1, 0.2), 50);
        assert!(pixel.len() == 50 && pixel.iter().all(|d| (0.0..=1.0).contains(&d.x) && (0.0..=1.0).contains(&d.y)));
        assert_eq!(dots(&Plane::filled(40, 30, 0.0), 10), []);
        assert_eq!(dots(&Plane::default(), 10), []);
        assert_eq!(dots(&Plane::filled(40, 30, f32::NAN), 10), []);
        assert_eq!(dots(&Plane::filled(300, 1, 1.0), 30).len(), 30);
        // one black pixel in white, and more dots than samples
        let lone = Plane::from_fn(200, 200, |x, y| if (x, y) == (150, 20) { 1.0 } else { 0.0 });
        let lone = dots(&lone, 300);
        assert!(lone.len() == 300 && lone.iter().all(|d| d.x as usize == 150 && d.y as usize == 20));
        assert_eq!(stipple(&Plane::filled(9, 9, 1.0), &StippleOptions::new(DotCount::Ink(f64::NAN)), 1), []);
    }

    #[test]
    fn grids_keep_the_ink_and_the_white() {
        let plane = ramp(37, 23);
        let total = |p: &Plane| p.values.iter().map(|d| f64::from(*d)).sum::<f64>();
        assert!((total(&finer(&plane, 3)) - total(&plane)).abs() < 1e-3);
        assert!((total(&coarser(&plane, 4)) - total(&plane)).abs() < 1e-3);
        let fine = finer(&plane, 3);
        assert!((0..37 * 3).all(|x| (0..23 * 3).all(|y| (fine.at(x, y) > 0.0) == (plane.at(x / 3, y / 3) > 0.0))));
    }
}
