//! Finds all wavenumbers at which the waves of a family have one frequency.
//!
//! The count of waves below the frequency is exact at each wavenumber, and changes where a wave has this
//! frequency. An interval is given up only when no wave can have it there: as the equations of motion are a
//! symmetric hyperbolic system, no frequency ω(k) changes faster than the speed c of the fastest front, so
//! that a wave between a and b whose frequency is ω has one within ω ± c (b - a)/2 at the middle. Other
//! intervals are halved down to the resolution. So a wave whose frequency has a maximum or minimum between
//! two wavenumbers is found on both sides of it.

use super::family::Family;
use super::free_bone::{FreeBone, bisect};

/// Width of the narrowest intervals, as a part of the least possible wavenumber ω/c. Two wavenumbers of one
/// wave that lie closer together, beside one without group velocity, are not told apart.
const RESOLUTION: f64 = 1e-6;
/// Maximum number of intervals. A thousand waves need some hundred each.
const INTERVALS_MAX: usize = 1 << 21;
/// The reach of an interval is taken larger by this, for rounding.
const WIDER: f64 = 1.0 + 1e-9;

/// A wave of a family at the frequency that is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// Wavenumber, rad/m.
    pub(super) k: f64,
    /// Place of the wave, from 1, in the order of the family's frequencies at this wavenumber.
    pub(super) rank: u64,
}

/// Wavenumbers with the number of waves below the frequency at both.
#[derive(Debug, Clone, Copy)]
struct WavenumberInterval {
    /// Lower and upper wavenumber, rad/m.
    ends: [f64; 2],
    counts: [u64; 2],
}

/// Returns all waves of a family at `omega` (rad/s) with wavenumbers between these (rad/m), in ascending
/// order; `None` if a number is not finite, or if the waves have too many turning points.
pub(super) fn crossings(
    bone: &mut FreeBone,
    family: &Family,
    omega: f64,
    ends: [f64; 2],
) -> Option<Vec<Crossing>> {
    let resolution = RESOLUTION * omega / bone.fastest;
    let counts = [bone.count(family, ends[0], omega)?, bone.count(family, ends[1], omega)?];
    let (mut found, mut left) = (Vec::new(), vec![WavenumberInterval { ends, counts }]);
    for _ in 0..INTERVALS_MAX {
        let Some(WavenumberInterval { ends: [low, high], counts }) = left.pop() else {
            return Some(found);
        };
        if high - low <= resolution {
            let (least, most) = (counts[0].min(counts[1]), counts[0].max(counts[1]));
            let rises = counts[0] > counts[1];
            for rank in least + 1..=most {
                let is_beyond =
                    |k| bone.count(family, k, omega).map(|count| (count < rank) == rises);
                found.push(Crossing { k: bisect((low, high), is_beyond)?, rank });
            }
            continue;
        }
        let middle = 0.5 * (low + high);
        let reach = WIDER * bone.fastest * 0.5 * (high - low);
        let below = if omega > reach { bone.count(family, middle, omega - reach)? } else { 0 };
        if bone.count(family, middle, omega + reach)? == below {
            continue;
        }
        let count = bone.count(family, middle, omega)?;
        left.push(WavenumberInterval { ends: [middle, high], counts: [count, counts[1]] });
        left.push(WavenumberInterval { ends: [low, middle], counts: [counts[0], count] });
    }
    None
}
