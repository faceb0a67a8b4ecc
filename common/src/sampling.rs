//! Sampling of frequencies and wavenumbers: derived from geometry, band and the fastest wave, and
//! not tuned to one geometry.
//!
//! The method computes p̂(k, s) at s = α + i 2πn/T and k = m Δk. Summing over k repeats the source
//! along x1 with period L = 2π/Δk; summing over n repeats the signal in time with period T, the
//! repetition weakened by exp(-α T). Both repetitions are kept out of the windows that are
//! evaluated:
//!
//! - L: the wave of the nearest repeated source reaches the last receiver, at the speed for which
//!   the sampling is made, only after the first packet;
//! - T: from a receiver's earliest possible arrival on, one period includes the first packet and
//!   the large wave that the bone's face reflects: if that wrapped round, it would overlap the
//!   first arrival, which is a thousand times smaller;
//! - band: the pulse's spectrum is cut smoothly below the first of [`WaveSampling::bands`] in the
//!   first pass and, where that is not enough, below the wider ones: the same lines and more;
//! - the sum over k ends where g (x3 + x3S), g = √(k² - ω²/c1²), has damped the integrand away.
//!
//! High in the band only the tail of the pulse's kink at t = 0 remains. There a shorter period
//! suffices, so frequencies are thinned out (`thinning.rs`). The wavenumbers of the first packet
//! suffice there, too, so those of the later, slower waves are faded out smoothly.

mod arrivals;
mod crowding;
mod fluid_path;
mod thinning;

use std::f64::consts::PI;

use crate::case::Setup;
use crate::layers::Layers;
use crate::limits::SAMPLING_PAIRS_MAX;
use crate::probe::Place;
use crate::settings::Method;
use arrivals::{by_the_bone, is_audible, last_reflected_arrival, lower_echo, upper_echo};
use crowding::{SLOWNESS_FADE, SLOWNESS_START, crowding};

pub use arrivals::{
    direct_arrival, earliest_arrival, earliest_echo, echoes_are_audible, fastest,
    fastest_in_coupling, nearest_and_farthest,
};
pub use fluid_path::slowness;
pub use thinning::{FrequencyRun, RUN, smooth_step};

/// Ratio of the upper edges of neighbouring speed bins.
const SPEED_BIN_RATIO: f64 = 1.05;
/// Number of speed bins: the last edge is 270 times the first.
pub const SPEED_BINS: usize = 116;
/// Fraction of a speed bin's highest speed over which it is blended into the next.
const SPEED_BIN_OVERLAP: f64 = 5e-4;
/// Speed, m/s, for which a setup's sampling is sized before any bone is known: the usual upper
/// limit of speeds in cortical bone.
const NOMINAL_SPEED: f64 = 4000.0;
/// Plates thinner than this many millimetres at 1 MHz (m·Hz) need a wider band: the first extremum
/// lies closer to the wave of the pulse's kink at t = 0, whose spectrum falls slowly.
const THIN_PLATE: f64 = 2000.0;
/// The band grows as this power of the thinness.
const THIN_PLATE_POWER: f64 = 1.6;
/// Largest widening of the band for a thin plate.
const THIN_PLATE_MAX: f64 = 3.0;
/// Maximum number of bands in which a bone is computed with one sampling.
pub const BANDS: usize = 4;
/// Ratio of the highest frequency of traces to the centre frequency: a trace is accurate to 1e-3 of
/// its largest value.
const TRACE_BAND: f64 = 12.0;
/// Where the taper of a trace starts, as a fraction of the band.
const TRACE_TAPER_START: f64 = 0.4;
/// Where the taper of a velocity starts, as a fraction of the band.
const TAPER_START: f64 = 0.5;
/// α T: a wave that wraps round is weakened by exp(-this). Truncation errors grow as e^(αt), so a
/// larger value needs more wavenumbers.
const WRAP_DAMPING: f64 = 12.0;
/// The same of the plain grade.
const PLAIN_DAMPING: f64 = 15.0;
/// The same of the thorough grade, at refinement 1, where a weak arrival may precede large waves that
/// last long.
const THOROUGH_DAMPING: f64 = 16.0;
/// Largest difference of α t, where an extremum is picked, from α T.
const GROWTH_MARGIN: f64 = 1.5;
/// Latest time of an extremum that a quick sampling is made for, after the earliest possible arrival,
/// in periods of the centre frequency.
pub const QUICK_LATEST: f64 = 1.4;
/// Shortest period, in periods of the centre frequency.
const SHORTEST_PERIOD: f64 = 6.0;
/// Period, in periods of the centre frequency, from which the thinning of frequencies removes those
/// that are not needed high in the band; a shorter period is thinned higher up.
const THINNED_PERIOD: f64 = 8.0;
/// Difference, from α T, of the exponent at which the sum over wavenumbers ends.
const EVANESCENCE: f64 = 6.5;
/// The same of the plain grade.
const PLAIN_EVANESCENCE: f64 = 9.0;
/// The same of the thorough grade, at refinement 1: what is cut off there grows as e^(αt), and may be
/// large compared with an attenuated arrival.
const THOROUGH_EVANESCENCE: f64 = 12.0;
/// Frequencies whose weight is below this are left out.
const TAPER_MIN: f64 = 1e-9;
/// The period of the thorough grade grows as this power of the refinement.
const PERIOD_POWER: f64 = 0.25;
/// Ratio of the period to the time that it must include.
const PERIOD_MARGIN: f64 = 1.03;
/// The same ratio for traces.
const TRACE_MARGIN: f64 = 1.15;
/// Frequencies, as multiples of the centre frequency, between which the sum over wavenumbers
/// narrows from all waves to those of the first packet.
const SLOW_WAVES_END: (f64, f64) = (3.5, 4.0);

