//! Drawings from formulas: grids, space-filling curves and test targets, with lengths known in closed form.
use std::f64::consts::{PI, TAU};

use nalgebra::{Point2, Rotation2, Vector2};
use serde::{Deserialize, Serialize};

use super::DrawingError;
use super::{Drawing, InkLayer, Stroke};
use crate::math::Rgb;

/// A pattern on a square sheet. In files `kind` tells which; other keys are strict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Pattern {
    /// `cells` x `cells` squares: `cells` + 1 horizontal and as many vertical lines across the sheet, so that their
    /// crossings can be measured.
    Grid {
        /// Squares along a side, 1..=1000.
        #[serde(default = "seven")]
        cells: u32,
        /// Colour of the ink.
        #[serde(default = "black")]
        color: Rgb,
    },
    /// Hilbert's curve through 4^order points, from the lower left to the lower right corner: one stroke of
    /// (2^order + 1) times the sheet's side. With a grid the curve runs through the middles of 4^order squares instead, which
    /// makes it shorter by a factor of 1 - 2^-order.
    Hilbert {
        /// 1..=10.
        order: u32,
        /// Squares along a side of a grid that is drawn first, 1..=1000; 0 for none.
        #[serde(default)]
        cells: u32,
        /// Colour of the ink.
        #[serde(default = "black")]
        color: Rgb,
    },
    /// Sierpinski's arrowhead curve: one stroke of (3/2)^order times the sheet's side.
    Arrowhead {
        /// 0..=12.
        order: u32,
        /// Colour of the ink.
        #[serde(default = "black")]
        color: Rgb,
    },
    /// Koch's snowflake: one closed stroke of (4/3)^order times 3 sqrt(3)/2 times the sheet's side.
    Snowflake {
        /// 0..=8.
        order: u32,
        /// Colour of the ink.
        #[serde(default = "black")]
        color: Rgb,
    },
    /// A target that shows what a pen can resolve.
    Target {
        /// Which one.
        #[serde(default)]
        figure: Figure,
        /// Colour of the ink.
        #[serde(default = "black")]
        color: Rgb,
    },
}

/// A test target, on a sheet of side s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Figure {
    /// All four, one in each quarter of the sheet: circles, star; ladder, corners.
    #[default]
    All,
    /// Ten concentric circles of radius s/20, 2 s/20 ... s/2.
    Circles,
    /// 36 spokes from radius s/20 to s/2: where they run together, the line is too wide.
    Star,
    /// Nine groups of five lines of length s, their pitch from s/25 down to s/400 by steps of sqrt(2).
    Ladder,
    /// Six corners of 15, 30, 45, 60, 90 and 120 degrees with arms of s/5.
    Corners,
}

fn seven() -> u32 {
    7
}

fn black() -> Rgb {
    Rgb([0, 0, 0])
}

/// Corners of [`Figure::Corners`], degrees.
const CORNERS_DEG: [f64; 6] = [15.0, 30.0, 45.0, 60.0, 90.0, 120.0];

impl Pattern {
    /// The pattern on a square sheet of this side, m.
    ///
    /// # Errors
    /// `BadOption` where the size is not between 0.1 mm and 1 km, or the order or number of cells is out of range.
    pub fn draw(&self, size: f64) -> Result<Drawing, DrawingError> {
        let (side, _) = super::Size::Natural.resolve(size, size)?;
        let within = |name, value: u32, range: std::ops::RangeInclusive<u32>| match range.contains(&value) {
            true => Ok(value),
            false => Err(DrawingError::BadOption {
                name,
                value: f64::from(value),
                message: format!("must lie between {} and {}", range.start(), range.end()),
            }),
        };
        // Strokes on a sheet of side 1 about the origin.
        let (name, color, strokes) = match *self {
            Pattern::Grid { cells, color } => ("grid", color, grid(within("cells", cells, 1..=1000)?)),
            Pattern::Hilbert { order, cells: 0, color } => {
                ("hilbert", color, vec![hilbert(within("order", order, 1..=10)?)])
            }
            Pattern::Hilbert { order, cells, color } => {
                let mut strokes = grid(within("cells", cells, 1..=1000)?);
                let inner = 1.0 - 0.5f64.powi(within("order", order, 1..=10)? as i32);
                strokes.push(hilbert(order).into_iter().map(|p| p * inner).collect());
                ("hilbert", color, strokes)
            }
            Pattern::Arrowhead { order, color } => {
                ("arrowhead", color, vec![arrowhead(within("order", order, 0..=12)?)])
            }
            Pattern::Snowflake { order, color } => {
                ("snowflake", color, vec![snowflake(within("order", order, 0..=8)?)])
            }
            Pattern::Target { figure, color } => ("target", color, target(figure, side)),
        };
        let scaled = |points: Vec<Point2<f64>>| Stroke::new(points.into_iter().map(|p| p * side).collect());
        let layer = InkLayer {
            name: name.to_string(),
            color,
            width_hint: None,
            strokes: strokes.into_iter().map(scaled).collect(),
        };
        Ok(Drawing::new(side, side, vec![layer]))
    }
}

