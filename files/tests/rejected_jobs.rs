//! Job files that are refused, each with all that a user reads.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

#[path = "support/hybrid_job.rs"]
mod hybrid_job;
mod support;

use std::path::Path;

use osteon_common::job::{JobKind, JobSpecification};
use osteon_files::document::Format;
use osteon_files::job_file;

use support::pin;

#[path = "rejected_jobs/decays.rs"]
mod decays;
#[path = "rejected_jobs/groups.rs"]
mod groups;
#[path = "rejected_jobs/objective.rs"]
mod objective;
#[path = "rejected_jobs/posterior.rs"]
mod posterior;
#[path = "rejected_jobs/probe.rs"]
mod probe;
#[path = "rejected_jobs/random.rs"]
mod random;
#[path = "rejected_jobs/setup.rs"]
mod setup;
#[path = "rejected_jobs/setup_parameters.rs"]
mod setup_parameters;
#[path = "rejected_jobs/systematic.rs"]
mod systematic;

const JOB: &str = include_str!("files/job.toml");
/// The line of the bone in `files/job.toml`.
const BONE: &str = "bone     = { thickness = 3e-3, attenuation = { quality_factor = 15.0, \
                    reference_frequency = 0.8e6 } }";
/// How `JOB` samples its 500 realizations.
const SAMPLING: &str = "sampling = \"sobol\"\nscrambles = 4\ncontrol_variate = true";

/// `JOB` with the one occurrence of `from` replaced by `to`; an empty `from` appends.
fn edited(from: &str, to: &str) -> String {
    if from.is_empty() {
        return format!("{JOB}{to}");
    }
    assert_eq!(JOB.matches(from).count(), 1, "{from} must occur once");
    let edited = JOB.replace(from, to);
    // With keys of the method "hybrid", what is refused is one of them.
    let of_hybrid = to.starts_with("method = \"hybrid\"\n");
    if of_hybrid { hybrid_job::without_exact_only(&edited) } else { edited }
}

fn refusal(text: &str, kind: JobKind) -> String {
    match job_file::parse(text, Format::Toml, Path::new("tests/files"), kind) {
        Ok(_) => "ACCEPTED".to_owned(),
        Err(error) => error.to_string(),
    }
}

fn parsed(text: &str) -> JobSpecification {
    let base = Path::new("tests/files");
    job_file::parse(text, Format::Toml, base, JobKind::Identification).unwrap()
}

fn check(name: &str, kind: JobKind, edits: &[(&str, &str)]) {
    let refusals = edits.iter().map(|(from, to)| {
        let to_shown = if to.is_empty() { "(removed)" } else { to.trim() };
        (to_shown, refusal(&edited(from, to), kind))
    });
    pin(name, refusals);
}

#[test]
fn parameters() {
    check(
        "rejected_parameters",
        JobKind::Identification,
        &[
            ("[parameters.dispersion]\nstart = 0.1\nbounds = [0.02, 0.3]", ""),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", "fixed = 0.0"),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", "fixed = 1700.0\nstart = 1700.0"),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", "fixed = 1700.0\nbounds = [1.0, 2.0]"),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", "start = 1700.0"),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", "bounds = [1500.0, 2000.0]"),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", ""),
            ("start = 1700.0", "start = 1400.0"),
            ("start = 1700.0", "start = -1700.0"),
            ("bounds = [1500.0, 2000.0]", "bounds = [2000.0, 1500.0]"),
            ("bounds = [1500.0, 2000.0]", "bounds = [1700.0, 1700.0]"),
            ("bounds = [1500.0, 2000.0]", "bounds = [0.0, 2000.0]"),
            ("bounds = [1500.0, 2000.0]", "bounds = [1500.0]"),
            ("bounds = [1500.0, 2000.0]", "bounds = [1500.0, \"2000\"]"),
            ("bounds = [1500.0, 2000.0]", "bounds = 1500.0"),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", "start = -1\nbounds = [\"1500\", 2e3]"),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", "start = \"a\"\nbounds = [-1, 2e3]"),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", "start = 1\nbounds = [2, 3]\nunit = 1"),
            ("fixed = 4.795e9", "fixed = -4.795e9"),
            ("start = 0.4\nbounds = [0.2, 0.5]", "fixed = 1.2"),
            ("start = 0.4\nbounds = [0.2, 0.5]", "start = 1.2\nbounds = [0.2, 1.5]"),
            ("start = 0.35\nbounds = [0.2, 0.45]", "fixed = 0.9"),
            ("start = 0.1\nbounds = [0.02, 0.3]", "fixed = 0.797724035217466"),
            ("start = 0.1\nbounds = [0.02, 0.3]", "fixed = 0"),
            ("bounds = [0.02, 0.3]", "bounds = [0.0, 0.8]"),
            (
                "[parameters.density]\nstart = 1700.0\nbounds = [1500.0, 2000.0]",
                "parameters.density = 1700.0",
            ),
        ],
    );
}

