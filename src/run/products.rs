//! The files of a run.
use std::path::PathBuf;

use super::belief::{Believed, Prepared};
use super::perform::{Performance, Touched};
use super::pictures::{self, Extra};
use super::setup::Setup;
use super::{RunError, Until, name_of, scene_builder};
use crate::artwork::{Likenesses, desired_trace};
use crate::cover::{self, Found};
use crate::drawing::{Drawing, svg_write};
use crate::ink::{InkTrace, RasterOptions, rasterise};
use crate::measure::{ImageMetrics, Laid, Metrics, PlanMetrics};
use crate::mesh;
use crate::picture::Image;
use crate::plan::Plan;
use crate::progress::Progress;
use crate::report::{
    OutputDir, Page, StagesOf, distortion_picture, drawing_svg, heights_csv, heights_figure, looks_csv, plan_json,
    plan_npy, report_html, stages_csv, write_record,
};
use crate::scenario::Scenario;
use crate::surface::StretchField;

/// Largest side of the preview, px.
const PREVIEW_PX: u32 = 2400;

/// The files written so far, and how the report speaks of them.
#[derive(Default)]
pub(super) struct Written {
    pub files: Vec<PathBuf>,
    pictures: Vec<(String, String)>,
    others: Vec<(String, String)>,
}

impl Written {
    pub(super) fn picture(&mut self, file: PathBuf, caption: &str) {
        self.pictures.push((name_of(&file), caption.to_string()));
        self.files.push(file);
    }

    pub(super) fn other(&mut self, file: PathBuf, content: &str) {
        self.others.push((name_of(&file), content.to_string()));
        self.files.push(file);
    }

    pub(super) fn scenario(&mut self, toml: &str, out: &OutputDir) -> Result<(), RunError> {
        self.other(out.write("scenario.toml", toml.as_bytes())?, "The scenario, resolved");
        Ok(())
    }
}

/// A drawing as it would come out: every line at its pen's width.
pub(super) struct Sheet {
    preview: Image,
    px_per_mm: f64,
    likenesses: Likenesses,
}

impl Sheet {
    /// Looks at a prepared drawing.
    pub(super) fn new(prepared: &Prepared) -> Result<Self, RunError> {
        Self::with_side(prepared, PREVIEW_PX)
    }

    /// The same with `px` pixels on the longer side, or as many as a preview has.
    pub(super) fn with_side(prepared: &Prepared, px: u32) -> Result<Self, RunError> {
        let (drawing, pens) = (&prepared.drawing, &prepared.pens);
        let [width, height] = pictures::page(drawing);
        let options = RasterOptions::with_long_side(width, height, px.min(PREVIEW_PX));
        let preview = rasterise(&desired_trace(drawing, pens), &options)?;
        let likenesses = Likenesses::new(drawing, pens, prepared.made.picture.as_ref())?;
        Ok(Self { preview, px_per_mm: options.px_per_mm, likenesses })
    }

    /// How like the picture it is; with what was drawn, if something was.
    pub(super) fn likeness(&self, ink: Option<&InkTrace>) -> Result<ImageMetrics, RunError> {
        Ok(self.likenesses.metrics(ink)?)
    }

    /// Figures of the drawing alone.
    pub(super) fn metrics(&self, scenario: &Scenario, prepared: &Prepared) -> Result<Metrics, RunError> {
        let mut metrics = Metrics::new(&scenario.name, scenario.seed);
        metrics.drawing = Some(prepared.metrics.clone());
        metrics.image = Some(self.likeness(None)?);
        Ok(metrics)
    }

