//! Convergence of the error with element size, order and time step.
//!
//! Measured one wavenumber at a time, under a load on the bone's face that is a smooth function of
//! time: the pulse itself has a kink at t = 0, after which no scheme of high order shows its order.
//! The pressure at the receivers' height is compared with that of a finer computation.

use osteon_common::bone::{Bone, BoneRef, Sublayers};
use osteon_common::case::Setup;
use osteon_common::outcome::FailureKind;

use super::march::{Limit, LoadResponse, MarchWorkspace};
use super::mesh::Mesh;
use super::operator::Operator;
use super::plan::Times;
use super::scope::Scope;
use crate::failure::Failure;
use crate::isa::Isa;
use crate::lanes::{LANES, Lanes};
use crate::medium::Medium;

/// Duration in periods of the centre frequency.
const PERIODS: f64 = 8.0;
/// Times at which pressures are compared.
const SAMPLES: usize = 65;
/// Width of the load, exp(-((t - t0)/width)²), in periods.
const LOAD_WIDTH: f64 = 0.3;
/// t0 over the width: the load starts below 1e-16.
const LOAD_DELAY: f64 = 6.1;
/// The largest wavenumber over that of the coupling fluid's waves at the centre frequency.
const WAVENUMBER: f64 = 1.4;
/// Order of the elements with which others are compared.
const REFERENCE_ORDER: usize = 12;
/// Time steps of the reference per smallest time step that is asked for.
const REFERENCE_STEPS: usize = 4;

/// One line of a convergence table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConvergenceRow {
    /// Largest element, m.
    pub element_size: f64,
    /// Polynomial degree of the elements.
    pub element_order: u32,
    /// Time step, s.
    pub time_step: f64,
    /// Largest error of the pressure over all times and eight wavenumbers, each relative to its
    /// wavenumber's largest pressure.
    pub error: f64,
}

/// Errors of meshes of one order, with elements no larger than each of `sizes` (m) in every layer.
///
/// All are stepped with the same time step, so that what is seen is the error of the elements.
///
/// # Errors
/// `NotFinite` when a computation is.
pub fn element_convergence(
    setup: &Setup,
    bone: &Bone,
    order: u32,
    sizes: &[f64],
) -> Result<Vec<ConvergenceRow>, Failure> {
    let finest = sizes.iter().copied().fold(f64::INFINITY, f64::min);
    let mut study = SmoothLoadStudy::new(setup, bone);
    let reference = study.mesh(REFERENCE_ORDER, finest);
    let mut stable = study.limit(&reference);
    for &size in sizes {
        let mesh = study.mesh(order as usize, size);
        stable = stable.min(study.limit(&mesh));
    }
    let ratio = study.ratio(stable);
    let exact = study.pressures(&reference, ratio)?;
    let mut rows = Vec::with_capacity(sizes.len());
    for &element_size in sizes {
        let mesh = study.mesh(order as usize, element_size);
        let pressures = study.pressures(&mesh, ratio)?;
        rows.push(ConvergenceRow {
            element_size,
            element_order: order,
            time_step: study.spacing() / ratio as f64,
            error: difference(&pressures, &exact),
        });
    }
    Ok(rows)
}

/// Errors of time steps on the setup's mesh: the largest stable one of the kind (a whole fraction
/// of the sampling), and `halvings` times its half.
///
/// # Errors
/// `NotFinite` when a computation is.
pub fn time_step_convergence(
    setup: &Setup,
    bone: &Bone,
    halvings: u32,
) -> Result<Vec<ConvergenceRow>, Failure> {
    let mut study = SmoothLoadStudy::new(setup, bone);
    let mesh = Mesh::new(setup, &study.bone, &study.scope, setup.solver.refinement.sqrt());
    let limit = study.limit(&mesh);
    let first = study.ratio(limit);
    let finest = first << halvings;
    let exact = study.pressures(&mesh, REFERENCE_STEPS * finest)?;
    let mut rows = Vec::new();
    for halving in 0..=halvings {
        let ratio = first << halving;
        let pressures = study.pressures(&mesh, ratio)?;
        rows.push(ConvergenceRow {
            element_size: setup.solver.element_size,
            element_order: setup.solver.element_order,
            time_step: study.spacing() / ratio as f64,
            error: difference(&pressures, &exact),
        });
    }
    Ok(rows)
}

