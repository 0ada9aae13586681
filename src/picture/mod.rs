//! Pictures as pixels: what artwork is made from.
//!
//! A [`Picture`] holds linear light, a [`Plane`] one number a pixel, an [`Image`] 8-bit sRGB for files.

mod error;
mod image;
mod ink;
mod light;
mod plane;
mod quality;
mod read;
mod resample;
mod value;

pub use error::PictureError;
pub use image::{Image, MAX_SIDE};
pub use ink::{Flat, Ink, Tone};
pub use light::Picture;
pub use plane::Plane;
pub use quality::{Likeness, PSNR_MAX_DB, likeness, psnr, ssim};
pub use read::{Labels, ReadOptions, read, read_depth, read_labels};
