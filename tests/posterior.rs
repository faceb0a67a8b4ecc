//! A posterior in a run: its files, and the same bytes whatever computes it.

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;

use serde_json::Value;
use support::{Coordinator, Scratch, eventually, run};

const JOB: &str = r#"
[data]
mean = 3906.0
coefficient_of_variation = 0.0271
count = 30

[parameters]
density = { fixed = 1598.8 }
longitudinal_young_modulus = { start = 17e9, bounds = [12e9, 25e9] }
longitudinal_poisson_ratio = { fixed = 0.3816 }
longitudinal_shear_modulus = { start = 4.5e9, bounds = [3e9, 6.5e9] }
transverse_young_modulus = { fixed = 9.8254e9 }
transverse_poisson_ratio = { fixed = 0.4495 }
dispersion = { start = 0.15, bounds = [0.02, 0.3] }

[monte_carlo]
sampling = "sobol"
realizations = 16
control_variate = true

[search]
method = "posterior"

[posterior]
draws = 300
"#;

/// The optimum lies within its intervals; the shear modulus, of which velocities say nothing, keeps
/// its prior.
#[test]
fn a_posterior_does_not_depend_on_the_number_of_workers() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", JOB);
    let results = ["1", "2"].map(|workers| {
        let out = scratch.path(workers);
        let (file, to) = (file.to_str().unwrap(), out.to_str().unwrap());
        let ran = run(&["identify", file, "--workers", workers, "--out", to]);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        ["result.json", "posterior.csv"].map(|name| fs::read_to_string(out.join(name)).unwrap())
    });
    let [[one, draws], other] = results;
    assert!(one == other[0] && draws == other[1], "the bytes differ");
    assert_eq!(draws.lines().count(), 301);
    let result: Value = serde_json::from_str(&one).unwrap();
    let posterior = &result["posterior"];
    assert_eq!(posterior["converged"], true, "{posterior}");
    let within = |quantity: &Value, value: f64| {
        let [low, high] = [0, 1].map(|end| quantity["interval_95"][end].as_f64().unwrap());
        assert!(low < value && value < high, "{value}: {quantity}");
    };
    within(&posterior["bulk_velocity"], 3960.0);
    within(&posterior["parameters"]["dispersion"], 0.1029);
    let shear = &posterior["parameters"]["longitudinal_shear_modulus"];
    assert!(shear["explained"].as_f64().unwrap() < 0.1, "{shear}");
}

/// Each coordinator is killed once more points of the posterior are known than before it.
#[test]
fn a_posterior_has_the_same_bytes_if_the_coordinator_is_killed_twice() {
    let scratch = Scratch::new();
    // So many realizations that the posterior takes seconds.
    let job = JOB.replace("realizations = 16", "realizations = 400");
    let file = scratch.write("job.toml", &job);
    let store = scratch.path("store");
    let mut coordinator = Coordinator::start(&store);
    let id = coordinator.submit(&file);
    for _ in 0..2 {
        let _worker = coordinator.worker(1);
        let evaluations = || coordinator.job(&id)["evaluations"].as_u64().unwrap();
        let known = evaluations();
        eventually("more points are known", || evaluations() > known + 3);
        assert_eq!(coordinator.job(&id)["state"], "running", "the job ended too early");
        coordinator.process.kill();
        coordinator = Coordinator::start(&store);
    }
    let _worker = coordinator.worker(1);
    coordinator.client(&["watch", &id]).succeeded();
    let [fetched, undisturbed] = ["fetched", "undisturbed"].map(|name| scratch.path(name));
    coordinator.client(&["fetch", &id, "--out", fetched.to_str().unwrap()]).succeeded();
    let (file, to) = (file.to_str().unwrap(), undisturbed.to_str().unwrap());
    run(&["identify", file, "--workers", "2", "--out", to]).succeeded();
    for name in ["result.json", "posterior.csv", "history.csv"] {
        let bytes = [&fetched, &undisturbed].map(|from| fs::read(from.join(name)).unwrap());
        assert!(bytes[0] == bytes[1], "{name} differs");
    }
}
