//! Random specifications, all of them valid.

use osteon_common::bone_structure::{
    BoneStructure, MeanSolid, MeanSublayer, PorosityProfile, ProfileShape, thickness,
};
use osteon_common::case::Setup;
use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    PosteriorPrior, PosteriorSettings, PriorDistribution, Sampling, SearchMethod,
};
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::limits::SUBLAYERS_MAX;
use osteon_common::moments::Moments;
use osteon_common::parameters::extended;
use osteon_common::porosity::{BoneMatrix, Homogenisation, PoreFluid, PorosityModel};
use osteon_common::pulse::PulseForm;
use osteon_common::pulse_samples::PulseSamples;
use osteon_common::random_quantities::{RandomDistribution, Scatter};
use osteon_common::settings::{Method, SolverSettings};
use osteon_common::systematic::{Systematic, SystematicLaw, SystematicQuantity};
use proptest::prelude::*;

use super::*;

fn parameters() -> impl Strategy<Value = [Range; PARAMETERS]> {
    proptest::array::uniform7((any::<bool>(), 0.0..1.0)).prop_map(|choices| {
        Range::of_bone(std::array::from_fn(|i| {
            let (start, lower, upper) = RANGES[i];
            let (fixed, shift) = choices[i];
            let value = start + 0.01 * shift * (upper - lower);
            // An identification needs at least one free parameter.
            if fixed && i < 6 {
                Range::Fixed(value)
            } else {
                Range::Free { start: value, lower, upper }
            }
        }))
    })
}

fn data() -> impl Strategy<Value = Data> {
    let noise = (any::<bool>(), 2_usize..9, 0.0..0.9);
    let exact = prop_oneof![
        // The fixed first value keeps the velocities from being all equal.
        proptest::collection::vec(2000.0..6000.0, 1..20).prop_map(|mut velocities| {
            velocities.insert(0, 1999.0);
            Data::from_velocities(velocities)
        }),
        (proptest::collection::vec("[a-zβ ]{1,9}", 1..5), any::<[bool; 6]>()).prop_map(
            |(names, known)| {
                let group = |(i, name): (usize, &String)| Group {
                    name: format!("{name}{i}"),
                    velocities: vec![1999.0, 2000.0 + i as f64],
                    subjects: None,
                    observables: osteon_common::observables::ObservedColumns::default(),
                    known: known_quantities(i, known),
                };
                Data::from_groups(names.iter().enumerate().map(group).collect())
            }
        ),
        (2000.0..6000.0, 0.002..0.4).prop_map(|(mean, coefficient_of_variation)| {
            Data::from_moments(mean, coefficient_of_variation)
        }),
    ];
    (exact, noise).prop_map(|(data, noise)| with_noise(data, noise))
}

/// Returns values for those quantities that are known, other ones for each group.
fn known_quantities(group: usize, known: [bool; 6]) -> KnownQuantities {
    let (usual, mut values) = ([0.1, 0.05, 0.15, 4e-3, 20.0, 1500.0], [None; 6]);
    for ((value, usual), known) in values.iter_mut().zip(usual).zip(known) {
        *value = known.then_some(usual * (1.0 + 0.01 * group as f64));
    }
    KnownQuantities::new(values)
}

