//! What can be typed.
use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};

use crate::artwork::Part;
use crate::experiment::Shard;
use crate::scenario::Override;

/// Draws pictures with a simulated robot arm and a pen that leaves ink where it really touches.
#[derive(Debug, Parser)]
#[command(name = "calamus", version, arg_required_else_help = true)]
pub(super) struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Say nothing but errors.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Tell more: where things were found and how long each stage took.
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// Threads to compute with; all cores when absent. Results don't depend on it.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Run a scenario from start to end: plan, simulate, picture, measure, report.
    Run {
        #[command(flatten)]
        job: Job,
        /// Draw what can be reached when not everything can, and be content with what comes of it.
        #[arg(long)]
        partial: bool,
        /// Draw a part alone: inks=RED,BLUE, strokes=10-20, or rect=LEFT,BOTTOM,RIGHT,TOP in mm from the sheet's middle.
        #[arg(long, value_name = "PART", allow_hyphen_values = true)]
        only: Option<Part>,
        /// Go on where this run was killed or interrupted.
        #[arg(long)]
        resume: bool,
        /// Least time between two states that are kept, ms; for tests.
        #[arg(long, hide = true, value_name = "MS")]
        keep_every_ms: Option<u64>,
    },
    /// Read a scenario's drawing, or a drawing file, and write the lines that the pen will be asked for.
    Draw(Job),
    /// Lay a scenario's drawing on its canvas and say how it is distorted.
    Map(Job),
    /// Find where a mobile base has to stand to draw a scenario's drawing on a wall: places, cuts, drives, a plan from above.
    Cover(Job),
    /// Plan a scenario's motion and say what can't be reached.
    Plan {
        #[command(flatten)]
        job: Job,
        /// Plan what can be reached when not everything can.
        #[arg(long)]
        partial: bool,
    },
    /// Check a scenario and print it with everything filled in.
    Check {
        /// A scenario: a file, or the name of one in scenarios/.
        #[arg(required_unless_present = "schema")]
        scenario: Option<PathBuf>,
        /// Change a value of the scenario.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        sets: Vec<Override>,
        /// Print the JSON schema of scenario files instead.
        #[arg(long)]
        schema: bool,
    },
    /// Run an experiment: many trials of a scenario, summed up with intervals, tables and plots.
    Experiment {
        /// An experiment: a file, or the name of one in scenarios/experiments/.
        experiment: PathBuf,
        /// Folder for the results; out/experiments/NAME when absent.
        #[arg(short, long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Trials of each case at each point of the grid, in place of the file's number.
        #[arg(long, value_name = "N")]
        trials: Option<u64>,
        /// Do a share of the trials, as 3/10; `calamus merge` puts the shares together.
        #[arg(long, value_name = "I/N", default_value = "1/1", hide_default_value = true)]
        shard: Shard,
        /// Go on where an earlier run was stopped.
        #[arg(long)]
        resume: bool,
        /// Do this trial alone and print its row; with --out, also write everything that `run` writes.
        #[arg(long, value_name = "K", conflicts_with_all = ["shard", "resume"])]
        trial: Option<u64>,
    },
    /// Put the shares of an experiment together and sum them up.
    Merge {
        /// Folders that `calamus experiment --shard` wrote.
        #[arg(required = true, value_name = "DIR")]
        folders: Vec<PathBuf>,
        /// Folder for the results.
        #[arg(short, long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Find where a robot can draw and the largest canvas there: maps, a picture, the canvas as a scene.
    Reach(ReachJob),
    /// List what there is to use.
    List {
        /// What to list.
        kind: Listed,
    },
}

/// A scenario, changes to it, and where the files go.
#[derive(Debug, clap::Args)]
pub(super) struct Job {
    /// A scenario: a file, or the name of one in scenarios/.
    pub scenario: PathBuf,
    /// Folder for the files; out/NAME of the scenario when absent.
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Change a value of the scenario, as control.speed_mm_s=30. May be given many times. A path is looked up in the scenario's folder, then here.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<Override>,
}

/// A robot, and what is asked about its reach.
#[derive(Debug, clap::Args)]
pub(super) struct ReachJob {
    /// A robot: a file, or the name of one in robots/.
    pub robot: PathBuf,
    /// Folder for the files; out/reach/NAME of the robot when absent.
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// An arm that is to draw, by name; many times for a canvas that they share. All arms when absent.
    #[arg(long = "arm", value_name = "NAME")]
    pub arms: Vec<String>,
    /// Where the pen points, in the world; the axis nearest to the first arm's pen at home when absent.
    #[arg(long, value_name = "X,Y,Z", value_parser = super::reach::axis, allow_hyphen_values = true)]
    pub axis: Option<[f64; 3]>,
    /// Distance between the points of the map.
    #[arg(long, value_name = "MM", default_value_t = 50.0, allow_hyphen_values = true)]
    pub spacing_mm: f64,
    /// Desired depths of the canvas, from the first arm's base along the pen; any when absent.
    #[arg(long, value_name = "NEAR:FAR", value_parser = super::reach::range, allow_hyphen_values = true)]
    pub depth_mm: Option<[f64; 2]>,
    /// Shape of the canvas; a square when absent.
    #[arg(long, value_name = "WIDTH:HEIGHT", value_parser = super::reach::ratio, conflicts_with = "drawing")]
    pub aspect: Option<f64>,
    /// A drawing file that gives the canvas its shape and is put on it; a scenario that draws it is written too.
    #[arg(long, value_name = "FILE")]
    pub drawing: Option<PathBuf>,
    /// Change how the drawing is read, as drawing.fill=hatch.
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "drawing")]
    pub sets: Vec<Override>,
    /// Folder in which maps are kept; cache in the folder for the files when absent.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Listed {
    /// Robots.
    Robots,
    /// Canvases and what stands around them.
    Scenes,
    /// Scenarios.
    Scenarios,
    /// Experiments.
    Experiments,
    /// Pens.
    Pens,
}
