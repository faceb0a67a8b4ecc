//! Tables that can be read in two ways, or are broken: a number may be refused, and never be a wrong one.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

#[path = "support/first_jobs.rs"]
mod support;

use support::{refuses, takes};

/// A table with four rows below its header, made of numbers between 3880 and 3950.
fn four(header: &str, row: impl Fn(usize, u32) -> String) -> String {
    let rows = [3908, 3912, 3899, 3921].into_iter().enumerate();
    rows.fold(format!("{header}\n"), |text, (place, v)| text + &row(place, v) + "\n")
}

const FOUR: [f64; 4] = [3908.0, 3912.0, 3899.0, 3921.0];

#[test]
fn a_job_says_what_was_found_out() {
    takes(&four("sep=\t\nid\tvelocity", |i, v| format!("{i}\t{v}")), &FOUR, "from line 3");
    refuses(
        &four(",velocity,velocity\n,mean,std\npatient,,", |i, v| format!("P{i},{v},2{i}")),
        "has the column `velocity` twice",
    );
    refuses("velocity\n3900\n3950\n1e30\n3920\n", "line 4: velocity is 1e30 m/s");
    refuses("velocity\n3900\n3950\n39\n3920\n", "line 4: velocity is 39.0 m/s");
}

#[test]
fn a_name_that_is_missing_is_no_name_of_rows() {
    for (header, row) in [
        (
            "Nr;Patient;Velocity",
            (|i, v| format!("{i};A{i};{v},5;4,{i}")) as fn(usize, u32) -> String,
        ),
        ("patient\tvelocity (m/s)", |i, v| format!("P{i}\t{v}\t{}", v - 500)),
        ("\"no\",\"patient\",\"velocity\"", |i, v| format!("{i},\"A{i}\",{v},4.{i}")),
    ] {
        refuses(&four(header, row), "the number of fields is ");
    }
    let merged = four("id\tvelocity\n\tleft\tright", |i, v| format!("P{i}\t{v}\t{}", v + 60));
    refuses(&merged, "");
    let of_r = four("\"velocity\" \"site\"", |i, v| format!("\"{}\" {v} \"t\"", 3 * i));
    takes(&of_r, &FOUR, "column 2 \"velocity\"");
}

#[test]
fn the_mark_of_a_comment_may_be_a_name() {
    takes(&four("#,velocity", |i, v| format!("{i},{v}")), &FOUR, "column 2 \"velocity\"");
    takes(&four("#\tvelocity\tt", |i, v| format!("{i}\t{v}\t4.{i}")), &FOUR, "column 2");
    takes(&four("# id velocity", |i, v| format!("{i} {v}")), &FOUR, "column 2");
    refuses("velocity\n3,3908\n3,3911\n3,3880\n", "may be one number with a decimal comma, or two");
}

#[test]
fn decimals_in_the_next_column_are_not_lost() {
    for (header, row, expected) in [
        (
            "id,velocity,note",
            (|i, v| format!("{i},{},{},", v / 1000, v % 1000)) as fn(usize, u32) -> String,
            "line 2: the velocity is \"3\"",
        ),
        ("velocity,", |_, v| format!("{},{}", v / 1000, v % 1000), "line 2: the velocity is \"3\""),
        (
            "id,velocity (km/s),note",
            |i, v| format!("{i},{},{},", v / 1000, v % 1000),
            "line 2: the velocity is \"3\"",
        ),
        (
            "id,velocity,note",
            |i, v| format!("{i},{v},{i},"),
            "their decimals may stand in the next column",
        ),
        (
            "id,velocity (km/s),note",
            |i, v| format!("{i},3{}{},", [".", ","][usize::from(i == 1)], v % 1000),
            "line 3: the number of fields is 4",
        ),
    ] {
        refuses(&four(header, row), expected);
    }
}

#[test]
fn an_open_quote_takes_no_rows_with_it() {
    let note = |i| ["\"a", "c", "b\"", "c"][i];
    let text = four("id,velocity,note", |i, v| format!("P{i},{v},{}", note(i)));
    refuses(&text, "line 2: a quote is not closed");
    let noted = four("id,velocity,note", |i, v| format!("P{i},{v},\"moved\nat 3900\""));
    takes(&noted, &FOUR, "4 velocities");
}

