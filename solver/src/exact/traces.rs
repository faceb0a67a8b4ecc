//! Full pressure traces, direct wave included.

use osteon_common::bone::BoneRef;
use osteon_common::fluid_sublayers::FluidSublayer;
use osteon_common::limits::SAMPLING_PAIRS_MAX;
use osteon_common::probe::Place;
use osteon_common::sampling::{self, WaveSampling, trace_taper};
use thiserror::Error;

use crate::complex::Complex;
use crate::exact::direct;
use crate::exact::element_average::separations;
use crate::exact::fluid_spectra::FluidSpectra;
use crate::exact::plate_stack::PlateStack;
use crate::exact::response::Spectra;
use crate::exact::signal::Signal;
use crate::exact::tables::{Tables, Waves};
use crate::failure::OUT_OF_SCALE;
use crate::isa::Kernel;
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::media::Media;
use crate::solver::Solver;
use crate::vector::Vector;

/// Maximum number of pressures, all receivers together: 40 MB.
const PRESSURES_MAX: f64 = 5e6;
/// A time step that a message suggests is longer than the shortest one by this factor, because it
/// is rounded.
const TO_BE_SAFE: f64 = 1.01;

/// The pressure at every receiver as a function of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Traces {
    /// Times, s, from 0 on.
    pub times: Vec<f64>,
    /// Pressure, Pa, per receiver and time; direct wave included.
    pub pressures: Vec<Vec<f64>>,
}

/// Reason why there are no traces.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum TraceError {
    /// Duration or time step is not a positive number, or there is no step in the duration.
    #[error(
        "a trace of {duration:e} s every {time_step:e} s is not possible: --time-step must be above 0, and \
         --duration at least as long"
    )]
    Times {
        /// Duration, s.
        duration: f64,
        /// Time step, s.
        time_step: f64,
    },
    /// There would be too many samples.
    #[error(
        "traces of {duration:e} s every {time_step:e} s at {receivers} receivers are {:.1e} pressures; at most \
         5e6 are computed: give a --time-step of {:.2e} s or more, shorten --duration, or lower \
         probe.receivers.count",
        pressures(*.duration, *.time_step, *.receivers),
        TO_BE_SAFE * .duration * f64::from(*.receivers) / PRESSURES_MAX
    )]
    TooMany {
        /// Duration, s.
        duration: f64,
        /// Time step, s.
        time_step: f64,
        /// Number of receivers.
        receivers: u32,
    },
    /// The sampling is too large.
    #[error(
        "a trace of {duration:e} s needs {pairs:.1e} (frequency, wavenumber) pairs; at most 1e7 are computed: \
         shorten --duration or lower the refinement"
    )]
    TooLong {
        /// Duration, s.
        duration: f64,
        /// Number of pairs required.
        pairs: f64,
    },
    /// A pressure came out as NaN or infinite.
    #[error("a pressure came out as NaN or infinite; {OUT_OF_SCALE}")]
    NotFinite,
}

fn pressures(duration: f64, time_step: f64, receivers: u32) -> f64 {
    (duration / time_step + 1.0) * f64::from(receivers)
}

/// Kernel that computes the pressure at many times.
struct SamplePressure<'a> {
    signal: Signal<'a>,
    times: &'a [f64],
}

impl Kernel for SamplePressure<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Vec<f64> {
        let mut pressures = Vec::with_capacity(self.times.len());
        for chunk in self.times.chunks(LANES) {
            let mut times = Lanes::ZERO;
            times.0[..chunk.len()].copy_from_slice(chunk);
            pressures.extend_from_slice(&self.signal.at::<V>(&times).0[..chunk.len()]);
        }
        pressures
    }
}

