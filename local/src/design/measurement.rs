//! Measurements that a design compares, and the texts by which users name them.

use std::fmt;
use std::str::FromStr;

use osteon_common::case::Setup;
use osteon_common::observables::Observable;
use osteon_common::parameters::Parameter;
use osteon_common::systematic::SystematicQuantity;
use thiserror::Error;

/// A measurement that may be added to a study.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measurement {
    /// The study has this number of velocities in all, and as many values of each observable that its data have.
    Velocities(u64),
    /// The velocities are those of both directions.
    BothDirections,
    /// As many velocities again, of other bones alike, at this centre frequency (Hz).
    Frequency(f64),
    /// As many velocities again, of other bones alike, with source and receivers at this height (m).
    Height(f64),
    /// The mean of an observable over the bones.
    Mean(Observable, Accuracy),
    /// A parameter that the job searches, by another method.
    Searched(Parameter, Accuracy),
    /// A quantity of the setup that the job says is not known exactly.
    OfSetup(SystematicQuantity, Accuracy),
}

/// Measurements that are made together.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasurementPlan(pub Vec<Measurement>);

/// Standard error of what is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Accuracy {
    /// As a fraction of the value.
    Relative(f64),
    /// In the unit of the value.
    Absolute(f64),
}

/// Why a text is no measurement.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NoMeasurement {
    /// Its name is none.
    #[error("{0:?} is no measurement; possible are {names}", names = names())]
    Name(String),
    /// Its number is missing.
    #[error("{0} needs a number: {0}={1}")]
    Missing(String, &'static str),
    /// It has a number that it does not need.
    #[error("both_directions takes no number, and has {0:?}")]
    Unneeded(String),
    /// Its number is none, or out of range.
    #[error("{name}={text} is not possible; {allowed}, e.g. {name}={example}")]
    Number {
        /// Name of the measurement.
        name: String,
        /// The text after the equals sign.
        text: String,
        /// What is allowed.
        allowed: String,
        /// An example of it.
        example: &'static str,
    },
}

/// Accepted numbers of velocities, and an example.
const COUNTS: (f64, f64, &str) = (5.0, 1e9, "1000");
/// Accepted frequencies, Hz.
const FREQUENCIES: (f64, f64, &str) = (1e4, 1e8, "0.5e6");
/// Accepted heights, m.
const HEIGHTS: (f64, f64, &str) = (1e-5, 0.1, "4e-3");
const ACCURACY: &str =
    "its standard error must be above 0, in its unit, or in per cent of its value";

impl FromStr for Measurement {
    type Err = NoMeasurement;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (name, number) = match text.split_once('=') {
            Some((name, number)) => (name.trim(), Some(number.trim())),
            None => (text.trim(), None),
        };
        let within = |range| number_within(name, number, range);
        match name {
            "velocities" => Ok(Self::Velocities(within(COUNTS)? as u64)),
            "both_directions" => match number {
                Some(number) => Err(NoMeasurement::Unneeded(number.to_owned())),
                None => Ok(Self::BothDirections),
            },
            "frequency" => within(FREQUENCIES).map(Self::Frequency),
            "height" => within(HEIGHTS).map(Self::Height),
            _ => measured_to(name, number),
        }
    }
}

impl FromStr for MeasurementPlan {
    type Err = NoMeasurement;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.split(',').map(str::parse).collect::<Result<_, _>>().map(Self)
    }
}

impl MeasurementPlan {
    /// Returns the text that is read as this plan.
    pub fn key(&self) -> String {
        self.0.iter().map(Measurement::key).collect::<Vec<String>>().join(",")
    }
}

impl Measurement {
    /// Returns the text that is read as this measurement.
    pub fn key(&self) -> String {
        let name = self.name();
        match self {
            Self::Velocities(count) => format!("{name}={count}"),
            Self::BothDirections => name.to_owned(),
            Self::Frequency(value) | Self::Height(value) => format!("{name}={value:?}"),
            Self::Mean(_, accuracy) | Self::Searched(_, accuracy) | Self::OfSetup(_, accuracy) => {
                format!("{name}={accuracy}")
            }
        }
    }

    /// Returns its name, without the number.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Velocities(_) => "velocities",
            Self::BothDirections => "both_directions",
            Self::Frequency(_) => "frequency",
            Self::Height(_) => "height",
            Self::Mean(observable, _) => observable.name(),
            Self::Searched(parameter, _) => parameter.name(),
            Self::OfSetup(quantity, _) => quantity.name(),
        }
    }

    /// Returns the setup in which it is made; `None` if that is the job's.
    pub(super) fn setup(&self, of_job: &Setup) -> Option<Setup> {
        let mut setup = of_job.clone();
        match *self {
            Self::BothDirections => setup.probe.bidirectional = true,
            Self::Frequency(frequency) => setup.probe.center_frequency = frequency,
            Self::Height(height) => {
                (setup.probe.source.x3, setup.probe.receivers.x3) = (height, height);
            }
            _ => return None,
        }
        Some(setup)
    }
}

