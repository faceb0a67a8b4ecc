//! The section `[bone]` of a job, and a porosity, which cases have too: a number, or the table of a profile.

use osteon_common::bone_structure::{
    BoneStructure, MeanSolid, MeanSublayer, PorosityProfile, ProfileShape, SUBLAYERS,
};
use osteon_common::parameters::Parameter;
use osteon_common::porosity::{POROSITY, PorosityModel};

use crate::reader::{self, Reader, Table};
use crate::solid::{self, solid};
use crate::sublayers;

/// Reads the section `[bone]` of a job. If it has sublayers, `thickness` (m) becomes that of all together.
pub(crate) fn of_job(reader: &mut Reader, root: &Table<'_>, thickness: &mut f64) -> BoneStructure {
    let keys = [POROSITY.name, PorosityModel::KEY.name, sublayers::KEY];
    let bone = reader.table(root, BoneStructure::KEY.name, &keys);
    let (porosity, profile) = porosity(reader, &bone);
    let mut model = PorosityModel::default();
    reader::section(reader, &bone, PorosityModel::KEY.name, &mut model);
    let sublayers = match bone.has(sublayers::KEY) {
        true => sublayers::read(reader, (root, &bone), thickness, &mean_solid).unwrap_or_default(),
        false => Vec::new(),
    };
    let sublayer = |(thickness, solid)| MeanSublayer { thickness, solid };
    let sublayers = sublayers.into_iter().map(sublayer).collect();
    BoneStructure { porosity, profile, model, sublayers }
}

/// Reads the solid of a sublayer; `None` after recording the violations.
fn mean_solid(reader: &mut Reader, table: &Table<'_>) -> Option<MeanSolid> {
    if table.has(POROSITY.name) {
        solid::refuse_beside_porosity(reader, table, "parameters");
        return reader.number(table, POROSITY.name).map(MeanSolid::Porous);
    }
    solid(reader, table).map(|bone| MeanSolid::Given(Box::new(bone)))
}

/// Reads the porosity in the table `bone`: one number, or a profile.
pub(crate) fn porosity(reader: &mut Reader, bone: &Table<'_>) -> (Option<f64>, PorosityProfile) {
    let mut profile = PorosityProfile::default();
    if !bone.holds_table(POROSITY.name) {
        return (reader.number(bone, POROSITY.name), profile);
    }
    let table = reader::section(reader, bone, POROSITY.name, &mut profile);
    if profile.shape == ProfileShape::Table && !table.has("values") {
        reader.missing(&table, "values", format!("a list of porosities, {SUBLAYERS}"));
    } else if profile.shape != ProfileShape::Table {
        for key in ["surface", "marrow"].into_iter().filter(|key| !table.has(key)) {
            reader.missing(&table, key, Parameter::Porosity.row().accepted);
        }
    }
    (None, profile)
}
