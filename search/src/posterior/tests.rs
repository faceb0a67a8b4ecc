//! Posteriors of a model whose moments are known in closed form, so that they can be computed by
//! other means.

use osteon_common::bone_structure::BoneStructure;
use osteon_common::case::Setup;
use osteon_common::data_likelihood::DataLikelihood;
use osteon_common::germ_source::sobol_points;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    Data, JobKind, JobSpecification, MonteCarlo, Objective, PosteriorPrior, PosteriorSettings,
    Range, Search,
};
use osteon_common::moments::MOMENTS;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::porosity::BoneMatrix;
use osteon_common::posterior::{Posterior, PosteriorSummary};
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::results::Moments;
use osteon_common::special::standard_normal_quantile;
use osteon_common::systematic::Systematic;

use super::features::features;
use super::problem::closed_form;
use super::{PosteriorSearch, SearchOutcome, SetLikelihood};

const OPTIMUM: Point =
    Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
const BOUNDS: [[f64; 2]; 7] = [
    [1500.0, 2000.0],
    [12e9, 25e9],
    [0.2, 0.45],
    [3e9, 6.5e9],
    [8e9, 16e9],
    [0.2, 0.5],
    [0.02, 0.3],
];

/// A model that deviates from the closed form about as a bone in a plate does: by up to 2 %.
fn model(point: &Point) -> Option<Moments> {
    let closed = closed_form(&BoneStructure::default(), point)?;
    let at = features(&BoneStructure::default(), point)?;
    let mean = -0.012 + 0.02 * at[0] * at[1] - 0.03 * at[2] * at[2];
    let variation = -1.33 + 0.1 * at[1] * at[1] + 0.03 * libm::exp(2.0 * at[6]);
    let [mean, variation] = [closed[0] + mean, closed[1] + variation];
    Some(Moments { mean: libm::exp(mean), coefficient_of_variation: libm::exp(variation) })
}

/// A model such as that of a thin plate at a low frequency: slower than the rule of thumb by 8 %.
fn slow_model(point: &Point) -> Option<Moments> {
    let [mean, variation] = closed_form(&BoneStructure::default(), point)?;
    let [mean, variation] = [mean - 0.08, variation - 1.1];
    Some(Moments { mean: libm::exp(mean), coefficient_of_variation: libm::exp(variation) })
}

/// A model such as that of a thick plate whose pores grow in number from the near to the far side: the porosity of
/// the far side hardly matters, although the closed form is that of the mean solid.
fn graded_model(point: &Point) -> Option<Moments> {
    let [near, far] =
        [Parameter::SurfacePorosity, Parameter::MarrowPorosity].map(|end| point.get(end));
    let mean = 8.3 - 0.36 * (0.9 * near + 0.1 * far);
    Some(Moments { mean: libm::exp(mean), coefficient_of_variation: 0.27 * point.dispersion() })
}

/// A model whose signal is faster than √(c1111/ρ), by more the nearer both Poisson ratios are to their upper bounds.
fn corner_model(point: &Point) -> Option<Moments> {
    let [mean, variation] = closed_form(&BoneStructure::default(), point)?;
    let share = |parameter: Parameter| {
        let [lower, upper] = BOUNDS[parameter as usize];
        (point.get(parameter) - lower) / (upper - lower)
    };
    let corner =
        share(Parameter::LongitudinalPoissonRatio) * share(Parameter::TransversePoissonRatio);
    let mean = mean - 0.012 + 0.2 * corner * corner * corner;
    Some(Moments { mean: libm::exp(mean), coefficient_of_variation: libm::exp(variation - 1.1) })
}

type Model = fn(&Point) -> Option<Moments>;

/// Velocities with exactly the moments that the model has at a point.
fn velocities(at: &Point, count: usize) -> Vec<f64> {
    with_moments(model(at).unwrap(), count)
}

