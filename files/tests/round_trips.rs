//! What is written reads back to the same bits; what is read never panics; a specification is
//! judged alike whether it comes as a file or not.

#[path = "support/fluids.rs"]
mod fluids;
#[path = "round_trips/random_bones.rs"]
mod random_bones;
#[path = "round_trips/random_scatter.rs"]
mod random_scatter;
#[path = "round_trips/uncertain_offset.rs"]
mod uncertain_offset;

use std::collections::BTreeSet;
use std::path::Path;

use osteon_common::attenuation::Attenuation;
use osteon_common::bone::{Bone, CaseBone, Sublayer, Sublayers};
use osteon_common::bone_structure::BoneStructure;
use osteon_common::case::{Case, Setup};
use osteon_common::data::numbered;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    Data, Group, JobKind, JobSpecification, Measurements, MonteCarlo, Objective, Omitted,
    PosteriorPrior, PosteriorSettings, Prior, PriorDistribution, Range, Sampling, Search,
    SearchMethod,
};
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::layers::{Fluid, Layers};
use osteon_common::limits::SUBLAYERS_MAX;
use osteon_common::moments::Moments;
use osteon_common::parameters::{PARAMETERS, Parameter};
use osteon_common::probe::{Probe, Receivers, Source};
use osteon_common::settings::{Extremum, Method, Picking, SolverSettings};
use osteon_files::document::Format;
use osteon_files::file_error::ContentError;
use osteon_files::{case_file, job_file};
use osteon_fuzz::properties;
use proptest::prelude::*;

#[path = "support/random_setup_parts.rs"]
mod random_setup_parts;

use fluids::{fluid, positive};
use random_setup_parts::{attenuation, pulse_form, tone};

const FORMATS: [Format; 2] = [Format::Toml, Format::Json];
const KINDS: [JobKind; 2] = [JobKind::Identification, JobKind::Propagation];

fn solver() -> impl Strategy<Value = SolverSettings> {
    let exact = (0.5..1.5)
        .prop_map(|refinement| SolverSettings { refinement, ..SolverSettings::default() });
    let hybrid = (0.5..1.5, 1e-4..1e-3, 2_u32..=12, prop::option::of(1e-9..1e-7)).prop_map(
        |(refinement, element_size, element_order, time_step)| SolverSettings {
            method: Method::Hybrid,
            refinement,
            element_size,
            element_order,
            time_step,
        },
    );
    prop_oneof![exact, hybrid]
}

fn setup() -> impl Strategy<Value = Setup> {
    let layers = (fluid(), 0.5e-3..8e-3, fluid(), prop::array::uniform3(attenuation()));
    let heights = (0.5e-3..3.9e-3, 0.5e-3..3.9e-3);
    let receivers = (5e-3..20e-3, 0.2e-3..1e-3, 3_u32..=32, any::<bool>());
    let pulse = (0.5e6..1.5e6, positive(), pulse_form(), 0.0..0.99);
    let settings = (any::<bool>(), 1e-300..1.0, solver(), any::<bool>());
    (layers, -10e-3..10e-3, heights, receivers, pulse, settings).prop_map(
        |(layers, x1, (x3, receivers_x3), row, pulse, settings)| {
            let (mut coupling, bone_thickness, mut marrow, mut attenuations) = layers;
            let (distance, pitch, count, left) = row;
            let span = f64::from(count) * pitch;
            let first_x1 = if left { x1 - distance - span } else { x1 + distance };
            let (second, threshold, solver, bidirectional) = settings;
            let extremum = if second { Extremum::Second } else { Extremum::First };
            if solver.method == Method::Hybrid {
                attenuations = [Attenuation::default(); 3];
            }
            let bone_attenuation = attenuations[1];
            // Elements of a width are computed in one fluid alone.
            let element_width = if coupling.sublayers.is_empty() { pulse.3 * pitch } else { 0.0 };
            // A0 between fluids is that of single ones.
            let are_single = coupling.sublayers.is_empty() && marrow.sublayers.is_empty();
            (coupling.attenuation, marrow.attenuation) = (attenuations[0], attenuations[2]);
            Setup {
                layers: Layers { coupling, bone_thickness, bone_attenuation, marrow },
                probe: Probe {
                    center_frequency: pulse.0,
                    amplitude: pulse.1,
                    pulse: pulse.2,
                    guided_wave_frequency: bidirectional.then_some(0.2 * pulse.0),
                    a0_in_fluids: bidirectional && are_single,
                    element_width,
                    source: Source { x1, x3 },
                    receivers: Receivers { first_x1, pitch, count, x3: receivers_x3 },
                    // Heights change by a few micrometres.
                    tilt: if solver.method == Method::Exact { -0.02 * x1 } else { 0.0 },
                    bidirectional,
                },
                picking: Picking { extremum, threshold },
                solver,
                structure: BoneStructure::default(),
            }
        },
    )
}