/// Grade of a sampling: the kind of bone for which it suffices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grade {
    /// Sufficient for most bones.
    Quick,
    /// The same with thinning of frequencies, and slow waves left out, only where the thorough grade
    /// does it, too: for bones whose first arrival is small compared to the later waves.
    Plain,
    /// For bones whose first arrival is weak or slow, or close to later ones: from the second band
    /// on, with a period and length that include the whole window before the direct wave.
    Thorough,
    /// The same with nothing thinned out or left out.
    Full,
}

/// The outer faces of the fluids that a sampling includes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OuterFaces {
    /// None: the fluids have no end, which changes nothing before [`earliest_echo`].
    None,
    /// Those whose reflections can arrive inside a window.
    Audible,
}

/// Sampling of one setup for waves up to one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveSampling {
    /// How fine it is.
    pub grade: Grade,
    /// No wave along x1 is faster, m/s.
    pub speed: f64,
    /// T, s.
    pub period: f64,
    /// 2π/T, rad/s.
    pub frequency_step: f64,
    /// α, 1/s.
    pub damping: f64,
    /// Highest frequencies of the passes, Hz, ascending; a band equal to the one before is not
    /// computed again.
    pub bands: [f64; BANDS],
    /// Δk, rad/m.
    pub wavenumber_step: f64,
    /// √(k² - (ω/c1)²), with the slowest c1 that is crossed, at which the sum over wavenumbers ends, rad/m.
    pub evanescent_limit: f64,
    /// Whether reflections of the coupling's outer face can arrive inside a window.
    pub upper_echoes: bool,
    /// Whether reflections of the marrow's outer face can arrive inside a window.
    pub lower_echoes: bool,
    sound_speed: f64,
    /// Frequency that replaces the centre frequency where the top of the band is sampled more
    /// coarsely, Hz; infinite if it is not.
    unit: f64,
}

/// Returns the quick sampling of a setup at the usual speeds of bone.
pub fn nominal(setup: &Setup) -> WaveSampling {
    let Layers { coupling, marrow, .. } = &setup.layers;
    let fluids = coupling.fastest().max(marrow.fastest());
    let speed = fastest(setup, NOMINAL_SPEED).max(1.2 * fluids);
    let bin = speed_bin(setup, speed).unwrap_or(SPEED_BINS - 1);
    WaveSampling::for_speed_bin(setup, bin, first_grade(setup), OuterFaces::None)
}

/// The exact method's sampling for the waves of the usual bone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NominalSampling {
    /// Highest frequency, Hz.
    pub band: f64,
    /// Period, s.
    pub period: f64,
    /// Number of (frequency, wavenumber) pairs.
    pub pairs: u64,
}

impl NominalSampling {
    /// Returns the sampling of a setup; `None` for methods other than the exact one.
    pub fn from_setup(setup: &Setup) -> Option<Self> {
        match setup.solver.method {
            Method::Exact => {
                let sampling = nominal(setup);
                let band = sampling.first_band();
                let pairs = sampling.pairs(band).round() as u64;
                Some(Self { band, period: sampling.period, pairs })
            }
            Method::Hybrid => None,
        }
    }
}

