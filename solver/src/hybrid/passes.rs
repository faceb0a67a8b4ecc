//! Computes one bone in passes, each finer than the one before, until the picked times converge.

use osteon_common::bone::Sublayers;
use osteon_common::case::Setup;
use osteon_common::outcome::FailureKind;

use super::column_load::ColumnLimit;
use super::incident::Incident;
use super::march::{Limit, March, MarchWorkspace, ReceiverSamples};
use super::operator::{FluidColumn, Operator};
use super::plan::{Plan, SAMPLES_BEYOND, Times, WorkBudget, thinness};
use super::samples::{LowPass, Samples};
use super::scope::{Scope, Span};
use crate::arrival::Arrival;
use crate::failure::{Failure, pressure_not_finite};
use crate::isa::Isa;
use crate::picking::{FLOOR, Pick, Window, criterion, pick};

/// Fineness of the first pass, relative to the setup. In a thin plate all passes are finer, by the
/// square root of the thinness.
const FIRST: f64 = 0.75;
/// Fineness of the second pass.
const SECOND: f64 = 1.2;
/// Factor of fineness from each pass to the next, from the third on.
const FINER: f64 = 1.5;
/// Maximum number of passes.
const PASSES_MAX: usize = 5;
/// Number of passes without a velocity after which the bone has none: coarse ones can miss a weak
/// arrival.
const FAILURES_MAX: usize = 3;
/// After the first pass, windows end this many periods of the centre frequency after the picked
/// extremum: they include the extrema with which the picking rule compares it, and a little more.
const PACKET_PERIODS: f64 = 1.25;
/// Fraction of a pass's change that is taken as its error: elements have a high order, and most of
/// the waves of the pulse's kink at t = 0 that one pass misses are resolved by the next.
const REMAINDER: f64 = 0.5;
/// Estimated relative error of the velocity at which passes end, at refinement 1. In a thin plate
/// it is multiplied by the thinness, since there the kink's waves decay more slowly.
const SMALL_ERROR: f64 = 2.5e-5;
/// Change of the mean of all times, in periods of the centre frequency, at which passes end. A
/// common shift of all times is the error of the elements, which falls fast; their scatter is
/// caused by the kink, and is part of the estimated error.
const SMALL_SHIFT: f64 = 2.5e-3;
/// Largest change of a time relative to the mean, in periods of the centre frequency, at which
/// passes end: a flat extremum moves by more than the line through all times shows.
const SMALL_SCATTER: f64 = 5e-4;

/// State of a bone's passes.
pub(super) struct Passes<'a> {
    pub(super) setup: &'a Setup,
    /// Distances of the receivers from the source, m.
    pub(super) distances: &'a [f64],
    pub(super) isa: Isa,
    pub(super) bone: &'a Sublayers,
    /// The windows up to the direct wave.
    pub(super) whole: Scope,
    pub(super) memory: &'a mut MarchWorkspace,
    pub(super) windows: &'a mut Vec<Window>,
    /// Ratio of the time step to the stability limit, once it is known.
    pub(super) share: Option<f64>,
    /// The work that the passes may still use.
    pub(super) budget: WorkBudget,
}

struct PassResult {
    pick: Pick,
    /// Extrema below these are noise, Pa per Pa of the pulse's amplitude; one per receiver.
    floors: Vec<f64>,
    /// Relative error of the speed of waves on its mesh.
    dispersion: f64,
}

