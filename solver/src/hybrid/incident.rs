//! The pressure that the source alone exerts on the bone's face, held rigid.
//!
//! Fluid 1 carries, besides the waves that the bone's motion makes, the source's wave and its mirror
//! image in the rigid face. At one wavenumber the source's wave at height z obeys a Klein-Gordon
//! equation, whose solution is a convolution,
//!
//! ```text
//! p(z, t) = (ρ c / 2) ∫ F(τ) J0(c k √((t - τ)² - z²/c²)) dτ,    0 < τ < t - z/c,
//! ```
//!
//! and at the rigid face the mirror image doubles it. Before the direct wave arrives neither of the
//! two is heard at a receiver, so that the picked pressure is that of the bone's motion alone. The
//! fluid's outer face adds images of the source where their waves, by way of the bone, can be heard.

use osteon_common::case::Setup;
use osteon_common::fluid_sublayers::FluidSublayer;

use super::column_load::ColumnLoad;
use super::mesh::{Mesh, longest_coupling_path};
use super::operator::FluidColumn;
use super::plan::Times;
use super::scope::Scope;
use crate::lanes::{LANES, Lanes};
use crate::pulse::Pulse;
use crate::vector::Vector;

/// Points of interpolation between samples.
const POINTS: usize = 6;
/// Maximum number of images of the source. A fluid thinner than about 1/64 of the longest path on which a
/// wave is heard would have more: the waves of those left out are the ones that arrive last.
const IMAGES_MAX: usize = 64;

/// An image of the source: its height above the bone's face, m, and its sign.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Image {
    height: f64,
    sign: f64,
}

/// Returns the source, and its images in fluid 1's outer face whose waves can arrive in a window.
fn images(fluid: &FluidSublayer, setup: &Setup, scope: &Scope) -> Vec<Image> {
    let (source, depth) = (setup.probe.source.x3, fluid.thickness);
    let heard = longest_coupling_path(setup, scope) - setup.probe.receivers.x3;
    let mut images = vec![Image { height: source, sign: 1.0 }];
    let mut sign = -1.0;
    for n in 1..=IMAGES_MAX / 2 {
        let middle = 2.0 * n as f64 * depth;
        for height in [middle - source, middle + source] {
            if height < heard {
                images.push(Image { height, sign });
            }
        }
        sign = -sign;
    }
    images
}

/// Computes the load for one block of wavenumbers after another.
#[derive(Debug)]
pub(super) enum Incident {
    /// In one fluid, from the time at which the source's wave reaches the face.
    Images(Box<ImageLoad>),
    /// In a stack of fluids, from the pulse's start on.
    Column(Box<ColumnLoad>),
}

impl Incident {
    /// Creates the load for the samples and steps of `times`.
    pub(super) fn new(setup: &Setup, scope: &Scope, mesh: &Mesh, times: Times) -> Self {
        match setup.layers.coupling_fluids().as_slice() {
            [one] => Self::Images(Box::new(ImageLoad::new(one, setup, scope, times.sample()))),
            _ => {
                let column = FluidColumn::new(&mesh.coupling, &mesh.element);
                Self::Column(Box::new(ColumnLoad::new(setup, mesh, column, times)))
            }
        }
    }

    /// Returns whether the load is stepped through time, as the bone is.
    pub(super) fn is_stepped(setup: &Setup) -> bool {
        setup.layers.coupling_fluids().as_slice().len() > 1
    }

    /// Returns the time at which the load begins, s, after the start of the pulse.
    pub(super) fn onset(setup: &Setup) -> f64 {
        match setup.layers.coupling_fluids().as_slice() {
            [one] => setup.probe.source.x3 / one.sound_speed,
            _ => 0.0,
        }
    }

    /// Computes the pressure on the face at n steps after the onset, for every n of `load`; `ratio` steps
    /// make a sample, `k` is in rad/m.
    #[inline(always)]
    pub(super) fn fill<V: Vector>(&mut self, k: Lanes, ratio: usize, load: &mut [Lanes]) {
        match self {
            Self::Images(images) => images.fill(k, ratio, load),
            Self::Column(column) => column.fill::<V>(k, load),
        }
    }
}

/// The load in one fluid.
#[derive(Debug)]
pub(super) struct ImageLoad {
    /// The images, with the source first.
    images: Vec<Image>,
    sound_speed: f64,
    density: f64,
    /// Spacing of samples, s.
    step: f64,
    /// F at multiples of the spacing.
    pulse: Vec<f64>,
    /// F' at 0 and at multiples of the spacing.
    pulse_slope: Vec<f64>,
    kernel: Vec<Lanes>,
    table: Vec<Lanes>,
}

