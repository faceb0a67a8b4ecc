//! Random elasticity tensors, to the bit those of a job.

use numpy::{PyArray1, PyArray3, PyArrayMethods as _};
use osteon_common::bone::CaseBone;
use osteon_common::case::Setup;
use osteon_common::elasticity::Elasticity;
use osteon_common::ensemble::{ElasticityLaw, Germs};
use osteon_common::realization::Ensemble;
use pyo3::prelude::*;

use crate::errors;
use crate::parallel::ParallelMap;

/// Random bones around a mean, each a function of seed and index.
#[pyclass(name = "Ensemble", module = "osteon._native", frozen)]
pub(crate) struct PyEnsemble {
    source: Bones,
}

enum Bones {
    /// Any mean, with independent germs.
    Law { law: Box<ElasticityLaw>, seed: u64 },
    /// The start of a job, with its germs and its setup.
    Job { ensemble: Box<Ensemble>, setup: Box<Setup> },
}

impl PyEnsemble {
    /// Creates the ensemble of a job with this setup.
    ///
    /// # Errors
    /// If its bones have several tensors each.
    pub(crate) fn of_job(ensemble: Ensemble, setup: Setup) -> PyResult<Self> {
        if setup.structure.profile.is_given() || setup.structure.is_layered() {
            let message = "makes bone that changes through the thickness, so that each sublayer of a realization has a tensor of \
                           its own; `osteon draw` writes all of them";
            let field =
                if setup.structure.is_layered() { "bone.sublayers" } else { "bone.porosity" };
            return Err(errors::bad_input(field, message));
        }
        let (ensemble, setup) = (Box::new(ensemble), Box::new(setup));
        Ok(Self { source: Bones::Job { ensemble, setup } })
    }

    fn tensor(&self, index: u64) -> Result<Elasticity, String> {
        let refused = |error: String| format!("the tensor of realization {index} {error}");
        match &self.source {
            Bones::Law { law, seed } => {
                law.realize(&Germs::draw(*seed, index)).map_err(|error| refused(error.to_string()))
            }
            Bones::Job { ensemble, setup } => {
                let drawn = ensemble.realization(index, setup);
                match drawn.map_err(|error| refused(error.to_string()))?.bone {
                    CaseBone::Homogeneous(bone) => Ok(bone.elasticity),
                    CaseBone::Layered(_) => Err(refused("is one of each sublayer".to_owned())),
                }
            }
        }
    }
}

#[pymethods]
impl PyEnsemble {
    #[new]
    fn new(mean: [[f64; 6]; 6], dispersion: f64, seed: u64) -> PyResult<Self> {
        let mean =
            Elasticity::new(mean).map_err(|error| errors::bad_input("mean", error.to_string()))?;
        let law = ElasticityLaw::new(&mean, dispersion).map_err(|error| {
            let message = error.to_string();
            let message = message.strip_prefix("dispersion ").unwrap_or(&message);
            errors::bad_input("dispersion", message)
        })?;
        Ok(Self { source: Bones::Law { law: Box::new(law), seed } })
    }

    /// Draws the tensors of the indices from `first` on, as an array (n, 6, 6).
    fn draw<'py>(
        &self,
        py: Python<'py>,
        count: usize,
        first: u64,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        if first.checked_add(count as u64).is_none() {
            return Err(errors::bad_input("first", format!("is {first}; it is too large")));
        }
        let plan = ParallelMap { threads, progress: None };
        let drawn = plan.map(py, count, |index, (): &mut ()| self.tensor(first + index as u64))?;
        let mut numbers = Vec::with_capacity(36 * count);
        for tensor in drawn {
            let tensor = tensor.map_err(|detail| errors::no_velocity("not_finite", &detail))?;
            numbers.extend(tensor.rows().as_flattened());
        }
        PyArray1::from_vec(py, numbers).reshape([count, 6, 6])
    }
}
