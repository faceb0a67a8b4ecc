//! Runs the commands that the documentation shows.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use osteon_files::job_file;

use support::{Owned, Scratch, osteon};

/// Returns the commands in the `console` blocks of a page, in order, without the program's name.
fn commands(page: &str) -> Vec<String> {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(page)).unwrap();
    text.split("```console\n")
        .skip(1)
        .flat_map(|block| block.split("```").next().unwrap_or("").lines())
        .filter_map(|line| {
            line.strip_prefix("osteon ").or_else(|| line.strip_prefix("cargo run --release -- "))
        })
        .map(str::to_owned)
        .collect()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Returns a column of numbers of a CSV file.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let at = lines.next().unwrap().split(',').position(|header| header == name).unwrap();
    lines.map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect()
}

#[test]
fn the_readmes_commands_do_what_they_say() {
    let scratch = Scratch::new();
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"), &scratch.path("examples"));
    let all = commands("README.md");
    assert!(all.len() > 5, "{all:?}");
    for (i, command) in all.iter().enumerate() {
        // The same command occurs later with `--out`; running it once is enough.
        if all[i + 1..].iter().any(|later| later.starts_with(command.as_str())) {
            continue;
        }
        run_in(&scratch, command);
    }
    // The example data match the description in their header. (A better solver may change them by
    // its accuracy.)
    let drawn = column(&scratch.path("optimum/realizations.csv"), "velocity");
    let data = column(&scratch.path("examples/data/velocities.csv"), "velocity");
    assert_eq!(drawn.len(), data.len());
    for (index, (drawn, data)) in drawn.iter().zip(&data).enumerate() {
        assert!((drawn / data - 1.0).abs() < 1e-4, "index {index}: {drawn} against {data}");
    }
    // The identification of the first command matches the data's moments to its tolerance.
    let result = fs::read_to_string(scratch.path("quick/result.json")).unwrap();
    let result: serde_json::Value = serde_json::from_str(&result).unwrap();
    assert_eq!(result["status"], "converged");
    for moment in ["mean", "coefficient_of_variation"] {
        let (model, data) = (&result["velocity"][moment], &result["data"][moment]);
        let relative = model.as_f64().unwrap() / data.as_f64().unwrap() - 1.0;
        // √cost_tolerance
        assert!(relative.abs() <= 1e-4, "{moment}: {relative}");
    }
}

#[test]
fn the_network_pages_commands_make_what_a_coordinator_takes() {
    let scratch = Scratch::new();
    let all = commands("docs/network.md");
    assert!(all.len() > 3, "{all:?}");
    for command in &all {
        let words = command.split_whitespace();
        let output = osteon().args(words).current_dir(scratch.path(".")).output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "osteon {command}: {errors}");
    }
    // The files in the page's table exist, and the coordinator's command accepts them.
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/network.md"));
    let listed: Vec<String> = page
        .unwrap()
        .lines()
        .filter(|line| line.starts_with("| `") && line.contains(".pem`"))
        .flat_map(|line| line.split('`').filter(|word| word.ends_with(".pem")).map(str::to_owned))
        .collect();
    assert_eq!(listed.len(), 8, "{listed:?}");
    for name in listed {
        assert!(scratch.path("certs").join(&name).exists(), "{name}");
    }
    for certs in ["certs", "certs-2"] {
        let store = scratch.path(certs).join("store");
        let file = |name: &str| scratch.path(certs).join(name);
        let mut command = osteon();
        command.args(["coordinator", "--listen", "0.0.0.0:0", "--store"]).arg(store);
        command.arg("--tls-ca").arg(file("ca.pem"));
        command.arg("--tls-cert").arg(file("server.pem"));
        command.arg("--tls-key").arg(file("server-key.pem"));
        command.arg("--tokens").arg(scratch.path("tokens"));
        let mut process = Owned::spawn(command.env("RUST_LOG", "warn"));
        // The URL contains the name in the certificate, which other machines use.
        let url = process.line();
        assert!(url.starts_with("https://node-1.example:"), "{url}");
    }
}

#[test]
fn the_cluster_pages_commands_for_operators_run_as_they_stand() {
    let scratch = Scratch::new();
    scratch.write("job.toml", &support::job(20, 1));
    let coordinator = support::Coordinator::start(&scratch.path("store"));
    let all = commands("docs/cluster.md");
    assert!(all.len() >= 8, "{all:?}");
    for command in &all {
        // Quoted text is one word, as in a shell.
        let quoted = command.split('"').enumerate();
        let words = quoted.flat_map(|(i, part)| match i % 2 {
            0 => part.split_whitespace().map(str::to_owned).collect::<Vec<_>>(),
            _ => vec![part.to_owned()],
        });
        let mut osteon = osteon();
        osteon.args(words).current_dir(scratch.path("."));
        let output = osteon.env("OSTEON_COORDINATOR", &coordinator.url).output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "osteon {command}: {errors}");
    }
    assert!(scratch.path("monday/osteon.sqlite").exists());
}

