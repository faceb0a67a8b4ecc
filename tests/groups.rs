//! Groups of measured velocities: one job, one identification for each group, nothing lost.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use support::{Coordinator, Owned, Scratch, children, eventually, job, option, osteon, run, text};

/// The files of a run with groups.
const FILES: [&str; 7] = [
    "job.toml",
    "result.json",
    "history.csv",
    "groups.csv",
    "comparison.csv",
    "realizations.csv",
    "provenance.json",
];

/// Velocities of a group around `mean`, about normally distributed, with a coefficient of variation
/// of 0.027.
fn velocities(mean: f64) -> Vec<f64> {
    let scores = [-1.63, -1.04, -0.67, -0.39, -0.13, 0.13, 0.39, 0.67, 1.04, 1.63];
    scores.iter().map(|score| mean * (1.0 + 0.03 * score)).collect()
}

/// A job of `count` groups with different means, by `newton`, with its file of velocities.
fn grouped(scratch: &Scratch, count: u32) -> PathBuf {
    let mut csv = "velocity,bone\n".to_owned();
    for score in 0..10 {
        for group in 0..count {
            let velocity = velocities(3850.0 + 10.0 * f64::from(group))[score];
            csv.push_str(&format!("{velocity},bone {group}\n"));
        }
    }
    scratch.write("velocities.csv", &csv);
    let data = "[data]\nvelocities = \"velocities.csv\"\ngroup = \"bone\"\n";
    let text = by_newton().replace(DATA, data);
    scratch.write("job.toml", &text)
}

const DATA: &str = "[data]\nmean = 3906.0\ncoefficient_of_variation = 0.0271\n";

fn by_newton() -> String {
    job(32, 20).replace("[search]\n", "[search]\nmethod = \"newton\"\n")
}

/// Returns the number of evaluations so far of the only job at `url`.
fn evaluations(url: &str) -> Option<u64> {
    let listed = run(&["jobs", "--json", "--coordinator", url]);
    let listed: Value = serde_json::from_str(&listed.stdout).ok()?;
    listed.as_array()?.first()?["evaluations"].as_u64()
}

/// Returns every row of a table by the names of its columns. Only the last field may contain a
/// comma.
fn table(text: &str) -> Vec<BTreeMap<String, String>> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let fields = line.splitn(names.len(), ',').map(|field| field.trim_matches('"').to_owned());
        names.iter().map(|name| (*name).to_owned()).zip(fields).collect()
    };
    lines.map(row).collect()
}

fn read(directory: &Path, name: &str) -> String {
    fs::read_to_string(directory.join(name)).unwrap()
}

#[test]
fn a_group_is_identified_as_it_would_be_alone() {
    let scratch = Scratch::new();
    let job = grouped(&scratch, 2);
    let out = scratch.path("out");
    let printed = run(&["identify", text(&job), "--out", text(&out)]);
    let table_text = printed.succeeded();
    assert!(table_text.contains("bone 1"), "{table_text}");
    let result: Value = serde_json::from_str(&read(&out, "result.json")).unwrap();
    assert_eq!(result["status"], "converged");
    for (group, mean) in [3850.0, 3860.0].into_iter().enumerate() {
        let alone = format!("[data]\nvelocities = {:?}\n", velocities(mean));
        let alone = scratch.write("alone.toml", &by_newton().replace(DATA, &alone));
        let alone = run(&["identify", text(&alone), "--json"]).json();
        let found = &result["groups"][group];
        assert_eq!(found["name"], format!("bone {group}"));
        assert_eq!(found["data"]["count"], 10);
        for key in ["cost", "parameters", "dispersion", "velocity", "sensitivities", "identified"] {
            assert_eq!(found[key], alone[key], "{key} of group {group}");
        }
        let interval = &found["identified"]["bulk_velocity"]["interval"];
        assert!(interval[0].as_f64() < interval[1].as_f64(), "{found}");
    }
    // Each group has a line in the tables.
    assert_eq!(read(&out, "groups.csv").lines().count(), 3);
    let rows = table(&read(&out, "groups.csv"));
    for (row, found) in rows.iter().zip(result["groups"].as_array().unwrap()) {
        let modulus = &found["identified"]["parameters"]["longitudinal_young_modulus"];
        let number = |column: &str| row[column].parse::<f64>().unwrap();
        assert_eq!(Some(number("longitudinal_young_modulus")), modulus["value"].as_f64());
        for (end, column) in ["lower", "upper"].into_iter().enumerate() {
            let expected = modulus["interval"][end].as_f64();
            assert_eq!(Some(number(&format!("longitudinal_young_modulus_{column}"))), expected);
            let expected = found["data"]["interval"]["mean"][end].as_f64();
            assert_eq!(Some(number(&format!("data_mean_{column}"))), expected);
        }
        assert_eq!(
            Some(number("kolmogorov_p_value")),
            found["data"]["kolmogorov"]["p_value"].as_f64()
        );
    }
    assert!(table_text.contains("LONGITUDINAL YOUNG MODULUS (GPa)"), "{table_text}");
    let comparison = read(&out, "comparison.csv");
    let row: Vec<&str> = comparison.lines().nth(1).unwrap().split(',').collect();
    assert_eq!(row[..2], ["bone 0", "bone 1"]);
    let numbers: Vec<f64> = row[2..].iter().map(|field| field.parse().unwrap()).collect();
    assert!(numbers[1] < numbers[0] && numbers[0] < numbers[2] && numbers[0] < 0.0, "{row:?}");
    assert!(read(&out, "history.csv").lines().nth(1).unwrap().ends_with(",bone 0"));
}

