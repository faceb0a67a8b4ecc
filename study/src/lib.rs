//! Measures the solvers against each other, and the methods of search: [`check`] on one case, and
//! studies over many draws of the paper's optimum that end in a [`Table`].
//!
//! A study is a function of its [`Draws`] alone: realizations are computed on all cores and taken
//! in index order, so that its numbers depend neither on threads nor on the instruction set.

pub mod accuracy;
pub mod check;
pub mod continuity;
pub mod convergence;
mod difference;
pub mod digest;
mod draws;
pub mod failures;
mod generator;
pub mod methods;
pub mod models;
pub mod refinement;
pub mod searches;
pub mod setups;
mod table;

pub use difference::{Difference, difference};
pub use draws::{Draws, OPTIMUM};
pub use table::Table;

/// Hears of every row of a table that is finished.
pub type Progress<'a> = &'a dyn Fn(&str);
