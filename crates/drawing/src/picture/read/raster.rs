//! Pixels as a file stores them.
use super::profile::Space;

/// What the samples of a pixel are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Model {
    Grey,
    Rgb,
    /// Four inks; the largest value is full ink.
    Cmyk,
}

impl Model {
    /// Samples of a pixel, without alpha.
    pub(super) fn samples(self) -> usize {
        match self {
            Self::Grey => 1,
            Self::Rgb => 3,
            Self::Cmyk => 4,
        }
    }
}

/// How a sample is stored, in this machine's order of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Depth {
    Eight,
    Sixteen,
    /// 32-bit floats, 1 is white.
    Float,
}

impl Depth {
    /// Bytes of a sample.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::Eight => 1,
            Self::Sixteen => 2,
            Self::Float => 4,
        }
    }

    /// The value of full light, or of full ink.
    pub(super) fn last(self) -> f32 {
        match self {
            Self::Eight => 255.0,
            Self::Sixteen => 65_535.0,
            Self::Float => 1.0,
        }
    }
}

/// A decoded file.
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) model: Model,
    /// A last sample says how opaque the pixel is.
    pub(super) alpha: bool,
    pub(super) depth: Depth,
    /// Rows from the top, pixels from the left, samples side by side.
    pub(super) bytes: Vec<u8>,
    /// What the samples mean.
    pub(super) space: Space,
    /// Exif orientation, 1..=8.
    pub(super) orientation: u8,
    /// What the user should know of the file.
    pub(super) notes: Vec<String>,
}

impl Raster {
    /// Samples of a pixel, with alpha.
    pub(super) fn samples(&self) -> usize {
        self.model.samples() + usize::from(self.alpha)
    }

    /// The rows, from the top.
    pub(super) fn rows(&self) -> std::slice::ChunksExact<'_, u8> {
        self.bytes.chunks_exact(self.width * self.samples() * self.depth.bytes())
    }

    /// The whole number stored as sample `i` of a row; 0 for floats.
    pub(super) fn step(&self, row: &[u8], i: usize) -> usize {
        match self.depth {
            Depth::Eight => usize::from(row[i]),
            Depth::Sixteen => usize::from(u16::from_ne_bytes([row[2 * i], row[2 * i + 1]])),
            Depth::Float => 0,
        }
    }

    /// Sample `i` of a row, 0..=1 but for floats that are more.
    pub(super) fn value(&self, row: &[u8], i: usize) -> f32 {
        match self.depth {
            Depth::Float => {
                let v = f32::from_ne_bytes([row[4 * i], row[4 * i + 1], row[4 * i + 2], row[4 * i + 3]]);
                if v.is_finite() { v.max(0.0) } else { 0.0 }
            }
            depth => self.step(row, i) as f32 / depth.last(),
        }
    }

    /// Takes four inks for light, as browsers do without a press's profile: `(1 - ink)(1 - black)`.
    pub(super) fn without_inks(mut self) -> Self {
        if self.model != Model::Cmyk {
            return self;
        }
        let samples = self.samples();
        let count = self.width * self.height;
        let mut light = Vec::with_capacity(3 * count * self.depth.bytes());
        for row in self.rows() {
            for x in 0..self.width {
                let bare = |k: usize| self.depth.last() as u64 - self.step(row, samples * x + k) as u64;
                let last = self.depth.last() as u64;
                for ink in 0..3 {
                    let v = (bare(ink) * bare(3) + last / 2) / last;
                    match self.depth {
                        Depth::Eight => light.push(v as u8),
                        _ => light.extend_from_slice(&(v as u16).to_ne_bytes()),
                    }
                }
            }
        }
        self.bytes = light;
        self.model = Model::Rgb;
        self.alpha = false;
        self
    }
}