/// The thickness of each bone, and the coupling's sound speed on the day of its measurement, are columns
/// of the file.
#[test]
fn a_group_has_the_setup_that_is_known_of_it() {
    let scratch = Scratch::new();
    let known = [(3850.0, 3.2e-3, 1480.0), (3860.0, 4.5e-3, 1510.0)];
    let mut csv = "velocity,bone,cortex,water\n".to_owned();
    for (bone, (mean, thickness, speed)) in known.into_iter().enumerate() {
        for velocity in velocities(mean) {
            csv.push_str(&format!("{velocity},bone {bone},{thickness},{speed}\n"));
        }
    }
    scratch.write("velocities.csv", &csv);
    let data = "[data]\nvelocities = \"velocities.csv\"\ngroup = \"bone\"\n\
                known = { bone_thickness = \"cortex\", coupling_sound_speed = \"water\" }\n";
    let job = scratch.write("job.toml", &by_newton().replace(DATA, data));
    let out = scratch.path("out");
    run(&["identify", text(&job), "--out", text(&out)]).succeeded();
    let result: Value = serde_json::from_str(&read(&out, "result.json")).unwrap();
    let rows = table(&read(&out, "realizations.csv"));
    for (bone, (mean, thickness, speed)) in known.into_iter().enumerate() {
        let alone = format!("[data]\nvelocities = {:?}\n", velocities(mean));
        let alone = by_newton().replace(DATA, &alone);
        let layers = format!(
            "{alone}[layers]\nbone = {{ thickness = {thickness} }}\ncoupling = {{ sound_speed = {speed} }}\n"
        );
        let alone = scratch.write("alone.toml", &layers);
        let out = scratch.path(&format!("alone {bone}"));
        let alone = run(&["identify", text(&alone), "--json", "--out", text(&out)]).json();
        let found = &result["groups"][bone];
        for key in ["cost", "dispersion", "velocity", "failures", "sensitivities", "identified"] {
            assert_eq!(found[key], alone[key], "{key} of bone {bone}");
        }
        assert_eq!(found["parameters"]["bone_thickness"].as_f64(), Some(thickness));
        assert_eq!(found["parameters"]["coupling_sound_speed"].as_f64(), Some(speed));
        // The velocities are the same to the bit, which their decimals show.
        let name = format!("bone {bone}");
        let of_group = rows.iter().filter(|row| row["group"] == name);
        let of_group: Vec<&String> = of_group.map(|row| &row["velocity"]).collect();
        let alone = table(&read(&out, "realizations.csv"));
        assert_eq!(of_group, alone.iter().map(|row| &row["velocity"]).collect::<Vec<_>>());
        assert_eq!(of_group.len(), 32);
        let row = &table(&read(&scratch.path("out"), "groups.csv"))[bone];
        let number = |column: &str| row[column].parse::<f64>().unwrap();
        assert_eq!(number("best_bone_thickness"), thickness);
        assert_eq!(number("best_coupling_sound_speed"), speed);
    }
    // A realization of a group has its setup; the same command shows the result again.
    let draw = ["draw", text(&job), "--index", "5", "--at", text(&out), "--group", "bone 1"];
    assert!(run(&draw).succeeded().contains("bone = { thickness = 0.0045 }"));
    let history = table(&read(&out, "history.csv"));
    assert!(
        history.iter().any(|row| row["bone_thickness"] == "0.0032" && row["group"] == "bone 0")
    );
    let again = run(&["identify", text(&job), "--out", text(&out), "--json"]).json();
    assert_eq!(again, result);
    // The job that was run has the values inlined.
    let inlined = out.join("job.toml");
    let again = run(&["identify", text(&inlined), "--json"]).json();
    assert_eq!(again["digest"], result["digest"]);
}

