//! Solves a travelling-salesman problem in a TSPLIB file (`EUC_2D`) and says how long the tour is.
//!
//!     cargo run --release --example tour -- FILE.tsp [--seconds S | --kicks K] [--out FILE.tour]
//!
//! The length is TSPLIB's: each edge rounded to the nearest whole number. The seconds are those of the whole run, from
//! reading the file on.
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use calamus::tour::{Effort, TourOptions, rounded_length, solve, tsplib};

fn main() -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let (mut file, mut out, mut effort) = (None, None, Effort::Time(Duration::from_secs(10)));
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--seconds" => effort = Effort::Time(Duration::try_from_secs_f64(value()?.parse()?)?),
            "--kicks" => effort = Effort::Kicks(value()?.parse()?),
            "--out" => out = Some(PathBuf::from(value()?)),
            _ => file = Some(argument),
        }
    }
    let file = file.ok_or("usage: tour FILE.tsp [--seconds S | --kicks K] [--out FILE.tour]")?;
    let problem = tsplib::read(Path::new(&file))?;
    if let Effort::Time(time) = &mut effort {
        *time = time.saturating_sub(start.elapsed());
    }
    let options = TourOptions { effort, rounded: true, ..TourOptions::default() };
    let tour = solve(&problem.points, &options)?;
    let seconds = start.elapsed().as_secs_f64();
    let length = rounded_length(&problem.points, &tour, true);
    println!("{}: {} points, length {length} (TSPLIB EUC_2D), {seconds:.2} s", problem.name, problem.points.len());
    if let Some(out) = out {
        let mut text = format!("NAME : {}\nTYPE : TOUR\nDIMENSION : {}\nTOUR_SECTION\n", problem.name, tour.len());
        text.extend(tour.iter().map(|i| format!("{}\n", i + 1)));
        text.push_str("-1\nEOF\n");
        std::fs::write(out, text)?;
    }
    Ok(())
}
