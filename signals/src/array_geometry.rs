//! What the picking needs of a probe: distances, time windows, criterion.

use osteon_common::case::Setup;
use osteon_common::sampling::{direct_arrival, earliest_arrival};
use osteon_common::settings::Picking;
use osteon_common::signal_layout::Transmitter;
use osteon_solver::picking::criterion;

/// Speed, m/s, above that of any wave along a bone or a plate of metal or glass: before its arrival there is
/// noise only.
const SPEED_MAX: f64 = 8000.0;

/// An array as seen from one of its sources; receivers are in the order of their distances from it.
#[derive(Debug, Clone)]
pub(crate) struct ArrayGeometry {
    /// Distances of the receivers from the source, m.
    pub(crate) distances: Vec<f64>,
    /// Earliest possible arrivals, s.
    pub(crate) earliest: Vec<f64>,
    /// Arrivals of the direct wave, s, which end the windows.
    pub(crate) direct: Vec<f64>,
    /// The criterion of the first signal, for the probe's pulse.
    pub(crate) criterion: Picking,
    /// Centre frequency, Hz.
    pub(crate) center_frequency: f64,
}

impl ArrayGeometry {
    /// Describes the array of `setup` as the source `transmitter` sees it.
    pub(crate) fn new(setup: &Setup, transmitter: Transmitter) -> Self {
        let setup = match transmitter {
            Transmitter::First => setup.clone(),
            Transmitter::Second => Setup { probe: setup.probe.from_other_side(), ..setup.clone() },
        };
        let places: Vec<_> = setup.probe.places().collect();
        Self {
            distances: setup.probe.distances().collect(),
            earliest: places.iter().map(|&p| earliest_arrival(&setup, p, SPEED_MAX)).collect(),
            direct: places.iter().map(|&p| direct_arrival(&setup, p)).collect(),
            criterion: criterion(&setup),
            center_frequency: setup.probe.center_frequency,
        }
    }
}
