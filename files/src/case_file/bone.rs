//! The section `[bone]`: one solid, or sublayers.

use osteon_common::bone::{Bone, CaseBone, Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::check;
use osteon_common::elasticity::{Elasticity, EngineeringConstants};
use osteon_common::field_path::element_path;
use osteon_common::limits::SUBLAYERS_MAX;
use osteon_common::parameters::Parameter;
use osteon_common::porosity::{CasePorosityModel, POROSITY, PorosityModel};
use osteon_common::setup_quantity::SetupQuantity;
use osteon_common::violations::Violations;

use super::porosity;
use crate::document::{Node, Value};
use crate::materials::{self, Base};
use crate::reader::{Reader, Table};

/// The five engineering constants as keys of `[bone]`.
const CONSTANTS: [Parameter; 5] = [
    Parameter::LongitudinalYoungModulus,
    Parameter::LongitudinalPoissonRatio,
    Parameter::LongitudinalShearModulus,
    Parameter::TransverseYoungModulus,
    Parameter::TransversePoissonRatio,
];

/// The keys of a solid.
const SOLID: [&str; 9] = {
    let [a, b, c, d, e] = CONSTANTS;
    let density = Parameter::Density.name();
    let [a, b, c, d, e] = [a.name(), b.name(), c.name(), d.name(), e.name()];
    [materials::KEY, density, "mandel", a, b, c, d, e, POROSITY.name]
};
/// The key of the sublayers.
const SUBLAYERS: &str = "sublayers";
/// Maximum number of refused sublayers whose violations are listed.
const REFUSED_MAX: usize = 3;
/// The key of a sublayer's thickness.
const THICKNESS: &str = "thickness";

/// Reads the bone, and sets the thickness of `setup` if the bone has sublayers; `None` after recording the
/// violations.
pub(super) fn read(reader: &mut Reader, root: &Table<'_>, setup: &mut Setup) -> Option<CaseBone> {
    let keys = [&SOLID[..], &[PorosityModel::KEY.name, SUBLAYERS]].concat();
    let table = reader.table(root, "bone", &keys);
    if !table.is_table() {
        if !root.has("bone") {
            let message = format!(
                "is missing; it must have a material, or density and {FORMS}, or a porosity, or {SUBLAYERS}"
            );
            reader.lacks("bone", &["bone".to_owned()], message);
        }
        return None;
    }
    let model = porosity_model(reader, &table)?;
    if !table.has(SUBLAYERS) && table.holds_table(POROSITY.name) {
        return porosity::profile(reader, &table, &model, setup.layers.bone_thickness);
    }
    if !table.has(SUBLAYERS) {
        return solid(reader, &table, &model).map(CaseBone::Homogeneous);
    }
    refuse_keys_of_one_solid(reader, root, &table);
    let sublayers = sublayers(reader, &table, &model)?;
    setup.layers.bone_thickness = whole_thickness(reader, &table, &sublayers)?;
    Some(CaseBone::Layered(sublayers))
}

/// Returns how porosities are read, of the bone or of its sublayers; `None` if there is none to be read so.
fn porosity_model(reader: &mut Reader, table: &Table<'_>) -> Option<CasePorosityModel> {
    let model = porosity::model(reader, table);
    let is_porous = |node: &Node| match &node.value {
        Value::List(sublayers) => sublayers.iter().any(|one| one.holds(POROSITY.name)),
        _ => false,
    };
    let is_used = table.has(POROSITY.name) || table.get(SUBLAYERS).is_some_and(is_porous);
    if table.has(PorosityModel::KEY.name) && !is_used {
        let cures = [table.path(POROSITY.name)];
        let message = "is given without a porosity; give bone.porosity, or leave it out";
        reader.lacks(&table.path(PorosityModel::KEY.name), &cures, message);
        return None;
    }
    Some(model)
}

/// Refuses what a bone of sublayers leaves out.
fn refuse_keys_of_one_solid(reader: &mut Reader, root: &Table<'_>, table: &Table<'_>) {
    for key in SOLID.into_iter().filter(|key| table.has(key)) {
        let message = format!(
            "is given together with {SUBLAYERS}, each of which has a solid of its own; leave one of \
             them out"
        );
        reader.violations.add(table.path(key), message);
    }
    if root.get("layers").is_some_and(|layers| layers.holds("bone.thickness")) {
        let message = format!(
            "is given together with {}, whose thicknesses add up to it; leave it out",
            table.path(SUBLAYERS)
        );
        reader.violations.add(SetupQuantity::BoneThickness.mean_key(), message);
    }
}

/// Reads the sublayers.
fn sublayers(
    reader: &mut Reader,
    bone: &Table<'_>,
    model: &CasePorosityModel,
) -> Option<Sublayers> {
    let path = bone.path(SUBLAYERS);
    let expected =
        format!("a list of 1 to {SUBLAYERS_MAX} tables, from the skin's side to the marrow's");
    let nodes = reader.list(bone, SUBLAYERS, &expected)?;
    if !(1..=SUBLAYERS_MAX).contains(&nodes.len()) {
        let message = format!("has {} elements; it must be {expected}", nodes.len());
        reader.violations.add(&path, message);
        return None;
    }
    let keys = [&[THICKNESS], &SOLID[..]].concat();
    let (mut sublayers, mut refused) = (Vec::with_capacity(nodes.len()), 0);
    for (index, node) in nodes.iter().enumerate() {
        if refused == REFUSED_MAX {
            reader.violations.add_more(&path, "the sublayers after these have not been looked at");
            break;
        }
        let table = reader.table_at(node, element_path(&path, index), &keys);
        match sublayer(reader, &table, model) {
            Some(sublayer) => sublayers.push(sublayer),
            None => refused += 1,
        }
    }
    if refused == 0 { Sublayers::new(&sublayers) } else { None }
}

/// Reads one sublayer; `None` after recording the violations.
fn sublayer(reader: &mut Reader, table: &Table<'_>, model: &CasePorosityModel) -> Option<Sublayer> {
    if !table.is_table() {
        return None;
    }
    let accepted = Sublayers::THICKNESS;
    if !table.has(THICKNESS) {
        reader.missing(table, THICKNESS, accepted);
    }
    let thickness = reader.number(table, THICKNESS);
    if let Some(thickness) = thickness {
        let kind = Parameter::BoneThickness.row().plausible;
        let path = table.path(THICKNESS);
        check::quantity(&path, thickness, accepted, kind, &mut reader.violations);
    }
    let solid = solid(reader, table, model);
    Some(Sublayer { thickness: thickness?, solid: solid? })
}

/// Returns the thickness of all sublayers together, if it can be that of a bone.
fn whole_thickness(reader: &mut Reader, bone: &Table<'_>, sublayers: &Sublayers) -> Option<f64> {
    let thickness = sublayers.thickness();
    let (path, mut found) = (bone.path(SUBLAYERS), Violations::new());
    if reader.violations.has_at_or_below(&path) {
        return None;
    }
    let kind = Parameter::BoneThickness.row().plausible;
    check::quantity(&path, thickness, Parameter::BoneThickness.row().accepted, kind, &mut found);
    for violation in found.iter() {
        let message = format!("the thickness of all together {}", violation.message);
        reader.violations.add(&violation.field, message);
    }
    found.is_empty().then_some(thickness)
}

/// Reads the keys of one solid in `table`; `None` after recording the violations.
fn solid(reader: &mut Reader, table: &Table<'_>, model: &CasePorosityModel) -> Option<Bone> {
    if table.has(POROSITY.name) {
        return porosity::bone(reader, table, model);
    }
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

/// The forms in which an elasticity may be given.
const FORMS: &str = "either the five engineering constants or mandel";

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
