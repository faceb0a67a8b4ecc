//! The section `[bone]` of a case: one solid, or sublayers.

use osteon_common::bone::{Bone, CaseBone, Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::porosity::{CasePorosityModel, POROSITY, PorosityModel};

use super::porosity;
use crate::reader::{Reader, Table};
use crate::solid::{self, FORMS, solid};
use crate::sublayers;

/// Reads the bone, and sets the thickness of `setup` if the bone has sublayers; `None` after recording the
/// violations.
pub(super) fn read(reader: &mut Reader, root: &Table<'_>, setup: &mut Setup) -> Option<CaseBone> {
    let keys = [&solid::KEYS[..], &[PorosityModel::KEY.name, sublayers::KEY]].concat();
    let table = reader.table(root, "bone", &keys);
    if !table.is_table() {
        if !root.has("bone") {
            let message = format!(
                "is missing; it must have a material, or density and {FORMS}, or a porosity, or {}",
                sublayers::KEY
            );
            reader.lacks("bone", &["bone".to_owned()], message);
        }
        return None;
    }
    let model = porosity_model(reader, &table)?;
    if table.has(sublayers::KEY) {
        let whole = &mut setup.layers.bone_thickness;
        let solid = |reader: &mut Reader, table: &Table<'_>| solid_or_porous(reader, table, &model);
        let sublayers = sublayers::read(reader, (root, &table), whole, &solid)?;
        let sublayer = |(thickness, solid)| Sublayer { thickness, solid };
        let sublayers: Vec<_> = sublayers.into_iter().map(sublayer).collect();
        return Sublayers::new(&sublayers).map(CaseBone::Layered);
    }
    if table.holds_table(POROSITY.name) {
        return porosity::profile(reader, &table, &model, setup.layers.bone_thickness);
    }
    solid_or_porous(reader, &table, &model).map(CaseBone::Homogeneous)
}

/// Reads one solid in `table`; `None` after recording the violations.
fn solid_or_porous(
    reader: &mut Reader,
    table: &Table<'_>,
    model: &CasePorosityModel,
) -> Option<Bone> {
    match table.has(POROSITY.name) {
        true => porosity::bone(reader, table, model),
        false => solid(reader, table),
    }
}

/// Returns how porosities are read, of the bone or of its sublayers; `None` if there is none to be read so.
fn porosity_model(reader: &mut Reader, table: &Table<'_>) -> Option<CasePorosityModel> {
    let model = porosity::model(reader, table);
    let is_used = table.has(POROSITY.name) || sublayers::is_any_porous(table);
    if table.has(PorosityModel::KEY.name) && !is_used {
        let cures = [table.path(POROSITY.name)];
        let message = "is given without a porosity; give bone.porosity, or leave it out";
        reader.lacks(&table.path(PorosityModel::KEY.name), &cures, message);
        return None;
    }
    Some(model)
}
