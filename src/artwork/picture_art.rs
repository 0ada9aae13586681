//! Pictures to strokes: a scenario's words in the terms of the generators.
use std::path::Path;
use std::time::Duration;

use super::ArtworkError;
use super::make::Made;
use super::pens::ink_pen;
use crate::art::depth::{LayeredOptions, Semantics, SemanticsError, estimate, layered_depth};
use crate::art::{
    ArtError, Artwork, DotOptions, EdgeOptions, HatchOptions, PainterlyOptions, PainterlyStyle, Plate, Sheet,
    TspOptions, dot_art, edges, hatching, painterly, tsp_art,
};
use crate::drawing::Size;
use crate::files;
use crate::math::PAPER;
use crate::picture::{
    CmykOptions, Dither, Flat, Ink, Noted, Palette, PaletteMethod, PaperRule, Picture, Plane, ReadOptions, Tone,
    ToneCurve, cmyk, pens, read, read_depth, read_labels, separation_image, single,
};
use crate::progress::Progress;
use crate::scenario::{
    ColorSettings, Generator, HatchingSettings, LayeredDepthSettings, PainterStyle, PainterlySettings, PictureSpec,
    Separation, Sketch, TspSettings, parse_color,
};
use crate::tour::Effort;

/// Ink of pictures in one ink.
const BLACK: crate::math::Rgb = crate::math::Rgb([26, 26, 30]);
/// Longer side of a picture's sheet when the scenario asks for none, m.
const LONG_SIDE: f64 = 0.2;
/// How near colours of a cluster are, in Oklab, and the least share of the picture that makes one.
const DBSCAN_REACH: f32 = 0.035;
const DBSCAN_SHARE: f64 = 0.005;
/// Passes that remove specks from a flattened picture.
const SMOOTHING: usize = 2;

/// Reads a picture and makes strokes of it.
pub(super) fn make(spec: &PictureSpec, sketch: &Sketch, progress: &dyn Progress) -> Result<Made, ArtworkError> {
    let read = told(&spec.file, read(&spec.file, &ReadOptions::default())?, progress);
    let picture = levels(&read, &spec.color).picture(&read);
    let mm = |x: Option<f64>| x.map(|x| x * 1e-3);
    let size = match (mm(sketch.drawing.width_mm), mm(sketch.drawing.height_mm)) {
        (None, None) => Size::Fit(LONG_SIDE, LONG_SIDE),
        (Some(w), None) => Size::Width(w),
        (None, Some(h)) => Size::Height(h),
        (Some(w), Some(h)) => Size::Fit(w, h),
    };
    let (width, height) = size.resolve(1e-3 * picture.width() as f64, 1e-3 * picture.height() as f64)?;
    let job = Job {
        file: &spec.file,
        picture: &picture,
        sheet: Sheet { width, height },
        color: &spec.color,
        sketch,
        progress,
    };
    let artwork = match &spec.generator {
        Generator::Tsp(s) => job.tsp(s)?,
        Generator::Stipple(s) => job.dots(s.dots)?,
        Generator::Painterly(s) => job.painterly(s)?,
        Generator::LayeredDepth(s) => job.layered_depth(s)?,
        Generator::Hatching(s) => job.hatching(s)?,
        Generator::Edges(s) => {
            let ink = black();
            let options = EdgeOptions {
                scale: s.detail_mm * 1e-3,
                contrast: s.contrast,
                min_length: s.min_length_mm * 1e-3,
                ..Default::default()
            };
            job.made(edges(&picture, job.sheet, job.line(&ink)?, &ink, &options))?
        }
    };
    for note in &artwork.notes {
        progress.note(&format!("{}: {note}", spec.file.display()));
    }
    let Artwork { drawing, plates, .. } = artwork;
    Ok(Made { drawing, picture: Some(picture), plates })
}

/// What a file holds, once its notes are told.
fn told<T>(file: &Path, read: Noted<T>, progress: &dyn Progress) -> T {
    for note in &read.notes {
        progress.note(&format!("{}: {note}", file.display()));
    }
    read.content
}

fn levels(picture: &Picture, color: &ColorSettings) -> ToneCurve {
    let (black, white, gamma) = (color.black_point as f32, color.white_point as f32, color.gamma as f32);
    match color.auto_levels {
        true => ToneCurve { gamma, ..ToneCurve::auto(picture, 0.005) },
        false => ToneCurve { black, white, gamma },
    }
}

fn black() -> Ink {
    Ink { name: "black".into(), color: BLACK }
}

/// A picture in inks, each with the width of its line, m, and pictures of them.
struct Separated {
    tones: Vec<(Tone, f64)>,
    plates: Vec<Plate>,
}

/// What every generator is given.
struct Job<'a> {
    file: &'a Path,
    picture: &'a Picture,
    sheet: Sheet,
    color: &'a ColorSettings,
    sketch: &'a Sketch,
    progress: &'a dyn Progress,
}

