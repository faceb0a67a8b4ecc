//! The vocabulary of osteon: what every other crate talks about.
//!
//! Elasticity and its random ensemble, layers, probe, case and job specifications with their
//! validation, the moments of a set of velocities, results and the digest that pins them.
//! This crate knows no network, no clock and no thread; all of it is a pure function of its input
//! except [`job_file`] and [`case_file`], which read the files a user names.
//!
//! Units are SI throughout: m, s, kg/m³, Pa, Hz.

pub mod case;
pub mod elasticity;
pub mod job;
pub mod layers;
pub mod limits;
pub mod outcome;
pub mod parameters;
pub mod probe;
pub mod results;
pub mod sampling;
pub mod settings;
pub mod version;
pub mod violations;
