//! Output of `simulate`.

use osteon_common::settings::Extremum;

use super::*;

fn arrival() -> Arrival {
    Arrival {
        velocity: 3908.75,
        directions: None,
        times: vec![2.9e-6, 3.104_7e-6, 3.309_3e-6],
        amplitudes: vec![2.0, 1.5, 1.125],
        estimated_error: 2e-5,
        passes: None,
    }
}

fn first_signal() -> FirstSignal {
    FirstSignal {
        other_extremum: Extremum::Second,
        other_velocity: Ok(3878.0625),
        decay: 3.125,
        center_frequency: Some(1.125e6),
    }
}

const GUIDED_WAVES: GuidedWaves = GuidedWaves {
    frequency: 1e6,
    a0: Some(GuidedWave { phase_velocity: 1601.25, group_velocity: 1650.5 }),
    s0: Some(GuidedWave { phase_velocity: 1610.75, group_velocity: 1598.125 }),
    a0_radiates: false,
};

/// A setup with three receivers. The exact method's sampling changes with every improvement of it;
/// the hybrid method's discretisation is set by the user.
fn setup(method: Method) -> Setup {
    let mut setup = Setup::default();
    setup.probe.receivers.count = 3;
    setup.solver.method = method;
    setup
}

fn simulation(
    format: OutputFormat,
    arrival: &Result<Arrival, Failure>,
    check: Option<&Check>,
) -> String {
    let solved = SolvedCase {
        setup: setup(Method::Hybrid),
        arrival: arrival.clone(),
        first_signal: arrival.is_ok().then(first_signal),
        guided_waves: GUIDED_WAVES,
        check: check.cloned(),
    };
    let shown = ShownSimulation { solved: &solved, traces: Some(Path::new("d/traces.csv")) };
    // Each build has its own commit.
    let commit = format!("\"commit\": {}", serde_json::json!(crate::program::COMMIT));
    printed(format, |output| output.simulation(&shown).unwrap())
        .replace(&commit, "\"commit\": \"(of the build)\"")
}

#[test]
fn a_simulation_shows_times_and_velocity() {
    insta::assert_snapshot!(simulation(OutputFormat::Text, &Ok(arrival()), None));
    insta::assert_snapshot!(simulation(OutputFormat::Json, &Ok(arrival()), None));
}

#[test]
fn a_simulation_without_velocity_says_why() {
    let failure = || Failure {
        kind: FailureKind::NoArrival,
        detail: "receiver 3 has no extremum".to_owned(),
    };
    insta::assert_snapshot!(simulation(OutputFormat::Text, &Err(failure()), None));
    insta::assert_snapshot!(simulation(OutputFormat::Json, &Err(failure()), None));
}

#[test]
fn the_sampling_that_decided_is_shown() {
    let last = Sampled { band: 12.5e6, period: 1.1e-5, pairs: 9000 };
    let passes = Some(PassSummary { count: 3, pairs_computed: 17_000, last });
    let arrival = Ok(Arrival { passes, ..arrival() });
    let setup = setup(Method::Exact);
    let solved =
        SolvedCase { setup, arrival, first_signal: None, guided_waves: GUIDED_WAVES, check: None };
    let shown = ShownSimulation { solved: &solved, traces: None };
    let text = |format| printed(format, |output| output.simulation(&shown).unwrap());
    let line = "solver exact: refinement 1, band to 12.5 MHz, period 11 µs; estimated";
    assert!(unwrapped(&text(OutputFormat::Text)).contains(line), "{}", text(OutputFormat::Text));
    let value: serde_json::Value = serde_json::from_str(&text(OutputFormat::Json)).unwrap();
    let expected = [("pairs", 9000), ("pairs_computed", 17_000), ("passes", 3)];
    for (key, number) in expected {
        assert_eq!(value["solver"][key], number, "{value:#}");
    }
}

#[test]
fn guided_waves_that_were_not_found_are_explained_and_attenuation_is_named() {
    let guided_waves = GuidedWaves { s0: None, ..GUIDED_WAVES };
    let mut setup = setup(Method::Exact);
    setup.layers.bone_attenuation.quality_factor = Some(10.0);
    let arrival = Ok(arrival());
    let solved = SolvedCase { setup, arrival, first_signal: None, guided_waves, check: None };
    let shown = ShownSimulation { solved: &solved, traces: None };
    let text = unwrapped(&printed(OutputFormat::Text, |output| output.simulation(&shown).unwrap()));
    for part in [
        "without its attenuation, at 1 MHz",
        "MHz A0 phase velocity 1601.250 m/s group velocity",
        "not all were found: the bone",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains("S0 phase"), "{text}");
    let json = printed(OutputFormat::Json, |output| output.simulation(&shown).unwrap());
    let waves = &serde_json::from_str::<serde_json::Value>(&json).unwrap()["guided_waves"];
    assert_eq!(waves["s0"], serde_json::Value::Null);
    assert_eq!(waves["a0"]["phase_velocity"], 1601.25);
    assert!(waves["reason"].as_str().unwrap().starts_with("the bone is too thin"), "{waves}");
}