#[test]
fn the_slurm_pages_commands_print_scripts_that_bash_can_read() {
    let scratch = Scratch::new();
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"), &scratch.path("examples"));
    let all = commands("docs/slurm.md");
    assert_eq!(all.len(), 2, "{all:?}");
    for command in &all {
        let arguments = command.split(" > ").next().unwrap_or_default();
        let mut osteon = osteon();
        osteon.args(arguments.split_whitespace()).current_dir(scratch.path("."));
        let script = support::Finished::of(osteon.output().unwrap());
        let script = scratch.write("script", script.succeeded());
        let checked = Command::new("bash").arg("-n").arg(script).output().unwrap();
        assert!(checked.status.success(), "osteon {command}: {checked:?}");
    }
}

#[test]
fn the_grpc_pages_code_is_the_tested_clients() {
    let read = |path: &str| fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path));
    let (page, client) = (read("docs/grpc.md").unwrap(), read("tests/python/osteon_client.py"));
    let client = client.unwrap();
    let blocks: Vec<&str> = page
        .split("```python\n")
        .skip(1)
        .map(|block| block.split("```").next().unwrap_or_default())
        .collect();
    assert!(blocks.len() > 5, "{} blocks", blocks.len());
    for block in &blocks {
        assert!(client.contains(block), "the tested client has not:\n{block}");
    }
    // The page shows all of it.
    for function in client.lines().filter(|line| line.starts_with("def ")) {
        assert!(blocks.iter().any(|block| block.contains(function)), "{function} is not shown");
    }
}

/// Writes the files that a page shows: each a fenced block after a comment `file: NAME`.
fn write_files(page: &str, scratch: &Scratch) {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(page)).unwrap();
    for part in text.split("<!-- file: ").skip(1) {
        let (name, rest) = part.split_once(" -->\n```").unwrap();
        let (_, block) = rest.split_once('\n').unwrap();
        scratch.write(name, block.split("```").next().unwrap());
    }
}

/// Runs a command in a shell's way, as far as the pages need it: `> FILE`.
fn run_in(scratch: &Scratch, command: &str) {
    let (arguments, file) = match command.split_once(" > ") {
        Some((arguments, file)) => (arguments, Some(file)),
        None => (command, None),
    };
    let words = arguments.split_whitespace();
    let output = osteon().args(words).current_dir(scratch.path(".")).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "osteon {command}: {errors}");
    if let Some(file) = file {
        fs::write(scratch.path(file), &output.stdout).unwrap();
    }
}

/// The pages for users that show files and commands, with the least number of commands of each.
const GUIDES: [(&str, usize); 15] = [
    ("docs/quick-start.md", 5),
    ("docs/tutorial.md", 3),
    ("docs/how-to-csv.md", 3),
    ("docs/how-to-pick.md", 8),
    ("docs/how-to-observables.md", 2),
    ("docs/how-to-attenuation.md", 3),
    ("docs/how-to-porosity.md", 2),
    ("docs/how-to-systematic.md", 2),
    ("docs/how-to-design.md", 3),
    ("docs/how-to-cluster.md", 2),
    ("docs/how-to-resume.md", 2),
    ("docs/how-to-posterior.md", 1),
    ("docs/how-to-reproduce.md", 4),
    ("docs/materials.md", 5),
    ("docs/job-files.md", 2),
];

#[test]
fn the_guides_commands_run_on_the_files_that_they_show() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    // What several pages do with the examples is done once.
    let mut done = BTreeSet::new();
    for (page, least) in GUIDES {
        let scratch = Scratch::new();
        copy(&examples, &scratch.path("examples"));
        write_files(page, &scratch);
        let all = commands(page);
        assert!(all.len() >= least, "{page}: {all:?}");
        for command in &all {
            if !command.contains(" examples/") || done.insert(command.clone()) {
                run_in(&scratch, command);
            }
        }
        check_guide(page, &scratch);
    }
}

