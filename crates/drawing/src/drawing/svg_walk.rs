//! usvg's resolved tree, walked in paint order: its paths placed on the sheet, dashed, clipped, flattened, filled as
//! asked, and gathered into layers.
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::sync::Arc;

use kurbo::{Affine, BezPath, PathEl, Point, Rect};
use nalgebra::Point2;
use usvg::tiny_skia_path::PathSegment;

use super::Warning;
use super::clip::{self, Clip, Outline};
use super::hatch::hatch;
use super::svg::{Fill, SvgOptions};
use super::svg_css::short;
use super::svg_survey::Labels;
use super::{InkLayer, Stroke};
use crate::math::Rgb;

/// Dashes of one path beyond which it is drawn solid.
const MAX_DASHES: f64 = 2e5;
/// Farthest coordinate that can be drawn, mm from the sheet's centre.
const FARTHEST: f64 = 1e7;
/// Points of a drawing beyond which the tolerance or the artwork is a mistake.
pub(super) const MAX_POINTS: f64 = 2e7;
/// Strokes looked at for shapes that hide them, beyond which shapes hide nothing.
const MAX_LOOKED: u64 = 3_000_000_000;
/// Segments among which repeated ones are looked for.
const MAX_COMPARED: usize = 4_000_000;
/// Length drawn again that is told, mm.
const TOLD_TWICE: f64 = 1.0;
/// Width below which a stroke's says nothing about the pen, mm.
const HAIRLINE: f64 = 1e-3;
/// Strokes shorter than this are dots, mm.
const DOT: f64 = 1e-3;

/// What of usvg's tree is not drawn as it looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Note {
    Mask,
    Pattern,
    Gradient,
    Opacity,
    Paper,
    Cover,
    Covers,
    Fill,
    Dashes,
    Far,
    Cropped,
    Hatch,
}

impl Note {
    fn message(self, count: usize) -> String {
        let what = match self {
            Note::Mask => "mask: ignored, the shapes under it are drawn whole",
            Note::Pattern => "pattern as paint: not drawn; use a colour",
            Note::Gradient => "gradient as paint: drawn in its mean colour",
            Note::Opacity => "partly transparent shape: drawn in full ink",
            Note::Paper => "shape in the paper's colour: not drawn, it would leave no mark",
            Note::Cover => "shape in the paper's colour: hides the lines under it",
            Note::Covers => "shape in the paper's colour: there are too many to hide the lines under all of them",
            Note::Fill => "filled shape without a stroke: not drawn, as asked",
            Note::Dashes => "stroke with too many dashes: drawn solid",
            Note::Far => "shape farther than 10 km from the sheet: not drawn",
            Note::Cropped => "stroke that leaves the page: cut at its edge",
            Note::Hatch => "fill too large for so dense a hatching: outlined",
        };
        format!("{count} x {what}")
    }
}

/// The strokes of one colour in one top-level group, mm.
struct Ink {
    group: usize,
    color: Rgb,
    strokes: Vec<Vec<Point>>,
    /// Box of each.
    boxes: Vec<Rect>,
    /// Stroke width, mm, and the length drawn with it, mm, per shape.
    widths: Vec<(f64, f64)>,
}

pub(super) struct Walk<'a> {
    options: &'a SvgOptions,
    sheet_from_px: Affine,
    /// mm
    tolerance: f64,
    crop: Option<Arc<Clip>>,
    labels: &'a Labels,
    /// Names of top-level groups, in document order; loose shapes have none.
    groups: Vec<Option<(String, bool)>>,
    /// Ids of the layers' groups met so far.
    entered: BTreeSet<String>,
    inks: Vec<Ink>,
    notes: BTreeMap<Note, usize>,
    /// Strokes looked at for shapes that hide them.
    looked: u64,
    /// A bound on the points made so far.
    points: f64,
}

