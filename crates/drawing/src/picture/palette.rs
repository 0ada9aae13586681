//! Palettes: the few inks that stand for a picture's colours, and the picture flattened to them.
use rayon::prelude::*;

use crate::math::Rgb;
use crate::math::srgb_from_linear;
use crate::picture::cluster::{self, Weighted, nearest};
use crate::picture::color::{Oklab, linear_from_oklab, oklab_difference2, oklab_from_linear, oklab_from_rgb};
use crate::picture::color_name::unique_names;
use crate::picture::{Flat, Ink, Picture, majority};

/// Most inks of a palette: a [`Flat`] labels them in bytes.
pub const PALETTE_MAX: usize = 255;

/// How the colours of a palette are found, by [`oklab_difference2`](crate::picture::oklab_difference2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PaletteMethod {
    /// So many colours that the squared differences from them are least: k-means from k-means++ seeds, the best of eight.
    KMeans {
        /// Number of colours.
        colors: usize,
    },
    /// So many colours by joining the two nearest groups again and again (Ward's criterion): keeps small, odd colours better.
    Agglomerative {
        /// Number of colours.
        colors: usize,
    },
    /// As many colours as there are dense groups of them (DBSCAN).
    Dbscan {
        /// How near colours of a group are (white to black is 1): 0.02 to 0.06.
        reach: f32,
        /// Least share of the picture's pixels within reach of a colour inside a group: 0.002 to 0.02.
        min_share: f64,
        /// Most colours: the largest groups are kept.
        max_colors: usize,
    },
}

/// The inks that stand for a picture's colours, light to dark.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Palette {
    /// At most [`PALETTE_MAX`] inks, each with a plain name of its own, such as `dark blue` or `red 2`.
    pub inks: Vec<Ink>,
}

/// What of a flattened picture is left to the paper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PaperRule {
    /// Nothing: every ink is drawn.
    None,
    /// The lightest ink, where it is so near to white that nobody would draw it.
    #[default]
    LightestIfNearWhite,
}

impl Palette {
    /// The palette of a picture. A picture with fewer colours than asked for gets those it has, and one without dense groups
    /// its mean; of a picture without pixels it is empty.
    pub fn of(picture: &Picture, method: PaletteMethod, seed: u64) -> Self {
        let colors = cluster::histogram(picture);
        let mut found = match method {
            PaletteMethod::KMeans { colors: k } => cluster::k_means(&colors, k.clamp(1, PALETTE_MAX), 8, seed),
            PaletteMethod::Agglomerative { colors: k } => cluster::ward(&colors, k.clamp(1, PALETTE_MAX), seed),
            PaletteMethod::Dbscan { reach, min_share, max_colors } => {
                let mut found = cluster::dbscan(&colors, reach.max(0.0), min_share);
                if found.is_empty() {
                    found = cluster::k_means(&colors, 1, 1, seed);
                }
                found.sort_by(|a, b| b.weight.total_cmp(&a.weight));
                found.truncate(max_colors.clamp(1, PALETTE_MAX));
                found
            }
        };
        found.sort_by(|a, b| b.color[0].total_cmp(&a.color[0]));
        Self::from_colors(&found)
    }

    fn from_colors(found: &[Weighted]) -> Self {
        let colors: Vec<Oklab> = found.iter().map(|c| c.color).collect();
        let ink = |(name, color): (String, &Oklab)| {
            let light = linear_from_oklab(*color);
            Ink { name, color: Rgb(light.map(|v| srgb_from_linear(f64::from(v)))) }
        };
        Self { inks: unique_names(&colors).into_iter().zip(&colors).map(ink).collect() }
    }

    /// Which ink is bare paper.
    pub fn paper(&self, rule: PaperRule) -> Option<usize> {
        let lightness = |i: &usize| oklab_from_rgb(self.inks[*i].color)[0];
        let lightest = (0..self.inks.len()).max_by(|a, b| lightness(a).total_cmp(&lightness(b)))?;
        let off_white = oklab_difference2(oklab_from_rgb(self.inks[lightest].color), [1.0, 0.0, 0.0]).sqrt();
        (rule == PaperRule::LightestIfNearWhite && off_white < 0.12).then_some(lightest)
    }