fn case() -> impl Strategy<Value = Case> {
    let solid = || {
        (positive(), random_bones::elasticity())
            .prop_map(|(density, elasticity)| Bone { density, elasticity })
    };
    let sublayer = (1e-6..5e-3, solid());
    let sublayer = sublayer.prop_map(|(thickness, solid)| Sublayer { thickness, solid });
    // In half of the cases too many for a bone, which is then homogeneous.
    let sublayers = prop::collection::vec(sublayer, 0..=2 * SUBLAYERS_MAX);
    (setup(), solid(), sublayers).prop_map(|(mut setup, solid, sublayers)| {
        let Some(sublayers) = Sublayers::new(&sublayers) else {
            return Case { setup, bone: solid.into() };
        };
        setup.layers.bone_thickness = sublayers.thickness();
        Case { setup, bone: CaseBone::Layered(sublayers) }
    })
}

fn range(lower: f64, upper: f64) -> impl Strategy<Value = Range> {
    let width = upper - lower;
    (any::<bool>(), lower..upper, 0.01..1.0, 0.01..1.0).prop_map(move |(fixed, start, down, up)| {
        if fixed {
            Range::Fixed(start)
        } else {
            let free = (start - lower, upper - start + 0.01 * width);
            Range::Free { start, lower: start - down * free.0, upper: start + up * free.1 }
        }
    })
}

/// Data that points within the bounds can come near to.
fn data() -> impl Strategy<Value = Data> {
    let noise = (any::<bool>(), 2_usize..9, 0.0..0.9);
    let exact = prop_oneof![
        prop::collection::vec(2e3..6e3, 2..40).prop_map(Data::from_velocities),
        prop::collection::btree_map(
            "[ -~äβ骨\"\\\\]{1,20}",
            prop::collection::vec(2e3..6e3, 2..9),
            1..5
        )
        .prop_map(|groups| {
            let group = |(name, velocities): (String, _)| Group::new(name, velocities);
            Data::from_groups(groups.into_iter().map(group).collect())
        }),
        (2e3..6e3, 0.02..0.1).prop_map(|(mean, coefficient_of_variation)| Data::from_moments(
            mean,
            coefficient_of_variation
        )),
    ];
    (exact, noise).prop_map(|(data, noise)| with_noise(data, noise))
}

/// Adds what may be known of the noise, by chance.
fn with_noise(mut data: Data, (known, few, part): (bool, usize, f64)) -> Data {
    if !known {
        return data;
    }
    let numbers = |count: usize| Some(numbered((0..count).map(|k| (k * k) % few)));
    let smallest = (0..data.sets()).map(|set| {
        let Moments { mean, coefficient_of_variation } = data.moments(set);
        mean * coefficient_of_variation
    });
    data.repeatability = part * smallest.fold(f64::INFINITY, f64::min);
    match &mut data.measurements {
        Measurements::Velocities { velocities, subjects, .. } => {
            *subjects = numbers(velocities.len());
        }
        Measurements::Groups(groups) => {
            for group in groups.iter_mut().step_by(2) {
                group.subjects = numbers(group.velocities.len());
            }
        }
        Measurements::Moments { count, .. } => *count = Some(few as u64),
    }
    data
}

