//! What is shown of a job while it computes: parts of different weight, of which as many are shown as
//! the width allows.

use osteon_common::visible;
use osteon_proto::v1::{JobKind, JobSnapshot, JobState};

/// What one snapshot does not tell.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Observed {
    /// How many of the most evaluations would measure derivatives, as far as known.
    pub(crate) derivatives: u64,
    /// Outcomes of the present evaluation, if it takes so long that a bar helps.
    pub(crate) bar: Option<u64>,
    /// What an evaluation has taken until now, s.
    pub(crate) evaluation_s: Option<f64>,
}

/// A piece of a line.
struct Part {
    /// What is dropped first has the highest.
    rank: u8,
    /// Stands before the text, unless it is the first.
    joint: &'static str,
    text: String,
}

/// Widest bar.
const BAR_WIDTH_MAX: usize = 16;

/// The lines of a job for a terminal of so many columns: how far it is, the best so far, what it
/// waits for, and a bar where there is a part whose end is known.
pub(crate) fn lines(snapshot: &JobSnapshot, observed: &Observed, width: usize) -> Vec<String> {
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

/// The same in one line.
pub(crate) fn line(snapshot: &JobSnapshot, observed: &Observed, width: usize) -> String {
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

/// How far the job is, and how fast.
fn course(snapshot: &JobSnapshot, observed: &Observed) -> Vec<Part> {
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
        // Logarithms of likelihoods differ in their last digits.
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

/// Time left. Of a search only the most is known: nobody can say when it will have found what it
/// looks for.
fn time_left(snapshot: &JobSnapshot, observed: &Observed) -> Vec<Part> {
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

/// A bar of the present evaluation.
fn bar(snapshot: &JobSnapshot, done: u64, width: usize) -> String {
    let all = snapshot.realizations.max(1);
    let fraction = done.min(all) as f64 / all as f64;
    let bar_width = (width / 5).min(BAR_WIDTH_MAX);
    let full = (fraction * bar_width as f64) as usize;
    let bar = format!("{}{}", "█".repeat(full), "░".repeat(bar_width - full));
    // Rounded down: 100 % is the end.
    let percent = format!("{:.0} %", (100.0 * fraction).floor());
    let part = |rank, joint, text: String| Part { rank, joint, text };
    let mut parts = vec![part(0, "", bar), part(1, " ", percent)];
    let search = snapshot.kind() == JobKind::Identification;
    if search {
        parts.push(part(2, " ", "of this evaluation".to_owned()));
    }
    parts.push(part(8, ", ", outcomes(snapshot, done)));
    if !search {
        let observed = Observed::default();
        let others = course(snapshot, &observed).into_iter().filter(|part| part.rank > 0);
        parts.extend(others);
    }
    fitted(parts, width)
}

/// As many of the parts as the width allows, in their order.
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

/// What has no smaller part is cut, and says so.
fn cut(text: String, width: usize) -> String {
    if text.chars().count() <= width {
        return text;
    }
    let kept = text.chars().take(width.saturating_sub(1));
    kept.chain(['…']).collect()
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
mod tests;