impl<'a> Walk<'a> {
    /// `sheet_from_px` places the document on a sheet of this width and height, all in mm; `labels` names top-level
    /// groups by id.
    pub(super) fn new(
        options: &'a SvgOptions,
        sheet_from_px: Affine,
        (width, height): (f64, f64),
        labels: &'a Labels,
    ) -> Self {
        Walk {
            options,
            sheet_from_px,
            tolerance: options.tolerance * 1e3,
            crop: options.crop.then(|| Arc::new(Clip::centred_rectangle(width, height))),
            labels,
            groups: Vec::new(),
            entered: BTreeSet::new(),
            inks: Vec::new(),
            notes: BTreeMap::new(),
            looked: 0,
            points: 0.0,
        }
    }

    /// What was not drawn as it looks.
    pub(super) fn warnings(&self) -> impl Iterator<Item = Warning> {
        let notes = self.notes.iter().map(|(note, count)| note.message(*count));
        let rest = self.drawn_twice().into_iter().chain(self.merged());
        notes.chain(rest).map(|message| Warning { line: None, message })
    }

    /// How much line lies exactly over line of the same ink.
    fn drawn_twice(&self) -> Option<String> {
        let strokes = || self.inks.iter().flat_map(|i| i.strokes.iter().map(move |s| (i.color, s)));
        if strokes().map(|(_, s)| s.len()).sum::<usize>() > MAX_COMPARED {
            return None;
        }
        let micrometres = |p: Point| ((1e3 * p.x).round() as i64, (1e3 * p.y).round() as i64);
        let (mut seen, mut again) = (HashSet::new(), 0.0);
        for (color, stroke) in strokes() {
            for w in stroke.windows(2) {
                let (a, b) = (micrometres(w[0]), micrometres(w[1]));
                if a != b && !seen.insert((color.0, a.min(b), a.max(b))) {
                    again += (w[1] - w[0]).hypot();
                }
            }
        }
        (again > TOLD_TWICE)
            .then(|| format!("{again:.0} mm of line are drawn again over the same line: remove what is there twice"))
    }

    /// Which labelled layers become one ink.
    fn merged(&self) -> Vec<String> {
        let mut labels: BTreeMap<[u8; 3], Vec<&str>> = BTreeMap::new();
        for ink in self.inks.iter().filter(|_| self.options.by_ink) {
            let of_color = labels.entry(ink.color.0).or_default();
            if let Some((label, true)) = &self.groups[ink.group]
                && !of_color.contains(&label.as_str())
            {
                of_color.push(label);
            }
        }
        let several = labels.into_iter().filter(|(_, l)| l.len() > 1);
        several
            .map(|([r, g, b], l)| {
                let named: Vec<String> = l.iter().take(6).map(|l| format!("`{}`", short(l))).collect();
                let more = if l.len() > 6 { ", ..." } else { "" };
                format!(
                    "layers {}{more} are of one colour, #{r:02x}{g:02x}{b:02x}, and become one ink",
                    named.join(", ")
                )
            })
            .collect()
    }

    /// Whether the walk stopped because the drawing grew too large.
    pub(super) fn overflowed(&self) -> bool {
        self.points > MAX_POINTS
    }

    fn note(&mut self, note: Note) {
        *self.notes.entry(note).or_default() += 1;
    }

    /// Walks the children of the document's root, each group of which starts a layer. usvg wraps them all in a
    /// nameless group where the page has a view box.
    pub(super) fn top_level(&mut self, root: &usvg::Group) {
        let children = match root.children() {
            [usvg::Node::Group(g)] if g.id().is_empty() && g.clip_path().is_none() && g.opacity().get() > 0.0 => {
                g.children()
            }
            children => children,
        };
        let mut loose = None;
        for child in children {
            let named = match child {
                usvg::Node::Group(g) => self.labels.get(g.id()),
                _ => None,
            };
            let group = match named {
                Some(name) => {
                    self.entered.insert(child.id().to_string());
                    loose = None;
                    self.groups.push(name.clone());
                    self.groups.len() - 1
                }
                None => *loose.get_or_insert_with(|| {
                    self.groups.push(None);
                    self.groups.len() - 1
                }),
            };
            self.node(child, group, &[], false);
        }
    }

