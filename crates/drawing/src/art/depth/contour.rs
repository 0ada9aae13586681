//! Outlines of a region of pixels, as curves.
use nalgebra::{Point2, Vector2};

/// A piece of a region's outline, in px (x right, y down, the picture's corner at the origin), with the region on its
/// right hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Points about a pixel apart, smoothed.
    pub points: Vec<Point2<f64>>,
    /// Unit normals into the region, one a point.
    pub inward: Vec<Vector2<f64>>,
    /// Whether the last point is followed by the first.
    pub closed: bool,
}

/// Directions of travel along pixel sides: east, south, west, north.
const WAYS: [(i64, i64); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

/// All outlines of the pixels for which `inside(column, row)` holds, those round holes too, in the order of their first
/// pixels. Where a region ends at the picture's edge there is no outline, and what is left of it is open. `smoothing`
/// is the standard deviation of the smoothing along the curve, px.
pub fn outlines(width: usize, height: usize, inside: impl Fn(usize, usize) -> bool, smoothing: f64) -> Vec<Outline> {
    let at = |x: i64, y: i64| {
        x >= 0 && y >= 0 && (x as usize) < width && (y as usize) < height && inside(x as usize, y as usize)
    };
    let mut seen = vec![false; width * height];
    let mut found = Vec::new();
    for row in 0..height {
        for column in 0..width {
            // every loop has a side that runs east, over the top of a pixel
            if !at(column as i64, row as i64) || at(column as i64, row as i64 - 1) || seen[row * width + column] {
                continue;
            }
            let sides = walk(&at, column as i64, row as i64, |x, y| seen[y as usize * width + x as usize] = true);
            let on_edge = |(x, y, way): &(i64, i64, usize)| {
                let (ox, oy) = left_pixel(*x, *y, *way);
                ox < 0 || oy < 0 || ox >= width as i64 || oy >= height as i64
            };
            found.extend(split(&sides, on_edge).into_iter().map(|(sides, closed)| curve(&sides, closed, smoothing)));
        }
    }
    found.retain(|o: &Outline| o.points.len() > 1);
    found
}

/// The pixel on the right hand of a side that starts at a corner.
fn right_pixel(x: i64, y: i64, way: usize) -> (i64, i64) {
    [(x, y), (x - 1, y), (x - 1, y - 1), (x, y - 1)][way]
}

/// The pixel on the left hand of a side that starts at a corner.
fn left_pixel(x: i64, y: i64, way: usize) -> (i64, i64) {
    [(x, y - 1), (x, y), (x - 1, y), (x - 1, y - 1)][way]
}

/// One loop of sides (corner and direction) from the top side of a pixel; diagonal pixels are not connected.
fn walk(
    at: &impl Fn(i64, i64) -> bool,
    column: i64,
    row: i64,
    mut over_the_top: impl FnMut(i64, i64),
) -> Vec<(i64, i64, usize)> {
    let start = (column, row, 0);
    let (mut x, mut y, mut way) = start;
    let mut sides = Vec::new();
    loop {
        if way == 0 {
            over_the_top(x, y);
        }
        sides.push((x, y, way));
        (x, y) = (x + WAYS[way].0, y + WAYS[way].1);
        let open = |w: usize| {
            let ((rx, ry), (lx, ly)) = (right_pixel(x, y, w), left_pixel(x, y, w));
            at(rx, ry) && !at(lx, ly)
        };
        way = [way + 1, way, way + 3].map(|w| w % 4).into_iter().find(|w| open(*w)).unwrap_or(way);
        if (x, y, way) == start {
            return sides;
        }
    }
}

type Side = (i64, i64, usize);

/// The runs of a loop that don't lie on the picture's edge, and whether they are the whole loop.
fn split(sides: &[Side], on_edge: impl Fn(&Side) -> bool) -> Vec<(Vec<Side>, bool)> {
    let Some(cut) = sides.iter().position(&on_edge) else {
        return vec![(sides.to_vec(), true)];
    };
    let mut runs = Vec::new();
    let mut run = Vec::new();
    for side in sides[cut..].iter().chain(&sides[..cut]) {
        if !on_edge(side) {
            run.push(*side);
        } else if !run.is_empty() {
            runs.push((std::mem::take(&mut run), false));
        }
    }
    if !run.is_empty() {
        runs.push((run, false));
    }
    runs
}

/// The smooth curve through the middles of sides.
fn curve(sides: &[Side], closed: bool, smoothing: f64) -> Outline {
    let middle =
        |&(x, y, way): &Side| Point2::new(x as f64 + 0.5 * WAYS[way].0 as f64, y as f64 + 0.5 * WAYS[way].1 as f64);
    let raw: Vec<Point2<f64>> = sides.iter().map(middle).collect();
    // a loop shorter than the kernel would shrink to a point
    let points = smooth(&raw, closed, smoothing.min(raw.len() as f64 / 12.0));
    let n = points.len();
    let inward = (0..n)
        .map(|i| {
            let (before, after) =
                if closed { ((i + n - 1) % n, (i + 1) % n) } else { (i.saturating_sub(1), (i + 1).min(n - 1)) };
            let along = points[after] - points[before];
            along.try_normalize(1e-9).map_or_else(Vector2::zeros, |t| Vector2::new(-t.y, t.x))
        })
        .collect();
    Outline { points, inward, closed }
}

/// A curve under a Gaussian of standard deviation `sigma` samples; the ends of an open one stay.
pub fn smooth(points: &[Point2<f64>], closed: bool, sigma: f64) -> Vec<Point2<f64>> {
    if sigma < 0.3 || points.len() < 3 {
        return points.to_vec();
    }
    let reach = (3.0 * sigma).ceil() as i64;
    let kernel: Vec<f64> = (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
    let n = points.len() as i64;
    let (first, last) = (points[0], points[points.len() - 1]);
    let at = |i: i64| {
        if closed {
            points[i.rem_euclid(n) as usize]
        } else if i < 0 {
            // mirrored through the end, so that the end stays where it is
            first + (first - points[(-i).min(n - 1) as usize])
        } else if i >= n {
            last + (last - points[(2 * (n - 1) - i).max(0) as usize])
        } else {
            points[i as usize]
        }
    };
    let total: f64 = kernel.iter().sum();
    (0..n)
        .map(|i| {
            let sum = kernel.iter().zip(i - reach..).fold(Vector2::zeros(), |s, (k, j)| s + *k * at(j).coords);
            Point2::from(sum / total)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_side_between_inside_and_outside_is_on_one_outline(
            width in 1usize..14, height in 1usize..14, mask in proptest::collection::vec(any::<bool>(), 196),
        ) {
            let inside = |x: usize, y: usize| mask[y * 14 + x];
            let mut sides = 0;
            for y in 0..height {
                for x in 0..width {
                    sides += usize::from(x + 1 < width && inside(x, y) != inside(x + 1, y));
                    sides += usize::from(y + 1 < height && inside(x, y) != inside(x, y + 1));
                }
            }
            let found = outlines(width, height, inside, 0.0);
            let points: usize = found.iter().map(|o| o.points.len()).sum();
            // a single side makes no curve
            prop_assert!(points <= sides);
            for o in &found {
                for (p, n) in o.points.iter().zip(&o.inward) {
                    prop_assert!(n.norm() < 1.0 + 1e-9);
                    prop_assert!((0.0..=width as f64).contains(&p.x) && (0.0..=height as f64).contains(&p.y));
                }
            }
        }
    }

    #[test]
    fn a_disc_has_one_round_outline_with_normals_to_its_middle() {
        let inside = |x: usize, y: usize| (x as f64 - 31.5).hypot(y as f64 - 31.5) < 20.0;
        let found = outlines(64, 64, inside, 2.0);
        assert_eq!(found.len(), 1);
        assert!(found[0].closed);
        for (p, n) in found[0].points.iter().zip(&found[0].inward) {
            let out = p - Point2::new(32.0, 32.0);
            assert!((out.norm() - 20.0).abs() < 0.8, "{}", out.norm());
            assert!(n.dot(&out.normalize()) < -0.95);
        }
    }

    #[test]
    fn a_region_on_the_edge_has_an_open_outline() {
        let found = outlines(30, 20, |x, _| x < 10, 2.0);
        assert_eq!(found.len(), 1);
        assert!(!found[0].closed);
        assert_eq!(found[0].points.len(), 20);
        assert!(found[0].points.iter().all(|p| (p.x - 10.0).abs() < 1e-9));
        assert!(outlines(30, 20, |_, _| true, 2.0).is_empty());
    }
}
