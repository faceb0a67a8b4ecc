//! Kinds of files of velocities: what `init` takes, what a job then reads, and what both refuse, with which
//! words.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use osteon_files::init;
use support::{refuses, refuses_bytes, takes, takes_bytes};

#[path = "support/first_jobs.rs"]
mod support;

/// Velocities of the files in `files/`, m/s.
const VELOCITIES: [f64; 6] = [3900.5, 3951.0, 4000.0, 3875.25, 3930.0, 3988.0];

/// Rows below a header, with velocities written by `cell`.
fn rows(header: &str, cell: impl Fn(usize, f64) -> String) -> String {
    let rows = VELOCITIES.iter().enumerate().map(|(place, velocity)| cell(place, *velocity) + "\n");
    format!("{header}\n{}", rows.collect::<String>())
}

#[test]
fn a_header_decides_with_the_size_of_the_numbers() {
    for name in ["SV (m/s)", "c [m/s]", "speed_m_per_s", "SOS", "v", "result (m s-1)", "音速(m/s)"]
    {
        takes(&rows(&format!("id,{name}"), |i, v| format!("{i},{v}")), &VELOCITIES, "column 2");
    }
    for (header, cell, expected) in [
        ("id,distance_mm,tof_us", "20.0,5.1", "write their quotient into a column `velocity`"),
        ("specimen,E (MPa)", "4850", "the header has `specimen`, `E (MPa)`"),
        ("id,time (us)", "5.1", "no column is clearly"),
        ("id,v", "3.9", "the median of the column `v` is 3.9"),
        ("id,velocity (ft/s)", "12800", "another unit of velocity than m/s"),
        ("id,velocity (km/s)", "3900.5", "the median 3900.5 where its unit is km/s"),
        ("id,velocity (m/s)", "3.90052", "[data] unit = \"m/s\" or \"km/s\""),
        ("id,Vp (m/s),Vs (m/s)", "3900,1950", "several columns may be the velocities: `Vp (m/s)`"),
        ("id,velocity,velocity", "3900,3950", "has the column `velocity` twice"),
    ] {
        refuses_bytes(rows(header, |i, _| format!("{i},{cell}")).as_bytes(), expected);
    }
}

#[test]
fn numbers_are_read_as_people_write_them() {
    for (separator, cell) in [
        (",", (|v| format!("\"{},{:06.2}\"", v as u32 / 1000, v % 1000.0)) as fn(f64) -> String),
        (";", |v| format!("{}'{:06.2}", v as u32 / 1000, v % 1000.0)),
        (";", |v| {
            format!("{}.{:06.2}", v as u32 / 1000, v % 1000.0)
                .replacen('.', "_", 1)
                .replace('.', ",")
                .replace('_', ".")
        }),
        (";", |v| format!("{}\u{a0}{:06.2}", v as u32 / 1000, v % 1000.0).replace('.', ",")),
        (",", |v| format!("{v} ± 12")),
        (",", |v| format!("{v} m/s")),
        (",", |v| format!("{:.5} km/s", v / 1000.0)),
        (",", |v| format!("{:.6}D+03", v / 1000.0)),
        (",", |v| format!("\"=\"\"{v}\"\"\"")),
        ("\t", |v| format!("'{v}")),
    ] {
        let text =
            rows(&format!("id{separator}velocity"), |i, v| format!("{i}{separator}{}", cell(v)));
        takes(&text, &VELOCITIES, "column 2 \"velocity\"");
    }
    refuses_bytes(
        b"velocity\n3900.5\n3. Sep\n3910\n3920\n",
        "line 3: the column `velocity` has \"3. Sep\"",
    );
    refuses_bytes(b"id;velocity\n1;3900,5\n2;3910.25\n", "another decimal mark than in line 2");
}

#[test]
fn what_is_no_measurement_is_left_out_and_said() {
    let table = rows("id,velocity", |i, v| format!("{i},{v}"));
    let mean = VELOCITIES.iter().sum::<f64>() / 6.0;
    takes(
        &format!("{table}Mean,{mean:.1}\nSD,50.1\nN,6\n"),
        &VELOCITIES,
        "3 rows left out: line 8 \"Mean\", line 9 \"SD\", line 10 \"N\"",
    );
    takes(&format!("{table}\nMaximum,4000\nMinimum,3875.25\n"), &VELOCITIES, "line 9 \"Maximum\"");
    takes(&format!("{table}id,velocity\n"), &VELOCITIES, "line 8 (the header again)");
    takes(
        &format!("{table}\nEnd of data\n"),
        &VELOCITIES,
        "1 row left out: line 9 \"End of data\"",
    );
    takes(&format!("{table},{mean:.1}\n"), &VELOCITIES, "1 row left out: line 8 \"3940.8\"");
    refuses_bytes(
        format!("{table}Mean,3890.0\n").as_bytes(),
        "line 8: the velocity of \"Mean\" is \"3890.0\", and the other rows give 3940.8",
    );
    // Somebody called Max is no maximum.
    let max = table.replace("\n2,", "\nMax,");
    takes(
        &max.replace("4000", "3950.5"),
        &[3900.5, 3951.0, 3950.5, 3875.25, 3930.0, 3988.0],
        "6 velocities",
    );
    takes(&max, &VELOCITIES, "6 velocities");
    // Nobody can know whether somebody is called so, if another has the same value.
    refuses_bytes(
        table.replace("\n1,3951", "\nMax,4000").as_bytes(),
        "the velocity of \"Max\" is \"4000\"",
    );
}

