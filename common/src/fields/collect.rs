//! The declared keys of a section with their values, as a list.

use crate::accepted::{Interval, WholeRange};

use super::{Choice, Condition, Fields, Key, List, Number, Section, Whole};

/// A declared key with its value.
#[derive(Debug, Clone, PartialEq)]
pub struct DeclaredKey {
    /// Name and meaning.
    pub key: Key,
    /// The value, and the values that are accepted.
    pub value: DeclaredValue,
    /// Condition under which the key is meaningful, if it has one.
    pub condition: Option<Condition>,
}

/// The value of a declared key, and the values that it accepts.
#[derive(Debug, Clone, PartialEq)]
pub enum DeclaredValue {
    /// A number; `None` if it is absent.
    Number(Option<f64>, Number),
    /// A whole number.
    Whole(u64, WholeRange),
    /// A Boolean.
    Boolean(bool),
    /// One of several names.
    Choice {
        /// The name of the value.
        chosen: &'static str,
        /// All names.
        names: Vec<&'static str>,
    },
    /// A table.
    Table(Vec<DeclaredKey>),
    /// A list of tables.
    List {
        /// The keys of each element.
        elements: Vec<Vec<DeclaredKey>>,
        /// Keys that every element has, with any values.
        keys: Vec<DeclaredKey>,
        /// Largest number of elements.
        max: usize,
    },
    /// A list of numbers, empty if it is absent.
    Numbers {
        /// The numbers.
        values: Vec<f64>,
        /// The numbers that are accepted.
        accepted: Interval,
        /// Largest number of them.
        max: usize,
    },
    /// A table that has code of its own.
    CustomTable,
}

impl DeclaredKey {
    /// Returns whether the key is meaningful with the values of the section.
    pub fn applies(&self) -> bool {
        self.condition.as_ref().is_none_or(|condition| condition.holds)
    }
}

/// Returns all keys of a section with their values.
///
/// ```
/// use osteon_common::fields::{DeclaredValue, entries};
/// use osteon_common::job::MonteCarlo;
///
/// let keys = entries(&mut MonteCarlo::default());
/// assert_eq!(keys[0].key.name, "realizations");
/// assert!(matches!(keys[0].value, DeclaredValue::Whole(2747, _)));
/// ```
pub fn entries(section: &mut dyn Section) -> Vec<DeclaredKey> {
    let mut collector = Collector::default();
    section.declare(&mut collector);
    collector.entries
}

/// Returns the names of declared keys.
pub fn names(declare: &mut dyn FnMut(&mut dyn Fields)) -> Vec<&'static str> {
    let mut collector = Collector::default();
    declare(&mut collector);
    collector.entries.iter().map(|entry| entry.key.name).collect()
}

#[derive(Debug, Default)]
struct Collector {
    entries: Vec<DeclaredKey>,
    condition: Option<Condition>,
}

impl Collector {
    fn push(&mut self, key: Key, value: DeclaredValue) {
        self.entries.push(DeclaredKey { key, value, condition: self.condition.clone() });
    }
}

impl Fields for Collector {
    fn number(&mut self, key: Key, field: &mut f64, accepted: Number) {
        self.push(key, DeclaredValue::Number(Some(*field), accepted));
    }

    fn optional_number(&mut self, key: Key, field: &mut Option<f64>, accepted: Number) {
        self.push(key, DeclaredValue::Number(*field, accepted));
    }

    fn whole(&mut self, key: Key, field: &mut dyn Whole, accepted: WholeRange) {
        self.push(key, DeclaredValue::Whole(field.get(), accepted));
    }

    fn boolean(&mut self, key: Key, field: &mut bool) {
        self.push(key, DeclaredValue::Boolean(*field));
    }

    fn choice(&mut self, key: Key, field: &mut dyn Choice) {
        self.push(key, DeclaredValue::Choice { chosen: field.name(), names: field.names() });
    }

    fn table(&mut self, key: Key, declare: &mut dyn FnMut(&mut dyn Fields)) {
        let mut inner = Self::default();
        declare(&mut inner);
        self.push(key, DeclaredValue::Table(inner.entries));
    }

    fn list(&mut self, key: Key, field: &mut dyn List) {
        let elements = (0..field.len()).map(|index| entries(field.element(index))).collect();
        let keys = entries(&mut *field.example());
        self.push(key, DeclaredValue::List { elements, keys, max: field.max() });
    }

    fn numbers(&mut self, key: Key, field: &mut Vec<f64>, accepted: Interval, max: usize) {
        self.push(key, DeclaredValue::Numbers { values: field.clone(), accepted, max });
    }

    fn only_if(&mut self, condition: &Condition, declare: &mut dyn FnMut(&mut dyn Fields)) {
        self.condition = Some(condition.clone());
        declare(self);
        self.condition = None;
    }

    fn custom_table(&mut self, key: Key) {
        self.push(key, DeclaredValue::CustomTable);
    }
}
