//! Support for tests on random inputs: properties with cases that are the same in every run, and
//! damaged inputs for every parser: a corpus of seeds, structured damage to them, and a limit on
//! the work of reading an input.
//!
//! A test of a parser reads every seed unchanged, then many damaged ones, and checks that nothing
//! panics, that no input takes more processor time than its length justifies, and that an accepted
//! input is accepted again, with the same meaning, after it is written out. `cargo xtask test random`
//! runs more such cases.

#![forbid(unsafe_code)]

mod bound;
mod corpus;
mod damage;
mod property;

pub use bound::bounded;
pub use corpus::{bytes, texts};
pub use damage::{damaged, damaged_text};
pub use property::{CASES, Place, check};
