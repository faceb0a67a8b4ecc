//! Velocities of many bones at once.

use std::sync::Arc;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray3};
use osteon_common::case::{Bone, Setup};
use osteon_common::elasticity::Elasticity;
use osteon_common::outcome::{Outcome, encode};
use osteon_solver::{Solver, Workspace};
use pyo3::prelude::*;

use crate::case::{PyCase, density_of};
use crate::parallel::ParallelMap;
use crate::{errors, solvers};

/// Velocities, NaN where there is none, and the code of each failure, 0 where there is a velocity.
type PlainVelocities<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u8>>);

/// Computes the velocities of bones with these tensors (n, 6, 6) and densities (n), or one density, in
/// the setup of `case`.
#[pyfunction]
pub(crate) fn velocities_of_tensors<'py>(
    py: Python<'py>,
    tensors: PyReadonlyArray3<'py, f64>,
    densities: PyReadonlyArray1<'py, f64>,
    case: &PyCase,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<PlainVelocities<'py>> {
    let solver = solvers::kept_solver(py, &case.case.setup)?;
    let bones = bones(&tensors, &densities)?;
    let plan = ParallelMap { threads, progress };
    let outcomes = plan.map(py, bones.len(), |index, memory: &mut Workspace| {
        solver.outcome(&bones[index], memory)
    })?;
    Ok(arrays(py, &outcomes))
}

/// Computes the velocities of cases, each in its own setup.
#[pyfunction]
pub(crate) fn velocities_of_cases<'py>(
    py: Python<'py>,
    cases: Vec<Py<PyCase>>,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<PlainVelocities<'py>> {
    let cases: Vec<_> = cases.iter().map(|case| case.get().case.clone()).collect();
    // Runs of one setup are computed together, with tables that they share.
    let mut outcomes: Vec<Outcome> = Vec::with_capacity(cases.len());
    for group in cases.chunk_by(|one, next| one.setup == next.setup) {
        let setup: &Setup = &group[0].setup;
        let solver: Arc<Solver> = solvers::kept_solver(py, setup)?;
        let before = outcomes.len();
        let progress = match &progress {
            Some(progress) => Some(offset(py, progress, before)?),
            None => None,
        };
        let plan = ParallelMap { threads, progress };
        outcomes.extend(plan.map(py, group.len(), |index, memory: &mut Workspace| {
            solver.outcome(&group[index].bone, memory)
        })?);
    }
    Ok(arrays(py, &outcomes))
}

/// Returns a function that calls `progress` with a number larger by `before`.
fn offset(py: Python<'_>, progress: &Py<PyAny>, before: usize) -> PyResult<Py<PyAny>> {
    let progress = progress.clone_ref(py);
    let call = move |arguments: &Bound<'_, pyo3::types::PyTuple>,
                     _: Option<&Bound<'_, pyo3::types::PyDict>>|
          -> PyResult<()> {
        let complete: usize = arguments.get_item(0)?.extract()?;
        progress.call1(arguments.py(), (before + complete,)).map(drop)
    };
    Ok(pyo3::types::PyCFunction::new_closure(py, None, None, call)?.into_any().unbind())
}

/// Copies the arrays into bones, and checks them.
fn bones(
    tensors: &PyReadonlyArray3<'_, f64>,
    densities: &PyReadonlyArray1<'_, f64>,
) -> PyResult<Vec<Bone>> {
    let (tensors, densities) = (tensors.as_array(), densities.as_array());
    let (count, rows, columns) = tensors.dim();
    if [rows, columns] != [6, 6] {
        let found = format!("has the shape ({count}, {rows}, {columns}); it must be (n, 6, 6)");
        return Err(errors::bad_input("tensors", found));
    }
    if densities.len() != count && densities.len() != 1 {
        let found = densities.len();
        let message =
            format!("has {found} values; it must have one, or one for each of {count} tensors");
        return Err(errors::bad_input("densities", message));
    }
    let bone = |index: usize| {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| tensors[[index, i, j]]));
        let elasticity = Elasticity::new(rows)
            .map_err(|error| errors::bad_input(&format!("tensors[{index}]"), error.to_string()))?;
        let place = if densities.len() == 1 { 0 } else { index };
        let density = density_of(densities[place], &format!("densities[{place}]"))?;
        Ok(Bone { density, elasticity })
    };
    (0..count).map(bone).collect()
}

fn arrays<'py>(py: Python<'py>, outcomes: &[Outcome]) -> PlainVelocities<'py> {
    let velocity = |outcome: &Outcome| outcome.unwrap_or(f64::NAN);
    let velocities = outcomes.iter().map(velocity).collect();
    let codes = outcomes.iter().map(|outcome| encode(*outcome).0).collect();
    (PyArray1::from_vec(py, velocities), PyArray1::from_vec(py, codes))
}
