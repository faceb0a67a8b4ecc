//! Systematic errors: the section `[systematic]`.

use osteon_common::job::JobKind;

use super::{check, edited, parsed, refusal};

/// The job's last line, in place of which derivatives are computed.
const WITHOUT: &str = "sensitivities = false";

#[test]
fn systematic() {
    let with = |keys: &str| format!("sensitivities = true\n\n[systematic]\n{keys}");
    let edits = [
        "usual = 1",
        "bone_thickness = { spread = -1e-4 }",
        "bone_thickness = { distribution = \"uniform\" }",
        "bone_thickness = { spread = 0.1e-3, center = 4e-3 }",
        "bone_thickness = { spread = 4e-3 }",
        "tilt = { spread = 0.1, distribution = \"gamma\" }",
        "velocity_offset = { spread = 10, distribution = \"log_normal\" }",
        "porosity_gradient = { spread = 0.1 }",
        "speed = { spread = 1 }",
    ]
    .map(with);
    let edits: Vec<(&str, &str)> = edits.iter().map(|keys| (WITHOUT, keys.as_str())).collect();
    check("rejected_systematic", JobKind::Identification, &edits);
}

#[test]
fn it_needs_a_search_and_its_derivatives() {
    let thickness = "bone_thickness = { spread = 0.1e-3 }";
    let without = edited("", &format!("\n[systematic]\n{thickness}\n"));
    let refused = refusal(&without, JobKind::Identification);
    assert!(refused.contains("search.sensitivities is false; leave one of them out"), "{refused}");
    let with = edited(WITHOUT, &format!("[systematic]\n{thickness}\n"));
    let with = with.replace("method = \"simplex\"", "method = \"posterior\"");
    let refused = refusal(&with, JobKind::Identification);
    assert!(refused.contains("needs the best point of a search"), "{refused}");
}

#[test]
fn a_spread_of_0_takes_a_quantity_out_of_the_usual_ones() {
    let names = |keys: &str| {
        let job = parsed(&edited(WITHOUT, &format!("\n[systematic]\nusual = true\n{keys}")));
        let setup = job.start().setup(&job.setup);
        let uncertain = job.uncertain(&setup);
        uncertain.iter().map(|one| one.quantity.name()).collect::<Vec<_>>()
    };
    let all = names("");
    assert!(all.contains(&"tilt") && !all.contains(&"porosity_gradient"), "{all:?}");
    let without = names("tilt = { spread = 0 }");
    let expected: Vec<_> = all.iter().copied().filter(|name| *name != "tilt").collect();
    assert_eq!(without, expected);
}