    fn node(&mut self, node: &usvg::Node, group: usize, clips: &[Arc<Clip>], faint: bool) {
        match node {
            usvg::Node::Group(g) => {
                // Layers may stand within an outer group.
                let group = match self.labels.get(g.id()).cloned() {
                    Some(name) if self.entered.insert(g.id().to_string()) => {
                        self.groups.push(name);
                        self.groups.len() - 1
                    }
                    _ => group,
                };
                self.group(g, group, clips, faint);
            }
            usvg::Node::Path(p) => self.path(p, group, clips, faint),
            // The survey has told about both.
            usvg::Node::Image(_) | usvg::Node::Text(_) => {}
        }
    }

    fn group(&mut self, g: &usvg::Group, group: usize, clips: &[Arc<Clip>], faint: bool) {
        if g.opacity().get() == 0.0 || self.points > MAX_POINTS {
            return;
        }
        if g.mask().is_some() {
            self.note(Note::Mask);
        }
        let faint = faint || g.opacity().get() < 1.0;
        match g.clip_path() {
            Some(c) => {
                let mut clips = clips.to_vec();
                clips.push(Arc::new(self.clip(c, g.abs_transform())));
                g.children().iter().for_each(|n| self.node(n, group, &clips, faint));
            }
            None => g.children().iter().for_each(|n| self.node(n, group, clips, faint)),
        }
    }

    /// A clip path on the sheet; `transform` is that of the element that it clips.
    fn clip(&mut self, c: &usvg::ClipPath, transform: usvg::Transform) -> Clip {
        let own = transform.pre_concat(c.transform());
        let mut clip = Clip::default();
        self.clip_outlines(c.root(), own, &[], &mut clip);
        clip.within = c.clip_path().map(|inner| Arc::new(self.clip(inner, transform)));
        clip
    }

    fn clip_outlines(&mut self, g: &usvg::Group, own: usvg::Transform, clips: &[Arc<Clip>], into: &mut Clip) {
        let mut clips = clips.to_vec();
        if let Some(c) = g.clip_path() {
            clips.push(Arc::new(self.clip(c, own.pre_concat(g.abs_transform()))));
        }
        for node in g.children() {
            match node {
                usvg::Node::Group(g) => self.clip_outlines(g, own, &clips, into),
                usvg::Node::Path(p) if p.is_visible() => {
                    let rule = p.fill().map_or(clip::FillRule::NonZero, |f| fill_rule(f.rule()));
                    let placed = self.sheet_from_px * affine(own.pre_concat(p.abs_transform())) * bez_path(p.data());
                    if let Some(contours) = self.flatten(&placed) {
                        into.outlines.push((Outline::new(&contours, rule), clips.clone()));
                    }
                }
                _ => {}
            }
        }
    }

    fn path(&mut self, p: &usvg::Path, group: usize, clips: &[Arc<Clip>], faint: bool) {
        if !p.is_visible() || self.points > MAX_POINTS {
            return;
        }
        let path = bez_path(p.data());
        let sheet_from_path = self.sheet_from_px * affine(p.abs_transform());
        match p.paint_order() {
            usvg::PaintOrder::FillAndStroke => {
                self.fill(p, &path, sheet_from_path, group, clips, faint);
                self.stroke(p, path, sheet_from_path, group, clips, faint);
            }
            usvg::PaintOrder::StrokeAndFill => {
                self.stroke(p, path.clone(), sheet_from_path, group, clips, faint);
                self.fill(p, &path, sheet_from_path, group, clips, faint);
            }
        }
    }

