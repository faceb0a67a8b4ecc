//! The table of observables: what is computed of a realization, and may be measured, besides the
//! velocity of its first signal.
//!
//! Where a job has data of an observable, its mean over the realizations of the model is compared with its
//! mean over the data (`inference/weights.rs`). `CONTRIBUTING.md` lists what a new row needs.

use std::array;
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;
use std::ops::{Index, IndexMut};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::accepted::Interval;

/// Number of the observables.
pub const OBSERVABLES: usize = 5;

/// An observable besides the velocity of the first signal (docs/physics.md, "What else the first signal
/// tells" and "Guided waves of the bone"). The order of the variants is that of all lists, and of the digest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Observable {
    /// Velocity of the extremum that the picking does not choose, m/s.
    OtherVelocity,
    /// Decay of the picked extremum along the array, dB/cm.
    Decay,
    /// Frequency by the times of both extrema, Hz.
    CenterFrequency,
    /// Phase velocity of the guided wave A0 at the probe's frequency of guided waves, m/s.
    A0Velocity,
    /// Phase velocity of the guided wave S0 there, m/s.
    S0Velocity,
}

/// A row of the table: everything about an observable that is not computed.
#[derive(Debug)]
pub struct ObservableRow {
    /// Name in results, and of the key that names its column in `[data]`.
    pub name: &'static str,
    /// Name of the key in `[data]` that lists a value for each velocity, and word for several values.
    pub plural: &'static str,
    /// Its name in sentences.
    pub title: &'static str,
    /// Its name where there is little room.
    pub short: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Accepted measured values.
    pub accepted: Interval,
    /// Reason why the mean of the data must be above 0, for a message.
    pub above_zero: &'static str,
    /// Meaning of the key that names its column, for the reference of job files.
    pub of_column: &'static str,
    /// Meaning of the key that lists its values.
    pub of_list: &'static str,
}

const ROWS: [ObservableRow; OBSERVABLES] = [
    ObservableRow {
        name: "other_velocity",
        plural: "other_velocities",
        title: "velocity of the other extremum",
        short: "other velocity",
        unit: "m/s",
        accepted: Interval::from_to(100.0, 1e5, "m/s"),
        above_zero: "it is a velocity",
        of_column: "name of the CSV column that holds the velocity (m/s, 100 to 10⁵) of the extremum that \
                    `picking.extremum` does not choose, in every row; as for `decay`",
        of_list: "with a list of velocities: the velocity of the other extremum of each, m/s",
    },
    ObservableRow {
        name: "decay",
        plural: "decays",
        title: "decay along the array",
        short: "decay",
        unit: "dB/cm",
        accepted: Interval::from_to(-100.0, 100.0, "dB/cm"),
        above_zero: "a decay is positive where the pressure falls with the distance from the source",
        of_column: "name of the CSV column that holds the decay along the array (dB/cm, -100 to 100, with a \
                    mean above 0) measured with each velocity, in every row: the mean decay is matched beside \
                    the moments of the velocities, see [below](#other-observables); requires at least ten \
                    velocities, or subjects, in each group",
        of_list: "with a list of velocities: the decay of each, dB/cm, as for `decay`",
    },
    ObservableRow {
        name: "center_frequency",
        plural: "center_frequencies",
        title: "centre frequency of the first signal",
        short: "centre frequency",
        unit: "Hz",
        accepted: Interval::from_to(1e4, 1e8, "Hz"),
        above_zero: "it is a frequency",
        of_column: "name of the CSV column that holds the centre frequency of the first signal (Hz, 10⁴ to \
                    10⁸), in every row; as for `decay`",
        of_list: "with a list of velocities: the centre frequency of each, Hz",
    },
    ObservableRow {
        name: "a0_velocity",
        plural: "a0_velocities",
        title: "phase velocity of A0",
        short: "A0",
        unit: "m/s",
        accepted: Interval::from_to(10.0, 1e5, "m/s"),
        above_zero: "it is a velocity",
        of_column: "name of the CSV column that holds the phase velocity (m/s, 10 to 10⁵) of the guided wave \
                    A0 at `probe.guided_wave_frequency`, in every row; as for `decay`",
        of_list: "with a list of velocities: the phase velocity of A0 with each, m/s",
    },
    ObservableRow {
        name: "s0_velocity",
        plural: "s0_velocities",
        title: "phase velocity of S0",
        short: "S0",
        unit: "m/s",
        accepted: Interval::from_to(10.0, 1e5, "m/s"),
        above_zero: "it is a velocity",
        of_column: "name of the CSV column that holds the phase velocity (m/s, 10 to 10⁵) of the guided wave \
                    S0 at `probe.guided_wave_frequency`, in every row; as for `decay`",
        of_list: "with a list of velocities: the phase velocity of S0 with each, m/s",
    },
];

impl Observable {
    /// All observables, in their order.
    pub const ALL: [Self; OBSERVABLES] = [
        Self::OtherVelocity,
        Self::Decay,
        Self::CenterFrequency,
        Self::A0Velocity,
        Self::S0Velocity,
    ];

    /// Returns the row of the table.
    pub const fn row(self) -> &'static ObservableRow {
        &ROWS[self as usize]
    }

    /// Returns the name used in files and messages.
    pub const fn name(self) -> &'static str {
        self.row().name
    }

    /// Returns the observable with this name; `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.name() == name)
    }
}

/// A value for each observable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PerObservable<T>(pub [T; OBSERVABLES]);

