//! Rules on how signals are recorded.

use crate::signal_layout::{SignalAxis, SignalLayout};
use crate::violations::Violations;

use super::section::section;

/// Records all violations of `layout`, which is the section `[signals]` of a file.
pub fn signals(layout: &SignalLayout, violations: &mut Violations) {
    section("signals", &mut layout.clone(), &mut SignalLayout::default(), violations);
    axes(layout, violations);
    band(layout, violations);
    transmitters(layout, violations);
}

fn axes(layout: &SignalLayout, violations: &mut Violations) {
    const FIELD: &str = "signals.axes";
    if layout.axes.is_empty() || violations.has_at_or_below(FIELD) {
        return;
    }
    for needed in [SignalAxis::Time, SignalAxis::Receiver] {
        if !layout.axes.contains(&needed) {
            violations.add(FIELD, format!("lacks \"{}\", which every array has", needed.name()));
        }
    }
    for axis in SignalAxis::ALL {
        let count = layout.axes.iter().filter(|&&other| other == axis).count();
        if count > 1 {
            violations
                .add(FIELD, format!("has \"{}\" {count} times; it may occur once", axis.name()));
        }
    }
}

fn band(layout: &SignalLayout, violations: &mut Violations) {
    const FIELD: &str = "signals.band";
    if violations.has_at_or_below(FIELD) {
        return;
    }
    match layout.band.as_slice() {
        [] => {}
        [low, high] if low < high => {}
        [low, high] => violations.add(
            FIELD,
            format!("is [{low:?}, {high:?}]; its first frequency must be below its second"),
        ),
        [_, ..] => violations.add(FIELD, "has one number; it must be [LOWER, UPPER], in Hz"),
    }
}

fn transmitters(layout: &SignalLayout, violations: &mut Violations) {
    const FIELD: &str = "signals.transmitters";
    if violations.has_at_or_below(FIELD) {
        return;
    }
    let names = || layout.transmitters.iter().map(|one| format!("\"{}\"", one.name()));
    match layout.transmitters.as_slice() {
        [_] => {}
        [one, other] if one != other => {}
        _ => violations.add(
            FIELD,
            format!(
                "is [{}]; it must name one source, or both",
                names().collect::<Vec<_>>().join(", ")
            ),
        ),
    }
}
