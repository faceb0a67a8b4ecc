//! The text of a first job file.

use std::fmt::Write as _;

use osteon_common::settings::Picking;

use super::roles::Roles;
use crate::velocities::VelocityTable;

/// Everything below `[data]`. The parameters but two are fixed, as two moments determine two.
const BELOW_DATA: &str = r#"
# Two moments of the velocities determine two parameters: here the longitudinal Young's modulus and
# the dispersion. The others are typical of cortical bone; replace them by what you know, or free
# them by { start = …, bounds = [ …, … ] }.
[parameters]
density                    = { fixed = 1850.0 }                              # kg/m³
longitudinal_young_modulus = { start = 20.0e9, bounds = [10.0e9, 30.0e9] }   # Pa
longitudinal_poisson_ratio = { fixed = 0.32 }
longitudinal_shear_modulus = { fixed = 4.5e9 }                               # Pa
transverse_young_modulus   = { fixed = 12.0e9 }                              # Pa
transverse_poisson_ratio   = { fixed = 0.38 }
dispersion                 = { start = 0.1, bounds = [0.02, 0.3] }

# Your device: source and receivers on the skin, x1 along the bone.
[probe]
center_frequency = 1.0e6    # Hz

[probe.receivers]
count = 14
first_x1 = 11.0e-3          # m, from the source at x1 = 0
pitch = 0.8e-3              # m, between neighbours

# The layers under the probe: gel or soft tissue, bone, marrow.
[layers.bone]
thickness = 4.0e-3          # m

[monte_carlo]
sampling = "sobol"
realizations = 1024
control_variate = true
seed = 1

[search]
method = "newton"
"#;

/// Returns the job file for a user who has given no file of velocities: it names one to be written.
pub fn without_data() -> String {
    of_data(
        "[data]\nvelocities = \"velocities.csv\"   # a header, and a column `velocity` in m/s\n\
         # or their moments, instead:\n\
         # mean = 3950.0                      # m/s\n\
         # coefficient_of_variation = 0.03\n\
         # count = 60                         # number of independent velocities\n",
    )
}

/// Returns a job file with this section of data.
pub(super) fn of_data(data: &str) -> String {
    format!(
        "# Identifies the mean elasticity of cortical bone from velocities of the first arriving signal.\n\
         #\n\
         #     osteon check FILE       what it will do and cost\n\
         #     osteon identify FILE    the identification\n\
         #\n\
         # Every key is described in docs/job-files.md; units are SI.\n\n{data}{BELOW_DATA}"
    )
}

/// Returns the section of data of a file.
pub(super) fn data_section(name: &str, table: &VelocityTable, roles: &Roles) -> String {
    let mut text = format!("[data]\nvelocities = {}\n", quoted(name));
    let mut key = |name: &str, value: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name} = {value}");
    };
    for (name, value) in table.keys() {
        key(name, value);
    }
    if let Some(group) = &roles.group {
        key("group", quoted(&group.name));
    }
    if let Some(subject) = &roles.subject {
        key("subject", quoted(&subject.name));
    }
    if let Some(error) = &roles.error {
        key("error_column", quoted(error));
    }
    text
}

/// Returns the section of a criterion.
pub(super) fn picking_section(picking: &Picking) -> String {
    let Picking { extremum, threshold } = picking;
    format!(
        "\n# As the velocities were picked.\n[picking]\nextremum = \"{}\"\nthreshold = {threshold:?}\n",
        extremum.name()
    )
}

/// Returns a text as a string of TOML.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
