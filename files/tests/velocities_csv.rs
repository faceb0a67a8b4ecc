//! Files of measured velocities: what is read, and what is refused with which words.

#[cfg(test)]
mod csv_job;

use std::fmt::Write as _;

use osteon_common::job::{Data, Group, NoVariation};
use osteon_common::observables::Observable;

use csv_job::{read_as, warnings};

/// Same as [`read_as`], without more keys.
fn read(bytes: &[u8]) -> Result<Option<Data>, String> {
    read_as(bytes, "")
}

#[test]
fn what_is_read() {
    let expected = Some(Data::from_velocities(vec![3900.5, 4000.0]));
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
    let group =
        |(name, velocities): (&str, [f64; 2])| Group::new(name.to_owned(), velocities.to_vec());
    let expected = Data::from_groups(groups.map(group).to_vec());
    assert_eq!(read_as(text.as_bytes(), "group = \"bone\""), Ok(Some(expected)));
}

#[test]
fn a_group_of_one_velocity_is_a_group() {
    let read =
        read_as(b"bone,velocity\na,3900\na,3950\nb,4000\nc,4010\nc,4010\n", "group = \"bone\"");
    let groups = read.unwrap().unwrap().groups().to_vec();
    let unsearched: Vec<_> = groups.iter().map(Group::no_variation).collect();
    let equal = NoVariation::AllEqual { count: 2, velocity: 4010.0 };
    assert_eq!(unsearched, [None, Some(NoVariation::OneVelocity), Some(equal)]);
}

#[test]
fn subjects_are_numbered_in_each_group() {
    let text = "bone,patient,velocity\na, p ,3900\nb,q,3910\na,q,3920\nb,p,3930\na,\"p\",3940\n";
    let subjects = |more: &str| {
        let data = read_as(text.as_bytes(), more).unwrap().unwrap();
        (0..data.sets()).map(|set| data.subjects(set).map(<[u32]>::to_vec)).collect::<Vec<_>>()
    };
    for (more, expected) in [
        ("", vec![None]),
        ("subject = \"patient\"", vec![Some(vec![0, 1, 1, 0, 0])]),
        ("group = \"bone\"", vec![None, None]),
        ("group = \"bone\"\nsubject = \"patient\"", vec![Some(vec![0, 1, 0]), Some(vec![0, 1])]),
    ] {
        assert_eq!(subjects(more), expected, "{more}");
    }
}

#[test]
fn decays_are_a_column() {
    let row = |k: u32| (3900.0 + f64::from(k * k), 4.5 + f64::from(k * 7 % 10) / 10.0);
    let rows: Vec<(f64, f64)> = (0..10).map(row).collect();
    let lines: String = rows.iter().map(|(v, d)| format!("{d:?},{v:?}\n")).collect();
    let more = "decay = \"dB/cm\"\ndecay_spreading = \"line\"\ndecay_error = 0.2";
    let data = read_as(format!("dB/cm,velocity\n{lines}").as_bytes(), more).unwrap().unwrap();
    let (velocities, decays): (Vec<f64>, Vec<f64>) = rows.into_iter().unzip();
    let found = data.set(0).unwrap();
    assert_eq!(
        (found.velocities, found.observables[Observable::Decay]),
        (&velocities[..], Some(&decays[..]))
    );
    let check = |rows: &str, expected: &str| {
        let text = format!("dB/cm,velocity\n{rows}{lines}");
        let message = read_as(text.as_bytes(), more).unwrap_err();
        assert!(message.contains(expected), "{message}");
    };
    let line = "data.velocities: DIR/data/v.csv, line 2: `dB/cm` is";
    let line = line.replace('`', "");
    for wrong in ["", "x", "nan", "-100.5", "462"] {
        check(&format!("{wrong},3900\n"), &format!("{line} {wrong:?}; it must be the decay"));
    }
    let columns = read_as(b"d,velocity\n4.5,3900\n4.6,3910\n", more).unwrap_err();
    assert!(columns.contains("no column `dB/cm`; the header has `d`, `velocity`"), "{columns}");
    let few = read_as(b"dB/cm,velocity\n4.5,3900\n4.6,3910\n", more).unwrap_err();
    assert!(few.contains("data.decay: there are 2 velocities; with decays at least 10"), "{few}");
}

