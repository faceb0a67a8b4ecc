//! Parameters that are solved for, so that a point has given moments.
//!
//! The data fix the two moments far more closely than the prior does, so a point drawn from the
//! prior hardly ever matches them. Most parameters are therefore drawn from the prior, the moments
//! from the data's likelihood, and two parameters, the pivots, are solved for: the dispersion, for
//! the coefficient of variation, and another one for the mean velocity.

use osteon_common::bone_structure::BoneStructure;
use osteon_common::bulk_velocity::bulk_velocity;
use osteon_common::parameters::{PARAMETERS, Parameter, Point};

use super::prior::ParameterPrior;

/// The parameters that are solved for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pivots {
    /// For the mean velocity; `None` if no free parameter but the dispersion or the shear modulus
    /// influences it.
    pub(super) mean: Option<Parameter>,
    /// Whether the dispersion is solved for.
    pub(super) dispersion: bool,
}

impl Pivots {
    /// Chooses the pivots among the free parameters: for the mean velocity the one whose prior
    /// leaves it most uncertain, at the point `at` of the other medians, of a bone of this structure. The
    /// longitudinal Young modulus is chosen only if there is no other, because up to two of its values give
    /// the same velocity.
    pub(super) fn choose(priors: &[ParameterPrior], structure: &BoneStructure, at: &Point) -> Self {
        let gradient =
            structure.bulk_velocity(at).map_or([1.0; PARAMETERS], |velocity| velocity.gradient);
        let free = priors.iter().filter(|prior| influences_bulk_velocity(prior.parameter));
        let influence = |prior: &&ParameterPrior| {
            let whole = (gradient[prior.parameter as usize] * prior.middle_half()).abs();
            let last = prior.parameter == Parameter::LongitudinalYoungModulus;
            (!last, whole)
        };
        let mean = free.max_by(|a, b| {
            let ((a_first, a), (b_first, b)) = (influence(a), influence(b));
            a_first.cmp(&b_first).then(a.total_cmp(&b))
        });
        Self {
            mean: mean.map(|prior| prior.parameter),
            dispersion: priors.iter().any(|prior| prior.parameter == Parameter::Dispersion),
        }
    }

    /// Returns the number of solutions that a point may have.
    pub(super) fn branches(&self) -> usize {
        match self.mean {
            Some(Parameter::LongitudinalYoungModulus) => 2,
            _ => 1,
        }
    }
}

/// Returns whether √(c1111/ρ) of the mean solid depends on a parameter.
fn influences_bulk_velocity(parameter: Parameter) -> bool {
    let others = [Parameter::Dispersion, Parameter::LongitudinalShearModulus];
    let is_known = parameter.of_setup().is_none() || Parameter::OF_PORES.contains(&parameter);
    is_known && !others.contains(&parameter)
}

/// Returns the value of `pivot` with which ln √(c1111/ρ) at `point` is `logarithm`: exactly for one solid without
/// pores. For others it is near, and a few repetitions from the value found make it exact.
pub(super) fn solve(
    structure: &BoneStructure,
    point: &Point,
    pivot: Parameter,
    logarithm: f64,
    branch: usize,
) -> Option<f64> {
    if Parameter::OF_PORES.contains(&pivot) {
        let slope = structure.bulk_slope(point, pivot).ok()?;
        let step = (logarithm - structure.bulk_logarithm(point).ok()?) / slope;
        return Some(point.get(pivot) + step).filter(|value| value.is_finite());
    }
    // The pores change the logarithm by an amount that hardly depends on the pivot.
    let by_pores = structure.bulk_logarithm(point).ok()? - bulk_velocity(point).ok()?.logarithm;
    solve_solid(point, pivot, logarithm - by_pores, branch)
}

/// Returns the value of `pivot` with which `point` has this ln √(c1111/ρ), by the paper's Eq. (7), of a bone
/// without pores. Where no value gives it, another one, perhaps inadmissible, on which the caller's repetition does
/// not close. Bounds are not regarded. Of two values `branch` 0 is the larger. `None` if none is finite, or if this
/// parameter is no pivot.
fn solve_solid(point: &Point, pivot: Parameter, logarithm: f64, branch: usize) -> Option<f64> {
    let [density, e_l, nu_l, _, e_t, nu_t, ..] = point.0;
    let stiffness = density * libm::exp(2.0 * logarithm);
    let (a, b) = (1.0 - nu_t, 2.0 * e_t * nu_l * nu_l);
    // c1111 = e_L² a / (e_L a - b).
    // So b must be this.
    let wanted_b = e_l * a - e_l * e_l * a / stiffness;
    let value = match pivot {
        Parameter::Density => {
            let velocity = bulk_velocity(point).ok()?;
            density * libm::exp(2.0 * (velocity.logarithm - logarithm))
        }
        Parameter::LongitudinalYoungModulus => {
            let root = (0.25 * stiffness * stiffness - stiffness * b / a).max(0.0).sqrt();
            if branch == 0 { 0.5 * stiffness + root } else { 0.5 * stiffness - root }
        }
        Parameter::LongitudinalPoissonRatio => (wanted_b.max(0.0) / (2.0 * e_t)).sqrt(),
        Parameter::TransverseYoungModulus => wanted_b / (2.0 * nu_l * nu_l),
        Parameter::TransversePoissonRatio if stiffness <= e_l => -1.0,
        Parameter::TransversePoissonRatio => 1.0 - stiffness * b / (stiffness * e_l - e_l * e_l),
        _ => return None,
    };
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIMUM: Point =
        Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

    #[test]
    fn solutions_have_the_wanted_velocity() {
        for pivot in [
            Parameter::Density,
            Parameter::LongitudinalYoungModulus,
            Parameter::LongitudinalPoissonRatio,
            Parameter::TransverseYoungModulus,
            Parameter::TransversePoissonRatio,
        ] {
            let wanted = bulk_velocity(&OPTIMUM).unwrap().logarithm + 0.005;
            let value = solve_solid(&OPTIMUM, pivot, wanted, 0).unwrap();
            let mut point = OPTIMUM;
            point.0[pivot as usize] = value;
            let found = bulk_velocity(&point).unwrap().logarithm;
            assert!((found - wanted).abs() < 1e-12, "{pivot:?}: {found} {wanted}");
        }
    }

    #[test]
    fn two_longitudinal_moduli_may_have_one_velocity() {
        let wanted = bulk_velocity(&OPTIMUM).unwrap().logarithm;
        let pivot = Parameter::LongitudinalYoungModulus;
        let both = [0, 1].map(|branch| solve_solid(&OPTIMUM, pivot, wanted, branch).unwrap());
        assert!(both[0] > both[1]);
        assert!((both[0] / 17.717e9 - 1.0).abs() < 1e-12, "{both:?}");
    }
}