impl Job<'_> {
    /// What was made of the picture, or the mistake with the picture's name.
    fn made<T>(&self, result: Result<T, ArtError>) -> Result<T, ArtworkError> {
        result.map_err(|source| ArtworkError::Art { picture: self.file.to_path_buf(), source })
    }

    /// Width of an ink's line, m: its pen's.
    fn line(&self, ink: &Ink) -> Result<f64, ArtworkError> {
        Ok(ink_pen(&ink.name, ink.color, &self.sketch.pen)?.width_nominal)
    }

    /// The pens that one owns.
    fn own_pens(&self) -> Vec<Ink> {
        let ink = |(name, color): (&String, &String)| Some(Ink { name: name.clone(), color: parse_color(color)? });
        self.color.pens.iter().filter_map(ink).collect()
    }

    /// The picture in inks that may overlap, and pictures of them.
    fn tones(&self) -> Result<Separated, ArtworkError> {
        let tones = match self.color.separation.unwrap_or(Separation::Black) {
            Separation::Black => vec![single(self.picture, &black(), PAPER, &ToneCurve::default())],
            Separation::Cmyk => {
                cmyk(self.picture, &CmykOptions { gcr: self.color.grey_replacement, ..Default::default() })
            }
            Separation::Pens => {
                let dither = if self.color.dither { Dither::Shares } else { Dither::None };
                pens(self.picture, &self.own_pens(), PAPER, dither)
            }
            _ => areas(&self.flat()?),
        };
        let mut plates = Vec::new();
        for tone in &tones {
            let name = format!("separation-{}", file_name(&tone.ink.name));
            let caption = format!("Separation: {}", tone.ink.name);
            plates.push(Plate { name, caption, image: separation_image(tone, PAPER)? });
        }
        let tones = tones.into_iter().map(|t| Ok((self.line(&t.ink)?, t)));
        let tones: Result<Vec<(Tone, f64)>, ArtworkError> = tones.map(|r| r.map(|(w, t)| (t, w))).collect();
        Ok(Separated { tones: tones?, plates })
    }

    /// The picture in a few inks side by side.
    fn flat(&self) -> Result<Flat, ArtworkError> {
        let count = self.color.count as usize;
        let of = |method| Palette::of(self.picture, method, self.sketch.seed);
        let desired = |method: &dyn Fn(usize) -> PaletteMethod| {
            let palette = of(method(count));
            // a colour that the paper has needs no pen: look for one more
            match palette.paper(PaperRule::LightestIfNearWhite) {
                Some(_) => of(method(count + 1)),
                None => palette,
            }
        };
        let palette = match self.color.separation.unwrap_or(Separation::Kmeans) {
            Separation::Kmeans => desired(&|colors| PaletteMethod::KMeans { colors }),
            Separation::Agglomerative => desired(&|colors| PaletteMethod::Agglomerative { colors }),
            Separation::Dbscan => {
                of(PaletteMethod::Dbscan { reach: DBSCAN_REACH, min_share: DBSCAN_SHARE, max_colors: count })
            }
            Separation::Pens => with_paper(self.own_pens()),
            Separation::Cmyk => with_paper(CmykOptions::default().inks.to_vec()),
            Separation::Black => with_paper(vec![black()]),
        };
        let flat = palette.flatten(self.picture, PaperRule::LightestIfNearWhite, SMOOTHING);
        self.made(flat.ok_or_else(|| ArtError::NothingToDraw { reason: "the picture has no colours".into() }))
    }

    /// What is where, and how near: from files, from models, or estimated.
    fn semantics(&self, s: &LayeredDepthSettings) -> Result<Semantics, ArtworkError> {
        let picture = self.picture;
        let depth = match (&s.depth, &s.depth_model) {
            (Some(file), _) => Some(told(file, read_depth(file)?, self.progress)),
            (None, Some(model)) => Some(models::depth(model, picture)?),
            (None, None) => None,
        };
        let labels = match (&s.labels, &s.segment_model) {
            (Some(file), _) => Some(read_labels(file)?),
            (None, Some(model)) => Some(models::labels(model, picture)?),
            (None, None) => None,
        };
        let (labels, depth) = match (labels, depth) {
            (None, None) => return Ok(estimate(picture)?),
            (None, Some(depth)) => return Ok(estimate(picture)?.with_depth(&depth)?),
            (Some(labels), depth) => (labels, depth),
        };
        let table = match &s.segments {
            Some(file) => text_of(file)?,
            None => "[]".into(),
        };
        let table_file = s.segments.as_deref().unwrap_or(Path::new("segments"));
        if let Some(depth) = depth {
            return Ok(Semantics::from_labels(&labels, &table, table_file, &depth)?);
        }
        let mut semantics = Semantics::from_labels(&labels, &table, table_file, estimate(picture)?.depth())?;
        semantics.notes.push("depth is an estimate: give a depth image or a model for what is really there".into());
        Ok(semantics)
    }

    fn lines(&self, flat: &Flat) -> Result<Vec<f64>, ArtworkError> {
        flat.inks.iter().map(|ink| self.line(ink)).collect()
    }

    fn tsp(&self, s: &TspSettings) -> Result<Artwork, ArtworkError> {
        let Separated { tones, plates } = self.tones()?;
        let effort = match s.seconds {
            Some(seconds) => Effort::Time(Duration::from_secs_f64(seconds)),
            None => Effort::Kicks(s.kicks),
        };
        let points = s.points.map(|n| n as usize);
        let options = TspOptions { points, closed: s.closed, effort, ..TspOptions::default() };
        Ok(with(plates, self.made(tsp_art(&tones, self.sheet, &options, self.sketch.seed))?))
    }

    fn dots(&self, count: Option<u32>) -> Result<Artwork, ArtworkError> {
        let Separated { tones, plates } = self.tones()?;
        let options = DotOptions { points: count.map(|n| n as usize), ..Default::default() };
        Ok(with(plates, self.made(dot_art(&tones, self.sheet, &options, self.sketch.seed))?))
    }

    fn painterly(&self, s: &PainterlySettings) -> Result<Artwork, ArtworkError> {
        let flat = self.flat()?;
        let style = match s.hand {
            PainterStyle::Impressionist => PainterlyStyle::Impressionist,
            PainterStyle::Expressionist => PainterlyStyle::Expressionist,
            PainterStyle::ColouristWash => PainterlyStyle::ColouristWash,
            PainterStyle::Pointillist => PainterlyStyle::Pointillist,
        };
        let radii = s.brushes_mm.iter().map(|mm| 0.5e-3 * mm).collect();
        let options = PainterlyOptions { strokes: s.strokes as usize, radii, ..PainterlyOptions::style(style) };
        self.made(painterly(&flat, self.picture, self.sheet, &self.lines(&flat)?, &options, self.sketch.seed))
    }

    fn layered_depth(&self, s: &LayeredDepthSettings) -> Result<Artwork, ArtworkError> {
        let flat = self.flat()?;
        let semantics = self.semantics(s)?;
        let options = LayeredOptions { strokes: s.strokes as usize, ..Default::default() };
        let lines = self.lines(&flat)?;
        self.made(layered_depth(&flat, self.picture, &semantics, self.sheet, &lines, &options, self.sketch.seed))
    }

    fn hatching(&self, s: &HatchingSettings) -> Result<Artwork, ArtworkError> {
        let Separated { tones, plates } = self.tones()?;
        let default = HatchOptions::default();
        let options = HatchOptions {
            directions: s.directions as usize,
            follow: s.follow,
            angle: s.angle_deg.to_radians(),
            min_length: s.min_length_mm * 1e-3,
            edges: default.edges.filter(|_| s.edges),
            ..default
        };
        Ok(with(plates, self.made(hatching(&tones, self.picture, self.sheet, &options, self.sketch.seed))?))
    }
}