impl Solver {
    /// Computes the pressure traces of one bone from 0 to `duration` (s), every `time_step` (s).
    ///
    /// They include all reflections of the outer faces. The direct wave and its image in the
    /// coupling's outer face have a closed form; the rest is computed by the exact-layer method
    /// with a separate sampling, so that traces have no influence on velocities.
    ///
    /// # Errors
    /// If the traces would be empty or too large.
    pub fn traces<'a>(
        &self,
        bone: impl Into<BoneRef<'a>>,
        duration: f64,
        time_step: f64,
    ) -> Result<Traces, TraceError> {
        self.traces_of(bone.into(), duration, time_step)
    }

    fn traces_of(
        &self,
        bone: BoneRef<'_>,
        duration: f64,
        time_step: f64,
    ) -> Result<Traces, TraceError> {
        let samples = duration / time_step;
        if !(duration > 0.0 && time_step > 0.0 && samples >= 1.0) {
            return Err(TraceError::Times { duration, time_step });
        }
        let receivers = self.setup().probe.receivers.count;
        if pressures(duration, time_step, receivers) > PRESSURES_MAX {
            return Err(TraceError::TooMany { duration, time_step, receivers });
        }
        let (mut plates, mut spectra) = (PlateStack::<11>::default(), Spectra::default());
        let media = Media::new(self.isa(), bone, self.setup().layers.bone_thickness);
        plates.fill(self.isa(), &media);
        let coupling = sampling::fastest_in_coupling(self.setup());
        let speed = sampling::fastest(self.setup(), media.fastest()).max(coupling);
        let sampling = WaveSampling::for_traces(self.setup(), speed, duration);
        let pairs = sampling.pairs(sampling.whole_band());
        if pairs > SAMPLING_PAIRS_MAX || pairs.is_nan() {
            return Err(TraceError::TooLong { duration, pairs });
        }
        let amplitude = self.setup().probe.amplitude;
        let cut = trace_taper(sampling.whole_band());
        let waves = if self.only_coupling_fluid().is_some() { Waves::All } else { Waves::Early };
        let tables = Tables::new(self.setup(), sampling, waves, amplitude, cut, None);
        let taper = tables.taper(cut);
        spectra.clear(&tables);
        spectra.fill(self.isa(), &tables, &media, &mut plates, 0..tables.lines.len());
        let times: Vec<f64> =
            (0..=(samples + 1e-9) as usize).map(|j| j as f64 * time_step).collect();
        let mut of_receivers: Vec<_> =
            (0..tables.receivers()).map(|r| spectra.receiver(r).to_vec()).collect();
        self.add_fluid_waves(&tables, &mut of_receivers);
        let pressures: Vec<Vec<f64>> = of_receivers
            .into_iter()
            .map(|mut spectrum| {
                for (run, weights) in spectrum.iter_mut().zip(&taper) {
                    run.re = run.re * *weights;
                    run.im = run.im * *weights;
                }
                let signal =
                    Signal { sampling: &tables.sampling, runs: &tables.runs, spectrum: &spectrum };
                self.isa().run(SamplePressure { signal, times: &times })
            })
            .collect();
        if pressures.iter().flatten().any(|p| !p.is_finite()) {
            return Err(TraceError::NotFinite);
        }
        Ok(Traces { times, pressures })
    }

    /// Returns the fluid above the bone if it is only one.
    fn only_coupling_fluid(&self) -> Option<FluidSublayer> {
        match self.setup().layers.coupling_fluids().as_slice() {
            [one] => Some(*one),
            _ => None,
        }
    }

    /// Adds the waves that do not meet the bone, or see no stiffness there, to the spectra of all receivers.
    fn add_fluid_waves(&self, tables: &Tables, spectra: &mut [Vec<ComplexLanes>]) {
        match self.only_coupling_fluid() {
            Some(only) => {
                let places = self.setup().probe.places();
                for (place, spectrum) in places.zip(spectra) {
                    self.add_direct_wave(&only, place, tables, spectrum);
                }
            }
            None => self.add_waves_of_stack(tables, spectra),
        }
    }

    fn add_waves_of_stack(&self, tables: &Tables, spectra: &mut [Vec<ComplexLanes>]) {
        let stack = FluidSpectra::new(self.setup());
        for (i, line) in tables.lines.iter().enumerate() {
            let waves = stack.pressures(&tables.sampling, line).into_iter();
            for (wave, spectrum) in waves.zip(&mut *spectra) {
                add(wave * line.pulse, i, spectrum);
            }
        }
    }

    /// Adds the direct wave and its image in the coupling's outer face at a receiver's place.
    fn add_direct_wave(
        &self,
        coupling: &FluidSublayer,
        place: Place,
        tables: &Tables,
        spectrum: &mut [ComplexLanes],
    ) {
        let setup = self.setup();
        let source = setup.probe.source.x3;
        let (along, upwards) = setup.probe.element_extent();
        let shortest = coupling.sound_speed / tables.sampling.whole_band();
        let travel = |x: f64, height: f64| libm::hypot(x, height) / coupling.sound_speed;
        let ways = separations(&setup.probe, shortest).into_iter().map(|(node, weight)| {
            let x = place.x + node * along;
            let direct = travel(x, place.x3 + node * upwards - source);
            (weight, direct, travel(x, 2.0 * coupling.thickness - place.x3 - source))
        });
        let ways: Vec<_> = ways.collect();
        for (i, line) in tables.lines.iter().enumerate() {
            let s = line.lossless.coupling;
            let wave = ways.iter().fold(Complex::default(), |sum, &(weight, direct, image)| {
                let wave = direct::pressure(coupling.density, direct, s)
                    - direct::pressure(coupling.density, image, s);
                sum + wave.scale(weight)
            });
            add(wave * line.pulse, i, spectrum);
        }
    }
}