/// Returns the grade with which a bone is first computed.
///
/// Above refinement 1 there is only one grade.
pub fn first_grade(setup: &Setup) -> Grade {
    if setup.solver.refinement > 1.0 { Grade::Thorough } else { Grade::Quick }
}

/// Returns the number of (frequency, wavenumber) pairs of one realization for which the first pass
/// is sufficient, at the usual speeds of bone.
pub fn pair_count(setup: &Setup) -> f64 {
    let sampling = nominal(setup);
    sampling.pairs(sampling.first_band())
}

/// Returns the lowest speed bin whose upper edge is at least `speed` (m/s); `None` above all bins,
/// or if `speed` is not finite.
pub fn speed_bin(setup: &Setup, speed: f64) -> Option<usize> {
    let mut top = first_bin_edge(setup);
    for bin in 0..SPEED_BINS {
        if speed <= top {
            return Some(bin);
        }
        top *= SPEED_BIN_RATIO;
    }
    None
}

/// Returns the weight of the next speed bin's result in the velocity of a bone with this speed
/// (m/s): 0 up to shortly below the upper edge of its own bin, 1 at the edge, linear between. The
/// results of two neighbouring speed bins differ slightly; near the edge they are blended.
pub fn next_bin_weight(setup: &Setup, bin: usize, speed: f64) -> f64 {
    let edge = speed_bin_edge(setup, bin);
    ((speed / edge - (1.0 - SPEED_BIN_OVERLAP)) / SPEED_BIN_OVERLAP).clamp(0.0, 1.0)
}

/// Returns the highest speed of a speed bin, m/s.
pub fn speed_bin_edge(setup: &Setup, bin: usize) -> f64 {
    (0..bin).fold(first_bin_edge(setup), |speed, _| speed * SPEED_BIN_RATIO)
}

impl WaveSampling {
    /// Returns the sampling for picking velocities of bones whose waves are no faster than the
    /// speed bin's speed.
    pub fn for_speed_bin(setup: &Setup, bin: usize, grade: Grade, faces: OuterFaces) -> Self {
        let speed = speed_bin_edge(setup, bin);
        let (fc, pulse) = (setup.probe.center_frequency, &setup.probe.pulse);
        // All in periods, for the paper's pulse: length of the reflected wave; latest time of a picked
        // extremum after the earliest possible arrival; latest time for which the wave of a repeated source
        // must be kept out.
        let (reflected_length, latest_pick, latest_source) = match grade {
            Grade::Quick | Grade::Plain => (1.0, QUICK_LATEST, QUICK_LATEST),
            Grade::Thorough | Grade::Full => (4.0, 2.5, f64::INFINITY),
        };
        let reflected_length = reflected_length + pulse.lateness(fc);
        let (latest_pick, latest_source) =
            (latest_pick + pulse.delay(fc), latest_source + pulse.delay(fc));
        let damping = wrap_damping(setup, grade);
        let mut longest = (SHORTEST_PERIOD + pulse.lateness(fc)) / fc;
        let mut last = 0.0_f64;
        for place in setup.probe.places() {
            let earliest = earliest_arrival(setup, place, speed);
            let direct = direct_arrival(setup, place);
            let reflected = last_reflected_arrival(setup, place) + reflected_length / fc;
            let pick = direct.min(earliest + latest_pick / fc);
            longest = longest
                .max(PERIOD_MARGIN * (reflected - earliest))
                .max(pick * damping / (damping + GROWTH_MARGIN));
            last = last.max(direct.min(earliest + latest_source / fc));
        }
        if matches!(grade, Grade::Thorough | Grade::Full) {
            // Finer samplings also have room for waves that arrive later.
            longest *= libm::pow(setup.solver.refinement.max(1.0), PERIOD_POWER);
        }
        let mut sampling = Self::new(setup, grade, damping, speed, longest, last);
        if faces == OuterFaces::Audible {
            sampling.upper_echoes = is_audible(setup, speed, upper_echo);
            sampling.lower_echoes = is_audible(setup, speed, lower_echo);
        }
        sampling
    }

    /// Returns the sampling for traces from 0 to `duration` (s) of bones whose waves are no faster
    /// than `speed` (m/s).
    pub fn for_traces(setup: &Setup, speed: f64, duration: f64) -> Self {
        let unit = setup.probe.band_unit();
        let period = TRACE_MARGIN * duration;
        let mut sampling = Self::new(setup, Grade::Thorough, WRAP_DAMPING, speed, period, duration);
        sampling.bands = [TRACE_BAND * setup.solver.refinement * thinness(setup) * unit; BANDS];
        sampling.upper_echoes = true;
        sampling.lower_echoes = true;
        sampling.unit = f64::INFINITY;
        sampling
    }

