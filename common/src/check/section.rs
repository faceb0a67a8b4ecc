//! Checks the declared keys of a section, each by itself.

use crate::accepted::{Interval, WholeRange};
use crate::field_path::{element_path, entry_path};
use crate::fields::{
    Choice, Condition, DeclaredKey, DeclaredValue, Fields, Key, List, Number, Section, Whole,
    entries,
};
use crate::violations::Violations;

use super::value::{elements, known_wrong, number, quantity, whole};

/// Records each key of `section`, which is the table `name` of a file, whose value is not accepted
/// or looks as if it were in another unit. Keys that are not meaningful must have the values that they have in
/// `default`.
pub(crate) fn section(
    name: &str,
    section: &mut dyn Section,
    default: &mut dyn Section,
    violations: &mut Violations,
) {
    section.declare(&mut Checker { path: name.to_owned(), violations });
    meaningless(name, &entries(section), &entries(default), violations);
}

/// Records the keys of a table, and of the tables in it, that are not meaningful and yet differ from their
/// defaults.
fn meaningless(
    table: &str,
    entries: &[DeclaredKey],
    defaults: &[DeclaredKey],
    violations: &mut Violations,
) {
    for (entry, default) in entries.iter().zip(defaults) {
        let field = entry_path(table, entry.key.name);
        if let Some(condition) = entry.condition.as_ref().filter(|condition| !condition.holds)
            && entry.value != default.value
            && !known_wrong(&field, violations)
        {
            violations.add(field, condition.refusal.as_str());
        } else if let (DeclaredValue::Table(entries), DeclaredValue::Table(defaults)) =
            (&entry.value, &default.value)
        {
            meaningless(&field, entries, defaults, violations);
        }
    }
}

struct Checker<'v> {
    path: String,
    violations: &'v mut Violations,
}

impl Checker<'_> {
    fn one(&mut self, key: Key, value: f64, accepted: Number) {
        let field = entry_path(&self.path, key.name);
        match accepted.plausible {
            Some(range) => {
                quantity(&field, value, accepted.interval, range, self.violations);
            }
            None => number(&field, value, accepted.interval, self.violations),
        }
    }
}

impl Fields for Checker<'_> {
    fn number(&mut self, key: Key, field: &mut f64, accepted: Number) {
        self.one(key, *field, accepted);
    }

    fn optional_number(&mut self, key: Key, field: &mut Option<f64>, accepted: Number) {
        if let Some(value) = *field {
            self.one(key, value, accepted);
        }
    }

    fn whole(&mut self, key: Key, field: &mut dyn Whole, accepted: WholeRange) {
        let path = entry_path(&self.path, key.name);
        whole(&path, field.get(), accepted, self.violations);
    }

    fn boolean(&mut self, _: Key, _: &mut bool) {}

    fn choice(&mut self, _: Key, _: &mut dyn Choice) {}

    fn table(&mut self, key: Key, declare: &mut dyn FnMut(&mut dyn Fields)) {
        let path = entry_path(&self.path, key.name);
        declare(&mut Checker { path, violations: self.violations });
    }

    fn list(&mut self, key: Key, field: &mut dyn List) {
        let list = entry_path(&self.path, key.name);
        for index in 0..field.len() {
            let path = element_path(&list, index);
            field.element(index).declare(&mut Checker { path, violations: self.violations });
        }
    }

    fn numbers(&mut self, key: Key, field: &mut Vec<f64>, accepted: Interval, max: usize) {
        let path = entry_path(&self.path, key.name);
        if field.len() > max {
            let message = format!("has {} elements; at most {max} are accepted", field.len());
            return self.violations.add(path, message);
        }
        elements(&path, field, (accepted, "numbers"), self.violations);
    }

    fn only_if(&mut self, condition: &Condition, declare: &mut dyn FnMut(&mut dyn Fields)) {
        if condition.holds {
            declare(self);
        }
    }

    fn custom_table(&mut self, _: Key) {}
}
