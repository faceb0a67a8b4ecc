//! Why a case has no velocity, with the reasons that both methods share.

use osteon_common::case::Setup;
use osteon_common::outcome::FailureKind;
use osteon_common::sampling;

/// Reason why a case has no velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// Its kind.
    pub kind: FailureKind,
    /// Description as a sentence, which names the receiver where there is one.
    pub detail: String,
}

/// Refuses, before anything is computed, bones through which no wave can arrive first; `speed`
/// (m/s) is an upper bound of the speed of every wave.
pub(crate) fn check_direct_wave(setup: &Setup, speed: f64) -> Result<(), Failure> {
    for (r, place) in setup.probe.places().enumerate() {
        let x = place.x;
        let earliest = sampling::earliest_arrival(setup, place, speed);
        let direct = sampling::direct_arrival(setup, place);
        if earliest >= direct {
            return Err(Failure {
                kind: FailureKind::DirectWaveFirst,
                detail: format!(
                    "at receiver {} ({x:?} m from the source) the direct wave arrives at {} µs, a wave \
                     through the bone not before {} µs",
                    r + 1,
                    readable(direct * 1e6),
                    readable(earliest * 1e6)
                ),
            });
        }
    }
    Ok(())
}

/// Formats a number for a sentence: three decimals, or an exponent if these would all be zero.
pub(crate) fn readable(value: f64) -> String {
    if (1e-2..1e6).contains(&value.abs()) { format!("{value:.3}") } else { format!("{value:.3e}") }
}

/// Advice if a pressure is not finite.
pub(crate) const OUT_OF_SCALE: &str =
    "a number of layers, probe, density or elasticity is out of scale";

/// Returns the failure of a bone whose waves have no finite speed.
pub(crate) fn speed_not_finite() -> Failure {
    Failure {
        kind: FailureKind::NotFinite,
        detail: "the bone's wave speeds came out as NaN or infinite; density or elasticity is out of scale"
            .to_owned(),
    }
}

/// Returns the failure of a case whose pressure is not finite.
pub(crate) fn pressure_not_finite() -> Failure {
    Failure {
        kind: FailureKind::NotFinite,
        detail: format!("the pressure came out as NaN or infinite; {OUT_OF_SCALE}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_sentences_are_short() {
        for (value, expected) in [
            (14.26666, "14.267"),
            (-0.05, "-0.050"),
            (1e300, "1.000e300"),
            (6.7e-16, "6.700e-16"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(readable(value), expected);
        }
    }
}
