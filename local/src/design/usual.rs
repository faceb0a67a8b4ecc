//! The measurements that are compared if none is named.

use osteon_common::case::Setup;
use osteon_common::observables::Observable;
use osteon_common::parameters::Parameter;

use super::measurement::{Accuracy, Measurement};
use super::prediction::DesignRequest;
use super::responses::Unknown;
use super::study::VELOCITIES;

/// By how much more velocities are compared.
const MORE: u64 = 4;
/// The other height of the probe, in parts of its own. Much higher, the direct wave comes first.
const HIGHER: f64 = 1.5;
/// Accuracies of the means of observables.
const OBSERVABLES: [(Observable, f64); 3] =
    [(Observable::A0Velocity, 0.01), (Observable::S0Velocity, 0.01), (Observable::Decay, 0.07)];
/// Accuracies of parameters that other methods measure.
const PARAMETERS: [(Parameter, f64); 5] = [
    (Parameter::Density, 0.02),
    (Parameter::BoneThickness, 0.05),
    (Parameter::Porosity, 0.1),
    (Parameter::SurfacePorosity, 0.1),
    (Parameter::MarrowPorosity, 0.1),
];
/// Part of its present standard deviation to which an uncertain quantity of the setup is measured.
const OF_SETUP: f64 = 0.25;

/// Returns the usual measurements.
pub(super) fn usual(
    request: &DesignRequest<'_>,
    setup: &Setup,
    unknowns: &[Unknown],
) -> Vec<Measurement> {
    let data = request.specification.data.as_ref();
    let count = request.velocities.or_else(|| data?.count(request.set)).unwrap_or(VELOCITIES);
    let mut usual = vec![Measurement::Velocities(MORE * count)];
    if !setup.probe.bidirectional {
        usual.push(Measurement::BothDirections);
    }
    usual.push(Measurement::Frequency(0.5 * setup.probe.center_frequency));
    usual.push(Measurement::Height(HIGHER * setup.probe.receivers.x3));
    usual.extend(OBSERVABLES.map(|(one, part)| Measurement::Mean(one, Accuracy::Relative(part))));
    for unknown in unknowns {
        match unknown {
            Unknown::Searched(parameter, _) => {
                let known = PARAMETERS.iter().find(|(one, _)| one == parameter);
                let accuracy = known.map(|(_, part)| Accuracy::Relative(*part));
                usual.extend(accuracy.map(|one| Measurement::Searched(*parameter, one)));
            }
            Unknown::OfSetup(uncertain) => {
                let quantity = uncertain.quantity;
                let accuracy = match quantity.value_in(setup) {
                    Some(value) => {
                        Accuracy::Absolute(OF_SETUP * (uncertain.above.value - value).abs())
                    }
                    None => Accuracy::Relative(OF_SETUP),
                };
                usual.push(Measurement::OfSetup(quantity, accuracy));
            }
        }
    }
    usual
}