/// Velocities with exactly these moments.
fn with_moments(Moments { mean, coefficient_of_variation }: Moments, count: usize) -> Vec<f64> {
    let scores: Vec<f64> =
        (0..count).map(|k| standard_normal_quantile((k as f64 + 0.5) / count as f64)).collect();
    let square = scores.iter().map(|z| z * z).sum::<f64>() / count as f64;
    let sigma = mean * coefficient_of_variation / square.sqrt();
    scores.iter().map(|z| mean + sigma * z).collect()
}

fn specification(
    free: &[Parameter],
    count: usize,
    settings: PosteriorSettings,
) -> JobSpecification {
    let mut parameters = OPTIMUM.0.map(Range::Fixed);
    for &parameter in free {
        let [lower, upper] = BOUNDS[parameter as usize];
        let start = OPTIMUM.get(parameter);
        parameters[parameter as usize] = Range::Free { start, lower, upper };
    }
    JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::from_velocities(velocities(&OPTIMUM, count))),
        parameters,
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo::default(),
        objective: Objective::Moments,
        search: Search::default(),
        posterior: Some(settings),
    }
}

/// Runs the search of a posterior to its end.
fn posterior(specification: &JobSpecification) -> Posterior {
    posterior_of(specification, model)
}

fn posterior_of(specification: &JobSpecification, model: Model) -> Posterior {
    let likelihood = SetLikelihood::new(specification, 0);
    let mut search = PosteriorSearch::new(specification, likelihood, std::iter::empty());
    while let Some(point) = search.point() {
        search.tell(model(&point).map(Into::into));
    }
    search.result(specification, [0.0; MOMENTS]).unwrap()
}

fn log_density(likelihood: &DataLikelihood, point: &Point) -> f64 {
    log_density_of(likelihood, model, point)
}

fn log_density_of(likelihood: &DataLikelihood, model: Model, point: &Point) -> f64 {
    let found = model(point).map(|found| [found.mean, found.coefficient_of_variation]);
    found.map_or(f64::NEG_INFINITY, |found| likelihood.log(found.map(libm::log)))
}

/// Returns mean, standard deviation and the quantiles at 2.5 and 97.5 % of weighted values.
fn moments(mut values: Vec<(f64, f64)>) -> [f64; 4] {
    let total: f64 = values.iter().map(|one| one.1).sum();
    let mean = values.iter().map(|(x, w)| w * x).sum::<f64>() / total;
    let square = values.iter().map(|(x, w)| w * (x - mean) * (x - mean)).sum::<f64>() / total;
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Each value stands for half the way to its neighbours.
    let quantile = |level: f64| {
        let mut below = 0.0;
        let reached = values.iter().position(|(_, weight)| {
            below += weight;
            below >= level * total
        });
        let k = reached.unwrap().clamp(1, values.len() - 2);
        let width = 0.5 * (values[k + 1].0 - values[k - 1].0);
        values[k].0 + width * (0.5 - (below - level * total) / values[k].1)
    };
    [mean, square.sqrt(), quantile(0.025), quantile(0.975)]
}

fn check(found: &PosteriorSummary, expected: [f64; 4], tolerance: f64, name: &str) {
    let [low, high] = found.interval();
    let found = [found.mean, found.standard_deviation, low, high];
    for (found, wanted) in found.iter().zip(expected) {
        let off = (found - wanted).abs() / expected[1];
        assert!(off < tolerance, "{name}: {found} instead of {wanted}, {off} deviations off");
    }
}

#[test]
fn one_parameter_has_the_posterior_of_quadrature() {
    for parameter in
        [Parameter::LongitudinalYoungModulus, Parameter::Density, Parameter::Dispersion]
    {
        let specification = specification(&[parameter], 300, PosteriorSettings::default());
        let found = posterior(&specification);
        assert!(found.converged, "{:?}", found.reason);
        let likelihood = SetLikelihood::new(&specification, 0).unwrap().velocities;
        let [lower, upper] = BOUNDS[parameter as usize];
        let nodes = 400_000;
        let values = (0..nodes).map(|k| {
            let value = lower + (upper - lower) * (f64::from(k) + 0.5) / f64::from(nodes);
            let mut point = OPTIMUM;
            point.0[parameter as usize] = value;
            let log = log_density(&likelihood, &point) - log_density(&likelihood, &OPTIMUM);
            (value, libm::exp(log))
        });
        check(&found.parameters[0], moments(values.collect()), 1e-3, parameter.name());
    }
}

