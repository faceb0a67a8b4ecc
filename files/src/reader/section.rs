//! Reads a section of a file: an implementation of [`Fields`] that, for each key that the section
//! declares, reads its value from a table of the file.

use osteon_common::field_path::element_path;
use osteon_common::fields::{
    self, Choice, Condition, DeclaredKey, DeclaredValue, Fields, Interval, Key, List, Number,
    Section, Whole, WholeRange,
};

use super::{Reader, Table};

/// Reads `section` from the table `name` of `root`, and returns the table. A key that is absent or
/// cannot be read leaves its field as it is; unknown keys and wrong types are recorded.
pub(crate) fn section<'a>(
    reader: &mut Reader,
    root: &Table<'a>,
    name: &str,
    section: &mut dyn Section,
) -> Table<'a> {
    let names = fields::names(&mut |fields| section.declare(fields));
    let table = reader.table(root, name, &names);
    section.declare(&mut TableReader { reader, table: table.clone() });
    table
}

struct TableReader<'r, 'a> {
    reader: &'r mut Reader,
    table: Table<'a>,
}

impl Fields for TableReader<'_, '_> {
    fn number(&mut self, key: Key, field: &mut f64, _: Number) {
        if let Some(number) = self.reader.number(&self.table, key.name) {
            *field = number;
        }
    }

    fn optional_number(&mut self, key: Key, field: &mut Option<f64>, _: Number) {
        if let Some(number) = self.reader.number(&self.table, key.name) {
            *field = Some(number);
        }
    }

    fn whole(&mut self, key: Key, field: &mut dyn Whole, accepted: WholeRange) {
        if let Some(whole) = self.reader.whole(&self.table, key.name, accepted) {
            field.set(whole);
        }
    }

    fn boolean(&mut self, key: Key, field: &mut bool) {
        if let Some(boolean) = self.reader.boolean(&self.table, key.name) {
            *field = boolean;
        }
    }

    fn choice(&mut self, key: Key, field: &mut dyn Choice) {
        self.reader.choice(&self.table, key.name, field);
    }

    fn table(&mut self, key: Key, declare: &mut dyn FnMut(&mut dyn Fields)) {
        let names = fields::names(declare);
        let table = self.reader.table(&self.table, key.name, &names);
        declare(&mut TableReader { reader: self.reader, table });
    }

    fn list(&mut self, key: Key, field: &mut dyn List) {
        let (path, max) = (self.table.path(key.name), field.max());
        let expected = format!("a list of 1 to {max} tables");
        let Some(nodes) = self.reader.list(&self.table, key.name, &expected) else { return };
        if !(1..=max).contains(&nodes.len()) {
            let message = format!("has {} elements; it must be {expected}", nodes.len());
            self.reader.violations.add(path, message);
            return;
        }
        field.resize(nodes.len());
        let keys = fields::entries(&mut *field.example());
        let names: Vec<_> = keys.iter().map(|entry| entry.key.name).collect();
        for (index, node) in nodes.iter().enumerate() {
            let table = self.reader.table_at(node, element_path(&path, index), &names);
            if table.is_table() {
                require(self.reader, &table, &keys);
            }
            field.element(index).declare(&mut TableReader { reader: self.reader, table });
        }
    }

    fn numbers(&mut self, key: Key, field: &mut Vec<f64>, _: Interval, max: usize) {
        let expected = format!("a list of at most {max} numbers");
        let path = self.table.path(key.name);
        let Some(nodes) = self.reader.list(&self.table, key.name, &expected) else { return };
        if let Some(numbers) = self.reader.numbers(&path, nodes) {
            *field = numbers;
        }
    }

    fn only_if(&mut self, condition: &Condition, declare: &mut dyn FnMut(&mut dyn Fields)) {
        if condition.holds {
            return declare(self);
        }
        // If the deciding key cannot be read, it is unknown whether these keys are meaningful.
        if self.reader.violations.has_at_or_below(&self.table.path(condition.decided_by)) {
            return;
        }
        for name in fields::names(declare).into_iter().filter(|name| self.table.has(name)) {
            self.reader.violations.add(self.table.path(name), condition.refusal.as_str());
        }
    }

    /// Such a table is read by its own code, see `crate::job_file`.
    fn custom_table(&mut self, _: Key) {}
}

/// Records the numbers among `keys` that `table` does not have.
fn require(reader: &mut Reader, table: &Table<'_>, keys: &[DeclaredKey]) {
    for DeclaredKey { key, value, .. } in keys {
        if let DeclaredValue::Number(_, accepted) = value
            && !table.has(key.name)
        {
            reader.missing(table, key.name, accepted.interval);
        }
    }
}
