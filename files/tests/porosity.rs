//! Porosities in case files.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

mod support;

use std::path::Path;

use osteon_common::bone::CaseBone;
use osteon_common::case::Case;
use osteon_common::elasticity::EngineeringConstants;
use osteon_common::job::JobKind;
use osteon_common::porosity::{
    BoneMatrix, CasePorosityModel, Homogenisation, PoreFluid, PorosityModel,
};
use osteon_common::realization::mean_bone;
use osteon_files::document::Format;
use osteon_files::{case_file, job_file};

use support::pin;

const EVERY_KEY: &str = include_str!("files/porosity.toml");

fn case(text: &str) -> Result<Case, String> {
    case_file::parse(text, Format::Toml).map_err(|error| error.to_string())
}

fn homogeneous(model: &CasePorosityModel, porosity: f64) -> CaseBone {
    CaseBone::Homogeneous(model.bone(porosity).unwrap())
}

#[test]
fn a_case_has_the_bone_of_its_porosity() {
    let read = case("bone = { porosity = 0.1 }").unwrap();
    assert_eq!(read.bone, homogeneous(&CasePorosityModel::default(), 0.1));
    // A whole number is a number, too, and bone without pores is the matrix.
    let read = case("bone = { porosity = 0 }").unwrap();
    assert_eq!(read.bone, homogeneous(&CasePorosityModel::default(), 0.0));
}

#[test]
fn every_key_of_the_model_counts() {
    let model = CasePorosityModel {
        matrix: BoneMatrix {
            density: 1900.0,
            constants: EngineeringConstants {
                longitudinal_young_modulus: 22e9,
                longitudinal_poisson_ratio: 0.35,
                longitudinal_shear_modulus: 6.5e9,
                transverse_young_modulus: 15e9,
                transverse_poisson_ratio: 0.4,
            },
        },
        model: PorosityModel {
            homogenisation: Homogenisation::SelfConsistent,
            fluid: PoreFluid { bulk_modulus: 2.2e9, density: 950.0 },
        },
    };
    assert_eq!(case(EVERY_KEY).unwrap().bone, homogeneous(&model, 0.12));
    // Keys that are left out have their defaults.
    let lighter = "[bone]\nporosity = 0.2\nporosity_model = { matrix = { density = 1900 } }";
    let mut model = CasePorosityModel::default();
    model.matrix.density = 1900.0;
    assert_eq!(case(lighter).unwrap().bone, homogeneous(&model, 0.2));
}

#[test]
fn a_profile_makes_sublayers_of_the_bones_thickness() {
    let check = |given: &str, porosities: &[f64]| {
        let text = format!(
            "layers = {{ bone = {{ thickness = 3e-3 }} }}\nbone = {{ porosity = {given} }}"
        );
        let CaseBone::Layered(sublayers) = case(&text).unwrap().bone else { panic!("not layered") };
        let solids: Vec<_> = sublayers.iter().map(|one| one.solid).collect();
        let model = CasePorosityModel::default();
        let expected: Vec<_> = porosities.iter().map(|&one| model.bone(one).unwrap()).collect();
        assert_eq!(solids, expected);
        assert!((sublayers.thickness() - 3e-3).abs() < 1e-18);
    };
    check("{ surface = 0.0625, marrow = 0.1875, sublayers = 2 }", &[0.09375, 0.15625]);
    let endosteal = "{ surface = 0.05, marrow = 0.15, shape = \"endosteal\" }";
    check(endosteal, &[0.05, 0.15]);
    check("{ shape = \"table\", values = [0.04, 0.05, 0.3] }", &[0.04, 0.05, 0.3]);
}

#[test]
fn sublayers_have_porosities_by_the_model_of_the_bone() {
    let text = |model: &str| {
        format!(
            "[bone]\n{model}\n[[bone.sublayers]]\nthickness = 2e-3\nporosity = 0.05\n\
             [[bone.sublayers]]\nthickness = 1e-3\nporosity = 0.15\n"
        )
    };
    let mut model = CasePorosityModel::default();
    for given in ["", "porosity_model = { homogenisation = \"self_consistent\" }"] {
        let CaseBone::Layered(sublayers) = case(&text(given)).unwrap().bone else {
            panic!("not layered");
        };
        let solids: Vec<_> = sublayers.iter().map(|one| one.solid).collect();
        assert_eq!(solids, [0.05, 0.15].map(|porosity| model.bone(porosity).unwrap()));
        model.model.homogenisation = Homogenisation::SelfConsistent;
    }
    let refused = case(&text("").replace("0.15", "0.6")).unwrap_err();
    assert!(refused.contains("bone.sublayers[1].porosity: is 0.6"), "{refused}");
    let refused = case(&text("porosity = 0.1")).unwrap_err();
    assert!(refused.contains("bone.porosity: is given together with sublayers"), "{refused}");
}

