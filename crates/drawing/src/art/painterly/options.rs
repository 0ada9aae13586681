//! How a picture is painted.
use crate::art::{ArtError, BrushFill};

/// The styles of Hertzmann 1998, section 3.1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PainterlyStyle {
    /// Curved strokes that follow the forms; the default.
    #[default]
    Impressionist,
    /// Long strokes that keep their direction, with paper showing through.
    Expressionist,
    /// Loose strokes of half coverage.
    ColouristWash,
    /// Dots.
    Pointillist,
}

/// How a picture is painted. Lengths on the sheet, m.
#[derive(Clone, Debug, PartialEq)]
pub struct PainterlyOptions {
    /// R_i: brush radii; empty: as large as the budget of strokes needs to cover the sheet, halved down to the pen's line.
    pub radii: Vec<f64>,
    /// T: a stroke is painted where it brings the canvas nearer to the picture by at least this much on average, in Oklab
    /// (0 to about 1; the square root of the mean fall of the squared difference). It is taken as if the stroke were larger
    /// by a dot of the largest brush, so that short strokes are painted where they matter.
    pub threshold: f64,
    /// f_sigma: the flow of a brush is that of the picture blurred by this many radii.
    pub blur: f64,
    /// f_g: distance between seeds, in radii.
    pub grid: f64,
    /// Shortest stroke, in radii.
    pub min_length: f64,
    /// Longest stroke, in radii of a brush between this and the largest, their geometric mean: fine lines may be long.
    pub max_length: f64,
    /// f_c: 1 follows the picture's flow, less keeps to the stroke's own direction, 0 draws straight lines.
    pub curvature: f64,
    /// How far strokes turn from the flow, at random: standard deviation, rad.
    pub jitter: f64,
    /// Share of a brush stroke's area that its lines cover: above 1 they overlap, below 1 paper shows between them.
    pub coverage: f64,
    /// How wide brush strokes are filled.
    pub fill: BrushFill,
    /// How much it counts against a stroke that another ink, or none, would do better under parts of it. At 0 the fall of
    /// the difference alone counts, and broad strokes run over details.
    pub regret: f64,
    /// 0 paints the picture, 1 its flattened version.
    pub flatness: f64,
    /// Most strokes.
    pub strokes: usize,
    /// Keep the pen in hand while its best stroke is worth at least this share of the best of all, 0..=1. At 1 the best
    /// stroke is always next, and pens change most.
    pub patience: f64,
}

impl Default for PainterlyOptions {
    fn default() -> Self {
        Self {
            radii: Vec::new(),
            threshold: 0.025,
            blur: 0.5,
            grid: 1.0,
            min_length: 4.0,
            max_length: 16.0,
            curvature: 1.0,
            jitter: 0.0,
            coverage: 1.0 / 0.9,
            fill: BrushFill::Bundle,
            regret: 4.0,
            flatness: 0.5,
            strokes: 1500,
            patience: 0.95,
        }
    }
}

impl PainterlyOptions {
    /// The options of a style.
    pub fn style(style: PainterlyStyle) -> Self {
        let base = Self::default();
        match style {
            PainterlyStyle::Impressionist => base,
            PainterlyStyle::Expressionist => {
                Self { threshold: 0.03, curvature: 0.25, min_length: 10.0, coverage: 0.7, jitter: 0.15, ..base }
            }
            PainterlyStyle::ColouristWash => Self { threshold: 0.06, coverage: 0.5, ..base },
            PainterlyStyle::Pointillist => Self { grid: 0.5, min_length: 0.0, max_length: 0.0, ..base },
        }
    }

    /// The first option that makes no sense.
    pub(super) fn invalid(&self) -> Option<ArtError> {
        let within = [
            ("threshold", self.threshold, 0.0, 1.0),
            ("blur", self.blur, 0.0, 20.0),
            ("grid", self.grid, 0.1, 20.0),
            ("min_length", self.min_length, 0.0, 1000.0),
            ("max_length", self.max_length, self.min_length, 1000.0),
            ("curvature", self.curvature, 0.0, 1.0),
            ("jitter", self.jitter, 0.0, 3.2),
            ("coverage", self.coverage, 0.05, 4.0),
            ("regret", self.regret, 0.0, 100.0),
            ("flatness", self.flatness, 0.0, 1.0),
            ("patience", self.patience, 0.0, 1.0),
            ("strokes", self.strokes as f64, 1.0, 1e6),
        ];
        let bad = within.into_iter().find(|(_, value, low, high)| !(low..=high).contains(&value));
        let bad = bad.map(|(name, value, low, high)| (name, value, format!("should be from {low} to {high}")));
        let radius = self.radii.iter().find(|r| !(**r > 0.0 && r.is_finite()));
        bad.or(radius.map(|r| ("radii", *r, "should be a length above 0".to_string())))
            .map(|(name, value, message)| ArtError::BadOption { name, value, message })
    }
}
