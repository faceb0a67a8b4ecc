//! What groups share: mean and scatter of each quantity, and the groups' values that follow.

use std::collections::{BTreeMap, BTreeSet};

use osteon_common::conclusions::{ErrorScale, Inference, QuantityErrors};
use osteon_common::parameters::Parameter;
use osteon_common::pooling::{GroupEstimate, POOLED_MIN, PooledNumber, Pooling};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::finite_or_null;

/// Errors of the quantities of one group, by their names.
type ErrorsOfGroup = BTreeMap<String, ScaledErrors>;

/// What the groups share.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct GroupPooling {
    /// Why nothing is pooled, in a sentence; null where something is.
    pub reason: Option<String>,
    /// The quantities: `bulk_velocity`, and free parameters.
    pub quantities: BTreeMap<String, SharedQuantity>,
    /// Groups that are not pooled, since they have no interval of their own.
    pub left_out: Vec<String>,
}

/// What the groups share of one quantity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SharedQuantity {
    /// Number of groups that are pooled.
    pub groups: u64,
    /// Mean over all groups like these; of a positive quantity the geometric mean.
    pub mean: PooledValue,
    /// Standard deviation of the true values between groups; of a positive quantity that of the logarithm, times
    /// the mean.
    pub scatter: PooledValue,
}

/// A value that was found with the help of other groups, in the unit of the quantity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PooledValue {
    /// The value.
    pub value: Option<f64>,
    /// Standard error.
    pub standard_error: Option<f64>,
    /// Lower and upper end of the 95 % interval.
    pub interval: [Option<f64>; 2],
}

impl PooledValue {
    /// Both ends of the interval, where they are finite.
    pub fn ends(&self) -> Option<[f64; 2]> {
        let [lower, upper] = self.interval;
        Some([lower?, upper?])
    }

    /// Returns a number on a scale in the unit of the quantity, whose values are within these limits.
    fn on_scale(scale: ErrorScale, number: PooledNumber, [least, most]: [f64; 2]) -> Self {
        let value = scale.quantity_at(number.value);
        let slope = match scale {
            ErrorScale::Logarithm => value,
            ErrorScale::Value => 1.0,
        };
        let end = |place: f64| finite_or_null(scale.quantity_at(place).clamp(least, most));
        Self {
            value: finite_or_null(value),
            standard_error: finite_or_null(slope * number.standard_error),
            interval: number.interval.map(end),
        }
    }

    /// Returns a number multiplied by a factor.
    fn scaled(number: PooledNumber, factor: f64) -> Self {
        let scaled = |one: f64| finite_or_null(factor * one);
        Self {
            value: scaled(number.value),
            standard_error: scaled(number.standard_error),
            interval: number.interval.map(scaled),
        }
    }
}

/// The value of a quantity of a group, partly its own, partly the mean of all.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PooledEstimate {
    /// The value.
    #[serde(flatten)]
    pub pooled: PooledValue,
    /// How much the group's own estimate counts, 0 to 1; the rest is that of the mean.
    pub own_weight: f64,
}

/// Errors of a quantity of a group, on a scale on which they are nearly normal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ScaledErrors {
    /// The scale: `logarithm`, or `value`.
    pub scale: ErrorScale,
    /// The estimate on that scale, corrected for the bias that a coefficient of variation of few velocities has.
    pub estimate: f64,
    /// Standard error by the noise of the group's own data.
    pub data: f64,
    /// Degrees of freedom behind it: one less than there are independent velocities, or subjects.
    pub freedom: u64,
    /// Change of the estimate by one standard error of each compared moment of the model, which sampling makes; the
    /// same errors in all groups.
    pub sampling: Vec<f64>,
    /// Change of the estimate by one standard deviation of each key of the job's `systematic`; the same errors in all
    /// groups.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub systematic: BTreeMap<String, f64>,
}

impl From<&QuantityErrors> for ScaledErrors {
    fn from(found: &QuantityErrors) -> Self {
        let systematic = found.systematic.iter();
        Self {
            scale: found.scale,
            estimate: found.estimate,
            data: found.data,
            freedom: found.freedom,
            sampling: found.sampling.clone(),
            systematic: systematic
                .map(|(source, moved)| (source.name().to_owned(), *moved))
                .collect(),
        }
    }
}

/// Returns the errors of all quantities of a group that are pooled.
pub(super) fn errors(found: &Inference) -> BTreeMap<String, ScaledErrors> {
    let named = |one: &QuantityErrors| (one.quantity.name().to_owned(), one.into());
    found.errors.iter().map(named).collect()
}

