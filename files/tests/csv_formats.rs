//! Files of velocities as people have them: separators, decimal marks, units, encodings, gaps.

#[cfg(test)]
mod csv_job;

use osteon_common::job::Data;

use csv_job::{read_as, warnings};

/// Files as spreadsheets, instruments and people write them, each with the keys that it needs.
#[test]
fn files_as_people_have_them_are_read() {
    let expected = Some(Data::from_velocities(vec![3900.5, 4000.0]));
    let utf16 = |text: &str, order: fn(u16) -> [u8; 2]| -> Vec<u8> {
        text.encode_utf16().flat_map(order).collect()
    };
    let plain = "velocity\n3900.5\n4000\n";
    let with_mark = format!("\u{feff}{plain}");
    for (bytes, more) in [
        (
            b"patient;velocity\r\nA;3900,5\r\nB;4000\r\n".to_vec(),
            "separator = \";\"\ndecimal = \",\"",
        ),
        (b"sep=;\r\npatient;velocity\r\nA;3900,5\r\nB;4000\r\n".to_vec(), "decimal = \",\""),
        (b"\"sep=;\"\nvelocity;x\n3900.5;1\n4000;\n".to_vec(), ""),
        (b"velocity\tx\n3900.5\t\n4000\t\n".to_vec(), "separator = \"tab\""),
        (b"x\tvelocity\n\t3900.5\n\t4000\n".to_vec(), "separator = \"\\t\""),
        (b"x|velocity\n1|3900.5\n|4000\n".to_vec(), "separator = \"|\""),
        (b"\"patient\",\"velocity\"\n\"A\",\"3900,5\"\nB,\"4000,0\"\n".to_vec(), "decimal = \",\""),
        (b"FAS (km/s)\n3.9005\n4\n".to_vec(), "column = \"FAS (km/s)\"\nunit = \"km/s\""),
        (
            b"v;x\n3,9005;\n4;\n".to_vec(),
            "separator = \";\"\ndecimal = \",\"\ncolumn = \"v\"\nunit = \"mm/\u{b5}s\"",
        ),
        (b"velocity\nNA\n3900.5\n-999\n4000\n-\n".to_vec(), "missing = [\"NA\", \"-999\", \"-\"]"),
        (b"a,velocity\n1,3900.5\n2,\n3,4000\n".to_vec(), "missing = [\"\"]"),
        (b"a,velocity\n1,3900.5\n,\n3,4000,,\n,\n".to_vec(), ""),
        (utf16(&with_mark, u16::to_le_bytes), ""),
        (utf16(&with_mark, u16::to_be_bytes), ""),
        (utf16(plain, u16::to_le_bytes), "encoding = \"utf-16le\""),
        (b"Gr\xf6\xdfe,velocity\nM\xfcller,3900.5\nx,4000\n".to_vec(), "encoding = \"latin1\""),
        (b"Device,X1\nvelocity,x\n3900.5,1\n4000,2\n".to_vec(), "skip_lines = 1"),
        (b"velocity\n1\n\nvelocity,x\n3900.5,1\n4000,2\n".to_vec(), "header_line = 4"),
        (b"1,3900.5\n2,4000\n".to_vec(), "header_line = 0\ncolumn = \"2\""),
        (b"id velocity\n 1   3900.5\n 2   4000\n".to_vec(), "separator = \"space\""),
        (b"the id  velocity\n1  3900.5\n2  4000\n".to_vec(), "separator = \"spaces\""),
        (with_mark.clone().into_bytes(), "encoding = \"windows-1252\""),
    ] {
        let shown = String::from_utf8_lossy(&bytes);
        assert_eq!(read_as(&bytes, more), Ok(expected.clone()), "{shown:?} with {more}");
    }
}

/// What `osteon pick` writes: the root mean square of the standard errors is the repeatability, and rows without a
/// velocity are left out.
#[test]
fn standard_errors_are_the_repeatability() {
    let picked = b"# picking.extremum = \"first\"\n# picking.threshold = 0.05\n\
        velocity,standard_error,quality,failure\n3900.5,3.0,0.9,\n,,0.0,too_noisy\n4000.0,4.0,0.8,\n";
    let keys = "error_column = \"standard_error\"\nmissing = [\"\"]";
    let expected =
        Data { repeatability: 12.5_f64.sqrt(), ..Data::from_velocities(vec![3900.5, 4000.0]) };
    assert_eq!(read_as(picked, keys), Ok(Some(expected)));
    // They are in the unit of the velocities.
    let in_km = b"v,e\n3.9005,0.003\n4,0.004\n";
    let data = read_as(in_km, "column = \"v\"\nunit = \"km/s\"\nerror_column = \"e\"");
    assert!((data.unwrap().unwrap().repeatability / 12.5_f64.sqrt() - 1.0).abs() < 1e-15);
    for (text, more, expected) in [
        ("velocity,e\n3900,-1\n4000,1\n", "", "e is \"-1\"; it must be the standard error"),
        ("velocity,e\n3900,\n4000,1\n", "", "e is \"\"; it must be the standard error"),
        (
            "velocity,e\n3900,60\n4000,90\n",
            "",
            "data.error_column: has errors whose root mean square is 76.4",
        ),
        ("velocity,e\n3900,1\n4000,1\n", "repeatability = 1.0", "leave one of them out"),
        ("velocity\n3900\n4000\n", "", "no column `e`"),
    ] {
        let found = read_as(text.as_bytes(), &format!("error_column = \"e\"\n{more}"));
        let refused = found.unwrap_err();
        assert!(refused.contains(expected), "{text} {more}: {refused}");
    }
}

