//! Rules on the pores and the sublayers of a job's bone.

use crate::bone::Sublayers;
use crate::bone_structure::{
    BoneStructure, MeanSolid, MeanSublayer, PorosityProfile, ProfileShape, SUBLAYERS,
};
use crate::field_path::element_path;
use crate::job::{JobSpecification, Range};
use crate::limits::SUBLAYERS_MAX;
use crate::parameters::{Parameter, Point};
use crate::porosity::{BoneMatrix, PorosityModel};
use crate::setup_quantity::SetupQuantity;
use crate::violations::Violations;

use super::porosity::porosity;
use super::section::section;
use super::value::{known_wrong, number, quantity};

/// Records all violations of `structure`, with the paths of a file.
pub(super) fn bone_structure(structure: &BoneStructure, violations: &mut Violations) {
    let porosity_key = SetupQuantity::Porosity.mean_key();
    if let Some(value) = structure.porosity {
        porosity(porosity_key, value, violations);
    }
    porosity_profile(porosity_key, &structure.profile, violations);
    let PorosityProfile { surface, marrow, .. } = &structure.profile;
    let given = [
        (SetupQuantity::Porosity, structure.porosity),
        (SetupQuantity::SurfacePorosity, *surface),
        (SetupQuantity::MarrowPorosity, *marrow),
    ];
    for (one, value) in given {
        // 0 is refused, too: a job without pores leaves the key out.
        if let Some(value) = value.filter(|_| !known_wrong(one.mean_key(), violations)) {
            number(one.mean_key(), value, Parameter::Porosity.row().accepted, violations);
        }
    }
    let has_profile = surface.is_some() || marrow.is_some() || !structure.profile.values.is_empty();
    if structure.porosity.is_some() && has_profile {
        let message = "is given together with a profile, which has porosities of its own; give one \
                       porosity, or a profile";
        violations.add(porosity_key, message);
    }
    sublayers(structure, violations);
    let (mut checked, mut default) = (structure.model, PorosityModel::default());
    section("bone.porosity_model", &mut checked, &mut default, violations);
    if structure.model != default && !structure.has_pores() && !violations.has_at_or_below("bone") {
        let message = "is given without a porosity; give bone.porosity, or sublayers with one, or leave it out";
        violations.add("bone.porosity_model", message);
    }
}

/// Checks the sublayers, each by itself, and that nothing else says what the bone consists of.
fn sublayers(structure: &BoneStructure, violations: &mut Violations) {
    const FIELD: &str = "bone.sublayers";
    let (count, most) = (structure.sublayers.len(), SUBLAYERS_MAX);
    if known_wrong(FIELD, violations) || count == 0 {
        return;
    }
    if count > most {
        let message = format!("has {count} elements; it must be a list of 1 to {most} tables");
        return violations.add(FIELD, message);
    }
    let porosity_key = SetupQuantity::Porosity.mean_key();
    if structure.mean_porosity().is_some() && !known_wrong(porosity_key, violations) {
        let message = "is given together with sublayers, each of which has a solid of its own; leave one of \
                       them out";
        violations.add(porosity_key, message);
    }
    for (index, MeanSublayer { thickness, solid }) in structure.sublayers.iter().enumerate() {
        let field = |key: &str| format!("{}.{key}", element_path(FIELD, index));
        let kind = Parameter::BoneThickness.row().plausible;
        quantity(&field("thickness"), *thickness, Sublayers::THICKNESS, kind, violations);
        match solid {
            MeanSolid::Porous(value) => porosity(&field("porosity"), *value, violations),
            MeanSolid::Given(bone) => {
                let accepted = Parameter::Density.row().accepted;
                number(&field("density"), bone.density, accepted, violations);
            }
        }
    }
}

/// Checks that the parameters leave sublayers of given solids alone.
pub(super) fn parameters_of_sublayers(
    specification: &JobSpecification,
    violations: &mut Violations,
) {
    let structure = &specification.setup.structure;
    // A refused material stands for parameters that the file does not have.
    let is_unknown = violations.has_at_or_below("parameters.material");
    if is_unknown {
        return;
    }
    let unused = Point::of_matrix(&BoneMatrix::default(), 0.0);
    for parameter in Parameter::OF_BONE.into_iter().filter(|one| structure.ignores(*one)) {
        let field = format!("parameters.{}", parameter.name());
        let is_default = specification.range(parameter) == Range::Fixed(unused.get(parameter));
        if !is_default && !violations.has_at_or_below(&field) {
            let message =
                "has no effect, as each of bone.sublayers has a solid of its own; leave it out";
            violations.add(field, message);
        }
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
