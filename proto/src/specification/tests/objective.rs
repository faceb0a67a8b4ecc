//! Tests of the default objective.

use super::*;

#[test]
fn the_default_objective_is_that_of_the_data() {
    let mut message = message();
    message.objective = None;
    message.search = Some(v1::Search::default());
    let found = |message: &v1::JobSpecification| {
        let specification = from_message(message).unwrap();
        (specification.objective, specification.search.cost_tolerance)
    };
    assert_eq!(found(&message), (Objective::Moments, 1e-10));
    message.data.as_mut().unwrap().count = Some(100);
    assert_eq!(found(&message), (Objective::ChiSquare, 1e-4));
    message.search.as_mut().unwrap().cost_tolerance = Some(1e-6);
    assert_eq!(found(&message), (Objective::ChiSquare, 1e-6));
    message.objective = Some(v1::Objective { kind: v1::ObjectiveKind::Moments.into() });
    assert_eq!(found(&message), (Objective::Moments, 1e-6));
}
