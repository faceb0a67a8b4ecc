//! Difference of two solutions of one case.

use osteon_common::case::Setup;

use crate::arrival::Arrival;
use crate::failure::Failure;

/// Picked times further apart than this, in periods of the centre frequency, belong to different
/// extrema: neighbouring extrema are about half a period apart, and discretisation moves one by a
/// thousandth.
const SAME_EXTREMUM: f64 = 0.1;

/// Largest relative error of a velocity.
const ERROR_MAX: f64 = 1e-4;
/// The same in a thin plate: its first extremum lies closer to the wave of the pulse's kink.
const ERROR_MAX_THIN: f64 = 3e-4;
/// Plates of less than this thickness times centre frequency are thin, m Hz.
const THIN: f64 = 2000.0;

/// Difference of a solution from a reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Difference {
    /// Neither has a velocity, for the same reason.
    BothFailed,
    /// They picked different extrema, failed for different reasons, or only one failed.
    Picks,
    /// They picked the same extremum.
    Numbers {
        /// |V - V_ref| / V_ref.
        velocity: f64,
        /// Largest difference of a receiver's picked times, s.
        time: f64,
    },
}

impl Difference {
    /// Returns the relative difference of the velocities, if the picks are the same.
    pub fn velocity(self) -> Option<f64> {
        match self {
            Self::Numbers { velocity, .. } => Some(velocity),
            Self::BothFailed | Self::Picks => None,
        }
    }

    /// Returns the largest difference of the times, s, if the picks are the same.
    pub fn time(self) -> Option<f64> {
        match self {
            Self::Numbers { time, .. } => Some(time),
            Self::BothFailed | Self::Picks => None,
        }
    }
}

/// Returns the difference of `found` from `reference`, both for a case of `setup`.
pub fn difference(
    setup: &Setup,
    found: &Result<Arrival, Failure>,
    reference: &Result<Arrival, Failure>,
) -> Difference {
    match (found, reference) {
        (Ok(found), Ok(reference)) => of_arrivals(setup, found, reference),
        (Err(found), Err(reference)) if found.kind == reference.kind => Difference::BothFailed,
        _ => Difference::Picks,
    }
}

/// Returns the largest accepted relative error of a velocity at refinement 1, in a case of `setup`.
pub fn error_max(setup: &Setup) -> f64 {
    let product = setup.layers.bone_thickness * setup.probe.center_frequency;
    if product < THIN { ERROR_MAX_THIN } else { ERROR_MAX }
}

fn of_arrivals(setup: &Setup, found: &Arrival, reference: &Arrival) -> Difference {
    let times = found.times.iter().zip(&reference.times);
    let time = times.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    if time * setup.probe.center_frequency > SAME_EXTREMUM {
        return Difference::Picks;
    }
    let velocity = (found.velocity - reference.velocity).abs() / reference.velocity;
    Difference::Numbers { velocity, time }
}

#[cfg(test)]
mod tests {
    use osteon_common::outcome::FailureKind;

    use super::*;

    fn arrival(velocity: f64, times: [f64; 3]) -> Result<Arrival, Failure> {
        Ok(Arrival {
            velocity,
            directions: None,
            times: times.to_vec(),
            amplitudes: vec![1.0; 3],
            estimated_error: 0.0,
            passes: None,
        })
    }

    fn failure(kind: FailureKind) -> Result<Arrival, Failure> {
        Err(Failure { kind, detail: String::new() })
    }

    #[test]
    fn picks_differ_when_times_or_reasons_do() {
        let reference = arrival(4000.0, [5e-6, 6e-6, 7e-6]);
        let check = |found: &Result<Arrival, Failure>, reference, expected| {
            assert_eq!(difference(&Setup::default(), found, reference), expected, "{found:?}");
        };
        let near = arrival(4004.0, [5e-6, 6e-6, 7.05e-6]);
        let Difference::Numbers { velocity, time } =
            difference(&Setup::default(), &near, &reference)
        else {
            panic!("the picks are the same");
        };
        assert_eq!(velocity, 1e-3);
        assert!((time - 5e-8).abs() < 1e-15, "{time}");
        check(&arrival(4000.0, [5e-6, 6e-6, 7.11e-6]), &reference, Difference::Picks);
        let (none, late) = (failure(FailureKind::NoArrival), failure(FailureKind::NotFinite));
        check(&none, &reference, Difference::Picks);
        check(&reference, &none, Difference::Picks);
        check(&none, &late, Difference::Picks);
        check(&none, &none, Difference::BothFailed);
    }
}
