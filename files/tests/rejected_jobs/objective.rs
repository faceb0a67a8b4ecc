//! Objectives that the data do not allow.

use osteon_common::job::JobKind;

use super::{edited, refusal};

#[test]
fn weights_need_the_noise_of_the_data() {
    let moments = edited(
        "velocities = [3900.5, 4000, 3950.25]",
        "mean = 3900.0\ncoefficient_of_variation = 0.03",
    );
    let text = moments.replace("kind = \"moments\"", "kind = \"chi_square\"");
    let refused = refusal(&text, JobKind::Identification);
    for part in ["objective.kind", "data.count", "data.velocities", "\"moments\""] {
        assert!(refused.contains(part), "{refused}");
    }
    let counted = text.replace("mean = 3900.0\n", "mean = 3900.0\ncount = 2\n");
    assert_eq!(refusal(&counted, JobKind::Identification), "ACCEPTED");
    assert_eq!(refusal(&text, JobKind::Propagation), "ACCEPTED");
}