/// Adds a pressure to frequency number `i` of a spectrum.
fn add(pressure: Complex, i: usize, spectrum: &mut [ComplexLanes]) {
    let run = &mut spectrum[i / LANES];
    run.re.0[i % LANES] += pressure.re;
    run.im.0[i % LANES] += pressure.im;
}

#[cfg(test)]
mod tests {
    use osteon_common::case::{Bone, Setup};
    use osteon_common::parameters::Point;
    use osteon_common::realization::Ensemble;
    use osteon_common::sampling::{Grade, OuterFaces, direct_arrival, velocity_taper};

    use super::*;
    use crate::isa::Isa;

    /// Returns the pressures at every receiver at these times before the direct wave arrives, s.
    fn pressures_before(
        setup: &Setup,
        bone: &Bone,
        waves: Waves,
        faces: OuterFaces,
        before: &[f64],
    ) -> Vec<f64> {
        let isa = Isa::fastest();
        let media = Media::new(isa, bone.into(), setup.layers.bone_thickness);
        let (mut plates, mut spectra) = (PlateStack::<11>::default(), Spectra::default());
        plates.fill(isa, &media);
        let speed = sampling::fastest(setup, media.fastest());
        let bin = sampling::speed_bin(setup, speed).unwrap();
        let sampling = WaveSampling::for_speed_bin(setup, bin, Grade::Full, faces);
        let cut = velocity_taper(sampling.whole_band());
        let tables = Tables::new(setup, sampling, waves, 1.0, cut, None);
        let taper = tables.taper(cut);
        spectra.clear(&tables);
        spectra.fill(isa, &tables, &media, &mut plates, 0..tables.lines.len());
        let receiver_pressures = |(r, place)| {
            let mut spectrum = spectra.receiver(r).to_vec();
            for (run, weights) in spectrum.iter_mut().zip(&taper) {
                run.re = run.re * *weights;
                run.im = run.im * *weights;
            }
            let signal =
                Signal { sampling: &tables.sampling, runs: &tables.runs, spectrum: &spectrum };
            let direct = direct_arrival(setup, place);
            let times: Vec<f64> = before.iter().map(|before| direct - before).collect();
            isa.run(SamplePressure { signal, times: &times })
        };
        setup.probe.places().enumerate().flat_map(receiver_pressures).collect()
    }

    /// Without and with the echoes of a thin coupling's outer face, from a level and a tilted probe, half
    /// a period before the direct wave and earlier.
    #[test]
    fn the_mirror_wave_does_not_arrive_before_the_direct_one() {
        let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.3]);
        let bone = Ensemble::new(&point, 1).unwrap().bone(0).unwrap();
        let before: Vec<f64> = (1..=8).map(|i| f64::from(i) * 0.5e-6).collect();
        for (thickness, tilt) in [(10e-3, 0.0), (3e-3, 0.0), (3e-3, 0.03)] {
            let mut setup = Setup::default();
            setup.layers.coupling.thickness = thickness;
            setup.probe.tilt = tilt;
            for faces in [OuterFaces::None, OuterFaces::Audible] {
                let pressures = |waves| pressures_before(&setup, &bone, waves, faces, &before);
                let (all, early) = (pressures(Waves::All), pressures(Waves::Early));
                let largest = all.iter().fold(0.0, |largest: f64, p| largest.max(p.abs()));
                assert!(largest > 0.0);
                for (all, early) in all.iter().zip(&early) {
                    let error = (all - early).abs() / largest;
                    assert!(error < 1e-4, "{thickness} {tilt} {faces:?}: {error:e}");
                }
            }
        }
    }
}
