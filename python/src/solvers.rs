//! The solvers of the last few setups, so that a loop of calls builds their tables once.

use std::collections::VecDeque;
use std::env;
use std::process;
use std::sync::{Arc, Mutex, PoisonError};

use osteon_common::case::Setup;
use osteon_solver::{Isa, Solver};
use pyo3::prelude::*;

use crate::errors;

/// Maximum number of solvers kept, each with up to 160 MB of tables.
const SOLVERS_MAX: usize = 2;

/// The solvers, the most recently used first, and the process that made them.
static KEPT: Mutex<(u32, VecDeque<Arc<Solver>>)> = Mutex::new((0, VecDeque::new()));

/// Returns the solver of `setup`, on the instruction set that the environment asks for.
///
/// The lock is held only while the interpreter is, so that a process that Python forks never finds it
/// locked. Solvers of the parent may have locked tables, and are left alone.
pub(crate) fn kept_solver(_interpreter: Python<'_>, setup: &Setup) -> PyResult<Arc<Solver>> {
    let isa = Isa::chosen(env::var_os(Isa::VARIABLE))
        .map_err(|error| errors::bad_input("", error.to_string()))?;
    // A panic while the lock is held leaves no half-finished entry.
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let (process, solvers) = &mut *kept;
    if *process != process::id() {
        *process = process::id();
        std::mem::forget(std::mem::take(solvers));
    }
    let known = solvers.iter().position(|solver| solver.setup() == setup && solver.isa() == isa);
    let solver = match known.and_then(|position| solvers.remove(position)) {
        Some(solver) => solver,
        None => Arc::new(Solver::with_isa(setup, isa)),
    };
    solvers.truncate(SOLVERS_MAX - 1);
    solvers.push_front(Arc::clone(&solver));
    Ok(solver)
}
