//! Steps all wavenumbers of one bone through all times, and sums them at the receivers.

use super::incident::Incident;
use super::operator::Operator;
use super::plan::{Plan, Times};
use super::stepping::{WaveState, smooth_start, stability_limit};
use crate::isa::Kernel;
use crate::lanes::{LANES, Lanes};
use crate::vector::Vector;

/// Kernel that computes the largest stable time step, s.
pub(super) struct Limit<'a> {
    pub(super) operator: &'a Operator<1>,
    pub(super) wavenumber: f64,
    pub(super) state: &'a mut WaveState,
}

impl Kernel for Limit<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Vector>(self) -> f64 {
        stability_limit::<V, _>(self.operator, self.wavenumber, self.state)
    }
}

/// Kernel that computes the pressures at the receivers.
pub(super) struct March<'a> {
    pub(super) operator: &'a Operator<1>,
    pub(super) plan: &'a Plan,
    pub(super) times: Times,
    pub(super) incident: &'a mut Incident,
    pub(super) receivers: &'a [ReceiverSamples],
    /// Height of the receivers, m.
    pub(super) height: f64,
    pub(super) memory: &'a mut MarchWorkspace,
}

/// The samples required at one receiver.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReceiverSamples {
    /// Distance from the source along x1, m.
    pub(super) distance: f64,
    /// First sample required.
    pub(super) first: usize,
    /// Last sample required.
    pub(super) last: usize,
}

/// Memory that a thread reuses.
#[derive(Debug, Default)]
pub(super) struct MarchWorkspace {
    pub(super) state: WaveState,
    /// Pressure on the bone's face at every time step.
    pub(super) load: Vec<Lanes>,
    /// Samples of the pressure at the receivers' height.
    pub(super) record: Vec<Lanes>,
    /// Pressure samples, receiver after receiver.
    pub(super) pressures: Vec<f64>,
    /// One receiver's row of them.
    pub(super) row: Vec<f64>,
}

impl MarchWorkspace {
    /// Makes room for a load and a record.
    pub(super) fn reset(&mut self, times: Times) {
        for (lanes, len) in
            [(&mut self.load, times.samples * times.ratio + 2), (&mut self.record, times.samples)]
        {
            lanes.clear();
            lanes.resize(len, Lanes::ZERO);
        }
    }
}

/// Kernel that steps eight wavenumbers under a load in `memory`; the result is its record.
#[cfg(feature = "measure")]
pub(super) struct LoadResponse<'a> {
    pub(super) operator: &'a Operator<1>,
    pub(super) k: Lanes,
    pub(super) times: Times,
    pub(super) receiver: (usize, &'a [f64]),
    pub(super) memory: &'a mut MarchWorkspace,
}

#[cfg(feature = "measure")]
impl Kernel for LoadResponse<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        run_block::<V>(self.operator, self.k, self.times, self.receiver, self.memory);
    }
}

impl Kernel for March<'_> {
    type Output = bool;

    /// Returns whether every number was finite.
    #[inline(always)]
    fn run<V: Vector>(self) -> bool {
        let samples = self.times.samples;
        let memory = self.memory;
        memory.pressures.clear();
        memory.pressures.resize(samples * self.receivers.len(), 0.0);
        memory.reset(self.times);
        let (node, weights) = self.plan.mesh.receiver(self.height);
        let mut finite = true;
        for block in 0..self.plan.blocks() {
            let mut k = Lanes::ZERO;
            for lane in 0..LANES {
                k.0[lane] = (block * LANES + lane) as f64 * self.plan.wavenumber_step;
            }
            self.incident.fill::<V>(k, self.times.ratio, &mut memory.load);
            run_block::<V>(self.operator, k, self.times, (node, &weights), memory);
            for (r, receiver) in self.receivers.iter().enumerate() {
                let sums = &mut memory.pressures[r * samples..(r + 1) * samples];
                let factors = transform(self.plan, k, receiver.distance);
                add(factors, &memory.record, receiver, sums);
            }
            finite &= memory.record.iter().all(|p| p.sum().is_finite());
        }
        finite
    }
}

/// Steps eight wavenumbers through all times; records the pressure at the receivers' height.
#[inline(always)]
fn run_block<V: Vector>(
    operator: &Operator<1>,
    k: Lanes,
    times: Times,
    (node, weights): (usize, &[f64]),
    memory: &mut MarchWorkspace,
) {
    let load = &memory.load;
    let state = &mut memory.state;
    state.start::<V, _>(operator, k, smooth_start([load[1], load[2]]), times.step);
    for n in 1..times.samples * times.ratio {
        if n.is_multiple_of(times.ratio) {
            let mut pressure = Lanes::ZERO;
            for (i, &weight) in weights.iter().enumerate() {
                pressure = Lanes::splat(weight).mul_add(state.now[node + i], pressure);
            }
            memory.record[n / times.ratio] = pressure;
        }
        state.step::<V, _>(operator, k, [load[n - 1], load[n], load[n + 1]], times.step);
    }
}

