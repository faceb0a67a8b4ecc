//! Measured decays.

use super::*;

#[test]
fn decays_of_the_data() {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    let moments = "mean = 3900.0\ncoefficient_of_variation = 0.03\n";
    let keys = "decay_spreading = \"line\"\ndecay_error = 0.2";
    let decays = |list: &str| format!("{given}\ndecays = {list}");
    let edits = [
        decays("[4.5, 4.6, 4.4]"),
        format!("{}\ndecay_spreading = \"lines\"\ndecay_error = -0.2", decays("[4.5, 4.6, 4.4]")),
        format!("{}\ndecay_spreading = 0\ndecay_error = \"no\"", decays("[4.5, 4.6, 4.4]")),
        format!("{given}\n{keys}"),
        format!("{}\n{keys}", decays("[4.5, 4.6]")),
        format!("{}\n{keys}", decays("[4.5, 4.6, 462.0]")),
        format!("{}\n{keys}", decays("[4.5, 4.6, \"x\"]")),
        format!("{}\n{keys}", decays("4.5")),
        format!("{}\n{keys}", decays("[4.5, 4.6, 4.4]")),
        format!("{given}\ndecay = \"decay\""),
        format!("{moments}decay = \"decay\"\ndecays = [4.5]"),
        "velocities = \"v.csv\"\ndecays = [4.5, 4.6]".to_owned(),
        "velocities = \"v.csv\"\ndecay = 3".to_owned(),
        "groups.a = { velocities = [3900.0, 4000.0], decays = [4.5, 4.6] }\ngroups.b = [3900.0, 4000.0]"
            .to_owned() + "\n" + keys,
        "groups.a = { velocities = [3900.0, 4000.0], decays = [4.5] }".to_owned() + "\n" + keys,
    ];
    let edits = edits.each_ref().map(|to| (given, to.as_str()));
    check("rejected_decays", JobKind::Identification, &edits);
}
