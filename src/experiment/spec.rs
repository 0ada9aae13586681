//! The experiment as it is meant: every key checked, every trial known by its index.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng as _;
use serde_json::{Map, Value};

use crate::diagnostic::{self, ConfigError};
use crate::files;
use crate::inputs::{BUILD, Inputs};
use crate::math::{Digest, stream};
use crate::scenario::{AssetKind, Assets, Override, Scenario, ScenarioError, check_ranges};

use super::ExperimentError;
use super::accept::Accept;
use super::axis::Axis;
use super::file::{ExperimentFile, PlotKind, Stage};
use super::place::{Section, wrong};
use super::quantity::{Quantity, Rate, SUCCESS};
use super::value::{self, Template};

/// Most trials of an experiment.
const MOST_TRIALS: u64 = 1_000_000;

/// A change of the scenario: where it stands in the file, its dotted key, its value.
#[derive(Clone, Debug)]
struct Change {
    section: Section,
    key: String,
    value: Template,
}

/// A named group of changes.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name; empty for the only case of an experiment without cases.
    pub name: String,
    changes: Vec<Change>,
}

/// A plot to make.
#[derive(Clone, Debug)]
pub struct PlotSpec {
    /// What it shows.
    pub kind: PlotKind,
    /// Of which figure.
    pub quantity: Quantity,
    /// Index of the axis across, of curves and heatmaps.
    pub axis: usize,
    /// Index of the axis upwards, of heatmaps.
    pub axis_y: usize,
    /// A curve's axis is logarithmic.
    pub log: bool,
    /// Bars of a histogram.
    pub bins: u32,
    /// Title.
    pub title: String,
}

/// Which trials are the worst.
#[derive(Clone, Debug)]
pub struct Worst {
    /// By which figure.
    pub quantity: Quantity,
    /// How many.
    pub n: usize,
    /// The smallest are the worst.
    pub lowest: bool,
    /// Rates of which one trial each is shown.
    pub each: Vec<Rate>,
}

/// Cases, times the points of a grid, times trials of each.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// Name.
    pub name: String,
    /// What it is to find out.
    pub description: String,
    /// Seed of everything random in it.
    pub seed: u64,
    /// How far each trial goes.
    pub until: Stage,
    /// Trials of each case at each point of the grid.
    pub trials: u64,
    /// Axes of the grid, by key; the last varies fastest.
    pub axes: Vec<Axis>,
    /// Cases, in the file's order; there is at least one.
    pub cases: Vec<Case>,
    /// Rates: `success`, and those of the file.
    pub rates: Vec<Rate>,
    /// Bounds.
    pub accept: Vec<Accept>,
    /// Plots.
    pub plots: Vec<PlotSpec>,
    /// Trials to show with pictures.
    pub worst: Option<Worst>,
    /// Digest of everything that trials depend on.
    pub hash: String,
    /// The experiment's file; absolute.
    pub file: PathBuf,
    text: String,
    base: PathBuf,
    base_text: String,
    changes: Vec<Change>,
}

/// One trial: what is changed in the scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Index in the experiment, from 0: by case, then by point of the grid, then by repeat.
    pub index: u64,
    /// Index of the case.
    pub case: usize,
    /// Index of the point of the grid.
    pub cell: u64,
    /// Which of the trials of its case and cell it is.
    pub repeat: u64,
    /// The scenario's seed: the same in every case.
    pub seed: u64,
    /// Values on the axes, by key.
    pub axes: BTreeMap<String, Value>,
    /// Values drawn, by key.
    pub draws: BTreeMap<String, Value>,
    changes: Vec<(Section, String, Value)>,
}

impl Experiment {
    /// Reads an experiment file and checks all of it, down to the scenario of every trial. `trials` takes the place of the
    /// file's number.
    pub fn read(file: &Path, trials: Option<u64>) -> Result<Self, ExperimentError> {
        let text = read_text(file)?;
        Self::parse(&text, file, trials)
    }