#[test]
fn a_realization_is_drawn_at_the_best_point_of_its_group() {
    let scratch = Scratch::new();
    let job = grouped(&scratch, 2);
    let out = scratch.path("out");
    run(&["identify", text(&job), "--out", text(&out)]).succeeded();
    let rows = table(&read(&out, "realizations.csv"));
    assert_eq!(rows.len(), 2 * 32);
    let draw = |options: &[&str]| {
        run(&[&["draw", text(&job), "--index", "5", "--at", text(&out)], options].concat())
    };
    for group in ["bone 0", "bone 1"] {
        let case = scratch.write("case.toml", draw(&["--group", group]).succeeded());
        let velocity = run(&["simulate", text(&case), "--json"]).json()["velocity"].as_f64();
        let row = rows.iter().find(|row| row["group"] == group && row["index"] == "5").unwrap();
        assert_eq!(row["velocity"].parse().ok(), velocity, "{group}");
    }
    for (options, expected) in [
        (&[][..], "choose one with --group: \"bone 0\", \"bone 1\""),
        (
            &["--group", "bone 2"],
            "there is no group \"bone 2\"; the groups are \"bone 0\", \"bone 1\"",
        ),
    ] {
        let refused = draw(options);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        assert!(refused.stderr.contains(expected), "{refused:?}");
    }
}

/// The job of [`grouped`] with additional `lines` in the file of velocities.
fn grouped_with(scratch: &Scratch, lines: &str) -> PathBuf {
    let job = grouped(scratch, 2);
    let csv = fs::read_to_string(scratch.path("velocities.csv")).unwrap();
    let (header, rows) = csv.split_once('\n').unwrap();
    scratch.write("velocities.csv", &format!("{header}\n{lines}{rows}"));
    job
}

#[test]
fn a_group_of_one_velocity_does_not_stop_the_others() {
    let scratch = Scratch::new();
    let (plain, mixed) = (scratch.path("plain"), scratch.path("mixed"));
    let job = grouped(&scratch, 2);
    run(&["identify", text(&job), "--out", text(&plain)]).succeeded();
    let job = grouped_with(&scratch, "3900,lonely\n3910,same\n3910,same\n");
    let run_here = run(&["identify", text(&job), "--out", text(&mixed)]);
    let printed = run_here.succeeded();
    for expected in [
        "velocities.csv: group \"lonely\" (1 velocity) is not searched: only one velocity",
        "velocities.csv: group \"same\" (2 velocities) is not searched: all 2 velocities are 3910.0",
    ] {
        assert!(run_here.stderr.contains(expected), "{run_here:?}");
    }
    let why = "only one velocity: a coefficient of variation needs at least two different ones";
    assert!(
        printed.contains("failed *") && printed.contains(&format!("* lonely: {why}")),
        "{printed}"
    );
    let json = |out: &Path| serde_json::from_str::<Value>(&read(out, "result.json")).unwrap();
    let (alone, mixed_result) = (json(&plain), json(&mixed));
    assert_eq!(mixed_result["status"], "converged");
    assert_eq!(mixed_result["digest"], alone["digest"]);
    assert_eq!(mixed_result["evaluations"], alone["evaluations"]);
    let groups = mixed_result["groups"].as_array().unwrap();
    assert_eq!((&groups[0]["name"], &groups[0]["status"]), (&"lonely".into(), &"failed".into()));
    assert_eq!(groups[0]["reason"], why);
    assert_eq!(groups[2..], alone["groups"].as_array().unwrap()[..]);
    let rows = table(&read(&mixed, "groups.csv"));
    assert_eq!((rows[0]["reason"].as_str(), rows[0]["evaluations"].as_str()), (why, "0"));
    let history = read(&mixed, "history.csv");
    assert!(!history.contains("lonely") && history.lines().nth(1).unwrap().ends_with(",bone 0"));
    // The same with a separate coordinator.
    let coordinator = Coordinator::start(&scratch.path("store"));
    let _worker = coordinator.worker(1);
    let there = scratch.path("there");
    let run_there = coordinator.client(&["identify", text(&job), "--out", text(&there)]);
    assert!(run_there.stderr.contains("group \"lonely\" (1 velocity)"), "{run_there:?}");
    run_there.succeeded();
    for name in FILES {
        assert!(read(&there, name) == read(&mixed, name), "{name} differs");
    }
}

