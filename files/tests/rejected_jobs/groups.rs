//! What is done with groups together: the section `[groups]`.

use std::path::Path;

use osteon_common::job::JobKind;
use osteon_files::document::Format;
use osteon_files::job_file;

/// A job that is accepted.
const POOLED: &str = include_str!("../../../fuzz/corpus/jobs/pooled.toml");

fn refused(edits: &[(&str, &str)]) -> Option<String> {
    let edit = |text: String, (old, new): &(&str, &str)| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    };
    let text = edits.iter().fold(POOLED.to_owned(), edit);
    let read = job_file::parse(&text, Format::Toml, Path::new(""), JobKind::Identification);
    read.err().map(|refused| refused.to_string())
}

#[test]
fn groups_are_pooled_only_where_that_says_something() {
    assert_eq!(refused(&[]), None);
    let newton = "method = \"newton\"";
    let tibia = "tibia = [3990.0, 4020.5, 3975.0, 3961.0, 3981.0]\n";
    let few = "tibia = [3990.0, 4020.5]\n";
    let ungrouped = [
        ("[data.groups]\nleft", "[data]\nvelocities"),
        ("right = [3890.0, 4010.5, 3955.0, 3960.0, 3901.0]\n", ""),
        (tibia, ""),
    ];
    for (edits, expected) in [
        (&[("pooled = true", "pooled = 1")][..], "groups.pooled"),
        (&[("pooled = true", "pool = true")], "did you mean `pooled`?"),
        (&ungrouped, "groups.pooled: is true, and the data are not grouped"),
        (&[(tibia, "")], "2 of the groups have at least 5 velocities, or subjects"),
        (&[(tibia, few)], "fewer than 3 of them: leave it out"),
        (
            &[(newton, "method = \"newton\"\nsensitivities = false")],
            "pooling needs the derivatives",
        ),
        (&[(newton, "method = \"posterior\"")], "pooling needs the best point of a search"),
    ] {
        let found = refused(edits).unwrap();
        assert!(found.contains(expected), "{expected}\n{found}");
    }
}

#[test]
fn a_propagation_of_the_same_file_ignores_them() {
    let read = job_file::parse(POOLED, Format::Toml, Path::new(""), JobKind::Propagation);
    assert!(read.unwrap().groups.pooled);
}
