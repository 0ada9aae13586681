//! What colours the samples of a file mean: sRGB, a power law, or a colour profile.
use std::sync::Arc;

use moxcms::{
    Chromaticity, CicpColorPrimaries, CicpProfile, ColorPrimaries, ColorProfile, DataColorSpace, Layout, LutStore,
    LutType, LutWarehouse, MatrixCoefficients, ToneReprCurve, TransferCharacteristics, TransformF64Executor,
    TransformOptions, XyY,
};

use super::fault::sentence;
use super::raster::{Depth, Model, Raster};
use crate::math::{light_of_srgb, linear_from_srgb};

/// A profile within this of sRGB, in shares of full scale of its encoded values, is sRGB: a quarter of an 8-bit step.
const SAME: f64 = 0.001;

/// What the samples of a file mean.
#[derive(Clone, Default)]
pub(super) enum Space {
    /// sRGB (IEC 61966-2-1), which is also meant where a file says nothing.
    #[default]
    Srgb,
    /// Light is the sample to this power; primaries of sRGB.
    Power(f64),
    /// As a profile says.
    Profile(Box<ColorProfile>),
}

impl Space {
    /// That of an embedded ICC profile. One that can't be read is passed over with a note, as every viewer does.
    pub(super) fn of_icc(icc: Option<&[u8]>, notes: &mut Vec<String>) -> Self {
        let Some(icc) = icc else { return Self::Srgb };
        match ColorProfile::new_from_slice(icc) {
            Ok(mut profile) => {
                widen(&mut profile);
                Self::Profile(Box::new(profile))
            }
            Err(e) => Self::unread(e, notes),
        }
    }

    /// sRGB for a profile that can't be read, with a note.
    pub(super) fn unread(why: impl std::fmt::Display, notes: &mut Vec<String>) -> Self {
        notes.push(format!("its colour profile can't be read ({}): passed over", sentence(&why.to_string())));
        Self::Srgb
    }

    /// That of white and primaries in CIE xy (white, red, green, blue) and the power law of the light, if one is stated.
    pub(super) fn of_primaries(xy: [[f32; 2]; 4], power: Option<f64>) -> Self {
        let [white, red, green, blue] = xy.map(|[x, y]| Chromaticity { x, y });
        let mut profile = ColorProfile::new_srgb();
        let white = XyY { x: f64::from(white.x), y: f64::from(white.y), yb: 1.0 };
        profile.update_rgb_colorimetry(white, ColorPrimaries { red, green, blue });
        if let Some(power) = power {
            let curve = ToneReprCurve::Parametric(vec![power as f32]);
            profile.red_trc = Some(curve.clone());
            profile.green_trc = Some(curve.clone());
            profile.blue_trc = Some(curve);
        }
        Self::Profile(Box::new(profile))
    }

    /// That of code points (ITU-T H.273); `None` for brightness beyond white and for code points without a meaning.
    pub(super) fn of_code_points(primaries: u8, transfer: u8) -> Option<Self> {
        let color_primaries = CicpColorPrimaries::try_from(primaries).ok()?;
        let transfer_characteristics = TransferCharacteristics::try_from(transfer).ok()?;
        if matches!(transfer_characteristics, TransferCharacteristics::Smpte2084 | TransferCharacteristics::Hlg) {
            return None;
        }
        let cicp = CicpProfile {
            color_primaries,
            transfer_characteristics,
            matrix_coefficients: MatrixCoefficients::Identity,
            full_range: true,
        };
        let profile = ColorProfile::new_from_cicp(cicp);
        profile.red_trc.is_some().then(|| Self::Profile(Box::new(profile)))
    }
}

/// Makes tables of 16 bits of those of 8 (`mft1`), as which `moxcms` 0.8 takes their Lab: 255 is 100 there, but 65280 in 16 bits.
fn widen(profile: &mut ColorProfile) {
    if profile.pcs != DataColorSpace::Lab {
        return;
    }
    let tables =
        [&mut profile.lut_a_to_b_perceptual, &mut profile.lut_a_to_b_colorimetric, &mut profile.lut_a_to_b_saturation];
    for table in tables.into_iter().flatten() {
        let LutWarehouse::Lut(lut) = table else { continue };
        let (LutStore::Store8(first), LutStore::Store8(grid), LutStore::Store8(last)) =
            (&lut.input_table, &lut.clut_table, &lut.output_table)
        else {
            continue;
        };
        let times = |values: &[u8], by: u16| LutStore::Store16(values.iter().map(|v| u16::from(*v) * by).collect());
        let wide = (times(first, 257), times(grid, 257), times(last, 256));
        (lut.input_table, lut.clut_table, lut.output_table) = wide;
        lut.lut_type = LutType::Lut16;
    }
}

/// Turns rows of samples into linear light.
pub(super) struct Light {
    way: Way,
    line: Vec<f64>,
    seen: Vec<f64>,
}

enum Way {
    /// The light of each sample value.
    Table(Vec<f32>),
    /// Floats to this power.
    Power(f32),
    /// By a profile to sRGB; the light of 65536 sRGB values; samples that the profile wants of a pixel.
    Profile { transform: Arc<TransformF64Executor>, light: Vec<f32>, samples: usize },
}

