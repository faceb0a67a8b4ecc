//! Solvers as users see them: instruction sets by name, checks, estimated errors.

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use osteon_solver::Isa;
use support::{Coordinator, Scratch, job, run, run_with, text};

const VARIABLE: &str = "OSTEON_INSTRUCTION_SET";

fn case(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/cases").join(name);
    text(&path).to_owned()
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", &job(8, 1));
    let (mut simulations, mut digests) = (BTreeSet::new(), BTreeSet::new());
    for isa in Isa::available() {
        let with = (VARIABLE, isa.name());
        let simulated = run_with(with, &["simulate", &case("D.toml"), "--json"]);
        simulations.insert(simulated.succeeded().to_owned());
        let propagated = run_with(with, &["propagate", text(&job), "--json", "--workers", "1"]);
        digests.insert(propagated.json()["digest"].as_str().unwrap().to_owned());
    }
    assert_eq!((simulations.len(), digests.len()), (1, 1), "{simulations:?} {digests:?}");
}

#[test]
fn an_unknown_instruction_set_is_refused_wherever_something_is_computed() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", &job(8, 1));
    let case = case("A.toml");
    for arguments in [
        &["simulate", &case][..],
        &["propagate", text(&job)],
        &["identify", text(&job)],
        &["worker", "--coordinator", "unix:nowhere"],
    ] {
        let refused = run_with((VARIABLE, "sse9"), arguments);
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{arguments:?}");
        assert!(
            refused.stderr.contains("\"sse9\" is not an instruction set"),
            "{}",
            refused.stderr
        );
        for isa in Isa::available() {
            assert!(refused.stderr.contains(isa.name()), "{}", refused.stderr);
        }
    }
    // A command that computes nothing.
    assert_eq!(run_with((VARIABLE, "sse9"), &["draw", text(&job), "--index", "0"]).code, Some(0));
}

#[test]
fn a_worker_says_what_it_computes_on() {
    let gone = ["worker", "--coordinator", "unix:nowhere", "--give-up-after", "0.01"];
    let finished = run_with((VARIABLE, "baseline"), &gone);
    assert_eq!(finished.code, Some(1));
    assert!(finished.stderr.contains("instruction_set=\"baseline\""), "{}", finished.stderr);
}

