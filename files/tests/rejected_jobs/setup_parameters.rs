//! Quantities of the setup that are searched.

use osteon_common::job::{JobKind, Range};
use osteon_common::parameters::Parameter;

use super::{BONE, check, edited};

/// The first range of `files/job.toml`.
const FIRST: &str = "[parameters.density]\n";

/// Keys of a range before the first one of the file.
fn with(name: &str, keys: &str) -> (&'static str, String) {
    (FIRST, format!("[parameters.{name}]\n{keys}\n\n{FIRST}"))
}

#[test]
fn setup_parameters() {
    let edits = [
        with("bone_thickness", "fixed = 3e-3"),
        with("bone_thickness", "start = 3e-3"),
        with("bone_thickness", "bounds = [2e-3]"),
        with("bone_thickness", "bounds = [4e-3, 5e-3]"),
        with("bone_thickness", "start = 6e-3\nbounds = [2.8e-3, 5e-3]"),
        with("bone_thickness", "bounds = [-1e-3, 5e-3]"),
        with("bone_thickness", "start = 3\nbounds = [2, 5]"),
        // Extreme realizations of thinner bones have no thickness.
        with("bone_thickness", "bounds = [0.3e-3, 5e-3]"),
        with("bone_quality_factor", "bounds = [1.0, 30.0]"),
        with("coupling_sound_speed", "bounds = [1400.0, 1.6]"),
        with("marrow_sound_speed", "bounds = [1400.0, 1600.0]"),
    ];
    let edits: Vec<(&str, &str)> = edits.iter().map(|(from, to)| (*from, to.as_str())).collect();
    check("rejected_setup_parameters", JobKind::Identification, &edits);
}

#[test]
fn pores() {
    let bone = |keys: &str| (FIRST, format!("[bone]\n{keys}\n\n{FIRST}"));
    let edits = [
        bone("porosity = 0.0"),
        bone("porosity = 10.0"),
        bone("porosity = 0.5"),
        bone("porosity = { surface = 0.05 }"),
        bone("porosity = {}"),
        bone("porosity = { surface = 0.05, marrow = 0.6 }"),
        bone("porosity = { surface = 0.05, marrow = 0.1, sublayers = 17 }"),
        bone("porosity = { surface = 0.05, marrow = 0.1, shape = \"endosteal\", sublayers = 4 }"),
        bone("porosity = { surface = 0.05, marrow = 0.1, shape = \"quadratic\" }"),
        bone("porosity = { surface = 0.05, marrow = 0.1, values = [0.05, 0.1] }"),
        bone("porosity = { surface = 0.05, shape = \"table\", values = [0.05, 0.1] }"),
        bone("porosity = { shape = \"table\" }"),
        bone("porosity = { shape = \"table\", values = [0.05] }"),
        bone("porosity = { shape = \"table\", values = [0.05, 0.6] }"),
        bone("porosity_model = { homogenisation = \"self_consistent\" }"),
        bone("porosity = 0.1\nporosity_model = { matrix = { density = 1900.0 } }"),
        bone("porosity = 0.1\ndensity = 1800.0"),
        bone(
            "porosity = 0.4\nporosity_model = { homogenisation = \"self_consistent\", fluid = { bulk_modulus = 0 } }",
        ),
        with("porosity", "bounds = [0.05, 0.2]"),
        bone("porosity = 0.1\n[parameters.porosity]\nbounds = [0.0, 0.2]"),
        bone("porosity = 0.1\n[parameters.porosity]\nbounds = [5, 20]\nstart = 10"),
        bone("porosity = 0.1\n[parameters.marrow_porosity]\nbounds = [0.05, 0.2]"),
        bone("porosity = 0.1\n[random.porosity]\nstandard_deviation = 0.03"),
        bone("porosity = 0.1\n[parameters]\nmaterial = \"human-tibia-rho-1996\""),
    ];
    let edits: Vec<(&str, &str)> = edits.iter().map(|(from, to)| (*from, to.as_str())).collect();
    check("rejected_pores", JobKind::Identification, &edits);
}

/// `known` is of the group `b`; `a` has a thickness of 3 mm.
#[test]
fn known_quantities_of_groups() {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    let group = "groups.a = { velocities = [3900.0, 4000.0], bone_thickness = 3e-3 }";
    let with =
        |known: &str| format!("{group}\ngroups.b = {{ velocities = [3900.0, 4000.0]{known} }}");
    let edits = [
        with(""),
        with(", coupling_sound_speed = 1480.0"),
        with(", bone_thickness = 3"),
        with(", bone_thickness = 0.0"),
        with(", bone_thickness = \"3e-3\""),
        // Extreme realizations of thinner bones have no thickness.
        with(", bone_thickness = 0.3e-3"),
        with(", probe_tilt = 0.01"),
        format!("{group}\nknown = {{ bone_thickness = \"t\" }}"),
        format!("{given}\nknown = {{ bone_thickness = \"t\" }}"),
    ];
    let edits: Vec<(&str, &str)> = edits.iter().map(|to| (given, to.as_str())).collect();
    check("rejected_known_quantities", JobKind::Identification, &edits);
    let searched = edited(given, group)
        .replace(FIRST, &format!("[parameters.bone_thickness]\nbounds = [2e-3, 5e-3]\n\n{FIRST}"));
    let refused = super::refusal(&searched, JobKind::Identification);
    let expected = "data.groups.\"a\".bone_thickness: is known of each group, and \
                    parameters.bone_thickness is searched; leave one of them out";
    assert!(
        refused.contains(expected) || refused.contains(&expected.replace('"', "")),
        "{refused}"
    );
}

