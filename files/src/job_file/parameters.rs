//! `[parameters]`: the range of each parameter.

use osteon_common::bone_structure::BoneStructure;
use osteon_common::case::Setup;
use osteon_common::fields::Key;
use osteon_common::job::Range;
use osteon_common::parameters::{PARAMETERS, Parameter};

use crate::materials::{self, Base};
use crate::reader::{Reader, Table};

/// The keys of a range.
pub(super) const KEYS: [Key; 3] = [
    Key {
        name: "start",
        meaning: "value at which the search starts, within the bounds; by default, of a quantity of the setup: the value in the setup",
    },
    Key { name: "bounds", meaning: "`[lower, upper]` of a free parameter" },
    Key { name: "fixed", meaning: "instead of both: the value of a parameter that is held fixed" },
];

/// The key that stands in for ranges.
pub(super) const MATERIAL: Key = Key {
    name: materials::KEY,
    meaning: "name of a material (`osteon materials` lists them): parameters that are left out are fixed at its values, and those with `bounds` alone start there; the dispersion must be given",
};

/// Returns the ranges. If one is missing or wrong, this is recorded, and the range has no meaning.
/// Parameters of the setup start at its values, unless a start is given.
pub(super) fn read(reader: &mut Reader, root: &Table<'_>, setup: &Setup) -> [Range; PARAMETERS] {
    let mut keys = vec![MATERIAL.name];
    keys.extend(Parameter::ALL.map(Parameter::name));
    let table = reader.table(root, "parameters", &keys);
    if !table.is_table() {
        if !root.has("parameters") {
            let names = Parameter::OF_BONE.map(Parameter::name).join(", ");
            let message = format!("is missing; it must have the seven tables {names}");
            reader.lacks("parameters", &["parameters".to_owned()], message);
        }
        return [UNKNOWN; PARAMETERS];
    }
    let base = base(reader, &table, setup);
    Parameter::ALL.map(|parameter| match parameter.of_setup() {
        Some(quantity) => searched(reader, &table, parameter, quantity.value_in(setup)),
        None => range(reader, &table, parameter, base),
    })
}

/// Returns what stands in for parameters of the bone that are left out.
fn base(reader: &mut Reader, table: &Table<'_>, setup: &Setup) -> Base {
    let named = Base::read(reader, table);
    match named {
        Base::None if setup.structure.is_given() => Base::Matrix,
        // The bone may have refused sublayers.
        Base::None if reader.violations.has_at_or_below(BoneStructure::KEY.name) => Base::Unknown,
        Base::Known(_) if setup.structure.is_given() => {
            let message = "names a whole bone, and with bone.porosity or bone.sublayers the parameters are those of the bone \
                           between the pores; leave it out, and give those constants of it that \
                           you know";
            reader.violations.add(table.path(MATERIAL.name), message);
            Base::Unknown
        }
        _ => named,
    }
}

/// Placeholder for a range that could not be read; a violation is always recorded with it.
const UNKNOWN: Range = Range::Fixed(f64::NAN);

/// Reads a range, for which a material can stand in; numbers that cannot be read are recorded and
/// become NaN.
fn range(reader: &mut Reader, parameters: &Table<'_>, parameter: Parameter, base: Base) -> Range {
    let of_material = base.value(parameter);
    let key = parameter.name();
    let table = reader.table(parameters, key, &KEYS.map(|key| key.name));
    let path = parameters.path(key);
    if !table.is_table() {
        if let (false, Some(value)) = (parameters.has(key), of_material) {
            return Range::Fixed(value);
        }
        if !parameters.has(key) {
            let mut cures = vec![path.clone()];
            if parameter != Parameter::Dispersion {
                cures.push(parameters.path(MATERIAL.name));
            }
            reader.lacks(&path, &cures, format!("is missing; {RANGE_FORMS}"));
        }
        return UNKNOWN;
    }
    match (table.has("fixed"), table.has("start") || table.has("bounds")) {
        (true, false) => Range::Fixed(reader.number(&table, "fixed").unwrap_or(f64::NAN)),
        (false, true) => {
            if !table.has("start") && of_material.is_none() {
                reader.missing(&table, "start", format_args!("within the bounds; {RANGE_FORMS}"));
            }
            if !table.has("bounds") {
                reader.missing(&table, "bounds", format_args!("[lower, upper]; {RANGE_FORMS}"));
            }
            let [lower, upper] = bounds(reader, &table).unwrap_or([f64::NAN; 2]);
            let start = match (table.has("start"), base) {
                (true, _) => reader.number(&table, "start"),
                (false, Base::Unknown) => Some(lower),
                (false, _) => of_material,
            };
            let start = start.unwrap_or(f64::NAN);
            Range::Free { start, lower, upper }
        }
        (true, true) => {
            let message = format!("has fixed together with start or bounds; {RANGE_FORMS}");
            reader.violations.add(path, message);
            UNKNOWN
        }
        (false, false) => {
            let cures = ["fixed", "start", "bounds"].map(|key| table.path(key));
            reader.lacks(&path, &cures, format!("has no value; {RANGE_FORMS}"));
            UNKNOWN
        }
    }
}

/// Reads the range of a parameter of the setup; `in_setup` is the value that the setup gives it.
fn searched(
    reader: &mut Reader,
    parameters: &Table<'_>,
    parameter: Parameter,
    in_setup: Option<f64>,
) -> Range {
    let key = parameter.name();
    if !parameters.has(key) {
        return Range::AS_IN_SETUP;
    }
    let table = reader.table(parameters, key, &[KEYS[0].name, KEYS[1].name]);
    if !table.is_table() {
        return UNKNOWN;
    }
    if !table.has("bounds") {
        reader.missing(&table, "bounds", "[lower, upper], the limits of the search");
    }
    let start = match table.has("start") {
        true => reader.number(&table, "start"),
        // The checks require a value.
        false => Some(in_setup.unwrap_or(f64::NAN)),
    };
    let [lower, upper] = bounds(reader, &table).unwrap_or([f64::NAN; 2]);
    Range::Free { start: start.unwrap_or(f64::NAN), lower, upper }
}

const RANGE_FORMS: &str = "give either fixed, or start and bounds";

fn bounds(reader: &mut Reader, table: &Table<'_>) -> Option<[f64; 2]> {
    let expected = "[lower, upper]";
    let elements = reader.list(table, "bounds", expected)?;
    let path = table.path("bounds");
    let numbers = reader.numbers(&path, elements)?;
    let bounds = <[f64; 2]>::try_from(numbers).ok();
    if bounds.is_none() {
        let found = &table.get("bounds")?.value;
        let cure = match elements.len() {
            3 | 4 => "; numbers have a decimal point, not a comma",
            _ => "",
        };
        reader.violations.add(path, format!("is {found}; it must be {expected}{cure}"));
    }
    bounds
}
