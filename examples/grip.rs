//! Pulls for a minute at a pen that is held by contact and friction, and says how far it slips in the hand.
//!
//!     cargo run --release --example grip -- [LATERAL_N AXIAL_N [SECONDS [GRIP_N]]]
use std::error::Error;

use calamus::tool::ToolSet;
use calamus::twin::grasp::{DockError, TrialSetup};
use nalgebra::{Point3, Vector3};

/// Until the grip has taken up the load, s.
const TAKEN_UP: u32 = 500;

fn main() -> Result<(), Box<dyn Error>> {
    let mut numbers = Vec::new();
    for argument in std::env::args().skip(1) {
        numbers.push(argument.parse::<f64>().map_err(|_| format!("{argument} is not a number"))?);
    }
    let given = |i: usize, default: f64| numbers.get(i).copied().unwrap_or(default);
    let (lateral, axial, seconds) = (given(0, 5.0), given(1, 5.0), given(2, 60.0));
    let mut setup = TrialSetup::gantry(ToolSet::pen_tool()?);
    setup.options.grip[1] = given(3, setup.options.grip[1]);
    let ways = [
        ("thumb to fingers", Vector3::y()),
        ("fingers to thumb", -Vector3::y()),
        ("out of the palm", Vector3::x()),
        ("into the palm", -Vector3::x()),
    ];
    for (name, way) in ways {
        let mut picked = setup.pick(&DockError::default())?;
        if !picked.change.succeeded() {
            return Err("the pen wasn't fetched".into());
        }
        // the canvas pushes the pen up and drags it aside
        picked.world.pull(way * lateral + Vector3::z() * axial);
        picked.hold(TAKEN_UP)?;
        let held: Point3<f64> = picked.world.pen_tip();
        let (mut slip, mut most) = (0.0, 0.0f64);
        for _ in 0..(seconds * 20.0) as u32 {
            picked.hold(50)?;
            slip = (picked.world.pen_tip() - held).norm() * 1e3;
            most = most.max(slip);
        }
        println!(
            "{lateral} N {name} and {axial} N up for {seconds} s: the tip ends {slip:.4} mm off, and is never more than {most:.4} mm off"
        );
    }
    Ok(())
}
