//! First job files, for CSV files as people have them: what is understood, and that the job reads the
//! same velocities.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

use osteon_common::job::JobKind;
use osteon_files::document::Format;
use osteon_files::{init, job_file};

/// Twelve velocities, m/s, of three patients.
const VELOCITIES: [f64; 12] = [
    3900.5, 3951.0, 4000.0, 3875.25, 3930.0, 3988.0, 4010.5, 3895.0, 3942.5, 3969.0, 3921.0,
    3958.75,
];

/// A file with a row of `cell` for each velocity.
fn file(header: &str, end: &str, cell: impl Fn(usize, f64) -> String) -> Vec<u8> {
    let rows = VELOCITIES.iter().enumerate().map(|(i, velocity)| cell(i, *velocity) + end);
    format!("{header}{end}{}", rows.collect::<String>()).into_bytes()
}

fn german(number: f64) -> String {
    number.to_string().replace('.', ",")
}

/// Returns the lines of `[data]` below the file's name, and what was said, after reading the job.
fn understood(bytes: &[u8]) -> Result<(Vec<String>, Vec<String>), String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("v.csv");
    std::fs::write(&path, bytes).unwrap();
    let first = match init::of_csv(&path, "v.csv") {
        Ok(first) => first,
        Err(error) => return Err(error.to_string().replace(&*path.to_string_lossy(), "CSV")),
    };
    let identification = JobKind::Identification;
    let job = job_file::parse(&first.text, Format::Toml, directory.path(), identification);
    let data = job.map_err(|error| error.to_string())?.data.unwrap();
    let mut velocities: Vec<f64> =
        (0..data.sets()).flat_map(|set| data.set(set).unwrap().velocities.to_vec()).collect();
    let mut expected = VELOCITIES.to_vec();
    velocities.sort_by(f64::total_cmp);
    expected.sort_by(f64::total_cmp);
    assert_eq!(velocities, expected, "{}", first.text);
    let lines = first.text.lines().skip_while(|line| !line.starts_with("velocities")).skip(1);
    Ok((lines.take_while(|line| !line.is_empty()).map(str::to_owned).collect(), first.understood))
}

/// A file of `osteon pick`: standard errors are named, what was not picked is left out, and the criterion becomes
/// that of the job.
#[test]
fn picked_velocities_are_understood() {
    let mut picked = b"# picking.extremum = \"second\"\n# picking.threshold = 0.05\n".to_vec();
    picked.extend(file("velocity,standard_error,quality,failure", "\n", |i, v| match i {
        3 => format!(",,0.0,too_noisy\n{v},3.5,0.9,"),
        _ => format!("{v},2.5,0.9,"),
    }));
    let (lines, sentences) = understood(&picked).unwrap();
    assert_eq!(lines, ["missing = [\"\"]", "error_column = \"standard_error\""]);
    assert!(sentences.join("\n").contains("standard errors in the column"), "{sentences:?}");
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("v.csv");
    std::fs::write(&path, picked).unwrap();
    let job = init::of_csv(&path, "v.csv").unwrap().text;
    assert!(job.contains("[picking]\nextremum = \"second\"\nthreshold = 0.05\n"), "{job}");
}

