//! Rules on the pores of a job's bone.

use crate::parameters::Parameter;
use crate::pores::{Pores, PorosityProfile, ProfileShape, SUBLAYERS};
use crate::porosity::PorosityModel;
use crate::setup_quantity::SetupQuantity;
use crate::violations::Violations;

use super::porosity::porosity;
use super::section::section;
use super::value::{known_wrong, number};

/// Records all violations of `pores`, with the paths of a file.
pub(super) fn pores(pores: &Pores, violations: &mut Violations) {
    let porosity_key = SetupQuantity::Porosity.mean_key();
    if let Some(value) = pores.porosity {
        porosity(porosity_key, value, violations);
    }
    porosity_profile(porosity_key, &pores.profile, violations);
    let PorosityProfile { surface, marrow, .. } = &pores.profile;
    let given = [
        (SetupQuantity::Porosity, pores.porosity),
        (SetupQuantity::SurfacePorosity, *surface),
        (SetupQuantity::MarrowPorosity, *marrow),
    ];
    for (quantity, value) in given {
        // 0 is refused, too: a job without pores leaves the key out.
        if let Some(value) = value.filter(|_| !known_wrong(quantity.mean_key(), violations)) {
            number(quantity.mean_key(), value, Parameter::Porosity.row().accepted, violations);
        }
    }
    let has_profile = surface.is_some() || marrow.is_some() || !pores.profile.values.is_empty();
    if pores.porosity.is_some() && has_profile {
        let message = "is given together with a profile, which has porosities of its own; give one \
                       porosity, or a profile";
        violations.add(porosity_key, message);
    }
    let (mut checked, mut default) = (pores.model, PorosityModel::default());
    section("bone.porosity_model", &mut checked, &mut default, violations);
    if pores.model != default && !pores.is_any() && !violations.has_at_or_below("bone") {
        let message = "is given without a porosity; give bone.porosity, or leave it out";
        violations.add("bone.porosity_model", message);
    }
}

/// Records all violations of a profile, which is the table `name` of a file.
pub fn porosity_profile(name: &str, profile: &PorosityProfile, violations: &mut Violations) {
    let (mut checked, mut default) = (profile.clone(), PorosityProfile::default());
    section(name, &mut checked, &mut default, violations);
    if profile.shape == ProfileShape::Table {
        return table(name, profile, violations);
    }
    let missing = match (profile.surface, profile.marrow) {
        (Some(_), None) => "marrow",
        (None, Some(_)) => "surface",
        _ => return,
    };
    let field = format!("{name}.{missing}");
    if !known_wrong(&field, violations) {
        violations.add(field, "is missing; a profile has surface and marrow");
    }
}

/// Checks the profile of a table, which has values and no ends.
fn table(name: &str, profile: &PorosityProfile, violations: &mut Violations) {
    let field = format!("{name}.values");
    let count = profile.values.len() as u64;
    if !SUBLAYERS.contains(count) && !known_wrong(&field, violations) {
        violations.add(field, format!("has {count} porosities; it must have {SUBLAYERS}"));
    }
    for (end, value) in [("surface", profile.surface), ("marrow", profile.marrow)] {
        let field = format!("{name}.{end}");
        if value.is_some() && !known_wrong(&field, violations) {
            let message = "belongs to the shapes \"linear\" and \"endosteal\"; a table has all porosities in \
                           `values`: leave it out";
            violations.add(field, message);
        }
    }
}
