//! A picture in inks: overlapping tones, or flat areas side by side.
use crate::math::{Rgb, linear_from_srgb};
use crate::picture::{Picture, Plane};

/// An ink as pictures are separated into: a name and a colour.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ink {
    /// Name of the ink and of its layer: `cyan`, `ink 2`.
    pub name: String,
    /// Colour of a full line on paper.
    pub color: Rgb,
}

/// How much of one ink a picture wants where.
#[derive(Clone, Debug, PartialEq)]
pub struct Tone {
    /// The ink.
    pub ink: Ink,
    /// Desired share of the paper that the ink covers, 0..=1, at each pixel of the picture.
    pub coverage: Plane,
}

/// A picture flattened to a few inks that don't overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct Flat {
    width: usize,
    height: usize,
    /// The inks, and perhaps the paper.
    pub inks: Vec<Ink>,
    /// Index into `inks` of what is bare paper: no pen draws it.
    pub paper: Option<usize>,
    /// `width * height` indices into `inks`, row by row.
    pub labels: Vec<u8>,
}

impl Flat {
    /// A flat picture; `None` when the labels don't fill it or name no ink.
    pub fn new(width: usize, height: usize, inks: Vec<Ink>, paper: Option<usize>, labels: Vec<u8>) -> Option<Self> {
        let known = labels.iter().all(|l| usize::from(*l) < inks.len()) && paper.is_none_or(|p| p < inks.len());
        (labels.len() == width * height && known).then_some(Self { width, height, inks, paper, labels })
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The picture in its inks' colours.
    pub fn picture(&self) -> Picture {
        let colors: Vec<[f32; 3]> =
            self.inks.iter().map(|ink| ink.color.0.map(|v| linear_from_srgb(v) as f32)).collect();
        let pixels = self.labels.iter().map(|l| colors[usize::from(*l)]).collect();
        Picture::from_pixels(self.width, self.height, pixels).unwrap_or_default()
    }
}
