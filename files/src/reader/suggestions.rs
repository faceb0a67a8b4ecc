//! What a key or a choice that is not known was probably meant to be.

use osteon_common::case::Setup;
use osteon_common::field_path::quoted;
use osteon_common::fields;
use osteon_common::job::{MonteCarlo, Objective, Search};
use osteon_common::parameters::Parameter;

/// Minimum similarity of two words (Jaro-Winkler) for one to count as a misspelling of the other.
const LIKENESS_MIN: f64 = 0.7;
/// The same for words that are known elsewhere.
const ALIKE_MIN: f64 = 0.92;
/// Longer words are not considered as misspellings.
const MISSPELT_BYTES_MAX: usize = 64;

/// Words of other programs and of the trade, in lower case with `_`, and the keys that mean the same.
const OTHER_NAMES: &[(&str, &[&str])] = &[
    (
        "max_evaluations",
        &["max_iter", "maxiter", "max_iterations", "iterations", "maxfev", "max_nfev"],
    ),
    ("cost_tolerance", &["tol", "ftol", "fatol", "tolerance", "ftol_rel"]),
    ("size_tolerance", &["xtol", "xatol", "xtol_rel"]),
    ("starts", &["restarts", "n_starts", "multistart", "multi_start"]),
    (
        "realizations",
        &["n", "samples", "n_samples", "num_samples", "draws", "trials", "num_realizations"],
    ),
    ("seed", &["random_seed", "rng", "rng_seed", "random_state"]),
    ("method", &["algorithm", "optimizer", "optimiser", "solver"]),
    ("kind", &["objective", "type", "cost", "loss"]),
    ("count", &["n", "number", "num", "n_receivers", "receivers"]),
    ("pitch", &["spacing", "step", "dx", "interval"]),
    ("first_x1", &["first", "offset", "x1", "distance"]),
    ("center_frequency", &["f", "f0", "fc", "freq", "frequency", "centre_frequency"]),
    ("sound_speed", &["c", "speed", "velocity", "speed_of_sound", "wave_speed"]),
    ("thickness", &["h", "height", "width"]),
    ("fixed", &["value", "val", "constant"]),
    ("start", &["initial", "guess", "x0", "init", "initial_value", "initial_guess"]),
    ("bounds", &["range", "limits", "interval", "min", "max", "lower", "upper"]),
    ("velocities", &["file", "csv", "path", "filename", "velocity", "measurements"]),
    ("coefficient_of_variation", &["cv", "cov", "variation"]),
    ("longitudinal_young_modulus", &["e_l", "el", "e_3", "e3", "young_modulus", "youngs_modulus"]),
    ("longitudinal_shear_modulus", &["g_l", "gl", "shear_modulus", "g"]),
    ("longitudinal_poisson_ratio", &["nu_l", "nul", "poisson_ratio", "poissons_ratio"]),
    ("transverse_young_modulus", &["e_t", "et", "e_1", "e1"]),
    ("transverse_poisson_ratio", &["nu_t", "nut"]),
    ("density", &["rho", "mass_density"]),
    ("dispersion", &["delta", "scatter", "disp"]),
    ("threshold", &["thresh", "level"]),
    ("refinement", &["accuracy", "resolution"]),
];

/// Words of other programs and of the trade, in lower case with `_`, and the choices that mean the same.
const OTHER_CHOICES: &[(&str, &[&str])] = &[
    ("simplex", &["nelder_mead", "neldermead", "nm", "amoeba", "downhill_simplex", "fmin"]),
    ("newton", &["gauss_newton", "bfgs", "gradient", "levenberg_marquardt", "least_squares"]),
    ("posterior", &["mcmc", "bayes", "bayesian", "emcee"]),
    ("monte_carlo", &["mc", "montecarlo", "random", "plain"]),
    ("sobol", &["sobol'", "qmc", "quasi_monte_carlo", "quasi_random"]),
    ("hybrid", &["spectral", "spectral_elements", "sem", "fem", "finite_elements"]),
    ("likelihood", &["mle", "max_likelihood", "maximum_likelihood", "log_likelihood"]),
    ("chi_square", &["chi2", "chisq", "chi_squared", "chi"]),
    ("first", &["e1", "1", "1st"]),
    ("second", &["e2", "2", "2nd"]),
];

