//! The pulse, the width of source and receivers, and the tilt.

use osteon_common::job::JobKind;

use super::check;

#[test]
fn probe() {
    check(
        "rejected_probe",
        JobKind::Identification,
        &[
            ("shape = \"tone\"", "shape = \"sine\""),
            ("shape = \"tone\"", "shape = \"ricker\""),
            ("cycles = 4.5", "cycles = 0.9"),
            ("cycles = 4.5", "cycles = 6.5"),
            ("cycles = 4.5", "cycels = 4.5"),
            ("element_width = 0.5e-3", "element_width = -0.1e-3"),
            ("element_width = 0.5e-3", "element_width = 0.9e-3"),
            ("element_width = 0.5e-3", "element_width = 0.5"),
            ("guided_wave_frequency = 0.2e6", "guided_wave_frequency = 0.0"),
            ("guided_wave_frequency = 0.2e6", "guided_wave_frequency = 0.2"),
            ("tilt = 0.001", "tilt = 1.0"),
            ("tilt = 0.001", "tilt = -0.2"),
            ("bidirectional = true", "bidirectional = \"both\""),
        ],
    );
}
