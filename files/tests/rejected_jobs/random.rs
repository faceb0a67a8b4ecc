//! Random quantities of the setup.

use osteon_common::job::JobKind;

use super::{check, edited, refusal};

#[test]
fn random() {
    let thickness = "standard_deviation = 0.2e-3\ndistribution = \"uniform\"";
    let tilt = "standard_deviation = 0.002\ndistribution = \"uniform\"";
    check(
        "rejected_random",
        JobKind::Identification,
        &[
            (thickness, "standard_deviation = 0"),
            (thickness, "standard_deviation = -0.2e-3"),
            (thickness, "standard_deviation = \"0.2e-3\""),
            (thickness, "distribution = \"uniform\""),
            (thickness, "standard_deviation = 0.2e-3\ndistribution = \"gamma\""),
            (thickness, "standard_deviation = 0.2e-3\nmean = 3e-3"),
            // Extreme realizations have no thickness, or no quality factor that is accepted.
            (thickness, "standard_deviation = 0.7e-3"),
            (thickness, "standard_deviation = 2e-3\ndistribution = \"uniform\""),
            ("standard_deviation = 2.0", "standard_deviation = 20.0"),
            (tilt, "standard_deviation = 0.05"),
            ("[random.probe_tilt]", "[random.source_tilt]"),
            ("[random.probe_tilt]", "[random.bone_density]"),
        ],
    );
}

#[test]
fn a_scatter_needs_a_mean() {
    let without =
        edited(", attenuation = { quality_factor = 15.0, reference_frequency = 0.8e6 }", "");
    assert_eq!(
        refusal(&without, JobKind::Identification),
        "1 error\n  line 60: random.bone_quality_factor: scatters about \
         layers.bone.attenuation.quality_factor, which is not given; give both"
    );
}

#[test]
fn a_log_normal_law_needs_a_mean_above_0() {
    let level = edited("tilt = 0.001\n", "");
    let law = "standard_deviation = 0.002\ndistribution = ";
    let text = level.replace(&format!("{law}\"uniform\""), &format!("{law}\"log_normal\""));
    assert_eq!(
        refusal(&text, JobKind::Identification),
        "1 error\n  line 69: random.probe_tilt.distribution: is \"log_normal\", which requires a mean \
         above 0, and probe.tilt is 0.0: set it to \"normal\" or \"uniform\""
    );
}

#[test]
fn the_hybrid_method_refuses_a_random_tilt() {
    let hybrid = edited("method = \"exact\"", "method = \"hybrid\"\n");
    let tilted = "\n[random.probe_tilt]\nstandard_deviation = 0.001\n";
    let refused = refusal(&format!("{hybrid}{tilted}"), JobKind::Identification);
    for part in ["random.probe_tilt", "probe.tilt", "hybrid"] {
        assert!(refused.contains(part), "{refused}");
    }
}