#[test]
fn what_is_known_of_each_group_is_a_column() {
    let text = "q,bone,t,velocity\n15,a,3e-3,3900\n20.5,b,0.0041,3910\n15.0,a,0.003,3920\n";
    let known = |more: &str| -> [Vec<(&str, f64)>; 2] {
        let data = read_as(text.as_bytes(), &format!("group = \"bone\"\n{more}")).unwrap().unwrap();
        [0, 1].map(|set| data.known(set).given().map(|(one, value)| (one.name(), value)).collect())
    };
    let nothing: [Vec<(&str, f64)>; 2] = [vec![], vec![]];
    assert_eq!(known(""), nothing);
    let thickness = [vec![("bone_thickness", 3e-3)], vec![("bone_thickness", 0.0041)]];
    assert_eq!(known("known = { bone_thickness = \"t\" }"), thickness);
    let both = known("[data.known]\nbone_quality_factor = \"q\"\nbone_thickness = \"t\"");
    assert_eq!(both[1], [("bone_thickness", 0.0041), ("bone_quality_factor", 20.5)]);
}

#[test]
fn known_values_that_are_refused() {
    let check = |rows: &str, expected: &str| {
        let more = "group = \"bone\"\nknown = { bone_thickness = \"t\" }";
        let csv = format!("bone,t,velocity\n{rows}b,4e-3,3900\nb,4e-3,3910\n");
        let message = read_as(csv.as_bytes(), more).unwrap_err();
        assert!(message.contains(expected), "{message}");
    };
    let file = "data.velocities: DIR/data/v.csv, line";
    let rule = "it must be a number (SI units), the same in all rows of a group";
    check("a,,3900\n", &format!("{file} 2: t is empty; {rule}"));
    check("a,3 mm,3900\n", &format!("{file} 2: t is \"3 mm\"; {rule}"));
    check("a,inf,3900\n", &format!("{file} 2: t is \"inf\"; {rule}"));
    check(
        "a,3e-3,3900\nb,4e-3,3905\na,3.1e-3,3910\n",
        &format!(
            "{file} 4: t is 0.0031, and 0.003 in line 2; all rows of the group \"a\" must have the same \
             value"
        ),
    );
    let place = "data.known.bone_thickness: DIR/data/v.csv, line 4: the value";
    let of_group = "of the group \"a\" is refused: layers.bone.thickness: is";
    for (value, expected) in [
        ("3.0", format!("{place} 3.0 {of_group} 3.0; values are in m: did you mean 3 mm (3e-3)?")),
        ("0", format!("{place} 0.0 {of_group} 0.0; it must be above 0")),
        ("-1e-3", format!("{place} -0.001 {of_group} -0.001; it must be above 0")),
    ] {
        check(&format!("b,4e-3,3900\nb,4e-3,3910\na,{value},3900\n"), &expected);
    }
    let columns = |more: &str, expected: &str| {
        let message = read_as(b"bone,t,velocity\na,3e-3,3900\na,3e-3,3910\n", more).unwrap_err();
        assert!(message.contains(expected), "{message}");
    };
    columns(
        "known = { bone_thickness = \"t\" }",
        "data.known: has a value for each group, and there are no groups; name their column: group = \"…\"",
    );
    columns(
        "group = \"bone\"\nknown = { bone_thickness = \"d\" }",
        "line 1: no column `d`; the header has `bone`, `t`, `velocity`",
    );
    columns(
        "group = \"bone\"\nknown = { thickness = \"t\" }",
        "data.known.thickness: unknown key; did you mean `bone_thickness`?",
    );
    columns(
        "group = \"bone\"\nknown = { bone_thickness = 3e-3 }",
        "data.known.bone_thickness: is 0.003; it must be the name of a column of the file of velocities",
    );
}

