//! Grids that are sheared and stretched by a known amount.
use std::f64::consts::FRAC_PI_2;

use super::*;
use crate::drawing::Pattern;
use crate::drawing::StrokeId;
use crate::ink::{InkPoint, InkStroke, TraceInk};
use crate::math::Rgb;
use crate::surface::{SurfaceLayer, SurfaceStroke, SurfaceTarget};

const SIDE: f64 = 0.14;

fn grid() -> Drawing {
    Pattern::Grid { cells: 7, color: Rgb([0; 3]) }.draw(SIDE).unwrap()
}

/// Points of every stroke, 0.2 mm apart.
fn dense(drawing: &Drawing) -> Vec<Vec<Point2<f64>>> {
    let stroke = |points: &[Point2<f64>]| -> Vec<Point2<f64>> {
        let pieces = points.windows(2).flat_map(|w| {
            let n = ((w[1] - w[0]).norm() / 2e-4).ceil() as usize;
            (0..n).map(move |i| w[0] + (w[1] - w[0]) * (i as f64 / n as f64))
        });
        pieces.chain(points.last().copied()).collect()
    };
    drawing.layers[0].strokes.iter().map(|s| stroke(&s.points)).collect()
}

fn flat(p: &Point2<f64>) -> Point3<f64> {
    Point3::new(p.x, p.y, 0.0)
}

fn desired(drawing: &Drawing) -> SurfaceDrawing {
    let target = |p: &Point2<f64>| SurfaceTarget { position: flat(p), normal: Vector3::z(), sheet: *p, width: None };
    let dense = dense(drawing);
    let strokes =
        dense.iter().enumerate().map(|(index, s)| SurfaceStroke { index, targets: s.iter().map(target).collect() });
    let layer = SurfaceLayer { name: "a".into(), color: Rgb([0; 3]), strokes: strokes.collect() };
    SurfaceDrawing { layers: vec![layer], order: Vec::new() }
}

/// Ink where `draw` puts the drawing's points; `None` is no ink.
fn drawn(drawing: &Drawing, draw: impl Fn(&Point2<f64>) -> Option<Point3<f64>>) -> InkTrace {
    let mut strokes = Vec::new();
    for (index, points) in dense(drawing).iter().enumerate() {
        let stroke = Some(StrokeId { layer: 0, index: index as u32 });
        let mut part = Vec::new();
        let mut end = |part: &mut Vec<InkPoint>| {
            if !part.is_empty() {
                strokes.push(InkStroke { ink: 0, stroke, arm: 0, points: std::mem::take(part) });
            }
        };
        for p in points {
            match draw(p) {
                Some(position) => part.push(InkPoint {
                    position,
                    normal: Vector3::z(),
                    sheet: position.xy(),
                    width: 8e-4,
                    density: 1.0,
                    time: 0.0,
                }),
                None => end(&mut part),
            }
        }
        end(&mut part);
    }
    InkTrace { inks: vec![TraceInk { name: "a".into(), color: Rgb([0; 3]) }], strokes }
}

/// Ink on a surface that is longer in y than its sheet.
fn stretched(mut ink: InkTrace, factor: f64) -> InkTrace {
    ink.strokes.iter_mut().flat_map(|s| &mut s.points).for_each(|p| p.position.y *= factor);
    ink
}

fn measured(draw: impl Fn(&Point2<f64>) -> Option<Point3<f64>>) -> GridShape {
    grid_shape(&grid(), &desired(&grid()), &drawn(&grid(), draw)).unwrap()
}

#[test]
fn a_right_grid_deviates_in_nothing() {
    let shape = measured(|p| Some(flat(p)));
    assert_eq!((shape.crossings, shape.missing), (64, 0));
    assert!(shape.aspect_deviation < 1e-9 && shape.angle_deviation < 1e-9, "{shape:?}");
    let sides = shape.sides.unwrap();
    assert!(sides.sides == 112 && sides.max < 1e-9);
}

#[test]
fn shear_is_an_angle() {
    let lean = 0.05f64;
    let shape = measured(|p| Some(Point3::new(p.x + lean.tan() * p.y, p.y, 0.0)));
    assert!((shape.angle_deviation - lean).abs() < 1e-4, "{shape:?}");
    // upright sides grow by 1 / cos; adjacent ratios by as much up or down
    assert!((shape.aspect_deviation - (1.0 / lean.cos() - 1.0)).abs() < 1e-5, "{shape:?}");
}