/// Returns the factors of the cosine transform at `distance` (m).
fn transform(plan: &Plan, k: Lanes, distance: f64) -> Lanes {
    Lanes(k.0.map(|k| plan.weight(k) * libm::cos(k * distance)))
}

/// Adds one block's contribution to a receiver's pressure.
#[inline(always)]
fn add(factor: Lanes, record: &[Lanes], receiver: &ReceiverSamples, sums: &mut [f64]) {
    let range = receiver.first..=receiver.last;
    for (sum, &pressure) in sums[range.clone()].iter_mut().zip(&record[range]) {
        *sum += (factor * pressure).sum();
    }
}

#[cfg(test)]
mod tests {
    use osteon_common::bone::{BoneRef, Sublayer, Sublayers};
    use osteon_common::case::Setup;
    use osteon_common::parameters::Point;
    use osteon_common::realization::Ensemble;

    use super::*;
    use crate::hybrid::mesh::Mesh;
    use crate::hybrid::scope::Scope;
    use crate::isa::Isa;
    use crate::{Complex, admittance};

    #[test]
    fn responses_are_those_of_the_exact_admittance() {
        let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.3]);
        let ensemble = Ensemble::new(&point, 3).unwrap();
        let bone = |index| ensemble.bone(index).unwrap();
        check(&BoneRef::from(&bone(1)).sublayers(4e-3));
        let sublayers = [(1.3e-3, bone(2)), (0.4e-3, bone(3)), (2.3e-3, bone(4))];
        let sublayers = sublayers.map(|(thickness, solid)| Sublayer { thickness, solid });
        check(&Sublayers::new(&sublayers).unwrap());
    }

    /// The Laplace transform of a record against the exact admittance of a bone on its marrow.
    fn check(bone: &Sublayers) {
        let mut setup = Setup::default();
        // Receivers so far away that every echo is heard: both fluids are meshed whole.
        setup.probe.receivers.first_x1 = 0.1;
        setup.layers.marrow.thickness = 4e-3;
        let scope = Scope::until_direct_wave(&setup, 5000.0);
        let mesh = Mesh::with_sizes(&setup, bone, &scope, 8, |_| 0.4e-3, |_| 0.4e-3);
        let operator = Operator::<1>::new(bone, &mesh);
        let step = 5e-9;
        // Echoes from the coupling's outer face after 13 µs are weakened by e^-25.
        let (damping, samples) = (1.9e6, 2600);
        let times = Times { step, ratio: 1, samples };
        let k = Lanes(std::array::from_fn(|lane| 600.0 * lane as f64));
        let mut memory = MarchWorkspace::default();
        memory.reset(times);
        let pulse = |n: usize| {
            let t = n as f64 * step / 0.15e-6 - 6.1;
            libm::exp(-t * t)
        };
        for (n, load) in memory.load.iter_mut().enumerate() {
            *load = Lanes::splat(pulse(n));
        }
        let height = setup.probe.receivers.x3;
        let (node, weights) = mesh.receiver(height);
        let receiver = (node, weights.as_slice());
        let memory_ = &mut memory;
        Isa::fastest().run(LoadResponse {
            operator: &operator,
            k,
            times,
            receiver,
            memory: memory_,
        });
        let transform = |s: Complex, value: &dyn Fn(usize) -> f64| {
            (0..samples).fold(Complex::default(), |sum, n| {
                sum + s.scale(-(n as f64) * step).exp().scale(value(n) * step)
            })
        };
        let fluid = &setup.layers.coupling;
        for frequency in [0.2e6, 0.9e6, 1.7e6] {
            let s = Complex::new(damping, 2.0 * std::f64::consts::PI * frequency);
            let mut largest: f64 = 0.0;
            for lane in 0..LANES {
                let k = k.0[lane];
                let found = transform(s, &|n| memory.record[n].0[lane]);
                let z = s * s * admittance(&setup, bone, k, s).scale(fluid.density);
                let root = s * s.scale(1.0 / (fluid.sound_speed * fluid.sound_speed));
                let g = (root + Complex::new(k * k, 0.0)).sqrt();
                let incident = transform(s, &|n| pulse(n));
                let expected = z * incident / (g - z) * g.scale(-height).exp();
                // 1e-7 is the fourth power of ω step at the highest frequencies of the load.
                let error = (found - expected).abs() / incident.abs();
                assert!(error < 1e-6, "k {k}, {frequency} Hz: {found:?}, {expected:?}: {error:e}");
                largest = largest.max(expected.abs() / incident.abs());
            }
            assert!(largest > 1e-2, "{frequency} Hz: nothing to compare");
        }
    }
}