    /// [`Experiment::read`] on text; `file` is named in errors, and its folder is where paths start.
    pub fn parse(text: &str, file: &Path, trials: Option<u64>) -> Result<Self, ExperimentError> {
        let typed: ExperimentFile = diagnostic::parse(text, file)?;
        check_ranges(&ExperimentFile::schema(), text, file)?;
        let bad = |section, key: &str, message: String| wrong(text, file, section, key, message);
        let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let base = Assets::seen_from(folder)
            .find(AssetKind::Scenario, &typed.scenario, folder)
            .map_err(|e| bad(Section::Top, "scenario", e))?;
        let stem = || file.file_stem().map_or_else(|| "experiment".into(), |s| s.to_string_lossy().into_owned());

        let changes = changes(&typed.set, Section::Set, &bad)?;
        let (axes, drawn) = varied(&typed.vary, &bad)?;
        let mut cases = Vec::new();
        for (i, case) in typed.cases.iter().enumerate() {
            if case.name.is_empty() || typed.cases[..i].iter().any(|c| c.name == case.name) {
                let message = format!("each case needs a name of its own, not `{}`", case.name);
                return Err(bad(Section::Case(i), "name", message).into());
            }
            cases.push(Case { name: case.name.clone(), changes: self::changes(&case.set, Section::Case(i), &bad)? });
        }
        if cases.is_empty() {
            cases.push(Case { name: String::new(), changes: Vec::new() });
        }
        let varied_keys: Vec<&str> =
            axes.iter().map(|a| a.key.as_str()).chain(drawn.iter().map(|c| c.key.as_str())).collect();
        for change in changes.iter().chain(cases.iter().flat_map(|c| &c.changes)) {
            if varied_keys.contains(&change.key.as_str()) {
                let message = format!("`{}` is set here and varied in [vary]", change.key);
                return Err(bad(change.section, &change.key, message).into());
            }
        }

        let mut rates = vec![Rate::success()];
        for (name, words) in &typed.rate {
            if name == SUCCESS {
                return Err(
                    bad(Section::Rate, name, format!("`{SUCCESS}` is the share of trials that could be done")).into()
                );
            }
            rates.push(Rate::parse(name, words).map_err(|e| bad(Section::Rate, name, e))?);
        }
        let accept = Accept::parse_all(&typed.accept, &rates, &cases, &axes)
            .map_err(|(key, message)| bad(Section::Accept, &key, message))?;
        let plots = plots(&typed, &rates, &axes, &bad)?;
        let worst = match &typed.worst {
            None => None,
            Some(w) => {
                let quantity = Quantity::parse(&w.metric, &rates).map_err(|e| bad(Section::Worst, "metric", e))?;
                let known = |name: &String| {
                    let wrong = || bad(Section::Worst, "each", format!("no rate `{name}` in `[rate]`"));
                    rates.iter().find(|r| r.name == *name).cloned().ok_or_else(wrong)
                };
                let each = w.each.iter().map(known).collect::<Result<_, _>>()?;
                Some(Worst { quantity, n: w.n as usize, lowest: w.lowest, each })
            }
        };

        let trials = trials.unwrap_or(typed.trials);
        let mut experiment = Self {
            name: typed.name.unwrap_or_else(stem),
            description: typed.description,
            seed: typed.seed,
            until: typed.until,
            trials,
            axes,
            cases,
            rates,
            accept,
            plots,
            worst,
            hash: String::new(),
            file: std::path::absolute(file).unwrap_or_else(|_| file.to_path_buf()),
            text: text.to_string(),
            base_text: read_text(&base)?,
            base,
            changes: changes.into_iter().chain(drawn).collect(),
        };
        let cells = experiment.axes.iter().try_fold(1_u64, |n, a| n.checked_mul(a.values.len() as u64));
        let total = cells.and_then(|n| n.checked_mul(trials)?.checked_mul(experiment.cases.len() as u64));
        if !total.is_some_and(|n| (1..=MOST_TRIALS).contains(&n)) {
            let message = format!("trials, cases and points of the grid should make 1 to {MOST_TRIALS} trials");
            return Err(bad(Section::Top, "trials", message).into());
        }
        experiment.hash = experiment.check_trials()?;
        Ok(experiment)
    }

    /// What [`hash`](Self::hash) is with so many trials of each case at each point of the grid.
    pub(super) fn hash_of(&self, trials: u64) -> Result<String, ExperimentError> {
        Self { trials, ..self.clone() }.check_trials()
    }

    /// The text that the experiment was read from.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Points of the grid.
    pub fn cells(&self) -> u64 {
        self.axes.iter().map(|a| a.values.len() as u64).product()
    }

    /// All trials.
    pub fn total(&self) -> u64 {
        self.cells() * self.trials * self.cases.len() as u64
    }

    /// Values on the axes of a point of the grid, by index.
    pub fn cell_values(&self, cell: u64) -> Vec<usize> {
        let mut rest = cell;
        let mut at: Vec<usize> = self
            .axes
            .iter()
            .rev()
            .map(|a| {
                let n = a.values.len() as u64;
                let i = rest % n;
                rest /= n;
                i as usize
            })
            .collect();
        at.reverse();
        at
    }

