//! Files that are accepted: what they mean, and what is filled in.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a helper of tests fails the test")]

#[path = "support/hybrid_job.rs"]
mod hybrid_job;
#[path = "support/no_pores.rs"]
mod no_pores;

use std::path::{Path, PathBuf};

use osteon_common::attenuation::Attenuation;
use osteon_common::bone::{Bone, CaseBone};
use osteon_common::case::{Case, Setup};
use osteon_common::elasticity::EngineeringConstants;
use osteon_common::fluid_sublayers::FluidSublayers;
use osteon_common::job::{
    Data, JobKind, JobSpecification, MonteCarlo, Objective, PosteriorPrior, PosteriorSettings,
    Range, Search,
};
use osteon_common::job::{Sampling, SearchMethod};
use osteon_common::layers::{Fluid, Layers};
use osteon_common::parameters::Parameter;
use osteon_common::probe::{Probe, Receivers, Source};
use osteon_common::pulse::PulseForm;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::settings::{Extremum, Method, Picking, SolverSettings};
use osteon_common::systematic::Systematic;
use osteon_files::document::Format;
use osteon_files::{case_file, job_file, materials};

/// All seven parameters and the data's moments: what has no default.
const MINIMAL: &str = "
[data]
mean = 3906.0
coefficient_of_variation = 0.027
[parameters]
density = { fixed = 1598.8 }
longitudinal_young_modulus = { start = 15e9, bounds = [12e9, 25e9] }
longitudinal_poisson_ratio = { fixed = 0.3816 }
longitudinal_shear_modulus = { fixed = 4.795e9 }
transverse_young_modulus = { fixed = 9.8254e9 }
transverse_poisson_ratio = { fixed = 0.4495 }
dispersion = { start = 0.1, bounds = [0.02, 0.3] }
";

fn job(text: &str, format: Format, kind: JobKind) -> JobSpecification {
    job_file::parse(text, format, Path::new(""), kind).unwrap_or_else(|error| panic!("{error}"))
}

fn case(text: &str, format: Format) -> Case {
    case_file::parse(text, format).unwrap_or_else(|error| panic!("{error}"))
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/cases").join(name)
}

const SUBLAYERS: &str = include_str!("files/sublayers.toml");

const LOSSLESS: Attenuation = Attenuation { quality_factor: None, reference_frequency: 1e6 };

const WATER: Fluid = Fluid {
    sublayers: FluidSublayers::NONE,
    thickness: 10e-3,
    density: 1000.0,
    sound_speed: 1500.0,
    attenuation: LOSSLESS,
};

/// The setup that documentation promises where a file is silent.
const DEFAULT_SETUP: Setup = Setup {
    layers: Layers {
        coupling: WATER,
        bone_thickness: 4e-3,
        bone_attenuation: LOSSLESS,
        marrow: WATER,
    },
    probe: Probe {
        center_frequency: 1e6,
        amplitude: 100.0,
        pulse: PulseForm::Paper,
        guided_wave_frequency: None,
        a0_in_fluids: false,
        element_width: 0.0,
        source: Source { x1: 0.0, x3: 2e-3 },
        receivers: Receivers { first_x1: 11e-3, pitch: 0.8e-3, count: 14, x3: 2e-3 },
        tilt: 0.0,
        bidirectional: false,
    },
    picking: Picking { extremum: Extremum::First, threshold: 0.05 },
    solver: SolverSettings {
        method: Method::Exact,
        refinement: 1.0,
        element_size: 0.5e-3,
        element_order: 8,
        time_step: None,
    },
    structure: no_pores::NO_PORES,
};

#[test]
fn a_minimal_job_has_the_documented_defaults() {
    let given = job(MINIMAL, Format::Toml, JobKind::Identification);
    let expected = JobSpecification {
        kind: JobKind::Identification,
        setup: DEFAULT_SETUP,
        data: Some(Data::from_moments(3906.0, 0.027)),
        parameters: Range::of_bone([
            Range::Fixed(1598.8),
            Range::Free { start: 15e9, lower: 12e9, upper: 25e9 },
            Range::Fixed(0.3816),
            Range::Fixed(4.795e9),
            Range::Fixed(9.8254e9),
            Range::Fixed(0.4495),
            Range::Free { start: 0.1, lower: 0.02, upper: 0.3 },
        ]),
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: Default::default(),
        monte_carlo: MonteCarlo {
            realizations: 2747,
            seed: 1,
            sampling: Sampling::MonteCarlo,
            scrambles: 1,
            control_variate: false,
            max_failed_fraction: 0.01,
        },
        objective: Objective::Moments,
        search: Search {
            method: SearchMethod::Simplex,
            max_evaluations: 400,
            cost_tolerance: 1e-10,
            size_tolerance: 1e-5,
            initial_step: 0.15,
            starts: 1,
            first_start: 0,
            sensitivities: true,
            priors: Search::default().priors,
        },
        posterior: None,
    };
    assert_eq!(given, expected);
    assert!(given.check().is_empty());
}