/// Pools groups, given by their names and errors. Returns what they share, and the values of each.
pub(super) fn pool(
    groups: &[(&str, &ErrorsOfGroup)],
) -> (GroupPooling, Vec<BTreeMap<String, PooledEstimate>>) {
    let left_out = groups.iter().filter(|(_, errors)| errors.is_empty());
    let left_out = left_out.map(|(name, _)| (*name).to_owned()).collect();
    let mut pooling = GroupPooling { left_out, ..GroupPooling::default() };
    let mut values = vec![BTreeMap::new(); groups.len()];
    let errors: Vec<&ErrorsOfGroup> = groups.iter().map(|(_, errors)| *errors).collect();
    let quantities: BTreeSet<&String> = errors.iter().flat_map(|errors| errors.keys()).collect();
    for quantity in quantities {
        let Some(pooled) = PooledGroups::new(&errors, quantity) else { continue };
        pooling.quantities.insert(quantity.clone(), pooled.shared());
        for (values, place) in values.iter_mut().zip(&pooled.places) {
            let estimate = place.map(|place| pooled.estimate(place));
            values.extend(estimate.map(|estimate| (quantity.clone(), estimate)));
        }
    }
    if pooling.quantities.is_empty() {
        let count = groups.len() - pooling.left_out.len();
        pooling.reason = Some(format!(
            "{count} of the groups have an interval of their own; the scatter between groups cannot be told from \
             fewer than {POOLED_MIN}"
        ));
    }
    (pooling, values)
}

/// The pooled groups of one quantity.
pub(crate) struct PooledGroups {
    scale: ErrorScale,
    limits: [f64; 2],
    pooling: Pooling,
    /// Place of each group among those that are pooled.
    places: Vec<Option<usize>>,
}

impl PooledGroups {
    /// Pools the groups with an interval of this quantity; `None` if there are too few.
    pub(crate) fn new(groups: &[&ErrorsOfGroup], name: &str) -> Option<Self> {
        let errors = || groups.iter().map(|errors| errors.get(name));
        let scale = errors().flatten().next()?.scale;
        let sources: BTreeSet<&String> =
            errors().flatten().flat_map(|one| one.systematic.keys()).collect();
        let estimate = |one: &ScaledErrors| {
            let moved = |source: &&String| one.systematic.get(*source).copied().unwrap_or(0.0);
            let common = one.sampling.iter().copied().chain(sources.iter().map(moved));
            GroupEstimate {
                value: one.estimate,
                error: one.data,
                freedom: one.freedom,
                common: common.collect(),
            }
        };
        let pooling = Pooling::new(errors().flatten().map(estimate).collect())?;
        let mut next = 0..;
        let places = errors().map(|one| one.and_then(|_| next.next())).collect();
        let accepted = Parameter::ALL.into_iter().find(|parameter| parameter.name() == name);
        let limits = accepted.map_or([f64::NEG_INFINITY, f64::INFINITY], |parameter| {
            parameter.row().accepted.limits()
        });
        Some(Self { scale, limits, pooling, places })
    }

    /// Returns the first group's value minus the second's, given by their numbers, with the ends of its interval;
    /// `None` if one of them is not pooled.
    pub(crate) fn difference(&self, first: usize, second: usize) -> Option<[f64; 3]> {
        let place = |group: usize| self.places.get(group).copied().flatten();
        let (first, second) = (place(first)?, place(second)?);
        let PooledNumber { value, interval: [low, high], .. } =
            self.pooling.difference(first, second);
        let numbers = [value, low, high];
        Some(match self.scale {
            ErrorScale::Value => numbers,
            ErrorScale::Logarithm => {
                // A ratio r of two numbers whose geometric mean is m is a difference of m (√r - 1/√r).
                let both = self.pooling.group(first).value + self.pooling.group(second).value;
                let twice = 2.0 * libm::exp(0.5 * both);
                numbers.map(|logarithm| twice * libm::sinh(0.5 * logarithm))
            }
        })
    }

    fn shared(&self) -> SharedQuantity {
        let mean = PooledValue::on_scale(self.scale, self.pooling.mean(), self.limits);
        let factor = match self.scale {
            ErrorScale::Logarithm => mean.value.unwrap_or(f64::NAN),
            ErrorScale::Value => 1.0,
        };
        let scatter = PooledValue::scaled(self.pooling.scatter(), factor);
        let groups = self.places.iter().flatten().count() as u64;
        SharedQuantity { groups, mean, scatter }
    }

    fn estimate(&self, place: usize) -> PooledEstimate {
        let number = self.pooling.group(place);
        PooledEstimate {
            pooled: PooledValue::on_scale(self.scale, number, self.limits),
            own_weight: self.pooling.own_weight(place),
        }
    }
}