#[test]
fn a_check_compares_both_methods_with_a_refined_solution() {
    let json = run(&["simulate", &case("A.toml"), "--check", "--json"]).json();
    let check = json["check"].as_array().unwrap();
    let methods: Vec<_> = check.iter().map(|one| one["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["exact", "hybrid", "exact"]);
    assert_eq!(check[0]["velocity"], json["velocity"]);
    assert_eq!(check[2]["refinement"], 5.0);
    assert_eq!(check[2]["relative_difference"], 0.0);
    assert!(check[0]["estimated_error"].as_f64().unwrap() >= 0.0);
    let mut velocities = BTreeSet::new();
    for one in check {
        let (difference, time) = (&one["relative_difference"], &one["time_difference"]);
        assert!(difference.as_f64().unwrap() < 1e-4 && time.as_f64().unwrap() < 1e-9, "{one}");
        velocities.insert(one["velocity"].to_string());
    }
    assert_eq!(velocities.len(), 3, "three solutions: {velocities:?}");
    let shown = run(&["simulate", &case("A.toml"), "--check"]);
    assert!(shown.succeeded().contains("the methods agree\n"), "{}", shown.stdout);
}

#[test]
fn sublayers_are_simulated_and_checked_by_both_methods() {
    let scratch = Scratch::new();
    let solid = fs::read_to_string(case("A.toml")).unwrap();
    let (_, solid) = solid.split_once("[bone]\n").unwrap();
    let sublayer = |thickness: &str, solid: &str| {
        format!("[[bone.sublayers]]\nthickness = {thickness}\n{solid}\n")
    };
    let write = |name, upper: &str| {
        let lower = sublayer("2.5e-3", solid);
        scratch.write(name, &format!("{}{lower}", sublayer("1.5e-3", upper)))
    };
    let velocity =
        |file: &Path| run(&["simulate", text(file), "--json"]).json()["velocity"].clone();
    let plate = run(&["simulate", &case("A.toml"), "--json"]).json();
    assert_eq!(velocity(&write("equal.toml", solid)), plate["velocity"], "to the bit");
    let denser = solid.replace("density = 1598.8", "density = 1700.0");
    let file = write("denser.toml", &denser);
    let slower = velocity(&file).as_f64().unwrap();
    assert!(slower < plate["velocity"].as_f64().unwrap() - 10.0, "{slower}");
    let out = scratch.path("out");
    let shown = run(&["simulate", text(&file), "--check", "--out", text(&out)]);
    assert!(shown.succeeded().contains("the methods agree\n"), "{}", shown.stdout);
    assert_eq!(velocity(&out.join("case.toml")).as_f64(), Some(slower));
    let twice = write("twice.toml", &format!("{denser}[layers.bone]\nthickness = 4e-3\n"));
    let refused = run(&["simulate", text(&twice)]);
    assert_eq!(refused.code, Some(2));
    let expected = "layers.bone.thickness: is given together with bone.sublayers";
    assert!(refused.stderr.contains(expected), "{}", refused.stderr);
}

#[test]
fn a_job_of_sublayers_has_the_bones_of_their_stack() {
    let scratch = Scratch::new();
    let write = |name, bone: &str| {
        let settings =
            "[parameters]\ndispersion = { fixed = 0.1 }\n[monte_carlo]\nrealizations = 6\n";
        scratch.write(name, &format!("{bone}\n{settings}"))
    };
    let digest = |file: &Path| run(&["propagate", text(file), "--json"]).json()["digest"].clone();
    let porous =
        |thickness: &str| format!("[[bone.sublayers]]\nthickness = {thickness}\nporosity = 0.1\n");
    let stack = write("equal.toml", &format!("{}{}", porous("1.5e-3"), porous("2.5e-3")));
    assert_eq!(
        digest(&stack),
        digest(&write("plate.toml", "[bone]\nporosity = 0.1")),
        "to the bit"
    );
    // The thickness of all together is random, and one has a tensor of its own.
    let random = "[random.bone_thickness]\nstandard_deviation = 0.2e-3\n[[bone.sublayers]]\nthickness = 1e-3\n";
    let material = "material = \"human-femur-ashman-1984\"\n";
    let file = write("random.toml", &format!("{random}{material}{}", porous("2.5e-3")));
    let coordinator = Coordinator::start(&scratch.path("store"));
    let _worker = coordinator.worker(2);
    let remote = coordinator.client(&["propagate", text(&file), "--json"]).json();
    assert_eq!(remote["failures"], serde_json::json!({}));
    assert_eq!(remote["digest"], digest(&file));
    // A realization is a case, whose velocity is that of the job.
    let out = scratch.path("out");
    run(&["propagate", text(&file), "--out", text(&out)]).succeeded();
    let rows = fs::read_to_string(out.join("realizations.csv")).unwrap();
    let row = rows.lines().nth(3).unwrap().split(',').nth(1).unwrap().parse::<f64>().unwrap();
    let drawn =
        scratch.write("drawn.toml", run(&["draw", text(&file), "--index", "2"]).succeeded());
    let simulated = run(&["simulate", text(&drawn), "--json"]).json();
    assert_eq!(simulated["velocity"].as_f64(), Some(row));
}

#[test]
fn a_check_of_a_case_with_attenuation_refines_only() {
    let scratch = Scratch::new();
    let attenuation = "[layers]\nbone = { attenuation = { quality_factor = 15 } }\n";
    let text_of_case = format!("{attenuation}{}", fs::read_to_string(case("A.toml")).unwrap());
    let file = scratch.write("A.toml", &text_of_case);
    let json = run(&["simulate", text(&file), "--check", "--json"]).json();
    let check = json["check"].as_array().unwrap();
    let methods: Vec<_> = check.iter().map(|one| one["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["exact", "exact"]);
    assert!(check[0]["relative_difference"].as_f64().unwrap() < 1e-4, "{check:?}");
    let shown = run(&["simulate", text(&file), "--check"]);
    assert!(shown.succeeded().contains("hybrid computes no attenuation\n"), "{}", shown.stdout);
}

#[test]
fn a_hybrid_job_runs_on_workers_and_states_its_discretisation() {
    let scratch = Scratch::new();
    let settings = "[solver]\nmethod = \"hybrid\"\nelement_order = 6\n";
    let text_of_job = format!("{settings}{}", job(3, 1));
    let file = scratch.write("job.toml", &text_of_job);
    let coordinator = Coordinator::start(&scratch.path("store"));
    let _worker = coordinator.worker(2);
    let result = coordinator.client(&["propagate", text(&file), "--json"]).json();
    let solver = &result["solver"];
    assert_eq!((&solver["method"], &solver["element_order"]), (&"hybrid".into(), &6.into()));
    let errors = &solver["estimated_error"];
    let (median, largest) = (errors["median"].as_f64(), errors["largest"].as_f64());
    assert!(0.0 <= median.unwrap() && median <= largest, "{errors}");
    let drawn = run(&["draw", text(&file), "--index", "2"]).succeeded().to_owned();
    assert!(drawn.contains("method = \"hybrid\""), "{drawn}");
    // The exact method's digest is different.
    let exact = scratch.write("exact.toml", &job(3, 1));
    let exact = coordinator.client(&["propagate", text(&exact), "--json"]).json();
    assert_ne!(exact["digest"], result["digest"]);
    assert_eq!(exact["solver"]["method"], "exact");
    assert!(exact["solver"]["pairs"].as_u64().unwrap() > 100);
}
