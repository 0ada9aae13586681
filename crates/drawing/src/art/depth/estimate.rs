//! Segments and depth guessed from the picture itself, for want of better ones.
//!
//! Nothing here knows what a sheep is. Regions of one colour are called things where they stand out from the rest and stuff
//! where they don't (global contrast: Cheng et al., "Global contrast based salient region detection", 2015,
//! doi:10.1109/TPAMI.2014.2345401), and depth is a mixture of the cues that painters use: what is lower in the picture,
//! stands out and is sharp seems near, what is high up, pale and blurred seems far.
use crate::art::depth::layered::working_size;
use crate::art::depth::regions::{RegionOptions, packed, regions};
use crate::art::depth::{Kind, Segment, Semantics, SemanticsError};
use crate::picture::{Picture, Plane, majority, oklab_from_linear};

/// Weights of the cues of depth, by how much each speaks for nearness.
const LOW: f64 = 0.5;
const SALIENT: f64 = 0.3;
const SHARP: f64 = 0.12;
const CLEAR: f64 = 0.08;
/// How far the middle of a thing bulges towards the viewer.
const BULGE: f64 = 0.25;
/// Strength of the spatial weighting of contrast, in squared picture diagonals (Cheng et al. use 0.4).
const NEARNESS: f64 = 0.4;
/// Things have at least this share of the highest saliency.
const SALIENT_ENOUGH: f64 = 0.4;
/// Most segments that are taken for things.
const THINGS: usize = 5;
/// A thing is background no more surely than this: it may be cut off by the picture's edge, but on one side.
const CUT: f64 = 0.5;
/// Strength of the preference for the picture's middle.
const CENTRED: f64 = 1.0;

/// What a region looks like.
struct Look {
    area: f64,
    lab: [f64; 3],
    /// Mean place, in picture heights from the picture's middle.
    middle: [f64; 2],
    /// Mean squared distance from the picture's middle, in half diagonals.
    off: f64,
    /// Lowest row, 0 (top) ..= 1.
    bottom: f64,
    /// Length of picture edge that it touches, in square roots of the picture's area.
    rim: f64,
    /// Mean slope of lightness.
    slope: f64,
    saliency: f64,
}

impl Look {
    /// How surely it is background, 0..=1: by the length of picture edge that it touches for its size.
    fn ground(&self) -> f64 {
        let connected = self.rim / self.area.sqrt().max(1e-9);
        1.0 - (-0.5 * connected * connected).exp()
    }
}

/// Most pixels that are looked at: a larger picture is made smaller first.
const MOST_PIXELS: usize = 1_000_000;

/// Segments and depth by colour and place alone. It says in its notes that it is an estimate. Of a picture above a megapixel
/// the maps are smaller than it.
///
/// # Errors
/// [`SemanticsError::Size`] of a picture without pixels.
pub fn estimate(picture: &Picture) -> Result<Semantics, SemanticsError> {
    let (width, height) = (picture.width(), picture.height());
    if picture.pixels.is_empty() {
        return Err(SemanticsError::Size { what: "picture", width, height, values: 0 });
    }
    let smaller = working_size(width, height, MOST_PIXELS);
    if smaller != (width, height) {
        return estimate(&picture.resized(smaller.0, smaller.1));
    }
    let lab: Vec<[f32; 3]> = picture.pixels.iter().map(|p| oklab_from_linear(*p)).collect();
    let soft = softened(&lab, width, height);
    let found = regions(&soft, width, &RegionOptions::default());
    let labels = packed(&majority(&found, width, width.max(height) / 160));
    let mut looks = look(&lab, width, height, &labels);
    rate(&mut looks);
    let things = choose(&looks);
    let segments = name(&looks, &things);
    let depth = depth(&looks, &things, &labels, width, height);
    let mut semantics = Semantics::new(segments, labels, depth)?;
    semantics.notes.push(
        "segments and depth are an estimate from colour, contrast and place in the picture: give a label image and a \
         depth map, or models, for what is really there"
            .to_string(),
    );
    Ok(semantics)
}

