//! The keys of one solid: of a bone, or of one of its sublayers.

use osteon_common::bone::Bone;
use osteon_common::check;
use osteon_common::elasticity::{Elasticity, EngineeringConstants};
use osteon_common::field_path::element_path;
use osteon_common::parameters::Parameter;
use osteon_common::porosity::POROSITY;

use crate::document::{Node, Value};
use crate::materials::{self, Base};
use crate::reader::{Reader, Table};

/// The five engineering constants as keys.
const CONSTANTS: [Parameter; 5] = [
    Parameter::LongitudinalYoungModulus,
    Parameter::LongitudinalPoissonRatio,
    Parameter::LongitudinalShearModulus,
    Parameter::TransverseYoungModulus,
    Parameter::TransversePoissonRatio,
];

/// The keys of a solid; the porosity stands in for all others.
pub(crate) const KEYS: [&str; 9] = {
    let [a, b, c, d, e] = CONSTANTS;
    let density = Parameter::Density.name();
    let [a, b, c, d, e] = [a.name(), b.name(), c.name(), d.name(), e.name()];
    [materials::KEY, density, "mandel", a, b, c, d, e, POROSITY.name]
};

/// Reads the density and the elasticity in `table`; `None` after recording the violations.
pub(crate) fn solid(reader: &mut Reader, table: &Table<'_>) -> Option<Bone> {
    let base = Base::read(reader, table);
    let named = table.has(materials::KEY).then_some(materials::KEY);
    let given =
        named.or_else(|| CONSTANTS.map(Parameter::name).into_iter().find(|key| table.has(key)));
    // Matrices are written by programs and may have any scale; constants are typed by people, so
    // their unit is checked.
    let density = required(reader, table, Parameter::Density, base, given.is_some());
    let elasticity = match (table.has("mandel"), given) {
        (true, None) => mandel(reader, table),
        (true, Some(other)) => {
            let cure = match other {
                materials::KEY => "leave one of them out".to_owned(),
                _ => format!("give {FORMS}, not both"),
            };
            reader
                .violations
                .add(table.path("mandel"), format!("is given together with {other}; {cure}"));
            None
        }
        (false, None) => {
            let others = ["mandel", materials::KEY, POROSITY.name];
            let cures = [&others[..], &CONSTANTS.map(Parameter::name)].concat();
            let cures: Vec<_> = cures.into_iter().map(|key| table.path(key)).collect();
            let message =
                format!("has no elasticity; give {FORMS}, or name a material, or give a porosity");
            reader.lacks(table.own_path(), &cures, message);
            None
        }
        (false, Some(_)) => from_constants(reader, table, base),
    };
    Some(Bone { density: density?, elasticity: elasticity? })
}

/// Refuses what the porosity in `table` replaces; `matrix` is the table of the bone between the pores.
pub(crate) fn refuse_beside_porosity(reader: &mut Reader, table: &Table<'_>, matrix: &str) {
    let replaced = KEYS.into_iter().filter(|key| *key != POROSITY.name);
    let beside: Vec<_> = replaced.filter(|key| table.has(key)).collect();
    if !beside.is_empty() {
        let beside = beside.join(", ");
        let message = format!(
            "is given together with {beside}; density and elasticity follow from it: give one or the \
             other (those of the bone between the pores belong to {matrix})"
        );
        reader.violations.add(table.path(POROSITY.name), message);
    }
}

/// The forms in which an elasticity may be given.
pub(crate) const FORMS: &str = "either the five engineering constants or mandel";

/// Reads a number of a solid, which only a material can stand in for, and checks its range and, if it
/// is `typed` by a person, its unit.
fn required(
    reader: &mut Reader,
    table: &Table<'_>,
    parameter: Parameter,
    base: Base,
    typed: bool,
) -> Option<f64> {
    let (key, accepted) = (parameter.name(), parameter.row().accepted);
    if !table.has(key) {
        let value = base.value(parameter);
        if value.is_none() {
            let cures = [key, materials::KEY, POROSITY.name].map(|key| table.path(key));
            let message = format!("is missing; it must be {accepted}");
            reader.lacks(&cures[0], &cures, message);
        }
        return value;
    }
    let value = reader.number(table, key)?;
    let path = table.path(key);
    if typed {
        let kind = parameter.row().plausible;
        check::quantity(&path, value, accepted, kind, &mut reader.violations);
    } else {
        check::number(&path, value, accepted, &mut reader.violations);
    }
    (!reader.violations.has_at_or_below(&path)).then_some(value)
}

fn from_constants(reader: &mut Reader, table: &Table<'_>, base: Base) -> Option<Elasticity> {
    let [e_l, nu_l, g_l, e_t, nu_t] =
        CONSTANTS.map(|parameter| required(reader, table, parameter, base, true));
    if matches!(base, Base::Unknown) {
        return None;
    }
    let constants = EngineeringConstants {
        longitudinal_young_modulus: e_l?,
        longitudinal_poisson_ratio: nu_l?,
        longitudinal_shear_modulus: g_l?,
        transverse_young_modulus: e_t?,
        transverse_poisson_ratio: nu_t?,
    };
    match constants.elasticity() {
        Ok(elasticity) => Some(elasticity),
        Err(inadmissible) => {
            let message = format!("the constants are not admissible: {inadmissible}");
            reader.violations.add(table.own_path(), message);
            None
        }
    }
}

fn mandel(reader: &mut Reader, table: &Table<'_>) -> Option<Elasticity> {
    let path = table.path("mandel");
    let expected = "6 rows of 6 numbers each (Pa, Kelvin-Mandel, order 11 22 33 23 31 12)";
    let lists = reader.list(table, "mandel", expected)?;
    if lists.len() != 6 {
        let count = lists.len();
        reader.violations.add(&path, format!("has {count} rows; it must be {expected}"));
        return None;
    }
    let rows: Vec<_> = lists
        .iter()
        .enumerate()
        .map(|(index, row)| mandel_row(reader, &path, index, row))
        .collect();
    let mut matrix = [[0.0; 6]; 6];
    for (target, row) in matrix.iter_mut().zip(rows) {
        *target = row?;
    }
    match Elasticity::new(matrix) {
        Ok(elasticity) => Some(elasticity),
        Err(not_elastic) => {
            reader.violations.add(&path, not_elastic.to_string());
            None
        }
    }
}

fn mandel_row(reader: &mut Reader, mandel: &str, index: usize, row: &Node) -> Option<[f64; 6]> {
    let path = element_path(mandel, index);
    let Value::List(elements) = &row.value else {
        reader.wrong_type(path, "a row of 6 numbers (Pa)", &row.value);
        return None;
    };
    let numbers = reader.numbers(&path, elements)?;
    let count = numbers.len();
    let row = <[f64; 6]>::try_from(numbers).ok();
    if row.is_none() {
        reader.violations.add(path, format!("has {count} numbers; a row must have 6 (Pa)"));
    }
    row
}
