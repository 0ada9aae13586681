//! Conformal mapping of a drawing onto a canvas.
use nalgebra::{Point2, Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::canvas::Canvas;
use super::mapped::Mapping;
use crate::mesh::{Chart, Distortion, Extent, FlatError, Flattening, Patch, PatchError, Repairs, SurfacePoint};

/// Least width of the surface round the drawing that is flattened with it, m, unless an option says otherwise.
const LEAST_MARGIN: f64 = 0.03;
/// The same, as a share of the drawing's larger side.
const MARGIN_SHARE: f64 = 0.25;
/// Radius round the anchor, m, in which "upright" is measured: a single triangle of a scan may lean any way.
const UPRIGHT_RADIUS: f64 = 0.01;
/// A point farther than this, m, from the surface is not on it.
const FAR: f64 = 0.05;
/// Largest mean error of angles, degrees, with which the surface that was asked for is taken without looking further.
const MOST_ANGLE_ERROR: f64 = 5.0;
/// Share of its error that another way may have at most to be taken instead.
const BETTER: f64 = 0.8;
/// How much longer the way along edges may be than the straight one, on triangles of equal sides.
const EDGE_DETOUR: f64 = 1.155;
/// Points at which the drawing's outline is looked up in the chart.
const OUTLINE: usize = 256;

/// How the canvas is flattened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FlattenMethod {
    /// Boundary first flattening: no pinned points, and the least variation of scale.
    #[default]
    Bff,
    /// Least squares conformal map, two points pinned.
    Lscm,
}

/// How much of the canvas is flattened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum PatchKind {
    /// The surface behind the sheet and a margin round it, as far as it faces the artist.
    #[default]
    Sheet,
    /// All of the surface that hangs together with the point behind the sheet's centre, cut open if it must be.
    Whole,
}

/// `[canvas.conformal]`: how a conformal map is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FlattenOptions {
    /// How the canvas is flattened.
    pub flattening: FlattenMethod,
    /// How much of the canvas is flattened.
    pub patch: PatchKind,
    /// Width of the surface round the drawing that is flattened with it; when absent, 30 mm or a quarter of the
    /// drawing's larger side, whichever is more.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1e4))]
    pub margin_mm: Option<f64>,
    /// Holes up to this wide may be crossed by the drawing.
    #[schemars(range(min = 0, max = 1e4))]
    pub bridge_mm: f64,
}

impl Default for FlattenOptions {
    fn default() -> Self {
        Self { flattening: FlattenMethod::Bff, patch: PatchKind::Sheet, margin_mm: None, bridge_mm: 10.0 }
    }
}

/// Why a canvas can't be flattened for a drawing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FlattenError {
    /// No piece of surface can be cut out.
    #[error(transparent)]
    Patch(#[from] PatchError),
    /// It can't be flattened.
    #[error(transparent)]
    Flat(#[from] FlatError),
    /// A size is not a positive length.
    #[error("a drawing of {width} x {height} m can't be laid on a surface")]
    BadSize {
        /// Width asked for, m.
        width: f64,
        /// Height asked for, m.
        height: f64,
    },
    /// The drawing is larger than the flattened surface.
    #[error(
        "a drawing of {width_mm:.1} x {height_mm:.1} mm is larger than the flattened canvas: at most {most_width_mm:.1} x {most_height_mm:.1} mm of these proportions fit there"
    )]
    TooLarge {
        /// Width of the drawing, mm.
        width_mm: f64,
        /// Its height, mm.
        height_mm: f64,
        /// Largest width that fits, mm.
        most_width_mm: f64,
        /// The height then, mm.
        most_height_mm: f64,
    },
}

/// What came of flattening a canvas.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlattenReport {
    /// Vertices that were flattened.
    pub vertices: usize,
    /// Triangles that were flattened.
    pub triangles: usize,
    /// What was mended first.
    pub repairs: Repairs,
    /// The repairs in plain words, one sentence each.
    pub mended: Vec<String>,
    /// How all of the chart is stretched.
    pub chart: Distortion,
}

/// A conformal map: a piece of the canvas is flattened so that angles are kept, and laid under the sheet so that the
/// sheet's centre is over the surface point that the artist sees behind it, the sheet's upward direction is upward
/// there, and lengths over the drawing's rectangle are real on average (the mean of the logarithm of scale is 0).
#[derive(Clone)]
pub struct ConformalMap {
    chart: Chart,
}

