//! The guided waves of a bone between its fluids, with attenuation: followed from those in a vacuum.

use std::f64::consts::TAU;

use osteon_common::bone::BoneRef;
use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
use osteon_common::layers::Layers;

use super::fluid_bone::{FluidBone, Radiation};
use super::modes::{FreeModes, Mode, ModesError};
use crate::complex::Complex;
use crate::solver::Solver;

/// First and least step of the share of fluids and loss.
const FIRST_STEP: f64 = 0.125;
const LEAST_STEP: f64 = 1.0 / 4096.0;
/// Maximum number of steps.
const STEPS_MAX: usize = 1000;
/// Largest error of a prediction, as a part of the distance to the nearest other wave and of the wavenumber.
const STRAY_MAX: f64 = 0.3;
const CHANGE_MAX: f64 = 0.05;
/// Radius about a wavenumber, as a part of it and of the distance to the nearest other one, in which it is the
/// only one.
const ALONE: f64 = 1e-3;
/// Distance of the upper side of the strip in which waves are counted from real wavenumbers, and of its ends from
/// the wavenumbers of sound, as parts of ω/c.
const BESIDE: f64 = 1e-3;
/// How far the strip reaches beyond the most attenuated wave.
const BEYOND: f64 = 1.05;
/// Pieces of each side of the strip.
const PIECES: usize = 500;

/// The guided waves of a bone between its fluids at one frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct FluidModes {
    /// The waves, by ascending phase velocity, with the names of those in a vacuum that they come from.
    pub modes: Vec<Mode>,
    /// The waves in a vacuum that could not be followed.
    pub lost: Vec<Mode>,
    /// Number of other waves that are not more attenuated than the most attenuated one of `modes`: slow ones,
    /// which there are only in fluids, and those that come from waves that do not propagate in a vacuum. `None`
    /// if they could not be counted.
    pub others: Option<u64>,
}

impl Solver {
    /// Computes the guided waves of a bone between coupling and marrow as half-spaces, with the attenuation of
    /// all layers, at `frequency` (Hz, above 0). Each is the only one near its wavenumber, by the argument
    /// principle.
    ///
    /// # Errors
    /// As [`Solver::modes`], and if coupling or marrow is a stack of several fluids, which is no half-space.
    pub fn modes_in_fluids<'a>(
        &self,
        bone: impl Into<BoneRef<'a>>,
        frequency: f64,
    ) -> Result<FluidModes, ModesError> {
        let layers = &self.setup().layers;
        let fluids = half_spaces(layers)?;
        let free = FreeModes::new(self, bone.into(), frequency)?;
        let omega = TAU * frequency;
        let sound = fluids.map(|fluid| omega / fluid.sound_speed);
        let mut found = FluidModes { modes: Vec::new(), lost: Vec::new(), others: Some(0) };
        for components in &free.components {
            for radiation in [[false, false], [false, true], [true, false], [true, true]] {
                let Some(range) = range(radiation, sound, free.last) else { continue };
                let bone = FluidBone {
                    isa: self.isa(),
                    media: &free.media,
                    layers,
                    fluids,
                    components,
                    radiation,
                    omega,
                    share: 1.0,
                };
                let is_here = |mode: &&Mode| {
                    free.components_of(mode) == components.as_slice()
                        && radiation == sound.map(|sound| mode.wavenumber < sound)
                };
                let waves: Vec<&Mode> = free.modes.iter().filter(is_here).collect();
                add_followed(&bone, &waves, range, &mut found);
            }
        }
        found.modes.sort_by(|a, b| a.phase_velocity.total_cmp(&b.phase_velocity));
        found.lost.sort_by(|a, b| a.phase_velocity.total_cmp(&b.phase_velocity));
        Ok(found)
    }
}

/// Returns the fluids above and below the bone.
pub(super) fn half_spaces(layers: &Layers) -> Result<[FluidSublayer; 2], ModesError> {
    let single = |fluids: FluidSublayers, field| match *fluids.as_slice() {
        [fluid] => Ok(fluid),
        _ => Err(ModesError::SeveralFluids { field }),
    };
    Ok([
        single(layers.coupling_fluids(), "layers.coupling.sublayers")?,
        single(layers.marrow_fluids(), "layers.marrow.sublayers")?,
    ])
}

