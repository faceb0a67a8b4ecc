//! Posteriors of the solver's model against quadrature.

use osteon_common::data_likelihood::DataLikelihood;
use osteon_common::job::{Data, Range};
use osteon_common::outcome::Outcome;
use osteon_common::posterior::PosteriorSummary;
use osteon_common::realization::Ensemble;
use osteon_common::statistics::estimate;
use osteon_solver::{Isa, Solver};

use super::*;
use crate::draws::{OPTIMUM, solve_realizations};

/// Realizations of the model: the comparison is exact for any number, but the mean velocity of a few
/// bones is rough by 1e-6 where passes are blended, and these are enough for that not to matter.
const REALIZATIONS: u64 = 64;
const COUNT: u64 = 300;
/// Nodes of each axis.
const NODES: usize = 27;
/// Steps between two nodes.
const FINER: usize = 200;

/// Returns a job for data with the moments of the optimum, in which only these parameters are free.
fn job(free: &[Parameter]) -> JobSpecification {
    let measurements = osteon_common::job::Measurements::Moments {
        mean: 3906.0,
        coefficient_of_variation: 0.0271,
        count: Some(COUNT),
    };
    let data = Data { measurements, repeatability: 0.0, decay_error: 0.0 };
    let mut job = specification(data, model_germs(REALIZATIONS, 1));
    for parameter in Parameter::ALL.into_iter().filter(|one| !free.contains(one)) {
        job.parameters[parameter as usize] = Range::Fixed(OPTIMUM.get(parameter));
    }
    job
}

/// The posterior's density on a grid, by the solver itself.
struct Grid {
    job: JobSpecification,
    likelihood: DataLikelihood,
    solver: Solver,
}

impl Grid {
    /// Creates it with the likelihood that the posterior has used: that of a model with the sampling
    /// errors of its best point.
    fn new(job: JobSpecification, errors: [f64; 2]) -> Self {
        let data = job.data.as_ref().unwrap();
        let likelihood = DataLikelihood::from_moments(data.moments(0), COUNT, 0.0).unwrap();
        let solver = Solver::with_isa(&job.setup, Isa::fastest());
        Self { job, likelihood: likelihood.with_model_errors(errors), solver }
    }

    fn log_density(&self, values: &[(Parameter, f64)]) -> f64 {
        let mut point = OPTIMUM;
        for &(parameter, value) in values {
            point.0[parameter as usize] = value;
        }
        let monte_carlo = &self.job.monte_carlo;
        let ensemble = Ensemble::drawn(&point, monte_carlo.germs()).unwrap();
        let solved = solve_realizations(&self.solver, &ensemble, REALIZATIONS);
        let outcomes: Vec<Outcome> = solved.into_iter().map(|one| one.outcome).collect();
        let found = estimate(monte_carlo, &point, &outcomes).unwrap().moments;
        self.likelihood.log([found.mean, found.coefficient_of_variation].map(libm::log))
    }
}

/// Returns mean, standard deviation and the quantiles at 2.5 and 97.5 % of a density, given its
/// logarithm at equidistant nodes that reach to where it vanishes. The trapezoidal rule is exact for
/// it, and its logarithm close to a parabola, so that cubics through four nodes fill the gaps.
fn moments(nodes: &[f64], logs: &[f64]) -> [f64; 4] {
    let step = (nodes[1] - nodes[0]) / FINER as f64;
    let mut fine = Vec::new();
    for k in 1..nodes.len() - 2 {
        for part in 0..FINER {
            let t = part as f64 / FINER as f64;
            let log = logs[k - 1] * (-t * (t - 1.0) * (t - 2.0) / 6.0)
                + logs[k] * ((t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0)
                + logs[k + 1] * (-(t + 1.0) * t * (t - 2.0) / 2.0)
                + logs[k + 2] * ((t + 1.0) * t * (t - 1.0) / 6.0);
            fine.push((nodes[k] + step * part as f64, libm::exp(log)));
        }
    }
    let total: f64 = fine.iter().map(|one| one.1).sum();
    let mean = fine.iter().map(|(x, weight)| weight * x).sum::<f64>() / total;
    let square = fine.iter().map(|(x, w)| w * (x - mean) * (x - mean)).sum::<f64>() / total;
    let quantile = |level: f64| {
        let mut below = 0.0;
        for (x, weight) in &fine {
            if below + weight >= level * total {
                return x + step * ((level * total - below) / weight - 0.5);
            }
            below += weight;
        }
        f64::NAN
    };
    [mean, square.sqrt(), quantile(0.025), quantile(0.975)]
}

fn check(found: &PosteriorSummary, expected: [f64; 4], name: &str) {
    let [low, high] = found.interval();
    for (found, wanted) in [found.mean, found.standard_deviation, low, high].iter().zip(expected) {
        let off = (found - wanted).abs() / expected[1];
        assert!(off < 1e-3, "{name}: {found} instead of {wanted}, {off} deviations off");
    }
}

fn posterior(job: &JobSpecification) -> (Posterior, [f64; 2]) {
    let done = identify(job, &mut RealizationCache::new(), Isa::fastest()).unwrap().result;
    let errors = done.best.unwrap().velocity.unwrap().relative_errors();
    let posterior = done.conclusions.posterior.unwrap();
    assert!(posterior.converged, "{:?}", posterior.reason);
    (posterior, errors)
}

fn nodes(around: &PosteriorSummary) -> Vec<f64> {
    let (center, reach) = (around.mean, 6.5 * around.standard_deviation);
    let place = |k: usize| 2.0 * k as f64 / (NODES - 1) as f64 - 1.0;
    (0..NODES).map(|k| center + reach * place(k)).collect()
}

#[test]
fn one_free_parameter_of_the_solver_has_the_posterior_of_quadrature() {
    for parameter in [Parameter::Dispersion, Parameter::LongitudinalYoungModulus] {
        let job = job(&[parameter]);
        let (found, errors) = posterior(&job);
        let grid = Grid::new(job, errors);
        let at = nodes(&found.parameters[0]);
        let logs: Vec<f64> = at.iter().map(|x| grid.log_density(&[(parameter, *x)])).collect();
        let largest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let logs: Vec<f64> = logs.iter().map(|log| log - largest).collect();
        check(&found.parameters[0], moments(&at, &logs), parameter.name());
    }
}

#[test]
fn two_free_parameters_of_the_solver_have_the_posterior_of_quadrature() {
    let free = [Parameter::LongitudinalYoungModulus, Parameter::Dispersion];
    let job = job(&free);
    let (found, errors) = posterior(&job);
    let grid = Grid::new(job, errors);
    let axes = [0, 1].map(|k| nodes(&found.parameters[k]));
    let largest = grid.log_density(&[0, 1].map(|k| (free[k], found.parameters[k].mean)));
    let mut sums = [vec![0.0; NODES], vec![0.0; NODES]];
    for (i, &x) in axes[0].iter().enumerate() {
        for (j, &y) in axes[1].iter().enumerate() {
            let log = grid.log_density(&[(free[0], x), (free[1], y)]);
            let density = libm::exp(log - largest);
            sums[0][i] += density;
            sums[1][j] += density;
        }
    }
    for k in [0, 1] {
        let logs: Vec<f64> = sums[k].iter().copied().map(libm::log).collect();
        check(&found.parameters[k], moments(&axes[k], &logs), free[k].name());
    }
}
