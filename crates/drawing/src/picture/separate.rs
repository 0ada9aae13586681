//! Inks on paper: what their tones give together, and the tone of a single ink.
//!
//! Lines of an ink that cover a share `f` of the paper, laid without regard to other inks, let through `1 - f (1 - c)` of each
//! channel's light, `c` being the ink's colour over the paper's; of several inks the factors multiply. That is Neugebauer's
//! equation (1937, doi:10.1117/12.931703) with Demichel's shares, where overprints are products of the inks.
use rayon::prelude::*;

use crate::math::Rgb;
use crate::picture::color::linear_from_rgb;
use crate::picture::light::luminance;
use crate::picture::quality::srgb_encoded;
use crate::picture::{Image, Ink, Picture, PictureError, Plane, Tone};

/// Light that an ink takes from each channel of the paper's where it covers it, 0..=1.
pub(super) fn absorption(ink: &Ink, paper: Rgb) -> [f32; 3] {
    let (ink, paper) = (linear_from_rgb(ink.color), linear_from_rgb(paper));
    [0, 1, 2].map(|k| (1.0 - ink[k] / paper[k].max(1e-6)).clamp(0.0, 1.0))
}

/// What tones give together on paper, whose lines cross as they come. It has the size of the first; without tones there is
/// nothing.
pub fn mixed(tones: &[Tone], paper: Rgb) -> Picture {
    let Some(first) = tones.first().map(|t| &t.coverage) else { return Picture::default() };
    let mut pixels = vec![linear_from_rgb(paper); first.values.len()];
    for tone in tones {
        let takes = absorption(&tone.ink, paper);
        pixels.par_iter_mut().zip(&tone.coverage.values).for_each(|(p, f)| {
            *p = [0, 1, 2].map(|k| p[k] * (1.0 - f.clamp(0.0, 1.0) * takes[k]));
        });
    }
    Picture::from_pixels(first.width(), first.height(), pixels).unwrap_or_default()
}

/// What tones give together whose marks lie side by side, as those of [`pens`](crate::picture::pens) do; a pixel with more
/// than full coverage is shared out.
pub fn side_by_side(tones: &[Tone], paper: Rgb) -> Picture {
    let Some(first) = tones.first().map(|t| &t.coverage) else { return Picture::default() };
    let paper = linear_from_rgb(paper);
    let colors: Vec<[f32; 3]> = tones.iter().map(|t| linear_from_rgb(t.ink.color)).collect();
    let pixel = |i: usize| {
        let share = |t: &Tone| t.coverage.values.get(i).map_or(0.0, |f| f.clamp(0.0, 1.0));
        let total: f32 = tones.iter().map(share).sum();
        let mut light = paper.map(|p| p * (1.0 - total).max(0.0));
        for (tone, color) in tones.iter().zip(&colors) {
            let share = share(tone) / total.max(1.0);
            light = [0, 1, 2].map(|k| light[k] + share * color[k]);
        }
        light
    };
    let pixels = (0..first.values.len()).into_par_iter().map(pixel).collect();
    Picture::from_pixels(first.width(), first.height(), pixels).unwrap_or_default()
}

/// A separation in its ink's colour on paper.
///
/// # Errors
/// [`PictureError::Pixels`], of a plane too large for an image.
pub fn separation_image(tone: &Tone, paper: Rgb) -> Result<Image, PictureError> {
    mixed(std::slice::from_ref(tone), paper).to_image()
}

/// Levels, as picture editors have them: sRGB-encoded values from `black` to `white` are stretched to 0..=1, then raised to
/// `1 / gamma`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneCurve {
    /// The value that becomes black, 0..=1.
    pub black: f32,
    /// The value that becomes white, 0..=1, above `black`.
    pub white: f32,
    /// Above 1 lightens the middle, below darkens it.
    pub gamma: f32,
}

impl Default for ToneCurve {
    fn default() -> Self {
        Self { black: 0.0, white: 1.0, gamma: 1.0 }
    }
}

impl ToneCurve {
    /// The levels that make the darkest and the lightest `clip` (0..0.5, such as 0.005) of the picture's luminances black and
    /// white. A picture without contrast is left as it is.
    pub fn auto(picture: &Picture, clip: f64) -> Self {
        let mut counts = [0usize; 256];
        for p in &picture.pixels {
            counts[(srgb_encoded(luminance(*p)) * 255.0 + 0.5) as usize] += 1;
        }
        let skip = (clip.clamp(0.0, 0.5) * picture.pixels.len() as f64) as usize;
        // The first value at which more pixels than the clipped ones have been passed.
        let past = |value: fn(usize) -> usize| {
            let mut sum = 0;
            let at = (0..256).map(value).find(|v| {
                sum += counts[*v];
                sum > skip
            });
            at.map_or(0.0, |v| v as f32 / 255.0)
        };
        let (black, white) = (past(|i| i), past(|i| 255 - i));
        if white - black < 0.02 { Self::default() } else { Self { black, white, gamma: 1.0 } }
    }

