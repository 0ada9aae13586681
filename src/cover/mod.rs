//! Where a base has to stand for a scenario's drawing: found, shown and written.
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;

use crate::artwork::{self, ArtworkError};
use crate::drawing::Drawing;
use crate::measure::{CoverageMetrics, DrawingMetrics, Metrics};
use crate::plan::cover::{self, CoverError, CoverJob, CoverMethod, CoverOptions, Coverage};
use crate::progress::Progress;
use crate::reach::kept_or_made;
use crate::report::{CoverSketch, FigureError, OutputDir, OutputError, cover_svg, metrics_json, svg_png};
use crate::robot::{Cell, RobotError};
use crate::run::{self, RunError};
use crate::scenario::{Scenario, Sketch, options};
use crate::surface::BelievedCanvas;

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
    Run(#[from] RunError),
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

/// Finds where the base stands for all of a scenario's drawing, and writes coverage.json, a plan from above and the figures into `out`.
///
/// Without `[coverage]` the defaults hold. Maps of reach are kept in `cache` in the output folder.
pub fn cover(scenario: &Scenario, out: &OutputDir, progress: &dyn Progress) -> Result<Covered, CoverageError> {
    let started = Instant::now();
    let options = scenario.coverage.clone().unwrap_or_default().options();
    let made = artwork::make(&Sketch::from(scenario), progress)?;
    let drawing = &made.drawing;
    let pens = artwork::pens(drawing, &scenario.pen)?;
    let cell = Cell::load(&scenario.robot)?;
    let arm = &cell.arms[cell.arm_index(scenario.arm.as_deref())?];
    let scene = run::scene_of(scenario)?;
    let Some(wall) = scene.wall else {
        return Err(CoverageError::NoWall { scene: scenario.canvas.scene.display().to_string() });
    };
    let (mapping, _) = run::mapping_onto(scenario, drawing, &scene.canvas)?;
    let canvas = BelievedCanvas(scene.canvas);
    let obstacles: Vec<_> = scene.furniture.iter().map(|f| f.mesh.clone()).collect();
    let plan = options::plan_options(scenario, &pens);
    let job = CoverJob {
        arm: &arm.model,
        home: &arm.home,
        wall: &wall,
        canvas: &canvas,
        obstacles: &obstacles,
        drawing,
        mapping: mapping.as_ref(),
        plan: &plan,
        cover: &options,
    };
    let cache = OutputDir::check(&out.path().join("cache"))?;
    let mut to_keep = None;
    let mut map = |probe: &crate::plan::ReachProbe, grid: &crate::plan::ReachGrid| {
        let made = kept_or_made(&arm.model.name, probe, grid, &cache, progress);
        to_keep = made.to_keep.map(|name| (name, made.map.clone()));
        made.map
    };
    let coverage = cover::cover(&job, &mut map, &mut |stage| progress.stage(stage, None))?;
    let mut metrics = Metrics::new(&scenario.name, scenario.seed);
    metrics.drawing = Some(DrawingMetrics::of(drawing, started.elapsed().as_secs_f64()));
    metrics.coverage = Some(CoverageMetrics::of(&coverage));

    let mut files = Vec::new();
    if let Some((name, map)) = to_keep {
        cache.write(&name, &crate::reach::npy_of(&map))?;
    }
    let json = CoverageJson {
        schema: 1,
        scenario: &scenario.name,
        footprint_m: options.footprint,
        mount_m: options.mount,
        margin_m: options.margin,
        coverage: &coverage,
    };
    files.push(out.write("coverage.json", (serde_json::to_string_pretty(&json)? + "\n").as_bytes())?);
    let svg = cover_svg(&sketch(scenario, &coverage, &wall, &options, &obstacles));
    files.push(out.write("coverage.svg", svg.as_bytes())?);
    files.push(out.write("coverage.png", &svg_png(&svg)?)?);
    files.push(out.write("metrics.json", metrics_json(&metrics)?.as_bytes())?);
    let seconds = started.elapsed().as_secs_f64();
    Ok(Covered { summary: summary(&coverage, seconds, out), drawing: made.drawing, coverage, metrics, files })
}

fn sketch<'a>(
    scenario: &'a Scenario,
    coverage: &'a Coverage,
    wall: &'a crate::surface::Wall,
    options: &CoverOptions,
    obstacles: &[crate::mesh::TriMesh],
) -> CoverSketch<'a> {
    let circle = match options.method {
        CoverMethod::Circles { radius, offset, base } => Some([radius, offset, base]),
        _ => None,
    };
    CoverSketch {
        title: &scenario.name,
        coverage,
        wall,
        obstacles: cover::outlines(wall, obstacles, options),
        footprint: options.footprint,
        mount: [options.mount[0], options.mount[1]],
        circle,
    }
}

fn summary(c: &Coverage, seconds: f64, out: &OutputDir) -> String {
    let mut text = String::new();
    let best = if c.optimal { ", none fewer do" } else { "" };
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
    let _ = writeln!(text, "took       {seconds:.1} s, {:.2} s of it the solver, {} rounds", c.solver_s, c.rounds);
    let _ = writeln!(text, "files      {}", out.path().display());
    text
}
