//! Progress of a job as text: parts of different priority, of which as many are shown as the width
//! allows.

use osteon_common::visible;
use osteon_proto::v1::{JobKind, JobSnapshot, JobState};

/// Data that a single snapshot does not contain.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct JobProgress {
    /// Number of evaluations, within the maximum, that would measure derivatives, as far as known.
    pub(crate) derivatives: u64,
    /// Outcomes of the current evaluation, if it takes so long that a bar is useful.
    pub(crate) bar: Option<u64>,
    /// Mean duration of an evaluation so far, s.
    pub(crate) evaluation_s: Option<f64>,
}

/// A piece of a line.
struct Part {
    /// Parts with the highest rank are dropped first.
    rank: u8,
    /// Separator before the text, unless it is the first part.
    joint: &'static str,
    text: String,
}

/// Maximum width of a bar.
const BAR_WIDTH_MAX: usize = 16;

/// Returns the lines of a job for a terminal of this width: its progress, the best point so far,
/// what it waits for, and a bar if the current evaluation takes long.
pub(crate) fn lines(snapshot: &JobSnapshot, observed: &JobProgress, width: usize) -> Vec<String> {
    let mut lines = Vec::new();
    if snapshot.kind() == JobKind::Identification {
        lines.push(fitted(course(snapshot, observed), width));
        lines.push(fitted(best(snapshot), width));
        lines.extend(observed.bar.map(|done| bar(snapshot, done, width)));
    } else if let Some(done) = observed.bar.filter(|_| snapshot.waiting_for.is_empty()) {
        lines.push(bar(snapshot, done, width));
    } else {
        lines.push(fitted(course(snapshot, observed), width));
    }
    lines.extend(waiting(snapshot).map(|part| cut(part.text, width)));
    lines.retain(|line| !line.is_empty());
    lines
}

/// Returns the same in one line.
pub(crate) fn line(snapshot: &JobSnapshot, observed: &JobProgress, width: usize) -> String {
    let mut parts = course(snapshot, observed);
    parts.extend(waiting(snapshot));
    parts.extend(best(snapshot));
    if snapshot.kind() == JobKind::Identification && snapshot.state() == JobState::Running {
        parts.push(Part {
            rank: 7,
            joint: ", ",
            text: outcomes(snapshot, snapshot.realizations_done),
        });
    }
    cut(fitted(parts, width), width)
}

/// Progress and speed of the job.
fn course(snapshot: &JobSnapshot, observed: &JobProgress) -> Vec<Part> {
    let part = |rank, joint, text: String| Part { rank, joint, text };
    let running = snapshot.state() == JobState::Running;
    let mut parts = Vec::new();
    match (snapshot.kind() == JobKind::Identification, running) {
        (true, true) => {
            let most = snapshot.max_evaluations;
            let number = (snapshot.evaluations + 1).min(most);
            parts.push(part(0, ", ", format!("evaluation {number}")));
            let search = most.saturating_sub(observed.derivatives);
            if observed.derivatives > 0 {
                let more = observed.derivatives;
                parts.push(part(8, " ", format!("of at most {search} + {more}")));
                parts.push(part(10, " ", "for derivatives".to_owned()));
            } else {
                parts.push(part(8, " ", format!("of at most {search}")));
            }
        }
        (true, false) if snapshot.evaluations > 0 => {
            parts.push(part(0, ", ", format!("{} evaluations", snapshot.evaluations)));
        }
        (false, true) => {
            parts.push(part(0, ", ", outcomes(snapshot, snapshot.realizations_done)));
        }
        _ => {}
    }
    if running {
        let rate = format!("{:.0} realizations/s", snapshot.realizations_per_second);
        parts.push(part(5, ", ", rate));
        parts.extend(time_left(snapshot, observed));
    }
    parts
}

