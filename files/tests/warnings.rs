//! What is accepted with a warning, and what without.

#[path = "support/hybrid_job.rs"]
mod hybrid_job;

use std::path::Path;

use osteon_common::job::JobKind;
use osteon_common::warnings::{Warning, case_warnings, job_warnings};
use osteon_files::document::Format;
use osteon_files::{case_file, job_file};

const JOB: &str = include_str!("files/job.toml");
const CASE: &str = include_str!("files/case.toml");
const MANDEL: &str = include_str!("files/mandel.toml");
const SUBLAYERS: &str = include_str!("files/sublayers.toml");

fn shown(warnings: &[Warning]) -> Vec<String> {
    warnings.iter().map(Warning::to_string).collect()
}

/// `text` with the one occurrence of `from` replaced by `to`.
fn edited(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "{from} must occur once");
    text.replace(from, to)
}

#[test]
fn ordinary_jobs_and_cases_are_silent() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    for name in ["fast", "quick", "paper"] {
        let path = root.join(format!("{name}.toml"));
        let warnings =
            job_file::read_with_warnings(&path, JobKind::Identification).unwrap().warnings;
        assert_eq!(shown(&warnings), [""; 0], "{name}");
    }
    for name in ["A", "D", "G"] {
        let case = case_file::read(&root.join(format!("cases/{name}.toml"))).unwrap();
        assert_eq!(shown(&case_warnings(&case)), [""; 0], "{name}");
    }
}

#[test]
fn unusual_numbers_of_a_job_are_accepted_with_a_warning() {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    for (from, to, expected) in [
        (
            "thickness = 3e-3",
            "thickness = 0.4",
            "layers.bone.thickness: is 0.4 m; usual is 0.0002 to 0.03 m; did you mean 0.4 mm (0.4e-3)?",
        ),
        (
            "thickness = 11e-3, density = 1010.0",
            "thickness = 11, density = 1010.0",
            "layers.coupling.thickness: is 11 m; usual is up to 0.3 m; did you mean 11 mm (11e-3)?",
        ),
        (
            "density = 950.0",
            "density = 0.95",
            "layers.marrow.density: is 0.95 kg/m³; usual is 100 to 15000 kg/m³; did you mean 0.95 g/cm³ \
             (0.95e3)?",
        ),
        (
            "center_frequency = 0.9e6",
            "center_frequency = 10e3",
            "probe.center_frequency: is 10000 Hz; usual is 20000 to 2e7 Hz; did you mean 10000 kHz \
             (10000e3)?",
        ),
        (
            "pitch = 0.9e-3",
            "pitch = 0.03",
            "probe.receivers.pitch: is 0.03 m; usual is 5e-5 to 0.02 m",
        ),
        (
            "method = \"exact\"",
            "method = \"hybrid\"\ntime_step = 8",
            "solver.time_step: is 8 s; usual is 1e-12 to 1e-6 s; did you mean 8 ns (8e-9)?",
        ),
        (
            "fixed = 4.795e9",
            "fixed = 4.795e6",
            "parameters.longitudinal_shear_modulus.fixed: is 4795000 Pa; usual is 1e8 to 1e12 Pa",
        ),
        (
            given,
            "velocities = [3900.5, 4000, 390]",
            "data.velocities: 390 (number 3) m/s: more than a factor 3 from the median 3900 m/s; in other \
             units, or a slip of the decimal point?",
        ),
        (
            given,
            "groups = { a = [3900.5, 4000], b = [8100, 8500] }",
            "data.groups.b: their median is 8300 m/s; usual is 1000 to 8000 m/s",
        ),
    ] {
        let mut text = edited(JOB, from, to);
        if to.contains("hybrid") {
            text = hybrid_job::without_exact_only(&text);
        }
        let parsed = job_file::parse(&text, Format::Toml, Path::new(""), JobKind::Identification);
        assert_eq!(shown(&job_warnings(&parsed.unwrap())), [expected], "{to}");
    }
}

#[test]
fn unusual_numbers_of_a_case_are_accepted_with_a_warning() {
    let modulus = "transverse_young_modulus = 9.8254e9";
    for (text, from, to, expected) in [
        (
            CASE,
            "density = 1598.8",
            "density = 15988",
            "bone.density: is 15990 kg/m³; usual is 300 to 6000 kg/m³",
        ),
        (
            MANDEL,
            "density = 1800",
            "density = 1.8",
            "bone.density: is 1.8 kg/m³; usual is 300 to 6000 kg/m³; did you mean 1.8 g/cm³ (1.8e3)?",
        ),
        (CASE, modulus, "transverse_young_modulus = 2e6", ""),
        (
            SUBLAYERS,
            "density = 1700",
            "density = 17000",
            "bone.sublayers[2].density: is 17000 kg/m³; usual is 300 to 6000 kg/m³",
        ),
        (
            SUBLAYERS,
            "thickness = 2e-3",
            "thickness = 40e-3",
            "bone.sublayers: the thickness of all together is 0.042 m; usual is 0.0002 to 0.03 m",
        ),
        (SUBLAYERS, "thickness = 2e-3", "thickness = 2e-6", ""),
    ] {
        let case = case_file::parse(&edited(text, from, to), Format::Toml).unwrap();
        let expected: Vec<&str> =
            Some(expected).into_iter().filter(|one| !one.is_empty()).collect();
        assert_eq!(shown(&case_warnings(&case)), expected, "{to}");
    }
    let case = case_file::parse(&MANDEL.replace("e9", ""), Format::Toml).unwrap();
    assert_eq!(
        shown(&case_warnings(&case)),
        [
            "bone: the largest stiffness is 19.9 Pa; usual is 1e8 to 1e12 Pa; did you mean 19.9 GPa (19.9e9)?"
        ]
    );
}
