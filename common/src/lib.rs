//! The types that all other crates of osteon share.
//!
//! Elasticity and its random ensemble, layers, probe, case and job specifications with their
//! validation, the moments of a set of velocities, results, and the digest that identifies them.
//! Keys of files are declared here and specifications are checked here; `osteon-files` reads and
//! writes the files. This crate uses no file, network, clock or thread; everything in it is a pure
//! function of its input.
//!
//! Units are SI throughout: m, s, kg/m³, Pa, Hz. "The paper" is Desceliers, Soize, Grimal, Talmant and
//! Naili, "Experimental identification in the ultrasonic range of a mechanical model for cortical
//! bones"; see `docs/physics.md`.

#![forbid(unsafe_code)]

mod accepted;
pub mod array_decay;
pub mod attainable_moments;
pub mod attenuation;
pub mod bone;
pub mod bone_structure;
pub mod bulk_velocity;
pub mod carried_velocity;
pub mod case;
pub mod check;
pub mod conclusions;
pub mod data;
pub mod data_likelihood;
pub mod data_statistics;
pub mod digest;
pub mod elasticity;
pub mod ensemble;
pub mod field_path;
pub mod fields;
pub mod fluid_sublayers;
pub mod germ_source;
pub mod group_settings;
pub mod homogenisation;
pub mod inference;
pub mod job;
pub mod known_quantities;
pub mod layers;
pub mod limits;
pub mod line_fit;
pub mod moments;
mod monte_carlo;
pub mod observables;
pub mod origin;
pub mod outcome;
pub mod outcomes;
pub mod parameters;
pub mod plausible;
pub mod pooling;
pub mod porosity;
pub mod posterior;
mod posterior_settings;
pub mod probe;
pub mod pulse;
pub mod pulse_samples;
pub mod quantile;
pub mod random_quantities;
pub mod realization;
pub mod results;
pub mod robust;
pub mod sampling;
mod search_settings;
pub mod settings;
pub mod setup_quantity;
pub mod shift;
pub mod signal_layout;
mod sobol;
pub mod special;
pub mod statistics;
pub mod systematic;
pub mod version;
pub mod violations;
pub mod visible;
pub mod warnings;
pub mod wave_settings;
