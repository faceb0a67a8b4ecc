//! Tests of the conversion of draws to and from messages.

use osteon_common::parameters::Point;
use osteon_fuzz::properties;
use proptest::prelude::*;

use super::*;
use crate::history::tests::{number, point};

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

properties! {
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

#[test]
fn draws_with_a_part_missing_are_refused() {
    let point = Point::of_bone([1.0; 7]);
    let draw =
        PosteriorDraw { point, log_density: -2.0, mean: 3900.0, coefficient_of_variation: 0.03 };
    let draws = vec![draw; 2];
    let mut block = draws_to_message(None, 0, &draws);
    block.draws[1].log_density = None;
    assert_eq!(draws_from_message(&block), Err(Malformed::Missing { field: "log_density" }));
    block.draws[0].point = None;
    assert_eq!(draws_from_message(&block), Err(Malformed::Missing { field: "point" }));
}
