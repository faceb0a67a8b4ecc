//! `[monte_carlo]`, `[objective]` and `[search]`.

use crate::check::{EVALUATIONS, REALIZATIONS, SCRAMBLES, SEED, STARTS};
use crate::job::{MonteCarlo, Objective, Prior, Sampling, Search, SearchMethod};
use crate::parameters::Parameter;
use crate::reader::{Choice, Reader, Table};

/// Reads the Monte Carlo settings; missing or wrong values are replaced by defaults.
pub(super) fn monte_carlo(reader: &mut Reader, root: &Table<'_>) -> MonteCarlo {
    let default = MonteCarlo::default();
    let keys =
        ["realizations", "seed", "sampling", "scrambles", "control_variate", "max_failed_fraction"];
    let table = reader.table(root, "monte_carlo", &keys);
    let sampling = Choice { all: &Sampling::ALL, name: Sampling::name, reserved: &[] };
    let scrambles = reader.whole(&table, "scrambles", SCRAMBLES).unwrap_or(default.scrambles);
    // If these are misspelt, the scrambles cannot be checked against them, and only the misspelling
    // is reported.
    let alone = ["realizations", "sampling"].iter().any(|key| reader.is_misspelt(&table, key));
    MonteCarlo {
        realizations: reader
            .whole(&table, "realizations", REALIZATIONS)
            .unwrap_or(default.realizations),
        seed: reader.whole(&table, "seed", SEED).unwrap_or(default.seed),
        sampling: reader.choice(&table, "sampling", &sampling).unwrap_or(default.sampling),
        scrambles: if alone { default.scrambles } else { scrambles },
        control_variate: reader.truth(&table, "control_variate").unwrap_or(default.control_variate),
        max_failed_fraction: reader
            .number(&table, "max_failed_fraction")
            .unwrap_or(default.max_failed_fraction),
    }
}

/// Reads the objective; a missing or wrong value is replaced by the default.
pub(super) fn objective(reader: &mut Reader, root: &Table<'_>) -> Objective {
    let table = reader.table(root, "objective", &["kind"]);
    let kind = Choice { all: &Objective::ALL, name: Objective::name, reserved: &[] };
    reader.choice(&table, "kind", &kind).unwrap_or_default()
}

/// Reads the search settings; missing or wrong values are replaced by defaults.
pub(super) fn search(reader: &mut Reader, root: &Table<'_>) -> Search {
    let keys = [
        "method",
        "max_evaluations",
        "cost_tolerance",
        "size_tolerance",
        "initial_step",
        "starts",
        "sensitivities",
        "priors",
    ];
    let table = reader.table(root, "search", &keys);
    let method = Choice { all: &SearchMethod::ALL, name: SearchMethod::name, reserved: &[] };
    let method = reader.choice(&table, "method", &method).unwrap_or_default();
    let default = Search::by(method);
    Search {
        method,
        max_evaluations: reader
            .whole(&table, "max_evaluations", EVALUATIONS)
            .unwrap_or(default.max_evaluations),
        cost_tolerance: reader.number(&table, "cost_tolerance").unwrap_or(default.cost_tolerance),
        size_tolerance: reader.number(&table, "size_tolerance").unwrap_or(default.size_tolerance),
        initial_step: reader.number(&table, "initial_step").unwrap_or(default.initial_step),
        starts: reader.whole(&table, "starts", STARTS).unwrap_or(default.starts),
        sensitivities: reader.truth(&table, "sensitivities").unwrap_or(default.sensitivities),
        priors: priors(reader, &table),
    }
}

/// Reads a table `{ value, weight }` for each parameter that has one; numbers that cannot be read
/// are recorded and become NaN.
fn priors(reader: &mut Reader, search: &Table<'_>) -> [Option<Prior>; 7] {
    let table = reader.table(search, "priors", &Parameter::ALL.map(Parameter::name));
    Parameter::ALL.map(|parameter| {
        if !table.has(parameter.name()) {
            return None;
        }
        let prior = reader.table(&table, parameter.name(), &["value", "weight"]);
        if !prior.is_table() {
            return None;
        }
        let [value, weight] = ["value", "weight"].map(|key| {
            if !prior.has(key) {
                let expected = "a number; a prior has a value and a weight";
                reader.missing(&prior, key, expected);
            }
            reader.number(&prior, key).unwrap_or(f64::NAN)
        });
        Some(Prior { value, weight })
    })
}
