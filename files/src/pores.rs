//! `porosity` of a section `[bone]`: a number, or the table of a profile.

use osteon_common::parameters::Parameter;
use osteon_common::pores::{Pores, PorosityProfile, ProfileShape, SUBLAYERS};
use osteon_common::porosity::{POROSITY, PorosityModel};

use crate::reader::{self, Reader, Table};

/// Reads the section `[bone]` of a job.
pub(crate) fn of_job(reader: &mut Reader, root: &Table<'_>) -> Pores {
    let bone = reader.table(root, Pores::KEY.name, &[POROSITY.name, PorosityModel::KEY.name]);
    let (porosity, profile) = porosity(reader, &bone);
    let mut model = PorosityModel::default();
    reader::section(reader, &bone, PorosityModel::KEY.name, &mut model);
    Pores { porosity, profile, model }
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