#[test]
fn two_parameters_have_the_posterior_of_quadrature() {
    let free = [Parameter::LongitudinalYoungModulus, Parameter::Dispersion];
    let specification = specification(&free, 300, PosteriorSettings::default());
    let found = posterior(&specification);
    assert!(found.converged, "{:?}", found.reason);
    let likelihood = SetLikelihood::new(&specification, 0).unwrap().velocities;
    // The posterior is negligible outside these ranges.
    let ranges = [[16.9e9, 18.5e9], [0.078, 0.135]];
    let nodes = 1500;
    let node = |axis: usize, k: usize| {
        let [lower, upper] = ranges[axis];
        lower + (upper - lower) * (k as f64 + 0.5) / nodes as f64
    };
    let mut sums = [vec![0.0; nodes], vec![0.0; nodes]];
    for i in 0..nodes {
        for j in 0..nodes {
            let mut point = OPTIMUM;
            point.0[1] = node(0, i);
            point.0[6] = node(1, j);
            let log = log_density(&likelihood, &point) - log_density(&likelihood, &OPTIMUM);
            let weight = libm::exp(log);
            sums[0][i] += weight;
            sums[1][j] += weight;
        }
    }
    for axis in [0, 1] {
        let values = (0..nodes).map(|k| (node(axis, k), sums[axis][k]));
        check(&found.parameters[axis], moments(values.collect()), 1e-3, free[axis].name());
    }
}

#[test]
fn seven_parameters_have_the_posterior_of_many_points_of_the_prior() {
    for model in [model, slow_model] {
        let data = with_moments(model(&OPTIMUM).unwrap(), 12);
        let job = specification(&Parameter::OF_BONE, 12, PosteriorSettings::default());
        check_with_points_of_the_prior(
            &JobSpecification { data: Some(Data::from_velocities(data)), ..job },
            model,
        );
    }
}

/// Wherever the corrections of the pivots begin, and whatever the width of their bounds.
#[test]
fn narrow_bounds_have_the_posterior_of_many_points_of_the_prior() {
    let free = [
        Parameter::Density,
        Parameter::TransverseYoungModulus,
        Parameter::LongitudinalShearModulus,
        Parameter::Dispersion,
    ];
    let mut job = specification(&free, 12, PosteriorSettings::default());
    job.data = Some(Data::from_velocities(with_moments(slow_model(&OPTIMUM).unwrap(), 12)));
    for (parameter, [lower, upper]) in
        [(Parameter::Density, [1560.0, 1640.0]), (Parameter::TransverseYoungModulus, [9e9, 11e9])]
    {
        job.parameters[parameter as usize] = Range::Free { start: lower, lower, upper };
    }
    check_with_points_of_the_prior(&job, slow_model);
}

/// Although the pivot of the mean velocity has to move ten times as far as the closed form says.
#[test]
fn a_porosity_profile_has_the_posterior_of_many_points_of_the_prior() {
    let mut job = specification(&[Parameter::Dispersion], 12, PosteriorSettings::default());
    let profile = &mut job.setup.structure.profile;
    (profile.surface, profile.marrow) = (Some(0.08), Some(0.2));
    let ends = [Parameter::SurfacePorosity, Parameter::MarrowPorosity];
    let mut truth = Point::of_matrix(&BoneMatrix::default(), 0.1);
    for (end, (value, [lower, upper])) in
        ends.into_iter().zip([(0.08, [0.01, 0.15]), (0.2, [0.02, 0.4])])
    {
        truth.0[end as usize] = value;
        job.parameters[end as usize] = Range::Free { start: value, lower, upper };
    }
    for parameter in Parameter::OF_BONE.into_iter().filter(|one| *one != Parameter::Dispersion) {
        job.parameters[parameter as usize] = Range::Fixed(truth.get(parameter));
    }
    job.data = Some(Data::from_velocities(with_moments(graded_model(&truth).unwrap(), 12)));
    check_with_points_of_the_prior(&job, graded_model);
}