impl ConformalMap {
    /// Flattens the canvas round a drawing of size `sheet` (width, height, m).
    ///
    /// # Errors
    /// No surface there, a surface that can't be flattened, and a drawing larger than what is flattened: that is judged by
    /// the ellipse in the drawing's rectangle, since a round drawing may have no surface under its corners; a stroke
    /// that does reach into a corner without surface is refused by [`super::map_drawing`].
    pub fn new(
        canvas: &Canvas,
        sheet: [f64; 2],
        options: &FlattenOptions,
    ) -> Result<(Self, FlattenReport), FlattenError> {
        let [width, height] = sheet;
        if !sheet.iter().all(|s| s.is_finite() && *s > 0.0) {
            return Err(FlattenError::BadSize { width, height });
        }
        let half = sheet.map(|s| s / 2.0);
        let margin =
            options.margin_mm.map_or_else(|| LEAST_MARGIN.max(MARGIN_SHARE * width.max(height)), |mm| mm * 1e-3);
        let (chart, other_way) = best_chart(canvas, half, margin, options)?;
        let all = Distortion::of(&chart.stretches()).ok_or(FlatError::Collapsed)?;
        let map = Self { chart };
        let most = largest(&map.chart, half);
        if most < 1.0 {
            return Err(FlattenError::TooLarge {
                width_mm: 1e3 * width,
                height_mm: 1e3 * height,
                most_width_mm: 1e3 * width * most,
                most_height_mm: 1e3 * height * most,
            });
        }
        let patch = &map.chart.patch;
        let report = FlattenReport {
            vertices: patch.vertices.len(),
            triangles: patch.triangles.len(),
            repairs: patch.repairs.clone(),
            mended: other_way.into_iter().chain(patch.repairs.sentences()).collect(),
            chart: all,
        };
        Ok((map, report))
    }

    /// The flattened piece and its map. Triangles of surface points are those of its patch's mesh.
    pub fn chart(&self) -> &Chart {
        &self.chart
    }
}

/// Whether all of the drawing's outline lies on the chart, its corners too.
fn holds(chart: &Chart, half: [f64; 2]) -> bool {
    let side = OUTLINE / 4;
    (0..=side).map(|i| 2.0 * i as f64 / side as f64 - 1.0).all(|u| {
        let places = [(u, -1.0), (u, 1.0), (-1.0, u), (1.0, u)];
        places.iter().all(|(x, y)| chart.covers(&Point2::new(x * half[0], y * half[1])))
    })
}

/// The largest share of the drawing's size, at most 1, at which the ellipse in its rectangle lies on the chart.
fn largest(chart: &Chart, half: [f64; 2]) -> f64 {
    let fits = |share: f64| {
        (0..OUTLINE).all(|i| {
            let (y, x) = (std::f64::consts::TAU * i as f64 / OUTLINE as f64).sin_cos();
            chart.covers(&Point2::new(share * x * half[0], share * y * half[1]))
        })
    };
    if fits(1.0) {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        *(if fits(middle) { &mut low } else { &mut high }) = middle;
    }
    low
}