#[test]
fn the_default_tolerance_is_that_of_the_method() {
    let check = |text: &str, expected: Search| {
        let given = job(&format!("{MINIMAL}\n{text}"), Format::Toml, JobKind::Identification);
        assert_eq!(given.search, expected);
        assert!(job_file::to_toml(&given).contains(&format!(
            "method = \"{}\"\nmax_evaluations = 400\ncost_tolerance = {:?}\n",
            expected.method.name(),
            expected.cost_tolerance
        )));
    };
    let newton = Search { cost_tolerance: 1e-12, ..Search::by(SearchMethod::Newton) };
    check("[search]\nmethod = \"newton\"\n", newton);
    let loose = Search { cost_tolerance: 1e-6, ..newton };
    check("[search]\nmethod = \"newton\"\ncost_tolerance = 1e-6\n", loose);
    check("[search]\nmethod = \"simplex\"\n", Search::default());
}

#[test]
fn the_default_objective_is_that_of_the_data() {
    let check = |given: &JobSpecification, objective: Objective, cost_tolerance: f64| {
        assert_eq!((given.objective, given.search.cost_tolerance), (objective, cost_tolerance));
        let text = job_file::to_toml(given);
        assert!(
            text.contains(&format!("[objective]\nkind = \"{}\"\n", objective.name())),
            "{text}"
        );
        assert_eq!(job(&text, Format::Toml, given.kind), *given);
    };
    let identification = |text: &str| job(text, Format::Toml, JobKind::Identification);
    check(&identification(MINIMAL), Objective::Moments, 1e-10);
    let moments = "mean = 3906.0\ncoefficient_of_variation = 0.027\n";
    assert!(MINIMAL.contains(moments), "{MINIMAL}");
    let of = |data: &str| MINIMAL.replace(moments, data);
    check(&counted(""), Objective::ChiSquare, 1e-4);
    check(&counted("[search]\nmethod = \"newton\"\n"), Objective::ChiSquare, 1e-4);
    check(&counted("[search]\ncost_tolerance = 1e-10\n"), Objective::ChiSquare, 1e-10);
    check(&counted("[objective]\nkind = \"moments\"\n"), Objective::Moments, 1e-10);
    check(&counted("[search]\nmethod = \"posterior\"\n"), Objective::Moments, 1e-10);
    let two = "velocities = [3900.0, 4000.0]\n";
    check(&identification(&of(two)), Objective::ChiSquare, 1e-4);
}

/// A minimal job whose data have a noise, as a posterior needs.
fn counted(text: &str) -> JobSpecification {
    let minimal = MINIMAL.replace("mean = 3906.0", "mean = 3906.0\ncount = 2747");
    job(&format!("{minimal}\n{text}"), Format::Toml, JobKind::Identification)
}

#[test]
fn a_posterior_is_asked_for_by_its_section_or_by_the_method() {
    let given = |text: &str| counted(text).posterior;
    let default = PosteriorSettings::default();
    assert_eq!((default.draws, default.max_evaluations), (2000, 400));
    assert_eq!(given(""), None);
    assert_eq!(given("[posterior]\n"), Some(default));
    assert_eq!(given("[search]\nmethod = \"posterior\"\n"), Some(default));
    let mut priors = default.priors;
    priors[1] = PosteriorPrior::LogNormal { center: 17e9, spread: 0.125 };
    priors[6] = PosteriorPrior::Normal { center: 0.1, spread: 0.05 };
    let text = "[posterior]\ndraws = 500\nmax_evaluations = 100\n\n\
        [posterior.priors.longitudinal_young_modulus]\ndistribution = \"log_normal\"\n\
        center = 17000000000.0\nspread = 0.125\n\n\
        [posterior.priors.dispersion]\ndistribution = \"normal\"\ncenter = 0.1\nspread = 0.05\n";
    let expected = PosteriorSettings { draws: 500, max_evaluations: 100, priors };
    let read = counted(text);
    assert_eq!(read.posterior, Some(expected));
    let written = job_file::to_toml(&read);
    assert!(written.ends_with(&format!("\n\n{text}")), "{written}");
    // A uniform prior is the default, and is not written.
    let uniform = "[posterior.priors]\ndispersion = { distribution = \"uniform\" }\n";
    assert_eq!(given(uniform), Some(default));
}