#[test]
fn the_speed_of_sublayers_of_the_coupling_is_not_random_searched_or_known() {
    let coupling = "thickness = 11e-3, density = 1010.0, sound_speed = 1510.0";
    let sublayers = "sublayers = [{ thickness = 6e-3, density = 990.0, sound_speed = 1480.0 }, \
                     { thickness = 5e-3, density = 1060.0, sound_speed = 1570.0 }]";
    let random =
        "[random.coupling_sound_speed]\nstandard_deviation = 10.0\ndistribution = \"uniform\"\n";
    let given = "velocities = [3900.5, 4000, 3950.25]";
    // The value is the default, which a setup of sublayers keeps.
    let known = "groups.a = { velocities = [3900.0, 4000.0], coupling_sound_speed = 1500.0 }";
    let searched =
        format!("[parameters.coupling_sound_speed]\nbounds = [1450.0, 1550.0]\n\n{FIRST}");
    // Elements in a stack have no width.
    let of_stack = edited(coupling, sublayers).replace("element_width = 0.5e-3\n", "");
    let fixed = of_stack.replace(random, "");
    let texts = [
        ("random", of_stack),
        ("searched", fixed.replace(FIRST, &searched)),
        ("known", fixed.replace(given, known)),
    ];
    let refusals = texts.map(|(what, text)| (what, super::refusal(&text, JobKind::Identification)));
    super::pin("rejected_speed_of_sublayers", refusals);
}

#[test]
fn a_quantity_of_the_setup_starts_at_its_value_there() {
    let (from, to) = with("bone_thickness", "bounds = [2e-3, 5e-3]");
    let text = edited(from, &to);
    let job = super::parsed(&text);
    let expected = Range::Free { start: 3e-3, lower: 2e-3, upper: 5e-3 };
    assert_eq!(job.range(Parameter::BoneThickness), expected);
    assert_eq!(job.range(Parameter::CouplingSoundSpeed), Range::AS_IN_SETUP);
    assert_eq!(job.parameters_given().count(), 8);
}

#[test]
fn sublayers() {
    const SOLID: &str = "density = 1850.0\nlongitudinal_young_modulus = 20e9\nlongitudinal_poisson_ratio = \
                         0.38\nlongitudinal_shear_modulus = 5e9\ntransverse_young_modulus = \
                         10e9\ntransverse_poisson_ratio = 0.44";
    const LAST: &str = "marrow   = { thickness = 12e-3, density = 950.0, sound_speed = 1450.0 }";
    let layers = format!("{BONE}\n{LAST}\n");
    let attenuated = layers.replace("thickness = 3e-3, attenuation", "attenuation");
    let stack = |before: &str, keys: &str| {
        let upper = "[[bone.sublayers]]\nthickness = 2e-3\nporosity = 0.05";
        format!("{attenuated}\n{before}\n{upper}\n[[bone.sublayers]]\n{keys}\n")
    };
    let edits = [
        stack("", "porosity = 0.1"),
        stack("", "thickness = 1\nporosity = 0.1"),
        stack("", "thickness = 1e-3"),
        stack("", "thickness = 1e-3\nporosity = 0.6"),
        stack("", "thickness = 1e-3\nporosity = 0.1\ndensity = 1800.0"),
        stack("", &format!("thickness = 1e-3\n{}", SOLID.replace("1850.0", "0.0"))),
        stack("", "thickness = 1e-3\ndensity = 1800.0\nmandel = [[1.0]]"),
        stack("[bone]\nporosity = 0.1", "thickness = 1e-3\nporosity = 0.1"),
        stack("[bone]\ndensity = 1800.0", "thickness = 1e-3\nporosity = 0.1"),
        stack("[parameters.porosity]\nbounds = [0.05, 0.2]", "thickness = 1e-3\nporosity = 0.1"),
        stack("[posterior]\n", &format!("thickness = 1e-3\n{SOLID}")),
        stack(
            "[parameters.bone_thickness]\nbounds = [1e-3, 3e-3]",
            "thickness = 1.5e-6\nporosity = 0.1",
        ),
        // The thickness of the bone is given, and nothing is left of which the parameters could be.
        format!("{layers}\n[[bone.sublayers]]\nthickness = 4e-3\n{SOLID}\n"),
    ];
    let edits: Vec<(&str, &str)> = edits.iter().map(|to| (layers.as_str(), to.as_str())).collect();
    check("rejected_job_sublayers", JobKind::Identification, &edits);
}