#[test]
fn an_extremum_without_velocity_is_explained() {
    let failure =
        Failure { kind: FailureKind::NoArrival, detail: "receiver 3 has 1 extrema".to_owned() };
    let signal = FirstSignal {
        other_velocity: Err(failure),
        decay: -0.5,
        center_frequency: None,
        ..first_signal()
    };
    let (setup, arrival) = (setup(Method::Exact), Ok(arrival()));
    let solved = SolvedCase {
        setup,
        arrival,
        first_signal: Some(signal),
        guided_waves: GUIDED_WAVES,
        check: None,
    };
    let shown = ShownSimulation { solved: &solved, traces: None };
    let text = unwrapped(&printed(OutputFormat::Text, |output| output.simulation(&shown).unwrap()));
    let expected = "no velocity of the second extremum: no arrival (receiver 3 has 1 extrema) \
                    decay along the array -0.5000 dB/cm guided waves";
    assert!(text.contains(expected), "{text}");
    let json = printed(OutputFormat::Json, |output| output.simulation(&shown).unwrap());
    let signal = &serde_json::from_str::<serde_json::Value>(&json).unwrap()["first_signal"];
    assert_eq!(signal["other_failure"], "no_arrival");
    assert_eq!(signal["other_velocity"], serde_json::Value::Null);
    assert_eq!(signal["center_frequency"], serde_json::Value::Null);
}

/// A check in which the hybrid method differs by this.
fn checked(hybrid: Difference) -> Check {
    let solution = |method, velocity, difference| MethodSolution {
        setup: setup(method),
        arrival: Ok(Arrival { velocity, ..arrival() }),
        difference,
    };
    let numbers = |velocity, time| Difference::Numbers { velocity, time };
    let mut refined = setup(Method::Exact);
    refined.solver.refinement = 5.0;
    Check {
        exact: solution(Method::Exact, 3908.85, numbers(2.5e-5, 1.2e-10)),
        hybrid: Some(solution(Method::Hybrid, 3908.9, hybrid)),
        refined: MethodSolution {
            setup: refined,
            ..solution(Method::Exact, 3908.75, numbers(0.0, 0.0))
        },
    }
}

#[test]
fn a_check_shows_every_solution_and_whether_it_passed() {
    let text = |check: &Check| simulation(OutputFormat::Text, &Ok(arrival()), Some(check));
    let same = checked(Difference::Numbers { velocity: 3.8e-5, time: 4e-10 });
    insta::assert_snapshot!(text(&same));
    assert!(text(&checked(Difference::Picks)).contains("THE PICKS DIFFER\n"));
    let mut off = same.clone();
    off.exact.difference = Difference::Numbers { velocity: 1.1e-4, time: 1e-9 };
    assert!(text(&off).contains("OFF by more than 1e-4: EXACT\n"), "{}", text(&off));
    off.hybrid.as_mut().unwrap().difference = Difference::Numbers { velocity: 2.7e-4, time: 1e-9 };
    assert!(text(&off).contains("OFF by more than 1e-4: EXACT AND HYBRID\n"), "{}", text(&off));
    let json = simulation(OutputFormat::Json, &Ok(arrival()), Some(&same));
    let check = &serde_json::from_str::<serde_json::Value>(&json).unwrap()["check"];
    assert_eq!(check.as_array().unwrap().len(), 3);
    assert_eq!(check[0]["velocity"], 3908.85);
    assert_eq!(check[1]["method"], "hybrid");
    assert_eq!(check[1]["relative_difference"], 3.8e-5);
    assert_eq!(check[1]["time_difference"], 4e-10);
    assert_eq!(check[2]["estimated_error"], 2e-5);
    assert_eq!(check[2]["same_pick"], true);
}

#[test]
fn both_directions_of_a_probe_are_shown() {
    let arrival = Ok(Arrival { directions: Some([3750.5, 4080.5]), ..arrival() });
    let text = unwrapped(&simulation(OutputFormat::Text, &arrival, None));
    let expected =
        "harmonic mean of 3750.500 m/s from the first source and 4080.500 m/s from the second";
    assert!(text.contains(expected), "{text}");
    let json = simulation(OutputFormat::Json, &arrival, None);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["directions"], serde_json::json!([3750.5, 4080.5]));
}
