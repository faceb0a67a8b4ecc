//! Rules on the solver's settings.

use crate::accepted::{Interval, WholeRange};
use crate::limits;
use crate::plausible;
use crate::settings::{Method, SolverSettings};
use crate::violations::Violations;

use super::{known_wrong, number, quantity, whole};

/// Range of `solver.element_order`.
pub(crate) const ELEMENT_ORDER: WholeRange =
    WholeRange::new(limits::ELEMENT_ORDER_MIN as u64, limits::ELEMENT_ORDER_MAX as u64);

/// Keys of `[solver]` that only the hybrid method has.
pub const HYBRID_KEYS: [&str; 3] = ["element_size", "element_order", "time_step"];

/// Returns the message that refuses one of [`HYBRID_KEYS`] with another method.
pub fn of_hybrid_only(method: Method) -> String {
    let (given, hybrid) = (method.name(), Method::Hybrid.name());
    format!(
        "belongs to the method \"{hybrid}\", and solver.method is \"{given}\"; leave it out, or set \
         solver.method = \"{hybrid}\""
    )
}

/// Records all violations of `solver`.
pub(super) fn solver(solver: &SolverSettings, violations: &mut Violations) {
    let refinement = Interval::from_to(limits::REFINEMENT_MIN, limits::REFINEMENT_MAX, "");
    number("solver.refinement", solver.refinement, refinement, violations);
    match solver.method {
        Method::Hybrid => hybrid(solver, violations),
        Method::Exact => without_hybrid(solver, violations),
    }
}

fn hybrid(solver: &SolverSettings, violations: &mut Violations) {
    let size = Interval::from_to(limits::ELEMENT_SIZE_MIN, limits::ELEMENT_SIZE_MAX, "m");
    let element_size = solver.element_size;
    quantity("solver.element_size", element_size, size, &plausible::ELEMENT_SIZE, violations);
    whole("solver.element_order", solver.element_order.into(), ELEMENT_ORDER, violations);
    if let Some(time_step) = solver.time_step {
        let accepted = Interval::above(0.0, "s");
        quantity("solver.time_step", time_step, accepted, &plausible::TIME_STEP, violations);
    }
}

/// Checks that settings of the hybrid method have their defaults with another method.
fn without_hybrid(solver: &SolverSettings, violations: &mut Violations) {
    let default = SolverSettings::default();
    let given = [
        solver.element_size != default.element_size,
        solver.element_order != default.element_order,
        solver.time_step != default.time_step,
    ];
    for (key, _) in HYBRID_KEYS.into_iter().zip(given).filter(|&(_, given)| given) {
        let field = format!("solver.{key}");
        if !known_wrong(&field, violations) {
            violations.add(field, of_hybrid_only(solver.method));
        }
    }
}