/// Numbers in another unit than the one that is asked for, each with the cure.
#[test]
fn units() {
    check(
        "rejected_units",
        JobKind::Identification,
        &[
            (BONE, "bone = { thickness = 4 }"),
            (BONE, "bone = { thickness = 4000 }"),
            ("sound_speed = 1510.0", "sound_speed = 1.51"),
            ("center_frequency = 0.9e6", "center_frequency = 1"),
            ("center_frequency = 0.9e6", "center_frequency = 0.25"),
            ("center_frequency = 0.9e6", "center_frequency = 900"),
            ("x1 = 1e-3, x3 = 3e-3", "x1 = 1e-3, x3 = 3"),
            ("first_x1 = 13e-3, pitch = 0.9e-3", "first_x1 = 13, pitch = 0.9"),
            ("method = \"exact\"", "method = \"hybrid\"\nelement_size = 0.5"),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", "fixed = 1.7"),
            ("start = 1700.0\nbounds = [1500.0, 2000.0]", "start = 1.7\nbounds = [1.5, 2.0]"),
            ("start = 18e9\nbounds = [12e9, 25e9]", "start = 20\nbounds = [12, 25]"),
            ("start = 18e9\nbounds = [12e9, 25e9]", "start = 18000\nbounds = [12000, 25000]"),
            ("start = 18e9\nbounds = [12e9, 25e9]", "start = 18\nbounds = [12e9, 25e9]"),
            ("start = 18e9\nbounds = [12e9, 25e9]", "start = 18e9\nbounds = [25e9, 12e9]"),
            ("start = 18e9\nbounds = [12e9, 25e9]", "start = 30e9\nbounds = [12e9, 25e9]"),
            ("fixed = 4.795e9", "fixed = 4.795"),
            ("start = 0.35\nbounds = [0.2, 0.45]", "start = 35\nbounds = [20, 45]"),
            ("start = 0.4\nbounds = [0.2, 0.5]", "fixed = 45"),
            ("start = 0.1\nbounds = [0.02, 0.3]", "fixed = 15"),
        ],
    );
}

/// Measured velocities in another unit, and those that no point within the bounds can reach.
#[test]
fn implausible_data() {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    check(
        "rejected_implausible_data",
        JobKind::Identification,
        &[
            (given, "velocities = [3.9, 4.0, 3.95]"),
            (given, "velocities = [3900e3, 4000e3, 3950e3]"),
            (given, "velocities = [3900.5, 4000, 39000, 3.95]"),
            (given, "velocities = [39, 40, 41]"),
            (given, "groups = { a = [3.9, 4.0], b = [3900.0, 4000.0] }"),
            (given, "mean = 3.8\ncoefficient_of_variation = 2.7"),
            (given, "mean = 50\ncoefficient_of_variation = 0.027"),
            (given, "mean = 3900.0\ncoefficient_of_variation = 0.6"),
            (given, "mean = 3900.0\ncoefficient_of_variation = 0.5"),
            (given, "mean = 1100.0\ncoefficient_of_variation = 0.027"),
            (given, "velocities = [1100.0, 1200.0]"),
            (given, "groups = { a = [1100.0, 1200.0], b = [1000.0, 1200.0] }"),
        ],
    );
    let other = edited(given, "groups = { a = [1100.0, 1200.0], b = [3900.0, 4000.0] }");
    assert_eq!(refusal(&other, JobKind::Identification), "ACCEPTED", "b can be matched");
}