fn check_with_points_of_the_prior(specification: &JobSpecification, model: Model) {
    let found = posterior_of(specification, model);
    assert!(found.converged, "{:?}", found.reason);
    let likelihood = SetLikelihood::new(specification, 0).unwrap().velocities;
    let points = sobol_points(77, 0, 1 << 18);
    let weighted: Vec<(Point, f64)> = points
        .iter()
        .map(|uniforms| {
            let mut uniforms = uniforms.iter();
            let point = Point::new(specification.parameters.map(|range| match range {
                Range::Fixed(value) => value,
                Range::Free { lower, upper, .. } => {
                    lower + (upper - lower) * uniforms.next().unwrap()
                }
            }));
            let of = |point: &Point| log_density_of(&likelihood, model, point);
            (point, libm::exp(of(&point) - of(&OPTIMUM)))
        })
        .collect();
    for (summary, parameter) in found.parameters.iter().zip(&found.free) {
        let values = weighted.iter().map(|(point, weight)| (point.get(*parameter), *weight));
        check(summary, moments(values.collect()), 0.05, parameter.name());
    }
}

/// Neither the first points of the prior nor the closed form know of models as fast as these data.
#[test]
fn data_that_only_a_corner_of_the_bounds_matches_have_a_posterior() {
    let truth = Point::of_bone([1678.0, 14.4e9, 0.442, 4.7e9, 15.4e9, 0.487, 0.15]);
    let data = with_moments(corner_model(&truth).unwrap(), 20);
    let wanted = libm::log(corner_model(&truth).unwrap().mean);
    let job = specification(&Parameter::OF_BONE, 20, PosteriorSettings::default());
    let job = JobSpecification { data: Some(Data::from_velocities(data)), ..job };
    let found = posterior_of(&job, corner_model);
    assert!(
        found.converged && found.evaluations < 400,
        "{}: {:?}",
        found.evaluations,
        found.reason
    );
    let velocities = found.draws.iter().map(|draw| corner_model(&draw.point).unwrap().mean);
    let off = velocities.map(|one| libm::log(one) - wanted).sum::<f64>() / found.draws.len() as f64;
    assert!(off.abs() < 0.01, "{off}");
}

/// With narrow priors the model is linear, and mean and covariance follow from least squares.
#[test]
fn narrow_normal_priors_give_the_gaussian_formula() {
    let mut settings = PosteriorSettings::default();
    let spreads = [20.0, 0.25e9, 0.006, 0.1e9, 0.15e9, 0.008];
    for ((prior, center), spread) in settings.priors.iter_mut().zip(OPTIMUM.0).zip(spreads) {
        *prior = PosteriorPrior::Normal { center, spread };
    }
    let specification = specification(&Parameter::OF_BONE, 2747, settings);
    let found = posterior(&specification);
    assert!(found.converged, "{:?}", found.reason);
    let noise = SetLikelihood::new(&specification, 0).unwrap().velocities.errors();
    // The dispersion alone follows the variation; the others share the mean velocity.
    let gradient: Vec<f64> = (0..6)
        .map(|k| {
            let mean = |sign: f64| {
                let mut point = OPTIMUM;
                point.0[k] += sign * 1e-3 * spreads[k];
                libm::log(model(&point).unwrap().mean)
            };
            (mean(1.0) - mean(-1.0)) / 2e-3
        })
        .collect();
    let total: f64 = gradient.iter().map(|slope| slope * slope).sum();
    for k in 0..6 {
        let remaining = 1.0 - gradient[k] * gradient[k] / (total + noise[0] * noise[0]);
        let expected = spreads[k] * remaining.sqrt();
        let summary = &found.parameters[k];
        let ratio = summary.standard_deviation / expected;
        assert!((ratio - 1.0).abs() < 0.03, "{k}: {ratio}");
        let off = (summary.mean - OPTIMUM.0[k]) / expected;
        assert!(off.abs() < 0.06, "{k}: {off}");
    }
}

