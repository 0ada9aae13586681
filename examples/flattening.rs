//! Flattens patches of bumpy columns by both methods, and says how long each takes and how it distorts.
//!
//!     cargo run --release --example flattening -- [TRIANGLE_MM] [AMPLITUDE_MM ...]
//!
//! The patch is 0.5 m a side on a column of 0.56 m; triangles of 1.456 mm give it 172,000 vertices. Area errors are
//! over the whole patch, angle errors over all of it and over the drawing of 0.3 m. Seconds are for flattening and laying the chart, without cutting the patch out of the column.
use std::error::Error;
use std::time::Instant;

use calamus::math::{Pose, frame_from_axes};
use calamus::mesh::shapes::{self, Bumps};
use calamus::mesh::{Chart, Distortion, Extent, Flattening, Patch};
use nalgebra::{Point2, Translation3, Vector3};

/// Half sides of the drawing, m.
const HALF: [f64; 2] = [0.15, 0.15];

fn main() -> Result<(), Box<dyn Error>> {
    let mut numbers = Vec::new();
    for argument in std::env::args().skip(1) {
        numbers.push(argument.parse::<f64>().map_err(|_| format!("{argument} is not a number"))? * 1e-3);
    }
    let (triangle, amplitudes) = numbers.split_first().map_or((1.456e-3, Vec::new()), |(t, a)| (*t, a.to_vec()));
    let amplitudes = if amplitudes.is_empty() { vec![0.006, 0.010, 0.017, 0.019] } else { amplitudes };
    println!(
        "bumps mm  vertices  method              s  quasi-conformal mean, max, drawing's max  log-area rms  turned over"
    );
    for amplitude in amplitudes {
        let bumps = Bumps { amplitude, wavelength: 0.14 };
        let mesh = shapes::column(0.28, 0.8, &bumps, triangle)?;
        let turn = frame_from_axes(&-Vector3::x(), &-Vector3::y());
        let sheet = Pose::from_parts(Translation3::new(-0.33, 0.0, 0.4), turn);
        let patch = Patch::cut(&mesh, &sheet, Extent::Prism([0.25, 0.25]), 0.01)?;
        let mut rms = Vec::new();
        for (name, method) in
            [("least squares", Flattening::LeastSquares), ("boundary first", Flattening::BoundaryFirst)]
        {
            let (patch, vertices) = (patch.clone(), patch.vertices.len());
            let start = Instant::now();
            let chart = Chart::new(patch, method, &Point2::origin(), HALF, &Vector3::z(), 0.01)?;
            let seconds = start.elapsed().as_secs_f64();
            let d = Distortion::of(&chart.stretches()).ok_or("a chart without area")?;
            let drawing = Distortion::of_chart(&chart, &Point2::origin(), HALF).ok_or("a drawing without area")?;
            println!(
                "{:8.1}  {vertices:8}  {name:14} {seconds:6.2}  {:.4} {:.4} {:.4}                       {:.4}        {}",
                amplitude * 1e3,
                d.quasi_conformal_mean,
                d.quasi_conformal_max,
                drawing.quasi_conformal_max,
                d.log_area_rms,
                d.flips
            );
            rms.push(d.log_area_rms);
        }
        println!("          log-area rms of boundary first by that of least squares: {:.2}", rms[1] / rms[0]);
    }
    Ok(())
}
