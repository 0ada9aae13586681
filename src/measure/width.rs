//! Drawn widths against desired ones, from the ink alone.
use crate::ink::InkTrace;
use crate::math::stats;
use crate::measure::segments::SegmentGrid;
use crate::surface::SurfaceDrawing;

/// Spacing at which lines of desired width are asked how wide they came out, m.
const PROBE: f64 = 1e-4;

/// The relative error of the line's width that the share `p` of the length of all lines of desired width stays below:
/// `|drawn - desired| / desired`, which is 1 where no ink of the stroke lies within the desired width. `None` where no width
/// is desired.
pub fn width_error(desired: &SurfaceDrawing, trace: &InkTrace, p: f64) -> Option<f64> {
    let mut grid = SegmentGrid::new(1e-3);
    let mut drawn: Vec<(f64, f64)> = Vec::new();
    for stroke in &trace.strokes {
        let Some(id) = stroke.stroke else { continue };
        for (i, point) in stroke.points.iter().enumerate() {
            let next = stroke.points.get(i + 1).unwrap_or(point);
            grid.insert(point.position, next.position, label(id.layer as usize, id.index as usize));
            drawn.push((point.width, next.width));
        }
    }
    let mut errors = Vec::new();
    for (layer, l) in desired.layers.iter().enumerate() {
        for stroke in &l.strokes {
            let own = label(layer, stroke.index);
            for w in stroke.targets.windows(2) {
                let (Some(a), Some(b)) = (w[0].width, w[1].width) else { continue };
                let way = w[1].position - w[0].position;
                let count = (way.norm() / PROBE).ceil().max(1.0);
                for i in 0..count as usize {
                    let u = (i as f64 + 0.5) / count;
                    let width = a + (b - a) * u;
                    let near = grid.nearest(&(w[0].position + way * u), width, |l| l == own);
                    let is = near.map_or(0.0, |n| drawn[n.segment].0 * (1.0 - n.share) + drawn[n.segment].1 * n.share);
                    errors.push(((is / width - 1.0).abs(), way.norm() / count));
                }
            }
        }
    }
    stats::weighted_quantile(&mut errors, p)
}

fn label(layer: usize, stroke: usize) -> u64 {
    (layer as u64) << 32 | stroke as u64
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point2, Point3, Vector3};

    use super::*;
    use crate::drawing::StrokeId;
    use crate::ink::{InkPoint, InkStroke, TraceInk};
    use crate::math::Rgb;
    use crate::surface::{SurfaceLayer, SurfaceStroke, SurfaceTarget};

    /// A line of 100 mm that swells from 1 to 2 mm.
    fn desired() -> SurfaceDrawing {
        let target = |i: u32| {
            let x = f64::from(i) * 1e-2;
            let (position, width) = (Point3::new(x, 0.0, 0.0), Some(1e-3 + 1e-2 * x));
            SurfaceTarget { position, normal: Vector3::z(), sheet: Point2::new(x, 0.0), width }
        };
        let strokes = vec![SurfaceStroke { index: 0, targets: (0..=10).map(target).collect() }];
        let layer = SurfaceLayer { name: "a".into(), color: Rgb([0; 3]), strokes };
        SurfaceDrawing { layers: vec![layer], order: Vec::new() }
    }

    fn drawn(length: f64, width: impl Fn(f64) -> f64) -> InkTrace {
        let point = |i: u32| {
            let x = length * f64::from(i) / 1000.0;
            let position = Point3::new(x, 5e-5, 0.0);
            let (sheet, width) = (position.xy(), width(x));
            InkPoint { position, normal: Vector3::z(), sheet, width, density: 1.0, time: 0.0 }
        };
        let stroke = Some(StrokeId { layer: 0, index: 0 });
        let inks = vec![TraceInk { name: "a".into(), color: Rgb([0; 3]) }];
        InkTrace { inks, strokes: vec![InkStroke { ink: 0, stroke, arm: 0, points: (0..=1000).map(point).collect() }] }
    }

    #[test]
    fn the_error_is_relative_and_by_length() {
        let right = |x: f64| 1e-3 + 1e-2 * x;
        assert!(width_error(&desired(), &drawn(0.1, right), 0.9).unwrap() < 1e-6);
        assert!((width_error(&desired(), &drawn(0.1, |x| 1.07 * right(x)), 0.9).unwrap() - 0.07).abs() < 1e-6);
        // an even line of 1.5 mm: the error falls from 1/2 to 0 and rises to 1/4; a tenth of the length is above 4/11
        assert!((width_error(&desired(), &drawn(0.1, |_| 1.5e-3), 0.9).unwrap() - 4.0 / 11.0).abs() < 1e-3);
    }

    #[test]
    fn a_missing_line_has_no_width() {
        let half = drawn(0.05, |x| 1e-3 + 1e-2 * x);
        assert_eq!(width_error(&desired(), &half, 0.9), Some(1.0));
        assert!(width_error(&desired(), &half, 0.49).unwrap() < 1e-6);
        let mut plain = desired();
        plain.layers[0].strokes[0].targets.iter_mut().for_each(|t| t.width = None);
        assert_eq!(width_error(&plain, &half, 0.9), None);
    }
}