fn monte_carlo() -> impl Strategy<Value = MonteCarlo> {
    let scrambles = prop::option::of(1_u64..=1024);
    (1_u64..=9765, scrambles, 0_u64..1 << 63, any::<bool>(), 0.0..1.0).prop_map(
        |(points, scrambles, seed, control_variate, max_failed_fraction)| MonteCarlo {
            realizations: points * scrambles.unwrap_or(1),
            seed,
            sampling: scrambles.map_or(Sampling::MonteCarlo, |_| Sampling::Sobol),
            scrambles: scrambles.unwrap_or(1),
            control_variate,
            max_failed_fraction,
        },
    )
}

fn search() -> impl Strategy<Value = Search> {
    let method = prop::sample::select(SearchMethod::ALL.to_vec());
    let numbers = (positive(), 0.0..1.0, 1e-300..0.5);
    let starts = (1_u64..=100, 0_u64..=1000);
    (method, 1_u64..=1000, numbers, starts, any::<bool>()).prop_map(
        |(method, max_evaluations, numbers, (starts, first_start), sensitivities)| Search {
            method,
            max_evaluations,
            cost_tolerance: numbers.0,
            size_tolerance: numbers.1,
            initial_step: numbers.2,
            starts,
            first_start,
            sensitivities,
            priors: Search::default().priors,
        },
    )
}

/// Asked for in one of two jobs; the laws of the priors, and their spreads as a share of the start.
type AskedPosterior = Option<(u64, u64, [(PriorDistribution, f64); PARAMETERS])>;

fn posterior() -> impl Strategy<Value = AskedPosterior> {
    let law = prop::sample::select(PriorDistribution::ALL.to_vec());
    let laws = prop::array::uniform13((law, 0.01..1.0));
    prop::option::of((100_u64..=20_000, 20_u64..=2_000, laws))
}

/// Searches the bone's thickness if `also` says so, from a start that is not the setup's value.
fn search_thickness(parameters: &mut [Range; PARAMETERS], setup: &Setup, also: bool) {
    if also {
        let near = |factor: f64| factor * setup.layers.bone_thickness;
        parameters[Parameter::BoneThickness as usize] =
            Range::Free { start: near(1.0005), lower: near(0.999), upper: near(1.001) };
    }
}

/// Gives each group a thickness of its own, near that of the setup.
fn know_thickness(data: &mut Data, setup: &Setup) {
    if let Measurements::Groups(groups) = &mut data.measurements {
        for (place, group) in groups.iter_mut().enumerate() {
            let thickness = setup.layers.bone_thickness * (1.0 + 1e-4 * place as f64);
            group.known = KnownQuantities::new(
                Parameter::OF_SETUP
                    .map(|one| (one == Parameter::BoneThickness).then_some(thickness)),
            );
        }
    }
}

/// Returns the settings of a posterior whose priors are around the starts.
fn around_starts(
    asked: AskedPosterior,
    parameters: &[Range; PARAMETERS],
) -> Option<PosteriorSettings> {
    let (draws, max_evaluations, laws) = asked?;
    let prior = |i: usize| match (laws[i], parameters[i]) {
        ((law, share), Range::Free { start, .. }) => {
            PosteriorPrior::new(law, start, share * start.abs())
        }
        _ => PosteriorPrior::default(),
    };
    let priors = std::array::from_fn(prior);
    Some(PosteriorSettings { draws, max_evaluations, priors })
}

