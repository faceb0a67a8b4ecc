//! The native module `osteon._native` of the Python package: the solver, the ensemble and the checks
//! of cases and jobs.
//!
//! Everything that a user sees is in `python/osteon`; this module has what Python cannot do itself. No
//! function here holds the interpreter while it computes, and none panics: what a computation's panic
//! would be is an exception.

#![forbid(unsafe_code)]

mod case;
mod ensemble;
mod errors;
mod job;
mod parallel;
mod solvers;
mod velocities;

/// The module.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use super::case::{PyCase, arrival, traces};
    #[pymodule_export]
    use super::ensemble::PyEnsemble;
    #[pymodule_export]
    use super::job::{PyJob, version};
    #[pymodule_export]
    use super::velocities::{velocities_of_cases, velocities_of_tensors};
}