#[test]
fn the_evaluations_of_the_posterior_are_counted() {
    let count = |text: &str| counted(text).evaluations_max();
    let searched = count("");
    assert_eq!(count("[posterior]\nmax_evaluations = 100\n"), searched + 100);
    assert_eq!(count("[search]\nmethod = \"posterior\"\n"), 400);
}

#[test]
fn a_complete_job_means_what_it_says() {
    let given = job(include_str!("files/job.toml"), Format::Toml, JobKind::Identification);
    assert_eq!(
        given.setup,
        Setup {
            layers: Layers {
                coupling: Fluid {
                    sublayers: FluidSublayers::NONE,
                    thickness: 11e-3,
                    density: 1010.0,
                    sound_speed: 1510.0,
                    attenuation: Attenuation {
                        quality_factor: Some(400.0),
                        reference_frequency: 1e6,
                    },
                },
                bone_thickness: 3e-3,
                bone_attenuation: Attenuation {
                    quality_factor: Some(15.0),
                    reference_frequency: 0.8e6,
                },
                marrow: Fluid {
                    sublayers: FluidSublayers::NONE,
                    thickness: 12e-3,
                    density: 950.0,
                    sound_speed: 1450.0,
                    attenuation: LOSSLESS,
                },
            },
            probe: Probe {
                center_frequency: 0.9e6,
                amplitude: 99.0,
                pulse: PulseForm::Tone { cycles: 4.5 },
                guided_wave_frequency: Some(0.2e6),
                a0_in_fluids: false,
                element_width: 0.5e-3,
                source: Source { x1: 1e-3, x3: 3e-3 },
                receivers: Receivers { first_x1: 13e-3, pitch: 0.9e-3, count: 12, x3: 2.5e-3 },
                tilt: 0.001,
                bidirectional: true,
            },
            picking: Picking { extremum: Extremum::Second, threshold: 0.06 },
            solver: SolverSettings { refinement: 1.5, ..SolverSettings::default() },
            structure: DEFAULT_SETUP.structure,
        }
    );
    // An integer stands for a number.
    assert_eq!(given.data, Some(Data::from_velocities(vec![3900.5, 4000.0, 3950.25])));
    assert_eq!(given.range(Parameter::LongitudinalShearModulus), Range::Fixed(4.795e9));
    assert_eq!(
        given.range(Parameter::TransversePoissonRatio),
        Range::Free { start: 0.4, lower: 0.2, upper: 0.5 }
    );
    let monte_carlo = &given.monte_carlo;
    assert_eq!((monte_carlo.realizations, monte_carlo.seed), (500, 7));
    assert_eq!((monte_carlo.sampling, monte_carlo.scrambles), (Sampling::Sobol, 4));
    assert!(given.monte_carlo.control_variate);
    assert_eq!(given.monte_carlo.max_failed_fraction, 0.02);
    let search = &given.search;
    assert_eq!((search.max_evaluations, search.cost_tolerance), (300, 1e-9));
    assert_eq!((search.size_tolerance, search.initial_step), (1e-4, 0.1));
    assert!(!given.search.sensitivities);
}

#[test]
fn a_propagation_needs_no_data_and_keeps_none() {
    for text in [MINIMAL.to_owned(), MINIMAL.split_once("[parameters]").unwrap().1.to_owned()] {
        let text = if text.contains("[data]") { text } else { format!("[parameters]{text}") };
        let given = job(&text, Format::Toml, JobKind::Propagation);
        assert_eq!((given.kind, &given.data), (JobKind::Propagation, &None));
        assert!(given.check().is_empty());
    }
}

