//! The layers, the probe, the rule of picking and the solver.

use osteon_common::job::JobKind;

use super::{BONE, check};

#[test]
fn setup() {
    check(
        "rejected_setup",
        JobKind::Identification,
        &[
            ("thickness = 11e-3", "thickness = 0.0"),
            ("density = 1010.0", "density = -1010.0"),
            ("density = 950.0", "density = nan"),
            ("sound_speed = 1450.0", "sound_speed = inf"),
            ("sound_speed = 1510.0", "sound_speed = \"1510\""),
            (BONE, "bone = { thickness = -3e-3 }"),
            (BONE, "bone = 3e-3"),
            ("quality_factor = 15.0", "quality_factor = 1.9"),
            ("quality_factor = 15.0, ", ""),
            ("reference_frequency = 0.8e6", "reference_frequency = 0"),
            ("reference_frequency = 0.8e6", "reference_frequency = 0.8"),
            ("method = \"exact\"", "method = \"hybrid\""),
            ("center_frequency = 0.9e6", "center_frequency = 0"),
            ("center_frequency = 0.9e6", "center_frequency = 1e12"),
            ("amplitude        = 99.0", "amplitude = 1e400"),
            ("x1 = 1e-3, x3 = 3e-3", "x1 = nan, x3 = 0.0"),
            ("x3 = 3e-3", "x3 = 11e-3"),
            ("x3 = 2.5e-3", "x3 = -2.5e-3"),
            ("first_x1 = 13e-3", "first_x1 = -5e-3"),
            ("first_x1 = 13e-3", "first_x1 = 1e-3"),
            ("pitch = 0.9e-3", "pitch = 0"),
            ("pitch = 0.9e-3", "pitch = 1e-30"),
            ("count = 12", "count = 2"),
            ("count = 12", "count = 65"),
            ("count = 12", "count = 12.0"),
            ("count = 12", "count = -1"),
            ("count = 12", "count = 99999999999999999999"),
            ("extremum = \"second\"", "extremum = \"third\""),
            ("threshold = 0.06", "threshold = 0"),
            ("threshold = 0.06", "threshold = 1.0"),
            ("method = \"exact\"", "method = \"spectral\"\ntime_step = 1e-8"),
            ("method = \"exact\"", "element_size = 0.5e-3"),
            ("method = \"exact\"", "method = \"exact\"\nelement_order = 4\ntime_step = 1e-8"),
            ("method = \"exact\"", "method = \"hybrid\"\nelement_size = 0.9e-6"),
            ("method = \"exact\"", "method = \"hybrid\"\nelement_size = 1.1e-2"),
            ("method = \"exact\"", "method = \"hybrid\"\nelement_order = 1"),
            ("method = \"exact\"", "method = \"hybrid\"\nelement_order = 13"),
            ("method = \"exact\"", "method = \"hybrid\"\nelement_order = 8.0"),
            ("method = \"exact\"", "method = \"hybrid\"\ntime_step = 0"),
            ("method = \"exact\"", "method = \"hybrid\"\ntime_step = inf"),
            ("method = \"exact\"", "method = \"hybrid\"\nelement_sise = 1e-3"),
            ("method = \"exact\"", "method = 1"),
            ("refinement = 1.5", "refinement = 0.4"),
            ("refinement = 1.5", "refinement = 17"),
        ],
    );
}