    /// The picture in the palette's inks, each pixel in the least different one. `smoothing` passes of a majority vote among
    /// the 3 x 3 pixels around each then remove specks. `None` without inks, or with more than [`PALETTE_MAX`].
    pub fn flatten(&self, picture: &Picture, paper: PaperRule, smoothing: usize) -> Option<Flat> {
        if self.inks.is_empty() || self.inks.len() > PALETTE_MAX {
            return None;
        }
        let colors: Vec<Oklab> = self.inks.iter().map(|ink| oklab_from_rgb(ink.color)).collect();
        let (w, h) = (picture.width(), picture.height());
        let mut labels: Vec<u8> =
            picture.pixels.par_iter().map(|p| nearest(oklab_from_linear(*p), &colors) as u8).collect();
        for _ in 0..smoothing {
            let voted = majority(&labels, w, 1);
            if voted == labels {
                break;
            }
            labels = voted;
        }
        Flat::new(w, h, self.inks.clone(), self.paper(paper), labels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::linear_from_rgb;

    const COLORS: [[u8; 3]; 4] = [[250, 248, 240], [240, 140, 30], [190, 30, 40], [25, 30, 70]];
    const METHODS: [PaletteMethod; 3] = [
        PaletteMethod::KMeans { colors: 4 },
        PaletteMethod::Agglomerative { colors: 4 },
        PaletteMethod::Dbscan { reach: 0.05, min_share: 0.01, max_colors: 9 },
    ];

    /// Four fields of colour with some noise in them, and a speck in each.
    fn fields() -> Picture {
        let (w, h) = (80, 60);
        let pixel = |i: usize| {
            let (x, y) = (i % w, i / w);
            let field = 2 * (y / 30) + x / 40;
            let field = if (x % 40, y % 30) == (20, 15) { (field + 1) % 4 } else { field };
            let noise = ((x * 31 + y * 17) % 9) as i32 - 4;
            linear_from_rgb(Rgb(COLORS[field].map(|v| (i32::from(v) + noise).clamp(0, 255) as u8)))
        };
        Picture::from_pixels(w, h, (0..w * h).map(pixel).collect()).unwrap()
    }

    #[test]
    fn every_method_finds_the_fields_light_to_dark() {
        for method in METHODS {
            let palette = Palette::of(&fields(), method, 1);
            assert_eq!(palette.inks.len(), 4, "{method:?}");
            for (ink, color) in palette.inks.iter().zip(COLORS) {
                assert!(
                    ink.color.0.iter().zip(color).all(|(a, b)| a.abs_diff(b) < 6),
                    "{method:?}: {ink:?}, {color:?}"
                );
            }
            let names: Vec<&str> = palette.inks.iter().map(|i| &i.name[..]).collect();
            assert_eq!(names, ["white", "orange", "red", "dark blue"]);
        }
    }

    #[test]
    fn flattening_leaves_white_to_the_paper_and_smoothing_removes_specks() {
        let palette = Palette::of(&fields(), METHODS[0], 1);
        let rough = palette.flatten(&fields(), PaperRule::None, 0).unwrap();
        assert_eq!((rough.paper, rough.labels[15 * 80 + 20]), (None, 1));
        let smooth = palette.flatten(&fields(), PaperRule::default(), 3).unwrap();
        assert_eq!((smooth.paper, smooth.labels[15 * 80 + 20]), (Some(0), 0));
        let flat: Vec<u8> = (0..80 * 60).map(|i| 2 * (i / 80 / 30) as u8 + (i % 80 / 40) as u8).collect();
        assert!(smooth.labels == flat);
        let plate = smooth.picture().to_image().unwrap();
        assert_eq!(plate.pixel(79, 59), Some(palette.inks[3].color));
        assert_eq!(Palette::default().flatten(&fields(), PaperRule::None, 0), None);
    }

    #[test]
    fn the_smallest_pictures_have_palettes() {
        for (pixels, w) in [(vec![], 0), (vec![[1.0; 3]], 1), (vec![[0.0; 3]; 6], 3), (vec![[1.0; 3]; 6], 3)] {
            let h = pixels.len().checked_div(w).unwrap_or(0);
            let picture = Picture::from_pixels(w, h, pixels.clone()).unwrap();
            for method in METHODS {
                let palette = Palette::of(&picture, method, 1);
                assert_eq!(palette.inks.len(), usize::from(w > 0), "{method:?}");
                if let Some(flat) = palette.flatten(&picture, PaperRule::default(), 2) {
                    assert_eq!(flat.paper.is_some(), pixels[0][0] == 1.0);
                }
            }
        }
    }

    #[test]
    fn any_number_of_threads_gives_the_same_palette() {
        let pixels = (0..90_000).map(|i| [7, 13, 29].map(|m| ((i * m) % 1009) as f32 / 1009.0)).collect();
        let many = Picture::from_pixels(300, 300, pixels).unwrap();
        let at = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                METHODS.map(|method| {
                    let palette = Palette::of(&many, method, 7);
                    let flat = palette.flatten(&many, PaperRule::default(), 2);
                    (palette, flat)
                })
            })
        };
        assert!(at(1) == at(2));
    }
}
