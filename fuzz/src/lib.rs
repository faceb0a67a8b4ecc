//! For tests on random inputs: properties with cases that are the same in every run, and damaged
//! inputs for whatever is parsed: a corpus of seeds, structured damage to them, and a bound on the
//! work that reading one may take.
//!
//! A test of a parser reads every seed as it is, then many damaged ones, and holds that nothing
//! panics, that no input of a length takes more than its share of processor time, and that what is
//! accepted is accepted again, and alike, when it is written out. `cargo xtask random` makes more
//! of it.

mod bound;
mod corpus;
mod damage;
mod property;

pub use bound::bounded;
pub use corpus::{bytes, texts};
pub use damage::{damaged, damaged_text};
pub use property::{CASES, Place, check};
