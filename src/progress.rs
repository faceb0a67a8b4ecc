//! What a run shows on stderr while it computes: a bar on a terminal, else one line a minute.

use std::io::{IsTerminal as _, Write};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use osteon_common::visible;
use osteon_proto::v1::{JobKind, JobSnapshot, JobState};
use tracing_subscriber::fmt::MakeWriter;

/// Time between two lines where there is no terminal, s.
const LINE_INTERVAL_S: u64 = 60;
/// How often a bar is drawn, per second.
const BAR_HZ: u8 = 8;

/// Bars of this process; empty where stderr is no terminal.
static BARS: OnceLock<MultiProgress> = OnceLock::new();

/// Progress of one run.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
    last_line: Instant,
}

impl Progress {
    /// Nothing done yet.
    pub(crate) fn start() -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bars = BARS.get_or_init(|| {
                MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(BAR_HZ))
            });
            let bar = bars.add(ProgressBar::new(1));
            // Falls back to the library's own look if the template were wrong.
            if let Ok(style) = ProgressStyle::with_template("{bar:16} {percent:>3}% {wide_msg}") {
                bar.set_style(style);
            }
            bar
        });
        Self { bar, last_line: Instant::now() }
    }

    /// Shows how far the job is.
    pub(crate) fn show(&mut self, snapshot: &JobSnapshot) {
        if let Some(bar) = &self.bar {
            bar.set_length(snapshot.realizations.max(1));
            bar.set_position(snapshot.realizations_done.min(snapshot.realizations));
            bar.set_message(visible::line(&describe(snapshot)).into_owned());
        } else if self.last_line.elapsed() >= Duration::from_secs(LINE_INTERVAL_S) {
            self.last_line = Instant::now();
            say(&describe(snapshot));
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

/// A snapshot in one line; the first things are those that a narrow terminal must show.
pub(crate) fn describe(snapshot: &JobSnapshot) -> String {
    let mut parts = Vec::new();
    let running = snapshot.state() == JobState::Running;
    if snapshot.kind() == JobKind::Identification {
        let number = snapshot.evaluations + u64::from(running);
        let most = snapshot.max_evaluations;
        parts.push(format!("evaluation {} of at most {most}", number.min(most)));
    }
    if !snapshot.waiting_for.is_empty() {
        parts.push(format!("waiting: {}", snapshot.waiting_for));
    }
    if let Some(cost) = snapshot.best_cost.filter(|cost| cost.is_finite()) {
        // Logarithms of likelihoods differ in their last digits.
        let digits = if cost.abs() < 1.0 { format!("{cost:.2e}") } else { format!("{cost:.6}") };
        parts.push(format!("best cost {digits}"));
    }
    if running {
        parts.push(format!("{:.0} realizations/s", snapshot.realizations_per_second));
        parts.extend(time_left(snapshot));
    }
    if let (Some(mean), Some(variation)) =
        (snapshot.best_mean, snapshot.best_coefficient_of_variation)
    {
        parts.push(format!("{mean:.1} m/s, CV {variation:.5}"));
    }
    if running {
        let (done, all) = (snapshot.realizations_done, snapshot.realizations);
        parts.push(format!("{done}/{all} realizations"));
    }
    parts.join(", ")
}

/// Time left of the evaluation, and for a search the range of what may come: it may end with this evaluation, or
/// take all that it is allowed.
fn time_left(snapshot: &JobSnapshot) -> Option<String> {
    let rate = snapshot.realizations_per_second;
    if !(rate > 0.0 && rate.is_finite()) {
        return None;
    }
    let rest = snapshot.realizations.saturating_sub(snapshot.realizations_done) as f64;
    let evaluation_s = rest / rate;
    if snapshot.kind() != JobKind::Identification {
        return Some(format!("{} left", span(evaluation_s)));
    }
    let others = snapshot.max_evaluations.saturating_sub(snapshot.evaluations + 1) as f64;
    let search_s = evaluation_s + others * snapshot.realizations as f64 / rate;
    Some(format!("{} to {} left", span(evaluation_s), span(search_s)))
}

/// A span of time in words of at most three characters' precision.
pub(crate) fn span(seconds: f64) -> String {
    match seconds {
        s if s < 9.95 => format!("{s:.1} s"),
        s if s < 99.5 => format!("{s:.0} s"),
        s if s < 99.5 * 60.0 => format!("{:.0} min", s / 60.0),
        s if s < 72.0 * 3600.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.0} days", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn snapshot() -> JobSnapshot {
        JobSnapshot {
            job: "1".to_owned(),
            kind: JobKind::Identification.into(),
            state: JobState::Running.into(),
            evaluations: 41,
            max_evaluations: 400,
            realizations_done: 1747,
            realizations: 2747,
            best_cost: Some(1.25e-5),
            best_mean: Some(3906.27),
            best_coefficient_of_variation: Some(0.02708),
            realizations_per_second: 1000.0,
            workers: 2,
            ..JobSnapshot::default()
        }
    }

    #[test]
    fn a_search_says_where_it_is_and_how_long_it_may_take() {
        assert_eq!(
            describe(&snapshot()),
            "evaluation 42 of at most 400, best cost 1.25e-5, 1000 realizations/s, 1.0 s to 16 min left, \
             3906.3 m/s, CV 0.02708, 1747/2747 realizations"
        );
    }

    #[test]
    fn a_likelihoods_cost_has_the_digits_that_change() {
        for (cost, expected) in
            [(6.071647123, "best cost 6.071647,"), (-2.5, "best cost -2.500000,")]
        {
            let line = describe(&JobSnapshot { best_cost: Some(cost), ..snapshot() });
            assert!(line.contains(expected), "{line}");
        }
    }

    #[test]
    fn what_is_not_known_is_not_said() {
        let begun = JobSnapshot {
            evaluations: 0,
            realizations_done: 0,
            best_cost: None,
            best_mean: None,
            best_coefficient_of_variation: None,
            realizations_per_second: 0.0,
            waiting_for: "no worker is attached".to_owned(),
            ..snapshot()
        };
        assert_eq!(
            describe(&begun),
            "evaluation 1 of at most 400, waiting: no worker is attached, 0 realizations/s, 0/2747 realizations"
        );
        let infeasible = JobSnapshot { best_cost: Some(f64::INFINITY), best_mean: None, ..begun };
        assert!(!describe(&infeasible).contains("cost"));
    }

    #[test]
    fn a_propagation_has_one_evaluation() {
        let propagation = JobSnapshot {
            kind: JobKind::Propagation.into(),
            evaluations: 0,
            best_cost: None,
            best_mean: None,
            ..snapshot()
        };
        assert_eq!(
            describe(&propagation),
            "1000 realizations/s, 1.0 s left, 1747/2747 realizations"
        );
    }

    #[test]
    fn spans_read_well() {
        let cases = [
            (0.0, "0.0 s"),
            (9.94, "9.9 s"),
            (9.96, "10 s"),
            (99.6, "2 min"),
            (3600.0, "60 min"),
            (7200.0, "2.0 h"),
            (1e6, "12 days"),
        ];
        for (seconds, expected) in cases {
            assert_eq!(span(seconds), expected);
        }
    }

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
