//! One realization: from (point, seed, index) to the bone's material.

use thiserror::Error;

use crate::case::Bone;
use crate::elasticity::{Inadmissible, NotElastic};
use crate::ensemble::{ElasticityLaw, Germs, LawError};
use crate::parameters::Point;

/// The bones of one point of the search: everything that fixes the material at each index.
///
/// Whoever needs a realization, a worker or a user who wants to look at one, takes it from here:
/// the same point, seed and index give the same bits.
#[derive(Debug, Clone, PartialEq)]
pub struct Ensemble {
    density: f64,
    law: ElasticityLaw,
    seed: u64,
}

/// Why a point has no ensemble.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum PointError {
    /// The density or the engineering constants are not admissible.
    #[error("the mean model is not admissible: {0}")]
    Mean(#[from] Inadmissible),
    /// The dispersion is outside its range.
    #[error(transparent)]
    Law(#[from] LawError),
}

impl Ensemble {
    /// The ensemble at a point, with the seed of its job.
    ///
    /// # Errors
    /// The first violated condition: density, constants of the mean model, dispersion.
    pub fn new(point: &Point, seed: u64) -> Result<Self, PointError> {
        let density = point.density();
        if !(density > 0.0 && density.is_finite()) {
            return Err(Inadmissible::NotPositive { name: "density", value: density }.into());
        }
        let mean = point.constants().elasticity()?;
        Ok(Self { density, law: ElasticityLaw::new(&mean, point.dispersion())?, seed })
    }

    /// The bone at `index`.
    ///
    /// # Errors
    /// When the drawn matrix is not positive definite within rounding
    /// (see [`ElasticityLaw::realize`]).
    pub fn bone(&self, index: u64) -> Result<Bone, NotElastic> {
        let elasticity = self.law.realize(&Germs::draw(self.seed, index))?;
        Ok(Bone { density: self.density, elasticity })
    }
}