    fn new(setup: &Setup, grade: Grade, damping: f64, speed: f64, period: f64, last: f64) -> Self {
        let refinement = setup.solver.refinement;
        let lowest = setup.probe.lowest_receiver();
        let (_, upwards) = setup.probe.element_extent();
        let heights = lowest + setup.probe.source.x3 - upwards.abs();
        let (_, farthest) = nearest_and_farthest(setup);
        let fc = setup.probe.center_frequency;
        let band_unit = setup.probe.band_unit();
        let bands = relative_bands(grade, refinement, thinness(setup));
        let unit = match grade {
            Grade::Quick => thinness(setup).min(1.4),
            Grade::Plain => 1.6,
            Grade::Thorough => 1.5 * refinement.max(2.0),
            Grade::Full => f64::INFINITY,
        };
        let evanescence = match grade {
            Grade::Quick => EVANESCENCE,
            Grade::Plain => PLAIN_EVANESCENCE,
            // Finer sampling is also less truncated, slowly.
            Grade::Thorough | Grade::Full => {
                THOROUGH_EVANESCENCE + 2.0 * libm::log(refinement.max(1.0))
            }
        };
        let unit = unit * crowding(setup, speed) * (THINNED_PERIOD / (period * fc)).max(1.0);
        let through_fluid = earliest_arrival(setup, Place { x: 0.0, x3: lowest }, speed);
        let length = farthest + speed * (last - through_fluid).max(0.0) + heights;
        Self {
            grade,
            speed,
            period,
            frequency_step: 2.0 * PI / period,
            damping: damping / period,
            bands: bands.map(|band| band * band_unit),
            wavenumber_step: 2.0 * PI / length,
            evanescent_limit: (damping + evanescence) / heights,
            upper_echoes: false,
            lower_echoes: false,
            sound_speed: by_the_bone(setup).slowest(),
            unit: unit * band_unit,
        }
    }

    /// Returns the highest frequency of the first pass, Hz.
    pub fn first_band(&self) -> f64 {
        self.bands[0]
    }

    /// Returns the highest frequency of all, Hz.
    pub fn whole_band(&self) -> f64 {
        self.bands[BANDS - 1]
    }

    /// Returns the number of frequencies below the whole band's end, n = 0 … this - 1; [`WaveSampling::runs`]
    /// lists those that are computed.
    pub fn frequencies(&self) -> usize {
        // The taper vanishes at the band's end.
        (self.whole_band() * self.period).ceil() as usize
    }

    /// Returns the angular frequency of sample `n`, rad/s.
    pub fn angular_frequency(&self, n: usize) -> f64 {
        n as f64 * self.frequency_step
    }

    /// Returns the number of wavenumbers at frequency `n`, m = 0 … this - 1: a multiple of [`RUN`].
    pub fn wavenumbers(&self, n: usize) -> usize {
        ((self.fading(n).1 / self.wavenumber_step) as usize + 1).next_multiple_of(RUN)
    }

    /// Returns the smooth weight of wavenumber `k` (rad/m) at frequency `n`: 1 except where slow
    /// waves are left out.
    pub fn wavenumber_weight(&self, n: usize, k: f64) -> f64 {
        let (start, end) = self.fading(n);
        if start < end { smooth_step((end - k) / (end - start)) } else { 1.0 }
    }

    /// Returns the smooth weight of frequency `n` that cuts the band: 1 up to `start` Hz, 0 from
    /// `end` Hz on.
    pub fn taper(&self, n: usize, (start, end): (f64, f64)) -> f64 {
        smooth_step((end - n as f64 / self.period) / (end - start))
    }

    /// Returns whether frequency `n` contributes to a signal whose band is cut by a taper.
    pub fn is_within(&self, n: usize, taper: (f64, f64)) -> bool {
        self.share(n) > 0.0 && self.taper(n, taper) > TAPER_MIN
    }