#[test]
fn a_job_has_sublayers_of_any_solids() {
    let job = |text: &str| {
        let kind = JobKind::Propagation;
        job_file::parse(text, Format::Toml, Path::new(""), kind).map_err(|error| error.to_string())
    };
    let dispersion = "[parameters]\ndispersion = { fixed = 0.1 }";
    let named = "[[bone.sublayers]]\nthickness = 1e-3\nmaterial = \"human-femur-ashman-1984\"";
    let porous = "[[bone.sublayers]]\nthickness = 2e-3\nporosity = 0.15";
    let read = job(&format!("{named}\n{porous}\n{dispersion}")).unwrap();
    assert_eq!(read.setup.layers.bone_thickness, 1e-3 + 2e-3);
    let bone = mean_bone(&read.start(), &read.setup).unwrap();
    assert_eq!(bone, case(&format!("{named}\n{porous}")).unwrap().bone);
    assert_eq!(job(&job_file::to_toml(&read)).unwrap(), read);
    // Where none is porous, the parameters have no meaning but the dispersion.
    let read = job(&format!("{named}\n{dispersion}")).unwrap();
    assert_eq!(job(&job_file::to_toml(&read)).unwrap(), read);
    let refused = job(&format!("{named}\n{dispersion}\ndensity = {{ fixed = 1800.0 }}"));
    let expected = "parameters.density: has no effect, as each of bone.sublayers";
    assert!(refused.as_ref().unwrap_err().contains(expected), "{refused:?}");
}

/// No closed form tells the scatter that a random tilt gives the velocities of sublayers.
#[test]
fn data_of_sublayers_may_scatter_by_the_setup_alone() {
    let read = |random: &str| {
        let text = format!(
            "[[bone.sublayers]]\nthickness = 3e-3\nporosity = 0.1\n[data]\nmean = 3900.0\n\
             coefficient_of_variation = 0.05\ncount = 50\n[parameters.dispersion]\nstart = 0.01\n\
             bounds = [0.005, 0.02]\n{random}"
        );
        job_file::parse(&text, Format::Toml, Path::new(""), JobKind::Identification)
    };
    let refused = read("").unwrap_err().to_string();
    assert!(refused.contains("data.coefficient_of_variation"), "{refused}");
    read("[random.probe_tilt]\nstandard_deviation = 0.01").unwrap();
}

/// As with a material, nothing but the values goes on.
#[test]
fn the_complete_case_has_the_values_and_no_porosity() {
    let read = case(EVERY_KEY).unwrap();
    let written = case_file::to_toml(&read);
    assert!(!written.contains("porosity"), "{written}");
    assert_eq!(case(&written).unwrap(), read);
}

#[test]
fn wrong_porosities_and_models_are_refused() {
    let of_model = |model: &str| format!("[bone]\nporosity = 0.1\n[bone.porosity_model]\n{model}");
    let alone = ["0.5", "-0.01", "10", "nan", "\"10 %\"", "{ surface = 0.05 }"];
    let alone = alone.map(|value| format!("[bone]\nporosity = {value}"));
    let beside = [
        "[bone]\nporosity = 0.1\ndensity = 1800",
        "[bone]\nporosity = 0.1\nmaterial = \"human-tibia-rho-1996\"",
        "[bone]\nporosity = 0.1\nmandel = []",
        "[bone]\nporosity = 0.1\nlongitudinal_young_modulus = 20e9\ntransverse_young_modulus = 12e9",
        "[bone]\nporosety = 0.1",
        "[bone]\nporosity_model = {}",
        "[bone]\nporosety = 0.1\nporosity_model = {}",
        "[bone]\nporosity = 0.1\nporosity_model = \"mori_tanaka\"",
    ];
    let models = [
        "homogenization = \"mori_tanaka\"",
        "homogenisation = \"self-consistent\"",
        "matrix = { density = 1.9 }",
        "matrix = { longitudinal_young_modulus = 22 }",
        "matrix = { longitudinal_poisson_ratio = 0.9 }",
        "matrix = { mandel = [] }",
        "fluid = { bulk_modulus = 2.3 }",
        "fluid = { bulk_modulus = -1, density = inf }",
        "fluid = { bulk_modulus = 1e308 }",
        "fluid = { sound_speed = 1500 }",
        "homogenisation = \"self_consistent\"\nfluid = { bulk_modulus = 0 }\nmatrix = { density = 0 }",
    ];
    let soft = "[bone]\nporosity = 0.4\n[bone.porosity_model]\nhomogenisation = \"self_consistent\"\n\
                fluid = { bulk_modulus = 0 }";
    let texts = alone.into_iter().chain(beside.map(str::to_owned));
    let texts = texts.chain(models.map(of_model)).chain([soft.to_owned()]);
    let refused: Vec<_> = texts
        .map(|text| {
            let message = case(&text).err().unwrap_or_else(|| "ACCEPTED".to_owned());
            (text, message)
        })
        .collect();
    let refused = refused.iter().map(|(text, message)| (text.as_str(), message.clone()));
    pin("rejected_porosity", refused);
}
