//! Declarations of the keys of job and case files.
//!
//! A [`Section`] declares each of its keys once: name, meaning, field, and accepted values. From
//! this follow reading and the refusal of unknown keys, checks of ranges and units, warnings, the
//! canonical text, the tables of `docs/job-files.md`, the JSON Schema of job files, and the messages
//! on the wire (in `osteon-proto`). Relations between several keys are rules of their own, in
//! [`crate::check`].

mod collect;

use crate::plausible::PlausibleRange;

pub use self::collect::{DeclaredKey, DeclaredValue, entries, names};
pub use crate::accepted::{Edge, Interval, WholeRange};

/// Name and meaning of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key {
    /// Name in a file and on the wire.
    pub name: &'static str,
    /// Meaning, and relations to other keys, in Markdown as part of a sentence. Default and
    /// accepted values are not repeated here.
    pub meaning: &'static str,
}

/// A part of a file with keys of its own.
pub trait Section {
    /// Declares every key to `fields`, in the order of a canonical file.
    ///
    /// Must declare the same keys whatever the values are. If the default of a key depends on an
    /// earlier one, the section sets it when that one has changed.
    fn declare(&mut self, fields: &mut dyn Fields);
}

/// One use of declared keys: it may read the fields or set them.
pub trait Fields {
    /// Declares a number.
    fn number(&mut self, key: Key, field: &mut f64, accepted: Number);

    /// Declares a number that may be absent.
    fn optional_number(&mut self, key: Key, field: &mut Option<f64>, accepted: Number);

    /// Declares a whole number.
    fn whole(&mut self, key: Key, field: &mut dyn Whole, accepted: WholeRange);

    /// Declares a Boolean.
    fn boolean(&mut self, key: Key, field: &mut bool);

    /// Declares a choice from a closed set of names.
    fn choice(&mut self, key: Key, field: &mut dyn Choice);

    /// Declares a table with keys of its own. `declare` may be called several times.
    fn table(&mut self, key: Key, declare: &mut dyn FnMut(&mut dyn Fields));

    /// Declares a list of tables.
    fn list(&mut self, key: Key, field: &mut dyn List);

    /// Declares a list of numbers, which may be absent; `max` is the largest number of them.
    fn numbers(&mut self, key: Key, field: &mut Vec<f64>, accepted: Interval, max: usize);

    /// Declares keys that are meaningful only under a condition on an earlier key.
    fn only_if(&mut self, condition: &Condition, declare: &mut dyn FnMut(&mut dyn Fields));

    /// Declares a table that has code of its own for each use.
    fn custom_table(&mut self, key: Key);
}

/// Condition under which keys are meaningful. If it does not hold, they keep their defaults.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Condition {
    /// Whether it holds.
    pub holds: bool,
    /// Name of the key that decides.
    pub decided_by: &'static str,
    /// The condition as part of a sentence, after "only".
    pub description: &'static str,
    /// Message that refuses one of the keys if it does not hold.
    pub refusal: String,
}

/// The numbers that a key accepts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Number {
    /// The interval of accepted numbers.
    pub interval: Interval,
    pub(crate) plausible: Option<&'static PlausibleRange>,
}

impl Number {
    /// Accepts an interval.
    pub(crate) const fn within(interval: Interval) -> Self {
        Self { interval, plausible: None }
    }

    /// Accepts an interval, with the unit and the prior knowledge of `plausible`.
    pub(crate) const fn plausible(interval: Interval, plausible: &'static PlausibleRange) -> Self {
        Self { interval, plausible: Some(plausible) }
    }

    /// Accepts numbers of at least `lower`, with the unit and the prior knowledge of `plausible`.
    pub(crate) const fn at_least(lower: f64, plausible: &'static PlausibleRange) -> Self {
        Self::plausible(Interval::from(lower, plausible.unit), plausible)
    }

    /// Accepts numbers above 0, with the unit and the prior knowledge of `plausible`.
    pub(crate) const fn above_zero(plausible: &'static PlausibleRange) -> Self {
        Self::plausible(Interval::above(0.0, plausible.unit), plausible)
    }
}

/// The type of a whole number.
pub trait Whole {
    /// Returns the number.
    fn get(&self) -> u64;

    /// Sets the number; one that does not fit is replaced by the largest.
    fn set(&mut self, value: u64);
}

impl Whole for u64 {
    fn get(&self) -> u64 {
        *self
    }

    fn set(&mut self, value: u64) {
        *self = value;
    }
}

impl Whole for u32 {
    fn get(&self) -> u64 {
        u64::from(*self)
    }

    fn set(&mut self, value: u64) {
        *self = Self::try_from(value).unwrap_or(Self::MAX);
    }
}

/// A list of tables that may be empty, and is by default. In a file, every number of an element must be
/// given.
pub trait List {
    /// Returns the number of elements.
    fn len(&self) -> usize;

    /// Returns whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the largest number of elements.
    fn max(&self) -> usize;

    /// Sets the number of elements, at most the largest, before the new ones are set.
    fn resize(&mut self, len: usize);

    /// Returns the element at `index`, which is less than the number of elements.
    fn element(&mut self, index: usize) -> &mut dyn Section;

    /// Returns an element that has the keys of all, and any values.
    fn example(&self) -> Box<dyn Section>;
}

/// A value of a closed set, each with a name.
pub trait Choice {
    /// Returns the names of all values, in the order of the documentation.
    fn names(&self) -> Vec<&'static str>;

    /// Returns the name of the value.
    fn name(&self) -> &'static str;

    /// Sets the value with this name; returns whether there is one.
    fn choose(&mut self, name: &str) -> bool;
}

/// Implements [`Choice`] for types with a constant `ALL` and a method `name`.
macro_rules! choices {
    ($($type:ty),+) => {$(
        impl crate::fields::Choice for $type {
            fn names(&self) -> Vec<&'static str> {
                Self::ALL.map(Self::name).to_vec()
            }

            fn name(&self) -> &'static str {
                Self::name(*self)
            }

            fn choose(&mut self, name: &str) -> bool {
                let chosen = Self::ALL.into_iter().find(|value| Self::name(*value) == name);
                chosen.inspect(|&value| *self = value).is_some()
            }
        }
    )+};
}

pub(crate) use choices;