    /// The light that becomes of a linear light.
    pub fn apply(&self, light: f32) -> f32 {
        if *self == Self::default() {
            return light;
        }
        let span = (self.white - self.black).max(1e-3);
        let v = ((srgb_encoded(light) - self.black) / span).clamp(0.0, 1.0).powf(1.0 / self.gamma.clamp(0.05, 20.0));
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    }

    /// The picture with the curve on each of its channels.
    pub fn picture(&self, picture: &Picture) -> Picture {
        let pixels = picture.pixels.par_iter().map(|p| p.map(|v| self.apply(v))).collect();
        Picture::from_pixels(picture.width(), picture.height(), pixels).unwrap_or_default()
    }
}

/// The tone of one ink that has the picture's luminance: `f = (1 - Y) / (1 - Y_ink)`, both over the paper's, at most 1. The
/// picture's white is bare paper. An ink as light as the paper covers nothing.
pub fn single(picture: &Picture, ink: &Ink, paper: Rgb, curve: &ToneCurve) -> Tone {
    let reach = 1.0 - luminance(linear_from_rgb(ink.color)) / luminance(linear_from_rgb(paper)).max(1e-6);
    let cover = |p: &[f32; 3]| {
        if reach <= 1e-3 { 0.0 } else { ((1.0 - curve.apply(luminance(*p))) / reach).clamp(0.0, 1.0) }
    };
    let values = picture.pixels.par_iter().map(cover).collect();
    let coverage = Plane::from_values(picture.width(), picture.height(), values).unwrap_or_default();
    Tone { ink: ink.clone(), coverage }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::PAPER;
    use proptest::prelude::*;

    fn ink(color: [u8; 3]) -> Ink {
        Ink { name: "ink".into(), color: Rgb(color) }
    }

    fn tone(color: [u8; 3], coverage: f32) -> Tone {
        Tone { ink: ink(color), coverage: Plane::filled(2, 1, coverage) }
    }

    #[test]
    fn full_tones_have_their_inks_colour_and_none_the_papers() {
        let image = |coverage| separation_image(&tone([20, 90, 200], coverage), PAPER).unwrap();
        assert_eq!((image(1.0).pixel(1, 0), image(0.0).pixel(0, 0)), (Some(Rgb([20, 90, 200])), Some(PAPER)));
        let crossing = mixed(&[tone([255, 0, 255], 0.5), tone([0, 255, 255], 0.5)], Rgb([255; 3]));
        assert_eq!(crossing.pixels[0], [0.5, 0.5, 1.0]);
        let beside = side_by_side(&[tone([255, 0, 255], 0.5), tone([0, 255, 255], 0.5)], Rgb([255; 3]));
        assert_eq!(beside.pixels[0], [0.5, 0.5, 1.0]);
        assert_eq!(mixed(&[], PAPER), Picture::default());
    }

    proptest! {
        #[test]
        fn one_ink_gives_back_the_luminance(y in 0.05f32..=1.0) {
            let grey = Picture::from_pixels(1, 1, vec![[y; 3]]).unwrap();
            let tone = single(&grey, &ink([40, 40, 60]), Rgb([255; 3]), &ToneCurve::default());
            prop_assert!((mixed(&[tone], Rgb([255; 3])).luminance().values[0] - y).abs() < 1e-5);
        }
    }

    #[test]
    fn white_is_bare_and_black_is_full() {
        let ends = Picture::from_pixels(2, 1, vec![[1.0; 3], [0.0; 3]]).unwrap();
        for curve in
            [ToneCurve::default(), ToneCurve { black: 0.1, white: 0.9, gamma: 1.4 }, ToneCurve::auto(&ends, 0.005)]
        {
            assert_eq!(single(&ends, &ink([20, 20, 20]), PAPER, &curve).coverage.values, [0.0, 1.0]);
            assert_eq!(single(&ends, &ink([255; 3]), PAPER, &curve).coverage.values, [0.0, 0.0]);
        }
    }

    #[test]
    fn auto_levels_stretch_what_is_there() {
        let pixels = (0..1000).map(|i| [crate::math::linear_from_srgb(60 + (i / 10) as u8) as f32; 3]).collect();
        let flat = Picture::from_pixels(100, 10, pixels).unwrap();
        let curve = ToneCurve::auto(&flat, 0.005);
        assert!((curve.black - 60.0 / 255.0).abs() < 1e-3 && (curve.white - 159.0 / 255.0).abs() < 1e-3, "{curve:?}");
        let levelled = curve.picture(&flat);
        assert!(levelled.pixels[0][0] == 0.0 && levelled.pixels[999][1] > 0.999);
        for one in [0.0, 0.4, 1.0] {
            let plain = Picture::from_pixels(1, 1, vec![[one; 3]]).unwrap();
            assert_eq!(ToneCurve::auto(&plain, 0.01), ToneCurve::default());
        }
    }
}