    fn stroke(&mut self, p: &usvg::Path, path: BezPath, place: Affine, group: usize, clips: &[Arc<Clip>], faint: bool) {
        let Some(stroke) = p.stroke() else { return };
        let Some(color) = self.ink_color(stroke.paint(), stroke.opacity().get(), faint) else { return };
        let width = f64::from(stroke.width().get()) * place.determinant().abs().sqrt();
        let path = match stroke.dasharray() {
            Some(dashes) => self.dashed(path, dashes, stroke.dashoffset()),
            None => path,
        };
        let Some(strokes) = self.flatten(&(place * path)) else { return };
        // A stroke of no length is a dot, where its caps have an extent.
        let dots = stroke.linecap() != usvg::LineCap::Butt;
        self.draw(strokes.into_iter().filter(|s| s.len() > 1 || dots), color, Some(width), group, clips);
    }

    fn dashed(&mut self, path: BezPath, dashes: &[f32], offset: f32) -> BezPath {
        let period: f64 = dashes.iter().map(|d| f64::from(*d)).sum();
        // A dash of no length is a dot; kurbo needs some length to tell where.
        let dashes: Vec<f64> = dashes.iter().map(|d| f64::from(*d).max(1e-6 * period)).collect();
        let count = control_length(&path) / period * dashes.len() as f64;
        if !count.is_finite() || count > MAX_DASHES {
            self.note(Note::Dashes);
            return path;
        }
        kurbo::dash(path.iter(), f64::from(offset), &dashes).collect()
    }

    fn fill(&mut self, p: &usvg::Path, path: &BezPath, place: Affine, group: usize, clips: &[Arc<Clip>], faint: bool) {
        let Some(fill) = p.fill() else { return };
        let stroked = p.stroke().is_some_and(|s| s.opacity().get() > 0.0);
        if self.options.fill != Fill::Ignore && self.hides(fill, faint) && self.cover(&(place * path), fill, clips) {
            return;
        }
        match self.options.fill {
            Fill::Outline if stroked => return,
            Fill::Ignore => {
                if !stroked {
                    self.note(Note::Fill);
                }
                return;
            }
            _ => {}
        }
        let Some(color) = self.ink_color(fill.paint(), fill.opacity().get(), faint) else { return };
        let Some(mut contours) = self.flatten(&(place * path)) else { return };
        contours.retain(|c| c.len() > 2);
        if let Fill::Hatch { spacing, angle } = self.options.fill {
            let rule = fill_rule(fill.rule());
            let outline = Outline::new(&contours, rule);
            match hatch(&outline, rule, 1e3 * spacing, angle) {
                Some(lines) if !lines.is_empty() => {
                    let strokes = lines.into_iter().map(|l| l.to_vec());
                    return self.draw(strokes, color, Some(1e3 * spacing), group, clips);
                }
                Some(_) => {}
                None => self.note(Note::Hatch),
            }
            if stroked {
                return;
            }
        }
        let closed = contours.into_iter().map(|mut c| {
            if c.first() != c.last() {
                c.push(c[0]);
            }
            c
        });
        self.draw(closed, color, None, group, clips);
    }

    /// Whether a fill is opaque and of the paper's colour, as shapes are that hide lines.
    fn hides(&self, fill: &usvg::Fill, faint: bool) -> bool {
        let usvg::Paint::Color(c) = fill.paint() else { return false };
        !faint && fill.opacity().get() == 1.0 && Some(Rgb([c.red, c.green, c.blue])) == self.options.paper
    }