#[test]
fn lines_above_the_table_are_no_part_of_it() {
    for above in [
        "% Device,A100\n% Rate,5\n",
        "[header]\n\npulse average=1499.92\n[data]\n",
        "Device: X1\nOperator: A\n\n",
        "Burst length,4000\nAverages,2000\n",
        "; Device X1\n",
    ] {
        let text = above.to_owned() + &rows("id,SV (m/s)", |i, v| format!("{i},{v}"));
        let line = above.lines().count() + 1;
        takes(&text, &VELOCITIES, &format!("header_line = {line}\n"));
    }
    takes(&rows("# id velocity", |i, v| format!("{i} {v}")), &VELOCITIES, "separator = \"space\"");
    refuses_bytes(b"1,3900.5\n2,3951.0\n", "[data] header_line = 0, column = \"1\"");
    let second = rows("id,speed", |i, v| format!("{i},{v}"));
    let two = rows("id,velocity", |i, v| format!("{i},{v}")) + "\n" + &second;
    refuses(&two, "line 9: has names of columns again, others than in line 1");
}

#[test]
fn rows_are_those_of_r_and_of_programs_that_end_lines_with_a_separator() {
    let quoted = rows("\"thickness_mm\",\"velocity\"", |i, v| format!("\"{}\",4.41,{v}", i + 1));
    takes(&quoted, &VELOCITIES, "column 3 \"velocity\"");
    takes(&rows("velocity,patient", |i, v| format!("{v},P{i},")), &VELOCITIES, "column 1");
    refuses_bytes(
        rows("id,velocity", |i, v| format!("{i},{v},5")).as_bytes(),
        "the number of fields is 3",
    );
}

#[test]
fn files_that_are_no_text_are_read_or_named() {
    let column = |place: usize| format!("{} velocities from line", place);
    takes_bytes(
        include_bytes!("files/velocities.xlsx"),
        &VELOCITIES,
        "sheet \"Data\" of an Excel workbook, header in line 3",
    );
    takes_bytes(include_bytes!("files/velocities.mat"), &VELOCITIES, "column 1 \"sos\"");
    takes_bytes(include_bytes!("files/structure.mat"), &VELOCITIES, "column 1 \"bone.velocity\"");
    takes_bytes(include_bytes!("files/velocities-7.3.mat"), &VELOCITIES, "column 1 \"velocity\"");
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(rows("velocity", |_, v| v.to_string()).as_bytes()).unwrap();
    takes_bytes(&packed.finish().unwrap(), &VELOCITIES, &column(6));
    for (bytes, expected) in [
        (&b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"[..], "save it as .xlsx or CSV"),
        (b"PK\x03\x04....", "a ZIP archive, and no Excel workbook"),
        (b"<html><table>", "a web page, or a table saved as one"),
        (b"{\"velocity\":[3900]}", "[data] velocities = [3900.0, …]"),
        (b"version https://git-lfs.github.com/spec/v1\n", "`git lfs pull` gets it"),
        (b"\x1f\x8b\x08\0\0", "a gzip file that cannot be read"),
        (b"velocity\n39\x0012\n", "line 2: has a character 0"),
    ] {
        refuses_bytes(bytes, expected);
    }
}

#[test]
fn what_unpacks_to_too_much_is_refused_before() {
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    let zeros = vec![b'1'; 1 << 20];
    for _ in 0..65 {
        packed.write_all(&zeros).unwrap();
    }
    refuses_bytes(&packed.finish().unwrap(), "is longer than 67108864 bytes");
}

#[test]
fn names_that_look_alike_are_one_or_pointed_out() {
    let name = |i: usize| ["Mu\u{308}ller", "M\u{fc}ller"][i % 2];
    let text = rows("velocity\u{200b},patient", |i, v| format!("{v},{}", name(i)));
    takes(&text, &VELOCITIES, "characters without width are not read");
    let text = rows("velocity,group", |i, v| format!("{v},{}", ["P1", "p1"][i % 2]));
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("v.csv");
    std::fs::write(&path, text).unwrap();
    let said = init::of_csv(&path, "v.csv").unwrap().understood.join("\n");
    assert!(said.contains("\"P1\" and \"p1\" differ only by case"), "{said}");
}

#[test]
fn old_encodings_are_found_by_the_word_of_velocities() {
    for (encoding, name) in [
        (encoding_rs::SHIFT_JIS, "音速(m/s)"),
        (encoding_rs::GBK, "声速(m/s)"),
        (encoding_rs::WINDOWS_1251, "скорость (м/с)"),
        (encoding_rs::WINDOWS_1252, "célérité (m/s)"),
    ] {
        let text = rows(&format!("id,{name}"), |i, v| format!("{i},{v}"));
        let bytes = encoding.encode(&text).0.into_owned();
        let key = format!("encoding = \"{}\"", encoding.name().to_lowercase());
        takes_bytes(&bytes, &VELOCITIES, &key);
    }
}