impl Passes<'_> {
    /// Computes the first arrival.
    ///
    /// # Errors
    /// The failure, if the case has no velocity in three passes, or if the computation exceeds
    /// its limits.
    pub(super) fn arrival(&mut self) -> Result<Arrival, Failure> {
        let mut last = self.pass(self.fineness(0), None);
        let mut estimate = 1.0;
        for passes in 1..PASSES_MAX {
            if last.as_ref().is_err_and(is_final) {
                break;
            }
            let finer = self.fineness(passes);
            let mut next = self.pass(finer, last.as_ref().ok());
            if last.is_ok() && next.as_ref().is_err_and(|failure| !is_final(failure)) {
                // The extremum picked now may lie behind the packet that was computed.
                next = self.pass(finer, None);
            }
            match (&last, &next) {
                // The next pass would exceed the limits of the computation. One pass alone gives no
                // estimate of its error.
                (Ok(_), Err(failure)) if is_final(failure) => {
                    if passes == 1 {
                        last = next;
                    }
                    break;
                }
                (Ok(before), Ok(after)) => {
                    let change = Change::new(&before.pick, &after.pick);
                    estimate = self.estimate(&change, &after.pick);
                    last = next;
                    if self.is_small(&change, estimate) {
                        break;
                    }
                }
                (Err(_), Err(_)) if passes + 1 == FAILURES_MAX => {
                    last = next;
                    break;
                }
                _ => last = next,
            }
        }
        last.map(|PassResult { pick, dispersion, .. }| Arrival {
            directions: None,
            velocity: pick.velocity,
            times: pick.times,
            amplitudes: pick.amplitudes,
            // Passes that do not resolve the waves can agree by accident.
            estimated_error: estimate.max(dispersion.min(1.0)),
            passes: None,
        })
    }

    /// Returns the fineness of a pass; passes are counted from 0.
    fn fineness(&self, pass: usize) -> f64 {
        let thin = thinness(self.setup).sqrt();
        let over = if pass == 0 {
            FIRST * thin
        } else {
            (2..=pass).fold(SECOND * thin, |over, _| FINER * over)
        };
        over * self.setup.solver.refinement.sqrt()
    }

    /// Returns the relative error of the velocity: its change, plus the change that the largest scatter of
    /// the times would cause at the receiver farthest from the middle of the array.
    fn estimate(&self, change: &Change, pick: &Pick) -> f64 {
        let count = self.distances.len() as f64;
        let mean = self.distances.iter().fold(0.0, |sum, x| sum + x) / count;
        let (mut square, mut largest) = (0.0_f64, 0.0_f64);
        for x in self.distances {
            square = (x - mean).mul_add(x - mean, square);
            largest = largest.max((x - mean).abs());
        }
        REMAINDER * (change.velocity + pick.velocity * change.scatter * largest / square)
    }

    /// Returns whether a pass changed so little that it can be the last.
    fn is_small(&self, change: &Change, estimate: f64) -> bool {
        let refinement = self.setup.solver.refinement;
        let periods = self.setup.probe.center_frequency * change.shift;
        let thinness = thinness(self.setup);
        refinement * estimate <= SMALL_ERROR * thinness
            && refinement * periods <= SMALL_SHIFT
            && refinement * self.setup.probe.center_frequency * change.scatter <= SMALL_SCATTER
    }

    /// Computes the bone `finer` times as fine as in the setup: the packet found `before`, or the
    /// whole windows.
    fn pass(&mut self, finer: f64, before: Option<&PassResult>) -> Result<PassResult, Failure> {
        let after = PACKET_PERIODS / self.setup.probe.center_frequency;
        let scope = match before {
            Some(found) => self.whole.end_after(&found.pick.times, after),
            None => self.whole.clone(),
        };
        let (times, dispersion) = self.march(finer, &scope)?;
        let (pick, floors) = self.pick(&scope, times, before)?;
        Ok(PassResult { pick, floors, dispersion })
    }

    /// Computes the pressures at the receivers; also returns the relative error of the speed of
    /// waves.
    fn march(&mut self, finer: f64, scope: &Scope) -> Result<(Times, f64), Failure> {
        let setup = self.setup;
        let plan = Plan::new(setup, self.bone, scope, finer)?;
        let operator = Operator::new(self.bone, &plan.mesh);
        let mut limit = self.isa.run(Limit {
            operator: &operator,
            wavenumber: plan.wavenumber_limit,
            state: &mut self.memory.state,
        });
        if Incident::is_stepped(setup) {
            limit = limit.min(self.isa.run(ColumnLimit {
                column: &FluidColumn::new(&plan.mesh.coupling, &plan.mesh.element),
                wavenumber: plan.wavenumber_limit,
                state: &mut self.memory.state,
            }));
        }
        let share = self.share(limit)?;
        let times = plan.times(setup, self.onset(), limit, share, &mut self.budget)?;
        let filter = LowPass::new(plan.band * times.sample());
        let receivers: Vec<ReceiverSamples> =
            scope.windows.iter().map(|span| self.receiver(span, times, filter.reach())).collect();
        let mut incident = Incident::new(setup, scope, &plan.mesh, times);
        let finite = self.isa.run(March {
            operator: &operator,
            plan: &plan,
            times,
            incident: &mut incident,
            receivers: &receivers,
            height: setup.probe.receivers.x3,
            memory: self.memory,
        });
        if !finite {
            return Err(pressure_not_finite());
        }
        let MarchWorkspace { pressures, row, .. } = &mut *self.memory;
        for values in pressures.chunks_exact_mut(times.samples) {
            row.clear();
            row.extend_from_slice(values);
            filter.apply(row, values);
        }
        Ok((times, plan.mesh.dispersion(setup, self.bone)))
    }

    /// Returns the ratio of the time step to the stability limit: in the first pass, with `limit`
    /// (s), the one that the setup requests; in all others the same.
    ///
    /// # Errors
    /// `NoConvergence` if the setup's step is above the limit.
    fn share(&mut self, limit: f64) -> Result<f64, Failure> {
        if let Some(share) = self.share {
            return Ok(share);
        }
        let share = match self.setup.solver.time_step {
            None => 1.0,
            Some(step) => {
                let allowed = limit * self.fineness(0);
                if step > allowed {
                    return Err(Failure {
                        kind: FailureKind::NoConvergence,
                        detail: format!(
                            "the time step of {step:e} s is above this bone's stability limit of \
                             {allowed:e} s; give a smaller solver.time_step, or none"
                        ),
                    });
                }
                step / allowed
            }
        };
        self.share = Some(share);
        Ok(share)
    }

    /// Returns the time, s, when the computation begins.
    fn onset(&self) -> f64 {
        Incident::onset(self.setup)
    }

    /// Returns the samples that a window needs with a filter of this `reach`.
    fn receiver(&self, span: &Span, times: Times, reach: usize) -> ReceiverSamples {
        let margin = SAMPLES_BEYOND + reach;
        let sample = |t: f64| ((t - self.onset()) / times.sample()).max(0.0) as usize;
        ReceiverSamples {
            distance: span.distance,
            first: sample(span.from).saturating_sub(margin),
            last: (sample(span.to) + margin).min(times.samples - 1),
        }
    }

    /// Picks the first arrival; also returns the pressures below which extrema are noise.
    fn pick(
        &mut self,
        scope: &Scope,
        times: Times,
        before: Option<&PassResult>,
    ) -> Result<(Pick, Vec<f64>), Failure> {
        let onset = self.onset();
        self.windows.resize_with(scope.windows.len(), Window::default);
        let rows = self.memory.pressures.chunks_exact(times.samples);
        let mut floors = Vec::with_capacity(scope.windows.len());
        let spans = scope.windows.iter().enumerate();
        for ((window, values), (r, span)) in self.windows.iter_mut().zip(rows).zip(spans) {
            let samples = Samples { start: onset, step: times.sample(), values };
            samples.extrema(span.from, span.to, &mut window.extrema);
            if let Some(found) = before {
                window.extrema.retain(|e| e.pressure.abs() >= found.floors[r]);
                floors.push(found.floors[r]);
            } else {
                window.last = samples.at(span.to).abs();
                window.drop_noise();
                let largest =
                    window.extrema.iter().fold(0.0, |max: f64, e| max.max(e.pressure.abs()));
                floors.push(FLOOR * largest);
            }
        }
        let fc = self.setup.probe.center_frequency;
        let pick = pick(&criterion(self.setup), fc, self.distances, self.windows)?;
        Ok((pick, floors))
    }
}

