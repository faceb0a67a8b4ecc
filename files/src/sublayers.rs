//! The list `sublayers` of a section `[bone]`.

use osteon_common::bone::{self, Sublayers};
use osteon_common::check;
use osteon_common::field_path::element_path;
use osteon_common::limits::SUBLAYERS_MAX;
use osteon_common::parameters::Parameter;
use osteon_common::porosity::POROSITY;
use osteon_common::setup_quantity::SetupQuantity;
use osteon_common::violations::Violations;

use crate::document::{Node, Value};
use crate::reader::{Reader, Table};
use crate::solid;

/// The key of the sublayers.
pub(crate) const KEY: &str = "sublayers";
/// Maximum number of refused sublayers whose violations are listed.
const REFUSED_MAX: usize = 3;
/// The key of a sublayer's thickness.
const THICKNESS: &str = "thickness";

/// Reads the sublayers in the section `table`, each with its thickness (m) and what `solid` reads of it, and
/// sets `whole` to the thickness of all; `None` after recording the violations.
pub(crate) fn read<T>(
    reader: &mut Reader,
    (root, table): (&Table<'_>, &Table<'_>),
    whole: &mut f64,
    solid: &dyn Fn(&mut Reader, &Table<'_>) -> Option<T>,
) -> Option<Vec<(f64, T)>> {
    refuse_keys_of_one_solid(reader, root, table);
    let sublayers = list(reader, table, solid)?;
    *whole = whole_thickness(reader, table, &sublayers)?;
    Some(sublayers)
}

/// Returns whether one of the sublayers in the section `table` has a porosity.
pub(crate) fn is_any_porous(table: &Table<'_>) -> bool {
    let is_porous = |node: &Node| match &node.value {
        Value::List(sublayers) => sublayers.iter().any(|one| one.holds(POROSITY.name)),
        _ => false,
    };
    table.get(KEY).is_some_and(is_porous)
}

/// Refuses what a bone of sublayers leaves out.
fn refuse_keys_of_one_solid(reader: &mut Reader, root: &Table<'_>, table: &Table<'_>) {
    let is_known = |key: &&str| reader.violations.has_at_or_below(&table.path(key));
    let beside = solid::KEYS.into_iter().filter(|key| table.has(key) && !is_known(key));
    for key in beside.collect::<Vec<_>>() {
        let message = format!(
            "is given together with {KEY}, each of which has a solid of its own; leave one of \
             them out"
        );
        reader.violations.add(table.path(key), message);
    }
    if root.get("layers").is_some_and(|layers| layers.holds("bone.thickness")) {
        let message = format!(
            "is given together with {}, whose thicknesses add up to it; leave it out",
            table.path(KEY)
        );
        reader.violations.add(SetupQuantity::BoneThickness.mean_key(), message);
    }
}

/// Reads the list of sublayers.
fn list<T>(
    reader: &mut Reader,
    bone: &Table<'_>,
    solid: &dyn Fn(&mut Reader, &Table<'_>) -> Option<T>,
) -> Option<Vec<(f64, T)>> {
    let path = bone.path(KEY);
    let expected =
        format!("a list of 1 to {SUBLAYERS_MAX} tables, from the skin's side to the marrow's");
    let nodes = reader.list(bone, KEY, &expected)?;
    if !(1..=SUBLAYERS_MAX).contains(&nodes.len()) {
        let message = format!("has {} elements; it must be {expected}", nodes.len());
        reader.violations.add(&path, message);
        return None;
    }
    let keys = [&[THICKNESS], &solid::KEYS[..]].concat();
    let (mut sublayers, mut refused) = (Vec::with_capacity(nodes.len()), 0);
    for (index, node) in nodes.iter().enumerate() {
        if refused == REFUSED_MAX {
            reader.violations.add_more(&path, "the sublayers after these have not been looked at");
            break;
        }
        let table = reader.table_at(node, element_path(&path, index), &keys);
        match sublayer(reader, &table, solid) {
            Some(sublayer) => sublayers.push(sublayer),
            None => refused += 1,
        }
    }
    (refused == 0).then_some(sublayers)
}

/// Reads one sublayer; `None` after recording the violations.
fn sublayer<T>(
    reader: &mut Reader,
    table: &Table<'_>,
    solid: &dyn Fn(&mut Reader, &Table<'_>) -> Option<T>,
) -> Option<(f64, T)> {
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
    let solid = solid(reader, table);
    Some((thickness?, solid?))
}

/// Returns the thickness of all sublayers together, if it can be that of a bone.
fn whole_thickness<T>(
    reader: &mut Reader,
    table: &Table<'_>,
    sublayers: &[(f64, T)],
) -> Option<f64> {
    let thickness = bone::whole_thickness(sublayers.iter().map(|one| one.0));
    let (path, mut found) = (table.path(KEY), Violations::new());
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
