//! Materials by name in job and case files.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a helper of tests fails the test")]

mod support;

use std::path::Path;

use osteon_common::bone::{Bone, CaseBone};
use osteon_common::case::Case;
use osteon_common::job::{JobKind, JobSpecification, Range};
use osteon_common::parameters::Parameter;
use osteon_files::document::Format;
use osteon_files::{case_file, job_file, materials};

use support::pin;

const NAME: &str = "human-tibia-rho-1996";

fn job(parameters: &str) -> Result<JobSpecification, String> {
    let text = format!("[data]\nmean = 3906.0\ncoefficient_of_variation = 0.027\n{parameters}");
    job_file::parse(&text, Format::Toml, Path::new(""), JobKind::Identification)
        .map_err(|error| error.to_string())
}

fn case(bone: &str) -> Result<Case, String> {
    case_file::parse(bone, Format::Toml).map_err(|error| error.to_string())
}

fn bone(text: &str) -> Bone {
    match case(text) {
        Ok(Case { bone: CaseBone::Homogeneous(bone), .. }) => bone,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_case_has_the_values_of_its_material() {
    let tibia = materials::named(NAME).unwrap_or_else(|| panic!("{NAME}"));
    let named = bone(&format!("bone = {{ material = \"{NAME}\" }}"));
    assert_eq!(named.density, tibia.density);
    assert_eq!(Ok(named.elasticity), tibia.constants().elasticity());
    // A key beside the name replaces the material's value.
    let lighter =
        format!("[bone]\ndensity = 1800\ntransverse_poisson_ratio = 0.4\nmaterial = \"{NAME}\"");
    let lighter = bone(&lighter);
    assert_eq!(lighter.density, 1800.0);
    let constants = lighter.elasticity.engineering_constants();
    assert!((constants.transverse_poisson_ratio - 0.4).abs() < 1e-9, "{constants:?}");
    let modulus = tibia.constants().longitudinal_young_modulus;
    assert!((constants.longitudinal_young_modulus / modulus - 1.0).abs() < 1e-9, "{constants:?}");
}

#[test]
fn a_job_is_that_of_the_materials_values() {
    let tibia = materials::named(NAME).unwrap_or_else(|| panic!("{NAME}"));
    let by_name = job(&format!(
        "[parameters]\nmaterial = \"{NAME}\"\ndispersion = {{ start = 0.1, bounds = [0.02, 0.3] }}\n\
         longitudinal_young_modulus = {{ bounds = [12e9, 25e9] }}\ndensity = {{ fixed = 1850 }}"
    ))
    .unwrap_or_else(|error| panic!("{error}"));
    let modulus = tibia.constants().longitudinal_young_modulus;
    assert_eq!(
        by_name.range(Parameter::LongitudinalYoungModulus),
        Range::Free { start: modulus, lower: 12e9, upper: 25e9 }
    );
    assert_eq!(by_name.range(Parameter::Density), Range::Fixed(1850.0));
    let shear = tibia.constants().longitudinal_shear_modulus;
    assert_eq!(by_name.range(Parameter::LongitudinalShearModulus), Range::Fixed(shear));
    // The complete job names no material, and is the same job.
    let written = job_file::to_toml(&by_name);
    assert!(!written.contains("material"), "{written}");
    let read = job_file::parse(&written, Format::Toml, Path::new(""), JobKind::Identification);
    assert_eq!(read.unwrap_or_else(|error| panic!("{error}")), by_name);
}

#[test]
fn wrong_names_and_combinations_are_refused() {
    let known = format!("material = \"{NAME}\"\n");
    let bones = [
        "[bone]\nmaterial = \"human-tibia\"".to_owned(),
        "[bone]\nmaterial = 3".to_owned(),
        format!("[bone]\nmateriel = \"{NAME}\""),
        format!("[bone]\n{known}mandel = []"),
        format!("[bone]\n{known}density = 2.0"),
        format!("[bone]\n{known}longitudinal_poisson_ratio = 0.8"),
        format!("[bone]\n{known}dispersion = 0.1"),
    ];
    let parameters = [
        "[parameters]\nmaterial = \"Sawbones\"\ndispersion = { fixed = 0.1 }".to_owned(),
        "[parameters]\nmaterial = 1\ndispersion = { fixed = 0.1 }\ndensity = { bounds = [1, 2] }"
            .to_owned(),
        format!("[parameters]\nmateriel = \"{NAME}\"\ndispersion = {{ fixed = 0.1 }}"),
        format!("[parameters]\n{known}"),
        format!("[parameters]\n{known}dispersion = {{ bounds = [0.1, 0.2] }}"),
        format!(
            "[parameters]\n{known}dispersion = {{ fixed = 0.1 }}\ndensity = {{ start = 1700 }}"
        ),
        format!("[parameters]\n{known}dispersion = {{ fixed = 0.1 }}\ndensity = {{}}"),
        format!(
            "[parameters]\n{known}dispersion = {{ fixed = 0.1 }}\ndensity = {{ bounds = [1500, 1800] }}"
        ),
    ];
    let refused =
        |result: Result<(), String>| result.err().unwrap_or_else(|| "ACCEPTED".to_owned());
    let of_cases = bones.iter().map(|bone| (bone.as_str(), refused(case(bone).map(drop))));
    let of_jobs = parameters.iter().map(|text| (text.as_str(), refused(job(text).map(drop))));
    pin("rejected_materials", of_cases.chain(of_jobs));
}