/// The picture with its texture blurred away.
fn softened(lab: &[[f32; 3]], width: usize, height: usize) -> Vec<[f32; 3]> {
    let sigma = (width.max(height) as f32 / 500.0).max(0.8);
    let channel = |k: usize| {
        let plane = Plane::from_values(width, height, lab.iter().map(|p| p[k]).collect()).unwrap_or_default();
        plane.blurred(sigma).values
    };
    let (l, a, b) = (channel(0), channel(1), channel(2));
    l.into_iter().zip(a).zip(b).map(|((l, a), b)| [l, a, b]).collect()
}

fn look(lab: &[[f32; 3]], width: usize, height: usize, labels: &[u16]) -> Vec<Look> {
    let count = labels.iter().max().map_or(0, |m| usize::from(*m) + 1);
    let new = || Look {
        area: 0.0,
        lab: [0.0; 3],
        middle: [0.0; 2],
        off: 0.0,
        bottom: 0.0,
        rim: 0.0,
        slope: 0.0,
        saliency: 0.0,
    };
    let mut looks: Vec<Look> = (0..count).map(|_| new()).collect();
    let (w, h) = (width as f64, height as f64);
    let half_diagonal2 = 0.25 * (w * w + h * h);
    let side = (w * h).sqrt();
    for (i, l) in labels.iter().enumerate() {
        let (x, y) = (i % width, i / width);
        let (px, py) = (x as f64 + 0.5 - 0.5 * w, y as f64 + 0.5 - 0.5 * h);
        let r = &mut looks[usize::from(*l)];
        r.area += 1.0;
        (0..3).for_each(|k| r.lab[k] += f64::from(lab[i][k]));
        r.middle[0] += px / h;
        r.middle[1] += py / h;
        r.off += (px * px + py * py) / half_diagonal2;
        r.bottom = (y as f64 + 1.0) / h;
        let sides = [x == 0, y == 0, x + 1 == width, y + 1 == height];
        r.rim += sides.into_iter().filter(|s| *s).count() as f64 / side;
        // within the region only: its outline says nothing about its own sharpness
        let across = labels.get(i + 1).filter(|n| *n == l && x + 1 < width).map_or(0.0, |_| lab[i + 1][0] - lab[i][0]);
        let down = labels.get(i + width).filter(|n| *n == l).map_or(0.0, |_| lab[i + width][0] - lab[i][0]);
        r.slope += f64::from(across.hypot(down));
    }
    for r in &mut looks {
        let n = r.area;
        r.lab = r.lab.map(|v| v / n);
        r.middle = r.middle.map(|v| v / n);
        r.off /= n;
        r.slope /= n;
    }
    let all = labels.len() as f64;
    looks.iter_mut().for_each(|r| r.area /= all);
    looks
}

/// Saliency of each region, 0..=1: contrast in colour to the other regions, those near counting more, times a preference
/// for the middle and against what runs along the picture's edge.
///
/// Contrast to the background counts, and what is background shows in how it meets the picture's edge (Zhu et al., "Saliency
/// optimization from robust background detection", 2014, doi:10.1109/CVPR.2014.360).
fn rate(looks: &mut [Look]) {
    let raw: Vec<f64> = looks
        .iter()
        .map(|r| {
            let contrast: f64 = looks
                .iter()
                .map(|s| {
                    let d: f64 = (0..3).map(|k| (r.lab[k] - s.lab[k]).powi(2)).sum();
                    let far = (r.middle[0] - s.middle[0]).powi(2) + (r.middle[1] - s.middle[1]).powi(2);
                    s.area * s.ground() * d.sqrt() * (-far / NEARNESS).exp()
                })
                .sum();
            contrast * (1.0 - r.ground()) * (-CENTRED * r.off).exp()
        })
        .collect();
    let most = raw.iter().copied().fold(0.0, f64::max);
    if most > 0.0 {
        looks.iter_mut().zip(raw).for_each(|(r, s)| r.saliency = s / most);
    }
}

