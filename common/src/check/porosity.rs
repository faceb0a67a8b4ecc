//! Rules on a porosity, and on the model by which density and elasticity are computed from it.

use crate::plausible;
use crate::porosity::{self, CasePorosityModel};
use crate::violations::Violations;

use super::section::section;
use super::value::quantity;

/// Records all violations of `model`, which is the table `name` of a file.
pub fn porosity_model(name: &str, model: &CasePorosityModel, violations: &mut Violations) {
    let (mut checked, mut default) = (*model, CasePorosityModel::default());
    section(name, &mut checked, &mut default, violations);
    let matrix = format!("{name}.matrix");
    if violations.has_at_or_below(&matrix) {
        return;
    }
    if let Some(inadmissible) = model.matrix.constants.violated().first() {
        violations.add(matrix, format!("the constants are not admissible: {inadmissible}"));
    }
}

/// Records a porosity at `field` that is not accepted, or in per cent.
pub fn porosity(field: &str, value: f64, violations: &mut Violations) {
    quantity(field, value, porosity::ACCEPTED, &plausible::POROSITY, violations);
}
