//! Progress for people: bars on a terminal, a line now and then elsewhere.
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::progress::{Progress, Silent};
use crate::report::duration;

use super::print;

/// The listener that fits the terminal and the flags.
pub(super) fn listener(quiet: bool, verbose: bool) -> Box<dyn Progress> {
    match (quiet, print::on_terminal()) {
        (true, _) => Box::new(Silent),
        (false, true) => Box::new(Bars { verbose, now: Mutex::new(None) }),
        (false, false) => Box::new(Lines { verbose, now: Mutex::new(None) }),
    }
}

/// One bar a stage, with the time left.
struct Bars {
    verbose: bool,
    now: Mutex<Option<(String, Instant, ProgressBar)>>,
}

impl Bars {
    fn end(&self, now: &mut Option<(String, Instant, ProgressBar)>) {
        if let Some((name, began, bar)) = now.take() {
            bar.finish_and_clear();
            if self.verbose {
                print::line(&format!("{name}: {}", duration(began.elapsed().as_secs_f64())));
            }
        }
    }
}

impl Progress for Bars {
    fn stage(&self, name: &str, total: Option<u64>) {
        let Ok(mut now) = self.now.lock() else { return };
        self.end(&mut now);
        let bar = match total {
            Some(total) => ProgressBar::new(total),
            None => ProgressBar::new_spinner(),
        };
        let template = match total {
            Some(_) => "{msg:<12} {bar:40} {percent:>3} %  {eta} left",
            None => "{msg:<12} {spinner} {elapsed}",
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("━━ "));
        }
        bar.set_message(name.to_string());
        bar.enable_steady_tick(Duration::from_millis(120));
        *now = Some((name.to_string(), Instant::now(), bar));
    }

    fn advance(&self, done: u64) {
        if let Ok(now) = self.now.lock()
            && let Some((_, _, bar)) = now.as_ref()
        {
            bar.set_position(done);
        }
    }

    fn note(&self, text: &str) {
        let Ok(now) = self.now.lock() else { return };
        match now.as_ref() {
            Some((_, _, bar)) => bar.suspend(|| print::line(text)),
            None => print::line(text),
        }
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        if let Ok(mut now) = self.now.lock() {
            self.end(&mut now);
        }
    }
}

/// Seconds between two lines about one stage.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// A stage under way, reported in lines.
struct Told {
    name: String,
    total: Option<u64>,
    began: Instant,
    last: Instant,
}

/// A line a stage, and one every ten seconds of a long one.
struct Lines {
    verbose: bool,
    now: Mutex<Option<Told>>,
}

impl Lines {
    fn end(&self, now: &mut Option<Told>) {
        if let Some(reported) = now.take()
            && self.verbose
        {
            print::line(&format!("{}: {}", reported.name, duration(reported.began.elapsed().as_secs_f64())));
        }
    }
}

impl Progress for Lines {
    fn stage(&self, name: &str, total: Option<u64>) {
        let Ok(mut now) = self.now.lock() else { return };
        self.end(&mut now);
        print::line(&format!("{name} ..."));
        *now = Some(Told { name: name.to_string(), total, began: Instant::now(), last: Instant::now() });
    }

    fn advance(&self, done: u64) {
        let Ok(mut now) = self.now.lock() else { return };
        let Some(reported) = now.as_mut().filter(|t| t.last.elapsed() >= LINE_EVERY) else { return };
        reported.last = Instant::now();
        if let Some(total) = reported.total.filter(|t| *t > 0 && done > 0) {
            let share = done as f64 / total as f64;
            let left = reported.began.elapsed().as_secs_f64() * (1.0 / share - 1.0).max(0.0);
            print::line(&format!("{} {:.0} %, {} left", reported.name, share * 100.0, duration(left)));
        }
    }

    fn note(&self, text: &str) {
        print::line(text);
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        if let Ok(mut now) = self.now.lock() {
            self.end(&mut now);
        }
    }
}