/// Returns whether a finer pass could not avoid the failure.
fn is_final(failure: &Failure) -> bool {
    matches!(failure.kind, FailureKind::NoConvergence | FailureKind::NotFinite)
}

/// Change from one pass to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Change {
    /// Relative change of the velocity.
    velocity: f64,
    /// Change of the mean of the times, s.
    shift: f64,
    /// Largest change of a time relative to the mean, s.
    scatter: f64,
}

impl Change {
    fn new(before: &Pick, after: &Pick) -> Self {
        let changes = || before.times.iter().zip(&after.times).map(|(a, b)| b - a);
        let shift = changes().fold(0.0, |sum, change| sum + change) / after.times.len() as f64;
        Self {
            velocity: (before.velocity / after.velocity - 1.0).abs(),
            shift: shift.abs(),
            scatter: changes().fold(0.0, |max: f64, change| max.max((change - shift).abs())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_of_all_times_is_told_from_their_scatter() {
        let pick = |velocity, times: [f64; 3]| Pick {
            velocity,
            times: times.to_vec(),
            amplitudes: vec![1.0; 3],
            skipped: 0.0,
            ratio: 1.0,
            residual: 0.0,
            prominence: 1.0,
        };
        let change = Change::new(&pick(4004.0, [1.0, 2.0, 3.0]), &pick(4000.0, [1.5, 2.5, 3.5]));
        assert!((change.velocity - 1e-3).abs() < 1e-12);
        assert_eq!((change.shift, change.scatter), (0.5, 0.0));
        let change = Change::new(&pick(4000.0, [1.0, 2.0, 3.0]), &pick(4000.0, [1.0, 2.0, 3.75]));
        assert_eq!((change.velocity, change.shift, change.scatter), (0.0, 0.25, 0.5));
    }
}