#[test]
fn which_of_several_columns_is_asked() {
    let check = |header: &str, cells: [&str; 2], expected: &str| {
        let text = four(header, |i, v| match i {
            0 => format!("{i},{},{}", cells[0], cells[1]),
            _ => format!(
                "{i},{},{}",
                if cells[0] == "NA" { "NA".to_owned() } else { v.to_string() },
                v + 60
            ),
        });
        refuses(&text, expected);
    };
    check("id,SOS left (m/s),SOS right (m/s)", ["3908 (est.)", "3960"], "several columns may be");
    check("id,SOS left (m/s),SOS right (m/s)", ["NA", "3960"], "several columns may be");
    for other in ["velocity_corrected", "velocity.1", "Velocity", "FAS (m/s)"] {
        check(&format!("id,velocity,{other}"), ["3900", "3960"], "several columns may be");
    }
    let ranks = four("velocity,SOS (m/s)", |i, v| format!("{},{v}", 5 - i));
    refuses(&ranks, "several columns may be");
    let scores =
        four("id,SOS (m/s),SOS T-score,SOS Z-score", |i, v| format!("{i},{v},-1.{i},0.{i}"));
    takes(&scores, &FOUR, "column 2");
}

#[test]
fn a_unit_that_is_not_known_is_asked_about() {
    let numbers = |i: usize, v: u32| format!("{i},{v}");
    for (header, expected) in [
        (
            "id,velocity (counts)",
            "the unit of the column `velocity (counts)` is none of velocities",
        ),
        ("id,FAS\n,ns", "the unit of the column `FAS`"),
        ("id,c\n-,µs", "the unit of the column `c`"),
        ("id,velocity\n-,ft/s", "has another unit of velocity than m/s"),
        ("id,cp\n,J/kg/K", "has \"J/kg/K\" directly below its name"),
        ("id,v (mm3)", "no column is clearly"),
    ] {
        refuses(&four(header, numbers), expected);
    }
    let beside = |i: usize, v: u32| format!("{i},{v},{}", ["m/s", "km/s"][usize::from(i == 2)]);
    refuses(&four("id,velocity,unit", beside), "line 4: the column of units has \"km/s\"");
    takes(&four("id,velocity,unit", |i, v| format!("{i},{v},m/s")), &FOUR, "(unit m/s)");
}

#[test]
fn two_tables_are_not_one() {
    let table = four("id,velocity", |i, v| format!("{i},{v}"));
    refuses(&(table + "\nno,thickness_um\n1,3850\n2,3900\n3,3871\n"), "these are two tables");
    let short = "no,velocity\n1,3900\n\nno,velocity,temp\n2,3911,21\n3,3880,21\n4,3950,21\n";
    refuses(short, "these are two tables");
    let two_lines = "id;Schallgeschwindigkeit;;Dicke\n;links;rechts;\n";
    let text = two_lines.to_owned() + "1;3900;3960;4,1\n2;3911;3950;4,2\n3;3880;3930;4,0\n";
    refuses(&text, "has \"links\" directly below its name");
}

#[test]
fn whole_numbers_that_count_are_no_velocities() {
    refuses(
        "velocity,P1,P2\n1,3900,3960\n2,3911,3950\n3,3880,3930\n4,3880,3930\n",
        "are counted one by one",
    );
    refuses("velocity,P1\n2,3900\n4,3911\n5,3880\n9,3880\n", "line 2: the velocity is \"2\"");
    let long = four("id,variable,value", |i, v| format!("{i},FAS,{v} m/s\n{i},water,1482 m/s"));
    refuses(&long, "has \"FAS\", so that rows say what they are of");
}

/// Takes five velocities; what sums them up is left out.
const FIVE: [f64; 5] = [3900.0, 3911.0, 3880.0, 3950.0, 3890.0];

