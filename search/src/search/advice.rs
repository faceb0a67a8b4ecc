//! Advice on what to change if no point has enough velocities.

use osteon_common::job::JobSpecification;
use osteon_common::outcome::FailureKind;
use osteon_common::results::Evaluation;
use osteon_common::settings::Method;
use osteon_common::warnings;

/// If at least this fraction of the realizations fails in the same way, neither more accuracy nor a
/// larger failure limit helps: the cause lies in layers, probe or parameters.
const SAME_WAY: f64 = 0.9;
/// Maximum number of unusual values of the specification that are listed.
const UNUSUAL_MAX: usize = 3;

/// Returns advice for a search whose first evaluation was `row`.
pub(super) fn after_failures(row: &Evaluation, specification: &JobSpecification) -> String {
    let realizations = specification.monte_carlo.realizations as f64;
    let all_alike = row.failures.iter().find(|&(_, count)| count as f64 >= SAME_WAY * realizations);
    let Some((kind, _)) = all_alike else {
        return "change the starts of [parameters], or allow a larger [monte_carlo] \
                max_failed_fraction"
            .to_owned();
    };
    let cause = likely_cause(kind, specification.setup.solver.method);
    let warnings = warnings::job_warnings(specification);
    let unusual: Vec<String> =
        warnings.iter().take(UNUSUAL_MAX).map(|warning| format!("; {warning}")).collect();
    format!("{cause}{}", unusual.concat())
}

/// Returns the probable cause if nearly all realizations fail in this way.
fn likely_cause(kind: FailureKind, method: Method) -> &'static str {
    match (kind, method) {
        (FailureKind::DirectWaveFirst, _) => {
            "such a bone is too slow for this probe: the wave through the coupling arrives first. Check \
             the moduli and the density of [parameters], layers.coupling.sound_speed, and the heights \
             and distances of [probe]"
        }
        (FailureKind::NoArrival, _) => {
            "no wave through such a bone is seen before the one through the coupling. Check the moduli \
             and the density of [parameters], layers.bone.thickness, and frequency, heights and \
             distances of [probe]"
        }
        (FailureKind::InconsistentArrival, _) => {
            "the receivers see different waves first. Check pitch and distances of probe.receivers \
             against the wavelength, layers.bone.thickness, and the starts of [parameters]"
        }
        (FailureKind::NotFinite, _) => {
            "a number of [layers], [probe] or [parameters] is out of scale. Check their units"
        }
        (FailureKind::NoConvergence, Method::Exact) => {
            "the solver would need too many frequencies and wavenumbers. Check the units of [layers], \
             [probe] and [parameters], or lower probe.center_frequency or [solver] refinement"
        }
        (FailureKind::NoConvergence, Method::Hybrid) => {
            "the solver's time step is too long, or its mesh too large. Leave out solver.time_step, or \
             give a larger solver.element_size"
        }
    }
}