/// Returns the one of the `known` names that a word stands for in other programs.
fn meant(
    word: &str,
    known: &[&'static str],
    names: &[(&'static str, &[&str])],
) -> Option<&'static str> {
    let word = word.to_lowercase().replace(['-', ' '], "_");
    let of = |(name, others): &(&'static str, &[&str])| {
        (known.contains(name) && others.contains(&word.as_str())).then_some(*name)
    };
    names.iter().find_map(of)
}

/// Returns the known name that is most like `word`, and the likeness.
fn nearest(word: &str, known: &[&'static str]) -> Option<(&'static str, f64)> {
    if word.len() > MISSPELT_BYTES_MAX {
        return None;
    }
    let lower = word.to_lowercase();
    let likeness = known.iter().map(|&name| (name, strsim::jaro_winkler(&lower, name)));
    likeness.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|&(_, likeness)| likeness >= LIKENESS_MIN)
}

/// What an unknown key was probably meant to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Suggestion {
    /// This key of the same table.
    Key(&'static str),
    /// The same key of this section.
    Section(&'static str),
    /// Nothing.
    None,
}

/// Returns what `key`, which is none of the keys `known` in the table at `path`, was probably meant to
/// be.
pub(super) fn of_key(path: &str, key: &str, known: &[&'static str]) -> Suggestion {
    let close = nearest(key, known);
    let alike = close.filter(|&(_, likeness)| likeness >= ALIKE_MIN).map(|(name, _)| name);
    if let Some(name) = alike.or_else(|| meant(key, known, OTHER_NAMES)) {
        return Suggestion::Key(name);
    }
    // Inside of a section the same word may mean something else.
    if !path.contains('.')
        && let Some(section) = section_of(key)
    {
        return Suggestion::Section(section);
    }
    close.map_or(Suggestion::None, |(name, _)| Suggestion::Key(name))
}

/// Returns the only section with this key.
fn section_of(key: &str) -> Option<&'static str> {
    let mut setup = Setup::default();
    let mut found = Vec::new();
    for (name, section) in setup.sections() {
        if fields::names(&mut |fields| section.declare(fields)).contains(&key) {
            found.push(name.name);
        }
    }
    let (mut monte_carlo, mut search) = (MonteCarlo::default(), Search::default());
    let mut objective = Objective::default();
    let sections: [(&'static str, &mut dyn fields::Section); 3] =
        [("monte_carlo", &mut monte_carlo), ("search", &mut search), ("objective", &mut objective)];
    for (name, section) in sections {
        if fields::names(&mut |fields| section.declare(fields)).contains(&key) {
            found.push(name);
        }
    }
    if Parameter::ALL.iter().any(|parameter| parameter.name() == key) {
        found.push("parameters");
    }
    if ["velocities", "mean", "coefficient_of_variation", "group", "groups"].contains(&key) {
        found.push("data");
    }
    let [section] = found[..] else { return None };
    Some(section)
}

/// Returns the question whether one of the choices `known` was meant by `word`.
pub(super) fn of_choice(word: &str, known: &[&'static str]) -> Option<String> {
    let name = meant(word, known, OTHER_CHOICES).or_else(|| Some(nearest(word, known)?.0))?;
    let of_whom = if name == "simplex" { ", the method of Nelder and Mead" } else { "" };
    Some(format!("did you mean \"{name}\"{of_whom}?"))
}

/// Returns what to write instead of a text where a number is needed.
pub(super) fn of_number_in_quotes(text: &str) -> Option<String> {
    let text = text.trim();
    if text.len() > MISSPELT_BYTES_MAX {
        return None;
    }
    if text.parse::<f64>().is_ok() {
        return Some(format!("write {text} without quotation marks"));
    }
    if text.matches(',').count() == 1 && text.replace(',', ".").parse::<f64>().is_ok() {
        return Some(format!("write {}, with a decimal point", text.replace(',', ".")));
    }
    let (number, unit) =
        text.split_at(text.find(|c: char| c.is_alphabetic() || c == '%' || c == '°')?);
    number.trim().parse::<f64>().ok()?;
    Some(format!("write the number without {}, in the unit of this key", quoted(unit)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_other_name_leads_to_a_key_or_a_choice_that_exists() {
        let text = crate::job_file::schema();
        for (name, _) in OTHER_NAMES.iter().chain(OTHER_CHOICES) {
            assert!(text.contains(&format!("\"{name}\"")), "{name}");
        }
    }

    #[test]
    fn keys_of_other_sections_are_found() {
        assert_eq!(section_of("seed"), Some("monte_carlo"));
        assert_eq!(section_of("max_evaluations"), Some("search"));
        assert_eq!(section_of("threshold"), Some("picking"));
        assert_eq!(section_of("velocities"), Some("data"));
        // Of the solver, and of the search.
        assert_eq!(section_of("method"), None);
    }
}
