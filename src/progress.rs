//! What a run shows on stderr while it computes: a few lines on a terminal, else one line a minute.

mod display;
mod observer;

use std::io::{IsTerminal as _, Write};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use osteon_common::job::{Data, JobKind, JobSpecification};
use osteon_common::visible;
use osteon_proto::v1::JobSnapshot;
use terminal_size::{Width, terminal_size_of};
use tracing_subscriber::fmt::MakeWriter;

pub(crate) use self::display::{Observed, line, span};
use self::observer::Observer;

/// Time between two lines where there is no terminal, s.
const LINE_INTERVAL_S: u64 = 60;
/// How often a terminal is drawn, per second.
const DRAWN_HZ: u8 = 8;
/// Columns of a terminal that does not tell.
const WIDTH_DEFAULT: usize = 80;
/// Narrowest terminal for which lines are laid out.
const WIDTH_MIN: usize = 40;

/// Bars of this process; empty where stderr is no terminal.
static BARS: OnceLock<MultiProgress> = OnceLock::new();

/// Progress of one run.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
    begun: Instant,
    last_line: Instant,
    observer: Observer,
}

impl Progress {
    /// Nothing done yet of this job.
    pub(crate) fn start(specification: &JobSpecification) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bars = BARS.get_or_init(|| {
                MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(DRAWN_HZ))
            });
            let bar = bars.add(ProgressBar::no_length());
            // Falls back to the library's own look if the template were wrong.
            if let Ok(style) = ProgressStyle::with_template("{msg}") {
                bar.set_style(style);
            }
            bar
        });
        let begun = Instant::now();
        let observer = Observer::new(derivatives(specification));
        Self { bar, begun, last_line: begun, observer }
    }

    /// Shows how far the job is.
    pub(crate) fn show(&mut self, snapshot: &JobSnapshot) {
        let observed = self.observer.observe(snapshot, self.begun.elapsed());
        if let Some(bar) = &self.bar {
            bar.set_message(display::lines(snapshot, &observed, terminal_width()).join("\n"));
        } else if self.last_line.elapsed() >= Duration::from_secs(LINE_INTERVAL_S) {
            self.last_line = Instant::now();
            say(&line(snapshot, &observed, usize::MAX));
        }
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
            if let Some(bars) = BARS.get() {
                bars.remove(bar);
                // Fails only when stderr is closed.
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

/// How many evaluations of a job would measure derivatives, beside those of its searches.
fn derivatives(specification: &JobSpecification) -> u64 {
    if specification.kind == JobKind::Propagation {
        return 0;
    }
    let sets = specification.data.as_ref().map_or(1, Data::sets) as u64;
    let search = &specification.search;
    let searches = search.max_evaluations.saturating_mul(search.starts).saturating_mul(sets);
    specification.evaluations_max().saturating_sub(searches)
}

/// Columns of the terminal as it is now.
fn terminal_width() -> usize {
    let width = terminal_size_of(std::io::stderr()).map(|(Width(width), _)| usize::from(width));
    width.filter(|width| *width > 0).unwrap_or(WIDTH_DEFAULT).max(WIDTH_MIN)
}

/// One line on stderr, above a bar if there is one.
pub(crate) fn say(line: &str) {
    let line = visible::lines(line);
    // Nothing is left to be done when stderr is closed.
    let write = || drop(writeln!(std::io::stderr(), "{line}"));
    match BARS.get() {
        Some(bars) => bars.suspend(write),
        None => write(),
    }
}

/// Where logs go: stderr, above a bar if there is one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LogWriter;

impl<'a> MakeWriter<'a> for LogWriter {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        *self
    }
}

impl Write for LogWriter {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let text = shown(bytes);
        // A closed stderr must not end a computation.
        let write = || drop(std::io::stderr().write_all(text.as_bytes()));
        match BARS.get() {
            Some(bars) => bars.suspend(write),
            None => write(),
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// An event of the log as one line: what others have said in it begins no line of its own.
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
