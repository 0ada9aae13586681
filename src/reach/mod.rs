//! Where the arms of a robot can draw, and the largest canvas that fits there.

mod canvas;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use serde::Serialize;

use crate::artwork::{self, ArtworkError};
use crate::mesh::{MeshError, TriMesh};
use crate::plan::{GridError, PlanOptions, Reach, ReachGrid, ReachMap, ReachProbe, Slice, slices};
use crate::progress::Progress;
use crate::report::{FigureError, OutputDir, OutputError, npy_bytes, read_npy_bytes};
use crate::robot::{Arm, Cell, RobotError};
use crate::scenario::Sketch;

use canvas::{CanvasJson, Placed, Tried, mm, rounded};

/// Side of the piece of canvas that is taken to be at each point, m.
const PATCH: f64 = 0.2;

/// Why there is nothing to tell.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReachError {
    /// The points can't be laid out.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The depths are no range.
    #[error("depths {near_mm} to {far_mm} mm must be finite and rise")]
    Depths {
        /// The nearer, mm.
        near_mm: f64,
        /// The farther, mm.
        far_mm: f64,
    },
    /// They lie between two layers of points.
    #[error("no depth between {near_mm} and {far_mm} mm is looked at: depths are multiples of {spacing_mm} mm")]
    NoDepth {
        /// The nearer, mm.
        near_mm: f64,
        /// The farther, mm.
        far_mm: f64,
        /// Distance between layers, mm.
        spacing_mm: f64,
    },
    /// The aspect is no ratio.
    #[error("a canvas {aspect} times as wide as high can't be: the ratio must be from 0.01 to 100")]
    Aspect {
        /// Width by height.
        aspect: f64,
    },
    /// No point there is reached by all arms.
    #[error("no canvas between {near_mm:.0} and {far_mm:.0} mm is reached by {arms}: {reached}")]
    NoPoint {
        /// The nearer depth, mm.
        near_mm: f64,
        /// The farther, mm.
        far_mm: f64,
        /// Which arms were asked.
        arms: String,
        /// What each reaches.
        reached: String,
    },
    /// Points are reached, but no rectangle.
    #[error(
        "between {near_mm:.0} and {far_mm:.0} mm {points} single points are reached, but no rectangle: take a finer spacing"
    )]
    NoRectangle {
        /// The nearer depth, mm.
        near_mm: f64,
        /// The farther, mm.
        far_mm: f64,
        /// Points that are reached.
        points: usize,
    },
    /// A shape can't be made.
    #[error(transparent)]
    Shape(#[from] MeshError),
    /// The picture can't be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// The robot can't be used.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The artwork can't be drawn.
    #[error(transparent)]
    Artwork(#[from] ArtworkError),
    /// An output can't be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Figures can't be written as JSON.
    #[error("figures can't be written: {0}")]
    Json(#[from] serde_json::Error),
}

/// What is asked.
#[derive(Clone, Debug)]
pub struct ReachRequest {
    /// The robot's file.
    pub robot: PathBuf,
    /// Names of the arms that are all to draw on the canvas; all arms when empty.
    pub arms: Vec<String>,
    /// Direction of the pen, out of the nib, world; the world axis nearest to the first arm's at home when absent.
    pub axis: Option<[f64; 3]>,
    /// Distance between points, m.
    pub spacing: f64,
    /// Desired depths of the canvas from the first arm's base along the pen, m; any when absent.
    pub depths: Option<[f64; 2]>,
    /// Width of the canvas by its height, where there is no drawing to say it.
    pub aspect: f64,
    /// What is to be drawn, with its file.
    pub drawing: Option<(PathBuf, Sketch)>,
    /// Folder in which maps are kept; `cache` in the output folder when absent.
    pub cache: Option<PathBuf>,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Reached {
    /// In a few lines.
    pub summary: String,
    /// The files written, in the order written.
    pub files: Vec<PathBuf>,
}

/// reach.json.
#[derive(Debug, Serialize)]
struct ReachJson {
    schema: u32,
    robot: String,
    /// Frame of the grid, world.
    origin_mm: [f64; 3],
    right: [f64; 3],
    up: [f64; 3],
    axis: [f64; 3],
    spacing_mm: f64,
    /// Coordinates of the first node: right, up, depth.
    first_mm: [f64; 3],
    size: [usize; 3],
    arms: Vec<ArmJson>,
    aspect: f64,
    depths: Vec<DepthJson>,
    canvas: CanvasJson,
}

#[derive(Debug, Serialize)]
struct ArmJson {
    name: String,
    map: String,
    points_free: usize,
    points_blocked: usize,
    digest: String,
    /// Of the points tried on the canvas at last, those that the arm can draw at.
    tried: usize,
    tried_free: usize,
}

#[derive(Debug, Serialize)]
struct DepthJson {
    depth_mm: f64,
    points: usize,
    width_mm: f64,
    height_mm: f64,
}

/// Finds where the arms can draw and the largest canvas there; writes the maps, a picture, reach.json, and the canvas as a
/// scene (with a drawing also a scenario) into `out`. Nothing is written when there is no such canvas.
pub fn reach(request: &ReachRequest, out: &OutputDir, progress: &dyn Progress) -> Result<Reached, ReachError> {
    let cell = Cell::load(&request.robot)?;
    let chosen = match request.arms.as_slice() {
        [] => (0..cell.arms.len()).collect(),
        names => names.iter().map(|n| cell.arm_index(Some(n))).collect::<Result<Vec<_>, _>>()?,
    };
    if let Some([near, far]) = request.depths
        && !(near.is_finite() && far.is_finite() && near <= far)
    {
        return Err(ReachError::Depths { near_mm: near * 1e3, far_mm: far * 1e3 });
    }
    let drawing = match &request.drawing {
        Some((_, sketch)) => Some(artwork::make(sketch, progress)?.drawing),
        None => None,
    };
    let aspect = drawing.as_ref().map_or(request.aspect, |d| d.width / d.height);
    if !(0.01..=100.0).contains(&aspect) {
        return Err(ReachError::Aspect { aspect });
    }
    let arms: Vec<&Arm> = chosen.iter().map(|i| &cell.arms[*i]).collect();
    let axis = request.axis.map_or_else(|| looking(arms[0]), Vector3::from);
    let models: Vec<_> = arms.iter().map(|a| &a.model).collect();
    let grid = ReachGrid::around(&models, &axis, request.spacing)?;
    let cache = OutputDir::check(request.cache.as_deref().unwrap_or(&out.path().join("cache")))?;
    let solids = chosen.iter().map(|i| {
        let others = cell.arms.iter().enumerate().filter(|(other, _)| other != i).map(|(_, arm)| arm);
        cell.solids(others)
    });
    let solids = solids.collect::<Result<Vec<Vec<TriMesh>>, _>>()?;
    let options = PlanOptions::default();
    let mut probes = Vec::new();
    for (arm, solids) in arms.iter().zip(&solids) {
        let probe = ReachProbe::new(&arm.model, &arm.home, solids, &grid.axis, &options, PATCH);
        probes.push(probe?);
    }
    let (mut maps, mut to_keep) = (Vec::new(), Vec::new());
    for (arm, probe) in arms.iter().zip(&probes) {
        let made = kept_or_made(&arm.model.name, probe, &grid, &cache, progress);
        maps.push(made.map);
        to_keep.push(made.to_keep);
    }
    let of_all: Vec<&ReachMap> = maps.iter().collect();
    let [near, far] = request.depths.unwrap_or([grid.coordinate(2, 0), grid.coordinate(2, grid.size[2] - 1)]);
    let depths = slices(&of_all, aspect, near, far);
    if depths.is_empty() && far - near < grid.spacing {
        return Err(ReachError::NoDepth { near_mm: near * 1e3, far_mm: far * 1e3, spacing_mm: grid.spacing * 1e3 });
    }
    progress.stage("trying canvases", None);
    let (canvas, tried) = choose(&grid, &depths, &arms, &maps, &probes, [near, far])?;
    let json = ReachJson {
        schema: 1,
        robot: cell.name.clone(),
        origin_mm: mm(&grid.origin.coords),
        right: grid.right.into(),
        up: grid.up.into(),
        axis: grid.axis.into(),
        spacing_mm: rounded(grid.spacing * 1e3),
        first_mm: std::array::from_fn(|d| rounded(grid.coordinate(d, 0) * 1e3)),
        size: grid.size,
        arms: arms.iter().zip(&maps).zip(&tried).map(|((arm, map), tried)| arm_json(arm, map, *tried)).collect(),
        aspect,
        depths: depths.iter().filter(|s| s.points > 0).map(depth_json).collect(),
        canvas: canvas.json(),
    };
    let mut files = Vec::new();
    for ((arm, map), to_keep) in arms.iter().zip(&maps).zip(&to_keep) {
        let npy = npy_of(map);
        if let Some(name) = to_keep {
            cache.write(name, &npy)?;
        }
        files.push(out.write(&map_name(arm), &npy)?);
    }
    files.push(out.write("reach.json", (serde_json::to_string_pretty(&json)? + "\n").as_bytes())?);
    let figure = canvas.figure(&cell.name, &arms, &maps, near, far, drawing.as_ref());
    files.push(out.write("reach.svg", figure.svg().as_bytes())?);
    files.push(out.write("reach.png", &figure.png()?)?);
    files.push(out.write("canvas.toml", canvas.scene(&cell.name).as_bytes())?);
    if let Some((file, _)) = &request.drawing {
        let arm = (cell.arms.len() > 1).then(|| arms[0].model.name.as_str());
        let toml = canvas.scenario(&request.robot, arm, file);
        files.push(out.write("scenario.toml", toml.as_bytes())?);
    }
    Ok(Reached { summary: summary(&json, out.path()), files })
}

/// The world axis nearest to the pen of `arm` at home.
fn looking(arm: &Arm) -> Vector3<f64> {
    let z = arm.model.kinematics(&arm.home).world_from_tip().rotation * Vector3::z();
    let d = z.iamax();
    let mut axis = Vector3::zeros();
    axis[d] = z[d].signum();
    axis
}

fn map_name(arm: &Arm) -> String {
    // names are a user's; files are not to leave the folder
    let safe = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
    format!("reach-{}.npy", arm.model.name.chars().map(safe).collect::<String>())
}

/// A map, and the name under which it is kept if it isn't yet.
pub(crate) struct Made {
    pub map: ReachMap,
    pub to_keep: Option<String>,
}

/// The map from the cache, or a new one. What is kept in a wrong form is made anew.
pub(crate) fn kept_or_made(
    name: &str,
    probe: &ReachProbe,
    grid: &ReachGrid,
    cache: &OutputDir,
    progress: &dyn Progress,
) -> Made {
    let file = format!("reach-{}.npy", probe.key(grid));
    let kept = std::fs::read(cache.path().join(&file)).ok().and_then(|bytes| {
        read_npy_bytes(&grid.size, &bytes)?.iter().map(|b| Reach::from_byte(*b)).collect::<Option<Vec<_>>>()
    });
    if let Some(nodes) = kept {
        progress.note(&format!("{name}: known from {}", cache.path().join(&file).display()));
        return Made { map: ReachMap { grid: grid.clone(), nodes }, to_keep: None };
    }
    progress.stage(&format!("reach of {name}"), None);
    Made { map: probe.map(grid, &|reached| progress.advance(reached)), to_keep: Some(file) }
}

/// A map as a NumPy array of bytes.
pub(crate) fn npy_of(map: &ReachMap) -> Vec<u8> {
    let bytes: Vec<u8> = map.nodes.iter().map(|r| *r as u8).collect();
    npy_bytes(&map.grid.size, &bytes)
}

/// The largest rectangle of all depths on the whole of which every arm can draw, of equal ones the nearest; where there is none,
/// the one on most of whose area they can.
///
/// The maps know but of a piece of canvas at each point. A whole one may be in the arm's own way, most of all
/// where it reaches over or beside its base.
fn choose<'a>(
    grid: &'a ReachGrid,
    depths: &[Slice],
    arms: &[&Arm],
    maps: &[ReachMap],
    probes: &[ReachProbe],
    [near, far]: [f64; 2],
) -> Result<(Placed<'a>, Tried), ReachError> {
    let placed = |s: &Slice| s.center.map(|center| Placed { grid, slice: *s, center });
    let mut canvases: Vec<Placed> = depths.iter().filter_map(placed).collect();
    canvases.sort_by(|a, b| b.slice.size[1].total_cmp(&a.slice.size[1]).then(a.slice.depth.total_cmp(&b.slice.depth)));
    let mut best: Option<(f64, Placed, Tried)> = None;
    for canvas in canvases {
        let tried = canvas.tried(probes)?;
        let share = tried.iter().map(|(tried, free)| *free as f64 / *tried as f64).fold(1.0, f64::min);
        if share == 1.0 {
            return Ok((canvas, tried));
        }
        let area = share * canvas.slice.size[0] * canvas.slice.size[1];
        if best.as_ref().is_none_or(|b| area > b.0) {
            best = Some((area, canvas, tried));
        }
    }
    let (near_mm, far_mm) = (near * 1e3, far * 1e3);
    let points = depths.iter().map(|s| s.points).sum();
    best.map(|(_, canvas, tried)| (canvas, tried)).ok_or_else(|| match points {
        0 => {
            let names: Vec<&str> = arms.iter().map(|a| a.model.name.as_str()).collect();
            let reached: Vec<String> = names.iter().zip(maps).map(|(name, map)| told_range(name, map)).collect();
            let (arms, reached) = (names.join(" and "), reached.join(", "));
            ReachError::NoPoint { near_mm, far_mm, arms, reached }
        }
        points => ReachError::NoRectangle { near_mm, far_mm, points },
    })
}

/// From which depth to which an arm can draw.
fn told_range(name: &str, map: &ReachMap) -> String {
    let free = (0..map.nodes.len()).filter(|i| map.nodes[*i] == Reach::Free);
    let depths: Vec<f64> = free.map(|i| map.grid.coordinate(2, map.grid.node(i)[2])).collect();
    let low = depths.iter().copied().fold(f64::INFINITY, f64::min);
    let high = depths.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if depths.is_empty() {
        format!("{name} reaches nothing with the pen that way")
    } else {
        format!("{name} reaches {:.0} to {:.0} mm", low * 1e3, high * 1e3)
    }
}

fn arm_json(arm: &Arm, map: &ReachMap, (tried, tried_free): (usize, usize)) -> ArmJson {
    ArmJson {
        name: arm.model.name.clone(),
        map: map_name(arm),
        points_free: map.count(Reach::Free),
        points_blocked: map.count(Reach::Blocked),
        digest: map.digest(),
        tried,
        tried_free,
    }
}

fn depth_json(s: &Slice) -> DepthJson {
    let [width_mm, height_mm] = s.size.map(|x| rounded(x * 1e3));
    DepthJson { depth_mm: rounded(s.depth * 1e3), points: s.points, width_mm, height_mm }
}

fn summary(json: &ReachJson, folder: &Path) -> String {
    let mut text = String::new();
    for arm in &json.arms {
        let ArmJson { name, points_free, points_blocked, tried, tried_free, .. } = arm;
        let _ = writeln!(
            text,
            "{name:<8} {points_free} points reached, {points_blocked} blocked; {tried_free} of {tried} tried on the canvas"
        );
    }
    let c = &json.canvas;
    let [x, y, z] = c.center_mm;
    let (w, h, d) = (c.width_mm, c.height_mm, c.depth_mm);
    let _ = writeln!(text, "canvas   {w:.0} x {h:.0} mm at depth {d:.0} mm, centre {x:.0} {y:.0} {z:.0} mm");
    let _ = writeln!(text, "files    {}", folder.display());
    text
}