#[test]
fn files_as_people_have_them_are_understood() {
    let check = |bytes: &[u8], keys: &[&str], said: &str| {
        let (lines, sentences) = understood(bytes).unwrap();
        assert_eq!(lines, keys, "{}", String::from_utf8_lossy(bytes));
        assert!(sentences.join("\n").contains(said), "{sentences:?}");
    };
    let plain = file("velocity", "\n", |_, v| v.to_string());
    check(
        &plain,
        &[],
        "header in line 1, decimal points\n12 velocities from line 2 to 13, column 1 \"velocity\"",
    );
    let marked =
        [b"\xef\xbb\xbf".to_vec(), file("velocity", "\r\n", |_, v| v.to_string())].concat();
    check(&marked, &[], "12 velocities");
    let excel = file("Patient;Velocity (m/s)", "\r\n", |i, v| format!("P{};{}", i % 6, german(v)));
    let keys = [
        "column = \"Velocity (m/s)\"",
        "separator = \";\"",
        "decimal = \",\"",
        "subject = \"Patient\"",
    ];
    check(&excel, &keys, "6 subjects in the column \"Patient\"");
    let one_column = file("velocity", "\r\n", |_, v| format!("{:.2}", v).replace('.', ","));
    check(&one_column, &["separator = \";\"", "decimal = \",\""], "decimal commas");
    let above =
        [b"sep=;\r\n".to_vec(), file("velocity;x", "\r\n", |i, v| format!("{v};{i}"))].concat();
    check(&above, &[], "fields separated by semicolons");
    let tabs = file("id\tspeed", "\n", |i, v| format!("{i}\t{v}"));
    check(&tabs, &["column = \"speed\"", "separator = \"tab\""], "fields separated by tabs");
    let km = file("FAS_velocity", "\n", |_, v| format!("{}", v / 1000.0));
    check(
        &km,
        &["column = \"FAS_velocity\"", "unit = \"km/s\""],
        "unit km/s, a guess from their size",
    );
    let named = file("v [mm/\u{b5}s]", "\n", |_, v| format!("{}", v / 1000.0));
    check(&named, &["column = \"v [mm/\u{b5}s]\"", "unit = \"mm/us\""], "unit mm/us)");
    let groups = file("patient,velocity", "\n", |i, v| format!("{},{v}", ["A", "B"][i % 2]));
    check(
        &groups,
        &["group = \"patient\""],
        "2 groups in the column \"patient\": a search for each",
    );
    let both = file("group,subject,velocity", "\n", |i, v| format!("g{},s{},{v}", i % 2, i % 6));
    check(&both, &["group = \"group\"", "subject = \"subject\""], "6 subjects");
    let mut gaps = file("velocity,site", "\n", |i, v| format!("{v},{}", i + 100));
    gaps.extend(b"NA,1\n-999,2\n,3\n-,4\n0,5\n");
    let keys = ["missing = [\"\", \"-\", \"-999\", \"0\", \"NA\"]"];
    check(&gaps, &keys, "5 rows are left out: the velocity is \"\" or \"-\" or");
    let units = file("velocity,n\nm/s,1", "\n", |i, v| format!("{v},{i}"));
    check(&units, &[], "1 row left out: line 2 (units)");
    let quoted = file("\"\",\"velocity\"", "\n", |i, v| format!("\"{i}\",\"{}\"", german(v)));
    check(&quoted, &["decimal = \",\""], "fields separated by commas, decimal commas");
    let latin: Vec<u8> =
        [b"Gr\xf6\xdfe;velocity\n".to_vec(), file("", "", |i, v| format!("{i};{v}\n"))].concat();
    check(&latin, &["separator = \";\"", "encoding = \"windows-1252\""], "windows-1252");
    let wide: Vec<u8> =
        String::from_utf8(plain).unwrap().encode_utf16().flat_map(u16::to_le_bytes).collect();
    check(&wide, &["encoding = \"utf-16le\""], "utf-16le");
    check(&[b"\xff\xfe".to_vec(), wide].concat(), &[], "12 velocities");
}

#[test]
fn what_is_not_understood_is_said() {
    let check = |text: &str, expected: &str| {
        let message = understood(text.as_bytes()).unwrap_err();
        assert!(message.contains(expected), "{message}");
    };
    check("", "CSV: has no header; its first line must name the columns");
    check(
        "3900\n3910\n",
        "line 1: begins with numbers, and no line above names the columns: write the names above them",
    );
    check(
        "a,b\nx,y\nz,w\n",
        "no column is clearly that of the velocities; the header has `a`, `b`",
    );
    check("a,b\n3900,3950\n3910,3940\n", "no column is clearly that of the velocities");
    check(
        "velocity\n39\n40\n41\n",
        "the median of the column `velocity` is 40; velocities of bone are",
    );
    check(
        "velocity\n3900\nNA\nNA\n",
        "line 3: the column `velocity` has \"NA\", which is no number",
    );
}

#[test]
fn a_job_without_data_lacks_only_their_file() {
    let directory = tempfile::tempdir().unwrap();
    let read = |kind| job_file::parse(&init::without_data(), Format::Toml, directory.path(), kind);
    assert!(read(JobKind::Propagation).is_ok());
    let message = read(JobKind::Identification).unwrap_err().to_string();
    assert!(message.starts_with("1 error") && message.contains("velocities.csv"), "{message}");
}