#[test]
fn run() {
    check(
        "rejected_run",
        JobKind::Identification,
        &[
            ("realizations = 500", "realizations = 0"),
            ("realizations = 500", "realizations = 10000001"),
            ("realizations = 500", "realizations = 1e3"),
            ("seed = 7", "seed = -1"),
            (SAMPLING, "sampling = \"halton\"\nscrambles = 4"),
            (SAMPLING, "sampling = \"monte_carlo\"\nscrambles = 4"),
            (SAMPLING, "scrambles = 2"),
            (SAMPLING, "sampling = \"sobol\"\nscrambles = 3"),
            (SAMPLING, "sampling = \"sobol\"\nscrambles = 0"),
            (SAMPLING, "sampling = \"sobol\"\nscrambles = 1025"),
            (SAMPLING, "sampling = \"sobol\"\nscrambles = 2.0"),
            (SAMPLING, "control_variate = 1"),
            (SAMPLING, "control_variate = \"yes\""),
            (SAMPLING, "control_variates = true"),
            ("max_failed_fraction = 0.02", "max_failed_fraction = 1.5"),
            ("kind = \"moments\"", "kind = \"entropy\""),
            (
                "kind = \"moments\"\n\n[search]\nmethod = \"simplex\"",
                "kind = \"likelihood\"\n\n[search]\nmethod = \"newton\"",
            ),
            (
                "realizations = 500\nseed = 7\nsampling = \"sobol\"\nscrambles = 4\n\
                 control_variate = true\nmax_failed_fraction = 0.02\n\n[objective]\nkind = \"moments\"",
                "realizations = 1\nseed = 7\nmax_failed_fraction = 0.02\n\n[objective]\nkind = \"likelihood\"",
            ),
            ("method = \"simplex\"", "method = \"annealing\""),
            (
                "realizations = 500\nseed = 7\nsampling = \"sobol\"\nscrambles = 4\n\
                 control_variate = true\nmax_failed_fraction = 0.02\n\n\
                 [objective]\nkind = \"moments\"\n\n[search]\nmethod = \"simplex\"",
                "realizations = 1\nseed = 7\nmax_failed_fraction = 0.02\n\n\
                 [objective]\nkind = \"moments\"\n\n[search]\nmethod = \"newton\"",
            ),
            ("max_evaluations = 300", "max_evaluations = 0"),
            ("cost_tolerance = 1e-9", "cost_tolerance = -1e-9"),
            ("size_tolerance = 1e-4", "size_tolerance = 1"),
            ("initial_step = 0.1", "initial_step = 0.6"),
            ("initial_step = 0.1", "starts = 0"),
            ("initial_step = 0.1", "starts = 1001"),
            ("initial_step = 0.1", "first_start = -1"),
            ("initial_step = 0.1", "first_start = 1001"),
            ("max_evaluations = 300", "max_evaluations = 10000\nstarts = 200"),
            ("sensitivities = false", "sensitivities = 1"),
            ("sensitivities = false", "sensitivity = true"),
            ("sensitivities = false", "priors = 1"),
            ("sensitivities = false", "priors = { densty = { value = 1700.0, weight = 1e-3 } }"),
            ("sensitivities = false", "priors = { dispersion = 0.1 }"),
            ("sensitivities = false", "priors = { dispersion = { value = 0.1 } }"),
            ("sensitivities = false", "priors = { dispersion = { value = 0.4, weight = 0.0 } }"),
            (
                "sensitivities = false",
                "priors = { longitudinal_shear_modulus = { value = 4e9, weight = 1.0 } }",
            ),
            (
                "method = \"simplex\"",
                "method = \"newton\"\npriors = { dispersion = { value = 0.1, weight = 1.0 } }",
            ),
            ("sensitivities = false", "speculation = true"),
        ],
    );
}

#[test]
fn the_draws_and_evaluations_of_many_groups_are_bounded() {
    let groups: String = (0..1000).map(|k| format!("g{k} = [3900.0, 4000.0]\n")).collect();
    let of = |method: &str, section: &str| {
        let text = edited("[data]\nvelocities = [3900.5, 4000, 3950.25]", "")
            .replace("\"simplex\"", &format!("\"{method}\""));
        refusal(&format!("{text}\n[data.groups]\n{groups}{section}"), JobKind::Identification)
    };
    assert_eq!(of("simplex", "[posterior]\n"), "ACCEPTED");
    let draws = of("simplex", "[posterior]\ndraws = 2001\n");
    let expected =
        "posterior.draws: is 2001, for each of 1000 groups; all together may have 2000000";
    assert!(draws.ends_with(expected), "{draws}");
    let searched = of("simplex", "[posterior]\nmax_evaluations = 701\n");
    let expected = "search.max_evaluations: is 300, of each of 1000 searches, and each of 1000 \
                    posteriors has up to 701; all together may have at most 1000000";
    assert!(searched.ends_with(expected), "{searched}");
    let alone = of("posterior", "[posterior]\nmax_evaluations = 1001\n");
    let expected = "posterior.max_evaluations: is 1001, for each of 1000 sets of data; all \
                    together may have at most 1000000";
    assert!(alone.ends_with(expected), "{alone}");
}

