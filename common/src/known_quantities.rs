//! Quantities of the setup that are known of one group of the data.

use crate::parameters::Parameter;

/// Values of those of [`Parameter::OF_SETUP`] that are known of a group: measured, say, in an image of
/// this bone.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct KnownQuantities([Option<f64>; Parameter::OF_SETUP.len()]);

impl KnownQuantities {
    /// Creates these from a value for each of [`Parameter::OF_SETUP`] that is known.
    pub const fn new(values: [Option<f64>; Parameter::OF_SETUP.len()]) -> Self {
        Self(values)
    }

    /// Returns the value of a parameter, if it is known.
    pub fn get(&self, parameter: Parameter) -> Option<f64> {
        self.given().find(|(given, _)| *given == parameter).map(|(_, value)| value)
    }

    /// Returns the parameters that are known, with their values.
    pub fn given(&self) -> impl Iterator<Item = (Parameter, f64)> + '_ {
        let each = Parameter::OF_SETUP.into_iter().zip(self.0);
        each.filter_map(|(parameter, value)| Some((parameter, value?)))
    }

    /// Returns whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.given().next().is_none()
    }
}