    /// Takes away what a shape hides of the lines drawn before it; whether that was anything.
    fn cover(&mut self, path: &BezPath, fill: &usvg::Fill, clips: &[Arc<Clip>]) -> bool {
        self.looked += self.inks.iter().map(|i| i.strokes.len() as u64).sum::<u64>();
        if self.looked > MAX_LOOKED {
            self.note(Note::Covers);
            return false;
        }
        if self.inks.is_empty() {
            return false;
        }
        let Some(contours) = self.flatten(path) else { return false };
        let area = contours.iter().map(|c| bounds(c)).reduce(|a, b| a.union(b)).unwrap_or(Rect::ZERO);
        let outline = Outline::new(&contours, fill_rule(fill.rule()));
        let clip = [Arc::new(Clip { outlines: vec![(outline, clips.to_vec())], hides: true, ..Default::default() })];
        let mut hid = false;
        for ink in &mut self.inks {
            let touched: Vec<usize> = (0..ink.boxes.len()).filter(|i| ink.boxes[*i].overlaps(area)).collect();
            let mut cut: BTreeMap<usize, Vec<Vec<Point>>> = BTreeMap::new();
            for i in touched {
                let parts = clip::clip_polyline(&ink.strokes[i], &clip);
                if parts.len() != 1 || (length(&parts[0]) - length(&ink.strokes[i])).abs() > 1e-6 {
                    cut.insert(i, parts);
                }
            }
            if cut.is_empty() {
                continue;
            }
            hid = true;
            let old = std::mem::take(&mut ink.strokes).into_iter().enumerate();
            ink.strokes = old.flat_map(|(i, s)| cut.remove(&i).unwrap_or_else(|| vec![s])).collect();
            ink.boxes = ink.strokes.iter().map(|s| bounds(s)).collect();
        }
        self.inks.retain(|i| !i.strokes.is_empty());
        if hid {
            self.note(Note::Cover);
        }
        hid
    }

    /// The ink for a paint; `None` where it leaves no mark.
    fn ink_color(&mut self, paint: &usvg::Paint, opacity: f32, faint: bool) -> Option<Rgb> {
        if opacity == 0.0 {
            return None;
        }
        let color = match paint {
            usvg::Paint::Color(c) => Rgb([c.red, c.green, c.blue]),
            usvg::Paint::LinearGradient(g) => self.mean_color(g.stops())?,
            usvg::Paint::RadialGradient(g) => self.mean_color(g.stops())?,
            usvg::Paint::Pattern(_) => {
                self.note(Note::Pattern);
                return None;
            }
        };
        if Some(color) == self.options.paper {
            self.note(Note::Paper);
            return None;
        }
        if faint || opacity < 1.0 {
            self.note(Note::Opacity);
        }
        Some(color)
    }

    fn mean_color(&mut self, stops: &[usvg::Stop]) -> Option<Rgb> {
        self.note(Note::Gradient);
        let mean = |channel: fn(&usvg::Color) -> u8| {
            let sum: f64 = stops.iter().map(|s| f64::from(channel(&s.color()))).sum();
            (sum / stops.len() as f64).round() as u8
        };
        (!stops.is_empty()).then(|| Rgb([mean(|c| c.red), mean(|c| c.green), mean(|c| c.blue)]))
    }

    /// Polylines of a path on the sheet, mm; `None`, with a note, for what is too far away to be meant.
    fn flatten(&mut self, path: &BezPath) -> Option<Vec<Vec<Point>>> {
        let near = |p: &Point| p.x.abs() <= FARTHEST && p.y.abs() <= FARTHEST;
        let all_near = path.elements().iter().all(|e| match e {
            PathEl::MoveTo(p) | PathEl::LineTo(p) => near(p),
            PathEl::QuadTo(p, q) => near(p) && near(q),
            PathEl::CurveTo(p, q, r) => near(p) && near(q) && near(r),
            PathEl::ClosePath => true,
        });
        if !all_near {
            self.note(Note::Far);
            return None;
        }
        // Segments of a flattened curve grow with the root of its length over the tolerance.
        let curves = path.elements().iter().filter(|e| matches!(e, PathEl::QuadTo(..) | PathEl::CurveTo(..))).count();
        let curved = curves as f64 * control_length(path) / self.tolerance;
        self.points += path.elements().len() as f64 + curved.sqrt();
        if self.points > MAX_POINTS {
            return None;
        }
        let (mut strokes, mut current): (Vec<Vec<Point>>, Vec<Point>) = (Vec::new(), Vec::new());
        let mut start = Point::ORIGIN;
        let mut finish = |mut stroke: Vec<Point>, drawn: bool| {
            stroke.dedup();
            if length(&stroke) < DOT {
                stroke.truncate(1);
            }
            if drawn {
                strokes.push(stroke);
            }
        };
        let mut drawn = false;
        kurbo::flatten(path.iter(), self.tolerance, |e| match e {
            PathEl::MoveTo(p) => {
                finish(std::mem::replace(&mut current, vec![p]), drawn);
                (start, drawn) = (p, false);
            }
            PathEl::LineTo(p) => {
                if current.is_empty() {
                    current.push(start);
                }
                current.push(p);
                drawn = true;
            }
            PathEl::ClosePath => {
                current.push(start);
                finish(std::mem::take(&mut current), true);
                drawn = false;
            }
            // `flatten` makes straight elements only.
            PathEl::QuadTo(..) | PathEl::CurveTo(..) => {}
        });
        finish(current, drawn);
        Some(strokes)
    }

