//! The objects `velocity` and `data`: moments of the model and of the data, and what is known of them.

use osteon_common::moments::{
    ConfidenceInterval, FormTests, KolmogorovTest, ObservableEstimates, OrderTest, Outlier,
};
use osteon_common::observables::ObservableValues;
use osteon_common::results::{self, BestPoint, DataSummary, Estimate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{absent_or_nullable, finite_or_null};

/// One of the two moments of a set of velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// The mean.
    Mean,
    /// The coefficient of variation.
    CoefficientOfVariation,
}

impl Moment {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Mean, Self::CoefficientOfVariation];
}

/// A number for the mean of velocities, and one for their coefficient of variation; null where they are
/// not known.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Moments {
    /// The number for the mean: a velocity is in m/s, a relative error and a derivative have no unit.
    pub mean: Option<f64>,
    /// The number for the coefficient of variation; it has no unit.
    pub coefficient_of_variation: Option<f64>,
}

impl Moments {
    /// The number for one of them.
    pub fn get(&self, moment: Moment) -> Option<f64> {
        match moment {
            Moment::Mean => self.mean,
            Moment::CoefficientOfVariation => self.coefficient_of_variation,
        }
    }
}

impl From<results::Moments> for Moments {
    fn from(moments: results::Moments) -> Self {
        Self {
            mean: finite_or_null(moments.mean),
            coefficient_of_variation: finite_or_null(moments.coefficient_of_variation),
        }
    }
}

impl From<Option<results::Moments>> for Moments {
    fn from(moments: Option<results::Moments>) -> Self {
        moments.map(Self::from).unwrap_or_default()
    }
}

/// Moments of the model's velocities (m/s) at the best point; null where there is none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Velocity {
    /// The moments.
    #[serde(flatten)]
    pub moments: Moments,
    /// Standard errors of the moments by sampling, in their units.
    pub standard_error: Moments,
    /// Whether the moments are those that the control variate gives.
    pub controlled: Option<bool>,
    /// Change of the moments that is expected if the failed realizations had succeeded.
    pub failure_bias: Moments,
}

impl Velocity {
    /// Returns the moments with their standard errors, NaN where these are not known; `None` where there are
    /// no moments.
    pub fn estimate(&self) -> Option<Estimate> {
        let moments = |found: Moments, unknown: Option<f64>| {
            Some(results::Moments {
                mean: found.mean.or(unknown)?,
                coefficient_of_variation: found.coefficient_of_variation.or(unknown)?,
            })
        };
        Some(Estimate {
            moments: moments(self.moments, None)?,
            standard_error: moments(self.standard_error, Some(f64::NAN))?,
            controlled: self.controlled?,
        })
    }
}

impl From<Option<&BestPoint>> for Velocity {
    fn from(best: Option<&BestPoint>) -> Self {
        let estimate = best.and_then(|best| best.velocity);
        Self {
            moments: estimate.map(|estimate| estimate.moments).into(),
            standard_error: estimate.map(|estimate| estimate.standard_error).into(),
            controlled: estimate.map(|estimate| estimate.controlled),
            failure_bias: best.and_then(|best| best.failure_bias).into(),
        }
    }
}

/// Derivatives of the moments along a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MomentSlopes {
    /// Those of the logarithms of both moments of the velocities, by the parameter's logarithm.
    #[serde(flatten)]
    pub moments: Moments,
    /// Those of the means of other observables, relative to those of the data.
    #[serde(flatten)]
    pub observables: ObservableValues,
}

/// Moments of the data; where velocities were measured also their intervals, those far from
/// the others, and a test of the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Data {
    /// The moments, that of the mean in m/s.
    #[serde(flatten)]
    pub moments: Moments,
    /// Other measured observables, with the standard error of each mean by their scatter.
    #[serde(flatten)]
    pub observables: ObservableEstimates,
    /// Confidence intervals of the moments of the law that the velocities were drawn from; not there
    /// where only moments are known, and not `data.count`, null where the velocities give none.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "absent_or_nullable"
    )]
    pub interval: Option<Option<MomentIntervals>>,
    /// Kolmogorov–Smirnov test of the velocities against the model's; not there where only moments are
    /// known, null where there is no best point.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "absent_or_nullable"
    )]
    pub kolmogorov: Option<Option<KolmogorovTest>>,
    /// Tests of skewness and kurtosis against the model's; not there where `kolmogorov` is null, and for less than
    /// eight velocities.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form: Option<FormTests>,
    /// Test of whether neighbouring velocities are more alike than in a random order (Bartels' rank test); not
    /// there where only moments are known, for less than ten velocities, for sorted ones, and with subjects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<OrderTest>,
    /// The velocities farther from the median than 6 robust standard deviations (and than 6 + 300/n²
    /// for n of them), in their order, at most the first 100; not there where there is none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outliers: Vec<Outlier>,
    /// Number of all such velocities; not there where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outlier_count: Option<u64>,
    /// Step to which the velocities are rounded, m/s; not there where none is seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rounding: Option<f64>,
    /// Number of the velocities; only of groups.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "absent_or_nullable"
    )]
    pub count: Option<Option<u64>>,
}

impl Data {
    /// The data of the one set that a job has.
    pub(super) fn of_job(data: &DataSummary, best: Option<&BestPoint>) -> Self {
        let measured = data.count.is_some();
        let intervals = data.intervals.map(MomentIntervals::from);
        Self {
            moments: data.moments.into(),
            observables: data.observables,
            interval: (measured || intervals.is_some()).then_some(intervals),
            kolmogorov: measured.then(|| best.and_then(|best| best.kolmogorov)),
            form: best.and_then(|best| best.form),
            order: data.order,
            outliers: data.outliers.clone(),
            rounding: data.rounding,
            outlier_count: Some(data.outlier_count).filter(|count| *count > 0),
            count: None,
        }
    }

    /// The data of a group.
    pub(super) fn of_group(data: &DataSummary, best: Option<&BestPoint>) -> Self {
        Self { count: Some(data.count), ..Self::of_job(data, best) }
    }

    /// The intervals, where they are known.
    pub fn intervals(&self) -> Option<&MomentIntervals> {
        self.interval.as_ref()?.as_ref()
    }
}

/// Confidence intervals of both moments.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MomentIntervals {
    /// Lower and upper end for the mean, m/s.
    pub mean: [f64; 2],
    /// Lower and upper end for the coefficient of variation.
    pub coefficient_of_variation: [f64; 2],
    /// Probability with which each interval holds its moment.
    pub level: f64,
}

impl MomentIntervals {
    /// The interval of one of them.
    pub fn get(&self, moment: Moment) -> [f64; 2] {
        match moment {
            Moment::Mean => self.mean,
            Moment::CoefficientOfVariation => self.coefficient_of_variation,
        }
    }
}

impl From<osteon_common::moments::MomentIntervals> for MomentIntervals {
    fn from(found: osteon_common::moments::MomentIntervals) -> Self {
        let ends = |interval: ConfidenceInterval| [interval.low, interval.high];
        Self {
            mean: ends(found.mean),
            coefficient_of_variation: ends(found.coefficient_of_variation),
            level: found.level,
        }
    }
}
