//! Time steps of fourth order: the modified equation
//!
//! ```text
//! x(t + Δ) = 2 x(t) - x(t - Δ) + Δ² (a + Δ²/12 (A a + b_tt)),    a = A x + b,
//! ```
//!
//! stable while Δ √λ < √12 for the largest eigenvalue λ of -A.

use super::operator::{Keep, Scratch, Sink, System};
use crate::lanes::{LANES, Lanes};
use crate::vector::Vector;

/// Steps of the power iteration. The largest eigenvalues lie close together, and after m steps
/// from a random vector of n numbers about 0.87 ln(n) / (m - 1) of the largest can be missing: 3 %
/// for the usual mesh, half of that in the root.
const POWER_STEPS: usize = 200;
/// Ratio of a step to the estimated stability limit; it covers the error of the estimate.
pub(super) const STABLE_SHARE: f64 = 0.98;

/// The largest stable time step, s, at wavenumber `k` (rad/m).
#[inline(always)]
pub(super) fn stability_limit<V: Vector, A: System>(
    operator: &A,
    k: f64,
    state: &mut WaveState,
) -> f64 {
    state.reset(operator);
    let mut noise = 1_u64;
    for value in &mut state.now {
        for lane in 0..LANES {
            // Any vector without symmetry is suitable.
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            value.0[lane] = (noise >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        }
    }
    let k = Lanes::splat(k);
    let mut growth = Lanes::ZERO;
    for _ in 0..POWER_STEPS {
        let scratch = &mut state.scratch;
        operator.apply::<V, Keep>(k, &state.now, Lanes::ZERO, scratch, &mut state.first, &mut Keep);
        let mut square = Lanes::ZERO;
        for &value in &state.first {
            square = value.mul_add(value, square);
        }
        // The vectors have norm one from the second step on, so that this is the eigenvalue.
        for lane in 0..LANES {
            growth.0[lane] = square.0[lane].sqrt();
        }
        let scale = growth.recip();
        for (now, &next) in state.now.iter_mut().zip(&state.first) {
            *now = scale * next;
        }
    }
    let largest = growth.0.iter().fold(0.0, |max: f64, &value| max.max(value));
    STABLE_SHARE * (12.0 / largest).sqrt()
}

/// Returns the mean for [`WaveState::start`] of a load that starts as t² or more smoothly; `load` contains
/// its values at 1 and 2 steps.
#[inline(always)]
pub(super) fn smooth_start(load: [Lanes; 2]) -> Lanes {
    // ∫∫ of a load α t² + β t³ over one step, from its values.
    Lanes::splat(7.0 / 60.0).mul_add(load[0], Lanes::splat(-1.0 / 120.0) * load[1])
}

/// The state at two neighbouring times of eight wavenumbers, and scratch memory.
#[derive(Debug, Default)]
pub(super) struct WaveState {
    pub(super) now: Vec<Lanes>,
    pub(super) before: Vec<Lanes>,
    first: Vec<Lanes>,
    second: Vec<Lanes>,
    scratch: Scratch,
}

impl WaveState {
    /// Sets everything to rest.
    pub(super) fn reset(&mut self, operator: &impl System) {
        let len = operator.len();
        for vector in [&mut self.now, &mut self.before, &mut self.first, &mut self.second] {
            vector.clear();
            vector.resize(len, Lanes::ZERO);
        }
    }

    /// Steps from rest at t = 0 to t = `step` under a load whose ∫∫ over the step is `mean` times the
    /// square of the step.
    #[inline(always)]
    pub(super) fn start<V: Vector, A: System>(
        &mut self,
        operator: &A,
        k: Lanes,
        mean: Lanes,
        step: f64,
    ) {
        self.reset(operator);
        let out = &mut self.first;
        operator.apply::<V, Keep>(k, &self.before, mean, &mut self.scratch, out, &mut Keep);
        let square = Lanes::splat(step * step);
        for (now, &first) in self.now.iter_mut().zip(&self.first) {
            *now = square * first;
        }
    }

    /// Makes one step; `load` contains the load's values one step before, now, and one step after.
    #[inline(always)]
    pub(super) fn step<V: Vector, A: System>(
        &mut self,
        operator: &A,
        k: Lanes,
        load: [Lanes; 3],
        step: f64,
    ) {
        let out = &mut self.first;
        operator.apply::<V, Keep>(k, &self.now, load[1], &mut self.scratch, out, &mut Keep);
        let square = step * step;
        let bend = Lanes::splat(1.0 / square) * ((load[2] - load[1]) - (load[1] - load[0]));
        let mut advance = Advance {
            now: &self.now,
            before: &mut self.before,
            rate: &self.first,
            once: square,
            twice: square * square / 12.0,
        };
        let out = &mut self.second;
        operator.apply::<V, Advance>(k, &self.first, bend, &mut self.scratch, out, &mut advance);
        std::mem::swap(&mut self.now, &mut self.before);
    }
}

/// The modified equation's update, which replaces `before` by the state after `now`.
struct Advance<'a> {
    now: &'a [Lanes],
    before: &'a mut [Lanes],
    /// a.
    rate: &'a [Lanes],
    /// Δ².
    once: f64,
    /// Δ⁴/12.
    twice: f64,
}

impl Sink for Advance<'_> {
    #[inline(always)]
    fn take<V: Vector>(&mut self, start: usize, values: &[Lanes]) {
        let end = start + values.len();
        let (now, rate) = (&self.now[start..end], &self.rate[start..end]);
        let before = &mut self.before[start..end];
        let (once, twice, two) = (V::splat(self.once), V::splat(self.twice), V::splat(2.0));
        for i in 0..values.len() {
            for part in 0..V::PARTS {
                let bend = twice.mul(V::load(&values[i], part));
                let change = once.mul_add(V::load(&rate[i], part), bend);
                let change = change.sub(V::load(&before[i], part));
                two.mul_add(V::load(&now[i], part), change).store(&mut before[i], part);
            }
        }
    }
}
