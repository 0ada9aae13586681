//! Where a base has to stand for a scenario's drawing: found, shown and written.
mod work_time;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;

use crate::artwork::{self, ArtworkError};
use crate::canvas::{self, CanvasError};
use crate::drawing::Drawing;
use crate::measure::{CoverageMetrics, DrawingMetrics, Metrics};
use crate::mesh::TriMesh;
use crate::pen::LayerPen;
use crate::plan::cover::{self, BasePose, CoverError, CoverJob, CoverMethod, CoverOptions, Coverage, MapMaker};
use crate::plan::{ReachGrid, ReachProbe};
use crate::progress::Progress;
use crate::reach::kept_or_made;
use crate::report::{CoverSketch, FigureError, OutputDir, OutputError, cover_svg, duration, metrics_json, svg_png};
use crate::robot::{Arm, Cell, RobotError};
use crate::scenario::{Scenario, Sketch, options};
use crate::surface::{BelievedCanvas, Wall};

pub use work_time::WorkTime;

/// Why there are no places.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CoverageError {
    /// The canvas is no wall.
    #[error("{scene}: places to stand are found before a wall: the canvas must be an extrusion")]
    NoWall {
        /// The scene's file.
        scene: String,
    },
    /// No places were found.
    #[error(transparent)]
    Cover(#[from] CoverError),
    /// The robot can't be used.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The artwork can't be drawn.
    #[error(transparent)]
    Artwork(#[from] ArtworkError),
    /// The scene or the mapping can't be made.
    #[error(transparent)]
    Canvas(#[from] CanvasError),
    /// The picture can't be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// An output can't be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Figures can't be written as JSON.
    #[error("figures can't be written: {0}")]
    Json(#[from] serde_json::Error),
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Covered {
    /// In a few lines.
    pub summary: String,
    /// What is drawn: the strokes that pieces are of.
    pub drawing: Drawing,
    /// Where to stand and what to draw from where.
    pub coverage: Coverage,
    /// Figures.
    pub metrics: Metrics,
    /// The files written, in the order written.
    pub files: Vec<PathBuf>,
}

/// coverage.json: lengths in m, angles in rad.
#[derive(Serialize)]
struct CoverageJson<'a> {
    schema: u32,
    scenario: &'a str,
    footprint_m: [f64; 2],
    mount_m: [f64; 3],
    margin_m: f64,
    #[serde(flatten)]
    coverage: &'a Coverage,
}

/// Where the base stands for a drawing, and what that was found in.
pub struct Found {
    /// Where to stand and what to draw from where.
    pub coverage: Coverage,
    /// The wall.
    pub wall: Wall,
    /// What was asked.
    pub options: CoverOptions,
    /// What stands before the wall, world.
    pub obstacles: Vec<TriMesh>,
    /// Time that the robot takes to drive and to draw, s, by rules of thumb.
    pub estimate: WorkTime,
    /// Time the computer took to find the places, s.
    pub seconds: f64,
}

impl Found {
    /// Its figures.
    pub fn metrics(&self) -> CoverageMetrics {
        CoverageMetrics {
            drive_s: self.estimate.driving,
            estimated_s: Some(self.estimate.total()),
            duration_s: Some(self.seconds),
            ..CoverageMetrics::of(&self.coverage)
        }
    }
}

/// Finds where the base stands for all of a drawing, and how it drives from where it starts to each place in turn. Without `[coverage]`
/// the defaults hold. `map` makes, or knows, a map of the arm's reach.
///
/// # Errors
/// The canvas is no wall, no scene is there, or no places do.
pub fn find(
    scenario: &Scenario,
    arm: &Arm,
    drawing: &Drawing,
    pens: &[LayerPen],
    map: &mut MapMaker,
    progress: &dyn Progress,
) -> Result<Found, CoverageError> {
    let started = Instant::now();
    let mut options = scenario.coverage.clone().unwrap_or_default().options();
    if let Some(base) = &arm.base {
        options.mount = base.base_from_arm.translation.vector.into();
    }
    let scene = canvas::scene_of(scenario)?;
    let Some(wall) = scene.wall else {
        return Err(CoverageError::NoWall { scene: scenario.canvas.scene.display().to_string() });
    };
    let (mapping, _) = canvas::mapping_onto(scenario, drawing, &scene.canvas)?;
    let believed = BelievedCanvas(scene.canvas);
    let obstacles: Vec<TriMesh> = scene.furniture.iter().map(|f| f.mesh.clone()).collect();
    let plan = options::plan_options(scenario, pens);
    let job = CoverJob {
        arm: &arm.model,
        home: &arm.home,
        start: arm.base.as_ref().map(|b| BasePose { x: b.start.x, y: b.start.y, heading: b.start.yaw }),
        wall: &wall,
        canvas: &believed,
        obstacles: &obstacles,
        drawing,
        mapping: mapping.as_ref(),
        plan: &plan,
        cover: &options,
    };
    let coverage = cover::cover(&job, map, &mut |stage| progress.stage(stage, None))?;
    let estimate = WorkTime::of(scenario, arm, drawing, &coverage);
    Ok(Found { coverage, wall, options, obstacles, estimate, seconds: started.elapsed().as_secs_f64() })
}

/// Finds where the base stands for all of a scenario's drawing, and writes coverage.json, a plan from above and the figures into `out`.
///
/// Maps of reach are kept in `cache` in the output folder.
///
/// # Errors
/// See [`find`]; or a file can't be written.
pub fn cover(scenario: &Scenario, out: &OutputDir, progress: &dyn Progress) -> Result<Covered, CoverageError> {
    let started = Instant::now();
    let made = artwork::make(&Sketch::from(scenario), progress)?;
    let drawing = &made.drawing;
    let pens = artwork::pens(drawing, &scenario.pen)?;
    let cell = Cell::load_changed(&scenario.robot, &scenario.change.robot)?;
    let arm = &cell.arms[cell.arm_index(scenario.arm.as_deref())?];
    let cache = OutputDir::check(&out.path().join("cache"))?;
    let mut to_keep = None;
    let mut map = |probe: &ReachProbe, grid: &ReachGrid| {
        let made = kept_or_made(&arm.model.name, probe, grid, &cache, progress);
        to_keep = made.to_keep.map(|name| (name, made.map.clone()));
        made.map
    };
    let found = find(scenario, arm, drawing, &pens, &mut map, progress)?;
    let mut metrics = Metrics::new(&scenario.name, scenario.seed);
    metrics.drawing = Some(DrawingMetrics::of(drawing, started.elapsed().as_secs_f64()));
    metrics.coverage = Some(found.metrics());

    if let Some((name, map)) = to_keep {
        cache.write(&name, &crate::reach::npy_of(&map))?;
    }
    let out = &out.begin("cover")?;
    let mut files = write(&scenario.name, &found, out)?;
    files.push(out.write("metrics.json", metrics_json(&metrics)?.as_bytes())?);
    let seconds = started.elapsed().as_secs_f64();
    let summary = summary(&found, seconds, out);
    Ok(Covered { summary, drawing: made.drawing, coverage: found.coverage, metrics, files })
}

/// Writes coverage.json and the plan from above; returns the files written.
///
/// # Errors
/// A file can't be written.
pub fn write(name: &str, found: &Found, out: &OutputDir) -> Result<Vec<PathBuf>, CoverageError> {
    let Found { coverage, options, .. } = found;
    let json = CoverageJson {
        schema: 1,
        scenario: name,
        footprint_m: options.footprint,
        mount_m: options.mount,
        margin_m: options.margin,
        coverage,
    };
    let svg = cover_svg(&sketch(name, found));
    Ok(vec![
        out.write("coverage.json", (serde_json::to_string_pretty(&json)? + "\n").as_bytes())?,
        out.write("coverage.svg", svg.as_bytes())?,
        out.write("coverage.png", &svg_png(&svg)?)?,
    ])
}

fn sketch<'a>(name: &'a str, found: &'a Found) -> CoverSketch<'a> {
    let Found { coverage, wall, options, obstacles, .. } = found;
    let circle = match options.method {
        CoverMethod::Circles { radius, offset, base } => Some([radius, offset, base]),
        _ => None,
    };
    CoverSketch {
        title: name,
        coverage,
        wall,
        obstacles: cover::outlines(wall, obstacles, options),
        footprint: options.footprint,
        mount: [options.mount[0], options.mount[1]],
        circle,
    }
}

fn summary(found: &Found, seconds: f64, out: &OutputDir) -> String {
    let Found { coverage: c, estimate, .. } = found;
    let mut text = String::new();
    let best = match c.bound {
        0 => String::new(),
        _ if c.optimal => ", none fewer do".into(),
        bound => format!(", no fewer than {bound} do"),
    };
    let _ = writeln!(text, "places     {}{best}; {:.2} m of driving between them", c.places.len(), c.drive());
    let _ = writeln!(text, "seams      {} strokes cut, {} crossings", c.strokes_cut(), c.cuts.len());
    for (k, p) in c.places.iter().enumerate() {
        let (x, y, deg) = (p.pose.x * 1e3, p.pose.y * 1e3, p.pose.heading.to_degrees());
        let [a, b] = p.stretch.map(|s| s * 1e3);
        let _ = writeln!(
            text,
            "  {}        x {x:.0}, y {y:.0} mm, {deg:.1} deg: {} pieces of line, wall {a:.0} to {b:.0} mm",
            k + 1,
            p.pieces.len()
        );
    }
    if c.raise != 0.0 {
        let way = if c.raise > 0.0 { "up" } else { "down" };
        let _ = writeln!(text, "height     the drawing is moved {:.0} mm {way}", c.raise.abs() * 1e3);
    }
    let _ = writeln!(
        text,
        "time       {} at the robot: {} of drawing, {} of driving, {} of pen changes",
        duration(estimate.total()),
        duration(estimate.drawing),
        duration(estimate.driving),
        duration(estimate.changing)
    );
    let made = (seconds - found.seconds).max(0.0);
    let _ = writeln!(
        text,
        "took       {:.1} s, {:.2} s of it the solver, {} rounds; {made:.1} s to make the drawing",
        found.seconds, c.solver_s, c.rounds
    );
    let _ = writeln!(text, "files      {}", out.path().display());
    text
}
