//! A bar on the terminal, and Ctrl-C.

use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use core::time::Duration;
use std::io::IsTerminal;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use fredholm::answer::SolveObserver;
use fredholm::choice::{ChoiceReport, LONG_SECONDS};
use fredholm::numbers::short;
use fredholm::{Settings, WalkOptions};
use fredholm_core::Statistics;
use fredholm_rayon::Observer;
use indicatif::{
    HumanCount, HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle,
};

use crate::failure::{Failure, say};

/// What the handler of Ctrl-C and a command know of each other.
#[derive(Debug, Default)]
pub(crate) struct Signals {
    /// Set by the first Ctrl-C.
    interrupted: AtomicBool,
    /// Whether walks are under way, which look for an interruption and have something to print.
    walking: AtomicBool,
}

impl Signals {
    /// From now on Ctrl-C, and a request to terminate, ends the walks, whose results so far are then printed. During the set-up there
    /// are none, and a second Ctrl-C does not want to wait for them: then `stop_at_once` is called.
    pub(crate) fn catch(stop_at_once: fn()) -> Result<Arc<Self>, Failure> {
        let signals = Arc::new(Self::default());
        let seen = Arc::clone(&signals);
        let handler = move || {
            let again = seen.interrupted.swap(true, Ordering::Relaxed);
            if again || !seen.walking.load(Ordering::Relaxed) {
                stop_at_once();
            }
        };
        ctrlc::set_handler(handler)
            .map_err(|error| Failure::run(format_args!("cannot catch interrupts: {error}")))?;
        Ok(signals)
    }

    /// From now on there is something to print, which a first Ctrl-C waits for.
    pub(crate) fn expect_results(&self) {
        self.walking.store(true, Ordering::Relaxed);
    }

    /// Whether Ctrl-C was pressed.
    pub(crate) fn interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}

/// Shows the walks done and the largest error bar so far; silent where stderr is no terminal.
#[derive(Debug)]
pub(crate) struct Progress<'a> {
    bar: ProgressBar,
    signals: &'a Signals,
    /// Walks not yet shown: every thread adds to it, and the bar is told now and then.
    pending: AtomicU64,
    /// The most walks there may be.
    most: u64,
    /// When walking began.
    began: Arc<OnceLock<Instant>>,
}

/// The time that the rest takes if it goes on as since walking began: neither the choice nor the set-up says anything of it.
/// Nothing is known before the first walks are done.
fn left(began: Option<&Instant>, done: u64, all: Option<u64>) -> Option<Duration> {
    let (began, all) = (began?, all.filter(|&all| all < u64::MAX)?);
    let each = began.elapsed().as_secs_f64() / done as f64;
    Duration::try_from_secs_f64(each * all.saturating_sub(done) as f64).ok()
}

/// A time for people. 0 seconds are never left of walks that are not done.
fn in_words(left: Duration) -> String {
    if left < Duration::from_secs(1) {
        return "less than a second".to_owned();
    }
    HumanDuration(left).to_string()
}

impl<'a> Progress<'a> {
    /// A bar for the walks of so many values.
    pub(crate) fn of_each(values: usize, walk: &WalkOptions, signals: &'a Signals) -> Self {
        let all = walk.walks.saturating_mul(values as u64);
        Self::new(walk.tolerance.map_or(all, |_| u64::MAX), signals)
    }

    /// A bar for so many walks; `u64::MAX` if that is not known yet.
    pub(crate) fn new(walks: u64, signals: &'a Signals) -> Self {
        let began: Arc<OnceLock<Instant>> = Arc::default();
        let since = Arc::clone(&began);
        let left = move |state: &ProgressState, text: &mut dyn core::fmt::Write| {
            let left = left(since.get(), state.pos(), state.len());
            let _ = text.write_str(&left.map_or("?".to_owned(), in_words));
        };
        // A choice predicts how many there are.
        let all = |state: &ProgressState, text: &mut dyn core::fmt::Write| {
            let all = state.len().filter(|&all| all < u64::MAX);
            let _ = text.write_str(&all.map_or("?".to_owned(), |all| HumanCount(all).to_string()));
        };
        let template = "{bar:30} {percent:>3} %  {human_pos} of {all} walks, {left} left {msg}";
        let keys = |style: ProgressStyle| style.with_key("left", left).with_key("all", all);
        Self {
            bar: bar(walks, template, keys),
            signals,
            pending: AtomicU64::new(0),
            most: walks,
            began,
        }
    }

    /// Says what is being worked on.
    pub(crate) fn say(&self, message: String) {
        self.bar.set_message(message);
    }

    /// Says a line on stderr, above the bar.
    fn aside(&self, line: &str) {
        self.bar.suspend(|| say(line));
    }

    /// Removes the bar.
    pub(crate) fn done(&self) {
        self.bar.finish_and_clear();
    }
}

/// A bar of so many things; silent where stderr is no terminal, and then without a thread that moves it.
pub(crate) fn bar(
    length: u64,
    template: &str,
    keys: impl FnOnce(ProgressStyle) -> ProgressStyle,
) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr_with_hz(10));
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(keys(style));
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

impl Observer for Progress<'_> {
    fn walked(&self, walks: u64) {
        const SHOW: u64 = 1 << 16;
        if self.pending.fetch_add(walks, Ordering::Relaxed) + walks >= SHOW {
            self.bar.inc(self.pending.swap(0, Ordering::Relaxed));
        }
    }

    fn merged(&self, statistics: &[Statistics]) {
        let largest = statistics
            .iter()
            .filter_map(|s| s.preconditioned().std_error)
            .fold(0.0, f64::max);
        self.say(format!("± {largest:.1e}"));
    }

    fn cancelled(&self) -> bool {
        self.signals.interrupted()
    }
}

impl SolveObserver for Progress<'_> {
    fn walking(&self) {
        self.began.get_or_init(Instant::now);
        self.say(String::new());
        self.signals.walking.store(true, Ordering::Relaxed);
    }

    fn choosing(&self, seconds: f64) {
        self.aside(&format!(
            "warning: choosing takes long: what comes next takes about {} s",
            short(seconds)
        ));
    }

    fn chosen(&self, settings: &Settings, report: &ChoiceReport) {
        self.bar
            .set_length((report.predicted_walks as u64).min(self.most));
        self.say("setting up".to_owned());
        let share = settings.walk_options().walks as f64 / report.predicted_walks;
        let walking = share.min(1.0) * report.predicted_walk_seconds;
        if report.predicted_setup_seconds + walking > LONG_SECONDS {
            let cells = settings.cells.unwrap_or(0).to_string();
            let text = report.text(settings, &cells);
            self.aside(&format!(
                "warning: this takes long: {}",
                text.trim_end().replace('\n', "; ")
            ));
        }
    }
}

/// Counts the sites of a diagnosis.
#[derive(Debug)]
pub(crate) struct Sites(pub(crate) ProgressBar);

impl Observer for Sites {}

impl SolveObserver for Sites {
    fn expect_sites(&self, sites: u64) {
        self.0.inc_length(sites);
    }

    fn finish_site(&self) {
        self.0.inc(1);
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn what_is_left_is_not_nothing() {
        for (seconds, words) in [(0.4, "less than a second"), (1.2, "1 second")] {
            assert_eq!(
                super::in_words(super::Duration::from_secs_f64(seconds)),
                words
            );
        }
    }
}
