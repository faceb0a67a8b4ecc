//! Rules on how signals are recorded.

use crate::signal_layout::{SignalAxis, SignalLayout, Transmitter};
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
    const OFFSETS: &str = "signals.transmitter_offsets";
    if violations.has_at_or_below(FIELD) || violations.has_at_or_below(OFFSETS) {
        return;
    }
    let (names, offsets) = (&layout.transmitters, &layout.transmitter_offsets);
    if offsets.is_empty() {
        match names.as_slice() {
            [_] => {}
            [one, other] if one != other => {}
            _ => {
                let names: Vec<_> = names.iter().map(|one| format!("\"{}\"", one.name())).collect();
                let message = format!(
                    "is [{}]; it must name one source, or both, unless transmitter_offsets says where each is",
                    names.join(", ")
                );
                violations.add(FIELD, message);
            }
        }
        return;
    }
    if offsets.len() != names.len() {
        let message =
            format!("has {} elements, and signals.transmitters {}", offsets.len(), names.len());
        return violations.add(OFFSETS, message);
    }
    for side in Transmitter::ALL.into_iter().filter(|side| names.contains(side)) {
        let of_side = layout.sources().filter(|(name, _)| *name == side);
        let mut of_side: Vec<f64> = of_side.map(|(_, offset)| offset).collect();
        of_side.sort_by(f64::total_cmp);
        if of_side[0] != 0.0 || of_side.windows(2).any(|two| two[0] == two[1]) {
            let message = format!(
                "has {of_side:?} for \"{}\"; they must differ, and one must be 0, that of the source itself",
                side.name()
            );
            violations.add(OFFSETS, message);
        }
    }
}