#[test]
fn subjects_that_are_refused() {
    let check = |text: &str, more: &str, expected: &str| {
        let more = format!("subject = \"patient\"\n{more}");
        let message = read_as(text.as_bytes(), &more).unwrap_err();
        assert!(message.contains(expected), "{message}");
    };
    let no_column = "data.velocities: DIR/data/v.csv, line 1: no column `patient`; the header has \
                     `site`, `velocity`";
    check("site,velocity\na,3900\na,3910\n", "", no_column);
    let empty = "data.velocities: DIR/data/v.csv, line 3: patient is empty; it must name the subject \
                 of the velocity";
    check("patient,velocity\na,3900\n\" \",3910\n", "", empty);
    let one = "data.subject: all 2 velocities are of one subject; at least two subjects are needed to \
               see by how much they differ";
    check("patient,velocity\na,3900\na,3910\n", "", one);
    let grouped = "site,patient,velocity\nx,a,3900\nx,b,3910\ny,a,3900\ny,a,3910\nz,a,3900\n";
    let one = "data.subject: in the group \"y\": all 2 velocities are of one subject";
    check(grouped, "group = \"site\"", one);
    let many = format!("patient,velocity\n{}", "a,3900\nb,3901\n".repeat(250_001));
    check(&many, "", "has more than 500000 velocities, the most that can have subjects");
}

#[test]
fn a_column_that_seems_to_name_subjects_is_pointed_out() {
    let hint = |column: &str| {
        format!(
            "data.velocities: the column {column:?} of the file repeats; if these are velocities of the \
             same subject, name it: subject = {column:?}"
        )
    };
    let rows = "a,3900\nb,3910\na,3920\n";
    for column in ["patient", "Subject", "specimen_id", "id"] {
        assert_eq!(warnings(&format!("{column},velocity\n{rows}"), ""), [hint(column)]);
    }
    let silent =
        |text: &str, more: &str| assert_eq!(warnings(text, more), [""; 0], "{text} {more}");
    silent("patient,velocity\na,3900\nb,3910\na,3920\n", "subject = \"patient\"");
    silent("patient,velocity\na,3900\na,3950\nb,3910\nb,3970\n", "group = \"patient\"");
    silent("operator,velocity\na,3900\nb,3910\na,3920\n", "");
    silent("id,velocity\n1,3900\n2,3910\n3,3920\n", "");
    silent("id,velocity\n1,3900\n1,3910\n1,3920\n", "");
    // Each patient is a group.
    silent("site,id,velocity\nx,1,3900\nx,1,3950\ny,2,3910\ny,2,3970\n", "group = \"site\"");
}

#[test]
fn velocities_far_from_the_others_are_named_with_their_lines() {
    let rows: String = (0..60).map(|k| format!("{}\n", 3850 + 5 * (k * 8 % 21))).collect();
    assert_eq!(warnings(&format!("velocity\n{rows}"), ""), [""; 0]);
    assert_eq!(
        warnings(&format!("velocity\n{rows}7800\n"), ""),
        [
            "data.velocities: DIR/v.csv: 7800 m/s (line 62) is 105 robust standard deviations from the \
             median 3900 m/s; check this: it changes both moments, but hardly a likelihood or a posterior"
        ]
    );
}

#[test]
fn copies_are_doubted() {
    let rows = "3900\n3911\n3922\n3933\n3944\n";
    assert_eq!(
        warnings(&format!("velocity\n{rows}{rows}"), ""),
        [
            "data.velocities: the first 5 velocities are repeated in the same order, 2 times in all: \
          are these copies?"
        ]
    );
    assert_eq!(
        warnings(&format!("velocity\n{rows}{}3950\n", "3944\n".repeat(4)), ""),
        [
            "data.velocities: 5 velocities in a row are 3944.0 m/s, from line 6 on: are these copies?"
        ]
    );
    assert_eq!(warnings(&format!("velocity\n{rows}{}", "3944\n".repeat(3)), ""), [""; 0]);
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
    let refusal = |bytes: &[u8]| {
        let message = read(bytes).unwrap_err();
        // The line of the job file changes with every key before it.
        let lines = message.lines().map(|line| match line.split_once(": data.velocities") {
            Some((_, rest)) => format!("  data.velocities{rest}"),
            None => line.to_owned(),
        });
        lines.collect::<Vec<_>>().join("\n")
    };
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
        let message = refusal(text.as_bytes());
        let shown: String = text.chars().take(60).collect();
        writeln!(page, "{}\n=> {message}\n", shown.trim_end().replace('\n', "\\n")).unwrap();
    }
    writeln!(page, "(not UTF-8)\n=> {}", refusal(b"velocity\n\xff\n")).unwrap();
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!("rejected_csv", page);
    });
}

