//! The trace as a flat picture, by a tile rasteriser on the CPU.
//!
//! Lines are chains of round-capped segments of varying width, anti-aliased by the overlap of a pixel with the line across
//! it. Within a stroke the strongest coverage of a pixel counts, so joints don't darken. Between strokes, and where a stroke
//! comes back to a pixel later, light is absorbed once more: a layer of coverage `c` and density `D` lets `1 - c (1 -
//! exp(-D a))` of the light through, so whole pixels show `paper exp(-sum D a)` and crossings darken.
//!
//! Tiles are rendered independently and each in the order of the trace, so the picture is the same at any number of threads.
use rayon::prelude::*;

use crate::ink::optics::absorbance;
use crate::ink::segment::{Bins, Segment, TILE, stroke_segments};
use crate::ink::tile::{Absorber, Colours, Tile};
use crate::ink::{InkError, InkTrace, RasterOptions};
use crate::math::{SrgbTable, linear_from_srgb};
use crate::picture::Image;

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
    Ok(Image::new(columns, rows, rgb)?)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ink::{InkPoint, InkStroke, TraceInk};
    use crate::math::{PAPER, Rgb, srgb_from_linear};
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
        let desired = a * a * (half - lean) + b * b * (half + lean) + (a + b) * length * lean.cos();
        let got = area(&picture(vec![cone]), BLUE, 16.0);
        assert!((got / desired - 1.0).abs() < 0.005, "{got} mm^2 of {desired}");
    }

    #[test]
    fn the_area_of_a_line_is_its_width_times_its_length() {
        for (width, angle) in [(0.1, 0.0), (0.4, 0.3), (0.8, 0.785), (0.8, 1.2), (1.5, 1.57)] {
            let (dx, dy) = (40.0 * f64::cos(angle), 40.0 * f64::sin(angle));
            let points: Vec<(f64, f64)> =
                (0..=400).map(|i| (f64::from(i) / 200.0 - 1.0, 0.013)).map(|(t, o)| (t * dx + o, t * dy)).collect();
            let options = RasterOptions::with_long_side(0.1, 0.1, 1000);
            let image = rasterise(&trace(vec![stroke(1, width, &points)]), &options).unwrap();
            let desired = 80.0 * width + std::f64::consts::FRAC_PI_4 * width * width;
            let got = area(&image, BLUE, options.px_per_mm);
            assert!((got / desired - 1.0).abs() < 0.005, "{width} mm at {angle} rad: {got} mm^2 of {desired}");
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
