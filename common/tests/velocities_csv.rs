//! Files of measured velocities: what is read, and what is refused with which words.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

use std::fmt::Write as _;

use osteon_common::document::Format;
use osteon_common::job::{Data, Group, JobKind, NoVariation};
use osteon_common::job_file;

/// What the job of `files/job.toml` gets from a file with these bytes.
fn read(bytes: &[u8]) -> Result<Option<Data>, String> {
    read_as(bytes, "")
}

/// The same with more keys in `[data]`.
fn read_as(bytes: &[u8], more: &str) -> Result<Option<Data>, String> {
    let directory = tempfile::tempdir().unwrap();
    std::fs::create_dir(directory.path().join("data")).unwrap();
    std::fs::write(directory.path().join("data/v.csv"), bytes).unwrap();
    let given = "velocities = [3900.5, 4000, 3950.25]";
    let text = include_str!("files/job.toml")
        .replace(given, &format!("velocities = \"data/v.csv\"\n{more}"));
    match job_file::parse(&text, Format::Toml, directory.path(), JobKind::Identification) {
        Ok(job) => Ok(job.data),
        Err(error) => Err(error.to_string().replace(&*directory.path().to_string_lossy(), "DIR")),
    }
}

#[test]
fn what_is_read() {
    let expected = Some(Data::Velocities(vec![3900.5, 4000.0]));
    for text in [
        "velocity\n3900.5\n4000\n",
        "velocity\r\n3900.5\r\n4e3",
        "\u{feff}velocity\n3900.5\n4000\n",
        "# synthetic\n\nvelocity\n3900.5\n# between\n\n4000\n\n",
        "index,velocity,failure\n0,3900.5,\n1,4000.0,\n",
        "\"name\", \"velocity\"\n\"a, \"\"b\"\"\", \"3900.5\"\nc,  4000 \n",
        " velocity , x\n3900.5,1\n4000,\n",
    ] {
        assert_eq!(read(text.as_bytes()), Ok(expected.clone()), "{text}");
    }
}

#[test]
fn groups_stand_in_the_order_in_which_they_begin() {
    let text = "bone,velocity\nleft,3900.5\nright,4000\n\"left\",3950\nright,4010\n";
    let groups = [("left", [3900.5, 3950.0]), ("right", [4000.0, 4010.0])];
    let group = |(name, velocities): (&str, [f64; 2])| Group {
        name: name.to_owned(),
        velocities: velocities.to_vec(),
    };
    let expected = Data::Groups(groups.map(group).to_vec());
    assert_eq!(read_as(text.as_bytes(), "group = \"bone\""), Ok(Some(expected)));
}

#[test]
fn a_group_of_one_velocity_is_a_group() {
    let read = read_as(b"bone,velocity\na,1\na,2\nb,3\nc,4\nc,4\n", "group = \"bone\"");
    let Ok(Some(Data::Groups(groups))) = read else { panic!("{read:?}") };
    let unsearched: Vec<_> = groups.iter().map(Group::no_variation).collect();
    let equal = NoVariation::AllEqual { count: 2, velocity: 4.0 };
    assert_eq!(unsearched, [None, Some(NoVariation::OneVelocity), Some(equal)]);
}

#[test]
fn groups_that_are_refused() {
    let check = |text: &str, expected: &str| {
        let message = read_as(text.as_bytes(), "group = \"bone\"").unwrap_err();
        assert!(message.contains(expected), "{message}");
    };
    check("site,velocity\na,1\na,2\n", "no column `bone`; the header has `site`, `velocity`");
    check("bone,velocity,bone\na,1,b\n", "the header has the column `bone` twice");
    check("bone,velocity\na,1\n,2\n", "line 3: bone is empty; it must name the group");
    let none = "no group of the column `bone` has two velocities that differ";
    check("bone,velocity\na,1\nb,3\nb,3\n", none);
    let many: String = (0..1001).map(|i| format!("g{i},1\n")).collect();
    check(&format!("bone,velocity\n{many}"), "has more than 1000 groups");
}

#[test]
fn what_is_refused() {
    let many_bad = format!("velocity\n{}", "x\n".repeat(30));
    let long_field = format!("velocity\n{}\n1\n", "y".repeat(200));
    let mut page = String::new();
    for text in [
        "",
        "# only a comment\n",
        "3900.5\n4000.0\n",
        "speed,site\n3900.5,a\n",
        "Velocity\n3900.5\n",
        "velocity;site\n3900.5;a\n",
        "velocity,velocity\n1,2\n",
        "velocity\n",
        "velocity\n3900.5\n",
        "velocity\n3900.5\n0\n4000\n",
        "velocity\n3900.5\n-4000\n",
        "velocity\n3900.5\nnan\ninf\n1e999\n",
        "velocity\n3900.5\n4,000\n",
        "index,velocity\n0,3900.5\n1\n2,4000,\n",
        "index,velocity,failure\n0,3900.5,\n1,,no_arrival\n2,3950.0,\n",
        "velocity\n3900.5\nfast\n",
        "velocity\n3900.5\n\"4000\n",
        "velocity\n39\"00.5\n\"4000\"1\n",
        "velocity\n3900.5\n3900.5\n",
        &many_bad,
        &long_field,
    ] {
        let message = read(text.as_bytes()).unwrap_err();
        let shown: String = text.chars().take(60).collect();
        writeln!(page, "{}\n=> {message}\n", shown.trim_end().replace('\n', "\\n")).unwrap();
    }
    writeln!(page, "(not UTF-8)\n=> {}", read(b"velocity\n\xff\n").unwrap_err()).unwrap();
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!("rejected_csv", page);
    });
}
