//! `reach`: where a robot can draw.
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::reach::{self, ReachRequest};
use crate::report::OutputDir;
use crate::scenario::{AssetKind, Sketch};

use super::Ending;
use super::args::{Args, ReachJob};
use super::commands::{CommandError, asset_file};
use super::print::Printer;
use super::progress::listener;

/// Maps, picture, canvas.
pub(super) fn reach(args: &Args, job: &ReachJob) -> Result<Ending, CommandError> {
    let robot = asset_file(AssetKind::Robot, &job.robot)?;
    let name = robot.file_stem().unwrap_or(OsStr::new("robot"));
    let default = || Path::new("out").join("reach").join(name);
    let out = OutputDir::check(&job.out.clone().unwrap_or_else(default))?;
    let sketch = |file: &PathBuf| Sketch::of_file(file, &job.sets).map(|s| (file.clone(), s));
    let request = ReachRequest {
        arms: job.arms.clone(),
        axis: job.axis,
        spacing: job.spacing_mm * 1e-3,
        depths: job.depth_mm.map(|d| d.map(|mm| mm * 1e-3)),
        aspect: job.aspect.unwrap_or(1.0),
        drawing: job.drawing.as_ref().map(sketch).transpose()?,
        cache: job.cache.clone(),
        robot,
    };
    let progress = listener(args.quiet, args.verbose);
    let reached = reach::reach(&request, &out, progress.as_ref())?;
    drop(progress);
    if !args.quiet {
        Printer::new().text(&reached.summary)?;
    }
    Ok(Ending::Done)
}

/// `X,Y,Z`.
pub(super) fn axis(text: &str) -> Result<[f64; 3], String> {
    numbers(text, ',').ok_or_else(|| "should be three numbers, as 1,0,0".into())
}

/// `NEAR:FAR`.
pub(super) fn range(text: &str) -> Result<[f64; 2], String> {
    numbers(text, ':').ok_or_else(|| "should be two numbers, as 400:800".into())
}

/// `WIDTH:HEIGHT`, as a ratio.
pub(super) fn ratio(text: &str) -> Result<f64, String> {
    let wrong = || "should be two positive numbers, as 3:2".to_string();
    let [width, height] = numbers(text, ':').ok_or_else(wrong)?;
    if width > 0.0 && height > 0.0 { Ok(width / height) } else { Err(wrong()) }
}

fn numbers<const N: usize>(text: &str, between: char) -> Option<[f64; N]> {
    let parts: Vec<f64> =
        text.split(between).map(|p| p.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect::<Option<_>>()?;
    parts.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_or_explained() {
        assert_eq!(axis("0, 0,-1"), Ok([0.0, 0.0, -1.0]));
        assert_eq!(range("400:800"), Ok([0.4e3, 0.8e3]));
        assert_eq!(ratio("3:2"), Ok(1.5));
        assert!(axis("1,0").is_err() && axis("1,0,inf").is_err() && range("400").is_err() && ratio("0:1").is_err());
    }
}
