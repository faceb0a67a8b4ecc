//! Jobs: checked, and written as files that the program reads.

use std::path::{Path, PathBuf};

use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::version::Program;
use osteon_common::warnings::job_warnings;
use osteon_files::job_file;
use osteon_proto::specification;
use prost::Message as _;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::case::format_named;
use crate::ensemble::PyEnsemble;
use crate::errors;

/// A checked job of one kind.
#[pyclass(name = "CheckedJob", module = "osteon._native", frozen)]
pub(crate) struct PyJob {
    specification: JobSpecification,
}

/// A function that makes a job again, and its arguments: text, format, directory, kind.
type Reduced<'py> = (Bound<'py, PyAny>, (String, &'static str, &'static str, &'static str));

#[pymethods]
impl PyJob {
    /// Reads and checks a job file.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, kind: &str) -> PyResult<Self> {
        let kind = kind_named(kind)?;
        let found = errors::computed(py, || job_file::read(&path, kind))?;
        found.map(|specification| Self { specification }).map_err(|error| errors::of_file(&error))
    }

    /// Checks the text of a job file in `directory`.
    #[staticmethod]
    fn parse(
        py: Python<'_>,
        text: &str,
        format: &str,
        directory: PathBuf,
        kind: &str,
    ) -> PyResult<Self> {
        let (format, kind) = (format_named(format)?, kind_named(kind)?);
        let directory: &Path = &directory;
        let found = errors::computed(py, || job_file::parse(text, format, directory, kind))?;
        found
            .map(|specification| Self { specification })
            .map_err(|error| errors::of_content(&error))
    }

    /// The complete job file, with defaults and data, which reads back to the same bits.
    fn to_toml(&self, py: Python<'_>) -> PyResult<String> {
        errors::computed(py, || job_file::to_toml(&self.specification))
    }

    /// The job as an encoded message `osteon.v1.JobSpecification`.
    fn to_message<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let message = errors::computed(py, || {
            specification::to_message(&self.specification).encode_to_vec()
        })?;
        Ok(PyBytes::new(py, &message))
    }

    /// What is allowed but unusual.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        job_warnings(&self.specification).iter().map(ToString::to_string).collect()
    }

    /// Number of realizations of each evaluation.
    #[getter]
    fn realizations(&self) -> u64 {
        self.specification.monte_carlo.realizations
    }

    /// Names of the parameters that are searched.
    #[getter]
    fn free(&self) -> Vec<&'static str> {
        self.specification.free().map(|parameter| parameter.name()).collect()
    }

    /// Returns the random bones at the fixed values and starts.
    fn ensemble(&self) -> PyResult<PyEnsemble> {
        let specification = &self.specification;
        let ensemble = specification
            .ensemble(&specification.start())
            .map_err(|error| errors::bad_input("parameters", error.to_string()))?;
        PyEnsemble::of_job(ensemble, specification.setup.clone())
    }

    /// Copies and pickles it as its complete job file.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        let specification = &slf.get().specification;
        let text = job_file::to_toml(specification);
        let kind = specification.kind.name();
        Ok((slf.get_type().getattr("parse")?, (text, "toml", "", kind)))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.specification == other.specification
    }
}

fn kind_named(name: &str) -> PyResult<JobKind> {
    [JobKind::Identification, JobKind::Propagation]
        .into_iter()
        .find(|kind| kind.name() == name)
        .ok_or_else(|| {
            errors::bad_input(
                "kind",
                format!("is {name:?}; it must be identification or propagation"),
            )
        })
}

/// Returns version and numerics revision.
#[pyfunction]
pub(crate) fn version() -> (String, u32) {
    let Program { version, numerics, .. } = Program::current(None);
    (version, numerics)
}