    /// Writes the lines, the preview, and the pictures of the way there.
    pub(super) fn write(&self, prepared: &Prepared, out: &OutputDir, written: &mut Written) -> Result<(), RunError> {
        let svg = svg_write::write(&prepared.drawing);
        written.other(out.write("wished.svg", svg.as_bytes())?, "The lines as desired, in mm");
        let png = self.preview.to_png(Some(self.px_per_mm))?;
        written.picture(out.write("preview.png", &png)?, "The lines as desired, at the pen's width: no robot");
        for plate in &prepared.made.plates {
            let png = plate.image.to_png(None)?;
            written.picture(out.write(&format!("{}.png", plate.name), &png)?, &plate.caption);
        }
        Ok(())
    }
}

/// All that the files of a whole run are made of, but for what was done.
pub(super) struct Products<'a> {
    pub scenario: &'a Scenario,
    pub setup: &'a Setup,
    pub believed: &'a Believed,
    pub sheet: &'a Sheet,
    pub toml: &'a str,
}

impl Products<'_> {
    /// Writes what there is of a scenario that isn't run to its end.
    pub(super) fn write_unfinished(
        &self,
        until: Until,
        out: &OutputDir,
        written: &mut Written,
    ) -> Result<Metrics, RunError> {
        let Self { scenario, setup, believed, sheet, toml } = *self;
        let mut metrics = sheet.metrics(scenario, &believed.prepared)?;
        metrics.belief = believed.belief_metrics();
        metrics.mapping = believed.mapped.as_ref().map(|m| m.metrics.clone());
        written.scenario(toml, out)?;
        if let Some(scan) = &believed.scan {
            scan.write(&believed.canvas, out, written)?;
        }
        if let Some(mapped) = &believed.mapped {
            write_laid(&mapped.laid, &mapped.field, &setup.drawing, out, written)?;
            if until == Until::Mapping {
                let text = serde_json::to_vec(&mapped.strokes)?;
                let content = "Desired contact points and normals on the canvas, m, world";
                written.other(out.write("mapped.json", &text)?, content);
            }
        }
        if let Some(planning) = &believed.planning {
            sheet.write(&believed.prepared, out, written)?;
            metrics.plan = Some(PlanMetrics::of(&planning.plan, &planning.reach, planning.seconds));
            write_plan(setup, &planning.plan, out, written)?;
        }
        Ok(metrics)
    }

    /// Writes all files but the figures, which come back whole.
    pub(super) fn write(
        &self,
        performance: Performance,
        out: &OutputDir,
        written: &mut Written,
        progress: &dyn Progress,
    ) -> Result<Metrics, RunError> {
        let Self { scenario, setup, believed, sheet, toml } = *self;
        let mut metrics = performance.metrics.clone();
        sheet.write(&believed.prepared, out, written)?;
        if let Some(scan) = &believed.scan {
            scan.write(&believed.canvas, out, written)?;
        }
        if let Some(driving) = &believed.prepared.driving {
            write_places(&scenario.name, &driving.found, out, written)?;
        }
        if let Some(mapped) = &believed.mapped {
            write_laid(&mapped.laid, &mapped.field, &setup.drawing, out, written)?;
        }
        written.scenario(toml, out)?;
        write_plan(setup, &performance.plan, out, written)?;
        if let Some(touched) = &performance.touched {
            write_touched(touched, out, written)?;
        }
        if !performance.aligned.is_empty() {
            let csv = looks_csv(&performance.aligned);
            let content = "What the base found out of its places by looking and feeling";
            written.other(out.write("looking.csv", csv.as_bytes())?, content);
        }
        let extra = self.tools(&performance, out, written, progress)?;
        let record = &performance.record;
        metrics.image = Some(sheet.likeness(Some(&record.ink))?);
        let [width, height] = pictures::page(&setup.drawing);
        let svg = drawing_svg(&record.ink, width, height);
        let content = "What was drawn, in mm, a layer an ink, width as drawn";
        written.other(out.write("drawing.svg", svg.as_bytes())?, content);
        let views = pictures::pictures(&scenario.render, setup, &extra, record, out, written, progress)?;
        metrics.render = Some(views);

        if let Some(driving) = &believed.prepared.driving {
            driving.pictures(record, out, written)?;
        }

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
        Ok(metrics)
    }

    /// Writes how the tools sat; hands, docks and tools come back as things to see.
    fn tools(
        &self,
        performance: &Performance,
        out: &OutputDir,
        written: &mut Written,
        progress: &dyn Progress,
    ) -> Result<Extra, RunError> {
        let Self { scenario, setup, .. } = *self;
        if !setup.fetches() {
            return Ok(Extra::default());
        }
        let mut rows = Vec::new();
        for ((arm, changes), lost) in setup.cell.arms.iter().zip(&performance.changes).zip(&performance.lost) {
            for (i, record) in changes.iter().enumerate() {
                let ink = &setup.drawing.layers[record.place.layer].name;
                let lost = if i + 1 == changes.len() { lost.as_slice() } else { &[] };
                rows.push(StagesOf { arm: &arm.model.name, ink, record, lost });
            }
        }
        let csv = stages_csv(rows);
        written.other(out.write("tools.csv", csv.as_bytes())?, "The tool in the hand, stage by stage of every change");
        let (extra, stages) = scene_builder::tools(scenario, setup, performance)?;
        if !stages.is_empty() {
            progress.stage("pictures of tool changes", None);
            let views = stages.iter().map(|s| (s.name.as_str(), s.caption.as_str(), &s.items, &s.view));
            pictures::stages(setup, views, out, written)?;
        }
        Ok(extra)
    }
}