/// Horizontal lines from bottom to top, then vertical ones from left to right, to and fro.
fn grid(cells: u32) -> Vec<Vec<Point2<f64>>> {
    let at = |k: u32| f64::from(k) / f64::from(cells) - 0.5;
    let line = |k: u32, horizontal: bool| {
        let turned = k % 2 == 1;
        let (from, to) = if turned { (0.5, -0.5) } else { (-0.5, 0.5) };
        match horizontal {
            true => vec![Point2::new(from, at(k)), Point2::new(to, at(k))],
            false => vec![Point2::new(at(k), from), Point2::new(at(k), to)],
        }
    };
    (0..=cells).map(|k| line(k, true)).chain((0..=cells).map(|k| line(k, false))).collect()
}

/// Points of Hilbert's curve by their index, two bits at a time from the finest square up.
fn hilbert(order: u32) -> Vec<Point2<f64>> {
    let n = 1u64 << order;
    let point = |mut index: u64| {
        let (mut x, mut y) = (0, 0);
        for s in (0..order).map(|k| 1u64 << k) {
            let (rx, ry) = ((index >> 1) & 1, (index ^ (index >> 1)) & 1);
            if ry == 0 {
                if rx == 1 {
                    (x, y) = (s - 1 - x, s - 1 - y);
                }
                (x, y) = (y, x);
            }
            (x, y) = (x + s * rx, y + s * ry);
            index >>= 2;
        }
        Point2::new(x as f64, y as f64) / (n - 1) as f64 - Vector2::new(0.5, 0.5)
    };
    (0..n * n).map(point).collect()
}

/// Points of the arrowhead curve over the middle of the sheet, width 1, in the box's middle.
fn arrowhead(order: u32) -> Vec<Point2<f64>> {
    // A -> B A B bulging to one side, B -> A B A bulging to the other. Segments are kept by direction, in sixths of a
    // turn; their letters alternate along the curve, and its first letter alternates from level to level.
    let step = 0.5f64.powi(order as i32);
    let mut points = vec![Point2::origin()];
    let mut curve = vec![0i32];
    for level in 0..order as usize {
        let thirds = |(k, d): (usize, &i32)| {
            let side = if (k + level) % 2 == 0 { 1 } else { -1 };
            [d + side, *d, d - side]
        };
        curve = curve.iter().enumerate().flat_map(thirds).collect();
    }
    for d in &curve {
        let direction = Vector2::new((f64::from(*d) * PI / 3.0).cos(), (f64::from(*d) * PI / 3.0).sin());
        points.push(points[points.len() - 1] + direction * step);
    }
    centre(points)
}

/// Moves points so that their bounding box is about the origin.
fn centre(mut points: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    let (low, high) = points.iter().fold((points[0], points[0]), |(l, h), p| (l.inf(p), h.sup(p)));
    let middle = nalgebra::center(&low, &high).coords;
    points.iter_mut().for_each(|p| *p -= middle);
    points
}

