//! Files of measured velocities: what is read, and what is refused with which words.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

use std::fmt::Write as _;

use osteon_common::document::Format;
use osteon_common::job::{Data, JobKind};
use osteon_common::job_file;

/// What the job of `files/job.toml` gets from a file with these bytes.
fn read(bytes: &[u8]) -> Result<Option<Data>, String> {
    let directory = tempfile::tempdir().unwrap();
    std::fs::create_dir(directory.path().join("data")).unwrap();
    std::fs::write(directory.path().join("data/v.csv"), bytes).unwrap();
    let given = "velocities = [3900.5, 4000, 3950.25]";
    let text = include_str!("files/job.toml").replace(given, "velocities = \"data/v.csv\"");
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