#[test]
fn rows_that_sum_up_are_known_in_any_language() {
    let five =
        |below: &str| format!("id,velocity\nP1,3900\nP2,3911\nP3,3880\nP4,3950\nP5,3890\n{below}");
    for label in
        ["Średnia", "Keskiarvo", "평균", "Overall", "Pooled", "Result", "M", "all", "Grand Total"]
    {
        takes(&five(&format!("{label},3906.2\n")), &FIVE, &format!("line 7 {label:?}"));
    }
    takes(&five(",3906.2\n"), &FIVE, "line 7");
    // What may be the name of a specimen leaves it open.
    refuses(
        &five("P6,3906.2\n"),
        "line 7: the velocity of \"P6\" is \"3906.2\", and the other rows give 3906.2",
    );
    for below in ["\nSampling rate (kHz),4000\n", "Reference value,3950\n", "\nYear,2026\n"] {
        refuses(&five(below), "if the row sums up others, delete");
    }
    takes(
        &five("Mean,3906.2\nmin,3880\n25%,3890\nLower limit,3876.1\nmax,3950\n"),
        &FIVE,
        "5 rows left out",
    );
    takes(&five("Średnia,3906.2\nOdch. std.,27.2\n"), &FIVE, "2 rows left out");
}

#[test]
fn a_label_may_stand_anywhere_in_a_row_that_sums_up() {
    let right = "velocity,patient\n3900,A\n3911,B\n3880,C\n3950,D\n3890,E\n3906.2,Mean\n";
    takes(right, &FIVE, "line 7");
    let top = "id,velocity\n,3906\nA,3900\nB,3911\nC,3880\nD,3950\nE,3890\n";
    takes(top, &FIVE, "line 2");
    let far = "subj,rep,thick,velocity\nP1,1,4.1,3900\nP1,2,4.1,3911\nP1,mean,4.1,3905.5\nP2,1,4.2,3880\n\
               P2,2,4.2,3950\nP2,mean,4.2,3915\n";
    takes(far, &FIVE[..4], "2 rows left out");
    let groups = "group,id,velocity\nA,1,3900\nA,2,3911\nA,3,3880\nA,,3897\nB,4,3950\nB,5,3890\nB,6,3860\nB,,3900\n";
    takes(groups, &[3900.0, 3911.0, 3880.0, 3950.0, 3890.0, 3860.0], "2 rows left out");
    let initials = "initials,velocity\nAB,3900\nCD,3911\nEF,3880\nMW,3897\n";
    refuses(initials, "the velocity of \"MW\" is \"3897\"");
    for name in ["SD-0", "CV 0", "Q1-0", "SE_0", "n 0", "Total 0"] {
        takes(&four("specimen,velocity", |i, v| format!("{name}{i},{v}")), &FOUR, "4 velocities");
    }
}

#[test]
fn marks_and_signs_are_asked_about() {
    let hash = "id,velocity\n#1,3900\n2,3911\n#3,3880\n4,3950\n";
    takes(hash, &[3911.0, 3950.0], "2 lines begin with # and are not read");
    for mark in ["%% ", "// ", "! "] {
        let text = format!("id,velocity\nP1,3900\n{mark}P2,2000\nP3,3911\n");
        refuses(&text, "line 3: begins with ");
    }
    let signs = "No;Dir;V_FAS (m/s)\n1;+;3900\n2;-;-3911\n3;+;3880\n4;-;-3950\n";
    refuses(signs, "line 3: velocity is \"-3911\": if the sign is a direction");
    takes("velocity (km/s)\n3.9\n3.91\n9.999\n", &[3900.0, 3910.0], "1 row is left out");
    refuses(
        "velocity\n3900\n7777\n3910\n3921\n",
        "line 3: velocity is \"7777\", far from the others",
    );
}

#[test]
fn a_row_that_begins_a_block_is_a_measurement() {
    let merged =
        "patient,rep,velocity (m/s)\nP1,1,3901\n,2,3884\n,3,3890\nP2,1,3892\n,2,3907\n,3,3899\n";
    takes(merged, &[3901.0, 3884.0, 3890.0, 3892.0, 3907.0, 3899.0], "6 velocities");
    let noted = "patient,note,velocity (m/s)\nP1,first,3901\nP1,,3884\nP1,,3890\nP2,first,3892\nP2,,3907\nP2,,3899\n";
    takes(noted, &[3901.0, 3884.0, 3890.0, 3892.0, 3907.0, 3899.0], "6 velocities");
    // Among coarse numbers any may be the mean of those above.
    takes(
        "id,velocity\n1,3901\n2,3884\n3,3900\n4b,3895\n5,3910\n",
        &[3901.0, 3884.0, 3900.0, 3895.0, 3910.0],
        "5 velocities",
    );
}

