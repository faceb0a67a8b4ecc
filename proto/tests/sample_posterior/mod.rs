//! A posterior of two free parameters, with all that there can be.

use osteon_common::parameters::{Parameter, Point};
use osteon_common::posterior::{Posterior, PosteriorDraw, PosteriorSummary};

/// Returns the posterior, with three draws at `point`.
pub(crate) fn posterior(point: Point) -> Posterior {
    let summary = |mean: f64| PosteriorSummary {
        mean,
        standard_deviation: 0.1 * mean,
        quantiles: [0.8, 0.85, 0.95, 1.0, 1.05, 1.15, 1.2].map(|quantile| quantile * mean),
        prior_standard_deviation: 0.2 * mean,
    };
    let draw = |k: u32| PosteriorDraw {
        point,
        log_density: -1.5 - f64::from(k),
        mean: 3900.0,
        coefficient_of_variation: 0.03,
    };
    Posterior {
        converged: false,
        reason: Some("why".to_owned()),
        evaluations: 80,
        effective_draws: 900.0,
        checked_draws: 20,
        model_error: 0.05,
        check_efficiency: 0.97,
        pareto_k: Some(0.3),
        sampling_error: 0.02,
        free: vec![Parameter::Density, Parameter::Dispersion],
        parameters: vec![summary(1700.0), summary(0.1)],
        correlation: vec![vec![1.0, -0.3], vec![-0.3, 1.0]],
        mean: summary(3900.0),
        coefficient_of_variation: summary(0.03),
        bulk_velocity: summary(4000.0),
        entries: vec![(0, 0, summary(25e9)), (4, 5, summary(1e7))],
        predictive_p_value: Some(0.4),
        outlier_share: Some(0.01),
        draws: (0..3).map(draw).collect(),
    }
}