/// Koch's snowflake about the origin, inside a circle of diameter 1.
fn snowflake(order: u32) -> Vec<Point2<f64>> {
    let corner = |k: u32| {
        let a = 0.5 * PI - TAU * f64::from(k % 3) / 3.0;
        Point2::new(0.5 * a.cos(), 0.5 * a.sin())
    };
    let mut points: Vec<Point2<f64>> = (0..4).map(corner).collect();
    // The triangle is walked clockwise, so its outside is on the left.
    let outward = Rotation2::new(PI / 3.0);
    for _ in 0..order {
        let mut finer = vec![points[0]];
        for w in points.windows(2) {
            let third = (w[1] - w[0]) / 3.0;
            finer.extend([w[0] + third, w[0] + third + outward * third, w[1] - third, w[1]]);
        }
        points = finer;
    }
    points
}

/// A test target on a sheet of side 1; `side` is its true side, m, which sets how finely circles are divided.
fn target(figure: Figure, side: f64) -> Vec<Vec<Point2<f64>>> {
    match figure {
        Figure::All => {
            let quarters = [
                (Figure::Circles, -0.25, 0.25),
                (Figure::Star, 0.25, 0.25),
                (Figure::Ladder, -0.25, -0.25),
                (Figure::Corners, 0.25, -0.25),
            ];
            // A margin keeps the quarters apart.
            let place = |(figure, x, y)| {
                let strokes = target(figure, 0.45 * side);
                strokes.into_iter().map(move |s| s.into_iter().map(|p| p * 0.45 + Vector2::new(x, y)).collect())
            };
            quarters.into_iter().flat_map(place).collect()
        }
        Figure::Circles => (1..=10).map(|k| circle(0.05 * f64::from(k), side)).collect(),
        Figure::Star => (0..36)
            .map(|k| {
                let (sin, cos) = (TAU * f64::from(k) / 36.0).sin_cos();
                let (near, far) = (Point2::new(0.05 * cos, 0.05 * sin), Point2::new(0.5 * cos, 0.5 * sin));
                if k % 2 == 0 { vec![near, far] } else { vec![far, near] }
            })
            .collect(),
        Figure::Ladder => {
            let pitches: Vec<f64> = (0..9).map(|k| 0.5f64.powf(0.5 * f64::from(k)) / 25.0).collect();
            let gap = (1.0 - 4.0 * pitches.iter().sum::<f64>()) / 8.0;
            let (mut y, mut lines) = (0.5, Vec::new());
            for pitch in pitches {
                for k in 0..5 {
                    let at = y - pitch * f64::from(k);
                    let (from, to) = if lines.len() % 2 == 0 { (-0.5, 0.5) } else { (0.5, -0.5) };
                    lines.push(vec![Point2::new(from, at), Point2::new(to, at)]);
                }
                y -= 4.0 * pitch + gap;
            }
            lines
        }
        Figure::Corners => CORNERS_DEG
            .iter()
            .enumerate()
            .map(|(k, degrees)| {
                // Three in a row, two rows, each opening upwards from its corner.
                let half = 0.5 * degrees.to_radians();
                let arm = Vector2::new(0.2 * half.sin(), 0.2 * half.cos());
                let tip = Point2::new(0.32 * (k % 3) as f64 - 0.32, if k < 3 { 0.1 } else { -0.35 });
                vec![tip + Vector2::new(-arm.x, arm.y), tip, tip + arm]
            })
            .collect(),
    }
}

