//! Rules on the quantities of the setup that differ from realization to realization.

use crate::accepted::written;
use crate::case::Setup;
use crate::random_quantities::{RandomDistribution, RandomQuantities};
use crate::setup_quantity::SetupQuantity;
use crate::violations::Violations;

use super::section::section;
use super::setup::setup as check_setup;
use super::value::known_wrong;

/// The sections of a job file that make the setup.
pub(super) const SETUP_SECTIONS: [&str; 5] = ["layers", "probe", "picking", "solver", "bone"];

/// Records all violations of `random`, whose means are in `setup`, which has been checked.
///
/// The smallest and the largest value of each quantity must give a valid setup, so that no realization
/// fails because of its setup alone.
pub fn random_quantities(random: &RandomQuantities, setup: &Setup, violations: &mut Violations) {
    let (mut checked, mut default) = (*random, RandomQuantities::default());
    section("random", &mut checked, &mut default, violations);
    if SETUP_SECTIONS.iter().any(|section| violations.has_at_or_below(section)) {
        return;
    }
    for quantity in random.random() {
        let table = format!("random.{}", quantity.name());
        if !known_wrong(&table, violations) && !violations.has_at_or_below(&table) {
            extent(random, quantity, setup, violations);
        }
    }
}

fn extent(
    random: &RandomQuantities,
    quantity: SetupQuantity,
    setup: &Setup,
    violations: &mut Violations,
) {
    let (table, mean_key) = (format!("random.{}", quantity.name()), quantity.mean_key());
    let scatter = random.scatter(quantity);
    let Some(mean) = quantity.value_in(setup) else {
        let message = format!("scatters about {mean_key}, which {}", quantity.lacking(setup));
        return violations.add(table, message);
    };
    if scatter.distribution == RandomDistribution::LogNormal && mean <= 0.0 {
        let mean = written(mean);
        let message = format!(
            "is \"log_normal\", which requires a mean above 0, and {mean_key} is {mean}: set it to \
             \"normal\" or \"uniform\""
        );
        return violations.add(format!("{table}.distribution"), message);
    }
    let Some(deviation) = scatter.standard_deviation else { return };
    let mut ends = scatter.extent(mean).into_iter();
    let refused =
        |end| Violations::first_of(|found| check_setup(&quantity.with(end, setup.clone()), found));
    if let Some(refused) = ends.find_map(refused) {
        let hint = match scatter.distribution {
            RandomDistribution::Normal if mean > 0.0 => {
                ", or set distribution = \"log_normal\" or \"uniform\""
            }
            RandomDistribution::Normal => ", or set distribution = \"uniform\"",
            _ => "",
        };
        let message = format!(
            "is {}; lower it{hint}; extreme realizations are refused: {}: {}",
            written(deviation),
            refused.field,
            refused.message
        );
        violations.add(format!("{table}.standard_deviation"), message);
    }
}