impl Light {
    /// The way from `raster`'s samples to light, and the raster that it takes: four inks without a usable profile become RGB.
    pub(super) fn of(mut raster: Raster) -> (Self, Raster) {
        let way = match std::mem::take(&mut raster.space) {
            Space::Profile(profile) => match transform(&profile, &raster) {
                Ok(Some(way)) => Some(way),
                Ok(None) => None,
                Err(why) => {
                    let assumed =
                        if raster.model == Model::Cmyk { "no press's inks are known" } else { "sRGB is assumed" };
                    raster.notes.push(format!("its colour profile isn't used ({}): {assumed}", sentence(&why)));
                    None
                }
            },
            Space::Power(power) => Some(match raster.depth {
                Depth::Float => Way::Power(power as f32),
                depth => Way::Table(table(depth, |v| v.powf(power))),
            }),
            Space::Srgb => None,
        };
        match way {
            Some(way) => (Self::new(way), raster),
            None => {
                let raster = raster.without_inks();
                let way = match raster.depth {
                    // Floats are linear light, but where a profile says otherwise.
                    Depth::Float => Way::Power(1.0),
                    Depth::Eight => Way::Table((0..=255).map(|v| linear_from_srgb(v) as f32).collect()),
                    Depth::Sixteen => Way::Table(table(Depth::Sixteen, light_of_srgb)),
                };
                (Self::new(way), raster)
            }
        }
    }

    fn new(way: Way) -> Self {
        Self { way, line: Vec::new(), seen: Vec::new() }
    }

    /// Linear light of a row of `raster`, over white where it is transparent.
    pub(super) fn row(&mut self, raster: &Raster, row: &[u8], line: &mut [[f32; 3]]) {
        let (samples, colors) = (raster.samples(), raster.model.samples());
        match &self.way {
            Way::Table(light) => {
                for (x, pixel) in line.iter_mut().enumerate() {
                    let at = |k: usize| light[raster.step(row, samples * x + k)];
                    *pixel = if colors == 1 { [at(0); 3] } else { [at(0), at(1), at(2)] };
                }
            }
            Way::Power(power) => {
                for (x, pixel) in line.iter_mut().enumerate() {
                    let at = |k: usize| raster.value(row, samples * x + k).min(1.0).powf(*power);
                    *pixel = if colors == 1 { [at(0); 3] } else { [at(0), at(1), at(2)] };
                }
            }
            Way::Profile { transform, light, samples: wanted } => {
                self.line.clear();
                for x in 0..line.len() {
                    let value = |k: usize| f64::from(raster.value(row, samples * x + k.min(colors - 1)).min(1.0));
                    self.line.extend((0..*wanted).map(value));
                }
                self.seen.clear();
                self.seen.resize(3 * line.len(), 0.0);
                // It only fails for lines of other lengths.
                let _ = transform.transform(&self.line, &mut self.seen);
                for (pixel, seen) in line.iter_mut().zip(self.seen.chunks_exact(3)) {
                    let at = |k: usize| light[(seen[k].clamp(0.0, 1.0) * 65_535.0).round() as usize];
                    *pixel = [at(0), at(1), at(2)];
                }
            }
        }
        if raster.alpha {
            for (x, pixel) in line.iter_mut().enumerate() {
                let alpha = raster.value(row, samples * x + colors).min(1.0);
                *pixel = pixel.map(|v| v * alpha + (1.0 - alpha));
            }
        }
    }
}

/// The light of each value of whole numbers.
fn table(depth: Depth, light: impl Fn(f64) -> f64) -> Vec<f32> {
    let last = depth.last() as u32;
    (0..=last).map(|i| light(f64::from(i) / f64::from(last)) as f32).collect()
}

/// The way through a profile; none where the profile is sRGB, so that pictures with and without it are drawn alike.
fn transform(profile: &ColorProfile, raster: &Raster) -> Result<Option<Way>, String> {
    let (layout, samples) = match (profile.color_space, raster.model) {
        (DataColorSpace::Gray, Model::Grey) => (Layout::Gray, 1),
        // Grey with a profile of colours is R = G = B.
        (DataColorSpace::Rgb, Model::Grey | Model::Rgb) => (Layout::Rgb, 3),
        (DataColorSpace::Cmyk, Model::Cmyk) => (Layout::Rgba, 4),
        (space, model) => return Err(format!("it is for {space:?}, but the picture is in {model:?}")),
    };
    // Perceptual, as littlecms and browsers; the doubles' path, for it runs the same on every processor where no table of colours is in the profile.
    let options = TransformOptions { prefer_fixed_point: false, ..Default::default() };
    let made = profile.create_transform_f64(layout, &ColorProfile::new_srgb(), Layout::Rgb, options);
    let transform = made.map_err(|e| e.to_string())?;
    if samples < 4 && raster.depth != Depth::Float && is_srgb(&transform, samples) {
        return Ok(None);
    }
    Ok(Some(Way::Profile { transform, light: table(Depth::Sixteen, light_of_srgb), samples }))
}

/// Whether greys and full colours come out as they went in.
fn is_srgb(transform: &Arc<TransformF64Executor>, samples: usize) -> bool {
    let steps = (0..=64).map(|i| f64::from(i) / 64.0);
    let colors: Vec<[f64; 3]> = if samples == 1 {
        steps.map(|v| [v; 3]).collect()
    } else {
        steps.flat_map(|v| [[v; 3], [v, 0.0, 0.0], [0.0, v, 0.0], [0.0, 0.0, v], [1.0, v, 0.0]]).collect()
    };
    let from: Vec<f64> = colors.iter().flat_map(|c| c[..samples].to_vec()).collect();
    let mut to = vec![0.0; 3 * colors.len()];
    transform.transform(&from, &mut to).is_ok() && colors.iter().flatten().zip(&to).all(|(a, b)| (a - b).abs() < SAME)
}