/// Almost always valid.
fn job() -> impl Strategy<Value = JobSpecification> {
    let parameters = (
        range(1500.0, 2000.0),
        range(12e9, 25e9),
        range(0.2, 0.45),
        range(3e9, 6.5e9),
        range(8e9, 12e9),
        range(0.2, 0.5),
        range(0.02, 0.3),
    );
    let objective = prop::sample::select(Objective::ALL.to_vec());
    let settings = (random_scatter::random(), monte_carlo(), search(), objective, posterior());
    let structure = prop_oneof![random_bones::structure(), random_bones::layered()];
    let setup = (setup(), prop::option::of(structure)).prop_map(|(setup, structure)| {
        random_bones::with_structure(setup, structure.unwrap_or_default())
    });
    (any::<bool>(), setup, data(), parameters, settings).prop_map(
        |(identification, mut setup, mut data, parameters, settings)| {
            let (random, monte_carlo, mut search, objective, posterior) = settings;
            let has_posterior = posterior.is_some() || search.method == SearchMethod::Posterior;
            if has_posterior && setup.structure.is_layered() {
                setup.structure = BoneStructure::default();
            }
            let random = random_scatter::scattered(random, &setup);
            let (rho, e_l, nu_l, g_l, e_t, nu_t, delta) = parameters;
            let mut parameters = Range::of_bone([rho, e_l, nu_l, g_l, e_t, nu_t, delta]);
            let also = rho.start().to_bits().is_multiple_of(2);
            search_thickness(&mut parameters, &setup, also);
            if !also {
                know_thickness(&mut data, &setup);
            }
            let by_simplex = search.method == SearchMethod::Simplex;
            for (prior, range) in search.priors.iter_mut().zip(parameters) {
                // Of some that are free.
                if let (true, Range::Free { start, lower, .. }) = (by_simplex, range)
                    && start.to_bits().is_multiple_of(3)
                {
                    *prior = Some(Prior { value: start, weight: 1.0 + lower.abs() / 7.0 });
                }
            }
            let has_law = !data.is_grouped()
                && !data.has_only_moments()
                && data.repeatability == 0.0
                && monte_carlo.realizations > 1;
            let searched = has_law && search.method == SearchMethod::Simplex;
            let objective = if searched { objective } else { Objective::Moments };
            let posterior = around_starts(posterior, &parameters).filter(|_| identification);
            let allowed = identification && search.sensitivities && !has_posterior;
            let systematic =
                uncertain_offset::uncertain_offset(allowed, monte_carlo.max_failed_fraction);
            let job = JobSpecification {
                kind: KINDS[usize::from(!identification)],
                setup,
                data: identification.then_some(data),
                parameters,
                random,
                systematic,
                groups: GroupSettings::default(),
                monte_carlo,
                objective,
                search,
                posterior,
            };
            job.with_implied(Omitted::default())
        },
    )
}

/// A number of a specification, replaced by another.
type Edit = fn(&mut JobSpecification, f64);

/// Sets the prior of the dispersion.
fn change_prior(job: &mut JobSpecification, prior: PosteriorPrior) {
    job.posterior.get_or_insert_default().priors[6] = prior;
}

const EDITS: [Edit; 23] = [
    |job, x| job.setup.layers.coupling = Fluid { thickness: x, ..Layers::default().coupling },
    |job, x| job.setup.layers.bone_thickness = x,
    |job, x| job.setup.layers.marrow = Fluid { sound_speed: x, ..Layers::default().marrow },
    |job, x| job.setup.probe.center_frequency = x,
    |job, x| job.setup.probe.pulse = tone(x),
    |job, x| job.setup.probe.element_width = x,
    |job, x| job.setup.probe.guided_wave_frequency = Some(x),
    |job, x| job.setup.probe.source.x1 = x,
    |job, x| job.setup.probe.source.x3 = x,
    |job, x| job.setup.probe.receivers.first_x1 = x,
    |job, x| job.setup.probe.receivers.pitch = x,
    |job, x| job.setup.picking.threshold = x,
    |job, x| job.setup.solver.refinement = x,
    |job, x| job.parameters[5] = Range::Fixed(x),
    |job, x| job.parameters[6] = Range::Free { start: x, lower: 0.1, upper: x },
    |job, x| job.random.bone_thickness.standard_deviation = Some(x),
    |job, x| job.random.probe_tilt.standard_deviation = Some(x),
    |job, x| job.search.initial_step = x,
    |job, x| job.data = Some(Data::from_velocities(vec![x, 1.0])),
    |job, x| job.monte_carlo.scrambles = x as u64,
    |job, _| job.monte_carlo.sampling = Sampling::MonteCarlo,
    |job, x| change_prior(job, PosteriorPrior::Normal { center: x, spread: 0.5 }),
    |job, x| change_prior(job, PosteriorPrior::LogNormal { center: 0.25, spread: x }),
];

/// Brackets of a text that the test itself may read as TOML.
const BRACKETS_MAX: usize = 200;

/// A file with some damage.
fn text_of_a_file() -> impl Strategy<Value = String> {
    let files = [
        include_str!("files/job.toml"),
        include_str!("files/case.toml"),
        include_str!("files/mandel.toml"),
    ];
    osteon_fuzz::damaged_text(files.map(str::to_owned).to_vec())
}

