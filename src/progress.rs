//! Progress of a run on stderr: a few lines on a terminal, otherwise one line a minute.

mod display;
mod observer;

use std::io::{self, IsTerminal as _, Write};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use osteon_common::job::{Data, JobKind, JobSpecification};
use osteon_common::visible;
use osteon_proto::v1::JobSnapshot;
use serde_json::json;
use terminal_size::{Width, terminal_size_of};
use tracing_subscriber::fmt::MakeWriter;

use crate::arguments::{ProgressFormat, VerbosityArguments};
use crate::output::json::snapshot_value;

pub(crate) use self::display::{JobProgress, line, span};
use self::observer::Observer;

/// Time between two lines if stderr is not a terminal, s.
const LINE_INTERVAL_S: u64 = 60;
/// Redraws of a terminal per second.
const DRAWN_HZ: u8 = 8;
/// Columns assumed for a terminal of unknown width.
const WIDTH_DEFAULT: usize = 80;
/// Columns of the time before a line.
const TIME_WIDTH: usize = 10;
/// Narrowest terminal for which lines are laid out.
const WIDTH_MIN: usize = 40;

/// Progress bars of this process; empty if stderr is not a terminal.
static BARS: OnceLock<MultiProgress> = OnceLock::new();

/// How the progress of a run is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ShownProgress {
    /// Its format.
    pub(crate) format: ProgressFormat,
    /// How much of it.
    pub(crate) verbosity: VerbosityArguments,
}

/// Progress of one run.
#[derive(Debug)]
pub(crate) struct Progress {
    shown: ShownProgress,
    /// Evaluations that had been made when a line was last shown.
    evaluations: u64,
    bar: Option<ProgressBar>,
    begun: Instant,
    last_line: Instant,
    observer: Observer,
}

impl Progress {
    /// Starts to show the progress of this job.
    pub(crate) fn start(specification: &JobSpecification, shown: ShownProgress) -> Self {
        let is_text = shown.format == ProgressFormat::Text && !shown.verbosity.quiet;
        let has_bar = is_text && io::stderr().is_terminal();
        let bar = has_bar.then(|| {
            let bars = BARS.get_or_init(|| {
                MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(DRAWN_HZ))
            });
            let bar = bars.add(ProgressBar::no_length());
            // If the template were invalid, the library's default style would be used.
            if let Ok(style) = ProgressStyle::with_template("{msg}") {
                bar.set_style(style);
            }
            bar
        });
        let begun = Instant::now();
        let observer = Observer::new(derivatives(specification));
        Self { shown, evaluations: 0, bar, begun, last_line: begun, observer }
    }

    /// Shows the progress of the job.
    ///
    /// # Errors
    /// If a program was to read the progress, and has closed stderr.
    pub(crate) fn show(&mut self, snapshot: &JobSnapshot) -> io::Result<()> {
        if self.shown.format == ProgressFormat::Json {
            return writeln!(io::stderr(), "{}", json!({ "progress": snapshot_value(snapshot) }));
        }
        let VerbosityArguments { quiet, verbose } = self.shown.verbosity;
        if quiet {
            return Ok(());
        }
        let observed = self.observer.observe(snapshot, self.begun.elapsed());
        let is_new = snapshot.evaluations > self.evaluations;
        if verbose && is_new {
            self.evaluations = snapshot.evaluations;
            let time = display::span(self.begun.elapsed().as_secs_f64());
            say(&format!("{time}: {}", line(snapshot, &observed, terminal_width() - TIME_WIDTH)));
        }
        if let Some(bar) = &self.bar {
            bar.set_message(display::lines(snapshot, &observed, terminal_width()).join("\n"));
        } else if self.last_line.elapsed() >= Duration::from_secs(LINE_INTERVAL_S) {
            self.last_line = Instant::now();
            say(&line(snapshot, &observed, usize::MAX));
        }
        Ok(())
    }

    /// Removes the bar.
    pub(crate) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
            if let Some(bars) = BARS.get() {
                bars.remove(bar);
                // Fails only if stderr is closed.
                drop(bars.clear());
            }
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

/// Returns how many evaluations of a job measure derivatives or serve the posterior, in addition to
/// those of its searches.
fn derivatives(specification: &JobSpecification) -> u64 {
    if specification.kind == JobKind::Propagation {
        return 0;
    }
    let sets = specification.data.as_ref().map_or(1, Data::sets) as u64;
    let searches = specification.searched_max().saturating_mul(sets);
    specification.evaluations_max().saturating_sub(searches)
}

/// Returns the current number of columns of the terminal.
fn terminal_width() -> usize {
    let width = terminal_size_of(io::stderr()).map(|(Width(width), _)| usize::from(width));
    width.filter(|width| *width > 0).unwrap_or(WIDTH_DEFAULT).max(WIDTH_MIN)
}

/// Prints one line on stderr, above a bar if there is one.
pub(crate) fn say(line: &str) {
    let line = visible::lines(line);
    // If stderr is closed, nothing more can be done.
    let write = || drop(writeln!(io::stderr(), "{line}"));
    match BARS.get() {
        Some(bars) => bars.suspend(write),
        None => write(),
    }
}

/// Writer of the logs: stderr, above a bar if there is one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LogWriter;

impl<'a> MakeWriter<'a> for LogWriter {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        *self
    }
}

impl Write for LogWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let text = shown(bytes);
        // A closed stderr must not end a computation.
        let write = || drop(io::stderr().write_all(text.as_bytes()));
        match BARS.get() {
            Some(bars) => bars.suspend(write),
            None => write(),
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Returns a log event as one line: line breaks and hidden characters are escaped.
fn shown(event: &[u8]) -> String {
    let text = String::from_utf8_lossy(event);
    match text.strip_suffix('\n') {
        Some(line) => format!("{}\n", visible::line(line)),
        None => visible::line(&text).into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_of_the_log_is_one_line() {
        assert_eq!(
            shown(b"WARN lost host=a\x1b[2J\n INFO b\n"),
            "WARN lost host=a\\u{1b}[2J\\n INFO b\n"
        );
        assert_eq!(shown("Größe \u{202e}\n".as_bytes()), "Größe \\u{202e}\n");
        assert_eq!(shown(b"\xff\n"), "\u{fffd}\n");
    }
}
