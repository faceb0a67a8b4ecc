//! Designs of small jobs, against identifications and closed forms.

use std::convert::Infallible;

use osteon_common::data::Data;
use osteon_common::group_settings::GroupSettings;
use osteon_common::inference::Uncertainty;
use osteon_common::job::{
    JobKind, JobSpecification, MonteCarlo, Objective, Range, Sampling, Search, SearchMethod,
};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::random_quantities::{RandomDistribution, RandomQuantities};
use osteon_common::realization::Ensemble;
use osteon_common::systematic::{Systematic, SystematicLaw, SystematicQuantity};
use osteon_solver::{Isa, Solver, Workspace};

use super::*;

const OPTIMUM: Point =
    Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

/// Returns a job in which the longitudinal Young modulus and the dispersion are free, and other parameters between
/// these bounds.
fn job(free: &[(Parameter, [f64; 2])]) -> JobSpecification {
    let mut parameters = OPTIMUM.0.map(Range::Fixed);
    let always =
        [(Parameter::LongitudinalYoungModulus, [12e9, 25e9]), (Parameter::Dispersion, [0.02, 0.3])];
    for (parameter, [lower, upper]) in always.iter().chain(free).copied() {
        let start = OPTIMUM.get(parameter);
        parameters[parameter as usize] = Range::Free { start, lower, upper };
    }
    JobSpecification {
        kind: JobKind::Propagation,
        setup: osteon_common::case::Setup::default(),
        data: None,
        parameters,
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo {
            realizations: 128,
            sampling: Sampling::Sobol,
            control_variate: true,
            ..MonteCarlo::default()
        },
        objective: Objective::default(),
        search: Search::by(SearchMethod::Newton),
        posterior: None,
    }
}

fn design_of(
    specification: &JobSpecification,
    velocities: Option<u64>,
    plans: &[&str],
) -> Result<Design, DesignError> {
    let request = DesignRequest {
        specification,
        set: 0,
        point: specification.start(),
        velocities,
        plans: Some(plans.iter().map(|plan| plan.parse().unwrap()).collect()),
        isa: Isa::fastest(),
        threads: 2,
    };
    Design::compute(&request, &|_| {})
}

fn quantity(design: &Design, target: DesignTarget) -> &DesignedQuantity {
    design.quantities.iter().find(|one| one.target == target).unwrap()
}

fn predicted(quantity: &DesignedQuantity, plan: &str) -> PredictedDeviation {
    quantity.ranking.iter().find(|one| one.plan.key() == plan).unwrap().clone()
}

fn check(found: f64, expected: f64, tolerance: f64) {
    assert!((found / expected - 1.0).abs() < tolerance, "{found} instead of {expected}");
}

/// The standard errors of an identification from fifty velocities are those of its design.
#[test]
fn an_identification_has_the_errors_of_its_design() {
    let mut job = job(&[]);
    let ensemble = Ensemble::new(&OPTIMUM, 77).unwrap();
    let solver = Solver::with_isa(&job.setup, Isa::fastest());
    let mut workspace = Workspace::default();
    let mut solve = |index| solver.realization(&ensemble, index, &mut workspace);
    let velocities = (0..50).filter_map(|index| solve(index).outcome.ok()).collect();
    job.kind = JobKind::Identification;
    job.data = Some(Data::from_velocities(velocities));
    let identified = osteon_search::identify::<Infallible>(&job, |asked| {
        let solver = Solver::with_isa(&job.setup, Isa::fastest());
        let mut workspace = Workspace::default();
        let solve = |index| solver.realization(&asked.ensemble, index, &mut workspace);
        Ok((0..asked.count).map(solve).collect())
    });
    let inference = identified.unwrap().result.conclusions.inference.unwrap();
    let design = design_of(&job, None, &[]).unwrap();
    assert_eq!(design.velocities, 50);
    for (target, found) in [
        (DesignTarget::BulkVelocity, inference.bulk_velocity),
        (DesignTarget::Parameter(Parameter::Dispersion), inference.dispersion),
    ] {
        let Uncertainty { standard_error, .. } = found.known.unwrap();
        // The design is about the start, and the result beside it.
        check(quantity(&design, target).deviation, standard_error, 0.1);
    }
}