/// The regions that are things.
fn choose(looks: &[Look]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..looks.len())
        .filter(|i| looks[*i].saliency > SALIENT_ENOUGH && looks[*i].ground() < CUT && looks[*i].area > 0.002)
        .collect();
    order.sort_by(|a, b| looks[*b].saliency.total_cmp(&looks[*a].saliency).then(a.cmp(b)));
    order.truncate(THINGS);
    // a picture of one region is all stuff
    if looks.len() < 2 { Vec::new() } else { order }
}

fn name(looks: &[Look], things: &[usize]) -> Vec<Segment> {
    let mut stuff: Vec<usize> = (0..looks.len()).filter(|i| !things.contains(i)).collect();
    // what a painter would call the subject's surroundings first, the far sky last
    stuff.sort_by(|a, b| looks[*b].bottom.total_cmp(&looks[*a].bottom).then(looks[*a].off.total_cmp(&looks[*b].off)));
    let mut segments = vec![Segment { name: String::new(), kind: Kind::Stuff { order: 0 } }; looks.len()];
    for (k, i) in things.iter().enumerate() {
        let kind = Kind::Thing { confidence: looks[*i].saliency };
        segments[*i] = Segment { name: format!("thing {}", k + 1), kind };
    }
    for (k, i) in stuff.iter().enumerate() {
        segments[*i] = Segment { name: format!("region {}", k + 1), kind: Kind::Stuff { order: k as i64 } };
    }
    segments
}

/// Relative depth, smooth, 0 (far) ..= 1 (near).
fn depth(looks: &[Look], things: &[usize], labels: &[u16], width: usize, height: usize) -> Plane {
    let most = |f: &dyn Fn(&Look) -> f64| looks.iter().map(f).fold(1e-9, f64::max);
    let sharpest = most(&|r| r.slope);
    let clear = |r: &Look| (r.lab[1].hypot(r.lab[2]) / 0.2).min(1.0).max(1.0 - r.lab[0]);
    let base: Vec<f64> = looks
        .iter()
        .map(|r| SALIENT * r.saliency + SHARP * r.slope / sharpest + CLEAR * clear(r).clamp(0.0, 1.0))
        .collect();
    let rim = rim_distance(labels, width, height);
    let mut deepest = vec![0.0f32; looks.len()];
    for (l, d) in labels.iter().zip(&rim) {
        deepest[usize::from(*l)] = deepest[usize::from(*l)].max(*d);
    }
    let raw = Plane::from_fn(width, height, |x, y| {
        let i = y * width + x;
        let l = usize::from(labels[i]);
        let r = &looks[l];
        // stuff lies like the ground; a thing stands upright where it meets the ground, and bulges
        let (low, bulge) = if things.contains(&l) {
            let d = f64::from(rim[i] / deepest[l].max(1.0));
            (r.bottom, (d * (2.0 - d)).max(0.0).sqrt())
        } else {
            ((y as f64 + 0.5) / height as f64, 0.0)
        };
        (base[l] + LOW * low + BULGE * bulge) as f32
    });
    let soft = raw.blurred((width.max(height) as f32 / 150.0).max(0.5));
    let (low, high) = soft.values.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    let span = high - low;
    let unit = |v: &f32| if span > 1e-6 { ((v - low) / span).clamp(0.0, 1.0) } else { 0.5 };
    Plane::from_values(width, height, soft.values.iter().map(unit).collect()).unwrap_or_default()
}