/// The observables that a job needs of each realization.
pub type ObservableSet = PerObservable<bool>;

/// Means of those observables that are known.
pub type ObservableValues = PerObservable<Option<f64>>;

/// The values of those observables that there are, each in its unit, one for each velocity of data or for
/// each realization.
pub type ObservedColumns = PerObservable<Option<Vec<f64>>>;

/// The observables of one realization, each in its unit; 0 for one that was not asked for, and on failure.
pub type ObservedValues = PerObservable<f64>;

impl<T> PerObservable<T> {
    /// Returns a value for each observable by a function.
    pub fn new(value: impl FnMut(Observable) -> T) -> Self {
        Self(Observable::ALL.map(value))
    }

    /// Returns the result of a function for each value.
    pub fn map<U>(self, change: impl FnMut(T) -> U) -> PerObservable<U> {
        PerObservable(self.0.map(change))
    }

    /// Returns references to the values.
    pub fn as_ref(&self) -> PerObservable<&T> {
        PerObservable(self.0.each_ref())
    }

    /// Returns the observables with their values, in their order.
    pub fn iter(&self) -> impl Iterator<Item = (Observable, &T)> + Clone {
        Observable::ALL.into_iter().zip(&self.0)
    }
}

impl<T> PerObservable<Option<T>> {
    /// Creates values of which only this one is there.
    pub fn only(observable: Observable, value: T) -> Self {
        let mut values = Self::default();
        values[observable] = Some(value);
        values
    }

    /// Returns the values that there are, with their observables, in their order.
    pub fn present(&self) -> impl Iterator<Item = (Observable, &T)> + Clone {
        self.iter().filter_map(|(observable, value)| Some((observable, value.as_ref()?)))
    }

    /// Returns which observables have a value.
    pub fn which(&self) -> ObservableSet {
        PerObservable(self.0.each_ref().map(Option::is_some))
    }
}

impl ObservableSet {
    /// No observable.
    pub const NONE: Self = Self([false; OBSERVABLES]);

    /// Returns whether there is none.
    pub fn is_empty(&self) -> bool {
        *self == Self::NONE
    }

    /// Returns the observables, in their order.
    pub fn members(&self) -> impl Iterator<Item = Observable> + Clone {
        let all = self.0;
        Observable::ALL.into_iter().filter(move |one| all[*one as usize])
    }

    /// Returns their names in a sentence: "decay", "decay and centre frequency of the first signal".
    pub fn titles(&self) -> String {
        let titles: Vec<&str> = self.members().map(|one| one.row().title).collect();
        titles.join(" and ")
    }
}

impl ObservedValues {
    /// Those of a failure, or of a realization that was asked for none.
    pub const NONE: Self = Self([0.0; OBSERVABLES]);
}

impl<T> Index<Observable> for PerObservable<T> {
    type Output = T;

    fn index(&self, observable: Observable) -> &T {
        &self.0[observable as usize]
    }
}

impl<T> IndexMut<Observable> for PerObservable<T> {
    fn index_mut(&mut self, observable: Observable) -> &mut T {
        &mut self.0[observable as usize]
    }
}

impl<T: Default> Default for PerObservable<T> {
    fn default() -> Self {
        Self(array::from_fn(|_| T::default()))
    }
}

/// An object with a key for each value that there is.
impl<T: Serialize> Serialize for PerObservable<Option<T>> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.present().map(|(one, value)| (one.name(), value)))
    }
}

/// Keys that are not names of observables are left to the object around them.
impl<'de, T: Deserialize<'de>> Deserialize<'de> for PerObservable<Option<T>> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(PresentVisitor(PhantomData))
    }
}

struct PresentVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for PresentVisitor<T> {
    type Value = PerObservable<Option<T>>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object with values of observables")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut found = PerObservable::default();
        while let Some(key) = map.next_key::<String>()? {
            match Observable::from_name(&key) {
                Some(observable) => found[observable] = Some(map.next_value()?),
                None => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        Ok(found)
    }
}

impl<T: JsonSchema> JsonSchema for PerObservable<Option<T>> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("Observables_of_{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let property = |one: Observable| {
            let mut schema = generator.subschema_for::<T>();
            let ObservableRow { title, unit, .. } = one.row();
            let description =
                format!("The {title}, {unit}; not there where `[data]` has none of it.");
            schema.insert("description".to_owned(), description.into());
            (one.name(), schema)
        };
        let properties: BTreeMap<&str, Schema> =
            Observable::ALL.map(property).into_iter().collect();
        json_schema!({ "type": "object", "properties": properties })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Around {
        mean: f64,
        #[serde(flatten)]
        observables: PerObservable<Option<f64>>,
    }

    #[test]
    fn names_are_found_and_rows_stand_at_their_places() {
        for observable in Observable::ALL {
            assert_eq!(Observable::from_name(observable.name()), Some(observable));
        }
        assert_eq!(Observable::Decay.row().unit, "dB/cm");
        assert_eq!(Observable::from_name("velocity"), None);
    }

    #[test]
    fn only_values_that_there_are_are_keys_of_the_object_around_them() {
        let mut observables = PerObservable::default();
        observables[Observable::Decay] = Some(4.5);
        let around = Around { mean: 3900.0, observables };
        let text = serde_json::to_string(&around).unwrap();
        assert_eq!(text, r#"{"mean":3900.0,"decay":4.5}"#);
        assert_eq!(serde_json::from_str::<Around>(&text).unwrap(), around);
        assert_eq!(around.observables.which().titles(), "decay along the array");
    }
}
