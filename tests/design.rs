//! `osteon design`: what to measure next.

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use support::{Scratch, run, text};

/// Two groups, with density, modulus and dispersion searched.
const JOB: &str = r#"
[data.groups]
young = [3871.0, 3923.0, 3899.0, 3951.0, 3884.0, 3990.0]
old = [3771.0, 3823.0, 3799.0, 3851.0, 3784.0, 3890.0, 3801.0]

[parameters]
material = "human-radius-desceliers"
density = { start = 1700.0, bounds = [1500.0, 2000.0] }
longitudinal_young_modulus = { bounds = [12e9, 25e9] }
dispersion = { start = 0.1, bounds = [0.02, 0.3] }
"#;

/// The best measurement comes first, whatever the order in which they are asked for.
#[test]
fn measurements_are_ranked_for_a_quantity() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", JOB);
    let job = text(&job);
    let asked = ["design", job, "--group", "old", "--for", "density", "--with", "velocities=100"];
    let asked = [&asked[..], &["--with", "density=2%", "--with", "density=1%"]].concat();
    let shown = run(&asked);
    let shown = shown.succeeded();
    assert!(shown.contains("as it is: with 7 velocities"), "{shown}");
    let order = ["as it is", "density to 1 %", "density to 2 %", "100 velocities"];
    let places = order.map(|name| shown.rfind(name).unwrap_or_else(|| panic!("{name}: {shown}")));
    assert!(places.is_sorted(), "{shown}");
    let found = run(&[&asked[..], &["--json"]].concat()).json();
    assert_eq!(found["quantities"].as_array().unwrap().len(), 1);
    let best = &found["quantities"][0]["measurements"][0];
    assert_eq!(best["measurement"], "density=1%");
    assert!(best["standard_deviation"].as_f64().unwrap() < 17.1, "{found}");
}

#[test]
fn what_cannot_be_designed_says_why() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", JOB);
    let check = |arguments: &[&str], words: &str| {
        let refused = run(&[&["design", text(&job)], arguments].concat());
        assert_eq!(refused.code, Some(2), "{refused:?}");
        assert!(refused.stderr.contains(words), "{refused:?}");
    };
    check(&[], "the data are of groups; choose one with --group: young, old");
    check(&["--group", "o"], "they have young, old");
    let of_old = |more: &[&'static str]| [&["--group", "old"], more].concat();
    check(&of_old(&["--for", "porosity"]), "possible are bulk_velocity, density, ");
    check(&of_old(&["--with", "tilt=1e-3"]), "tilt=0.001: the job takes it as known");
    check(&of_old(&["--with", "stiffness=2%"]), "\"stiffness\" is no measurement");
}
