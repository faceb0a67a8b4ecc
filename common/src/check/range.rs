//! Rules on the range of a parameter.

use crate::accepted::{Interval, written};
use crate::job::Range;
use crate::parameters::Parameter;
use crate::plausible::PlausibleRange;
use crate::violations::Violations;

use super::value::{known_wrong, number, quantity};

/// Checks a range: the numbers of a fixed or free parameter by themselves, and the start against the
/// bounds.
pub(super) fn range(parameter: Parameter, range: Range, violations: &mut Violations) {
    let path = format!("parameters.{}", parameter.name());
    let (accepted, kind) = (parameter.row().accepted, parameter.row().plausible);
    match range {
        Range::Fixed(value) => {
            quantity(&format!("{path}.fixed"), value, accepted, kind, violations);
        }
        Range::Free { start, lower, upper } => {
            let (start_path, bounds_path) = (format!("{path}.start"), format!("{path}.bounds"));
            quantity(&start_path, start, accepted, kind, violations);
            bounds(&bounds_path, [lower, upper], accepted, kind, violations);
            if !known_wrong(&bounds_path, violations) {
                let within = Interval::from_to(lower, upper, "the bounds");
                number(&start_path, start, within, violations);
            }
        }
    }
}

fn bounds(
    path: &str,
    [lower, upper]: [f64; 2],
    accepted: Interval,
    kind: &PlausibleRange,
    violations: &mut Violations,
) {
    if known_wrong(path, violations) {
        return;
    }
    for (name, value) in [("lower", lower), ("upper", upper)] {
        if !accepted.contains(value) {
            violations.add(path, format!("the {name} bound {}", accepted.refusal(value)));
        }
    }
    if violations.has_at_or_below(path) {
        return;
    }
    if lower >= upper {
        let reversed = lower > upper;
        let [lower, upper] = [lower, upper].map(written);
        let cure = if reversed { format!("; write [{upper}, {lower}]") } else { String::new() };
        let message = format!("the lower bound {lower} must be below the upper {upper}{cure}");
        violations.add(path, message);
    } else if let Some(question) = kind.question(&[lower, upper], accepted) {
        let asked_for = kind.asked_for();
        violations.add(path, format!("are {lower:?} and {upper:?}; {asked_for}: {question}"));
    }
}