    /// The trial of an index. Seeds and draws come from the experiment's seed, the cell and the repeat: trials of different cases
    /// meet the same randomness, and more trials leave the first ones as they are.
    pub fn trial(&self, index: u64) -> Result<Trial, ExperimentError> {
        if index >= self.total() {
            return Err(ExperimentError::NoTrial { index, total: self.total() });
        }
        let repeat = index % self.trials;
        let cell = index / self.trials % self.cells();
        let case = (index / self.trials / self.cells()) as usize;
        let own = |what: &str| -> ChaCha8Rng { stream(self.seed, &format!("{what} of cell {cell}"), repeat) };
        // a whole number that TOML, JSON and spreadsheets hold exactly
        let seed = own("scenario").next_u64() >> 11;
        let axes: BTreeMap<String, Value> =
            self.axes.iter().zip(self.cell_values(cell)).map(|(a, i)| (a.key.clone(), a.values[i].clone())).collect();
        let mut draws = BTreeMap::new();
        let mut changed = Vec::new();
        let mut draw = |c: &Change| {
            let value = c.value.draw(&c.key, &|name| own(&format!("draw {name}")), &mut draws);
            changed.push((c.section, c.key.clone(), value));
        };
        self.changes.iter().for_each(&mut draw);
        let in_case = self.cases[case].changes.iter();
        in_case.for_each(&mut draw);
        // a case's own changes come last
        let own_changes = changed.split_off(self.changes.len());
        changed.extend(axes.iter().map(|(k, v)| (Section::Vary, k.clone(), v.clone())));
        changed.extend(own_changes);
        Ok(Trial { index, case, cell, repeat, seed, axes, draws, changes: changed })
    }

    /// The scenario of a trial.
    pub fn scenario(&self, trial: &Trial) -> Result<Scenario, ExperimentError> {
        let mut overrides = Vec::with_capacity(trial.changes.len());
        for (section, key, value) in &trial.changes {
            let set = Override::new(key, value).map_err(|e| wrong(&self.text, &self.file, *section, key, e))?;
            overrides.push(set);
        }
        let at = |text: &str| overrides.iter().rposition(|o| o.text == text);
        let mut scenario = Scenario::parse(&self.base_text, &self.base, &overrides).map_err(|e| match e {
            ScenarioError::Override { text, message } => match at(&text).map(|i| &trial.changes[i]) {
                Some((section, key, _)) => {
                    let drawn = trial.draws.keys().any(|d| d.starts_with(key.as_str()));
                    let which = if drawn { format!(" (trial {})", trial.index) } else { String::new() };
                    ExperimentError::from(wrong(&self.text, &self.file, *section, key, format!("{message}{which}")))
                }
                None => ScenarioError::Override { text, message }.into(),
            },
            other => other.into(),
        })?;
        scenario.seed = trial.seed;
        scenario.name = format!("{} #{}", self.name, trial.index);
        scenario.accept.clear();
        Ok(scenario)
    }

    /// Resolves the scenario of every trial whose values differ from those before, and digests what trials depend on: the program's
    /// build, the experiment but for its name and what is made of results, the base scenario, and all files that are read.
    fn check_trials(&self) -> Result<String, ExperimentError> {
        let mut digest = Digest::new();
        digest.bytes(BUILD.as_bytes()).bytes(self.base_text.as_bytes());
        if self.until != Stage::End {
            digest.bytes(format!("{:?}", self.until).as_bytes());
        }
        let mut inputs = Inputs::default();
        for index in 0..self.total() {
            let trial = self.trial(index)?;
            digest.bytes(&trial.seed.to_le_bytes()).bytes(self.cases[trial.case].name.as_bytes());
            for (_, key, value) in &trial.changes {
                digest.bytes(key.as_bytes()).bytes(b"=").bytes(value.to_string().as_bytes()).bytes(b"\n");
            }
            // repeats without draws differ in their seed alone
            if trial.repeat == 0 || !trial.draws.is_empty() {
                let scenario = self.scenario(&trial)?;
                inputs.add(&scenario).map_err(|e| ExperimentError::Run { trial: index, source: Box::new(e.into()) })?;
            }
        }
        // the files may have moved: what is in them counts
        let mut contents: Vec<&String> = inputs.files().values().collect();
        contents.sort();
        contents.into_iter().for_each(|c| {
            digest.bytes(c.as_bytes());
        });
        Ok(digest.hex())
    }
}

fn read_text(file: &Path) -> Result<String, ConfigError> {
    files::read_text(file).map_err(|source| ConfigError::Unreadable { file: file.to_path_buf(), source })
}

type Bad<'a> = dyn Fn(Section, &str, String) -> ConfigError + 'a;

