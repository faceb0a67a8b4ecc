//! What usual errors of a setup would move, for a result whose job does not say how well it is known.

use osteon_common::case::Setup;
use osteon_common::job::JobSpecification;
use osteon_common::parameters::Point;
use osteon_common::realization::mean_bone;
use osteon_common::settings::{Method, SolverSettings};
use osteon_common::systematic::{Shift, Systematic, SystematicQuantity, Uncertain};
use osteon_solver::{Isa, Solver, Workspace};

/// What a usual error of one quantity would move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct UsualShift {
    /// The quantity.
    pub(crate) quantity: SystematicQuantity,
    /// The value that is usually possible, in the quantity's unit: one standard deviation above the job's.
    pub(crate) value: f64,
    /// The job's value; `None` if it has none.
    pub(crate) known: Option<f64>,
    /// Change of the velocity, relative, without its sign.
    pub(crate) change: f64,
}

/// Returns what usual errors of the setup would move at a point, the largest first. The velocity is that of the
/// mean model, by the exact method: a few dozen solutions, in the time of one realization each.
pub(crate) fn usual_shifts(
    specification: &JobSpecification,
    point: &Point,
    isa: Isa,
) -> Vec<UsualShift> {
    let mut setup = point.setup(&specification.setup);
    setup.solver = SolverSettings { method: Method::Exact, ..SolverSettings::default() };
    let usual = Systematic { usual: true, ..Systematic::default() };
    let of_job = JobSpecification { systematic: usual, ..specification.clone() };
    let velocity = |setup: &Setup| -> Option<f64> {
        let bone = mean_bone(point, setup).ok()?;
        let arrival = Solver::with_isa(setup, isa).arrival(&bone, &mut Workspace::default());
        Some(arrival.ok()?.velocity)
    };
    let Some(unshifted) = velocity(&setup) else { return Vec::new() };
    let logarithm = |shift: Shift| {
        let found = velocity(&shift.quantity.with(shift.value, setup.clone()))? / unshifted;
        Some(found.ln() - shift.pitch_logarithm(&setup))
    };
    let shift = |one: Uncertain| {
        let Uncertain { quantity, below, above } = one;
        let change = match quantity {
            SystematicQuantity::VelocityOffset => above.value / unshifted,
            _ => match (below.and_then(logarithm), logarithm(above)) {
                (Some(below), Some(above)) => 0.5 * (above - below).abs(),
                (below, above) => above.or(below)?.abs(),
            },
        };
        let known = quantity.value_in(&setup);
        Some(UsualShift { quantity, value: above.value, known, change })
    };
    let mut shifts: Vec<_> = of_job.uncertain(&setup).into_iter().filter_map(shift).collect();
    shifts.sort_by(|a, b| b.change.total_cmp(&a.change));
    shifts
}