    /// Clips and keeps strokes.
    fn draw(
        &mut self,
        strokes: impl Iterator<Item = Vec<Point>>,
        color: Rgb,
        width: Option<f64>,
        group: usize,
        clips: &[Arc<Clip>],
    ) {
        let mut kept = Vec::new();
        for stroke in strokes {
            for part in clip::clip_polyline(&stroke, clips) {
                let Some(page) = &self.crop else {
                    kept.push(part);
                    continue;
                };
                let cut = clip::clip_polyline(&part, std::slice::from_ref(page));
                if cut.len() != 1 || (length(&cut[0]) - length(&part)).abs() > 1e-3 {
                    self.note(Note::Cropped);
                }
                kept.extend(cut);
            }
        }
        if kept.is_empty() {
            return;
        }
        let at = self.inks.iter().position(|i| i.group == group && i.color == color).unwrap_or_else(|| {
            self.inks.push(Ink { group, color, strokes: Vec::new(), boxes: Vec::new(), widths: Vec::new() });
            self.inks.len() - 1
        });
        if let Some(w) = width.filter(|w| *w >= HAIRLINE) {
            self.inks[at].widths.push((w, kept.iter().map(|s| length(s)).sum()));
        }
        self.inks[at].boxes.extend(kept.iter().map(|s| bounds(s)));
        self.inks[at].strokes.append(&mut kept);
    }

    pub(super) fn layers(self) -> Vec<InkLayer> {
        // each with its widths and their lengths, and whether it has no name of its own yet
        type Named = (InkLayer, Vec<(f64, f64)>, bool);
        let mut layers: Vec<Named> = Vec::new();
        for ink in &self.inks {
            let Rgb([r, g, b]) = ink.color;
            let hex = format!("#{r:02x}{g:02x}{b:02x}");
            let shared = self.inks.iter().filter(|i| i.group == ink.group).count() > 1;
            let label = self.groups[ink.group].as_ref().map(|(label, _)| label);
            let name = match label {
                Some(group) if shared => format!("{group} {hex}"),
                Some(group) => group.clone(),
                None => hex.clone(),
            };
            let strokes = ink
                .strokes
                .iter()
                .map(|s| Stroke::new(s.iter().map(|p| Point2::new(1e-3 * p.x, 1e-3 * p.y)).collect()));
            match layers.iter_mut().find(|(l, ..)| self.options.by_ink && l.color == ink.color) {
                Some((layer, widths, unnamed)) => {
                    // Strokes of several groups with names of their own have the colour alone in common.
                    match label {
                        Some(_) if *unnamed => layer.name = name,
                        Some(_) if layer.name != name => layer.name = hex,
                        _ => {}
                    }
                    *unnamed &= label.is_none();
                    layer.strokes.extend(strokes);
                    widths.extend(&ink.widths);
                }
                None => layers.push((
                    InkLayer { name, color: ink.color, width_hint: None, strokes: strokes.collect() },
                    ink.widths.clone(),
                    label.is_none(),
                )),
            }
        }
        let hinted = |(mut layer, widths, _): (InkLayer, Vec<(f64, f64)>, bool)| {
            layer.width_hint = median_by_length(widths).map(|w| 1e-3 * w);
            layer
        };
        let mut layers: Vec<InkLayer> = layers.into_iter().map(hinted).collect();
        tell_apart(&mut layers);
        layers
    }
}