/// A chart of the surface round a drawing of half sides `half` (m), and in words how it was made where not as asked.
///
/// Where the surface that the options ask for can't be flattened by their method, or only with the angles of the drawing far off, the
/// other method is tried, and for a sheet's prism what is near along the surface, by both: the chart of the smallest error stays.
fn best_chart(
    canvas: &Canvas,
    half: [f64; 2],
    margin: f64,
    options: &FlattenOptions,
) -> Result<(Chart, Option<String>), FlattenError> {
    let method = |m: FlattenMethod| match m {
        FlattenMethod::Bff => Flattening::BoundaryFirst,
        FlattenMethod::Lscm => Flattening::LeastSquares,
    };
    let frame = &canvas.sheet.world_from_sheet;
    let up = frame * Vector3::y();
    let flatten = |extent, by| -> Result<(Chart, f64), FlattenError> {
        let patch = Patch::cut(&canvas.mesh, frame, extent, options.bridge_mm * 1e-3)?;
        let chart = Chart::new(patch, method(by), &Point2::origin(), half, &up, UPRIGHT_RADIUS)?;
        let error = Distortion::of(&chart.stretches_in(&Point2::origin(), half)).map_or(90.0, |d| d.angle_error_mean);
        Ok((chart, error))
    };
    let own = options.flattening;
    let other = if own == FlattenMethod::Bff { FlattenMethod::Lscm } else { FlattenMethod::Bff };
    let radius = EDGE_DETOUR * (half[0].hypot(half[1]) + margin);
    let prism = Extent::Prism(half.map(|h| h + margin));
    let (asked, ways) = match options.patch {
        PatchKind::Sheet => {
            // a chart that shrinks towards its middle needs more surface round it
            let along = [1.0, 1.5, 2.25].map(|more| Extent::Along(more * radius));
            (prism, [&along[..], &[prism]].concat())
        }
        PatchKind::Whole => (Extent::Whole, vec![Extent::Whole]),
    };
    let first = flatten(asked, own);
    if first.as_ref().is_ok_and(|(_, error)| *error <= MOST_ANGLE_ERROR) {
        return first.map(|(chart, _)| (chart, None));
    }
    let tried = ways.iter().flat_map(|extent| [(*extent, own), (*extent, other)]).filter(|way| *way != (asked, own));
    let best = tried
        .filter_map(|(extent, by)| flatten(extent, by).ok().map(|(chart, error)| (chart, error, extent, by)))
        .filter(|(chart, ..)| largest(chart, half) >= 1.0)
        .map(|(chart, error, extent, by)| (!holds(&chart, half), chart, error, extent, by))
        .min_by(|a, b| a.0.cmp(&b.0).then(a.2.total_cmp(&b.2)))
        .map(|(_, chart, error, extent, by)| (chart, error, extent, by));
    match (first, best) {
        (Err(why), None) => Err(why),
        (Ok((chart, _)), None) => Ok((chart, None)),
        (Ok((chart, error)), Some(better)) if better.1 > BETTER * error => Ok((chart, None)),
        (_, Some((chart, _, extent, by))) => {
            let along = if matches!(extent, Extent::Along(_)) {
                ", grown along the surface, which overhangs or folds under the sheet"
            } else {
                ""
            };
            let by =
                if by == FlattenMethod::Bff { "boundary first flattening" } else { "a least squares conformal map" };
            Ok((chart, Some(format!("flattened by {by}{along}"))))
        }
    }
}

impl Mapping for ConformalMap {
    fn to_surface(&self, sheet: &Point2<f64>) -> Option<SurfacePoint> {
        self.chart.to_surface(sheet)
    }

    /// The chart's point at the nearest surface point; `None` farther than 50 mm from the surface, beyond its boundary, and
    /// over holes that stay open.
    fn to_sheet(&self, world: &Point3<f64>) -> Option<Point2<f64>> {
        self.chart.to_flat(world, FAR)
    }

    fn kind(&self) -> &'static str {
        "conformal"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Pose;
    use crate::mesh::shapes::{self, Bumps};
    use crate::surface::{Projection, SheetFrame, StretchField};

    fn column() -> Canvas {
        let bumps = Bumps { amplitude: 0.003, wavelength: 0.14 };
        let mesh = shapes::column(0.15, 0.4, &bumps, 0.006).unwrap();
        let turn = crate::math::frame_from_axes(&-Vector3::x(), &-Vector3::y());
        let world_from_sheet = Pose::from_parts(nalgebra::Translation3::new(-0.2, 0.0, 0.2), turn);
        Canvas { name: "column".into(), mesh, sheet: SheetFrame { world_from_sheet } }
    }

    #[test]
    fn squares_stay_square_where_projection_stretches_them() {
        let sheet = [0.2, 0.2];
        let (map, report) = ConformalMap::new(&column(), sheet, &FlattenOptions::default()).unwrap();
        assert!(report.mended.is_empty() && report.chart.flips == 0, "{report:?}");
        let projection = Projection::new(&column());
        let side = |mapping: &dyn Mapping, a: Point2<f64>, b: Point2<f64>| {
            let at = |i: i32| mapping.to_surface(&(a + (b - a) * (f64::from(i) / 100.0))).unwrap().position;
            (0..100).map(|i| (at(i + 1) - at(i)).norm()).sum::<f64>() / (b - a).norm() - 1.0
        };
        let worst = |mapping: &dyn Mapping| {
            let at = |i: i32, j: i32| Point2::new(f64::from(2 * i - 7) / 70.0, f64::from(2 * j - 7) / 70.0);
            let sides =
                (0..7).flat_map(|i| (0..=7).flat_map(move |j| [(at(i, j), at(i + 1, j)), (at(j, i), at(j, i + 1))]));
            sides.map(|(a, b)| side(mapping, a, b).abs()).fold(0.0, f64::max)
        };
        let (ours, theirs) = (worst(&map), worst(&projection));
        assert!(ours < 0.02 && theirs > 0.2, "{ours} {theirs}");
        let skew = |mapping: &dyn Mapping| StretchField::of(mapping, sheet).distortion().unwrap();
        assert!(skew(&map).angle_error_mean < 0.2, "{:?}", skew(&map));
        assert!(skew(&projection).angle_error_p95 > 5.0, "{:?}", skew(&projection));
    }