/// A closed circle about the origin whose chords stay within 0.01 mm of the arc.
fn circle(radius: f64, side: f64) -> Vec<Point2<f64>> {
    let half = (1.0 - (1e-5 / (radius * side)).min(0.5)).acos();
    let n = (PI / half).ceil().clamp(8.0, 10_000.0) as u32;
    let at = |k: u32| {
        let (sin, cos) = (TAU * f64::from(k % n) / f64::from(n)).sin_cos();
        Point2::new(radius * cos, radius * sin)
    };
    (0..=n).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draw(text: &str, size: f64) -> Drawing {
        toml::from_str::<Pattern>(text).unwrap().draw(size).unwrap()
    }

    fn assert_on_sheet(d: &Drawing) {
        for p in d.layers.iter().flat_map(|l| &l.strokes).flat_map(|s| &s.points) {
            assert!(p.x.abs() <= 0.5 * d.width * (1.0 + 1e-12) && p.y.abs() <= 0.5 * d.height * (1.0 + 1e-12), "{p}");
        }
    }

    #[test]
    fn lengths_are_those_of_the_closed_forms() {
        let s = 0.24;
        for n in [1, 7, 20] {
            let d = draw(&format!("kind = 'grid'\ncells = {n}"), s);
            assert_eq!(d.stroke_count(), 2 * (n + 1));
            assert!((d.length() - 2.0 * (n as f64 + 1.0) * s).abs() < 1e-12);
            assert_on_sheet(&d);
        }
        for k in 1..=8 {
            let d = draw(&format!("kind = 'hilbert'\norder = {k}"), s);
            assert_eq!((d.stroke_count(), d.point_count()), (1, 1 << (2 * k)));
            assert!((d.length() / (s * (2f64.powi(k) + 1.0)) - 1.0).abs() < 1e-9);
            assert_on_sheet(&d);
            let d = draw(&format!("kind = 'hilbert'\norder = {k}\ncells = 3"), s);
            let curve = s * (2f64.powi(k) + 1.0) * (1.0 - 0.5f64.powi(k));
            assert_eq!(d.stroke_count(), 9);
            assert!((d.length() / (8.0 * s + curve) - 1.0).abs() < 1e-9);
            assert_on_sheet(&d);
        }
        for k in 0..=9 {
            let d = draw(&format!("kind = 'arrowhead'\norder = {k}"), s);
            assert!((d.length() / (s * 1.5f64.powi(k)) - 1.0).abs() < 1e-9);
            let points = &d.layers[0].strokes[0].points;
            let chord = points[points.len() - 1] - points[0];
            assert!((chord - Vector2::new(s, 0.0)).norm() < 1e-9, "order {k}: {chord}");
            assert_on_sheet(&d);
        }
        for k in 0..=6 {
            let d = draw(&format!("kind = 'snowflake'\norder = {k}"), s);
            assert!((d.length() / (1.5 * 3f64.sqrt() * s * (4.0f64 / 3.0).powi(k)) - 1.0).abs() < 1e-9);
            assert!(
                (d.layers[0].strokes[0].points[0] - d.layers[0].strokes[0].points[3 * 4usize.pow(k as u32)]).norm()
                    < 1e-12
            );
            assert_on_sheet(&d);
        }
        let sums = [
            ("circles", TAU * 2.75),
            ("star", 36.0 * 0.45),
            ("ladder", 45.0),
            ("corners", 2.4),
            ("all", 0.45 * (TAU * 2.75 + 36.0 * 0.45 + 45.0 + 2.4)),
        ];
        for (figure, sum) in sums {
            let d = draw(&format!("kind = 'target'\nfigure = '{figure}'"), s);
            assert!((d.length() / (s * sum) - 1.0).abs() < 1e-3, "{figure}");
            assert_on_sheet(&d);
        }
    }

    #[test]
    fn space_filling_curves_never_visit_a_point_twice() {
        for text in ["kind = 'hilbert'\norder = 6", "kind = 'arrowhead'\norder = 7"] {
            let d = draw(text, 1.0);
            let mut cells: Vec<_> = d.layers[0].strokes[0]
                .points
                .iter()
                .map(|p| ((p.x * 1e6).round() as i64, (p.y * 1e6).round() as i64))
                .collect();
            cells.sort();
            assert!(cells.windows(2).all(|w| w[0] != w[1]), "{text}");
        }
    }

    #[test]
    fn unknown_keys_kinds_and_orders_are_refused() {
        for text in ["kind = 'grid'\ncell = 3", "kind = 'grd'", "kind = 'hilbert'", "kind = 'hilbert'\norder = -1"] {
            assert!(toml::from_str::<Pattern>(text).is_err(), "{text}");
        }
        let e = Pattern::Hilbert { order: 40, cells: 0, color: black() }.draw(0.1).unwrap_err();
        assert_eq!(e.to_string(), "order = 40: must lie between 1 and 10");
        assert!(Pattern::Grid { cells: 7, color: black() }.draw(f64::NAN).is_err());
    }
}
