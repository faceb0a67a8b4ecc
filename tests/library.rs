//! Compares a job in the process of a Rust program with the same job by coordinator and workers.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

#[path = "../examples/identify.rs"]
#[expect(dead_code, reason = "its `main` is not called")]
mod example;

use std::path::Path;

use osteon_common::job::JobKind;
use osteon_common::parameters::Parameter;
use osteon_files::job_file;
use support::{Scratch, job, run, text};

/// Compares the example's result with the output of `osteon identify`.
fn check(file: &Path) {
    let specification = job_file::read(file, JobKind::Identification).unwrap();
    let found = example::run(&specification).unwrap();
    let printed = run(&["identify", text(file), "--json", "--workers", "2"]).json();
    let result = found.result;
    assert_eq!(printed["digest"], result.digest.as_str(), "{}", file.display());
    assert_eq!(printed["status"], result.status.name());
    assert_eq!(printed["evaluations"], result.evaluations);
    let best = result.best.unwrap();
    for (parameter, expected) in best.point.given() {
        let value = match parameter {
            Parameter::Dispersion => &printed["dispersion"],
            other => &printed["parameters"][other.name()],
        };
        let value = value.as_f64().unwrap();
        assert_eq!(value.to_bits(), expected.to_bits(), "{parameter:?}");
    }
    let largest = printed["solver"]["estimated_error"]["largest"].as_f64();
    assert_eq!(largest, best.estimated_error.map(|errors| errors.largest));
}

#[test]
fn a_program_of_its_own_gives_the_bits_of_the_service() {
    let scratch = Scratch::new();
    // By simplex with independent germs; by Newton steps with Sobol' points.
    check(&scratch.write("job.toml", &job(40, 30)));
    check(&Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/fast.toml"));
}

/// Thickness and attenuation are searched, and the probe's tilt is random.
#[test]
fn so_it_does_with_a_setup_that_is_searched_and_random() {
    let scratch = Scratch::new();
    let searched = "\n[layers]\nbone = { thickness = 1.2e-3, attenuation = { quality_factor = 15 } }\n\
                    [parameters.bone_thickness]\nbounds = [0.8e-3, 1.6e-3]\n\
                    [parameters.bone_quality_factor]\nstart = 12\nbounds = [8, 30]\n\
                    [random.probe_tilt]\nstandard_deviation = 0.005\n";
    check(&scratch.write("job.toml", &format!("{}{searched}", job(24, 12))));
}
