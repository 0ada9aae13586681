//! Stipples a picture and says how long it took and how like the picture the dots are.
//!
//!     cargo run --release --example stipple -- PICTURE [DOTS]
//!
//! Dots are points of equal ink that stand for the darkness of the picture's levels. They and the picture are blurred by
//! so many pixels before they are compared. The seconds are those of stippling alone.
use std::error::Error;
use std::path::Path;
use std::time::Instant;

use calamus::art::{DotCount, StippleOptions, stipple};
use calamus::math::srgb_from_linear;
use calamus::picture::{Plane, ReadOptions, psnr, read, ssim};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("usage: stipple PICTURE [DOTS]")?;
    let dots: usize = arguments.next().map_or(Ok(80_000), |n| n.parse())?;
    let light = read(Path::new(&file), &ReadOptions::default())?.content.luminance();
    let (w, h) = (light.width(), light.height());
    let dark = |column, row| 1.0 - f32::from(srgb_from_linear(f64::from(light.at(column, row)))) / 255.0;
    let density = Plane::from_fn(w, h, dark);
    let start = Instant::now();
    let dots = stipple(&density, &StippleOptions::new(DotCount::Points(dots)), 1);
    println!("{w} x {h} px, {} dots, {:.2} s", dots.len(), start.elapsed().as_secs_f64());
    let ink = density.values.iter().map(|v| f64::from(*v)).sum::<f64>() / dots.len().max(1) as f64;
    let mut drawn = Plane::filled(w, h, 0.0);
    for dot in &dots {
        drawn.values[(dot.y as usize).min(h - 1) * w + (dot.x as usize).min(w - 1)] += ink as f32;
    }
    for sigma in [4.0, 8.0, 16.0] {
        let (a, b) = (drawn.blurred(sigma), density.blurred(sigma));
        if let Some((psnr, ssim)) = psnr(&a, &b).zip(ssim(&a, &b)) {
            println!("blurred by {sigma} px: PSNR {psnr:.1} dB, SSIM {ssim:.4}");
        }
    }
    Ok(())
}