#[test]
fn statistics_below_a_column_are_left_out_or_asked_about() {
    let four = "velocity (m/s)\n4094.3\n4168.6\n3960.7\n4084.4\n";
    let taken = [4094.3, 4168.6, 3960.7, 4084.4];
    for below in ["\n4077.0\n", "\n4077.025\n"] {
        takes(&format!("{four}{below}"), &taken, "line 7");
    }
    refuses(&format!("{four}\n4168.6\n3960.7\n"), "line 7: the velocity is \"4168.6\"");
    refuses(&format!("{four}4077.0\n"), "write it with a decimal more");
    takes(&format!("{four}\n4101.2\n"), &[4094.3, 4168.6, 3960.7, 4084.4, 4101.2], "5 velocities");
    let blocks = "velocity\n3901.1\n3922.0\n3950.5\n3924.53\n3875.0\n3911.4\n3893.2\n3893.20\n";
    takes(
        &blocks.replace("3893.20", "3893.2000"),
        &[3901.1, 3922.0, 3950.5, 3875.0, 3911.4, 3893.2],
        "2 rows left out",
    );
}

#[test]
fn means_of_groups_are_asked_about() {
    for (text, which) in [
        ("site,velocity\nA,3948.1\nA,3743.3\nB,3976.4\nB,4043.8\n\nA,3845.7\nB,4010.1\n", "last"),
        (
            "patient,rep,velocity\nP1,,3845.7\nP1,1,3948.1\nP1,2,3743.3\nP2,,4010.1\nP2,1,3976.4\nP2,2,4043.8\n",
            "first",
        ),
    ] {
        refuses(text, &format!("the {which} row has the mean of the others"));
    }
    let other = "site,velocity\nA,3948.1\nA,3743.3\nA,3845.7\nB,3976.4\nB,4043.8\nB,4012.1\n";
    takes(other, &[3948.1, 3743.3, 3845.7, 3976.4, 4043.8, 4012.1], "6 velocities");
}

#[test]
fn what_other_columns_say_of_the_rows_is_heeded() {
    let wide = "Patient,Velocity (m/s),,\nP1,2940.7,2802.4,2529.8\nP2,3025.3,2740.1,2887.4\n";
    refuses(wide, "column 3 has no name, and numbers like those of `Velocity (m/s)`");
    let modes = "id,mode,velocity\n1,L,3469.8\n1,T,1734.9\n2,L,3507.2\n2,T,1753.6\n";
    refuses(modes, "the velocities where `mode` is \"L\" have a mean of 3488.5 m/s");
    for (name, cells) in
        [("status", ["OK", "INVALID"]), ("excluded", ["", "yes"]), ("type", ["meas", "cal"])]
    {
        let [yes, no] = cells;
        let text = format!(
            "id,velocity,{name}\n1,4100.1,{yes}\n2,4115.5,{yes}\n3,4200.4,{no}\n4,4051.0,{yes}\n"
        );
        takes(&text, &[4100.1, 4115.5, 4200.4, 4051.0], &format!("the column {name:?} ("));
    }
    let titles =
        "Nr,velocity\nPatient,2601\n1,2944.7\n2,2948.2\nPatient,2602\n1,2854.2\n2,2944.2\n";
    refuses(titles, "the velocity of \"Patient\" is \"2602\"");
    refuses(
        "nr,velocity\n1,3948.1\n2,3743.3\nprobe no.,4001\n3,3976.4\n4,4043.8\n",
        "\"probe no.\"",
    );
    let named =
        "# missing value = 4444.0\nid,velocity\n1,4167.3\n2,4245.5\n3,4444.0\n4,4096.4\n5,4444.0\n";
    refuses(named, "a comment names \"4444.0\" with missing values");
    let range = "id,velocity\n1,10000\n2,4187.5\n3,4256.7\n4,4025.1\n5,10000\n6,4136.2\n";
    refuses(range, "velocity is \"10000\", far from the others");
    for name in ["rotor speed", "angular velocity", "RPM speed", "velocity gradient"] {
        refuses(
            &format!("run,{name}\n1,2911\n2,3016\n3,3099\n"),
            "no column is clearly that of the velocities",
        );
    }
}
