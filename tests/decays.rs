//! Identifications from velocities and other observables: what these add, and that workers change nothing.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[path = "support/service.rs"]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod service;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use service::{Service, worker};
use support::{Scratch, run, text};

/// The truth of the data of `examples/decays.toml`, and what its job finds.
const TRUTHS: [(&str, f64); 2] =
    [("longitudinal_young_modulus", 17.717e9), ("transverse_young_modulus", 9.8254e9)];

/// Returns the example with few realizations, its file of data beside it; `without` its decays.
fn example(scratch: &Scratch, name: &str, without: bool) -> PathBuf {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    fs::create_dir_all(scratch.path("data")).unwrap();
    fs::copy(examples.join("data/decays.csv"), scratch.path("data/decays.csv")).unwrap();
    let job = fs::read_to_string(examples.join("decays.toml")).unwrap();
    let mut job = job.replace("realizations = 256", "realizations = 64");
    if without {
        job = job.lines().filter(|line| !line.starts_with("decay")).collect::<Vec<_>>().join("\n");
    }
    scratch.write(name, &job)
}

/// Returns the largest relative error of the moduli.
fn error(result: &Value) -> f64 {
    let of = |(name, truth): (&str, f64)| {
        (result["parameters"][name].as_f64().unwrap() / truth - 1.0).abs()
    };
    TRUTHS.into_iter().map(of).fold(0.0, f64::max)
}

#[test]
fn decays_find_what_velocities_leave_open() {
    let scratch = Scratch::new();
    let with = example(&scratch, "with.toml", false);
    let without = example(&scratch, "without.toml", true);
    let out = scratch.path("out");
    let found = run(&["identify", text(&with), "--json", "--out", text(&out)]).json();
    let alone = run(&["identify", text(&without), "--json"]).json();
    assert_eq!((&found["status"], &alone["status"]), (&"converged".into(), &"converged".into()));
    // The standard errors of the moduli are about 1 %.
    assert!(error(&found) < 0.03 && error(&alone) > 2.0 * error(&found), "{found}, {alone}");
    for (name, truth) in TRUTHS {
        let known = &found["identified"]["parameters"][name];
        let [lower, upper] = [0, 1].map(|end| known["interval"][end].as_f64().unwrap());
        assert!((lower..upper).contains(&truth), "{name}: {known}");
        assert!(alone["identified"]["parameters"][name]["interval"].is_null());
        assert!(found["sensitivities"][name]["decay"].is_number());
        assert!(alone["sensitivities"][name].get("decay").is_none());
    }
    let of_model = found["decay"]["mean"].as_f64().unwrap();
    let of_data = found["data"]["decay"]["mean"].as_f64().unwrap();
    assert!((of_model / of_data - 1.0).abs() < 1e-3, "{of_model}, {of_data}");
    assert!(alone.get("decay").is_none() && alone["data"].get("decay").is_none());
    let history = fs::read_to_string(out.join("history.csv")).unwrap();
    assert!(history.contains(",mean,coefficient_of_variation,decay,cost,"), "{history}");
    // `job.toml` holds the data: the same job again.
    let again = scratch.write("again.toml", &fs::read_to_string(out.join("job.toml")).unwrap());
    let again = run(&["identify", text(&again), "--json"]).json();
    assert_eq!(again["digest"], found["digest"]);
}

/// With all three observables four parameters are determined, by Newton's search, too.
#[test]
fn the_table_of_observe_is_data_of_an_identification() {
    let scratch = Scratch::new();
    let bones = scratch.write(
        "bones.toml",
        "[parameters]\nmaterial = \"human-radius-desceliers\"\ndispersion = { fixed = 0.1 }\n\
         [monte_carlo]\nrealizations = 60\nseed = 7\n",
    );
    let table = scratch.path("observed.csv");
    run(&["observe", text(&bones), "--out", text(&table)]).succeeded();
    let job = scratch.write(
        "job.toml",
        "[data]\nvelocities = \"observed.csv\"\ndecay = \"decay\"\ndecay_spreading = \"line\"\n\
         decay_error = 0\nother_velocity = \"other_velocity\"\ncenter_frequency = \"center_frequency\"\n\
         [parameters]\nmaterial = \"human-radius-desceliers\"\n\
         longitudinal_young_modulus = { start = 20.0e9, bounds = [14.0e9, 25.0e9] }\n\
         longitudinal_shear_modulus = { start = 4.2e9, bounds = [3.0e9, 6.5e9] }\n\
         transverse_young_modulus = { start = 12.0e9, bounds = [8.0e9, 16.0e9] }\n\
         dispersion = { start = 0.15, bounds = [0.02, 0.3] }\n\
         [monte_carlo]\nsampling = \"sobol\"\nrealizations = 64\ncontrol_variate = true\n\
         [search]\nmethod = \"newton\"\n",
    );
    let found = run(&["identify", text(&job), "--json"]).json();
    assert_eq!(found["identified"]["matched"], true, "{found}");
    for (name, truth) in TRUTHS.into_iter().chain([("longitudinal_shear_modulus", 4.795e9)]) {
        let known = &found["identified"]["parameters"][name];
        let [lower, upper] = [0, 1].map(|end| known["interval"][end].as_f64().unwrap());
        assert!((lower..upper).contains(&truth), "{name}: {known}");
    }
    assert!(found["center_frequency"]["mean"].as_f64().unwrap() > 1e6);
}

/// Every answer is computed by two workers and compared, decays included.
#[test]
fn the_digest_is_the_same_with_one_worker_and_with_two() {
    let scratch = Scratch::new();
    let file = example(&scratch, "job.toml", false);
    let job = fs::read_to_string(&file).unwrap() + "\n[search]\nmax_evaluations = 12\n";
    let file = scratch.write("job.toml", &job);
    let alone = run(&["identify", text(&file), "--json", "--threads", "1"]).json();
    let service = Service::start(&scratch, &["--audit-fraction", "1"]);
    let _workers = [(); 2].map(|()| worker(&scratch, service.url()));
    let arguments = ["identify", text(&file), "--json", "--coordinator", service.url()];
    let shared = run(&arguments).json();
    assert_eq!((&shared["digest"], &shared["decay"]), (&alone["digest"], &alone["decay"]));
}
