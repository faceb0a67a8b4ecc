//! Tests of the conversion of posteriors to and from messages.

use osteon_fuzz::properties;
use proptest::prelude::*;

use super::*;
use crate::results::tests::{free, number, point};

prop_compose! {
    fn summary_of_any()(
        mean in number(),
        standard_deviation in number(),
        quantiles in proptest::array::uniform7(number()),
        prior_standard_deviation in number(),
    ) -> PosteriorSummary {
        PosteriorSummary { mean, standard_deviation, quantiles, prior_standard_deviation }
    }
}

prop_compose! {
    fn draw()(
        point in point(),
        log_density in number(),
        mean in number(),
        coefficient_of_variation in number(),
    ) -> PosteriorDraw {
        PosteriorDraw { point, log_density, mean, coefficient_of_variation }
    }
}

prop_compose! {
    /// A posterior with any numbers.
    pub(crate) fn posterior()(free in free())(
        converged in any::<bool>(),
        reason in proptest::option::of("[a-z ]{0,9}"),
        evaluations in 0..=POSTERIOR_EVALUATIONS_MAX,
        checked_draws in any::<u64>(),
        accuracy in proptest::array::uniform4(number()),
        pareto_k in proptest::option::of(number()),
        parameters in proptest::collection::vec(summary_of_any().boxed(), free.len()),
        correlation in proptest::collection::vec(
            proptest::collection::vec(number(), free.len()), free.len()),
        moments in (summary_of_any().boxed(), summary_of_any().boxed(), summary_of_any().boxed()),
        entries in proptest::collection::vec((0_usize..6, 0_usize..6, summary_of_any()), 0..4),
        predictive_p_value in proptest::option::of(number()),
        outlier_share in proptest::option::of(number()),
        draws in proptest::collection::vec(draw(), 0..5),
        free in Just(free),
    ) -> Posterior {
        let [effective_draws, model_error, check_efficiency, sampling_error] = accuracy;
        let (mean, coefficient_of_variation, bulk_velocity) = moments;
        let upper = |(i, j, one): (usize, usize, PosteriorSummary)| (i.min(j), i.max(j), one);
        Posterior {
            converged,
            reason,
            evaluations,
            effective_draws,
            checked_draws,
            model_error,
            check_efficiency,
            pareto_k,
            sampling_error,
            free,
            parameters,
            correlation,
            mean,
            coefficient_of_variation,
            bulk_velocity,
            entries: entries.into_iter().map(upper).collect(),
            predictive_p_value,
            outlier_share,
            draws,
        }
    }
}

properties! {
    fn posteriors_survive_the_wire(posterior in posterior().boxed()) {
        let draws = posterior.draws.clone();
        prop_assert_eq!(from_message(&to_message(&posterior), draws), Ok(posterior));
    }

    fn draws_survive_the_wire(
        group in any::<Option<u32>>(),
        first in any::<u64>(),
        draws in proptest::collection::vec(draw(), 0..9),
    ) {
        let block = draws_to_message(group, first, &draws);
        prop_assert_eq!(block.group, group);
        prop_assert_eq!(draws_from_message(&block), Ok((first, draws)));
    }
}

fn complete() -> (v1::Posterior, Vec<PosteriorDraw>) {
    let summary = PosteriorSummary {
        mean: 1.0,
        standard_deviation: 0.5,
        quantiles: [0.1, 0.2, 0.5, 1.0, 1.5, 1.8, 1.9],
        prior_standard_deviation: 1.0,
    };
    let point = osteon_common::parameters::Point::of_bone([1.0; 7]);
    let draw =
        PosteriorDraw { point, log_density: -2.0, mean: 3900.0, coefficient_of_variation: 0.03 };
    let posterior = Posterior {
        converged: true,
        reason: None,
        evaluations: 80,
        effective_draws: 900.0,
        checked_draws: 20,
        model_error: 0.05,
        check_efficiency: 0.97,
        pareto_k: None,
        sampling_error: 0.02,
        free: vec![Parameter::Density, Parameter::Dispersion],
        parameters: vec![summary; 2],
        correlation: vec![vec![1.0, -0.3], vec![-0.3, 1.0]],
        mean: summary,
        coefficient_of_variation: summary,
        bulk_velocity: summary,
        entries: vec![(0, 5, summary)],
        predictive_p_value: None,
        outlier_share: None,
        draws: vec![draw; 2],
    };
    (to_message(&posterior), posterior.draws)
}

#[test]
fn posteriors_with_a_part_missing_are_refused() {
    let refused = |change: fn(&mut v1::Posterior)| {
        let (mut message, draws) = complete();
        from_message(&message, draws.clone()).unwrap();
        change(&mut message);
        match from_message(&message, draws).unwrap_err() {
            Malformed::Missing { field }
            | Malformed::WrongLength { field, .. }
            | Malformed::OutOfRange { field, .. } => field,
            other => panic!("{other}"),
        }
    };
    fn mean(message: &mut v1::Posterior) -> &mut v1::QuantityPosterior {
        message.mean.as_mut().unwrap()
    }
    assert_eq!(refused(|m| m.evaluations = POSTERIOR_EVALUATIONS_MAX + 1), "evaluations");
    assert_eq!(refused(|m| m.draws = DRAWS_MAX + 1), "draws");
    assert_eq!(refused(|m| m.draws = 1), "draws");
    assert_eq!(refused(|m| m.parameters[0].parameter = 0), "parameter");
    assert_eq!(refused(|m| m.parameters[0].posterior = None), "posterior");
    assert_eq!(refused(|m| m.correlations.truncate(1)), "correlations");
    assert_eq!(refused(|m| m.correlations[1].dispersion = None), "dispersion");
    assert_eq!(refused(|m| m.bulk_velocity = None), "bulk_velocity");
    assert_eq!(refused(|m| m.mean = None), "mean");
    assert_eq!(refused(|m| mean(m).quantiles.truncate(6)), "quantiles");
    assert_eq!(refused(|m| mean(m).prior_standard_deviation = None), "prior_standard_deviation");
    assert_eq!(refused(|m| m.mandel[0].row = 7), "row");
    assert_eq!(refused(|m| m.mandel[0].column = 0), "column");
    let (_, draws) = complete();
    let mut block = draws_to_message(None, 0, &draws);
    block.draws[1].log_density = None;
    assert_eq!(draws_from_message(&block), Err(Malformed::Missing { field: "log_density" }));
    block.draws[0].point = None;
    assert_eq!(draws_from_message(&block), Err(Malformed::Missing { field: "point" }));
}