/// The best point so far.
fn best(snapshot: &JobSnapshot) -> Vec<Part> {
    let part = |rank, text: String| Part { rank, joint: ", ", text };
    let mut parts = Vec::new();
    if let Some(cost) = snapshot.best_cost.filter(|cost| cost.is_finite()) {
        // Logarithms of likelihoods differ only in their last digits.
        let digits = if cost.abs() < 1.0 { format!("{cost:.2e}") } else { format!("{cost:.6}") };
        parts.push(part(2, format!("best cost {digits}")));
    }
    if let (Some(mean), Some(variation)) =
        (snapshot.best_mean, snapshot.best_coefficient_of_variation)
    {
        parts.push(part(4, format!("mean {mean:.1} m/s")));
        parts.push(part(6, format!("CV {variation:.5}")));
    }
    parts
}

fn waiting(snapshot: &JobSnapshot) -> Option<Part> {
    let text = format!("waiting: {}", visible::line(&snapshot.waiting_for));
    (!snapshot.waiting_for.is_empty()).then_some(Part { rank: 1, joint: ", ", text })
}

fn outcomes(snapshot: &JobSnapshot, done: u64) -> String {
    format!("{done} of {} realizations", snapshot.realizations)
}

/// Time left. For a search only an upper limit is known, since it may find its point at any time.
fn time_left(snapshot: &JobSnapshot, observed: &JobProgress) -> Vec<Part> {
    let (done, all) = (snapshot.realizations_done as f64, snapshot.realizations.max(1) as f64);
    let by_rate = all / snapshot.realizations_per_second;
    let evaluation_s = observed.evaluation_s.unwrap_or(by_rate);
    if !(evaluation_s > 0.0 && evaluation_s.is_finite()) {
        return Vec::new();
    }
    let of_this = (1.0 - done / all).max(0.0);
    if snapshot.kind() != JobKind::Identification {
        let text = format!("{} left", span(of_this * evaluation_s));
        return vec![Part { rank: 3, joint: ", ", text }];
    }
    let others = snapshot.max_evaluations.saturating_sub(snapshot.evaluations + 1) as f64;
    let text = format!("up to {} left", span((of_this + others) * evaluation_s));
    let condition = "if all evaluations are used".to_owned();
    vec![Part { rank: 3, joint: ", ", text }, Part { rank: 9, joint: " ", text: condition }]
}

/// A bar of the current evaluation.
fn bar(snapshot: &JobSnapshot, done: u64, width: usize) -> String {
    let all = snapshot.realizations.max(1);
    let fraction = done.min(all) as f64 / all as f64;
    let bar_width = (width / 5).min(BAR_WIDTH_MAX);
    let full = (fraction * bar_width as f64) as usize;
    let bar = format!("{}{}", "█".repeat(full), "░".repeat(bar_width - full));
    // Rounded down, so that 100 % means complete.
    let percent = format!("{:.0} %", (100.0 * fraction).floor());
    let part = |rank, joint, text: String| Part { rank, joint, text };
    let mut parts = vec![part(0, "", bar), part(1, " ", percent)];
    let search = snapshot.kind() == JobKind::Identification;
    if search {
        parts.push(part(2, " ", "of this evaluation".to_owned()));
    }
    parts.push(part(8, ", ", outcomes(snapshot, done)));
    if !search {
        let observed = JobProgress::default();
        let others = course(snapshot, &observed).into_iter().filter(|part| part.rank > 0);
        parts.extend(others);
    }
    fitted(parts, width)
}

/// Returns as many of the parts as the width allows, in their order.
fn fitted(mut parts: Vec<Part>, width: usize) -> String {
    loop {
        let text = joined(&parts);
        let least = parts.iter().enumerate().max_by_key(|(_, part)| part.rank);
        match least {
            Some((place, _)) if text.chars().count() > width && parts.len() > 1 => {
                parts.remove(place);
            }
            _ => return text,
        }
    }
}

fn joined(parts: &[Part]) -> String {
    let mut text = String::new();
    for (place, part) in parts.iter().enumerate() {
        if place > 0 {
            text.push_str(part.joint);
        }
        text.push_str(&part.text);
    }
    text
}

/// Cuts a text that has no smaller parts, and marks the cut.
fn cut(text: String, width: usize) -> String {
    if text.chars().count() <= width {
        return text;
    }
    let kept = text.chars().take(width.saturating_sub(1));
    kept.chain(['…']).collect()
}

/// Returns a duration as text with at most three significant characters.
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
mod tests;
