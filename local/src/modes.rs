//! The guided waves of a case's bone at several frequencies.

use std::fmt::Write as _;

use osteon_common::case::Case;
use osteon_solver::{FluidModes, Isa, Mode, ModesError, Solver};
use rayon::ThreadPoolBuildError;
use rayon::prelude::*;
use thiserror::Error;

/// What is on both sides of a bone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoneSurroundings {
    /// Nothing; the bone has no attenuation, either.
    Vacuum,
    /// Coupling and marrow as half-spaces; all layers have the attenuation of their case.
    Fluids,
}

/// Decibels per centimetre of one neper per metre: 20 log10(e) / 100.
const DB_PER_CM: f64 = 0.086_858_896_380_650_36;

/// The guided waves of a bone at each of some frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct BandModes {
    /// What is on both sides of the bone.
    pub surroundings: BoneSurroundings,
    /// The frequencies, Hz, with their waves by ascending phase velocity.
    pub frequencies: Vec<(f64, FluidModes)>,
}

/// A wave over the frequencies at which it propagates.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveRange {
    /// Its name, or family and rank.
    pub label: String,
    /// Lowest frequency, Hz, with its phase velocity there, m/s.
    pub first: [f64; 2],
    /// The same of the highest frequency.
    pub last: [f64; 2],
    /// Number of frequencies at which it is a backward wave.
    pub backward: usize,
}

/// Why guided waves are not known.
#[derive(Debug, Error)]
pub enum BandModesError {
    /// The bone has none that can be stated at a frequency.
    #[error(transparent)]
    Modes(#[from] ModesError),
    /// No threads can be started.
    #[error(transparent)]
    Threads(#[from] ThreadPoolBuildError),
}

impl BandModes {
    /// Computes the waves at these frequencies, Hz. They are the same for every number of threads.
    ///
    /// # Errors
    /// If a frequency is out of scale for the bone, or if no threads can be started.
    pub fn compute(
        case: &Case,
        surroundings: BoneSurroundings,
        frequencies: &[f64],
        isa: Isa,
        threads: usize,
    ) -> Result<Self, BandModesError> {
        let solver = Solver::with_isa(&case.setup, isa);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let modes = |&frequency: &f64| {
            let found = match surroundings {
                BoneSurroundings::Vacuum => {
                    let modes = solver.modes(&case.bone, frequency)?;
                    FluidModes { modes, lost: Vec::new(), others: Some(0) }
                }
                BoneSurroundings::Fluids => solver.modes_in_fluids(&case.bone, frequency)?,
            };
            Ok((frequency, found))
        };
        let found: Vec<Result<_, ModesError>> =
            pool.install(|| frequencies.par_iter().map(modes).collect());
        let frequencies = found.into_iter().collect::<Result<_, _>>()?;
        Ok(Self { surroundings, frequencies })
    }

    /// Returns one row for each wave and frequency, with a heading.
    pub fn to_csv(&self) -> String {
        let mut text =
            "frequency,wave,family,rank,wavenumber,phase_velocity,group_velocity,attenuation\n"
                .to_owned();
        for (frequency, found) in &self.frequencies {
            for mode in &found.modes {
                let Mode { family, rank, name, wavenumber, phase_velocity, group_velocity, .. } =
                    mode;
                let (name, attenuation) = (name.as_deref().unwrap_or(""), attenuation(mode));
                // Writing to a string cannot fail.
                let _ = writeln!(
                    text,
                    "{frequency:?},{name},{family},{rank},{wavenumber:?},{phase_velocity:?},{group_velocity:?},{attenuation:?}"
                );
            }
        }
        text
    }

    /// Returns each wave over its frequencies, by the frequency at which it begins.
    pub fn ranges(&self) -> Vec<WaveRange> {
        let mut ranges: Vec<WaveRange> = Vec::new();
        for (frequency, found) in &self.frequencies {
            for mode in &found.modes {
                let (label, here) = (label(mode), [*frequency, mode.phase_velocity]);
                let backward = usize::from(mode.group_velocity < 0.0);
                match ranges.iter_mut().find(|range| range.label == label) {
                    Some(range) => {
                        range.last = here;
                        range.backward += backward;
                    }
                    None => ranges.push(WaveRange { label, first: here, last: here, backward }),
                }
            }
        }
        ranges
    }

    /// Returns the points of a figure, frequency (Hz) and phase velocity (m/s), of each family.
    pub fn points(&self) -> Vec<(&'static str, Vec<[f64; 2]>)> {
        let mut families: Vec<(&'static str, Vec<[f64; 2]>)> = Vec::new();
        for (frequency, found) in &self.frequencies {
            for mode in &found.modes {
                let point = [*frequency, mode.phase_velocity];
                match families.iter_mut().find(|(family, _)| *family == mode.family) {
                    Some((_, points)) => points.push(point),
                    None => families.push((mode.family, vec![point])),
                }
            }
        }
        families
    }
}

/// Returns the attenuation of a wave along the bone, dB/cm.
pub fn attenuation(mode: &Mode) -> f64 {
    DB_PER_CM * mode.attenuation
}

/// Returns the name of a wave, or its family and rank.
pub fn label(mode: &Mode) -> String {
    mode.name.clone().unwrap_or_else(|| format!("{} {}", mode.family.replace('_', " "), mode.rank))
}