#[test]
fn values_at_the_edges_are_accepted() {
    for (from, to) in [
        ("count = 12", "count = 3"),
        ("count = 12", "count = 64"),
        ("realizations = 500", "realizations = 4"),
        ("scrambles = 4", "scrambles = 1"),
        ("scrambles = 4", "scrambles = 500"),
        (
            "realizations = 500\nseed = 7\nsampling = \"sobol\"\nscrambles = 4",
            "realizations = 1024\nsampling = \"sobol\"\nscrambles = 1024",
        ),
        (
            "realizations = 500\nseed = 7\nsampling = \"sobol\"\nscrambles = 4",
            "realizations = 1\nscrambles = 1",
        ),
        ("realizations = 500", "realizations = 10000000"),
        ("realizations = 500", "realizations = 10_000"),
        ("seed = 7", "seed = 0"),
        ("seed = 7", "seed = 9223372036854775807"),
        ("refinement = 1.5", "refinement = 0.5"),
        ("refinement = 1.5", "refinement = 16"),
        ("\"exact\"", "\"hybrid\""),
        ("\"exact\"", "\"hybrid\"\nelement_size = 1e-6\nelement_order = 2\ntime_step = 1e-300"),
        ("\"exact\"", "\"hybrid\"\nelement_size = 1e-2\nelement_order = 12"),
        ("max_failed_fraction = 0.02", "max_failed_fraction = 0"),
        ("max_failed_fraction = 0.02", "max_failed_fraction = 1"),
        ("start = 1700.0", "start = 1500"),
        ("start = 1700.0", "start = 2000"),
        ("cost_tolerance = 1e-9", "cost_tolerance = 0"),
        ("initial_step = 0.1", "initial_step = 0.5"),
        ("bounds = [0.02, 0.3]", "bounds = [1e-3, 0.7977]"),
        // Receivers on the other side of the source.
        ("first_x1 = 13e-3", "first_x1 = -21e-3"),
    ] {
        let text = include_str!("files/job.toml");
        assert_eq!(text.matches(from).count(), 1, "{from} must occur once");
        let mut text = text.replace(from, to);
        if to.contains("hybrid") {
            text = hybrid_job::without_exact_only(&text);
        }
        job(&text, Format::Toml, JobKind::Identification);
    }
}

#[test]
fn toml_and_json_say_the_same() {
    for text in [MINIMAL, include_str!("files/job.toml")] {
        assert_eq!(
            job(text, Format::Toml, JobKind::Identification),
            job(&as_json(text), Format::Json, JobKind::Identification)
        );
    }
    let cases = [
        include_str!("files/case.toml"),
        include_str!("files/mandel.toml"),
        include_str!("files/porosity.toml"),
        SUBLAYERS,
    ];
    for text in cases {
        assert_eq!(case(text, Format::Toml), case(&as_json(text), Format::Json));
    }
}

#[test]
fn sublayers_are_read_downwards_and_add_up_to_the_thickness() {
    let case = case(SUBLAYERS, Format::Toml);
    let layers = Layers {
        bone_thickness: 1.5e-3 + 2e-3 + 0.5e-3,
        bone_attenuation: Attenuation { quality_factor: Some(20.0), ..LOSSLESS },
        ..DEFAULT_SETUP.layers
    };
    assert_eq!(case.setup, Setup { layers, ..DEFAULT_SETUP });
    let sublayers = case.bone.sublayers().unwrap();
    let thicknesses: Vec<f64> = sublayers.iter().map(|sublayer| sublayer.thickness).collect();
    assert_eq!(thicknesses, [1.5e-3, 2e-3, 0.5e-3]);
    let densities: Vec<f64> = sublayers.iter().map(|sublayer| sublayer.solid.density).collect();
    let femur = materials::named("human-femur-ashman-1984").unwrap();
    assert_eq!(densities, [1900.0, femur.density, 1700.0]);
    assert_eq!(sublayers.lower()[1].solid.elasticity.rows()[5][5], 10.4e9);
    assert_eq!(sublayers.lower()[0].solid.elasticity, femur.constants().elasticity().unwrap());
    assert_eq!(case_file::parse(&case_file::to_toml(&case), Format::Toml).unwrap(), case);
}

#[test]
fn a_byte_order_mark_is_no_mistake() {
    let text = format!("\u{feff}{}", include_str!("files/case.toml"));
    assert_eq!(case(&text, Format::Toml), case(&text[3..], Format::Toml));
}

#[test]
fn the_example_cases_are_what_they_say() {
    let optimum = EngineeringConstants {
        longitudinal_young_modulus: 17.717e9,
        longitudinal_poisson_ratio: 0.3816,
        longitudinal_shear_modulus: 4.795e9,
        transverse_young_modulus: 9.8254e9,
        transverse_poisson_ratio: 0.4495,
    };
    let a = case_file::read(&example("A.toml")).unwrap();
    assert_eq!(a.setup, DEFAULT_SETUP);
    let elasticity = optimum.elasticity().unwrap();
    assert_eq!(a.bone, CaseBone::Homogeneous(Bone { density: 1598.8, elasticity }));
    for (name, thickness) in [("D", 4e-3), ("G", 3e-3)] {
        let read = case_file::read(&example(&format!("{name}.toml"))).unwrap();
        let mut setup = DEFAULT_SETUP;
        setup.layers.bone_thickness = thickness;
        assert_eq!(read.setup, setup);
        let CaseBone::Homogeneous(bone) = read.bone else { panic!("{name} has sublayers") };
        let reference = reference(name);
        assert_eq!(reference["thickness"].as_f64().unwrap(), thickness);
        assert_eq!(reference["density"].as_f64().unwrap(), bone.density);
        for (i, row) in bone.elasticity.rows().iter().enumerate() {
            for (j, &entry) in row.iter().enumerate() {
                // The reference's mirrored entries may differ in their last bits.
                let expected = reference["mandel"][i][j].as_f64().unwrap();
                assert!((entry - expected).abs() <= 1e-15 * expected.abs(), "{name} {i} {j}");
            }
        }
    }
}

