//! One scenario, from start to end.

mod cast;
mod error;
mod evaluate;
mod laying;
mod options;
mod pictures;
mod scan;
pub(crate) mod standing;
mod tools;
mod touching;

use std::path::PathBuf;
use std::time::Instant;

use crate::artwork::{self, Likenesses, Made};
use crate::drawing::svg_write;
use crate::ink::{InkTrace, RasterOptions, rasterise};
use crate::measure::{
    ContactMetrics, DrawingMetrics, Laid, LineMetrics, MappingMetrics, Metrics, PlanMetrics, ShapeMetrics, SimMetrics,
    grid_shape, line_fit, side_errors, width_error,
};
use crate::pen::LayerPen;
use crate::picture::Image;
use crate::plan::{self, Plan, Planned};
use crate::progress::Progress;
use crate::report::{OutputDir, Page, drawing_svg, metrics_json, plan_json, plan_npy, report_html, write_record};
use crate::scenario::{Artwork, Pattern, Scenario, Sketch};
use crate::surface::{Mapping, StretchField, SurfaceDrawing, map_drawing, map_what_fits};
use crate::twin::{Record, TwinArm, simulate};

pub use error::RunError;
pub use evaluate::{Cache, evaluate};

use cast::Cast;
use laying::{lay, mapping_onto, mapping_onto_truth, overlaid, own_layers, write_laid};
use pictures::Extra;

/// Spacing at which the wished line is known when the drawn one is measured, m.
const MEASURE_STEP: f64 = 2.5e-4;
/// Largest side of the preview, px.
const PREVIEW_PX: u32 = 2400;

/// How far to go along the way from drawing to pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Until {
    /// To the drawing on its sheet.
    Drawing,
    /// To the drawing on the canvas.
    Mapping,
    /// To the timed joint motion.
    Plan,
    /// To the report.
    End,
}

/// What a run left.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Its figures.
    pub metrics: Metrics,
    /// The files written, in the order written.
    pub files: Vec<PathBuf>,
    /// Why the robot stopped before all was drawn; what it had drawn is there.
    pub stopped: Option<String>,
}

/// The files written so far, and how the report speaks of them.
#[derive(Default)]
struct Written {
    files: Vec<PathBuf>,
    pictures: Vec<(String, String)>,
    others: Vec<(String, String)>,
}

impl Written {
    fn picture(&mut self, file: PathBuf, caption: &str) {
        self.pictures.push((name_of(&file), caption.to_string()));
        self.files.push(file);
    }
    fn other(&mut self, file: PathBuf, content: &str) {
        self.others.push((name_of(&file), content.to_string()));
        self.files.push(file);
    }
}