    #[test]
    fn the_drawing_lies_upright_under_the_sheet_and_true_to_size() {
        let canvas = column();
        let (map, _) = ConformalMap::new(&canvas, [0.1, 0.1], &FlattenOptions::default()).unwrap();
        let at = |x: f64, y: f64| map.to_surface(&Point2::new(x, y)).unwrap().position;
        let seen = Projection::new(&canvas).to_surface(&Point2::origin()).unwrap().position;
        assert!((at(0.0, 0.0) - seen).norm() < 1e-6);
        let up = at(0.0, 0.004) - at(0.0, -0.004);
        assert!((up.norm() / 0.008 - 1.0).abs() < 0.02);
        let right = canvas.sheet.world_from_sheet * Vector3::x();
        assert!((up.dot(&right) / up.norm()).abs() < 0.02);
    }

    #[test]
    fn a_drawing_larger_than_the_chart_is_told_how_large_it_may_be() {
        let new = |sheet| ConformalMap::new(&column(), sheet, &FlattenOptions::default());
        let Err(FlattenError::TooLarge { most_width_mm, most_height_mm, .. }) = new([0.3, 0.6]) else {
            panic!("is refused")
        };
        assert!((380.0..405.0).contains(&most_height_mm), "{most_height_mm}");
        assert!(new([0.95e-3 * most_width_mm, 0.95e-3 * most_height_mm]).is_ok());
        assert!(matches!(new([0.0, 0.1]), Err(FlattenError::BadSize { .. })));
    }

    /// A plane with a nose of the given height (m) that leans over.
    fn nose(height: f64, triangle: f64) -> Canvas {
        let plane = shapes::rectangle(0.4, 0.4, 0.0, triangle).unwrap();
        let lean = |p: &Point3<f64>| {
            let z = height * (-p.coords.norm_squared() / (0.03f64 * 0.03)).exp();
            Point3::new(p.x, p.y - 1.5 * z, z)
        };
        let mesh = crate::mesh::TriMesh::new(plane.vertices().iter().map(lean).collect(), plane.triangles().to_vec());
        let world_from_sheet = Pose::translation(0.0, 0.0, 0.3);
        Canvas { name: "nose".into(), mesh: mesh.unwrap(), sheet: SheetFrame { world_from_sheet } }
    }

    #[test]
    fn a_surface_that_overhangs_is_laid_flat_without_folds_and_a_gentle_one_is_cut_as_ever() {
        let sheet = [0.1, 0.1];
        let of = |height| ConformalMap::new(&nose(height, 0.004), sheet, &FlattenOptions::default()).unwrap();
        let (_, gentle) = of(0.01);
        assert_eq!(gentle.mended, Vec::<String>::new());
        let (map, report) = of(0.05);
        let d = StretchField::of(&map, sheet).distortion().unwrap();
        assert!(report.chart.flips == 0 && d.angle_error_mean < 5.0, "{d:?} {:?}", report.mended);
        // the tip of the nose and what it hides from the sheet are drawn on
        assert!(map.to_sheet(&Point3::new(0.0, -0.075, 0.05)).is_some());
        let hidden = Point3::new(0.0, -0.0529, 0.0053);
        let back = map.to_surface(&map.to_sheet(&hidden).unwrap()).unwrap();
        assert!((back.position - hidden).norm() < 2e-3, "{}", back.position);
        assert!(map.to_surface(&Point2::new(0.05, -0.05)).is_some());
    }

    #[test]
    fn points_off_the_patch_have_no_place_in_the_chart() {
        let (map, _) = ConformalMap::new(&column(), [0.1, 0.1], &FlattenOptions::default()).unwrap();
        assert!(map.to_sheet(&Point3::new(-0.16, 0.0, 0.2)).is_some());
        assert!(map.to_sheet(&Point3::new(0.15, 0.0, 0.2)).is_none());
        assert!(map.to_sheet(&Point3::new(-0.15, 0.0, 0.39)).is_none());
        assert!(map.to_sheet(&Point3::new(f64::NAN, 0.0, 0.39)).is_none());
    }
}
