//! Systematic errors: how far an error of each uncertain quantity of the setup moves the moments, and which
//! share of the variance of a result it causes.

use std::array;

use super::agreement::ModelAtPoint;
use super::jacobian::changes;
use super::linear::Linear;
use super::noise::Noise;
use crate::conclusions::{BudgetSource, VariancePart};
use crate::job::JobSpecification;
use crate::moments::{MOMENTS, MomentMatrix, MomentVector};
use crate::results::Evaluation;
use crate::systematic::{Shift, SystematicQuantity, Uncertain};

/// Changes of the compared moments by one standard deviation of each quantity.
pub(super) type Effects = Vec<(SystematicQuantity, MomentVector)>;

/// Returns the covariance of the compared moments by the setup at the best point of set number `set`, given the
/// evaluations of shifted setups; `None` if an effect was not measured.
pub fn systematic_covariance(
    specification: &JobSpecification,
    set: usize,
    best: ModelAtPoint<'_>,
    shifted: &[Evaluation],
) -> Option<MomentMatrix> {
    effects(specification, set, best, shifted).as_ref().map(covariance)
}

/// Returns the effects at the best point of set number `set`; `None` if one was not measured.
pub(super) fn effects(
    specification: &JobSpecification,
    set: usize,
    best: ModelAtPoint<'_>,
    history: &[Evaluation],
) -> Option<Effects> {
    let setup = best.point.setup(&specification.setup);
    let effect = |one: Uncertain| {
        let effect = match one.quantity {
            SystematicQuantity::VelocityOffset => {
                // The scatter of the velocities stays, so that relative to a higher mean it is less.
                let relative = one.above.value / specification.data.as_ref()?.moments(set).mean;
                of_velocities([relative, -relative])
            }
            _ => half_difference(&one, specification, set, best, history)?,
        };
        effect.iter().all(|change| change.is_finite()).then_some((one.quantity, effect))
    };
    specification.uncertain(&setup).into_iter().map(effect).collect()
}

/// Returns half the difference between one standard deviation above and below, or that from the best point
/// where one of the two has no moments.
fn half_difference(
    uncertain: &Uncertain,
    specification: &JobSpecification,
    set: usize,
    best: ModelAtPoint<'_>,
    history: &[Evaluation],
) -> Option<MomentVector> {
    let setup = best.point.setup(&specification.setup);
    let found = |shift: Shift| {
        let is_row = |row: &&Evaluation| row.belongs_to(set) && row.point.shift() == Some(shift);
        let mut found = changes(specification, set, best, history.iter().find(is_row)?)?;
        found[0] -= shift.pitch_logarithm(&setup);
        Some(found)
    };
    match (uncertain.below.and_then(found), found(uncertain.above)) {
        (Some(below), Some(above)) => {
            Some(array::from_fn(|axis| 0.5 * (above[axis] - below[axis])))
        }
        (Some(below), None) => Some(below.map(|change| -change)),
        (None, above) => above,
    }
}

/// Returns changes of the moments of the velocities alone.
fn of_velocities([mean, variation]: [f64; 2]) -> MomentVector {
    array::from_fn(|axis| match axis {
        0 => mean,
        1 => variation,
        _ => 0.0,
    })
}

/// Returns the covariance of the moments by independent effects.
pub(super) fn covariance(effects: &Effects) -> MomentMatrix {
    let mut sum = [[0.0; MOMENTS]; MOMENTS];
    for (_, effect) in effects {
        for (row, of_row) in sum.iter_mut().zip(effect) {
            row.iter_mut().zip(effect).for_each(|(entry, of_column)| *entry += of_row * of_column);
        }
    }
    sum
}

/// Returns the parts of the variance of a quantity with this gradient, which add up to 1; none if the
/// variance is 0 or not known.
pub(super) fn contributions(
    gradient: &[f64],
    linear: &Linear,
    noise: &Noise,
    effects: &Effects,
) -> Vec<VariancePart> {
    let Some(response) = linear.response(gradient, &noise.covariance()) else { return Vec::new() };
    let transfer = response.transfer;
    let of_data = noise.data.map_or(0.0, |data| quadratic(&transfer, &data.covariance));
    let of_sampling = transfer.iter().zip(noise.model).map(|(by, variance)| by * by * variance);
    let own = [(BudgetSource::Data, of_data), (BudgetSource::Sampling, of_sampling.sum())];
    let of_effect = |(source, effect): &(SystematicQuantity, MomentVector)| {
        let moved: f64 = transfer.iter().zip(effect).map(|(by, change)| by * change).sum();
        (BudgetSource::Systematic(*source), moved * moved)
    };
    let parts: Vec<_> = own.into_iter().chain(effects.iter().map(of_effect)).collect();
    let whole: f64 = parts.iter().map(|(_, variance)| variance).sum();
    if !(whole > 0.0 && whole.is_finite()) {
        return Vec::new();
    }
    let share = |(source, variance)| VariancePart { source, variance_share: variance / whole };
    parts.into_iter().map(share).collect()
}

/// Returns the variance of a quantity that changes by `transfer` with the moments.
pub(super) fn quadratic(transfer: &MomentVector, covariance: &MomentMatrix) -> f64 {
    let of_row = |row: &MomentVector| row.iter().zip(transfer).map(|(c, by)| c * by).sum::<f64>();
    transfer.iter().zip(covariance).map(|(by, row)| by * of_row(row)).sum()
}