impl ImageLoad {
    /// Creates the load for samples `step` (s) apart.
    fn new(fluid: &FluidSublayer, setup: &Setup, scope: &Scope, step: f64) -> Self {
        // A velocity does not depend on the pulse's amplitude, not even in its last bit.
        let pulse = Pulse::new(1.0, &setup.probe);
        let samples = (pulse.extent() / step) as usize + 1;
        let at = |i: usize| i as f64 * step;
        Self {
            images: images(fluid, setup, scope),
            sound_speed: fluid.sound_speed,
            density: fluid.density,
            step,
            pulse: (0..samples).map(|i| pulse.at(at(i))).collect(),
            pulse_slope: (0..samples).map(|i| pulse.slope_at(at(i))).collect(),
            kernel: Vec::new(),
            table: Vec::new(),
        }
    }

    /// Computes the pressure on the face at n substeps after the source's wave has reached it, for
    /// every n of `load`; `ratio` substeps make a step, `k` is in rad/m.
    #[inline(always)]
    fn fill(&mut self, k: Lanes, ratio: usize, load: &mut [Lanes]) {
        load.fill(Lanes::ZERO);
        let substep = self.step / ratio as f64;
        for i in 0..self.images.len() {
            let image = self.images[i];
            let late = (image.height - self.images[0].height) / self.sound_speed;
            self.tabulate(k, image, load.len() / ratio + POINTS);
            for (n, load) in load.iter_mut().enumerate() {
                let position = (n as f64).mul_add(substep, -late) / self.step;
                if position > 0.0 {
                    *load = interpolate(&self.table, position, *load);
                }
            }
        }
    }

    /// Tabulates the wave of one image at multiples of the step after its arrival, by the
    /// trapezoidal rule with the first Euler-Maclaurin correction at both ends, which is of fourth
    /// order in the step.
    #[inline(always)]
    fn tabulate(&mut self, k: Lanes, image: Image, count: usize) {
        let delay = image.height / self.sound_speed;
        self.kernel.clear();
        for j in 0..count {
            let t = j as f64 * self.step;
            // t (t + 2 z/c) = (t + z/c)² - z²/c² without cancellation.
            let root = self.sound_speed * (t * (t + 2.0 * delay)).sqrt();
            let mut value = Lanes::ZERO;
            for lane in 0..LANES {
                value.0[lane] = libm::j0(k.0[lane] * root);
            }
            self.kernel.push(value);
        }
        let correction = self.step * self.step / 12.0;
        // J0's slope in t at the front, over k².
        let front = -0.5 * self.sound_speed * image.height;
        let scale = Lanes::splat(image.sign * self.density * self.sound_speed);
        self.table.clear();
        for j in 0..count {
            let last = j.min(self.pulse.len() - 1);
            let sum = convolve(&self.pulse[..=last], &self.kernel[j - last..=j]);
            let mut ends = Lanes::splat(self.pulse_slope[0]) * self.kernel[j];
            if j == last {
                let slope = Lanes::splat(self.pulse[j] * front) * (k * k);
                ends = ends + (slope - Lanes::splat(self.pulse_slope[j]));
            }
            let sum = Lanes::splat(self.step).mul_add(sum, Lanes::splat(correction) * ends);
            self.table.push(scale * sum);
        }
    }
}

/// Returns the trapezoidal sum Σ pulse_i kernel_(n-i) over i = 0 … n, in four interleaved sums.
#[inline(always)]
fn convolve(pulse: &[f64], kernel: &[Lanes]) -> Lanes {
    let n = pulse.len() - 1;
    // The last term counts half; so does the first, but the pulse starts at zero.
    let mut sums =
        [Lanes::splat(-0.5 * pulse[n]) * kernel[0], Lanes::ZERO, Lanes::ZERO, Lanes::ZERO];
    let mut i = 0;
    while i + 4 <= n + 1 {
        for a in 0..4 {
            sums[a] = Lanes::splat(pulse[i + a]).mul_add(kernel[n - i - a], sums[a]);
        }
        i += 4;
    }
    while i <= n {
        sums[0] = Lanes::splat(pulse[i]).mul_add(kernel[n - i], sums[0]);
        i += 1;
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// Adds to `sum` the table's value at `position` > 0, counted in samples; before the first there
/// is nothing.
#[inline(always)]
fn interpolate(table: &[Lanes], position: f64, sum: Lanes) -> Lanes {
    let first = position as usize;
    let t = position - first as f64;
    let mut sum = sum;
    for a in 0..POINTS {
        // Nodes -2 … 3 around the interval.
        let node = a as f64 - 2.0;
        let mut weight = 1.0;
        for b in 0..POINTS {
            if b != a {
                let other = b as f64 - 2.0;
                weight *= (t - other) / (node - other);
            }
        }
        if first + a >= 2 && first + a - 2 < table.len() {
            sum = Lanes::splat(weight).mul_add(table[first + a - 2], sum);
        }
    }
    sum
}
