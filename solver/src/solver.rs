//! One realization from bone to velocity.

use std::sync::OnceLock;

use osteon_common::case::{Bone, Setup};
use osteon_common::limits::SAMPLING_PAIRS_MAX;
use osteon_common::outcome::{FailureKind, Outcome};
use osteon_common::sampling::{self, RUNGS, Sampling};

use crate::complex::Complex;
use crate::isa::{Isa, Kernel};
use crate::lanes::{ComplexLanes, Lanes};
use crate::medium::Medium;
use crate::picking::{Window, pick};
use crate::plate::Plate;
use crate::response::Spectra;
use crate::signal::{Grid, Signal};
use crate::tables::Tables;

/// A bone may need this many times the pairs of the setup's usual sampling limit before it fails.
const PAIRS_MARGIN: f64 = 2.0;

/// Solves cases of one setup; holds the tables that all its realizations share.
#[derive(Debug)]
pub struct Solver {
    setup: Setup,
    distances: Vec<f64>,
    isa: Isa,
    /// One entry per rung of the speed ladder, made when a bone first needs it.
    rungs: [OnceLock<Option<Box<Rung>>>; RUNGS],
}

/// Shared tables of one rung.
#[derive(Debug)]
struct Rung {
    tables: Tables,
    grid: Grid,
}

/// Scratch memory of one thread; its contents never reach a result.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(crate) plate: Plate,
    pub(crate) spectra: Spectra,
    windows: Vec<Window>,
    slopes: Vec<ComplexLanes>,
}

/// A picked first arrival.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// Velocity of the first arriving signal, m/s.
    pub velocity: f64,
    /// Time of the picked extremum at each receiver, s.
    pub times: Vec<f64>,
}

/// Why a case has no velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// Its kind.
    pub kind: FailureKind,
    /// In a sentence, with the receiver named where there is one.
    pub detail: String,
}

impl Solver {
    /// A solver for cases of `setup`, which has passed validation.
    pub fn new(setup: &Setup) -> Self {
        Self::with_isa(setup, Isa::fastest())
    }

    /// The same, computing on one instruction set. The bits do not depend on it.
    pub fn with_isa(setup: &Setup, isa: Isa) -> Self {
        Self {
            setup: *setup,
            distances: sampling::distances(setup).collect(),
            isa,
            rungs: [const { OnceLock::new() }; RUNGS],
        }
    }

    /// The setup.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    pub(crate) fn isa(&self) -> Isa {
        self.isa
    }

    /// The first arrival of one bone.
    ///
    /// # Errors
    /// A typed failure when the case has no velocity.
    pub fn arrival(&self, bone: &Bone, workspace: &mut Workspace) -> Result<Arrival, Failure> {
        let medium = Medium::new(bone);
        let speed = medium.fastest.max(self.setup.layers.marrow.sound_speed);
        if !speed.is_finite() {
            return Err(not_finite("the bone's wave speeds"));
        }
        self.check_direct_wave(speed)?;
        let rung = self.rung(speed)?;
        let observed =
            self.isa.run(Observe { solver: self, rung, medium: &medium, speed, workspace });
        if !observed {
            return Err(not_finite("the pressure"));
        }
        let probe = &self.setup.probe;
        pick(&self.setup.picking, probe.center_frequency, &self.distances, &workspace.windows)
    }

    /// The same, reduced to what a job keeps.
    pub fn outcome(&self, bone: &Bone, workspace: &mut Workspace) -> Outcome {
        self.arrival(bone, workspace)
            .map(|arrival| arrival.velocity)
            .map_err(|failure| failure.kind)
    }

    /// Refuses, before anything is computed, bones through which nothing can come first.
    fn check_direct_wave(&self, speed: f64) -> Result<(), Failure> {
        for (r, &x) in self.distances.iter().enumerate() {
            let earliest = sampling::earliest_arrival(&self.setup, x, speed);
            let direct = sampling::direct_arrival(&self.setup, x);
            if earliest >= direct {
                return Err(Failure {
                    kind: FailureKind::DirectWaveFirst,
                    detail: format!(
                        "at receiver {} ({x} m from the source) the direct wave arrives at {:.3} µs, a wave \
                         through the bone not before {:.3} µs",
                        r + 1,
                        direct * 1e6,
                        earliest * 1e6
                    ),
                });
            }
        }
        Ok(())
    }

    fn rung(&self, speed: f64) -> Result<&Rung, Failure> {
        let too_large = || Failure {
            kind: FailureKind::NoConvergence,
            detail: format!(
                "waves of up to {speed:.0} m/s need more than {:.0e} (frequency, wavenumber) pairs",
                PAIRS_MARGIN * SAMPLING_PAIRS_MAX
            ),
        };
        let index = sampling::rung(&self.setup, speed).ok_or_else(too_large)?;
        let rung = self.rungs[index].get_or_init(|| {
            let sampling = Sampling::at_rung(&self.setup, index);
            if sampling.pairs() > PAIRS_MARGIN * SAMPLING_PAIRS_MAX {
                return None;
            }
            // A velocity does not depend on the pulse's amplitude, not even in its last bit.
            let tables = Tables::new(&self.setup, sampling, 1.0);
            let grid = Grid::new(&self.setup, &sampling, tables.frequencies.len());
            Some(Box::new(Rung { tables, grid }))
        });
        rung.as_deref().ok_or_else(too_large)
    }
}

/// Computes the pressure of one bone and lists its extrema at every receiver; whether every number
/// was finite.
struct Observe<'a> {
    solver: &'a Solver,
    rung: &'a Rung,
    medium: &'a Medium,
    /// Bound of every wave's speed, m/s.
    speed: f64,
    workspace: &'a mut Workspace,
}

impl Kernel for Observe<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let Workspace { plate, spectra, windows, slopes } = self.workspace;
        let (setup, tables) = (&self.solver.setup, &self.rung.tables);
        plate.fill(self.medium, setup.layers.bone_thickness);
        spectra.fill(tables, self.medium, plate);
        windows.resize_with(self.solver.distances.len(), Window::default);
        for (r, (window, &x)) in windows.iter_mut().zip(&self.solver.distances).enumerate() {
            let signal = Signal { sampling: &tables.sampling, spectrum: spectra.receiver(r) };
            let from = sampling::earliest_arrival(setup, x, self.speed);
            let to = sampling::direct_arrival(setup, x);
            signal.extrema(&self.rung.grid, from, to, slopes, &mut window.extrema);
            window.last = signal.at(to).abs();
            window.drop_noise();
        }
        spectra.is_finite()
    }
}

/// Admittance Y(k, s) = û3(0)/p̂(0), m/Pa, of the bone on its marrow.
///
/// `k` in rad/m, of either sign; `s` in 1/s with a positive real part.
pub fn admittance(setup: &Setup, bone: &Bone, k: f64, s: Complex) -> Complex {
    let medium = Medium::new(bone);
    let mut plate = Plate::default();
    plate.fill(&medium, setup.layers.bone_thickness);
    plate.prepare(&medium, s, k.abs());
    let load = crate::tables::marrow_load(setup, s, k, true);
    let lanes = |z: Complex| ComplexLanes { re: Lanes::splat(z.re), im: Lanes::splat(z.im) };
    let impedance = plate.impedance(Lanes::splat(k), lanes(load));
    -(Complex::new(1.0, 0.0) / Complex::new(impedance.re.0[0], impedance.im.0[0]))
}

fn not_finite(what: &str) -> Failure {
    Failure {
        kind: FailureKind::NotFinite,
        detail: format!(
            "{what} came out as NaN or infinite; density or elasticity is out of scale"
        ),
    }
}