#[test]
fn four_times_as_many_velocities_halve_the_errors() {
    let design = design_of(&job(&[]), Some(500), &["velocities=2000"]).unwrap();
    for quantity in &design.quantities {
        let more = predicted(quantity, "velocities=2000");
        check(more.deviation, 0.5 * quantity.deviation, 0.02);
        check(more.worth.unwrap() as f64, 2000.0, 2e-3);
    }
}

/// The velocity tells √(c1111/ρ) alone: a density is as well known as it is measured, and with it the modulus.
#[test]
fn what_is_measured_by_itself_is_known_so_well() {
    let job = job(&[(Parameter::Density, [1500.0, 2000.0])]);
    let design = design_of(&job, None, &["density=2%", "a0_velocity=1%,density=2%"]).unwrap();
    let density = quantity(&design, DesignTarget::Parameter(Parameter::Density));
    check(density.prior, 500.0 / 12.0_f64.sqrt(), 1e-4);
    let measured = predicted(density, "density=2%");
    let error = 0.02 * OPTIMUM.density();
    check(
        measured.deviation,
        (1.0 / (1.0 / (density.deviation * density.deviation) + 1.0 / (error * error))).sqrt(),
        1e-6,
    );
    assert_eq!(measured.worth, None);
    let together = predicted(density, "a0_velocity=1%,density=2%");
    assert!(together.deviation <= measured.deviation);
    assert_eq!(density.ranking[0], together);
    let modulus = quantity(&design, DesignTarget::Parameter(Parameter::LongitudinalYoungModulus));
    assert!(predicted(modulus, "density=2%").deviation < 0.5 * modulus.deviation);
}

/// A tilt shifts the velocity of one direction, and not the mean of both; measured by itself it does as well.
#[test]
fn both_directions_remove_the_error_of_a_tilt() {
    let mut job = job(&[]);
    let exact = design_of(&job, Some(1000), &[]).unwrap();
    let law = SystematicLaw {
        spread: Some(0.5_f64.to_radians()),
        distribution: RandomDistribution::Normal,
        center: None,
    };
    job.systematic.laws[SystematicQuantity::Tilt as usize] = law;
    let design = design_of(&job, Some(1000), &["both_directions", "tilt=1e-6"]).unwrap();
    let [exact, tilted] =
        [&exact, &design].map(|design| quantity(design, DesignTarget::BulkVelocity));
    assert!(tilted.deviation > 5.0 * exact.deviation, "{tilted:?} {exact:?}");
    check(predicted(tilted, "tilt=1e-6").deviation, exact.deviation, 1e-3);
    check(predicted(tilted, "both_directions").deviation, exact.deviation, 0.1);
}

#[test]
fn the_usual_measurements_are_those_that_fit() {
    let job = job(&[(Parameter::Density, [1500.0, 2000.0])]);
    let request = DesignRequest {
        specification: &job,
        set: 0,
        point: job.start(),
        velocities: None,
        plans: None,
        isa: Isa::fastest(),
        threads: 2,
    };
    let design = Design::compute(&request, &|_| {}).unwrap();
    let mut keys: Vec<String> =
        design.quantities[0].ranking.iter().map(|one| one.plan.key()).collect();
    keys.sort_unstable();
    let expected = [
        "a0_velocity=1%",
        "both_directions",
        "decay=7%",
        "density=2%",
        "frequency=500000.0",
        "height=0.003",
        "s0_velocity=1%",
        "velocities=400",
    ];
    assert_eq!(keys, expected);
}

#[test]
fn what_does_not_fit_the_job_is_named() {
    let refused = |specification: &JobSpecification, plans: &[&str], words: &str| {
        let error = design_of(specification, None, plans).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    refused(&job(&[]), &["density=2%"], "density=2%: the job takes it as known");
    refused(&job(&[]), &["height=0.02"], "height=0.02: probe.source.x3");
    let fixed = JobSpecification { parameters: OPTIMUM.0.map(Range::Fixed), ..job(&[]) };
    refused(&fixed, &[], "searches nothing");
    let unknown = JobSpecification { data: Some(Data::from_moments(3900.0, 0.03)), ..job(&[]) };
    refused(&unknown, &[], "how many velocities");
}
