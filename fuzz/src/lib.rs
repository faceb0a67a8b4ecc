//! Damaged inputs for tests: a corpus of seeds, structured damage to them, and a bound on the work
//! that reading one may take.
//!
//! A test of a parser reads every seed as it is, then many damaged ones, and holds that nothing
//! panics, that no input of a length takes more than its share of processor time, and that what is
//! accepted is accepted again, and alike, when it is written out. `PROPTEST_CASES=100000` makes
//! more of it.

mod bound;
mod corpus;
mod damage;

use proptest::test_runner::{Config, FileFailurePersistence};

pub use bound::bounded;
pub use corpus::{bytes, texts};
pub use damage::{damaged, damaged_text};

/// How the tests run: what has failed is kept beside them, in a file `….regressions`, and tried
/// first ever after.
pub fn config() -> Config {
    Config {
        failure_persistence: Some(Box::new(FileFailurePersistence::WithSource("regressions"))),
        ..Config::default()
    }
}
