//! `porosity` and `porosity_model` of a case file: the bone of a porosity replaces the name before anything
//! else sees it, as that of a material does.

use osteon_common::case::Bone;
use osteon_common::check;
use osteon_common::parameters::Parameter;
use osteon_common::porosity::{POROSITY, PorosityModel};

use crate::materials::{self, Material};
use crate::reader::{self, Reader, Table};

/// Path of the model in a case file.
const MODEL_PATH: &str = "bone.porosity_model";

/// Reads the model in `table`. If it is wrong, this is recorded, and the model has no meaning.
pub(super) fn model(reader: &mut Reader, table: &Table<'_>) -> PorosityModel {
    let mut model = PorosityModel::default();
    let read = reader::section(reader, table, PorosityModel::KEY.name, &mut model);
    if read.is_table() {
        check::porosity_model(MODEL_PATH, &model, &mut reader.violations);
    }
    model
}

/// Returns the bone of the porosity in `table`, or `None` after recording the violations.
pub(super) fn bone(reader: &mut Reader, table: &Table<'_>, model: &PorosityModel) -> Option<Bone> {
    let path = table.path(POROSITY.name);
    let replaced = [materials::KEY, "mandel"].into_iter().chain(Material::HAS.map(Parameter::name));
    let beside: Vec<_> = replaced.filter(|key| table.has(key)).collect();
    if !beside.is_empty() {
        let beside = beside.join(", ");
        let message = format!(
            "is given together with {beside}; density and elasticity follow from it: give one or the \
             other (those of the bone between the pores belong to {MODEL_PATH}.matrix)"
        );
        reader.violations.add(&path, message);
    }
    let porosity = reader.number(table, POROSITY.name)?;
    check::porosity(&path, porosity, &mut reader.violations);
    let known_wrong = |path: &str| reader.violations.has_at_or_below(path);
    if known_wrong(&path) || known_wrong(MODEL_PATH) {
        return None;
    }
    match model.bone(porosity) {
        Ok(bone) => Some(bone),
        Err(none) => {
            reader.violations.add(path, format!("is {porosity:?}; {none}"));
            None
        }
    }
}