/// Keeps only those known quantities that are not searched, and that the setup has.
fn knowing_what_is_not_searched(
    mut data: Data,
    parameters: &[Range; PARAMETERS],
    setup: &Setup,
) -> Data {
    if let Measurements::Groups(groups) = &mut data.measurements {
        for group in groups {
            let kept = |parameter: Parameter| {
                let is_fixed = matches!(parameters[parameter as usize], Range::Fixed(_));
                let has = parameter.of_setup().is_some_and(|one| one.value_in(setup).is_some());
                group.known.get(parameter).filter(|_| is_fixed && has)
            };
            group.known = KnownQuantities::new(Parameter::OF_SETUP.map(kept));
        }
    }
    data
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

/// Adds a number of velocities to moments without one, as a posterior needs it.
fn counted(mut data: Data) -> Data {
    if let Measurements::Moments { count, .. } = &mut data.measurements {
        count.get_or_insert(9);
    }
    data
}

/// Accepted in every setup.
fn random() -> impl Strategy<Value = RandomQuantities> {
    let distribution = proptest::sample::select(RandomDistribution::ALL.to_vec());
    let scatter = (proptest::option::of(0.001..0.1), distribution);
    let scatters = [scatter.clone(), scatter];
    scatters.prop_map(|[thickness, speed]| {
        let scatter = |(share, distribution): (Option<f64>, RandomDistribution), mean: f64| {
            let deviation =
                |share: f64| Scatter { standard_deviation: Some(share * mean), distribution };
            share.map_or_else(Scatter::default, deviation)
        };
        RandomQuantities {
            bone_thickness: scatter(thickness, 4e-3),
            coupling_sound_speed: scatter(speed, 1500.0),
            ..RandomQuantities::default()
        }
    })
}

fn structure() -> impl Strategy<Value = BoneStructure> {
    let shape = proptest::sample::select(ProfileShape::ALL.to_vec());
    let homogenisation = proptest::sample::select(Homogenisation::ALL.to_vec());
    let profile = (0.06..0.3, 0.06..0.3, shape, 2_u32..=16);
    (any::<bool>(), profile, homogenisation, 0.0..1e10).prop_map(
        |(is_profile, (surface, marrow, shape, sublayers), homogenisation, bulk_modulus)| {
            let fluid = PoreFluid { bulk_modulus, ..PoreFluid::default() };
            let model = PorosityModel { homogenisation, fluid };
            let default = PorosityProfile::default();
            let sublayers =
                if shape == ProfileShape::Linear { sublayers } else { default.sublayers };
            let is_table = shape == ProfileShape::Table;
            let values = if is_table { vec![surface, marrow, surface] } else { Vec::new() };
            let end = |value| Some(value).filter(|_| !is_table);
            let [surface, marrow] = [surface, marrow].map(end);
            match is_profile {
                true => BoneStructure {
                    porosity: None,
                    profile: PorosityProfile { surface, marrow, shape, sublayers, values },
                    model,
                    sublayers: Vec::new(),
                },
                false => BoneStructure { porosity: Some(0.1), model, ..BoneStructure::default() },
            }
        },
    )
}

/// A bone of sublayers, of which the first has a porosity.
fn sublayers() -> impl Strategy<Value = BoneStructure> {
    let thickness = || 1e-4..1e-3;
    let porous = || (0.06..0.3).prop_map(MeanSolid::Porous);
    let given = (1500.0..2000.0).prop_map(|density| {
        let bone = BoneMatrix { density, ..BoneMatrix::default() }.bone();
        MeanSolid::Given(Box::new(bone.unwrap()))
    });
    let solid = prop_oneof![porous(), given];
    let lower = proptest::collection::vec((thickness(), solid), 0..SUBLAYERS_MAX);
    // Random thicknesses are drawn for a bone of 4 mm at least.
    ((4e-3..5e-3, porous()), lower).prop_map(|(first, lower)| {
        let sublayer = |(thickness, solid)| MeanSublayer { thickness, solid };
        let sublayers = [first].into_iter().chain(lower).map(sublayer).collect();
        BoneStructure { sublayers, ..BoneStructure::default() }
    })
}

fn setup() -> impl Strategy<Value = Setup> {
    let structure = proptest::option::of(prop_oneof![structure(), sublayers()]);
    (layered(), structure).prop_map(|(mut setup, structure)| {
        setup.structure = structure.unwrap_or_default();
        if setup.structure.is_layered() {
            setup.layers.bone_thickness = thickness(&setup.structure.sublayers);
        }
        setup
    })
}

/// A peak and a trough of about 1 MHz.
fn samples() -> PulseForm {
    let value = |t: f64| (6.3 * t).sin() * (-4.0 * (t - 1.0) * (t - 1.0)).exp();
    let values: Vec<f64> = (1..40).map(|j| value(0.05 * f64::from(j))).collect();
    PulseForm::Samples(PulseSamples::new(5e-8, &values).unwrap())
}

fn layered() -> impl Strategy<Value = Setup> {
    let exact = (0.5..1.5, proptest::option::of(2.0..99.0)).prop_map(|(refinement, quality)| {
        let mut setup = Setup::default();
        setup.solver.refinement = refinement;
        setup.layers.bone_attenuation.quality_factor = quality;
        (setup.probe.tilt, setup.probe.bidirectional) = (-0.02 * refinement, quality.is_some());
        setup.probe.element_width = 1e-4 * refinement;
        setup.probe.guided_wave_frequency = quality.map(|quality| 1e4 * quality);
        setup.probe.a0_in_fluids = quality.is_some();
        setup.probe.pulse = match quality {
            Some(_) => PulseForm::Tone { cycles: 4.0 * refinement },
            None if refinement < 1.0 => PulseForm::Ricker,
            None => samples(),
        };
        setup
    });
    let hybrid = (1e-4..1e-3, 2_u32..=12, proptest::option::of(1e-9..1e-7)).prop_map(
        |(element_size, element_order, time_step)| SolverSettings {
            method: Method::Hybrid,
            refinement: 1.0,
            element_size,
            element_order,
            time_step,
        },
    );
    let hybrid = hybrid.prop_map(|solver| {
        let mut setup = Setup { solver, ..Setup::default() };
        let sublayer = |i: u32| FluidSublayer {
            thickness: 2e-3,
            density: 950.0 + f64::from(i),
            sound_speed: 1450.0,
        };
        // One to four.
        let sublayers: Vec<_> = (0..=solver.element_order % 4).map(sublayer).collect();
        setup.layers.marrow.sublayers = FluidSublayers::new(&sublayers).unwrap_or_default();
        setup
    });
    prop_oneof![exact, hybrid]
}

prop_compose! {
    /// With the centers of priors at the starts of the paper's search box.
    fn posterior()(
        draws in 100_u64..=20_000,
        max_evaluations in 20_u64..=2_000,
        laws in proptest::array::uniform7(
            (proptest::sample::select(PriorDistribution::ALL.to_vec()), 0.01..1.0)),
    ) -> PosteriorSettings {
        let prior = |i: usize| PosteriorPrior::new(laws[i].0, RANGES[i].0, laws[i].1 * RANGES[i].0);
        PosteriorSettings { draws, max_evaluations, priors: extended(std::array::from_fn(prior), PosteriorPrior::Uniform) }
    }
}

/// Searches quantities of the setup, within one part in a thousand of their values there.
fn searched(
    mut parameters: [Range; PARAMETERS],
    setup: &Setup,
    chosen: [bool; 6],
) -> [Range; PARAMETERS] {
    for (parameter, _) in Parameter::ALL.into_iter().skip(7).zip(chosen).filter(|one| one.1) {
        if let Some(value) = parameter.of_setup().and_then(|quantity| quantity.value_in(setup)) {
            let (lower, upper) = (0.999 * value, 1.001 * value);
            parameters[parameter as usize] = Range::Free { start: 1.0005 * value, lower, upper };
        }
    }
    parameters
}

prop_compose! {
    pub(super) fn specification()(
        data in proptest::option::of(data()),
        (parameters, chosen) in (parameters(), any::<[bool; 6]>()),
        points in 2_u64..=9765,
        scrambles in proptest::option::of(1_u64..=1024),
        control_variate: bool,
        seed in 0..1_u64 << 63,
        max_failed_fraction in 0.0..1.0,
        method in proptest::sample::select(SearchMethod::ALL.to_vec()),
        max_evaluations in 1_u64..1000,
        initial_step in 0.01..0.5,
        starts in 1_u64..100,
        first_start in 0_u64..=1000,
        sensitivities: bool,
        weights in proptest::collection::vec(proptest::option::of(1e-9..1.0), PARAMETERS),
        setup in setup(),
        random in random(),
        posterior in proptest::option::of(posterior()),
    ) -> JobSpecification {
        let needs_noise = posterior.is_some() || method == SearchMethod::Posterior;
        let mut setup = setup;
        if needs_noise && setup.structure.is_layered() {
            setup.structure = BoneStructure::default();
        }
        let parameters = searched(parameters, &setup, chosen);
        let data = data.map(|data| if needs_noise { counted(data) } else { data });
        let data = data.map(|data| knowing_what_is_not_searched(data, &parameters, &setup));
        let posterior = posterior.filter(|_| data.is_some()).map(|mut posterior| {
            for (prior, range) in posterior.priors.iter_mut().zip(&parameters) {
                if matches!(range, Range::Fixed(_)) {
                    *prior = PosteriorPrior::Uniform;
                }
            }
            posterior
        });
        let mut priors = [None; PARAMETERS];
        for ((prior, weight), range) in priors.iter_mut().zip(weights).zip(&parameters) {
            let drawn = matches!(range, Range::Free { .. }) && method == SearchMethod::Simplex;
            *prior = weight.filter(|_| drawn).map(|weight| Prior { value: range.start(), weight });
        }
        let allowed = data.is_some() && sensitivities && !needs_noise;
        let specification = JobSpecification {
            kind: if data.is_some() { JobKind::Identification } else { JobKind::Propagation },
            setup,
            data,
            parameters,
            random,
            systematic: uncertain_offset(allowed, max_failed_fraction),
            groups: GroupSettings::default(),
            monte_carlo: MonteCarlo {
                realizations: points * scrambles.unwrap_or(1),
                seed,
                sampling: scrambles.map_or(Sampling::MonteCarlo, |_| Sampling::Sobol),
                scrambles: scrambles.unwrap_or(1),
                control_variate,
                max_failed_fraction,
            },
            objective: Objective::default(),
            search: Search {
                max_evaluations,
                initial_step,
                starts,
                first_start,
                sensitivities,
                priors,
                ..Search::by(method)
            },
            posterior,
        };
        specification.with_implied(Omitted::default())
    }
}

/// Returns an uncertain offset of the velocities, where the job allows any.
fn uncertain_offset(allowed: bool, spread: f64) -> Systematic {
    let mut systematic = Systematic::default();
    if allowed {
        let distribution = RandomDistribution::Uniform;
        systematic.laws[SystematicQuantity::VelocityOffset as usize] =
            SystematicLaw { spread: Some(spread), distribution, center: Some(0.0) };
    }
    systematic
}
