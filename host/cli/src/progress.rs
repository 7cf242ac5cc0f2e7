//! Progress bar on the standard error, if that is a terminal.

use std::io::{IsTerminal, Write, stderr};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::outln;
use crate::output::OutputError;

/// Minimum interval between two drawings of the bar.
const REDRAW: Duration = Duration::from_millis(100);
const BAR_CELLS: usize = 40;

/// A progress bar for any number of threads. It disappears when it is dropped.
#[derive(Debug)]
pub struct Progress {
    title: String,
    unit: &'static str,
    total: usize,
    start: Instant,
    is_terminal: bool,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    done: usize,
    drawn: Option<Instant>,
}

impl Progress {
    /// A bar at 0 of `total`; `unit` is the plural of the counted items.
    pub fn new(title: impl Into<String>, total: usize, unit: &'static str) -> Self {
        let is_terminal = stderr().is_terminal();
        Self { title: title.into(), unit, total, start: Instant::now(), is_terminal, state: Mutex::default() }
    }

    /// Increments the count.
    pub fn increment(&self) {
        let Ok(mut state) = self.state.lock() else { return };
        state.done += 1;
        if self.is_terminal && state.drawn.is_none_or(|drawn| drawn.elapsed() >= REDRAW) {
            state.drawn = Some(Instant::now());
            let line = self.line(state.done);
            let _ = write!(stderr(), "\r\x1b[K{line}");
        }
    }

    /// Prints a line to the standard output, above the bar.
    ///
    /// # Errors
    /// If the standard output fails.
    pub fn println(&self, line: impl std::fmt::Display) -> Result<(), OutputError> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.drawn.take().is_some() {
            let _ = write!(stderr(), "\r\x1b[K");
        }
        outln!("{line}")
    }

    fn line(&self, done: usize) -> String {
        let Self { title, unit, total, .. } = self;
        let share = done as f64 / (*total).max(1) as f64;
        let filled = ((share * BAR_CELLS as f64) as usize).min(BAR_CELLS);
        let (filled, rest) = ("█".repeat(filled), "░".repeat(BAR_CELLS - filled));
        let separator = if title.is_empty() { "" } else { " " };
        format!("{title}{separator}{filled}{rest} {done}/{total} {unit}, {} s", self.start.elapsed().as_secs())
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.state.get_mut().is_ok_and(|state| state.drawn.is_some()) {
            let _ = write!(stderr(), "\r\x1b[K");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_is_filled_in_proportion_to_the_count() {
        let progress = Progress::new("office", 80, "places");
        let line = progress.line(20);
        assert_eq!((line.matches('█').count(), line.matches('░').count()), (10, 30));
        assert!(line.starts_with("office ") && line.contains(" 20/80 places, "), "{line}");
        assert_eq!(progress.line(100).matches('█').count(), BAR_CELLS);
        assert!(!Progress::new("", 0, "places").line(0).contains("NaN"));
    }
}