#[test]
fn a_propagation_checks_its_posterior_and_keeps_none() {
    let text = format!("{JOB}\n[posterior]\n");
    let job = job_file::parse(&text, Format::Toml, Path::new(""), JobKind::Propagation).unwrap();
    assert_eq!(job.posterior, None);
    let text = format!("{JOB}\n[posterior.priors]\ndensity = {{ distribution = \"normal\" }}\n");
    let refused = refusal(&text, JobKind::Propagation);
    assert!(refused.contains("posterior.priors.density.center: is missing"), "{refused}");
}

#[test]
fn data() {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    check(
        "rejected_data",
        JobKind::Identification,
        &[
            ("[data]\nvelocities = [3900.5, 4000, 3950.25]", ""),
            (given, ""),
            (given, "velocities = []"),
            (given, "velocities = [3900.0]"),
            (given, "velocities = [3900.0, 3900.0]"),
            (given, "velocities = [3900.0, -1.0, nan, 4000.0]"),
            (given, "velocities = [3900.0, \"4000\"]"),
            (given, "velocities = 3900.0"),
            (given, "velocities = \"missing.csv\""),
            (given, "mean = 3900.0"),
            (given, "mean = 3900.0\ncoefficient_of_variation = 0.0"),
            (given, "mean = 0\ncoefficient_of_variation = 0.03"),
            (given, "velocities = [3900.0, 4000.0]\nmean = 3900.0"),
            (given, "groups = { a = [3900.0, 4000.0] }\nmean = 3900.0"),
            (given, "groups = { a = [3900.0, 4000.0] }\nvelocities = [3900.0, 4000.0]"),
            (given, "groups = {}"),
            (given, "groups = [3900.0, 4000.0]"),
            (given, "groups = { a = [3900.0, 4000.0], b = 3900.0, \"c d\" = [3900.0, \"x\"] }"),
            (given, "groups = { a = [3900.0], b = [3900.0, -1.0], \"\" = [3900.0, 4000.0] }"),
            (given, "groups = { a = [3900.0], b = [3950.0, 3950.0] }"),
            (given, "groups = { a = [], b = [3900.0, 4000.0] }"),
            (given, "groups = { \"a\\tb\" = [3900.0, 4000.0] }"),
            (given, "group = \"site\""),
            (given, "velocities = [3900.0, 4000.0]\ngroup = \"site\""),
            (given, "velocities = \"v.csv\"\ngroup = 3"),
        ],
    );
}

#[test]
fn noise_of_the_data() {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    let moments = "mean = 3900.0\ncoefficient_of_variation = 0.03\n";
    let edits = [
        format!("{given}\nrepeatability = -1.0"),
        format!("{given}\nrepeatability = nan"),
        format!("{given}\nrepeatability = \"5 m/s\""),
        // The standard deviation of the three is 40.62.
        format!("{given}\nrepeatability = 40.7"),
        format!("{moments}repeatability = 117.1"),
        "groups = { a = [3900.0], b = [3900.0, 4000.0] }\nrepeatability = 50.0".to_owned(),
        format!("{moments}count = 1"),
        format!("{moments}count = 2.5"),
        format!("{moments}count = 1_000_000_001"),
        format!("{given}\ncount = 3"),
        format!("{given}\nsubject = \"patient\""),
        format!("{given}\nsubjects = [0, 1]"),
        format!("{given}\nsubjects = []"),
        format!("{given}\nsubjects = [7, 7, 7]"),
        format!("{given}\nsubjects = [0, -1, \"a\"]"),
        format!("{given}\nsubjects = \"patient\""),
        format!("{moments}subject = \"patient\"\nsubjects = [0, 1]"),
        "velocities = \"v.csv\"\nsubjects = [0, 1]".to_owned(),
        "velocities = \"v.csv\"\nsubject = 3".to_owned(),
        "groups.a = { velocities = [3900.0, 4000.0], subjects = [5, 5] }".to_owned(),
        "groups.a = { velocities = [3900.0, 4000.0], subjects = [5], subject = 1 }".to_owned(),
        "groups.a = { subjects = [0, 1] }".to_owned(),
    ];
    let edits = edits.each_ref().map(|to| (given, to.as_str()));
    check("rejected_data_noise", JobKind::Identification, &edits);
    let below = edited(given, &format!("{given}\nrepeatability = 40.6"));
    assert_eq!(refusal(&below, JobKind::Identification), "ACCEPTED");
}