#[test]
fn a_job_without_a_group_to_search_is_refused() {
    let scratch = Scratch::new();
    let job = grouped(&scratch, 1);
    scratch.write("velocities.csv", "velocity,bone\n3900,a\n3910,b\n3910,b\n");
    let refused = run(&["identify", text(&job), "--out", text(&scratch.path("out"))]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    let expected = "velocities.csv: no group of the column `bone` has two velocities that differ";
    assert!(refused.stderr.contains(expected), "{refused:?}");
    assert!(!scratch.path("out").exists());
}

/// The example's velocities come from the seeds and parameters in the file's header. (A better
/// solver may change them by its accuracy.)
#[test]
fn the_examples_velocities_are_drawn_as_their_head_says() {
    let scratch = Scratch::new();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let csv = read(&examples, "data/groups.csv");
    let (head, rows): (Vec<&str>, Vec<&str>) = csv.lines().partition(|line| line.starts_with('#'));
    let rows = table(&rows.join("\n"));
    let job = read(&examples, "groups.toml");
    let fixed = job.split("[parameters]").nth(1).unwrap().split("\n\n").next().unwrap();
    let mut drawn = 0;
    for line in head {
        let Some((patient, said)) = line[2..].split_once(": ").filter(|(name, _)| name.len() == 3)
        else {
            continue;
        };
        let said: Vec<&str> = said.split(", ").collect();
        let [modulus, dispersion, realizations, seed] = said[..] else { panic!("{line}") };
        let parameters = fixed.lines().map(|line| match line.split_whitespace().next() {
            Some("longitudinal_young_modulus") => {
                format!("longitudinal_young_modulus = {{ fixed = {} }}\n", &modulus[..6])
            }
            Some("dispersion") => format!("dispersion = {{ fixed = {dispersion} }}\n"),
            _ => format!("{line}\n"),
        });
        let parameters: String = parameters.collect();
        let text = format!("[parameters]{parameters}[monte_carlo]\n{realizations}\n{seed}\n");
        let job = scratch.write(&format!("{patient}.toml"), &text);
        let out = scratch.path(patient);
        run(&["propagate", support::text(&job), "--out", support::text(&out)]).succeeded();
        let expected = table(&read(&out, "realizations.csv"));
        let measured: Vec<_> = rows.iter().filter(|row| row["patient"] == patient).collect();
        assert_eq!(measured.len(), expected.len());
        for (measured, expected) in measured.iter().zip(&expected) {
            let [measured, expected] =
                [&measured["velocity"], &expected["velocity"]].map(|v| v.parse::<f64>().unwrap());
            assert!((measured / expected - 1.0).abs() < 1e-4, "{measured} against {expected}");
        }
        drawn += measured.len();
    }
    assert_eq!(drawn, rows.len());
}

#[test]
fn a_job_of_groups_whose_coordinator_is_killed_loses_nothing() {
    let scratch = Scratch::new();
    let job = grouped(&scratch, 12);
    let (undisturbed, out) = (scratch.path("undisturbed"), scratch.path("out"));
    run(&["identify", text(&job), "--out", text(&undisturbed)]).succeeded();
    // Interrupted twice, the second time further on.
    let mut stored = 0;
    for _ in 0..2 {
        let mut command = osteon();
        command.args(["identify", text(&job), "--out", text(&out)]);
        let mut process = Owned::spawn(&mut command);
        eventually("more evaluations are stored", || {
            let worker = children(process.id()).into_iter().next();
            let url = worker.and_then(|worker| option(worker, "--coordinator"));
            let now = url.and_then(|url| evaluations(&url)).unwrap_or(0);
            // Many are stored at once, and a run that has ended stores no more.
            assert_eq!(process.ended(), None, "it was too quick for this test");
            let more = now >= stored + 5;
            stored = if more { now } else { stored };
            more
        });
        process.kill();
        assert!(!out.join("result.json").exists(), "it was too quick for this test");
    }
    run(&["identify", text(&job), "--out", text(&out)]).succeeded();
    for name in FILES {
        assert!(read(&out, name) == read(&undisturbed, name), "{name} differs");
    }
}
