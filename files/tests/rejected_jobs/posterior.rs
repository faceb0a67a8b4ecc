//! Settings of a posterior that are refused.

use osteon_common::job::JobKind;

use super::{check, edited, refusal};

/// A section with one prior.
fn prior(prior: &str) -> String {
    format!("[posterior.priors]\n{prior}\n")
}

#[test]
fn posterior() {
    let edits = [
        "[posterior]\ndraws = 99\n".to_owned(),
        "[posterior]\ndraws = 20001\n".to_owned(),
        "[posterior]\nmax_evaluations = 19\n".to_owned(),
        "[posterior]\nmax_evaluations = 2001\n".to_owned(),
        "[posterior]\ndraw = 1000\n".to_owned(),
        "[posteriors]\ndraws = 1000\n".to_owned(),
        "[posterior]\npriors = 1\n".to_owned(),
        prior("densty = { distribution = \"normal\", center = 1700.0, spread = 50.0 }"),
        prior("density = 1700.0"),
        prior("density = {}"),
        prior("density = { center = 1700.0, spread = 50.0 }"),
        prior("density = { distribution = \"gamma\", center = 1700.0 }"),
        prior("density = { distribution = \"normal\" }"),
        prior("density = { distribution = \"normal\", center = 1700.0, sprd = 50.0 }"),
        prior("density = { distribution = \"normal\", center = \"a\", spread = nan }"),
        prior("density = { distribution = \"normal\", center = inf, spread = 0.0 }"),
        prior("density = { distribution = \"normal\", center = 2500.1, spread = 50.0 }"),
        prior("density = { distribution = \"normal\", center = 1.7, spread = 0.05 }"),
        prior("density = { distribution = \"log_normal\", center = -1700.0, spread = 0.1 }"),
        prior("density = { distribution = \"log_normal\", center = 1700.0, spread = 0.0 }"),
        prior("dispersion = { distribution = \"log_normal\", center = 0.0002, spread = 0.4 }"),
        prior("density = { distribution = \"uniform\", center = 1700.0 }"),
        prior(
            "longitudinal_shear_modulus = { distribution = \"normal\", center = 4e9, spread = 1e9 }",
        ),
    ];
    let rows: Vec<_> = edits.iter().map(|text| ("[data]", format!("{text}\n[data]"))).collect();
    let mut rows: Vec<_> = rows.iter().map(|(from, to)| (*from, to.as_str())).collect();
    rows.push((
        "velocities = [3900.5, 4000, 3950.25]\n",
        "groups = { a = [3900.0, 4000.0] }\n[posterior]\ndraws = 20000\nmax_evaluations = 3000\n",
    ));
    rows.push((
        "method = \"simplex\"",
        "method = \"posterior\"\npriors = { dispersion = { value = 0.1, weight = 1.0 } }",
    ));
    check("rejected_posterior", JobKind::Identification, &rows);
}

#[test]
fn a_posterior_needs_two_realizations() {
    let sampling = "realizations = 500\nseed = 7\nsampling = \"sobol\"\nscrambles = 4";
    for (section, method) in [("[posterior]\n", "simplex"), ("", "posterior")] {
        let text =
            edited(sampling, "realizations = 1").replace("\"simplex\"", &format!("\"{method}\""));
        assert_eq!(
            refusal(&format!("{text}\n{section}"), JobKind::Identification),
            "1 error\n  line 73: monte_carlo.realizations: is 1; a posterior needs the \
             distribution of the velocities, hence at least 2 realizations"
        );
    }
}
