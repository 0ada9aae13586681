//! The true canvas as it differs from the nominal one: relief, dents, boards, and errors of place and scale.
//!
//! Everything random is drawn from the run's seed, each part from its own stream, so that one part never shifts another.
use nalgebra::{Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::TrueCanvas;
use crate::math::{Pose, rotation_vector, standard_normal, stream, unit};
use crate::mesh::{Boards, Dent, MeshError, RandomField, ReliefError, TriMesh, clad, dented, hausdorff, rough};
use crate::surface::{Canvas, SheetFrame};

/// Cosine, to the direction towards the artist, from which on a part of the surface may be dented: 60 degrees.
const DENTED: f64 = 0.5;

/// In which direction boards run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlankKind {
    /// There are none.
    #[default]
    None,
    /// Up the sheet.
    Vertical,
    /// Across the sheet.
    Horizontal,
    /// Boards up the sheet, each cut across, with steps and gaps both ways.
    Both,
}

/// How the true canvas differs from the nominal one. SI units; the default differs in nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthOptions {
    /// Two-sided Hausdorff distance that a random relief makes, as a share of the canvas's size: the longest side of its
    /// axis-aligned bounds, 2 R of a half-sphere.
    pub relief: f64,
    /// Shortest wave of the relief, m; half the canvas's size where `None`.
    pub relief_wavelength: Option<f64>,
    /// Boards that the face is made of.
    pub planks: PlankKind,
    /// From board to board, m.
    pub plank_width: f64,
    /// Largest step between two boards, m: they stand out by as much as half of it either way, evenly spread.
    pub plank_step: f64,
    /// Between two boards, m.
    pub plank_gap: f64,
    /// Width and depth of their eased edges, m.
    pub plank_bevel: f64,
    /// Dents in what faces the sheet.
    pub dents: u32,
    /// Depth of a dent, m; below 0 it is a bump.
    pub dent_depth: f64,
    /// Radius of a dent, m.
    pub dent_radius: f64,
    /// How far the canvas stands from where it is believed, m, world.
    pub offset: [f64; 3],
    /// Standard deviation of a random part of that, m.
    pub offset_sd: [f64; 3],
    /// Roll, pitch and yaw of the canvas about its middle, rad, about the world's axes in that order.
    pub turn: [f64; 3],
    /// Standard deviation of a random part of that, rad.
    pub turn_sd: [f64; 3],
    /// How much larger the canvas is about its middle, as a share.
    pub scale: f64,
    /// Standard deviation of a random part of that.
    pub scale_sd: f64,
}

impl Default for TruthOptions {
    fn default() -> Self {
        Self {
            relief: 0.0,
            relief_wavelength: None,
            planks: PlankKind::None,
            plank_width: 0.1,
            plank_step: 0.002,
            plank_gap: 0.0,
            plank_bevel: 0.002,
            dents: 0,
            dent_depth: 0.003,
            dent_radius: 0.03,
            offset: [0.0; 3],
            offset_sd: [0.0; 3],
            turn: [0.0; 3],
            turn_sd: [0.0; 3],
            scale: 0.0,
            scale_sd: 0.0,
        }
    }
}

/// How the true canvas came out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TruthReport {
    /// Longest side of the nominal mesh's bounds, m: what `relief` is a share of.
    pub size: f64,
    /// Measured two-sided Hausdorff distance between true and nominal shape, m, place and scale left out.
    pub hausdorff: f64,
    /// How far the canvas stands from where it is believed, m, world.
    pub offset: Vector3<f64>,
    /// By which angle it is turned, rad.
    pub turn: f64,
    /// How much larger it is, as a share.
    pub scale: f64,
}