/// The settings in a table, by dotted key: tables in it are looked into, but for those that are one value.
fn flatten(table: &BTreeMap<String, Value>) -> Vec<(String, &Value)> {
    fn walk<'a>(
        prefix: &str,
        table: impl Iterator<Item = (&'a String, &'a Value)>,
        found: &mut Vec<(String, &'a Value)>,
    ) {
        for (name, value) in table {
            let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
            match value {
                Value::Object(inner) if is_section(&key, inner) => walk(&key, inner.iter(), found),
                value => found.push((key, value)),
            }
        }
    }
    let mut found = Vec::new();
    walk("", table.iter(), &mut found);
    found
}

/// Whether a table holds settings; a pattern is one value, so that it takes the place of another whole.
fn is_section(key: &str, table: &Map<String, Value>) -> bool {
    key != "drawing.pattern" && !value::is_spread(table)
}

/// Keys that a trial has of its own.
fn refuse_own(section: Section, key: &str, bad: &Bad) -> Result<(), ConfigError> {
    match key {
        "seed" => Err(bad(section, key, "each trial has its own seed, made of the experiment's `seed`".into())),
        "name" => Err(bad(section, key, "a trial's name is the experiment's and its index".into())),
        _ => Ok(()),
    }
}

fn changes(table: &BTreeMap<String, Value>, section: Section, bad: &Bad) -> Result<Vec<Change>, ConfigError> {
    let change = |(key, value): (String, &Value)| {
        refuse_own(section, &key, bad)?;
        let template = Template::parse(value).map_err(|e| bad(section, &key, format!("`{key}`: {e}")))?;
        Ok(Change { section, key, value: template })
    };
    flatten(table).into_iter().map(change).collect()
}

/// `[vary]`: axes, and what is drawn.
fn varied(table: &BTreeMap<String, Value>, bad: &Bad) -> Result<(Vec<Axis>, Vec<Change>), ConfigError> {
    let (mut axes, mut drawn) = (Vec::new(), Vec::new());
    for (key, value) in flatten(table) {
        refuse_own(Section::Vary, &key, bad)?;
        let wrong = |e: String| bad(Section::Vary, &key, format!("`{key}`: {e}"));
        match value::axis(value).map_err(wrong)? {
            Some(values) => axes.push(Axis::new(&key, values)),
            None => match Template::parse(value).map_err(wrong)? {
                Template::Fixed(_) => {
                    let message = "doesn't vary: give a list, a range { from, to, steps } or a distribution, or put it into [set]";
                    return Err(wrong(message.into()));
                }
                template => drawn.push(Change { section: Section::Vary, key, value: template }),
            },
        }
    }
    Ok((axes, drawn))
}

fn plots(typed: &ExperimentFile, rates: &[Rate], axes: &[Axis], bad: &Bad) -> Result<Vec<PlotSpec>, ConfigError> {
    let mut plots = Vec::new();
    for (i, plot) in typed.plots.iter().enumerate() {
        let section = Section::Plot(i);
        let find = |name: &str, key: &Option<String>| -> Result<usize, ConfigError> {
            let known = || axes.iter().map(|a| a.key.as_str()).collect::<Vec<_>>().join(", ");
            let Some(key) = key else {
                let message = format!("this plot needs `{name}`, an axis of [vary]: {}", known());
                return Err(bad(section, name, message));
            };
            axes.iter().position(|a| a.key == *key).ok_or_else(|| {
                let message = match diagnostic::nearest(key, axes.iter().map(|a| a.key.as_str())) {
                    Some(near) => format!("no axis `{key}`: did you mean `{near}`?"),
                    None => format!("no axis `{key}` in [vary]: there are {}", known()),
                };
                bad(section, name, message)
            })
        };
        let quantity = Quantity::parse(&plot.metric, rates).map_err(|e| bad(section, "metric", e))?;
        let (axis, axis_y) = match plot.kind {
            PlotKind::Curve => (find("axis", &plot.axis)?, 0),
            PlotKind::Histogram => (0, 0),
            PlotKind::Heatmap => (find("axis", &plot.axis)?, find("axis_y", &plot.axis_y)?),
        };
        if plot.kind == PlotKind::Heatmap && axis == axis_y {
            return Err(bad(section, "axis_y", "a heatmap needs two different axes".into()));
        }
        if plot.log && !axes.get(axis).is_some_and(Axis::is_positive) {
            return Err(bad(section, "log", "a logarithmic axis needs numbers above 0".into()));
        }
        let bins = plot.bins.unwrap_or(24);
        let title = plot.title.clone().unwrap_or_else(|| quantity.meaning());
        plots.push(PlotSpec { kind: plot.kind, quantity, axis, axis_y, log: plot.log, bins, title });
    }
    Ok(plots)
}