/// Depth and labels from models, where the program can run them.
#[cfg(feature = "onnx")]
mod models {
    use super::{ArtworkError, Path, Picture, Plane};
    use crate::art::depth::{ModelOptions, depth_from_model, labels_from_model};
    use crate::picture::Labels;

    pub(super) fn depth(model: &Path, picture: &Picture) -> Result<Plane, ArtworkError> {
        Ok(depth_from_model(model, picture, &ModelOptions::default())?)
    }

    pub(super) fn labels(model: &Path, picture: &Picture) -> Result<Labels, ArtworkError> {
        Ok(labels_from_model(model, picture, &ModelOptions::default())?)
    }
}

#[cfg(not(feature = "onnx"))]
mod models {
    use super::{ArtworkError, Path, Picture, Plane};
    use crate::picture::Labels;

    pub(super) fn depth(model: &Path, _: &Picture) -> Result<Plane, ArtworkError> {
        Err(ArtworkError::NoModels { model: model.to_path_buf() })
    }

    pub(super) fn labels(model: &Path, _: &Picture) -> Result<Labels, ArtworkError> {
        Err(ArtworkError::NoModels { model: model.to_path_buf() })
    }
}

/// The palette of these pens and the paper.
fn with_paper(mut inks: Vec<Ink>) -> Palette {
    inks.push(Ink { name: "paper".into(), color: PAPER });
    Palette { inks }
}

/// Each ink's areas, fully covered.
fn areas(flat: &Flat) -> Vec<Tone> {
    let inks = flat.inks.iter().enumerate().filter(|(i, _)| Some(*i) != flat.paper);
    let area = |i: usize| flat.labels.iter().map(|l| if usize::from(*l) == i { 1.0 } else { 0.0 }).collect();
    let coverage = |i| Plane::from_values(flat.width(), flat.height(), area(i)).unwrap_or_default();
    inks.map(|(i, ink)| Tone { ink: ink.clone(), coverage: coverage(i) }).collect()
}

fn text_of(file: &Path) -> Result<String, ArtworkError> {
    let io = |source| SemanticsError::Io { file: file.to_path_buf(), source };
    Ok(files::read_text(file).map_err(io)?)
}

/// The artwork with these plates before its own.
fn with(mut plates: Vec<Plate>, mut artwork: Artwork) -> Artwork {
    plates.append(&mut artwork.plates);
    Artwork { plates, ..artwork }
}

/// An ink's name as part of a file's.
fn file_name(ink: &str) -> String {
    ink.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}
