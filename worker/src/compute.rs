//! The processor cores of this worker as a [`Backend`].
//!
//! Realization i of a batch is drawn by [`Ensemble`] from (point, germs, i), and solved by
//! [`Solver::realization`]; its bits depend on nothing else: not on the thread, the batch, or earlier
//! computations. If a drawn tensor is not positive definite in floating point, or if no realization
//! can be drawn at the point, the outcome of each realization concerned is the failure
//! `not_finite`.

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use osteon_common::case::Setup;
use osteon_common::outcome::{FailureKind, RealizationResult};
use osteon_common::realization::Ensemble;
use osteon_proto::batch::Work;
use osteon_solver::{Isa, Solver, Workspace};
use rayon::prelude::*;

use crate::backend::{Backend, Computed, Done, Task};
use crate::error::{PanickedCase, WorkerError};

/// Maximum number of solvers that a worker keeps, each with up to 160 MB of tables. If the jobs that
/// take turns have more setups than that, tables are rebuilt, which takes a small part of a batch's
/// time.
const SOLVERS_MAX: usize = 2;

thread_local! {
    /// Scratch memory of one thread of the pool.
    static WORKSPACE: RefCell<Workspace> = RefCell::new(Workspace::default());
}

/// The processor cores of a worker.
#[derive(Debug)]
pub(crate) struct Cores {
    pool: rayon::ThreadPool,
    solvers: Arc<Solvers>,
    /// Stop flags of the unfinished batches that are still needed.
    stops: BTreeMap<Task, StopFlag>,
}

/// Requests that a computation stop; checked between realizations.
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
    /// Creates a pool of `threads` threads that compute on `isa`.
    ///
    /// # Errors
    /// If the operating system cannot create the threads.
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
        // This cannot fail: the pool was created with a `u32` number of threads.
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

/// Reason why a batch was not completed.
enum Interrupted {
    Stopped,
    Panicked { case: Box<PanickedCase>, message: String },
}

/// Computes the realizations of a batch, in index order.
fn compute(
    work: &Work,
    solvers: &Solvers,
    stop: &StopFlag,
) -> Result<Vec<RealizationResult>, Interrupted> {
    if stop.is_raised() {
        return Err(Interrupted::Stopped);
    }
    let Work { evaluation, first, count } = work;
    let indices = *first..first + u64::from(*count);
    let panicked = |index: u64, payload: Box<dyn std::any::Any + Send>| Interrupted::Panicked {
        case: Box::new(PanickedCase { index, germs: evaluation.germs, point: evaluation.point }),
        message: panic_message(payload.as_ref()),
    };
    let prepared = catch_unwind(AssertUnwindSafe(|| {
        let ensemble = Ensemble::drawn(&evaluation.point, evaluation.germs);
        let ensemble = ensemble.map(|ensemble| ensemble.with_random(evaluation.random));
        (solvers.get(&evaluation.point.setup(&evaluation.setup)), ensemble)
    }));
    let (solver, ensemble) = prepared.map_err(|payload| panicked(*first, payload))?;
    let Ok(ensemble) = ensemble else {
        return Ok(indices.map(|_| RealizationResult::failed(FailureKind::NotFinite)).collect());
    };
    indices
        .into_par_iter()
        .map(|index| {
            if stop.is_raised() {
                return Err(Interrupted::Stopped);
            }
            catch_unwind(AssertUnwindSafe(|| {
                WORKSPACE.with_borrow_mut(|memory| {
                    solver.realization_with(evaluation.observables, &ensemble, index, memory)
                })
            }))
            .map_err(|payload| panicked(index, payload))
        })
        .collect()
}

fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("no message").to_owned()
}

/// The solvers of the last few setups, the most recently used first.
#[derive(Debug)]
struct Solvers {
    isa: Isa,
    kept: Mutex<VecDeque<Arc<Solver>>>,
}

impl Solvers {
    fn new(isa: Isa) -> Self {
        Self { isa, kept: Mutex::default() }
    }

    /// Returns the solver of `setup`, which is created once even if several batches request it at
    /// the same time, and shares the tables of a kept one if it can.
    fn get(&self, setup: &Setup) -> Arc<Solver> {
        // A panic while the lock is held leaves no half-finished entry in the queue.
        let mut solvers = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let known = solvers.iter().position(|solver| solver.setup() == setup);
        let solver = match known.and_then(|position| solvers.remove(position)) {
            Some(solver) => solver,
            None => {
                let sharing = solvers.iter().find_map(|solver| solver.sharing_tables(setup));
                Arc::new(sharing.unwrap_or_else(|| Solver::with_isa(setup, self.isa)))
            }
        };
        solvers.truncate(SOLVERS_MAX - 1);
        solvers.push_front(Arc::clone(&solver));
        solver
    }
}

#[cfg(test)]
mod tests;
