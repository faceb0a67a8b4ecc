//! The pulse, the width of source and receivers, and the tilt.

use osteon_common::job::JobKind;

use super::check;

#[test]
fn probe() {
    check(
        "rejected_probe",
        JobKind::Identification,
        &[
            ("{ tone = 4.5 }", "\"sine\""),
            ("{ tone = 4.5 }", "4.5"),
            ("{ tone = 4.5 }", "{}"),
            ("tone = 4.5", "tone = 0.9"),
            ("tone = 4.5", "tone = 6.5"),
            ("tone = 4.5", "tune = 4.5"),
            ("tone = 4.5", "tone = 4.5, step = 1e-8"),
            ("tone = 4.5", "tone = 4.5, file = \"pulse.csv\""),
            ("tone = 4.5", "file = \"there_is_none.csv\""),
            ("tone = 4.5", "samples = [0.0, 1.0]"),
            ("tone = 4.5", "step = 1e-8, samples = [0.0, 1.0]"),
            ("tone = 4.5", "step = 1e-8, samples = [0, 0, 0, 0, 0, 0, 0, 0]"),
            ("tone = 4.5", "step = 1e-8, samples = [0, 1, 0, -1, 0, 1, 0, -1]"),
            ("tone = 4.5", "step = 1e-6, samples = [0, 1, 3, 6, 9, 6, 3, 1]"),
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