fn name_of(file: &std::path::Path) -> String {
    file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// Runs a scenario as far as `until`, and writes the files of every stage that it passes into `out`.
///
/// Nothing is written before everything that could be wrong with the scenario's files, the mapping and the plan is known
/// to be right.
pub fn run(scenario: &Scenario, until: Until, out: &OutputDir, progress: &dyn Progress) -> Result<Outcome, RunError> {
    let mut metrics = Metrics::new(&scenario.name, scenario.seed);
    let mut written = Written::default();
    let toml = scenario.to_toml()?;

    progress.stage("drawing", None);
    let started = Instant::now();
    let sketch = Sketch::from(scenario);
    let mut made = artwork::make(&sketch, progress)?;
    overlaid(&mut made.drawing, scenario);
    let drawn = Drawn::new(&sketch, &made, started, &mut metrics)?;
    if until == Until::Drawing {
        written.other(out.write("scenario.toml", toml.as_bytes())?, "The scenario, resolved");
        drawn.write(&made, out, &mut written)?;
        return finish(metrics, written, out);
    }

    if scenario.tools.is_some() && until == Until::Plan {
        return Err(RunError::WithTools);
    }
    if scenario.touch.is_some() && until < Until::End {
        return Err(RunError::WhileDrawing);
    }
    progress.stage("mapping", None);
    let cast = Cast::load(scenario, made.drawing.clone(), drawn.pens.clone())?;
    if let Some(touch) = &scenario.touch {
        let touched = touching::draw(scenario, touch, &cast, progress)?;
        touched.measured(scenario, &cast, &mut metrics)?;
        drawn.write(&made, out, &mut written)?;
        written.other(out.write("scenario.toml", toml.as_bytes())?, "The scenario, resolved");
        write_plan(&cast, &touched.plan, out, &mut written)?;
        touched.write(out, &mut written)?;
        let mapping = mapping_onto_truth(scenario, &cast)?;
        let record = &touched.record;
        return report(
            scenario,
            &cast,
            &drawn,
            record,
            &Extra::default(),
            mapping.as_ref(),
            &toml,
            metrics,
            written,
            out,
            progress,
        );
    }
    metrics.belief = cast.scan.as_ref().map(scan::Scan::metrics);
    let started = Instant::now();
    let (mapping, flattened) = mapping_onto(scenario, &cast, &cast.belief)?;
    for sentence in flattened.iter().flat_map(|f| &f.mended) {
        progress.note(&format!("canvas: {sentence}"));
    }
    let mapped = lay(scenario, &cast, &cast.belief, mapping.as_ref(), scenario.plan.step_mm * 1e-3, map_drawing)?;
    let seconds = started.elapsed().as_secs_f64();
    let field = StretchField::of(mapping.as_ref(), [cast.drawing.width, cast.drawing.height]);
    let own = own_layers(&cast.drawing, scenario);
    let flips = flattened.as_ref().map(|f| f.chart.flips);
    let figures = MappingMetrics::of(mapping.kind(), &own, &mapped, seconds);
    metrics.mapping = Some(figures.with(field.distortion().as_ref(), flips));
    let laid = Laid::new(mapping.kind(), &own, &mapped, &field, flattened.as_ref());
    if until == Until::Mapping {
        written.other(out.write("scenario.toml", toml.as_bytes())?, "The scenario, resolved");
        cast.scan.as_ref().map_or(Ok(()), |s| s.write(&cast.belief, out, &mut written))?;
        write_laid(&laid, &field, &cast.drawing, out, &mut written)?;
        let text = serde_json::to_vec(&mapped)?;
        written.other(out.write("mapped.json", &text)?, "Wished contact points and normals on the canvas, m, world");
        return finish(metrics, written, out);
    }

    if let Some(settings) = &scenario.tools {
        let true_mapping = mapping_onto_truth(scenario, &cast)?;
        let done = tools::draw(scenario, settings, &cast, &mapped, true_mapping.as_ref(), progress)?;
        metrics.plan = Some(PlanMetrics::of(&done.plan, &done.reach, done.planning));
        metrics.tool = Some(done.tool.clone());
        drawn.write(&made, out, &mut written)?;
        cast.scan.as_ref().map_or(Ok(()), |s| s.write(&cast.belief, out, &mut written))?;
        write_laid(&laid, &field, &cast.drawing, out, &mut written)?;
        written.other(out.write("scenario.toml", toml.as_bytes())?, "The scenario, resolved");
        write_plan(&cast, &done.plan, out, &mut written)?;
        done.write(scenario, &cast, out, &mut written, progress)?;
        let (record, mapping) = (&done.record, true_mapping.as_ref());
        let outcome =
            report(scenario, &cast, &drawn, record, &done.extra, mapping, &toml, metrics, written, out, progress)?;
        return Ok(Outcome { stopped: done.stopped, ..outcome });
    }
    let started = Instant::now();
    let planned = make_plan(scenario, &cast, &mapped, progress)?;
    drawn.write(&made, out, &mut written)?;
    cast.scan.as_ref().map_or(Ok(()), |s| s.write(&cast.belief, out, &mut written))?;
    write_laid(&laid, &field, &cast.drawing, out, &mut written)?;
    let reach = planned.reach;
    let plan = Plan { arms: vec![planned.plan] };
    metrics.plan = Some(PlanMetrics::of(&plan, &reach, started.elapsed().as_secs_f64()));
    written.other(out.write("scenario.toml", toml.as_bytes())?, "The scenario, resolved");
    write_plan(&cast, &plan, out, &mut written)?;
    if until == Until::Plan {
        return finish(metrics, written, out);
    }

    let true_mapping = mapping_onto_truth(scenario, &cast)?;
    let record = make_record(scenario, &cast, &plan, true_mapping.as_ref(), progress)?;
    report(
        scenario,
        &cast,
        &drawn,
        &record,
        &Extra::default(),
        true_mapping.as_ref(),
        &toml,
        metrics,
        written,
        out,
        progress,
    )
}

/// Writes the segments and the joint paths of a plan.
fn write_plan(cast: &Cast, plan: &Plan, out: &OutputDir, written: &mut Written) -> Result<(), RunError> {
    let joints: Vec<Vec<String>> =
        cast.cell.arms.iter().map(|a| a.model.joints.iter().map(|j| j.name.clone()).collect()).collect();
    written.other(out.write("plan.json", plan_json(plan, &joints).as_bytes())?, "Segments of the planned motion");
    for (arm, names) in plan.arms.iter().zip(&joints) {
        let (name, bytes) = plan_npy(arm, names.len());
        written.other(out.write(&name, &bytes)?, "Planned joint path, a NumPy array");
    }
    Ok(())
}

/// Measures what was drawn, and writes everything that comes after drawing.
#[allow(clippy::too_many_arguments)]
fn report(
    scenario: &Scenario,
    cast: &Cast,
    drawn: &Drawn,
    record: &Record,
    extra: &Extra,
    mapping: &dyn Mapping,
    toml: &str,
    mut metrics: Metrics,
    mut written: Written,
    out: &OutputDir,
    progress: &dyn Progress,
) -> Result<Outcome, RunError> {
    progress.stage("measuring", None);
    measured(scenario, cast, record, mapping, &mut metrics)?;
    metrics.image = Some(drawn.likenesses.metrics(Some(&record.ink))?);
    let [width, height] = pictures::page(&cast.drawing);
    let svg = drawing_svg(&record.ink, width, height);
    written.other(out.write("drawing.svg", svg.as_bytes())?, "What was drawn, in mm, a layer an ink, width as drawn");
    let pictures = pictures::pictures(&scenario.render, cast, extra, record, out, &mut written, progress)?;
    metrics.render = Some(pictures);

    progress.stage("report", None);
    let mcap = out.write_with("record.mcap", |file| write_record(record, file).map_err(std::io::Error::other))?;
    written.other(mcap, "Joints, pen, forces and events over time; opens in Foxglove");
    // what was drawn comes before how it came about
    written.pictures.sort_by_key(|(name, _)| !(name == "drawing.png" || name.starts_with("view-")));
    let page = Page {
        title: &scenario.name,
        description: &scenario.description,
        metrics: &metrics,
        record: Some(record),
        pictures: &written.pictures,
        files: &written.others,
        scenario_toml: toml,
    };
    let html = report_html(&page);
    written.other(out.write("report.html", html.as_bytes())?, "Pictures, figures and plots on one page");
    finish(metrics, written, out)
}

/// Reads, or makes, a drawing, and writes the lines as wished, a preview of them and the figures.
pub fn draw(sketch: &Sketch, out: &OutputDir, progress: &dyn Progress) -> Result<Outcome, RunError> {
    progress.stage("drawing", None);
    let started = Instant::now();
    let made = artwork::make(sketch, progress)?;
    let mut metrics = Metrics::new(&sketch.name, sketch.seed);
    let drawn = Drawn::new(sketch, &made, started, &mut metrics)?;
    let mut written = Written::default();
    drawn.write(&made, out, &mut written)?;
    finish(metrics, written, out)
}

/// A drawing with its pens, and what it would look like.
struct Drawn {
    pens: Vec<LayerPen>,
    preview: Image,
    px_per_mm: f64,
    likenesses: Likenesses,
}

impl Drawn {
    /// Finds the pens and looks at the preview; `started` is when the artwork was begun.
    fn new(sketch: &Sketch, made: &Made, started: Instant, metrics: &mut Metrics) -> Result<Self, RunError> {
        let seconds = started.elapsed().as_secs_f64();
        let pens = artwork::pens(&made.drawing, &sketch.pen)?;
        let estimate = artwork::estimated_time(&made.drawing, sketch);
        metrics.drawing =
            Some(DrawingMetrics { estimated_s: Some(estimate), ..DrawingMetrics::of(&made.drawing, seconds) });
        let [width, height] = pictures::page(&made.drawing);
        let px = sketch.render.drawing_px.min(PREVIEW_PX);
        let options = RasterOptions::with_long_side(width, height, px);
        let preview = rasterise(&artwork::wished_trace(&made.drawing, &pens), &options)?;
        let likenesses = Likenesses::new(&made.drawing, &pens, made.picture.as_ref())?;
        metrics.image = Some(likenesses.metrics(None)?);
        Ok(Self { pens, preview, px_per_mm: options.px_per_mm, likenesses })
    }

    /// Writes the lines, the preview, and the pictures of the way there.
    fn write(&self, made: &Made, out: &OutputDir, written: &mut Written) -> Result<(), RunError> {
        let svg = svg_write::write(&made.drawing);
        written.other(out.write("wished.svg", svg.as_bytes())?, "The lines as wished, in mm");
        let png = self.preview.to_png(Some(self.px_per_mm))?;
        written.picture(out.write("preview.png", &png)?, "The lines as wished, at the pen's width: no robot");
        for plate in &made.plates {
            let png = plate.image.to_png(None)?;
            written.picture(out.write(&format!("{}.png", plate.name), &png)?, &plate.caption);
        }
        Ok(())
    }
}

fn finish(metrics: Metrics, mut written: Written, out: &OutputDir) -> Result<Outcome, RunError> {
    let json = metrics_json(&metrics)?;
    written.other(out.write("metrics.json", json.as_bytes())?, "Figures");
    Ok(Outcome { metrics, files: written.files, stopped: None })
}

fn make_plan(
    scenario: &Scenario,
    cast: &Cast,
    mapped: &SurfaceDrawing,
    progress: &dyn Progress,
) -> Result<Planned, RunError> {
    const PARTS: f64 = 1000.0;
    progress.stage("planning", Some(PARTS as u64));
    let arm = &cast.cell.arms[0];
    let obstacles = cast.obstacles()?;
    let options = options::plan_options(scenario, &cast.pens);
    let mut hear = |share: f64| progress.advance((share * PARTS) as u64);
    Ok(plan::plan(0, &arm.model, &arm.home, &arm.service, mapped, &cast.belief, &obstacles, &options, &mut hear)?)
}

/// The figures of what was drawn, but for pictures.
fn measured(
    scenario: &Scenario,
    cast: &Cast,
    record: &Record,
    mapping: &dyn Mapping,
    metrics: &mut Metrics,
) -> Result<(), RunError> {
    metrics.digest = Some(record.digest.clone());
    metrics.sim = Some(SimMetrics::of(record, scenario.sim.plant));
    metrics.contact = Some(ContactMetrics::of(record));
    metrics.truth = cast.truth_metrics.clone();
    // the wished line lies where the drawing falls on the true canvas, which may have gaps and steps
    let wished = lay(scenario, cast, &cast.truth, mapping, MEASURE_STEP, map_what_fits)?;
    let widths: Vec<f64> = cast.pens.iter().map(|p| p.pen.width_nominal).collect();
    metrics.line = line_fit(&wished, &record.ink, &widths).map(|fit| LineMetrics {
        width_error_p90: width_error(&wished, &record.ink, 0.9),
        ..LineMetrics::of(&fit, &record.ink)
    });
    metrics.shape = shape(scenario, cast, &record.ink)?;
    Ok(())
}

/// The shape of a drawn pattern against the one wished on the nominal canvas.
fn shape(scenario: &Scenario, cast: &Cast, ink: &InkTrace) -> Result<Option<ShapeMetrics>, RunError> {
    let Artwork::Pattern(pattern) = &scenario.drawing.artwork else { return Ok(None) };
    let own = own_layers(&cast.drawing, scenario);
    let sides = side_errors(&own, ink);
    let grid = match pattern {
        Pattern::Grid { .. } => {
            let (mapping, _) = mapping_onto(scenario, cast, &cast.scene.canvas)?;
            grid_shape(&own, &map_what_fits(&own, mapping.as_ref(), MEASURE_STEP)?, ink)
        }
        _ => None,
    };
    Ok(ShapeMetrics::of(grid.as_ref(), sides.as_ref()))
}

fn make_record(
    scenario: &Scenario,
    cast: &Cast,
    plan: &Plan,
    mapping: &dyn Mapping,
    progress: &dyn Progress,
) -> Result<Record, RunError> {
    progress.stage("simulating", Some((plan.duration() * 1e3) as u64));
    let arms = cast.cell.arms.iter().map(|arm| TwinArm {
        model: arm.model.clone(),
        controller: options::controller(scenario, &arm.model),
        start: arm.home,
    });
    let world = cast.surroundings(scenario, mapping);
    let colors: Vec<_> = cast.drawing.layers.iter().map(|l| l.color).collect();
    let mut hear = |time: f64| progress.advance((time * 1e3) as u64);
    Ok(simulate(arms.collect(), plan, &world, &colors, &options::twin_options(scenario), &mut hear)?)
}
