//! `[posterior]` with its priors.

use osteon_common::fields::{Choice as _, Key};
use osteon_common::job::{PosteriorPrior, PosteriorSettings, PriorDistribution};
use osteon_common::parameters::Parameter;

use crate::reader::{self, Reader, Table};

const DISTRIBUTION: &str = "distribution";
const NUMBERS: [&str; 2] = ["center", "spread"];

/// The keys of a prior.
pub(super) const KEYS: [Key; 3] = [
    Key {
        name: DISTRIBUTION,
        meaning: "law of the prior within the bounds: `\"uniform\"`, `\"normal\"` or \
                  `\"log_normal\"`; parameters without a prior have a uniform one",
    },
    Key {
        name: NUMBERS[0],
        meaning: "mean of a normal prior, or median of a log-normal one, before it is truncated to \
                  the bounds; at most ten spreads outside them, and above 0 for `\"log_normal\"`",
    },
    Key {
        name: NUMBERS[1],
        meaning: "standard deviation of a normal prior, in the unit of the parameter, or of the \
                  natural logarithm under a log-normal one; above 0",
    },
];

/// Reads the section; `None` if it is absent, or no table.
pub(super) fn read(reader: &mut Reader, root: &Table<'_>) -> Option<PosteriorSettings> {
    let mut settings = PosteriorSettings::default();
    let table = reader::section(reader, root, PosteriorSettings::KEY.name, &mut settings);
    if !table.is_table() {
        return None;
    }
    let priors = reader.table(&table, "priors", &Parameter::ALL.map(Parameter::name));
    settings.priors = Parameter::ALL.map(|parameter| prior(reader, &priors, parameter));
    Some(settings)
}

/// Reads the prior of one parameter; numbers that cannot be read are recorded and become NaN.
fn prior(reader: &mut Reader, priors: &Table<'_>, parameter: Parameter) -> PosteriorPrior {
    let table = reader.table(priors, parameter.name(), &KEYS.map(|key| key.name));
    if !table.is_table() {
        return PosteriorPrior::default();
    }
    let mut distribution = PriorDistribution::default();
    if !table.has(DISTRIBUTION) {
        let names: Vec<_> = distribution.names().iter().map(|name| format!("\"{name}\"")).collect();
        reader.missing(&table, DISTRIBUTION, names.join(" or "));
    }
    reader.choice(&table, DISTRIBUTION, &mut distribution);
    let known = !reader.violations.has_at_or_below(&table.path(DISTRIBUTION));
    let numbers = NUMBERS.map(|key| reader.number(&table, key));
    let uniform = distribution == PriorDistribution::Uniform;
    for key in NUMBERS.into_iter().filter(|_| known) {
        match (uniform, table.has(key)) {
            (false, false) => reader.missing(&table, key, "a number"),
            (true, true) => {
                let message = "belongs to a \"normal\" or \"log_normal\" prior, and this one is \
                               \"uniform\"; leave it out";
                reader.violations.add(table.path(key), message);
            }
            _ => {}
        }
    }
    let [center, spread] = numbers.map(|number| number.unwrap_or(f64::NAN));
    PosteriorPrior::new(distribution, center, spread)
}