/// Returns the wavenumbers (rad/m) of waves that radiate where this says; `None` if there are none.
fn range(radiation: Radiation, sound: [f64; 2], last: f64) -> Option<[f64; 2]> {
    let (mut low, mut high) =
        (BESIDE * sound[0].min(sound[1]), 2.0 * last.max(sound[0]).max(sound[1]));
    for (radiates, sound) in radiation.into_iter().zip(sound) {
        if radiates {
            high = high.min(sound);
        } else {
            low = low.max(sound);
        }
    }
    (low < high).then_some([low, high])
}

/// Follows these waves from a vacuum into the fluids, and adds what was found.
fn add_followed(bone: &FluidBone<'_>, waves: &[&Mode], range: [f64; 2], found: &mut FluidModes) {
    let starts: Vec<Complex> =
        waves.iter().map(|wave| Complex::new(wave.wavenumber, 0.0)).collect();
    let roots = follow(bone, starts);
    let known: Vec<Complex> = roots.iter().copied().flatten().collect();
    let is_inside = |k: &Complex| range[0] < k.re && k.re < range[1];
    let mut deepest = 0.0_f64;
    let mut counted = 0;
    for (wave, root) in waves.iter().zip(&roots) {
        let good = root.filter(|root| {
            let radius = ALONE * root.abs().min(nearest(*root, &known));
            is_inside(root) && bone.is_single_root(*root, radius)
        });
        let Some(k) = good else {
            found.lost.push((*wave).clone());
            continue;
        };
        deepest = deepest.max(-k.im);
        counted += 1;
        found.modes.push(Mode {
            wavenumber: k.re,
            phase_velocity: bone.omega / k.re,
            group_velocity: bone.group_velocity(k),
            // Not -k.im, which is -0 where nothing is lost.
            attenuation: 0.0 - k.im,
            ..(*wave).clone()
        });
    }
    let margin = BESIDE * range[1].min(bone.omega / bone.fluids[0].sound_speed);
    let strip = [
        Complex::new(range[0] + 1e-3 * margin, -BEYOND * deepest - margin),
        Complex::new(range[1] - 1e-3 * margin, margin),
    ];
    let within = bone.roots_within(strip, PIECES);
    let others = within.and_then(|within| u64::try_from(within - counted).ok());
    found.others = found.others.zip(others).and_then(|(sum, others)| sum.checked_add(others));
}

/// Returns the distance (rad/m) from a root to the nearest other one.
fn nearest(root: Complex, roots: &[Complex]) -> f64 {
    let distances = roots.iter().map(|other| (*other - root).abs());
    distances.filter(|distance| *distance > 0.0).fold(f64::INFINITY, f64::min)
}

/// Follows wavenumbers (rad/m) from those in a vacuum to those in the fluids; `None` for those that are lost.
fn follow(bone: &FluidBone<'_>, starts: Vec<Complex>) -> Vec<Option<Complex>> {
    let mut lost = vec![false; starts.len()];
    let (mut roots, mut slopes) = (starts, vec![Complex::default(); lost.len()]);
    let (mut share, mut step) = (0.0_f64, FIRST_STEP);
    for _ in 0..STEPS_MAX {
        if share >= 1.0 {
            let kept = roots.into_iter().zip(lost);
            return kept.map(|(root, lost)| (!lost).then_some(root)).collect();
        }
        let next = (share + step).min(1.0);
        let places: Vec<usize> = (0..roots.len()).filter(|place| !lost[*place]).collect();
        let predicted: Vec<Complex> =
            places.iter().map(|&place| roots[place] + slopes[place].scale(next - share)).collect();
        let found = FluidBone { share: next, ..*bone }.roots(&predicted);
        let is_good = |(found, predicted_here): (&Option<Complex>, &Complex)| {
            found.is_some_and(|found| {
                let stray = (found - *predicted_here).abs();
                stray <= STRAY_MAX * nearest(*predicted_here, &predicted)
                    && stray <= CHANGE_MAX * found.abs()
            })
        };
        let good: Vec<bool> = found.iter().zip(&predicted).map(is_good).collect();
        let all_good = good.iter().all(|good| *good);
        if !all_good && step > LEAST_STEP {
            step *= 0.5;
            continue;
        }
        for ((&place, good), found) in places.iter().zip(&good).zip(&found) {
            match found.filter(|_| *good) {
                Some(found) => {
                    slopes[place] = (found - roots[place]).scale(1.0 / (next - share));
                    roots[place] = found;
                }
                None => lost[place] = true,
            }
        }
        share = next;
        if all_good {
            step = (2.0 * step).min(FIRST_STEP);
        }
    }
    vec![None; lost.len()]
}