#[test]
fn a_likelihood_does_not_contain_the_instruments_scatter() {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    let text = edited(given, &format!("{given}\nrepeatability = 5.0"));
    assert_eq!(refusal(&text, JobKind::Identification), "ACCEPTED");
    let text = text.replace("kind = \"moments\"", "kind = \"likelihood\"");
    let refused = refusal(&text, JobKind::Identification);
    assert!(refused.contains("data.repeatability: is 5.0; the objective.kind"), "{refused}");
}

#[test]
fn a_likelihood_needs_the_velocities_themselves() {
    let moments = edited(
        "velocities = [3900.5, 4000, 3950.25]",
        "mean = 3900.0\ncoefficient_of_variation = 0.03",
    );
    let text = moments.replace("kind = \"moments\"", "kind = \"likelihood\"");
    let refused = refusal(&text, JobKind::Identification);
    assert!(refused.contains("objective.kind"), "{refused}");
    for key in ["data.velocities", "data.mean", "data.coefficient_of_variation"] {
        assert!(refused.contains(key), "{refused}");
    }
    assert_eq!(refusal(&text, JobKind::Propagation), "ACCEPTED");
    assert_eq!(refusal(&moments, JobKind::Identification), "ACCEPTED");
}

#[test]
fn unknown_keys() {
    check(
        "rejected_unknown_keys",
        JobKind::Identification,
        &[
            ("", "[serach]\nmax_evaluations = 3\n"),
            ("", "tolerance = 1e-3\n"),
            ("", "[bone]\ndensity = 1600.0\n"),
            ("thickness = 11e-3", "thicknes = 11e-3"),
            ("amplitude        = 99.0", "Amplitude = 99.0"),
            ("count = 12", "number = 12"),
            ("threshold = 0.06", "treshold = 0.06"),
            ("refinement = 1.5", "refinment = 1.5"),
            ("realizations = 500", "realisations = 500"),
            ("sampling = \"sobol\"", "samplng = \"sobol\""),
            ("start = 0.1", "strat = 0.1"),
            ("[parameters.dispersion]", "[parameters.dispersoin]"),
            ("kind = \"moments\"", "\"sur prise\" = 1"),
        ],
    );
}

#[test]
fn a_propagation_checks_its_data_without_reading_files() {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    check(
        "rejected_propagation_data",
        JobKind::Propagation,
        &[
            (given, "velocities = [3900.0, -1.0]"),
            (given, "velocity = \"data.csv\""),
            (given, "velocities = 1"),
            (given, "mean = 1.0"),
        ],
    );
    let text = edited(given, "velocities = \"missing.csv\"");
    let job = job_file::parse(&text, Format::Toml, Path::new(""), JobKind::Propagation).unwrap();
    assert_eq!(job.data, None);
}

#[test]
fn all_seven_fixed_leaves_nothing_to_search() {
    let mut text = JOB.to_owned();
    for (free, fixed) in [
        ("start = 1700.0\nbounds = [1500.0, 2000.0]", "fixed = 1700.0"),
        ("start = 18e9\nbounds = [12e9, 25e9]", "fixed = 18e9"),
        ("start = 0.35\nbounds = [0.2, 0.45]", "fixed = 0.35"),
        ("start = 10e9\nbounds = [8e9, 16e9]", "fixed = 10e9"),
        ("start = 0.4\nbounds = [0.2, 0.5]", "fixed = 0.4"),
        ("start = 0.1\nbounds = [0.02, 0.3]", "fixed = 0.1"),
    ] {
        assert!(text.contains(free));
        text = text.replace(free, fixed);
    }
    assert_eq!(
        refusal(&text, JobKind::Identification),
        "1 error\n  parameters: all are fixed; an identification searches at least \
         one: give it start and bounds (a run at fixed parameters is a propagation)"
    );
    assert_eq!(refusal(&text, JobKind::Propagation), "ACCEPTED");
}

#[test]
fn everything_wrong_is_said_at_once_in_the_order_of_the_lines() {
    let text = JOB
        .replace("density = 1010.0", "density = 0, colour = 3")
        .replace("count = 12", "count = 0")
        .replace("start = 0.4\n", "start = 1.2\n")
        .replace("realizations = 500", "realizations = 0")
        .replace("[parameters.density]\nstart = 1700.0\nbounds = [1500.0, 2000.0]\n", "");
    pin("rejected_all_at_once", [("six mistakes", refusal(&text, JobKind::Identification))]);
}

#[test]
fn an_empty_file_names_the_tables_that_it_lacks() {
    pin(
        "rejected_empty_job",
        [
            ("identification", refusal("", JobKind::Identification)),
            ("propagation", refusal("", JobKind::Propagation)),
        ],
    );
}
