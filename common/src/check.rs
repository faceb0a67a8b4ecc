//! The rules for specifications, which are the same for files and for messages.
//!
//! Fields are named as in a job file, e.g. `layers.coupling.density`. A field that is already known
//! to be wrong is not checked again, nor is a relation between fields of which one is wrong.

mod bone_structure;
mod data;
mod groups;
mod job;
mod known_quantities;
mod observables;
mod porosity;
mod posterior;
mod priors;
mod pulse;
mod random_quantities;
mod range;
mod section;
mod setup;
mod setup_parameters;
mod signals;
mod systematic;
mod value;
mod waves;

use crate::job::JobSpecification;
use crate::violations::Violations;

pub use self::bone_structure::porosity_profile;
pub use self::data::{
    COUNT, DATA_FORMS, DECAY_ERROR, REPEATABILITY, VELOCITIES_MIN, VELOCITY, data, no_data,
};
pub use self::job::{job, job_from};
pub use self::porosity::{porosity, porosity_model};
pub use self::posterior::posterior;
pub use self::random_quantities::random_quantities;
pub use self::setup::setup;
pub use self::signals::signals;
pub use self::value::{number, quantity};
pub use self::waves::waves;

impl JobSpecification {
    /// Returns all violations of the specification, each with its field named as in a job file.
    pub fn check(&self) -> Violations {
        let mut violations = Violations::new();
        job(self, &mut violations);
        violations
    }
}