fn no_panic(text: &str) {
    for format in FORMATS {
        let _ = case_file::parse(text, format);
        for kind in KINDS {
            let _ = job_file::parse(text, format, Path::new("/nowhere"), kind);
        }
    }
}

fn as_json(toml: &str) -> Result<String, TestCaseError> {
    let table: toml::Table =
        toml::from_str(toml).map_err(|error| TestCaseError::fail(error.to_string()))?;
    serde_json::to_string(&table).map_err(|error| TestCaseError::fail(error.to_string()))
}

properties! {
    fn a_case_reads_back_to_the_bit(case in case()) {
        let text = case_file::to_toml(&case);
        let read = case_file::parse(&text, Format::Toml).unwrap();
        // The text tells all bits, a zero's sign among them.
        prop_assert_eq!(case_file::to_toml(&read), text.clone());
        prop_assert_eq!(&read, &case);
        prop_assert_eq!(case_file::parse(&as_json(&text)?, Format::Json).unwrap(), case);
    }

    fn a_job_reads_back_to_the_bit(job in job()) {
        prop_assume!(job.check().is_empty());
        let text = job_file::to_toml(&job);
        let read = job_file::parse(&text, Format::Toml, Path::new(""), job.kind).unwrap();
        prop_assert_eq!(job_file::to_toml(&read), text.clone());
        prop_assert_eq!(&read, &job);
        let json = as_json(&text)?;
        prop_assert_eq!(job_file::parse(&json, Format::Json, Path::new(""), job.kind).unwrap(), job);
    }

    fn a_file_is_judged_as_the_specification_it_stands_for(
        mut job in job(),
        edits in prop::collection::vec(
            (prop::sample::select(EDITS.to_vec()), prop_oneof![
                Just(0.0), Just(-0.0), Just(-1.0), Just(1.0), Just(1e-3), Just(1e300), Just(5e-324),
                Just(f64::INFINITY), Just(f64::NEG_INFINITY), proptest::num::f64::NORMAL,
            ]),
            0..4,
        ),
    ) {
        job.kind = JobKind::Identification;
        job.data.get_or_insert(Data::from_moments(1.0, 1.0));
        for (edit, value) in edits {
            edit(&mut job, value);
        }
        // A file has no other thickness for a bone of sublayers.
        let structure = job.setup.structure.clone();
        job.setup = random_bones::with_structure(job.setup, structure);
        let job = job.with_implied(Omitted::default());
        let expected: BTreeSet<_> = job.check().iter().map(ToString::to_string).collect();
        let text = job_file::to_toml(&job);
        let found = match job_file::parse(&text, Format::Toml, Path::new(""), job.kind) {
            Ok(_) => BTreeSet::new(),
            Err(ContentError::Invalid(invalid)) => {
                invalid.iter().map(|(_, violation)| violation.to_string()).collect()
            }
            Err(malformed) => panic!("{malformed}\n{text}"),
        };
        prop_assert_eq!(found, expected);
    }

    fn arbitrary_text_does_not_panic(text in "\\PC*|[\\[\\]{}=.,:\"' \n0-9a-e_-]*") {
        no_panic(&text);
    }

    fn damaged_files_do_not_panic(text in text_of_a_file()) {
        no_panic(&text);
        // As it stands, the TOML crate takes the whole stack on thousands of open brackets.
        let is_deep = text.matches(['[', '{']).count() > BRACKETS_MAX;
        if !is_deep && let Ok(table) = toml::from_str::<toml::Table>(&text) {
            no_panic(&serde_json::to_string(&table).unwrap());
        }
    }
}

#[test]
fn the_canonical_text_of_a_job() {
    let text = include_str!("files/job.toml");
    let job = job_file::parse(text, Format::Toml, Path::new(""), JobKind::Identification).unwrap();
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!("canonical_job", job_file::to_toml(&job));
    });
    let job = JobSpecification { kind: JobKind::Propagation, data: None, ..job };
    assert!(!job_file::to_toml(&job).contains("[data]"));
}

#[test]
fn the_canonical_text_of_a_case() {
    let case = case_file::parse(include_str!("files/mandel.toml"), Format::Toml).unwrap();
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!("canonical_case", case_file::to_toml(&case));
    });
}
