//! The cores of this worker as a [`Backend`].
//!
//! Realization i of a batch is drawn by [`Ensemble`] from (point, germs, i), and solved by
//! [`Solver::arrival`]; its bits depend on nothing else: not on the thread, the batch, or what was
//! computed before. A drawn tensor that is not positive definite in floating point, or a point
//! from which nothing can be drawn, is the failure `not_finite` of each realization concerned.

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use osteon_common::case::Setup;
use osteon_common::outcome::{FailureKind, Solved};
use osteon_common::realization::Ensemble;
use osteon_proto::batch::Work;
use osteon_solver::{Isa, Solver, Workspace};
use rayon::prelude::*;

use crate::backend::{Backend, Computed, Done, Task};
use crate::error::{PanickedCase, WorkerError};

/// Most solvers, each with up to 20 MB of tables, that a worker keeps. Where the jobs that take turns
/// have more setups than that, tables are made again, which is a small part of a batch's time.
const SOLVERS_MAX: usize = 2;

thread_local! {
    /// Scratch memory of one thread of the pool.
    static WORKSPACE: RefCell<Workspace> = RefCell::new(Workspace::default());
}

/// The cores of a worker.
#[derive(Debug)]
pub(crate) struct Cores {
    pool: rayon::ThreadPool,
    solvers: Arc<Solvers>,
    /// Batches that somebody waits for, and how to stop them.
    stops: BTreeMap<Task, StopFlag>,
}

/// Tells a computation to stop; looked at between realizations.
#[derive(Debug, Clone, Default)]
struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// Stops the computation.
    fn raise(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl Cores {
    /// A pool of `threads` threads that compute on `isa`.
    ///
    /// # Errors
    /// When the operating system gives none.
    pub(crate) fn new(threads: u32, isa: Isa) -> Result<Self, WorkerError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads as usize)
            .thread_name(|index| format!("realizations-{index}"))
            .build()
            .map_err(|source| WorkerError::Pool { threads, source })?;
        Ok(Self { pool, solvers: Arc::new(Solvers::new(isa)), stops: BTreeMap::new() })
    }
}

impl Backend for Cores {
    fn slots(&self) -> u32 {
        // Made from a `u32`.
        u32::try_from(self.pool.current_num_threads()).unwrap_or(u32::MAX)
    }

    fn start(&mut self, task: Task, work: Work, done: Done) {
        let stop = StopFlag::default();
        self.stops.insert(task, stop.clone());
        let solvers = Arc::clone(&self.solvers);
        self.pool.spawn_fifo(move || {
            let start = Instant::now();
            done(match compute(&work, &solvers, &stop) {
                Ok(solved) => {
                    Computed::Complete { solved, elapsed_s: start.elapsed().as_secs_f64() }
                }
                Err(Interrupted::Stopped) => Computed::Abandoned,
                Err(Interrupted::Panicked { case, message }) => {
                    Computed::Panicked { case, message }
                }
            });
        });
    }

    fn forget(&mut self, task: Task) {
        if let Some(stop) = self.stops.remove(&task) {
            stop.raise();
        }
    }
}

/// Why there is no answer.
enum Interrupted {
    Stopped,
    Panicked { case: Box<PanickedCase>, message: String },
}

/// The realizations in index order.
fn compute(work: &Work, solvers: &Solvers, stop: &StopFlag) -> Result<Vec<Solved>, Interrupted> {
    if stop.is_raised() {
        return Err(Interrupted::Stopped);
    }
    let indices = work.first..work.first + u64::from(work.count);
    let panicked = |index: u64, payload: Box<dyn std::any::Any + Send>| Interrupted::Panicked {
        case: Box::new(PanickedCase { index, germs: work.germs, point: work.point }),
        message: panic_message(payload.as_ref()),
    };
    let prepared = catch_unwind(AssertUnwindSafe(|| {
        (solvers.get(&work.setup), Ensemble::drawn(&work.point, work.germs))
    }));
    let (solver, ensemble) = prepared.map_err(|payload| panicked(work.first, payload))?;
    let Ok(ensemble) = ensemble else {
        return Ok(indices.map(|_| Solved::failed(FailureKind::NotFinite)).collect());
    };
    indices
        .into_par_iter()
        .map(|index| {
            if stop.is_raised() {
                return Err(Interrupted::Stopped);
            }
            catch_unwind(AssertUnwindSafe(|| realization(&solver, &ensemble, index)))
                .map_err(|payload| panicked(index, payload))
        })
        .collect()
}

fn realization(solver: &Solver, ensemble: &Ensemble, index: u64) -> Solved {
    let Ok(bone) = ensemble.bone(index) else {
        return Solved::failed(FailureKind::NotFinite);
    };
    match WORKSPACE.with_borrow_mut(|workspace| solver.arrival(&bone, workspace)) {
        Ok(arrival) => {
            Solved { outcome: Ok(arrival.velocity), estimated_error: arrival.estimated_error }
        }
        Err(failure) => Solved::failed(failure.kind),
    }
}

fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("no message").to_owned()
}

/// The solvers of the last few setups, the one used last in front.
#[derive(Debug)]
struct Solvers {
    isa: Isa,
    kept: Mutex<VecDeque<Arc<Solver>>>,
}

impl Solvers {
    fn new(isa: Isa) -> Self {
        Self { isa, kept: Mutex::default() }
    }

    /// The solver of `setup`; made once, even if several batches ask at a time.
    fn get(&self, setup: &Setup) -> Arc<Solver> {
        // A panic while the lock is held leaves the queue as it was: no half-made entry.
        let mut solvers = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let known = solvers.iter().position(|solver| solver.setup() == setup);
        let solver = match known.and_then(|position| solvers.remove(position)) {
            Some(solver) => solver,
            None => Arc::new(Solver::with_isa(setup, self.isa)),
        };
        solvers.truncate(SOLVERS_MAX - 1);
        solvers.push_front(Arc::clone(&solver));
        solver
    }
}

#[cfg(test)]
mod tests;
