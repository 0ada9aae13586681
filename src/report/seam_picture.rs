//! A seam close up: the ink round a place of the sheet.
use nalgebra::Point2;

use crate::ink::{InkError, InkStroke, InkTrace, RasterOptions, rasterise};
use crate::picture::Image;

/// Pixels a side.
const SIDE_PX: u32 = 600;

/// The ink within a square of this side (m) round `middle` (m, sheet), as it lies.
///
/// # Errors
/// The ink can't be drawn.
pub fn seam_picture(trace: &InkTrace, middle: &Point2<f64>, side: f64) -> Result<Image, InkError> {
    // lines go on beyond the edge of the picture
    let near = |p: &Point2<f64>| (p - middle).amax() < side;
    let mut strokes = Vec::new();
    for stroke in &trace.strokes {
        for run in stroke.points.chunk_by(|a, b| near(&a.sheet) == near(&b.sheet)) {
            if near(&run[0].sheet) {
                let mut points = run.to_vec();
                points.iter_mut().for_each(|p| p.sheet -= middle.coords);
                strokes.push(InkStroke { points, ..stroke.clone() });
            }
        }
    }
    let close = InkTrace { inks: trace.inks.clone(), strokes };
    rasterise(&close, &RasterOptions::with_long_side(side, side, SIDE_PX))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::ink::{InkPoint, TraceInk};
    use crate::math::Rgb;

    #[test]
    fn what_is_near_is_seen_and_what_is_far_is_not() {
        let point = |x: f64, y: f64| InkPoint {
            position: Point3::origin(),
            normal: Vector3::z(),
            sheet: Point2::new(x, y),
            width: 1e-3,
            density: 1.0,
            time: 0.0,
        };
        let line = |y: f64| InkStroke {
            ink: 0,
            stroke: None,
            arm: 0,
            points: (0..200).map(|i| point(1e-3 * f64::from(i), y)).collect(),
        };
        let trace = InkTrace {
            inks: vec![TraceInk { name: "black".into(), color: Rgb([0; 3]) }],
            strokes: vec![line(0.1), line(0.2)],
        };
        let picture = seam_picture(&trace, &Point2::new(0.1, 0.1), 0.02).unwrap();
        let dark = |x: u32, y: u32| picture.pixel(x, y).unwrap().0[0] < 100;
        assert!(dark(300, 300) && dark(3, 300) && dark(596, 300));
        assert!((0..280).all(|y| !dark(300, y)) && (320..600).all(|y| !dark(300, y)));
    }
}
