//! The sublayers of a job's bone as messages.

use osteon_common::bone::{Bone, Sublayers};
use osteon_common::bone_structure::{MeanSolid, MeanSublayer, thickness};
use osteon_common::case::Setup;
use osteon_common::elasticity::Elasticity;
use osteon_common::field_path::element_path;
use osteon_common::limits::SUBLAYERS_MAX;
use osteon_common::setup_quantity::SetupQuantity;
use osteon_common::violations::Violations;

use crate::v1;

const FIELD: &str = "bone.sublayers";

/// Returns sublayers as messages.
pub(crate) fn to_messages(sublayers: &[MeanSublayer]) -> Vec<v1::BoneSublayer> {
    let message = |MeanSublayer { thickness, solid }: &MeanSublayer| {
        let own = v1::BoneSublayer { thickness: Some(*thickness), ..v1::BoneSublayer::default() };
        match solid {
            MeanSolid::Porous(porosity) => v1::BoneSublayer { porosity: Some(*porosity), ..own },
            MeanSolid::Given(bone) => v1::BoneSublayer {
                density: Some(bone.density),
                mandel: bone.elasticity.rows().concat(),
                ..own
            },
        }
    };
    sublayers.iter().map(message).collect()
}

/// Sets the sublayers of `setup` to those of a message, and its thickness of the bone to that of all
/// together, which `layers` may also give. Missing fields, and matrices that are no elasticity, are added to
/// `violations`.
pub(crate) fn from_messages(
    message: &v1::Bone,
    layers: Option<&v1::Layers>,
    setup: &mut Setup,
    violations: &mut Violations,
) {
    let most = SUBLAYERS_MAX;
    let count = message.sublayers.len();
    if count > most {
        return violations.add(FIELD, format!("has {count} elements; at most {most} are accepted"));
    }
    let each = message.sublayers.iter().enumerate();
    let sublayers = each.map(|(index, one)| sublayer(index, one, violations)).collect::<Vec<_>>();
    let Some(sublayers) = sublayers.into_iter().collect::<Option<Vec<_>>>() else { return };
    if sublayers.is_empty() {
        return;
    }
    let whole = thickness(&sublayers);
    let given = layers.and_then(|layers| layers.bone.as_ref()?.thickness);
    if let Some(given) = given.filter(|given| *given != whole) {
        let field = SetupQuantity::BoneThickness.mean_key();
        let message = format!(
            "is {given:?}, and the thicknesses of {FIELD} add up to {whole:?}; leave it out"
        );
        violations.add(field, message);
    }
    setup.layers.bone_thickness = whole;
    setup.structure.sublayers = sublayers;
}

/// Returns the sublayer of a message; `None` after recording what is missing or wrong.
fn sublayer(
    index: usize,
    message: &v1::BoneSublayer,
    violations: &mut Violations,
) -> Option<MeanSublayer> {
    let v1::BoneSublayer { thickness, porosity, density, mandel } = message;
    let field = |key: &str| format!("{}.{key}", element_path(FIELD, index));
    if thickness.is_none() {
        violations
            .add(field("thickness"), format!("is missing; it must be {}", Sublayers::THICKNESS));
    }
    let beside = density.is_some() || !mandel.is_empty();
    let solid = match porosity {
        Some(_) if beside => {
            let message = "is given together with density or mandel, which follow from it; give one or the other";
            violations.add(field("porosity"), message);
            None
        }
        Some(porosity) => Some(MeanSolid::Porous(*porosity)),
        None => {
            if density.is_none() {
                violations.add(
                    field("density"),
                    "is missing; without a porosity it must be above 0 kg/m³",
                );
            }
            let elasticity = elasticity(&field("mandel"), mandel, violations);
            density.zip(elasticity).map(|(density, elasticity)| {
                MeanSolid::Given(Box::new(Bone { density, elasticity }))
            })
        }
    };
    Some(MeanSublayer { thickness: (*thickness)?, solid: solid? })
}

fn elasticity(field: &str, entries: &[f64], violations: &mut Violations) -> Option<Elasticity> {
    let (rows, rest) = entries.as_chunks::<6>();
    let rows = <[[f64; 6]; 6]>::try_from(rows).ok().filter(|_| rest.is_empty());
    let Some(rows) = rows else {
        let count = entries.len();
        let message =
            format!("has {count} numbers; without a porosity it must have 36, row by row (Pa)");
        violations.add(field, message);
        return None;
    };
    Elasticity::new(rows).map_err(|not_elastic| violations.add(field, not_elastic.to_string())).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(sublayers: &[v1::BoneSublayer], given: Option<f64>) -> (Setup, String) {
        let (mut setup, mut violations) = (Setup::default(), Violations::new());
        let bone = v1::Bone { sublayers: sublayers.to_vec(), ..v1::Bone::default() };
        let layer = v1::BoneLayer { thickness: given, ..v1::BoneLayer::default() };
        let layers = v1::Layers { bone: Some(layer), ..v1::Layers::default() };
        from_messages(&bone, Some(&layers), &mut setup, &mut violations);
        (setup, violations.to_string())
    }

    #[test]
    fn refused_sublayers_are_named() {
        let porous = v1::BoneSublayer {
            thickness: Some(1e-3),
            porosity: Some(0.1),
            ..v1::BoneSublayer::default()
        };
        let whole = v1::BoneSublayer { density: Some(1800.0), porosity: None, ..porous.clone() };
        let refusals = [
            (
                v1::BoneSublayer { thickness: None, ..porous.clone() },
                "bone.sublayers[1].thickness: is missing",
            ),
            (
                v1::BoneSublayer { density: Some(1.0), ..porous.clone() },
                "bone.sublayers[1].porosity: is given together",
            ),
            (
                v1::BoneSublayer { porosity: None, ..porous.clone() },
                "bone.sublayers[1].density: is missing",
            ),
            (
                v1::BoneSublayer { mandel: vec![1.0; 35], ..whole.clone() },
                "bone.sublayers[1].mandel: has 35 numbers",
            ),
            (v1::BoneSublayer { mandel: vec![1.0; 36], ..whole }, "bone.sublayers[1].mandel: "),
        ];
        for (refused, expected) in refusals {
            let (setup, message) = check(&[porous.clone(), refused], None);
            assert!(message.contains(expected), "{message}");
            assert!(setup.structure.sublayers.is_empty());
        }
        let (_, message) = check(&vec![porous.clone(); 17], None);
        assert!(message.contains("bone.sublayers: has 17 elements; at most 16"), "{message}");
        let (_, message) = check(&[porous.clone(), porous.clone()], Some(4e-3));
        assert!(message.contains("layers.bone.thickness: is 0.004, and the thick"), "{message}");
        let (setup, message) = check(&[porous.clone(), porous], None);
        assert_eq!((setup.layers.bone_thickness, message.as_str()), (2e-3, ""));
    }
}