/// One bone under the smooth load.
struct SmoothLoadStudy<'a> {
    setup: &'a Setup,
    bone: Sublayers,
    scope: Scope,
    wavenumbers: Lanes,
    memory: MarchWorkspace,
}

impl<'a> SmoothLoadStudy<'a> {
    fn new(setup: &'a Setup, bone: &Bone) -> Self {
        let fc = setup.probe.center_frequency;
        let fluid = 2.0 * std::f64::consts::PI * fc / setup.layers.coupling.fastest();
        let mut wavenumbers = Lanes::ZERO;
        for lane in 0..LANES {
            wavenumbers.0[lane] = WAVENUMBER * fluid * lane as f64 / (LANES - 1) as f64;
        }
        let speed = Medium::new(bone).fastest.max(setup.layers.marrow.fastest());
        Self {
            setup,
            bone: BoneRef::from(bone).sublayers(setup.layers.bone_thickness),
            scope: Scope::until_direct_wave(setup, speed),
            wavenumbers,
            memory: MarchWorkspace::default(),
        }
    }

    /// The same elements everywhere.
    fn mesh(&self, order: usize, size: f64) -> Mesh {
        Mesh::with_sizes(self.setup, &self.bone, &self.scope, order, |_| size, |_| size)
    }

    /// Returns the largest stable time step, s.
    fn limit(&mut self, mesh: &Mesh) -> f64 {
        Isa::fastest().run(Limit {
            operator: &Operator::new(&self.bone, mesh),
            wavenumber: self.wavenumbers.0[LANES - 1],
            state: &mut self.memory.state,
        })
    }

    /// Time between samples, s.
    fn spacing(&self) -> f64 {
        PERIODS / self.setup.probe.center_frequency / (SAMPLES - 1) as f64
    }

    /// Time steps per sample, so that a step is at most `limit` (s).
    fn ratio(&self, limit: f64) -> usize {
        (self.spacing() / limit) as usize + 1
    }

    /// Pressures at the receivers' height with `ratio` time steps per sample.
    fn pressures(&mut self, mesh: &Mesh, ratio: usize) -> Result<Vec<Lanes>, Failure> {
        let step = self.spacing() / ratio as f64;
        let times = Times { step, ratio, samples: SAMPLES };
        let width = LOAD_WIDTH / self.setup.probe.center_frequency;
        self.memory.reset(times);
        for (n, load) in self.memory.load.iter_mut().enumerate() {
            let t = n as f64 * times.step / width - LOAD_DELAY;
            *load = Lanes::splat(libm::exp(-t * t));
        }
        let (node, weights) = mesh.receiver(self.setup.probe.receivers.x3);
        Isa::fastest().run(LoadResponse {
            operator: &Operator::new(&self.bone, mesh),
            k: self.wavenumbers,
            times,
            receiver: (node, &weights),
            memory: &mut self.memory,
        });
        let record = self.memory.record.clone();
        if record.iter().all(|p| p.sum().is_finite()) {
            Ok(record)
        } else {
            Err(Failure {
                kind: FailureKind::NotFinite,
                detail: "a pressure of the convergence study came out as NaN or infinite"
                    .to_owned(),
            })
        }
    }
}

/// The largest difference, each lane relative to its largest value in `exact`.
fn difference(found: &[Lanes], exact: &[Lanes]) -> f64 {
    let mut largest: f64 = 0.0;
    for lane in 0..LANES {
        let scale = exact.iter().fold(0.0, |max: f64, p| max.max(p.0[lane].abs()));
        for (a, b) in found.iter().zip(exact) {
            largest = largest.max((a.0[lane] - b.0[lane]).abs() / scale);
        }
    }
    largest
}