#[test]
fn stretch_is_an_aspect_and_a_side() {
    let shape = measured(|p| Some(Point3::new(1.06 * p.x, p.y, 0.0)));
    // two corners have the ratio 1.06, two 1 / 1.06
    assert!((shape.aspect_deviation - 0.5 * (0.06 + 1.0 - 1.0 / 1.06)).abs() < 1e-6, "{shape:?}");
    assert!(shape.angle_deviation < 1e-9);
    let sides = shape.sides.unwrap();
    assert!((sides.mean - 0.03).abs() < 1e-6 && (sides.max - 0.06).abs() < 1e-6, "{sides:?}");
}

#[test]
fn sides_are_measured_along_the_surface() {
    // up a cylinder about y: sheet x is arc r sin(a)
    let r = 0.1f64;
    let shape = measured(|p| {
        let a = (p.x / r).asin();
        Some(Point3::new(r * a.sin(), p.y, r * a.cos()))
    });
    let flat_edge: f64 = SIDE / 2.0;
    let inner = flat_edge - SIDE / 7.0;
    let worst = r * ((flat_edge / r).asin() - (inner / r).asin()) / (SIDE / 7.0) - 1.0;
    assert!((shape.sides.unwrap().max / worst - 1.0).abs() < 2e-3, "{shape:?} {worst}");
    assert!(shape.angle_deviation < 1e-6 * FRAC_PI_2);
}

#[test]
fn missing_ink_is_a_missing_crossing_and_short_ends_are_none() {
    let hole = Point2::new(grid().layers[0].strokes[2].points[0].x + 2.0 * SIDE / 7.0, SIDE * (2.0 / 7.0 - 0.5));
    let near = |p: &Point2<f64>| (p.x.abs() - SIDE / 14.0).abs() < 2e-3 && (p.y.abs() - SIDE / 14.0).abs() < 2e-3;
    let shape = measured(|p| (!near(p)).then(|| flat(p)));
    assert_eq!(shape.missing, 4, "{hole}");
    assert!(shape.aspect_deviation < 1e-9);
    // 1 mm short at every end: corners are where the lines would meet
    let inside =
        |p: &Point2<f64>| p.x.abs().max(p.y.abs()) < 0.5 * SIDE - 1e-3 || p.x.abs().min(p.y.abs()) < 0.5 * SIDE - 1e-3;
    let shape = measured(|p| inside(p).then(|| flat(p)));
    assert_eq!(shape.missing, 0);
    assert!(shape.aspect_deviation < 1e-9, "{shape:?}");
    // no ink, no shape
    assert_eq!(grid_shape(&grid(), &desired(&grid()), &drawn(&grid(), |_| None)), None);
}

#[test]
fn joined_and_turned_strokes_are_the_same_grid() {
    // the frame of a grid of one cell in one stroke, and a square of four strokes
    let mut frame = Pattern::Grid { cells: 1, color: Rgb([0; 3]) }.draw(0.04).unwrap();
    let corner = |x: f64, y: f64| Point2::new(0.02 * x, 0.02 * y);
    let round = vec![corner(1., 1.), corner(-1., 1.), corner(-1., -1.), corner(1., -1.), corner(1., 1.)];
    frame.layers[0].strokes = vec![crate::drawing::Stroke::new(round)];
    let ink = stretched(drawn(&frame, |p| Some(flat(p))), 1.1);
    let shape = grid_shape(&frame, &desired(&frame), &ink).unwrap();
    assert_eq!((shape.crossings, shape.missing), (4, 0));
    assert!((shape.aspect_deviation - 0.5 * (0.1 + 1.0 - 1.0 / 1.1)).abs() < 0.01, "{shape:?}");
}

#[test]
fn sides_of_a_curve_are_found_corner_by_corner() {
    let hilbert = Pattern::Hilbert { order: 4, cells: 0, color: Rgb([0; 3]) }.draw(0.15).unwrap();
    let straight = side_errors(&hilbert, &drawn(&hilbert, |p| Some(flat(p)))).unwrap();
    assert!(straight.max < 0.05 && straight.sides > 150, "{straight:?}");
    let wide = side_errors(&hilbert, &stretched(drawn(&hilbert, |p| Some(flat(p))), 1.2)).unwrap();
    assert!(wide.max > 0.15 && wide.max < 0.3, "{wide:?}");
    let circle = Pattern::Target { figure: crate::drawing::Figure::Circles, color: Rgb([0; 3]) }.draw(0.1).unwrap();
    assert!(side_errors(&circle, &drawn(&circle, |p| Some(flat(p)))).is_none_or(|s| s.max < 0.05));
}