    /// Returns the wavenumbers, rad/m, at which the sum at frequency `n` begins to fade and ends.
    fn fading(&self, n: usize) -> (f64, f64) {
        let omega = self.angular_frequency(n);
        let all = self.last_wavenumber(omega);
        let start = SLOWNESS_START * self.sound_speed / self.speed;
        let end = start + SLOWNESS_FADE;
        if end >= 1.0 {
            return (all, all);
        }
        let (from, to) = (SLOW_WAVES_END.0 * self.unit, SLOW_WAVES_END.1 * self.unit);
        let frequency = n as f64 / self.period;
        if frequency <= from {
            return (all, all);
        }
        let kept = (end * omega / self.sound_speed).max(self.last_wavenumber(2.0 * PI * from));
        let limit = all.min(kept);
        let fade = smooth_step((frequency - from) / (to - from));
        (limit * (1.0 - (1.0 - start / end) * fade), limit)
    }

    /// Returns the wavenumber at which g (x3 + x3S) has damped the integrand away, rad/m.
    fn last_wavenumber(&self, omega: f64) -> f64 {
        let propagating = omega / self.sound_speed;
        propagating.mul_add(propagating, self.evanescent_limit * self.evanescent_limit).sqrt()
    }

    /// Returns the number of (frequency, wavenumber) pairs up to `band` (Hz). If there are very
    /// many, it is estimated from above without a loop over frequencies.
    pub fn pairs(&self, band: f64) -> f64 {
        let frequencies = band * self.period;
        let highest = 2.0 * PI * band / self.sound_speed;
        let per_frequency = (0.5 * highest + self.evanescent_limit) / self.wavenumber_step;
        if frequencies * per_frequency > 20.0 * SAMPLING_PAIRS_MAX || frequencies.is_nan() {
            return frequencies * per_frequency;
        }
        let runs = self.runs();
        let computed = runs.iter().flat_map(|run| run.frequencies());
        computed
            .filter(|&n| self.is_within(n, velocity_taper(band)))
            .map(|n| self.wavenumbers(n) as f64)
            .sum()
    }
}

/// Returns the highest frequency of the last passes of a grade, Hz.
pub fn widest_band(setup: &Setup, grade: Grade) -> f64 {
    let [.., last] = relative_bands(grade, setup.solver.refinement, thinness(setup));
    last * setup.probe.band_unit()
}

/// Returns the highest frequencies of the passes, as multiples of the centre frequency.
fn relative_bands(grade: Grade, refinement: f64, thinness: f64) -> [f64; BANDS] {
    let wide = (10.5 * thinness).min(24.0);
    // At refinement 1 thinning leaves too few frequencies farther up for the echoes in a thin plate.
    let widest = if refinement > 1.0 { 4.0 * wide } else { (4.0 * wide).min(48.0) };
    match grade {
        // Too much is thinned out of a quick sampling for a still wider band to help.
        Grade::Quick => [5.25 * thinness, wide, 2.0 * wide, 2.0 * wide].map(|f| f * refinement),
        Grade::Plain => [5.25 * thinness, wide, 2.0 * wide, widest].map(|f| f * refinement),
        Grade::Thorough => [wide, 2.0 * wide, widest, widest].map(|f| f * refinement.sqrt()),
        // Without thinning, a band of twice the width costs four times as much.
        Grade::Full => [wide, 2.0 * wide, 2.0 * wide, 2.0 * wide].map(|f| f * refinement.sqrt()),
    }
}

/// Returns the taper that cuts a velocity's band, given its end: start and end, Hz.
pub fn velocity_taper(band: f64) -> (f64, f64) {
    (TAPER_START * band, band)
}

/// Returns the taper that cuts a trace's band, given its end: start and end, Hz.
pub fn trace_taper(band: f64) -> (f64, f64) {
    (TRACE_TAPER_START * band, band)
}

/// Returns how much wider the band must be than that of a thick plate.
pub fn thinness(setup: &Setup) -> f64 {
    let product = setup.layers.bone_thickness * setup.probe.center_frequency;
    libm::pow((THIN_PLATE / product).max(1.0), THIN_PLATE_POWER).min(THIN_PLATE_MAX)
}

/// Speed of the lowest speed bin, m/s: waves no faster than the coupling fluid never arrive first.
fn first_bin_edge(setup: &Setup) -> f64 {
    setup.layers.coupling.fastest() * SPEED_BIN_RATIO
}

/// Returns α T.
fn wrap_damping(setup: &Setup, grade: Grade) -> f64 {
    match grade {
        Grade::Quick => WRAP_DAMPING,
        Grade::Plain => PLAIN_DAMPING,
        Grade::Thorough | Grade::Full => {
            THOROUGH_DAMPING + 2.0 * libm::log(setup.solver.refinement.max(1.0))
        }
    }
}

#[cfg(test)]
mod tests;
