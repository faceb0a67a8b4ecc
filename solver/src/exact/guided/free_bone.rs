//! A bone whose waves are counted: with free faces, or between fluids.

use osteon_common::fluid_sublayers::FluidSublayer;

use super::count::CountWaves;
use super::family::{Family, Symmetry};
use super::stack::FreeStack;
use crate::exact::plate::{AccuratePlate, Fill};
use crate::isa::Isa;
use crate::media::{Media, MediumLayer};
use crate::medium::Medium;

/// Ratio of neighbouring wavenumbers of the search.
const SEARCH_STEP: f64 = 1.02;
/// Maximum number of steps of the search: wavenumbers of 10⁸ times the least one.
const SEARCH_STEPS_MAX: usize = 1000;
/// The search begins with this part of the least possible wavenumber, for rounding.
const BELOW_LEAST: f64 = 1.0 - 1e-9;
/// Number of halvings of an interval: the width of the first one divided by 2⁵⁰ is below rounding.
const HALVINGS: usize = 50;
/// The group velocity is the difference quotient over this part of the wavenumber in both directions.
const GROUP_STEP: f64 = 1e-4;
/// If a count is undecided because a pivot is exactly zero, it is repeated at the wavenumber times one of these.
/// In a thin plate a larger step is needed: the pivot of a wave of extension or shear is (kh)² times the change.
const BESIDE: [f64; 4] = [1.0 + 1e-13, 1.0 + 1e-11, 1.0 + 1e-9, 1.0 + 1e-7];

/// One guided wave at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuidedWave {
    /// Phase velocity ω/k, m/s.
    pub phase_velocity: f64,
    /// Group velocity dω/dk, m/s.
    pub group_velocity: f64,
}

/// A bone with free faces.
pub(super) struct FreeBone {
    counter: WaveCounter,
    /// Bound of the speed of a wave without cut-off frequency, and of every group velocity, m/s.
    pub(super) fastest: f64,
    /// Thickness, m.
    pub(super) thickness: f64,
}

/// Counts the guided waves of a bone below a frequency.
enum WaveCounter {
    Plate { isa: Isa, plate: Box<(Medium, AccuratePlate)> },
    Stack(FreeStack),
}

impl FreeBone {
    pub(super) fn new(isa: Isa, media: &Media, symmetry: Symmetry) -> Self {
        let counter = if media.lower.is_empty() {
            let MediumLayer { medium, thickness } = media.uppermost.clone();
            let mut plate = Box::new((medium, AccuratePlate::default()));
            let (medium, filled) = &mut *plate;
            isa.run(Fill { medium, thickness, doublings_min: 1, plate: filled });
            WaveCounter::Plate { isa, plate }
        } else {
            WaveCounter::Stack(FreeStack::new(isa, media, symmetry.halves()))
        };
        let thickness = media.iter().fold(0.0, |sum, layer| sum + layer.thickness);
        Self { counter, fastest: media.fastest(), thickness }
    }

    /// Creates a bone between fluids, which reach far.
    pub(super) fn between(isa: Isa, media: &Media, fluids: [FluidSublayer; 2]) -> Self {
        let slowest = fluids[0].sound_speed.min(fluids[1].sound_speed);
        let thickness = media.iter().fold(0.0, |sum, layer| sum + layer.thickness);
        let counter = WaveCounter::Stack(FreeStack::between(isa, media, fluids));
        // Faster waves radiate, and have no real wavenumbers.
        Self { counter, fastest: slowest.min(media.fastest()), thickness }
    }

    /// Returns the wave of this rank in a family at `omega`, rad/s: the first wavenumber at which its
    /// frequency, which rises from zero, is `omega`. `None` if its product with the thickness is below
    /// `thinnest`.
    pub(super) fn wave(
        &mut self,
        family: &Family,
        rank: u64,
        omega: f64,
        thinnest: f64,
    ) -> Option<GuidedWave> {
        // No wave that has no cut-off frequency is faster: the displacement that is the same at all
        // depths bounds its frequency from above.
        let mut low = BELOW_LEAST * omega / self.fastest;
        let mut high = low;
        for step in 0.. {
            if step == SEARCH_STEPS_MAX {
                return None;
            }
            high *= SEARCH_STEP;
            if self.count(family, high, omega)? < rank {
                break;
            }
            low = high;
        }
        let k = bisect((low, high), |k| Some(self.count(family, k, omega)? < rank))?;
        if k * self.thickness < thinnest {
            return None;
        }
        let group_velocity = self.group_velocity(family, rank, k, omega)?;
        Some(GuidedWave { phase_velocity: omega / k, group_velocity })
    }

    /// Returns the group velocity (m/s) of the wave of this rank in a family, whose frequency at `k` (rad/m) is
    /// `omega` (rad/s).
    pub(super) fn group_velocity(
        &mut self,
        family: &Family,
        rank: u64,
        k: f64,
        omega: f64,
    ) -> Option<f64> {
        let step = GROUP_STEP * k;
        let reach = 2.0 * self.fastest * step;
        let mut at = |k: f64| {
            let range = (omega - reach, omega + reach);
            bisect(range, |omega| Some(self.count(family, k, omega)? >= rank))
        };
        let difference = at(k + step)? - at(k - step)?;
        Some(difference / (2.0 * step))
    }

    /// Returns the number of waves of a family whose frequency at `k` (rad/m) is below `omega` (rad/s);
    /// `None` if a number is not finite.
    pub(super) fn count(&mut self, family: &Family, k: f64, omega: f64) -> Option<u64> {
        let mut at = |k: f64| match &mut self.counter {
            WaveCounter::Plate { isa, plate } => {
                let (medium, plate) = &mut **plate;
                isa.run(CountWaves { medium, plate, family, k, omega })
            }
            WaveCounter::Stack(stack) => stack.count(family, k, omega),
        };
        at(k).or_else(|| BESIDE.into_iter().find_map(|factor| at(factor * k)))
    }
}

/// Returns where a condition begins to hold, by halving a range at the end of which it holds.
pub(super) fn bisect(
    (mut low, mut high): (f64, f64),
    mut holds: impl FnMut(f64) -> Option<bool>,
) -> Option<f64> {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(0.5 * (low + high))
}
