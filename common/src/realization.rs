//! One realization: the bone's material, and its random setup, from (point, seed, index).

use thiserror::Error;

use crate::bone::CaseBone;
use crate::case::{Bone, Case, Setup};
use crate::elasticity::{Inadmissible, NotElastic};
use crate::ensemble::{ElasticityLaw, LawError};
use crate::germ_source::{GermMaker, GermSource};
use crate::parameters::Point;
use crate::porosity::NoPorousBone;
use crate::random_quantities::RandomQuantities;

/// The realizations of one point of the search: everything that determines the material at each index,
/// and how its setup differs from the job's.
///
/// All code that needs a realization uses this type, whether a worker or a user's inspection: the
/// same point, seed and index give the same bits.
#[derive(Debug, Clone, PartialEq)]
pub struct Ensemble {
    point: Point,
    law: ElasticityLaw,
    germs: GermMaker,
    random: RandomQuantities,
}

/// Reason why a point has no ensemble.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum PointError {
    /// The density or the engineering constants are not admissible.
    #[error("the mean model is not admissible: {0}")]
    Mean(#[from] Inadmissible),
    /// The dispersion is outside its range.
    #[error(transparent)]
    Law(#[from] LawError),
}

/// One realization: the setup and the bone that a solver is given.
#[derive(Debug, Clone, PartialEq)]
pub struct Realization {
    /// The setup, if it is not the one that was given.
    pub own_setup: Option<Setup>,
    /// The bone.
    pub bone: CaseBone,
}

/// Reason why a realization has no bone.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum NoBone {
    /// The drawn matrix is no elasticity.
    #[error(transparent)]
    NotElastic(#[from] NotElastic),
    /// The mean bone does not exist with the pores of this realization.
    #[error("is not defined: {0}")]
    Pores(#[from] NoPorousBone),
}

/// Returns the mean bone at a point, given the point's setup ([`Point::setup`]): the realization without
/// dispersion.
///
/// # Errors
/// If the mean model is not admissible, or has no stiffness with the pores of the setup.
pub fn mean_bone(point: &Point, setup: &Setup) -> Result<CaseBone, NoPorousBone> {
    setup.structure.bone(&point.mean_model(), setup.layers.bone_thickness, Ok)
}

impl Realization {
    /// Returns it as a case, whose setup is `given` unless it has its own.
    pub fn into_case(self, given: &Setup) -> Case {
        Case { setup: self.own_setup.unwrap_or_else(|| given.clone()), bone: self.bone }
    }
}

impl Ensemble {
    /// Creates the ensemble at a point, with independent germs of this seed.
    ///
    /// # Errors
    /// The first violated condition: density, constants of the mean model, dispersion.
    pub fn new(point: &Point, seed: u64) -> Result<Self, PointError> {
        Self::drawn(point, GermSource::streams(seed))
    }

    /// Creates the ensemble at a point, with the germs of its job.
    ///
    /// # Errors
    /// The first violated condition: density, constants of the mean model, dispersion.
    pub fn drawn(point: &Point, germs: GermSource) -> Result<Self, PointError> {
        let mean = point.mean_model().bone()?;
        let law = ElasticityLaw::new(&mean.elasticity, point.dispersion())?;
        let (germs, random) = (GermMaker::new(germs), RandomQuantities::default());
        Ok(Self { point: *point, law, germs, random })
    }

    /// Makes quantities of the setup random.
    #[must_use]
    pub fn with_random(self, random: RandomQuantities) -> Self {
        Self { random, ..self }
    }

    /// Returns the setup of the realization at `index`, given that of the job or that of its point;
    /// `None` if it is the one given, as no quantity is random or searched.
    pub fn own_setup(&self, index: u64, setup: &Setup) -> Option<Setup> {
        let of_point = self.point.setup(setup);
        if self.random.is_any() {
            return Some(self.random.draw(&of_point, &self.germs.setup_germs(index)));
        }
        (of_point != *setup).then_some(of_point)
    }

    /// Returns the setup of the realization at `index`, given that of the job.
    pub fn setup(&self, index: u64, setup: &Setup) -> Setup {
        self.own_setup(index, setup).unwrap_or_else(|| setup.clone())
    }

    /// Returns the realization at `index`, given the setup of the job or that of its point.
    ///
    /// All sublayers of a bone have the same `[G]`: the bone is stiffer or softer than its mean throughout.
    ///
    /// # Errors
    /// If the drawn matrix is not positive definite within rounding (see
    /// [`ElasticityLaw::realize`]), or if there is no mean bone with the pores of this realization.
    pub fn realization(&self, index: u64, setup: &Setup) -> Result<Realization, NoBone> {
        let own_setup = self.own_setup(index, setup);
        let Setup { structure, layers, .. } = own_setup.as_ref().unwrap_or(setup);
        if !structure.is_given() {
            return Ok(Realization { own_setup, bone: self.bone(index)?.into() });
        }
        let matrix = self.point.mean_model();
        let realize = self.law.realize_about(&self.germs.germs(index));
        let realized = |mean: Bone| -> Result<Bone, NoBone> {
            Ok(Bone { elasticity: realize(&mean.elasticity)?, ..mean })
        };
        let bone = structure.bone(&matrix, layers.bone_thickness, realized)?;
        Ok(Realization { own_setup, bone })
    }

    /// Returns the bone at `index` of a setup without pores and sublayers. What may have some needs
    /// [`Ensemble::realization`].
    ///
    /// # Errors
    /// If the drawn matrix is not positive definite within rounding (see
    /// [`ElasticityLaw::realize`]).
    pub fn bone(&self, index: u64) -> Result<Bone, NotElastic> {
        let elasticity = self.law.realize(&self.germs.germs(index))?;
        Ok(Bone { density: self.point.density(), elasticity })
    }

    /// Returns √(c1111/ρ), m/s, of the bones at 0, 1, … `count` - 1, to the bit. The other
    /// constants are not computed, which saves 99 % of the work. A speed may exist even if the
    /// whole bone does not.
    pub(crate) fn longitudinal_speeds(&self, count: u64) -> impl Iterator<Item = f64> {
        self.germs.first_germs(count).map(|germ| self.speed_of_germ(germ))
    }

    /// Returns √(c1111/ρ), m/s, of the bone at `index`, the same as [`Self::longitudinal_speeds`].
    pub(crate) fn longitudinal_speed(&self, index: u64) -> f64 {
        self.speed_of_germ(self.germs.first_germ(index))
    }

    fn speed_of_germ(&self, germ: f64) -> f64 {
        (self.law.c1111(germ) / self.point.density()).sqrt()
    }

    /// Returns mean, m/s, and variance, m²/s², of √(c1111/ρ) under the law.
    pub(crate) fn longitudinal_speed_moments(&self) -> (f64, f64) {
        let (mean, variance) = self.law.root_c1111_moments();
        (mean / self.point.density().sqrt(), variance / self.point.density())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::germ_source::GermScheme;
    use crate::random_quantities::Scatter;
    use crate::statistics;

    const OPTIMUM: Point =
        Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

    #[test]
    fn a_bone_is_a_function_of_point_seed_and_index() {
        let ensemble = Ensemble::new(&OPTIMUM, 7).unwrap();
        let bone = ensemble.bone(3).unwrap();
        assert_eq!(bone.density, 1598.8);
        assert_eq!(Ensemble::new(&OPTIMUM, 7).unwrap().bone(3).unwrap(), bone);
        assert_ne!(ensemble.bone(4).unwrap(), bone);
        assert_ne!(Ensemble::new(&OPTIMUM, 8).unwrap().bone(3).unwrap(), bone);
    }

    #[test]
    fn a_realization_has_the_porosity_of_its_own_setup() {
        let mut setup = Setup::default();
        let none = Ensemble::new(&OPTIMUM, 7).unwrap();
        let bone = none.bone(3).unwrap();
        let plain = Realization { own_setup: None, bone: bone.into() };
        assert_eq!(none.realization(3, &setup), Ok(plain));
        // Nearly without pores or dispersion, it is the mean model.
        setup.structure.porosity = Some(1e-9);
        let CaseBone::Homogeneous(porous) = none.realization(3, &setup).unwrap().bone else {
            panic!("one porosity");
        };
        let change = porous.elasticity.rows()[0][0] / bone.elasticity.rows()[0][0] - 1.0;
        assert!(change.abs() < 1e-7 && change != 0.0, "{change}");
        setup.structure.porosity = Some(0.1);
        let scatter = Scatter { standard_deviation: Some(0.02), ..Scatter::default() };
        let random = RandomQuantities { porosity: scatter, ..RandomQuantities::default() };
        let Realization { own_setup, bone } =
            none.with_random(random).realization(3, &setup).unwrap();
        let own = own_setup.and_then(|setup| setup.structure.porosity).unwrap();
        let CaseBone::Homogeneous(bone) = bone else { panic!("one porosity") };
        let expected = (1.0 - own) * OPTIMUM.density() + own * 1000.0;
        assert!(own != 0.1 && (bone.density - expected).abs() < 1e-9, "{own}");
    }

    #[test]
    fn longitudinal_speeds_are_those_of_the_bones() {
        for scheme in [GermScheme::Streams, GermScheme::Sobol { points: 3 }] {
            let ensemble = Ensemble::drawn(&OPTIMUM, GermSource { seed: 7, scheme }).unwrap();
            let of_bone = |index| {
                let bone = ensemble.bone(index).unwrap();
                (bone.elasticity.rows()[0][0] / bone.density).sqrt()
            };
            assert!(ensemble.longitudinal_speeds(20).eq((0..20).map(of_bone)), "{scheme:?}");
            let one_by_one = (0..20).map(|index| ensemble.longitudinal_speed(index));
            assert!(one_by_one.eq((0..20).map(of_bone)), "{scheme:?}");
        }
    }

    /// With 2¹⁶ scrambled points the mean is accurate to 1e-6 and the variance to 1e-4.
    #[test]
    fn moments_of_the_longitudinal_speed_are_those_of_its_law() {
        for dispersion in [0.02, 0.1029, 0.3, 0.79] {
            let mut point = OPTIMUM;
            point.0[6] = dispersion;
            let scheme = GermScheme::Sobol { points: 1 << 16 };
            let ensemble = Ensemble::drawn(&point, GermSource { seed: 3, scheme }).unwrap();
            let speeds: Vec<f64> = ensemble.longitudinal_speeds(1 << 16).collect();
            let found = statistics::moments(&speeds).unwrap();
            let (mean, variance) = ensemble.longitudinal_speed_moments();
            assert!((found.mean / mean - 1.0).abs() < 1e-6, "{dispersion}: {found:?} {mean}");
            let deviation = found.mean * found.coefficient_of_variation;
            let ratio = deviation * deviation / variance;
            assert!((ratio - 1.0).abs() < 1e-4, "{dispersion}: {ratio}");
        }
    }

    #[test]
    fn a_bad_point_is_named() {
        let check = |parameter: usize, value: f64, expected: &str| {
            let mut point = OPTIMUM;
            point.0[parameter] = value;
            let message = Ensemble::new(&point, 1).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        };
        check(0, 0.0, "density is 0; it must be above 0");
        check(0, f64::NAN, "density is NaN");
        check(0, f64::INFINITY, "density is inf");
        check(1, -1.0, "longitudinal_young_modulus is -1");
        check(2, 0.9, "e_L (1 - ν_T) - 2 e_T ν_L² is");
        check(5, 1.2, "transverse_poisson_ratio is 1.2");
        check(6, 0.8, "dispersion is 0.8; it must be above 0 and below √(7/11)");
    }
}
