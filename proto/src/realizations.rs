//! Outcomes of consecutive indices in packed form: a code byte and a double each.

use osteon_common::outcome::{self, Outcome};

use crate::malformed::Malformed;
use crate::v1;

/// Packs `outcomes`, the first of which has index `first`, into a block. `group` is the group whose
/// best point they belong to, if there are groups.
pub fn to_message(group: Option<u32>, first: u64, outcomes: &[Outcome]) -> v1::RealizationBlock {
    let (codes, velocities) = pack(outcomes);
    v1::RealizationBlock { group, first, codes, velocities }
}

/// Returns the index of the first realization of a block, and the block's outcomes.
///
/// # Errors
/// Same as [`unpack`].
pub fn from_message(block: &v1::RealizationBlock) -> Result<(u64, Vec<Outcome>), Malformed> {
    Ok((block.first, unpack(&block.codes, &block.velocities)?))
}

/// Returns the code bytes and velocities (m/s, 0 on failure) of `outcomes`, in their order.
pub fn pack(outcomes: &[Outcome]) -> (Vec<u8>, Vec<f64>) {
    outcomes.iter().map(|&outcome| outcome::encode(outcome)).unzip()
}

/// Returns the outcomes packed by [`pack`].
///
/// # Errors
/// If the lengths differ, or if a pair does not encode an outcome.
pub fn unpack(codes: &[u8], velocities: &[f64]) -> Result<Vec<Outcome>, Malformed> {
    if codes.len() != velocities.len() {
        return Err(Malformed::WrongLength {
            field: "velocities",
            found: velocities.len(),
            expected: codes.len(),
        });
    }
    let pairs = codes.iter().zip(velocities).enumerate();
    pairs
        .map(|(index, (&code, &velocity))| {
            outcome::decode(code, velocity).ok_or(Malformed::Outcome { index, code, velocity })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use osteon_common::outcome::FailureKind;
    use osteon_fuzz::properties;
    use proptest::prelude::*;

    use super::*;

    fn outcomes() -> impl Strategy<Value = Vec<Outcome>> {
        let outcome = prop_oneof![
            (f64::MIN_POSITIVE..1e5).prop_map(Ok),
            (0..FailureKind::ALL.len()).prop_map(|kind| Err(FailureKind::ALL[kind])),
        ];
        proptest::collection::vec(outcome, 0..50)
    }

    properties! {
        fn outcomes_survive_the_wire(
            group in any::<Option<u32>>(),
            first in any::<u64>(),
            outcomes in outcomes(),
        ) {
            let block = to_message(group, first, &outcomes);
            prop_assert_eq!(block.group, group);
            prop_assert_eq!(from_message(&block).unwrap(), (first, outcomes));
        }

        fn arbitrary_blocks_are_read_or_refused(
            codes in proptest::collection::vec(any::<u8>(), 0..100),
            velocities in proptest::collection::vec(proptest::num::f64::ANY, 0..50),
        ) {
            if let Ok(outcomes) = unpack(&codes, &velocities) {
                prop_assert_eq!(pack(&outcomes), (codes, velocities));
            }
        }
    }

    #[test]
    fn unequal_lengths_are_refused() {
        assert_eq!(
            unpack(&[0, 0], &[3900.0]),
            Err(Malformed::WrongLength { field: "velocities", found: 1, expected: 2 })
        );
    }
}