/// Gives layers of one name different ones: by their colours, then by number.
fn tell_apart(layers: &mut [InkLayer]) {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    layers.iter().for_each(|l| *counts.entry(l.name.clone()).or_default() += 1);
    for layer in layers.iter_mut().filter(|l| counts[&l.name] > 1) {
        let Rgb([r, g, b]) = layer.color;
        layer.name = format!("{} #{r:02x}{g:02x}{b:02x}", layer.name);
    }
    let mut taken = BTreeSet::new();
    for layer in layers {
        let (plain, mut n) = (layer.name.clone(), 1);
        while !taken.insert(layer.name.clone()) {
            n += 1;
            layer.name = format!("{plain} ({n})");
        }
    }
}

fn bounds(points: &[Point]) -> Rect {
    let first = points.first().copied().unwrap_or_default();
    points.iter().fold(Rect::from_points(first, first), |r, p| r.union_pt(*p))
}

/// The width below and above which half of the length was drawn.
fn median_by_length(mut widths: Vec<(f64, f64)>) -> Option<f64> {
    widths.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * widths.iter().map(|w| w.1).sum::<f64>();
    let mut sum = 0.0;
    widths
        .iter()
        .find(|w| {
            sum += w.1;
            sum >= half
        })
        .map(|w| w.0)
}

fn length(points: &[Point]) -> f64 {
    points.windows(2).map(|w| (w[1] - w[0]).hypot()).sum()
}

/// Length of a path's control polygon, not less than that of the path.
fn control_length(path: &BezPath) -> f64 {
    let (mut sum, mut last, mut start) = (0.0, Point::ORIGIN, Point::ORIGIN);
    let mut go = |p: Point, last: &mut Point| {
        sum += (p - *last).hypot();
        *last = p;
    };
    for e in path.elements() {
        match *e {
            PathEl::MoveTo(p) => (last, start) = (p, p),
            PathEl::LineTo(p) => go(p, &mut last),
            PathEl::QuadTo(p, q) => [p, q].into_iter().for_each(|p| go(p, &mut last)),
            PathEl::CurveTo(p, q, r) => [p, q, r].into_iter().for_each(|p| go(p, &mut last)),
            PathEl::ClosePath => go(start, &mut last),
        }
    }
    sum
}

fn affine(t: usvg::Transform) -> Affine {
    Affine::new([t.sx, t.ky, t.kx, t.sy, t.tx, t.ty].map(f64::from))
}

fn fill_rule(rule: usvg::FillRule) -> clip::FillRule {
    match rule {
        usvg::FillRule::NonZero => clip::FillRule::NonZero,
        usvg::FillRule::EvenOdd => clip::FillRule::EvenOdd,
    }
}

fn bez_path(data: &usvg::tiny_skia_path::Path) -> BezPath {
    let point = |p: usvg::tiny_skia_path::Point| Point::new(f64::from(p.x), f64::from(p.y));
    let mut path = BezPath::new();
    for segment in data.segments() {
        path.push(match segment {
            PathSegment::MoveTo(p) => PathEl::MoveTo(point(p)),
            PathSegment::LineTo(p) => PathEl::LineTo(point(p)),
            PathSegment::QuadTo(p, q) => PathEl::QuadTo(point(p), point(q)),
            PathSegment::CubicTo(p, q, r) => PathEl::CurveTo(point(p), point(q), point(r)),
            PathSegment::Close => PathEl::ClosePath,
        });
    }
    path
}
