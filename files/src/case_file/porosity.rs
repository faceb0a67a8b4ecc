//! `porosity` and `porosity_model` of a case file: the bone of a porosity replaces the name before anything
//! else sees it, as that of a material does.

use osteon_common::bone::CaseBone;
use osteon_common::bone_structure::BoneStructure;
use osteon_common::case::Bone;
use osteon_common::check;
use osteon_common::porosity::{CasePorosityModel, NoPorousBone, POROSITY, PorosityModel};

use crate::bone_structure;
use crate::reader::{self, Reader, Table};
use crate::solid;

/// Path of the model in a case file.
const MODEL_PATH: &str = "bone.porosity_model";

/// Reads the model in `table`. If it is wrong, this is recorded, and the model has no meaning.
pub(super) fn model(reader: &mut Reader, table: &Table<'_>) -> CasePorosityModel {
    let mut model = CasePorosityModel::default();
    let read = reader::section(reader, table, PorosityModel::KEY.name, &mut model);
    if read.is_table() {
        check::porosity_model(MODEL_PATH, &model, &mut reader.violations);
    }
    model
}

/// Returns the bone of the porosity in `table`, or `None` after recording the violations.
pub(super) fn bone(
    reader: &mut Reader,
    table: &Table<'_>,
    model: &CasePorosityModel,
) -> Option<Bone> {
    let path = table.path(POROSITY.name);
    solid::refuse_beside_porosity(reader, table, &format!("{MODEL_PATH}.matrix"));
    let porosity = reader.number(table, POROSITY.name)?;
    check::porosity(&path, porosity, &mut reader.violations);
    if is_wrong(reader, &path) {
        return None;
    }
    let bone = model.bone(porosity);
    bone.map_err(|none| reader.violations.add(path, format!("is {porosity:?}; {none}"))).ok()
}

/// Returns the bone of the profile in `table`, whose thickness is `thickness` (m), or `None` after recording
/// the violations.
pub(super) fn profile(
    reader: &mut Reader,
    table: &Table<'_>,
    model: &CasePorosityModel,
    thickness: f64,
) -> Option<CaseBone> {
    let path = table.path(POROSITY.name);
    solid::refuse_beside_porosity(reader, table, &format!("{MODEL_PATH}.matrix"));
    let (porosity, profile) = bone_structure::porosity(reader, table);
    check::porosity_profile(&path, &profile, &mut reader.violations);
    if is_wrong(reader, &path) {
        return None;
    }
    let structure =
        BoneStructure { porosity, profile, model: model.model, ..BoneStructure::default() };
    let bone = structure.bone(&model.matrix, thickness, Ok::<_, NoPorousBone>);
    bone.map_err(|none| reader.violations.add(path, format!("has no bone: {none}"))).ok()
}

/// Returns whether the porosity, or the model, is known to be wrong.
fn is_wrong(reader: &Reader, path: &str) -> bool {
    [path, MODEL_PATH].into_iter().any(|path| reader.violations.has_at_or_below(path))
}
