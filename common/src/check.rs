//! The rules for specifications, which are the same for files and for messages.
//!
//! Fields are named as in a job file, e.g. `layers.coupling.density`. A field that is already known
//! to be wrong is not checked again, nor is a relation between fields of which one is wrong.

mod job;
mod section;
mod setup;

use crate::accepted::{Interval, WholeRange};
use crate::job::JobSpecification;
use crate::plausible::PlausibleRange;
use crate::violations::Violations;

pub use self::job::{DATA_FORMS, VELOCITIES_MIN, VELOCITY, data, job, job_from, no_data};
use self::section::section;
pub use self::setup::setup;

impl JobSpecification {
    /// Returns all violations of the specification, each with its field named as in a job file.
    pub fn check(&self) -> Violations {
        let mut violations = Violations::new();
        job(self, &mut violations);
        violations
    }
}

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

/// Records a whole number outside `accepted`, unless `field` is known to be wrong.
fn whole(field: &str, value: u64, accepted: WholeRange, violations: &mut Violations) {
    if !known_wrong(field, violations) && !accepted.contains(value) {
        violations.add(field, accepted.refusal(&value));
    }
}

/// Returns whether `field`, something inside it, or a table around it is known to be wrong.
fn known_wrong(field: &str, violations: &Violations) -> bool {
    let around =
        |table: &str| field.strip_prefix(table).is_some_and(|rest| rest.starts_with(['.', '[']));
    violations.touches(field) || violations.iter().any(|violation| around(&violation.field))
}
