//! One deterministic case: the class `Case`, its first arrival, its traces.

use std::path::PathBuf;

use numpy::{PyArray1, PyArray2};
use osteon_common::bone::{Bone, CaseBone};
use osteon_common::case::Case;
use osteon_common::elasticity::Elasticity;
use osteon_common::warnings::case_warnings;
use osteon_files::case_file;
use osteon_files::document::Format;
use osteon_solver::Workspace;
use pyo3::prelude::*;
use pyo3::types::PyType;

use crate::{errors, solvers};

/// Layers, probe, picking, solver and bone: everything that a velocity depends on.
#[pyclass(name = "Case", module = "osteon._native", frozen)]
pub(crate) struct PyCase {
    /// The case.
    pub(crate) case: Case,
}

/// Velocity, velocities of both directions, times, amplitudes, estimated error.
type PlainArrival<'py> =
    (f64, Option<[f64; 2]>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, f64);

/// Times and pressures.
type PlainTraces<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

impl PyCase {
    /// Returns the solid of a bone without sublayers, of which `what` is asked for.
    fn homogeneous(&self, what: &str) -> PyResult<&Bone> {
        match &self.case.bone {
            CaseBone::Homogeneous(bone) => Ok(bone),
            CaseBone::Layered(_) => {
                let message = format!("have a {what} each; the bone as a whole has none");
                Err(errors::bad_input("bone.sublayers", message))
            }
        }
    }
}

#[pymethods]
impl PyCase {
    /// Reads and checks a case file (TOML or JSON).
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let case = errors::computed(py, || case_file::read(&path))?;
        case.map(|case| Self { case }).map_err(|error| errors::of_file(&error))
    }

    /// Checks the text of a case file; `format` is toml or json.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str, format: &str) -> PyResult<Self> {
        let format = format_named(format)?;
        let case = errors::computed(py, || case_file::parse(text, format))?;
        case.map(|case| Self { case }).map_err(|error| errors::of_content(&error))
    }

    /// The complete case file, which reads back to the same bits.
    fn to_toml(&self) -> String {
        case_file::to_toml(&self.case)
    }

    /// Density of the bone, kg/m³.
    #[getter]
    fn density(&self) -> PyResult<f64> {
        self.homogeneous("density").map(|bone| bone.density)
    }

    /// Elasticity of the bone, Pa, as an array (6, 6): Kelvin-Mandel, order 11 22 33 23 31 12.
    #[getter]
    fn tensor<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.homogeneous("tensor")?.elasticity.rows();
        PyArray2::from_vec2(py, &rows.map(|row| row.to_vec())).map_err(PyErr::from)
    }

    /// Positions x1 of the receivers along the bone, m.
    #[getter]
    fn receivers<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.case.setup.probe.receivers.positions().collect())
    }

    /// What is allowed but unusual.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        case_warnings(&self.case).iter().map(ToString::to_string).collect()
    }

    /// The same case with another bone of the same thickness, without sublayers: elasticity in Pa
    /// (6, 6), density in kg/m³.
    fn with_bone(&self, tensor: [[f64; 6]; 6], density: f64) -> PyResult<Self> {
        let elasticity = Elasticity::new(tensor)
            .map_err(|error| errors::bad_input("tensor", error.to_string()))?;
        let bone = Bone { density: density_of(density, "density")?, elasticity };
        Ok(Self { case: Case { setup: self.case.setup.clone(), bone: bone.into() } })
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.case == other.case
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (String, &'static str))> {
        let class: Bound<'py, PyType> = slf.get_type();
        Ok((class.getattr("parse")?, (slf.get().to_toml(), "toml")))
    }
}

/// Returns the format with this name.
pub(crate) fn format_named(name: &str) -> PyResult<Format> {
    match name {
        "toml" => Ok(Format::Toml),
        "json" => Ok(Format::Json),
        _ => Err(errors::bad_input("format", format!("is {name:?}; it must be toml or json"))),
    }
}

/// Checks a density, kg/m³.
pub(crate) fn density_of(density: f64, field: &str) -> PyResult<f64> {
    if density > 0.0 && density.is_finite() {
        return Ok(density);
    }
    Err(errors::bad_input(field, format!("is {density:?}; it must be above 0 (kg/m³)")))
}

/// Computes the first arrival of a case.
#[pyfunction]
pub(crate) fn arrival<'py>(py: Python<'py>, case: &PyCase) -> PyResult<PlainArrival<'py>> {
    let case = &case.case;
    let solver = solvers::kept_solver(py, &case.setup)?;
    let found = errors::computed(py, || solver.arrival(&case.bone, &mut Workspace::default()))?;
    let found = found.map_err(|failure| errors::of_failure(&failure))?;
    let array = |values| PyArray1::from_vec(py, values);
    let (times, amplitudes) = (array(found.times), array(found.amplitudes));
    Ok((found.velocity, found.directions, times, amplitudes, found.estimated_error))
}

/// Computes the pressures at the receivers of a case.
#[pyfunction]
pub(crate) fn traces<'py>(
    py: Python<'py>,
    case: &PyCase,
    duration: f64,
    time_step: f64,
) -> PyResult<PlainTraces<'py>> {
    let case = &case.case;
    let solver = solvers::kept_solver(py, &case.setup)?;
    let found = errors::computed(py, || solver.traces(&case.bone, duration, time_step))?;
    // The messages name the options of the command line.
    let named =
        |text: String| text.replace("--time-step", "time_step").replace("--duration", "duration");
    let found = found.map_err(|error| errors::bad_input("", named(error.to_string())))?;
    let pressures = PyArray2::from_vec2(py, &found.pressures)?;
    Ok((PyArray1::from_vec(py, found.times), pressures))
}