/// Checks what a page says of its results.
fn check_guide(page: &str, scratch: &Scratch) {
    let read = |name: &str| fs::read_to_string(scratch.path(name)).unwrap();
    let json = |name: &str| serde_json::from_str::<serde_json::Value>(&read(name)).unwrap();
    match page {
        "docs/how-to-porosity.md" => {
            // The data are the moments of the example's velocities, whose bone has a tenth of pores.
            let found = json("found/result.json");
            let porosity = found["parameters"]["porosity"].as_f64().unwrap();
            assert!((porosity - 0.0992).abs() < 1e-3, "{porosity}");
        }
        "docs/quick-start.md" => {
            // The tutorial quotes these.
            let pairs = read("patients/comparison.csv");
            assert!(pairs.contains("\nP01,P02,-190."), "{pairs}");
            let text =
                fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/tutorial.md"));
            assert!(text.unwrap().contains("> -190 m/s (95 % interval -234 to -147 m/s)"));
            assert!(pairs.contains(",-233.7") && pairs.contains(",-147.0"), "{pairs}");
        }
        "docs/how-to-csv.md" => {
            let job = read("messung/job.toml");
            assert!(job.contains("3871.0, 3923.0, 3899.0, 3951.0, 3884.0"), "{job}");
        }
        "docs/how-to-pick.md" => {
            let velocities = column(&scratch.path("velocities.csv"), "velocity");
            assert!((velocities[0] - 3908.755).abs() < 0.5, "{velocities:?}");
            // The example's signals are those that the page makes, and of bones of a known porosity.
            let signals = |name: &str| fs::read(scratch.path(name)).unwrap();
            assert!(signals("study/signals.npy") == signals("examples/signals/signals.npy"));
            assert_eq!(signals("study/probe.toml"), signals("examples/signals/probe.toml"));
            let found = json("known/result.json");
            let porosity = found["parameters"]["porosity"].as_f64().unwrap();
            assert!((porosity - 0.0960).abs() < 1e-4, "{porosity}");
        }
        "docs/how-to-reproduce.md" => {
            assert_eq!(json("original/result.json"), json("again/result.json"));
        }
        "docs/how-to-systematic.md" => {
            let budget = &json("whole/result.json")["budget"][0];
            assert_eq!(budget["quantity"], "bulk_velocity");
            let parts = budget["contributions"].as_array().unwrap();
            let shares = parts.iter().map(|part| part["variance_share"].as_f64().unwrap());
            assert!((shares.sum::<f64>() - 1.0).abs() < 1e-9, "{budget}");
            let sources = parts.iter().map(|part| part["source"].as_str().unwrap());
            assert!(sources.clone().any(|name| name == "bone_quality_factor"), "{budget}");
            assert!(!sources.clone().any(|name| name == "tilt"), "{budget}");
        }
        "docs/how-to-design.md" => {
            // A0 tells the shear modulus, of which the velocity tells nothing, and not the density.
            let designed = json("design.json");
            let quantities = designed["quantities"].as_array().unwrap();
            let share = |quantity: &str, measurement: &str| {
                let found = quantities.iter().find(|one| one["quantity"] == quantity).unwrap();
                let all = found["measurements"].as_array().unwrap();
                let one = all.iter().find(|one| one["measurement"] == measurement).unwrap();
                one["prior_share"].as_f64().unwrap()
            };
            let modulus = share("longitudinal_shear_modulus", "a0_velocity=1%");
            assert!((modulus - 0.4).abs() < 0.03, "{modulus}");
            let density = share("density", "density=2%");
            assert!((density - 0.23).abs() < 0.02, "{density}");
            assert!(share("density", "a0_velocity=1%") > 0.8);
        }
        "docs/how-to-posterior.md" => {
            assert!(read("posterior/posterior.csv").lines().count() > 100);
        }
        _ => {}
    }
}

/// Returns `page` with the text between the two marks replaced.
fn with_keys(page: &str, name: &str, table: &str) -> String {
    let (begin, end) = (format!("<!-- keys of {name} -->\n"), "<!-- end of keys -->");
    let (before, rest) = page.split_once(&begin).unwrap();
    let (_, after) = rest.split_once(end).unwrap();
    format!("{before}{begin}{table}{end}{after}")
}

#[test]
fn the_tables_of_keys_are_those_of_the_program() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/job-files.md");
    let page = fs::read_to_string(&path).unwrap();
    let current = with_keys(&page, "setup", &job_file::setup_table());
    let current = with_keys(&current, "porosity", &job_file::porosity_table());
    let current = with_keys(&current, "job", &job_file::job_table());
    if std::env::var_os("OSTEON_WRITE_DOCS").is_some() {
        fs::write(&path, &current).unwrap();
    } else {
        assert!(page == current, "after a change: cargo xtask generate reference");
    }
}
