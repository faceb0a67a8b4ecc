//! Summaries of measured data as messages.

use osteon_common::moments::{ConfidenceInterval, MomentIntervals, Outlier};
use osteon_common::results::DataSummary;

use crate::interval::{interval_from_message, interval_to_message};
use crate::malformed::Malformed;
use crate::moments::{
    decay_from_message, decay_to_message, moments_from_message, moments_to_message,
};
use crate::v1;

/// Returns the message of a summary.
pub(crate) fn data_to_message(data: &DataSummary) -> v1::DataSummary {
    let interval = |found: ConfidenceInterval| interval_to_message([found.low, found.high]);
    v1::DataSummary {
        moments: Some(moments_to_message(&data.moments)),
        count: data.count,
        intervals: data.intervals.map(|found| v1::MomentIntervals {
            mean: Some(interval(found.mean)),
            coefficient_of_variation: Some(interval(found.coefficient_of_variation)),
            level: found.level,
        }),
        outliers: data.outliers.iter().map(outlier_to_message).collect(),
        outlier_count: data.outlier_count,
        rounding: data.rounding,
        decay: data.decay.map(decay_to_message),
    }
}

/// Returns the summary of a message.
pub(crate) fn data_from_message(message: &v1::DataSummary) -> Result<DataSummary, Malformed> {
    let moments = message.moments.as_ref().ok_or(Malformed::Missing { field: "moments" })?;
    let interval = |message: Option<&v1::Interval>| {
        interval_from_message(message).map(|[low, high]| ConfidenceInterval { low, high })
    };
    let intervals = |found: &v1::MomentIntervals| {
        Ok(MomentIntervals {
            mean: interval(found.mean.as_ref())?,
            coefficient_of_variation: interval(found.coefficient_of_variation.as_ref())?,
            level: found.level,
        })
    };
    Ok(DataSummary {
        moments: moments_from_message(moments),
        decay: message.decay.map(decay_from_message),
        count: message.count,
        intervals: message.intervals.as_ref().map(intervals).transpose()?,
        outliers: message.outliers.iter().map(outlier_from_message).collect(),
        outlier_count: message.outlier_count,
        rounding: message.rounding,
    })
}

fn outlier_to_message(outlier: &Outlier) -> v1::Outlier {
    let Outlier { index, velocity, deviations } = *outlier;
    v1::Outlier { index, velocity, deviations }
}

fn outlier_from_message(message: &v1::Outlier) -> Outlier {
    let v1::Outlier { index, velocity, deviations } = *message;
    Outlier { index, velocity, deviations }
}