/// A model whose signals are picked otherwise than the measured ones is warned of.
#[test]
fn another_criterion_of_picking_is_told() {
    let picked =
        "# picking.extremum = \"first\"\n# picking.threshold = 0.05\nvelocity\n3900\n4000\n";
    let found = warnings(picked, "");
    let expected =
        "picking: has extremum = \"second\", threshold = 0.06, and the file of velocities says";
    assert!(found.iter().any(|one| one.contains(expected)), "{found:?}");
    let same = picked.replace("first", "second").replace("0.05", "0.06");
    assert!(warnings(&same, "").iter().all(|one| !one.contains("picking")));
}

#[test]
fn several_columns_name_a_group_together() {
    let text = "patient,site,velocity\nA,left,3900\nB,left,3910\nA,right,3920\nA,left,3930\n";
    let data = read_as(text.as_bytes(), "group = [\"patient\", \"site\"]").unwrap().unwrap();
    let names: Vec<_> = data.groups().iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["A / left", "B / left", "A / right"]);
    assert_eq!(data.groups()[0].velocities, [3900.0, 3930.0]);
    let check = |key: &str, expected: &str| {
        let message = read_as(text.as_bytes(), key).unwrap_err();
        assert!(message.contains(expected), "{message}");
    };
    check("group = []", "data.group: is an empty list; it must be the name of a column");
    check("group = [1]", "data.group[0]: is 1; it must be a text");
    check("group = [\"patient\", \"side\"]", "no column `side`; the header has");
}

#[test]
fn what_is_left_out_is_said() {
    let said = |text: &str| -> Vec<String> {
        let all = warnings(text, "missing = [\"NA\"]\ngroup = \"g\"");
        all.into_iter().filter(|warning| warning.contains("data.missing")).collect()
    };
    let rows = "g,velocity\nA,3900\nA,3910\nA,3935\nA,3960\nA,3940\n";
    assert!(said(rows).is_empty());
    let one = said(&format!("{rows}A,NA\n"));
    assert_eq!(one, ["data.missing: a row has a missing value and is left out"]);
    let two = said(&format!("{rows}A,NA\nNA,3900\n"));
    assert_eq!(two, ["data.missing: 2 rows have a missing value and are left out"]);
}

#[test]
fn a_refusal_names_the_key_that_reads_the_file() {
    let check = |bytes: &[u8], more: &str, expected: &str| {
        let message = read_as(bytes, more).unwrap_err();
        assert!(message.contains(expected), "{message}");
    };
    check(b"a;velocity\n1;3900\n", "", "this reads it: [data] separator = \";\"");
    check(b"a\tvelocity\n1\t3900\n", "", "[data] separator = \"tab\"");
    check(b"a;velocity\n1;3900,5\n", "separator = \";\"", "[data] decimal = \",\"");
    check(b"a,FAS Velocity\n1,3900\n", "", "[data] column = \"FAS Velocity\"");
    check(b"velocity\n3900\nn/a\n", "", "[data] missing = [\"n/a\"]");
    check(b"velocity\n3900\n\xfc\n", "", "[data] encoding = \"windows-1252\"");
    check(
        b"v\0e\0l\0\n\0",
        "",
        "[data] encoding = \"windows-1252\" (Western Europe, Latin-1), \"utf-16le\"",
    );
    check(b"velocity\n3900,5\n", "", "this reads it: [data] separator = \";\", decimal = \",\"");
    let ok = b"velocity\n3900\n3910\n";
    check(
        ok,
        "unit = \"cm/s\"",
        "data.unit: is \"cm/s\"; it must be \"m/s\" or \"km/s\" or \"mm/us\"",
    );
    check(
        ok,
        "separator = \";;\"",
        "data.separator: is \";;\"; it must be \",\" or \";\" or \"tab\" or \"|\"",
    );
    check(ok, "decimal = \"'\"", "data.decimal: is \"'\"; it must be \".\" or \",\"");
    check(
        ok,
        "encoding = \"klingon\"",
        "data.encoding: is \"klingon\"; it must be an encoding's name",
    );
    check(
        ok,
        "missing = \"NA\"",
        "data.missing: is the string \"NA\"; it must be a list of at most 20 texts",
    );
    check(ok, "skip_lines = -1", "data.skip_lines: is -1; it must be");
    check(ok, "header_line = 1.5", "data.header_line: is 1.5; it must be");
    check(ok, "skip_lines = 1\nheader_line = 2", "leave one of them out");
    check(ok, "column = \"v\"", "no column `v`; the header has `velocity`");
}
