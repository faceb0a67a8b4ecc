//! The digest that identifies a job's result to the bit.

use crate::outcome::{Outcome, encode};
use crate::outcomes::Outcomes;
use crate::parameters::Point;

/// BLAKE3 over the evaluations of a search's path, in order.
///
/// Each evaluation adds its parameters (seven, and those of the setup that are searched), then for
/// each index the code byte of the outcome (0 = success) and its velocity in m/s (0 on failure); then,
/// for each observable that the job has data of, in their order, its value for each index (0 on failure);
/// every float as 8 bytes little-endian, nothing between them. The digest depends on these numbers alone: not
/// on names, times or the program's version.
#[derive(Debug, Clone, Default)]
pub struct PathDigest(blake3::Hasher);

/// Size of an outcome in the digest: its code byte and its velocity.
const OUTCOME_BYTES: usize = 9;
/// Outcomes that are hashed at once.
const BLOCK_OUTCOMES: usize = 4096;

impl PathDigest {
    /// The digest of an empty path.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends one evaluation: its point and its outcomes in index order, with the observables that they
    /// have.
    pub fn add(&mut self, point: &Point, outcomes: &Outcomes) {
        self.add_evaluation(point, outcomes);
        for (_, values) in outcomes.observables().present() {
            for value in values.iter() {
                self.0.update(&value.to_le_bytes());
            }
        }
    }

    /// Appends one evaluation without other observables: its point and its outcomes in index order.
    pub fn add_evaluation(&mut self, point: &Point, outcomes: &[Outcome]) {
        for (_, value) in point.given() {
            self.0.update(&value.to_le_bytes());
        }
        // A hash of a few bytes at a time would take ten times as long.
        let mut block = Vec::with_capacity(BLOCK_OUTCOMES.min(outcomes.len()) * OUTCOME_BYTES);
        for outcomes in outcomes.chunks(BLOCK_OUTCOMES) {
            block.clear();
            for &outcome in outcomes {
                let (code, velocity) = encode(outcome);
                let mut record = [code; OUTCOME_BYTES];
                record[1..].copy_from_slice(&velocity.to_le_bytes());
                block.extend_from_slice(&record);
            }
            self.0.update(&block);
        }
    }

    /// Returns the digest so far, 64 hexadecimal digits in lower case.
    pub fn finish(&self) -> String {
        self.0.finalize().to_hex().to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observables::{Observable, PerObservable};
    use crate::outcome::FailureKind;

    const FIRST: Point =
        Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    const FIRST_OUTCOMES: [Outcome; 3] =
        [Ok(3908.749494174314), Err(FailureKind::NoArrival), Ok(4056.3145)];
    const SECOND: Point = Point::of_bone([1700.0, 20e9, 0.3, 5e9, 10e9, 0.4, 0.2]);
    const SECOND_OUTCOMES: [Outcome; 2] = [Err(FailureKind::NoConvergence), Ok(0.1)];

    /// Compares with values computed by the Python package `blake3` over bytes packed with `struct`
    /// (`<7d`, then `<Bd` for each outcome).
    #[test]
    fn the_bytes_are_those_of_the_contract() {
        let mut digest = PathDigest::new();
        let empty = "af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262";
        assert_eq!(digest.finish(), empty);
        digest.add_evaluation(&FIRST, &FIRST_OUTCOMES);
        let one = "943d111c440d0fa27c1485c1dc9cd4fdb6a8eb7a482d15603a57e2848cc8fc10";
        assert_eq!(digest.finish(), one);
        digest.add_evaluation(&SECOND, &SECOND_OUTCOMES);
        let two = "052c5ecdc171f97a61c243565215e3fe47e7cf62117709159a3c475b3628b3a5";
        assert_eq!(digest.finish(), two);
    }

    #[test]
    fn observables_follow_the_outcomes() {
        let of = |decays: Option<[f64; 3]>| {
            let mut digest = PathDigest::new();
            let outcomes = Outcomes::from(FIRST_OUTCOMES);
            let mut columns = PerObservable::default();
            columns[Observable::Decay] = decays.map(|decays| decays.to_vec());
            digest.add(&FIRST, &outcomes.with_observables(columns));
            digest.finish()
        };
        let mut digest = PathDigest::new();
        digest.add_evaluation(&FIRST, &FIRST_OUTCOMES);
        assert_eq!(of(None), digest.finish());
        for decay in [4.625_f64, 0.0, -0.5] {
            digest.0.update(&decay.to_le_bytes());
        }
        assert_eq!(of(Some([4.625, 0.0, -0.5])), digest.finish());
        assert_ne!(of(Some([4.625, 0.0, 0.5])), digest.finish());
    }

    #[test]
    fn every_number_counts() {
        let of = |point: Point, outcomes: &[Outcome]| {
            let mut digest = PathDigest::new();
            digest.add_evaluation(&point, outcomes);
            digest.finish()
        };
        let reference = of(FIRST, &FIRST_OUTCOMES);
        for parameter in 0..7 {
            let mut point = FIRST;
            point.0[parameter] = point.0[parameter].next_up();
            assert_ne!(of(point, &FIRST_OUTCOMES), reference, "parameter {parameter}");
        }
        for index in 0..FIRST_OUTCOMES.len() {
            let mut outcomes = FIRST_OUTCOMES;
            outcomes[index] = match outcomes[index] {
                Ok(velocity) => Ok(velocity.next_up()),
                Err(_) => Err(FailureKind::NotFinite),
            };
            assert_ne!(of(FIRST, &outcomes), reference, "index {index}");
        }
    }
}
