//! The pressure of the source on the rigid bone's face under a stack of fluids, stepped through time.
//!
//! By reciprocity it is the pressure at the source's place when the face is driven as the source is. In
//! this reciprocal problem all waves are smooth, so that a mesh needs no node at the source.

use osteon_common::case::Setup;

use super::mesh::Mesh;
use super::operator::FluidColumn;
use super::plan::Times;
use super::stepping::{WaveState, stability_limit};
use crate::isa::Kernel;
use crate::lanes::Lanes;
use crate::pulse::Pulse;
use crate::vector::Vector;

/// Computes the load for one block of wavenumbers after another.
#[derive(Debug)]
pub(super) struct ColumnLoad {
    column: FluidColumn,
    /// Node and weights by which the pressure at the source's place is interpolated.
    node: usize,
    weights: Vec<f64>,
    /// Time step, s.
    step: f64,
    /// F at every time step.
    pulse: Vec<f64>,
    state: WaveState,
}

impl ColumnLoad {
    /// Creates the load of the column of a mesh at these times.
    pub(super) fn new(setup: &Setup, mesh: &Mesh, column: FluidColumn, times: Times) -> Self {
        let (node, weights) = mesh.receiver(setup.probe.source.x3);
        // A velocity does not depend on the pulse's amplitude, not even in its last bit.
        let pulse = Pulse::new(1.0, &setup.probe);
        let steps = times.samples * times.ratio + 2;
        let pulse = (0..=steps).map(|n| pulse.at(n as f64 * times.step)).collect();
        Self { column, node, weights, step: times.step, pulse, state: WaveState::default() }
    }

    /// Computes the pressure on the face at every time step from the pulse's start on; `k` is in rad/m.
    #[inline(always)]
    pub(super) fn fill<V: Vector>(&mut self, k: Lanes, load: &mut [Lanes]) {
        let Self { column, node, weights, step, pulse, state } = self;
        let at = |n: usize| Lanes::splat(pulse[n]);
        // The double time integral of the first step, divided by its square, of the parabola through 0 and
        // the values after one and two steps: the pulse starts at 0, with a slope.
        let mean = Lanes::splat(0.25).mul_add(at(1), Lanes::splat(-1.0 / 24.0) * at(2));
        state.start::<V, _>(column, k, mean, *step);
        load[0] = Lanes::ZERO;
        for (n, load) in load.iter_mut().enumerate().skip(1) {
            let pressures = &state.now[*node..*node + weights.len()];
            *load = pressures
                .iter()
                .zip(&*weights)
                .fold(Lanes::ZERO, |sum, (&p, &weight)| Lanes::splat(weight).mul_add(p, sum));
            state.step::<V, _>(column, k, [at(n - 1), at(n), at(n + 1)], *step);
        }
    }
}

/// Kernel that computes the largest stable time step of a column, s.
pub(super) struct ColumnLimit<'a> {
    pub(super) column: &'a FluidColumn,
    pub(super) wavenumber: f64,
    pub(super) state: &'a mut WaveState,
}

impl Kernel for ColumnLimit<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Vector>(self) -> f64 {
        stability_limit::<V, _>(self.column, self.wavenumber, self.state)
    }
}