#[test]
fn velocities_in_another_unit_are_refused() {
    let check = |text: &str, more: &str, expected: &[&str]| {
        let message = read_as(text.as_bytes(), more).unwrap_err();
        for part in expected {
            assert!(message.contains(part), "{part} is not in: {message}");
        }
    };
    let all = "data.velocities: their median is 3.95; values are in m/s: did you mean 3.95 km/s";
    check("velocity\n3.9\n3.95\n4.0\n", "", &["1 error", all]);
    let one = "DIR/data/v.csv, line 5: velocity is 39000.0; no velocity of sound in bone is outside \
               100 to 20000 (m/s); their median is 3950";
    check("# one\nvelocity\n3900.5\n\n39000\n3950\n", "", &["1 error", one]);
    let grouped = "bone,velocity\na,3900.5\nb,3.9\na,3.95\nb,4.0\na,4000\n";
    let expected = [
        "2 errors",
        "data.groups.b: their median is 3.95; values are in m/s: did you mean 3.95 km/s (3.95e3)?",
        "data.groups.a[1]: DIR/data/v.csv, line 4: velocity is 3.95; no velocity",
    ];
    check(grouped, "group = \"bone\"", &expected);
    let many = format!("velocity\n{}{}", "3900\n4000\n".repeat(20), "39000\n".repeat(12));
    let expected =
        ["more than 10 errors", "line 51: velocity is 39000.0", "more velocities out of range"];
    check(&many, "", &expected);
}

#[test]
fn single_velocities_far_from_the_others_are_warned_of_with_their_line() {
    let one = "velocity\n3900.5\n# comment\n390\n3950\n4000\n3960\n3970\n";
    assert_eq!(
        warnings(one, ""),
        [
            "data.velocities: DIR/v.csv: 390 (line 4) m/s: more than a factor 3 from the median 3955 m/s; \
          in other units, or a slip of the decimal point?"
        ]
    );
    let many = format!("velocity\n{}{}390\n", "3900\n4000\n".repeat(20), "390\n391\n".repeat(3));
    let found = warnings(&many, "");
    assert_eq!(found.len(), 1, "{found:?}");
    let listed =
        "390 (line 42), 391 (line 43), 390 (line 44), 391 (line 45), 390 (line 46) and 2 more m/s";
    assert!(found[0].contains(listed), "{found:?}");
    assert_eq!(warnings("velocity\n3900.5\n3950\n2000\n8000\n", ""), [""; 0]);
    let grouped = "bone,velocity\na,3900\nb,4000\na,3950\na,390\nb,3900\n";
    assert_eq!(
        warnings(grouped, "group = \"bone\""),
        [
            "data.groups.a: DIR/v.csv: 390 (line 5) m/s: more than a factor 3 from the median 3900 m/s; \
          in other units, or a slip of the decimal point?"
        ]
    );
}

#[test]
fn unusual_known_values_are_told_of_one_group() {
    let csv =
        "bone,t,velocity\na,3e-3,3900\na,3e-3,3950\nb,1e-3,3900\nc,40e-3,3910\nd,50e-3,3910\n";
    let job = "group = \"bone\"\nknown = { bone_thickness = \"t\" }";
    let expected =
        "data.known.bone_thickness: that of the group \"c\" is 0.04 m; usual is 0.0002 to 0.03 m";
    assert_eq!(warnings(csv, job), [expected]);
}

#[test]
fn unusual_groups_are_listed_and_counted() {
    let rows: String = (0..8).map(|i| format!("g{i},900\ng{i},950\n")).collect();
    let csv = format!("bone,velocity\n{rows}z,3900\nz,3950\n");
    let found = warnings(&csv, "group = \"bone\"");
    assert_eq!(found.len(), 6, "{found:?}");
    assert_eq!(found[0], "data.groups.g0: their median is 925 m/s; usual is 1000 to 8000 m/s");
    assert_eq!(found[5], "data.groups: 3 more groups are unusual");
}