impl Accuracy {
    /// Returns the standard error of a measurement of this value, in its unit.
    pub(super) fn standard_error(self, value: f64) -> f64 {
        match self {
            Self::Relative(part) => part * value.abs(),
            Self::Absolute(error) => error,
        }
    }
}

impl fmt::Display for Accuracy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Of a fraction such as 0.07 a hundred times as much is not quite 7.
            Self::Relative(part) => write!(f, "{}%", (1e10 * part).round() / 1e8),
            Self::Absolute(error) => write!(f, "{error:?}"),
        }
    }
}

/// Returns the measurement of what has this name to an accuracy.
fn measured_to(name: &str, number: Option<&str>) -> Result<Measurement, NoMeasurement> {
    let observable = Observable::from_name(name);
    let searched = Parameter::ALL.into_iter().find(|one| one.name() == name);
    let of_setup = SystematicQuantity::ALL.into_iter().find(|one| one.name() == name);
    if observable.is_none() && searched.is_none() && of_setup.is_none() {
        return Err(NoMeasurement::Name(name.to_owned()));
    }
    let accuracy = accuracy(name, number)?;
    // A thickness may be searched or uncertain; which of both is for the job to say.
    let measurement = observable.map(|one| Measurement::Mean(one, accuracy));
    let measurement = measurement.or(searched.map(|one| Measurement::Searched(one, accuracy)));
    measurement
        .or(of_setup.map(|one| Measurement::OfSetup(one, accuracy)))
        .ok_or_else(|| NoMeasurement::Name(name.to_owned()))
}

fn accuracy(name: &str, text: Option<&str>) -> Result<Accuracy, NoMeasurement> {
    let text = text.ok_or_else(|| NoMeasurement::Missing(name.to_owned(), "2%"))?;
    let (number, is_relative) = match text.strip_suffix('%') {
        Some(number) => (number.trim(), true),
        None => (text, false),
    };
    let value = number.parse().ok().filter(|value: &f64| *value > 0.0 && value.is_finite());
    let value = value.ok_or_else(|| NoMeasurement::Number {
        name: name.to_owned(),
        text: text.to_owned(),
        allowed: ACCURACY.to_owned(),
        example: "2%",
    })?;
    Ok(if is_relative { Accuracy::Relative(0.01 * value) } else { Accuracy::Absolute(value) })
}

fn number_within(
    name: &str,
    text: Option<&str>,
    (lower, upper, example): (f64, f64, &'static str),
) -> Result<f64, NoMeasurement> {
    let text = text.ok_or_else(|| NoMeasurement::Missing(name.to_owned(), example))?;
    let value = text.parse().ok().filter(|value: &f64| (lower..=upper).contains(value));
    value.ok_or_else(|| NoMeasurement::Number {
        name: name.to_owned(),
        text: text.to_owned(),
        allowed: format!("it must be from {lower:?} to {upper:?}"),
        example,
    })
}

/// Returns the names of all measurements.
fn names() -> String {
    let given = ["velocities", "both_directions", "frequency", "height"].into_iter();
    let observables = Observable::ALL.into_iter().map(Observable::name);
    let parameters = Parameter::ALL.into_iter().map(Parameter::name);
    let mut names: Vec<&str> = given.chain(observables).chain(parameters).collect();
    for name in SystematicQuantity::ALL.map(SystematicQuantity::name) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_are_read() {
        let check = |text: &str, expected: Measurement| {
            assert_eq!(text.parse(), Ok(expected), "{text}");
        };
        check("velocities=1000", Measurement::Velocities(1000));
        check("both_directions", Measurement::BothDirections);
        check("frequency = 0.5e6", Measurement::Frequency(0.5e6));
        check("height=4e-3", Measurement::Height(4e-3));
        check(
            "a0_velocity=1%",
            Measurement::Mean(Observable::A0Velocity, Accuracy::Relative(0.01)),
        );
        check("density=30", Measurement::Searched(Parameter::Density, Accuracy::Absolute(30.0)));
        check(
            "tilt=2e-3",
            Measurement::OfSetup(SystematicQuantity::Tilt, Accuracy::Absolute(2e-3)),
        );
        let both = "velocities=50,density=2%".parse::<MeasurementPlan>().unwrap();
        assert_eq!(both.key(), "velocities=50,density=2%");
    }

    #[test]
    fn what_is_no_measurement_is_named() {
        let check = |text: &str, words: &str| {
            let error = text.parse::<Measurement>().unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        };
        check("elasticity=2%", "\"elasticity\" is no measurement; possible are velocities,");
        check("velocities", "velocities needs a number: velocities=1000");
        check("velocities=4", "velocities=4 is not possible; it must be from 5.0 to 1000000000.0");
        check("both_directions=2", "takes no number");
        check("density=-2%", "above 0");
        check("density=nan", "above 0");
        check("", "\"\" is no measurement");
        check("frequency=1 MHz", "frequency=1 MHz is not possible");
        check("a0_velocity", "a0_velocity needs a number: a0_velocity=2%");
    }
}
