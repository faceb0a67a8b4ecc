//! Rules on one value by itself.

use crate::accepted::{Interval, WholeRange};
use crate::field_path::element_path;
use crate::plausible::PlausibleRange;
use crate::violations::Violations;

/// Records a number outside `accepted`, unless `field` is known to be wrong.
pub fn number(field: &str, value: f64, accepted: Interval, violations: &mut Violations) {
    if !known_wrong(field, violations) && !accepted.contains(value) {
        violations.add(field, accepted.refusal(value));
    }
}

/// Records a number outside `accepted`, or one that is physically impossible and would be plausible
/// in another unit, unless `field` is known to be wrong.
pub fn quantity(
    field: &str,
    value: f64,
    accepted: Interval,
    quantity: &PlausibleRange,
    violations: &mut Violations,
) {
    if known_wrong(field, violations) {
        return;
    }
    let question = quantity.question(&[value], accepted);
    let refusal = match (accepted.contains(value), question) {
        (true, None) => return,
        (true, Some(question)) => format!("is {value:?}; {}: {question}", quantity.asked_for()),
        (false, None) => accepted.refusal(value),
        (false, Some(question)) => format!("{}: {question}", accepted.refusal(value)),
    };
    violations.add(field, refusal);
}

/// Maximum number of elements of a list that are refused individually.
pub(super) const REFUSED_MAX: usize = 10;

/// Records the elements of a list that are outside `accepted`; `plural` is a word for them.
pub(super) fn elements(
    field: &str,
    values: &[f64],
    (accepted, plural): (Interval, &str),
    violations: &mut Violations,
) {
    let refused = values.iter().enumerate().filter(|&(_, &value)| !accepted.contains(value));
    for (refusals, (index, &value)) in refused.enumerate() {
        if refusals == REFUSED_MAX {
            violations.add_more(field, format!("more {plural} out of range are not listed"));
            return;
        }
        violations.add(element_path(field, index), accepted.refusal(value));
    }
}

/// Records a whole number outside `accepted`, unless `field` is known to be wrong.
pub(super) fn whole(field: &str, value: u64, accepted: WholeRange, violations: &mut Violations) {
    if !known_wrong(field, violations) && !accepted.contains(value) {
        violations.add(field, accepted.refusal(&value));
    }
}

/// Returns whether `field`, something inside it, or a table around it is known to be wrong.
pub(super) fn known_wrong(field: &str, violations: &Violations) -> bool {
    let around =
        |table: &str| field.strip_prefix(table).is_some_and(|rest| rest.starts_with(['.', '[']));
    violations.has_at_or_below(field) || violations.iter().any(|violation| around(&violation.field))
}
