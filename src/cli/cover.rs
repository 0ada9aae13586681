//! `cover`: where a base stands.
use crate::cover;
use crate::report::OutputDir;
use crate::scenario::Scenario;

use super::Ending;
use super::args::{Args, Job};
use super::commands::{CommandError, out_folder, scenario_file};
use super::print::{self, Printer};
use super::progress::listener;

/// Places, cuts, drives, a plan from above.
pub(super) fn cover(args: &Args, job: &Job) -> Result<Ending, CommandError> {
    let file = scenario_file(&job.scenario)?;
    let scenario = Scenario::read(&file, &job.sets)?;
    let out = OutputDir::check(&out_folder(job, &file))?;
    let progress = listener(args.quiet, args.verbose);
    let covered = cover::cover(&scenario, &out, progress.as_ref())?;
    drop(progress);
    if !args.quiet {
        Printer::new().text(&covered.summary)?;
    }
    // the other figures are of stages that didn't run
    let asked = |path: &str| path.starts_with("coverage.");
    let unmet: Vec<_> = scenario.unmet(&covered.metrics).into_iter().filter(|u| asked(&u.path)).collect();
    for bound in &unmet {
        print::error(&bound.to_string());
    }
    Ok(if unmet.is_empty() { Ending::Done } else { Ending::Unmet })
}