fn reference(name: &str) -> serde_json::Value {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../solver/tests/reference");
    let text = std::fs::read_to_string(directory.join(format!("{name}.json"))).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The same keys and nesting in JSON.
fn as_json(text: &str) -> String {
    let table: toml::Table = toml::from_str(text).unwrap();
    serde_json::to_string(&table).unwrap()
}

/// The decays of all groups are inlined, and χ² is the default.
#[test]
fn decays_are_inlined() {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    let list = |start: u32, step: u32| -> Vec<u32> {
        (0..10).map(|k| start + step * k * k % 101).collect()
    };
    let group = |name: &str, start: u32| {
        let (velocities, decays) = (list(start, 7), list(4, 13));
        format!("groups.{name} = {{ velocities = {velocities:?}, decays = {decays:?} }}\n")
    };
    let keys = "decay_spreading = \"line\"\ndecay_error = 0.25\n";
    let data = keys.to_owned() + &group("b", 3900) + &group("a", 3950);
    let text = include_str!("files/job.toml").replace(given, &data);
    let text = text.replace("kind = \"moments\"", "kind = \"chi_square\"");
    let read = job(&text, Format::Toml, JobKind::Identification);
    let written = job_file::to_toml(&read);
    let expected = "# dB/cm\ndecays = [\n    4.0, 17.0, 56.0, 20.0, 10.0, 26.0,\n    68.0, 35.0, 28.0, 47.0,\n]\n";
    assert!(written.contains(expected), "{written}");
    assert_eq!(job(&written, Format::Toml, JobKind::Identification), read);
}

/// Subjects are numbered anew, and the canonical text is read as it is written.
#[test]
fn what_is_known_of_the_data_is_inlined() {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    let grouped = "groups.b = { velocities = [3900, 4000, 3950], subjects = [9, 3, 9] }\n\
                   groups.a = [3900.0, 4000.0]\nrepeatability = 2";
    let moments = "mean = 3906.0\ncoefficient_of_variation = 0.027\ncount = 2747";
    for (data, expected) in [
        (
            format!("{given}\nsubjects = [7, 2, 7]\nrepeatability = 5"),
            "[data]  # m/s\nvelocities = [\n    3900.5, 4000.0, 3950.25,\n]\n\
             subjects = [\n    0, 1, 0,\n]\nrepeatability = 5.0\n",
        ),
        (
            grouped.to_owned(),
            "[data]  # m/s\nrepeatability = 2.0\n\n\
             [data.groups.\"b\"]  # m/s\nvelocities = [\n    3900.0, 4000.0, 3950.0,\n]\n\
             subjects = [\n    0, 1, 0,\n]\n\n\
             [data.groups.\"a\"]  # m/s\nvelocities = [\n    3900.0, 4000.0,\n]\n",
        ),
        (
            "groups.b = { velocities = [3900, 4000], coupling_sound_speed = 1480, bone_thickness = 3e-3 }\n\
             groups.a = { velocities = [3900], bone_thickness = 4e-3, coupling_sound_speed = 1500.5 }"
                .to_owned(),
            "[data.groups.\"b\"]  # m/s\nbone_thickness = 0.003  # m\ncoupling_sound_speed = 1480.0  # m/s\n\
             velocities = [\n    3900.0, 4000.0,\n]\n\n\
             [data.groups.\"a\"]  # m/s\nbone_thickness = 0.004  # m\ncoupling_sound_speed = 1500.5  # m/s\n\
             velocities = [\n    3900.0,\n]\n",
        ),
        (
            moments.to_owned(),
            "[data]  # m/s\nmean = 3906.0\ncoefficient_of_variation = 0.027\ncount = 2747\n",
        ),
    ] {
        let text = include_str!("files/job.toml").replace(given, &data);
        let read = job(&text, Format::Toml, JobKind::Identification);
        let written = job_file::to_toml(&read);
        assert!(written.contains(expected), "{written}");
        assert_eq!(job(&written, Format::Toml, JobKind::Identification), read);
    }
}
