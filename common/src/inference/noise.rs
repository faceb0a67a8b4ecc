//! Errors of the compared moments, for the data and for the model.

use crate::conclusions::NoiseErrors;
use crate::job::{Data, Measurements};
use crate::moments::{
    ComparedMoments, Estimate, MOMENTS, MomentMatrix, MomentVector, Moments, ObservableEstimates,
    moment_vector,
};
use crate::observables::Observable;
use crate::statistics;

/// Quantile of the standard normal law at 0.975.
pub(super) const NORMAL: f64 = 1.959_963_984_540_054;
/// Quantiles of Student's law with 1 to 5 degrees of freedom, where its expansion is too short.
const FEW: [f64; 5] = [
    12.706_204_736_174_7,
    4.302_652_729_749_46,
    3.182_446_305_283_71,
    2.776_445_105_197_8,
    2.570_581_835_636_31,
];

/// Covariances of the compared moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Noise of the data's moments; `None` if only the moments are known, and not the number of
    /// velocities behind them.
    pub data: Option<DataNoise>,
    /// Variances of the model's moments by sampling.
    pub model: MomentVector,
    /// Covariance of what is the same for all data and not known exactly.
    pub systematic: MomentMatrix,
}

/// Noise of the data's moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DataNoise {
    /// Covariance of the compared moments.
    pub covariance: MomentMatrix,
    /// Degrees of freedom: one less than there are independent velocities, or subjects.
    pub freedom: u64,
}

/// Fewest independent velocities, or subjects, whose scatter tells of that of their law: with fewer no
/// interval is stated, and their own noise gives no weights.
pub(crate) const PARTS_MIN: u64 = 5;

/// Returns the noise of set number `set` of the data, and of a model's estimates.
pub fn noise(
    data: &Data,
    set: usize,
    model: &Estimate,
    observables: &ObservableEstimates,
) -> Noise {
    let errors = model_errors(&data.compared(set), model, observables);
    Noise {
        data: data_noise(data, set),
        model: errors.map(|error| error * error),
        systematic: [[0.0; MOMENTS]; MOMENTS],
    }
}

/// Returns the relative standard errors, by sampling, of a model's moments in which it is compared with
/// these data.
pub fn model_errors(
    data: &ComparedMoments,
    model: &Estimate,
    observables: &ObservableEstimates,
) -> MomentVector {
    moment_vector(model.relative_errors(), |one| match (data.observables[one], observables[one]) {
        (Some(mean), Some(found)) => found.standard_error / mean,
        _ => 0.0,
    })
}

/// Returns the noise of set number `set` of the data; `None` if it is not known.
pub fn data_noise(data: &Data, set: usize) -> Option<DataNoise> {
    if let Measurements::Moments { mean, coefficient_of_variation, count } = data.measurements {
        let measured = Moments { mean, coefficient_of_variation };
        return of_normal_law(measured, data.moments(set), count?);
    }
    let velocities = data.set(set)?;
    // Less work where nothing else is compared.
    let covariance = match velocities.observables.which().is_empty() {
        true => of_velocities(statistics::covariance_of_logarithms(&velocities)?),
        false => with_decay_error(statistics::covariance_of_moments(&velocities)?, data, set),
    };
    Some(DataNoise { covariance, freedom: velocities.independent_count() as u64 - 1 })
}

/// Returns a covariance with the error that all decays of the data have in common.
fn with_decay_error(mut covariance: MomentMatrix, data: &Data, set: usize) -> MomentMatrix {
    if let Some(mean) = data.compared(set).observables[Observable::Decay] {
        let error = data.decay_error / mean;
        let axis = 2 + Observable::Decay as usize;
        covariance[axis][axis] += error * error;
    }
    covariance
}

/// Returns the noise that the moments of the velocities of set number `set` would have if these were
/// independent and had a normal law; `None` with subjects, or if their number is not known.
pub(super) fn normal_law_noise(data: &Data, set: usize) -> Option<DataNoise> {
    if let Measurements::Moments { .. } = data.measurements {
        return data_noise(data, set);
    }
    let given = data.set(set).filter(|given| given.subjects.is_none())?;
    let measured = statistics::moments(given.velocities)?;
    of_normal_law(measured, data.moments(set), given.velocities.len() as u64)
}

/// Returns the noise of the moments of `count` independent velocities with a normal law, given
/// their measured moments and those that are matched, without the instrument's own scatter.
fn of_normal_law(measured: Moments, matched: Moments, count: u64) -> Option<DataNoise> {
    if count < 2 {
        return None;
    }
    let ratio = measured.coefficient_of_variation / matched.coefficient_of_variation;
    let of_mean = measured.coefficient_of_variation * measured.coefficient_of_variation;
    let of_mean = of_mean / count as f64;
    // Mean and variance of a normal sample are independent. By the ratio's square a relative change
    // of the variance is larger for the part that is matched.
    let of_deviation = (ratio * ratio) * (ratio * ratio) / (2.0 * (count - 1) as f64);
    let covariance = of_velocities([[of_mean, -of_mean], [-of_mean, of_deviation + of_mean]]);
    covariance[1][1].is_finite().then_some(DataNoise { covariance, freedom: count - 1 })
}

impl Noise {
    /// Returns the covariance of all together.
    pub fn covariance(&self) -> MomentMatrix {
        let mut sum = self.systematic;
        if let Some(DataNoise { covariance, .. }) = self.data {
            let entries = sum.iter_mut().flatten().zip(covariance.iter().flatten());
            entries.for_each(|(sum, entry)| *sum += entry);
        }
        for (axis, variance) in self.model.into_iter().enumerate() {
            sum[axis][axis] += variance;
        }
        sum
    }

    /// Returns the standard errors of the moments of the velocities.
    pub fn errors(&self) -> NoiseErrors {
        let errors = |[mean, variation]: [f64; 2]| Moments {
            mean: mean.sqrt(),
            coefficient_of_variation: variation.sqrt(),
        };
        let of_data = |data: DataNoise| errors([data.covariance[0][0], data.covariance[1][1]]);
        let [mean, variation, ..] = self.model;
        NoiseErrors { data: self.data.map(of_data), sampling: errors([mean, variation]) }
    }

    /// Returns how many standard errors an interval extends to each side.
    pub fn quantile(&self) -> f64 {
        self.data.map_or(NORMAL, |data| student_quantile(data.freedom))
    }
}

/// Returns the covariance of the compared moments with this of (ln v, ln Δ), and none of observables.
pub(super) fn of_velocities(block: [[f64; 2]; 2]) -> MomentMatrix {
    let mut covariance = [[0.0; MOMENTS]; MOMENTS];
    covariance.iter_mut().zip(block).for_each(|(row, known)| row[..2].copy_from_slice(&known));
    covariance
}

/// Returns the quantile of Student's law at 0.975 with `freedom` degrees of
/// freedom, of which there is at least one: from a table for the first few, and then the first
/// terms of its expansion about the normal law's (Abramowitz and Stegun 1964, 26.7.5), accurate to
/// 1e-3.
pub(crate) fn student_quantile(freedom: u64) -> f64 {
    if let Some(&known) = FEW.get(freedom.max(1) as usize - 1) {
        return known;
    }
    let freedom = freedom as f64;
    let square = NORMAL * NORMAL;
    let terms = [
        (square + 1.0) / 4.0,
        ((5.0 * square + 16.0) * square + 3.0) / 96.0,
        (((3.0 * square + 19.0) * square + 17.0) * square - 15.0) / 384.0,
    ];
    let series = terms.iter().rev().fold(0.0, |sum, term| (sum + term) / freedom);
    NORMAL * (1.0 + series)
}