/// Why the true canvas can't be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TruthError {
    /// The relief doesn't work out.
    #[error("truth.relief_percent: {0}")]
    Relief(#[from] ReliefError),
    /// The mesh doesn't.
    #[error("truth: {0}")]
    Mesh(#[from] MeshError),
    /// No part of the surface faces the sheet.
    #[error("truth.dents: no part of the canvas faces the sheet")]
    NothingFaces,
}

/// The true canvas: the nominal one with all that `options` say, drawn from `seed`. Shape comes first (relief, dents, boards), then
/// scale and place. The sheet goes with the canvas: the drawing is desired on the object, wherever that is.
///
/// # Errors
/// A relief that folds the surface, dents without a place, and whatever a mesh can be refused for.
pub fn perturb(nominal: &Canvas, options: &TruthOptions, seed: u64) -> Result<(TrueCanvas, TruthReport), TruthError> {
    let (low, high) = nominal.mesh.bounds();
    let size = (high - low).max();
    let outward = Unit::new_unchecked(nominal.sheet.world_from_sheet.rotation * Vector3::z());
    let mut mesh = nominal.mesh.clone();
    let mut apart = 0.0;
    if options.relief > 0.0 {
        let wavelength = options.relief_wavelength.unwrap_or(size / 2.0);
        let field = RandomField::new(wavelength, &mut stream(seed, "truth: relief", 0));
        (mesh, apart) = rough(&mesh, &field, wavelength, options.relief * size, &outward)?;
    }
    let dents = options.dents > 0 && options.dent_depth != 0.0;
    if dents {
        mesh = dented(&mesh, &scattered(&mesh, &outward, options, seed)?)?;
    }
    let sheet_from_world = nominal.sheet.world_from_sheet.inverse();
    let planks: &[bool] = match options.planks {
        PlankKind::None => &[],
        PlankKind::Vertical => &[false],
        PlankKind::Horizontal => &[true],
        PlankKind::Both => &[false, true],
    };
    for &across in planks {
        let boards = boards(&mesh, &sheet_from_world, across, options, seed);
        mesh = clad(&mesh, &sheet_from_world, across, &boards)?;
    }
    if dents || !planks.is_empty() {
        apart = hausdorff(&mesh, &nominal.mesh);
    }
    let mut report = TruthReport { size, hausdorff: apart, ..Default::default() };
    let canvas = placed(nominal, mesh, options, seed, &mut report)?;
    Ok((TrueCanvas::new(canvas), report))
}

/// The nominal canvas at the true one's scale and place, where [`perturb`] gives it another shape; `None` where only scale and place differ.
///
/// # Errors
/// Whatever the mesh can be refused for.
pub fn unshaped(nominal: &Canvas, options: &TruthOptions, seed: u64) -> Result<Option<Canvas>, TruthError> {
    let shaped =
        options.relief > 0.0 || (options.dents > 0 && options.dent_depth != 0.0) || options.planks != PlankKind::None;
    let place = || placed(nominal, nominal.mesh.clone(), options, seed, &mut TruthReport::default());
    shaped.then(place).transpose()
}

/// Dents at places spread evenly over what faces `outward`.
fn scattered(
    mesh: &TriMesh,
    outward: &Unit<Vector3<f64>>,
    options: &TruthOptions,
    seed: u64,
) -> Result<Vec<Dent>, TruthError> {
    let corners = |t: &[u32; 3]| t.map(|i| mesh.vertices()[i as usize]);
    let mut areas: Vec<(f64, u32)> = Vec::new();
    let mut total = 0.0;
    for (i, (t, n)) in mesh.triangles().iter().zip(mesh.face_normals()).enumerate() {
        if n.dot(outward) >= DENTED {
            let [a, b, c] = corners(t);
            total += (b - a).cross(&(c - a)).norm() / 2.0;
            areas.push((total, i as u32));
        }
    }
    if areas.is_empty() {
        return Err(TruthError::NothingFaces);
    }
    let mut random = stream(seed, "truth: dents", 0);
    let dent = |_| {
        let at = unit(&mut random) * total;
        let (_, triangle) = areas[areas.partition_point(|(sum, _)| *sum < at).min(areas.len() - 1)];
        let middle = mesh.point_at(triangle, [1.0 / 3.0; 3]).position;
        Dent { middle, depth: options.dent_depth, radius: options.dent_radius }
    };
    Ok((0..options.dents).map(dent).collect())
}

/// Boards that cover all of the mesh: the first begins at a random place, each stands out by a random height.
fn boards(mesh: &TriMesh, sheet_from_world: &Pose, across: bool, options: &TruthOptions, seed: u64) -> Boards {
    let at = |p: &Point3<f64>| {
        let p = sheet_from_world * p;
        if across { p.y } else { p.x }
    };
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for v in mesh.vertices() {
        (low, high) = (low.min(at(v)), high.max(at(v)));
    }
    let mut random = stream(seed, "truth: planks", u64::from(across));
    let start = low - options.plank_width * (1.0 + unit(&mut random));
    let count = ((high - start) / options.plank_width).ceil() as usize + 1;
    let offsets = (0..count).map(|_| (unit(&mut random) - 0.5) * options.plank_step).collect();
    Boards { start, width: options.plank_width, gap: options.plank_gap, bevel: options.plank_bevel, offsets }
}

/// The shape, scaled and moved together with its sheet.
fn placed(
    nominal: &Canvas,
    mesh: TriMesh,
    options: &TruthOptions,
    seed: u64,
    report: &mut TruthReport,
) -> Result<Canvas, TruthError> {
    let mut random = stream(seed, "truth: place", 0);
    let mut varied = |mean: [f64; 3], sd: [f64; 3]| {
        Vector3::from(std::array::from_fn::<f64, 3, _>(|i| mean[i] + sd[i] * standard_normal(&mut random)))
    };
    let offset = varied(options.offset, options.offset_sd);
    let turn = varied(options.turn, options.turn_sd);
    let scale = varied([options.scale, 0.0, 0.0], [options.scale_sd, 0.0, 0.0]).x.max(-0.9);
    let rotation = UnitQuaternion::from_euler_angles(turn.x, turn.y, turn.z);
    (report.offset, report.turn, report.scale) = (offset, rotation_vector(&rotation).norm(), scale);
    let mut canvas = Canvas { name: nominal.name.clone(), mesh, sheet: nominal.sheet.clone() };
    let (low, high) = nominal.mesh.bounds();
    let middle = nalgebra::center(&low, &high);
    if scale != 0.0 {
        let grown = |p: &Point3<f64>| middle + (p - middle) * (1.0 + scale);
        let vertices = canvas.mesh.vertices().iter().map(grown).collect();
        canvas.mesh = TriMesh::new(vertices, canvas.mesh.triangles().to_vec())?;
        let mut pose = canvas.sheet.world_from_sheet;
        pose.translation = Translation3::from(grown(&Point3::from(pose.translation.vector)).coords);
        canvas.sheet = SheetFrame { world_from_sheet: pose };
    }
    if offset != Vector3::zeros() || turn != Vector3::zeros() {
        let about_middle =
            Pose::from_parts(Translation3::from(middle.coords + offset), rotation) * Translation3::from(-middle.coords);
        canvas.mesh = canvas.mesh.transformed(&about_middle);
        canvas.sheet = SheetFrame { world_from_sheet: about_middle * canvas.sheet.world_from_sheet };
    }
    Ok(canvas)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::surface::{Mapping, Projection};
    use nalgebra::Point2;

    fn dome() -> Canvas {
        let mesh = shapes::dome(0.15, 0.005).unwrap().transformed(&Pose::translation(0.5, 0.0, 0.1));
        let world_from_sheet = Pose::translation(0.5, 0.0, 0.3);
        Canvas { name: "dome".into(), mesh, sheet: SheetFrame { world_from_sheet } }
    }

    #[test]
    fn nothing_asked_is_nothing_changed() {
        let (truth, report) = perturb(&dome(), &TruthOptions::default(), 7).unwrap();
        assert_eq!(truth.mesh().vertices(), dome().mesh.vertices());
        assert_eq!(*truth.sheet(), dome().sheet);
        assert_eq!((report.hausdorff, report.turn, report.scale), (0.0, 0.0, 0.0));
    }

    #[test]
    fn relief_is_of_the_asked_size_and_differs_from_seed_to_seed() {
        let options = TruthOptions { relief: 0.035, ..Default::default() };
        let (a, report) = perturb(&dome(), &options, 1).unwrap();
        assert!((report.hausdorff / 0.0105 - 1.0).abs() < 0.01 && (report.size - 0.3).abs() < 1e-9);
        let (same, _) = perturb(&dome(), &options, 1).unwrap();
        assert_eq!(a.mesh().vertices(), same.mesh().vertices());
        let (other, _) = perturb(&dome(), &options, 2).unwrap();
        assert!(hausdorff(a.mesh(), other.mesh()) > 2e-3);
        // the relief doesn't hang on what else is asked for
        let moved = TruthOptions { offset: [0.01, 0.0, 0.0], ..options };
        let (moved, _) = perturb(&dome(), &moved, 1).unwrap();
        let back = moved.mesh().transformed(&Pose::translation(-0.01, 0.0, 0.0));
        assert!(hausdorff(a.mesh(), &back) < 1e-9);
    }

    #[test]
    fn the_sheet_goes_with_the_canvas() {
        let options =
            TruthOptions { offset: [0.01, -0.02, 0.03], turn: [0.0, 0.1, 0.2], scale: 0.05, ..Default::default() };
        let (truth, report) = perturb(&dome(), &options, 1).unwrap();
        let (there, here) = (Projection::new(truth.reveal()), Projection::new(&dome()));
        for (x, y) in [(0.0, 0.0), (0.03, 0.02), (-0.05, 0.01)] {
            let on_truth = there.to_surface(&Point2::new(x * 1.05, y * 1.05)).unwrap().position;
            let on_nominal = here.to_surface(&Point2::new(x, y)).unwrap().position;
            let (low, high) = dome().mesh.bounds();
            let middle = nalgebra::center(&low, &high);
            let rotation = UnitQuaternion::from_euler_angles(0.0, 0.1, 0.2);
            let desired = middle + Vector3::new(0.01, -0.02, 0.03) + rotation * ((on_nominal - middle) * 1.05);
            assert!((on_truth - desired).norm() < 1e-9, "{on_truth} {desired}");
        }
        assert!((report.scale, report.offset.z) == (0.05, 0.03) && report.turn > 0.2);
    }

    #[test]
    fn random_errors_of_place_have_their_spread() {
        let options = TruthOptions { offset_sd: [0.002, 0.0, 0.001], scale_sd: 0.01, ..Default::default() };
        let reports: Vec<_> = (0..60).map(|s| perturb(&dome(), &options, s).unwrap().1).collect();
        let sd = |f: fn(&TruthReport) -> f64| (reports.iter().map(|r| f(r).powi(2)).sum::<f64>() / 60.0).sqrt();
        assert!((sd(|r| r.offset.x) / 0.002 - 1.0).abs() < 0.35, "{}", sd(|r| r.offset.x));
        assert!(reports.iter().all(|r| r.offset.y == 0.0));
        assert!((sd(|r| r.scale) / 0.01 - 1.0).abs() < 0.35);
    }

    #[test]
    fn dents_and_boards_are_there() {
        let options = TruthOptions { dents: 4, ..Default::default() };
        let (_, report) = perturb(&dome(), &options, 3).unwrap();
        assert!((report.hausdorff - 0.003).abs() < 2e-4, "{}", report.hausdorff);
        let wall = Canvas { mesh: shapes::rectangle(0.4, 0.3, 0.0, 0.005).unwrap(), ..dome() };
        let options = TruthOptions { planks: PlankKind::Both, plank_step: 0.01, ..Default::default() };
        let (truth, report) = perturb(&wall, &options, 3).unwrap();
        assert!(report.hausdorff > 0.003 && report.hausdorff < 0.0145, "{}", report.hausdorff);
        assert!(Projection::new(truth.reveal()).to_surface(&Point2::new(-0.5 + 0.01, 0.02)).is_some());
    }
}