/// Writes the segments and the joint paths of a plan.
fn write_plan(setup: &Setup, plan: &Plan, out: &OutputDir, written: &mut Written) -> Result<(), RunError> {
    let joints: Vec<Vec<String>> =
        setup.cell.arms.iter().map(|a| a.model.joints.iter().map(|j| j.name.clone()).collect()).collect();
    written.other(out.write("plan.json", plan_json(plan, &joints).as_bytes())?, "Segments of the planned motion");
    for (arm, names) in plan.arms.iter().zip(&joints) {
        let (name, bytes) = plan_npy(arm, names.len());
        written.other(out.write(&name, &bytes)?, "Planned joint path, a NumPy array");
    }
    Ok(())
}

/// Writes how the canvas stretches the drawing.
pub(super) fn write_laid(
    laid: &Laid,
    field: &StretchField,
    drawing: &Drawing,
    out: &OutputDir,
    written: &mut Written,
) -> Result<(), RunError> {
    let json = serde_json::to_vec_pretty(laid)?;
    written.other(out.write("distortion.json", &json)?, "How the canvas stretches the drawing, and what was mended");
    let png = distortion_picture(field, drawing)?.to_png(None)?;
    written.picture(out.write("distortion.png", &png)?, "How the canvas stretches the drawing: areas, and angles");
    Ok(())
}

/// Writes where a base stands.
pub(super) fn write_places(name: &str, found: &Found, out: &OutputDir, written: &mut Written) -> Result<(), RunError> {
    for file in cover::write(name, found, out)? {
        if file.extension().is_some_and(|e| e == "svg") {
            written.picture(file, "Where the base stands, from above, and what it draws from where");
        } else {
            written.other(file, "Where the base stands, and what it draws from where");
        }
    }
    Ok(())
}

/// Writes how belief grew, and what it came to.
fn write_touched(touched: &Touched, out: &OutputDir, written: &mut Written) -> Result<(), RunError> {
    let csv = heights_csv(&touched.heights);
    written.other(out.write("belief.csv", csv.as_bytes())?, "Predicted less met height, stroke by stroke");
    let content = "The canvas as the robot believes it to be in the end, m, world";
    written.other(out.write("belief.ply", &mesh::ply_bytes(&touched.belief.mesh))?, content);
    let svg = heights_figure(&touched.heights).svg();
    let caption = "How far the pen met the canvas from where it expected it";
    written.picture(out.write("belief.svg", svg.as_bytes())?, caption);
    Ok(())
}