/// Distance of each pixel from the nearest pixel of another region, px, by the 3-4 chamfer of Borgefors (1986,
/// doi:10.1016/S0734-189X(86)80047-0), which is within 8 %. The picture's edge is no border.
pub(super) fn rim_distance<T: Copy + PartialEq>(labels: &[T], width: usize, height: usize) -> Vec<f32> {
    const FAR: f32 = 1e9;
    let at = |x: usize, y: usize| y * width + x;
    let mut d: Vec<f32> = (0..labels.len())
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let other = |n: usize| labels[n] != labels[i];
            let rim = (x > 0 && other(i - 1))
                || (x + 1 < width && other(i + 1))
                || (y > 0 && other(i - width))
                || (y + 1 < height && other(i + width));
            if rim { 0.5 } else { FAR }
        })
        .collect();
    let (one, diagonal) = (1.0f32, 4.0 / 3.0);
    for y in 0..height {
        for x in 0..width {
            let mut best = d[at(x, y)];
            if x > 0 {
                best = best.min(d[at(x - 1, y)] + one);
            }
            if y > 0 {
                best = best.min(d[at(x, y - 1)] + one);
                if x > 0 {
                    best = best.min(d[at(x - 1, y - 1)] + diagonal);
                }
                if x + 1 < width {
                    best = best.min(d[at(x + 1, y - 1)] + diagonal);
                }
            }
            d[at(x, y)] = best;
        }
    }
    for y in (0..height).rev() {
        for x in (0..width).rev() {
            let mut best = d[at(x, y)];
            if x + 1 < width {
                best = best.min(d[at(x + 1, y)] + one);
            }
            if y + 1 < height {
                best = best.min(d[at(x, y + 1)] + one);
                if x > 0 {
                    best = best.min(d[at(x - 1, y + 1)] + diagonal);
                }
                if x + 1 < width {
                    best = best.min(d[at(x + 1, y + 1)] + diagonal);
                }
            }
            d[at(x, y)] = best;
        }
    }
    let largest = (width.max(height)) as f32;
    d.into_iter().map(|v| v.min(largest)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A red disc on a green meadow under a pale sky.
    fn scene(width: usize, height: usize) -> Picture {
        let pixel = |x: usize, y: usize| {
            let (u, v) = (x as f64 / width as f64 - 0.5, y as f64 / height as f64 - 0.55);
            if (u * u + v * v).sqrt() < 0.2 {
                [0.7, 0.05, 0.05]
            } else if y * 5 < height * 2 {
                [0.7, 0.8, 0.9]
            } else {
                [0.1, 0.4, 0.1]
            }
        };
        let pixels = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
        Picture::from_pixels(width, height, pixels).unwrap()
    }

    #[test]
    fn the_red_disc_is_the_thing_and_the_sky_is_far() {
        let s = estimate(&scene(120, 90)).unwrap();
        let at = |x: usize, y: usize| (usize::from(s.labels()[y * 120 + x]), s.depth().at(x, y));
        let (disc, sky, meadow) = (at(60, 50), at(5, 5), at(5, 85));
        assert!(matches!(s.segments()[disc.0].kind, Kind::Thing { .. }));
        assert!(matches!(s.segments()[sky.0].kind, Kind::Stuff { .. }));
        assert_eq!(s.drawing_order()[0], disc.0);
        assert!(disc.1 > meadow.1 && meadow.1 > sky.1, "{disc:?} {meadow:?} {sky:?}");
        assert!(s.notes[0].contains("estimate"));
    }

    #[test]
    fn one_pixel_and_one_colour_are_stuff() {
        for (width, height) in [(1, 1), (30, 20)] {
            let plain = Picture::from_pixels(width, height, vec![[0.3; 3]; width * height]).unwrap();
            let s = estimate(&plain).unwrap();
            assert_eq!(s.segments().len(), 1);
            assert!(s.depth().values.iter().all(|d| (0.0..=1.0).contains(d)));
        }
        assert!(estimate(&Picture::default()).is_err());
    }

    #[test]
    fn distances_grow_from_the_rim() {
        let labels: Vec<u16> = (0..40 * 10).map(|i| u16::from(i % 40 >= 15)).collect();
        let d = rim_distance(&labels, 40, 10);
        assert_eq!([d[14], d[15], d[0], d[39]], [0.5, 0.5, 14.5, 24.5]);
    }
}
