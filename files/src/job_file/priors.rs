//! `[search.priors]`.

use osteon_common::fields::Key;
use osteon_common::job::Prior;
use osteon_common::parameters::{PARAMETERS, Parameter};

use crate::reader::{Reader, Table};

/// The keys of a prior.
pub(super) const KEYS: [Key; 2] = [
    Key {
        name: "value",
        meaning: "value expected from prior knowledge, within the bounds; the cost grows with the \
                  distance from it",
    },
    Key {
        name: "weight",
        meaning: "increase of the cost if the parameter is off by the full width of its bounds; \
                  above 0",
    },
];

/// Reads a table `{ value, weight }` for each parameter that has one; numbers that cannot be read
/// are recorded and become NaN.
pub(super) fn read(reader: &mut Reader, search: &Table<'_>) -> [Option<Prior>; PARAMETERS] {
    let table = reader.table(search, "priors", &Parameter::ALL.map(Parameter::name));
    Parameter::ALL.map(|parameter| {
        if !table.has(parameter.name()) {
            return None;
        }
        let prior = reader.table(&table, parameter.name(), &KEYS.map(|key| key.name));
        if !prior.is_table() {
            return None;
        }
        let [value, weight] = KEYS.map(|Key { name: key, .. }| {
            if !prior.has(key) {
                let expected = "a number; a prior has a value and a weight";
                reader.missing(&prior, key, expected);
            }
            reader.number(&prior, key).unwrap_or(f64::NAN)
        });
        Some(Prior { value, weight })
    })
}
