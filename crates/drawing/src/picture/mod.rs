//! Pictures as pixels: what artwork is made from.
//!
//! A [`Picture`] holds linear light, a [`Plane`] one number a pixel, an [`Image`] 8-bit sRGB for files. A file is [`read`] into
//! a picture, which becomes either tones of inks that cross ([`cmyk`], [`single`]), tones of pens side by side ([`pens`]), or
//! flat areas of a [`Palette`]. [`likeness`] tells how near a drawing has come to it.

mod cluster;
mod cmyk;
mod color;
mod color_name;
mod cube;
mod error;
mod image;
mod ink;
pub mod lettering;
mod light;
mod majority;
mod palette;
mod pens;
mod plane;
mod quality;
mod read;
mod resample;
mod separate;
mod value;

pub use cmyk::{CmykOptions, cmyk};
pub use color::{
    Oklab, ciede2000, cielab_from_linear, linear_from_oklab, linear_from_rgb, oklab_difference2, oklab_from_linear,
    oklab_from_rgb,
};
pub use error::PictureError;
pub use image::{Image, MAX_SIDE};
pub use ink::{Flat, Ink, Tone};
pub use light::Picture;
pub use majority::majority;
pub use palette::{PALETTE_MAX, Palette, PaletteMethod, PaperRule};
pub use pens::{Dither, pens};
pub use plane::Plane;
pub use quality::{Likeness, PSNR_MAX_DB, likeness, psnr, ssim};
pub use read::{Labels, Noted, ReadOptions, is_picture, read, read_depth, read_labels};
pub use separate::{ToneCurve, mixed, separation_image, side_by_side, single};