#[test]
fn the_same_evaluations_give_the_same_bits() {
    let free = [Parameter::Density, Parameter::TransversePoissonRatio, Parameter::Dispersion];
    let specification = specification(&free, 100, PosteriorSettings::default());
    let (one, other) = (posterior(&specification), posterior(&specification));
    assert!(one == other, "the results differ");
    let bits = |found: &Posterior| -> Vec<u64> {
        found.draws.iter().flat_map(|draw| draw.point.0.map(f64::to_bits)).collect()
    };
    assert_eq!(bits(&one), bits(&other));
    assert_eq!(one.draws.len(), 2000);
}

#[test]
fn too_few_evaluations_are_said() {
    let settings = PosteriorSettings { max_evaluations: 20, ..PosteriorSettings::default() };
    let found = posterior(&specification(&Parameter::OF_BONE, 2747, settings));
    assert!(!found.converged && found.evaluations <= 20, "{}", found.evaluations);
    assert!(found.reason.unwrap().contains("max_evaluations"));
}

/// The last batch may be accurate and yet too small, and the first one may be large enough and yet
/// not accurate.
#[test]
fn a_result_that_does_not_pass_is_not_called_converged() {
    let one = &[Parameter::Density][..];
    let three = &[Parameter::Density, Parameter::TransversePoissonRatio, Parameter::Dispersion];
    for (free, most, expected) in [(&three[..], 56, "checked at 8 draws"), (one, 32, "differs")] {
        let settings = PosteriorSettings { max_evaluations: most, ..PosteriorSettings::default() };
        let found = posterior(&specification(free, 2747, settings));
        assert_eq!(found.evaluations, most);
        assert!(!found.converged, "{most}");
        let reason = found.reason.unwrap();
        assert!(reason.contains(expected), "{reason}");
    }
}

/// One of a hundred velocities is doubled, which raises their coefficient of variation from 0.027 to
/// 0.1.
#[test]
fn a_wrong_velocity_hardly_moves_the_posterior() {
    let clean = specification(&[Parameter::Dispersion], 100, PosteriorSettings::default());
    let mut velocities = velocities(&OPTIMUM, 100);
    velocities[50] *= 2.0;
    let data = Some(Data::from_velocities(velocities));
    let found = posterior(&JobSpecification { data, ..clean });
    let off = found.parameters[0].mean - OPTIMUM.dispersion();
    assert!(off.abs() < 0.3 * found.parameters[0].standard_deviation, "{:?}", found.parameters);
    assert!((0.008..0.03).contains(&found.outlier_share.unwrap()), "{:?}", found.outlier_share);
}

/// A job that asks for nothing but the posterior ends as the result says.
#[test]
fn a_posterior_of_too_noisy_a_model_has_not_converged() {
    let free = [Parameter::Density, Parameter::TransversePoissonRatio, Parameter::Dispersion];
    let job = specification(&free, 100, PosteriorSettings::default());
    let mut search = PosteriorSearch::new(&job, SetLikelihood::new(&job, 0), std::iter::empty());
    while let Some(point) = search.point() {
        search.tell(model(&point).map(Into::into));
    }
    let noise = search.problem.as_ref().unwrap().likelihood.errors();
    for (ratio, converged) in [(1.0, true), (9.0, false)] {
        let errors = noise.map(|noise| ratio * noise);
        let found = search.result(&job, errors).unwrap();
        assert_eq!(found.converged, converged, "{ratio}: {:?}", found.reason);
        let expected = found.reason.map_or(SearchOutcome::Converged, SearchOutcome::Doubtful);
        assert_eq!(search.ending(Some(errors)), expected);
    }
}
