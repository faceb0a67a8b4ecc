//! The tables of a simulation.

use osteon_files::report::Simulation;

use super::markup::{Numbers, table as markup_table};
use crate::quantity::{LENGTH, Precision, TIME, Unit, VELOCITY};

const MEGAHERTZ: Unit = Unit { name: "MHz", size: 1e6 };
const DECAY: Unit = Unit { name: "dB/cm", size: 1.0 };

/// Returns the tables of a simulation.
pub(super) fn table(numbers: &Numbers, result: &Simulation) -> String {
    let digits = Precision::Digits;
    let mut rows = vec![vec![
        "velocity of the first arriving signal (m/s)".to_owned(),
        numbers.number(result.velocity, "/velocity", VELOCITY, digits(7)),
    ]];
    let mut add = |name: &str, value: Option<f64>, place: &str, unit: Unit| {
        let shown = numbers.number(value, place, unit, digits(5));
        rows.push(vec![unit.axis_label(name), shown]);
    };
    for (place, name) in ["velocity from the first source", "velocity from the second source"]
        .into_iter()
        .enumerate()
    {
        if let Some(directions) = result.directions {
            add(name, Some(directions[place]), &format!("/directions/{place}"), VELOCITY);
        }
    }
    if let Some(signal) = &result.first_signal {
        let other = format!("velocity of the {} extremum", signal.other_extremum.name());
        add(&other, signal.other_velocity, "/first_signal/other_velocity", VELOCITY);
        add("decay along the array", Some(signal.decay), "/first_signal/decay", DECAY);
        let frequency = "/first_signal/center_frequency";
        add("frequency of the signal", signal.center_frequency, frequency, MEGAHERTZ);
    }
    let waves = &result.guided_waves;
    for (name, wave, at) in [("A0", waves.a0, "a0"), ("S0", waves.s0, "s0")] {
        let place = |which: &str| format!("/guided_waves/{at}/{which}_velocity");
        let phase = wave.map(|wave| wave.phase_velocity);
        add(&format!("phase velocity of {name}"), phase, &place("phase"), VELOCITY);
        let group = wave.map(|wave| wave.group_velocity);
        add(&format!("group velocity of {name}"), group, &place("group"), VELOCITY);
    }
    let mut out = markup_table("Velocity and other observables", &["Quantity", "Value"], &rows);
    let receivers: Vec<Vec<String>> = result
        .receivers
        .iter()
        .enumerate()
        .map(|(place, one)| {
            let at = |key: &str| format!("/receivers/{place}/{key}");
            vec![
                (place + 1).to_string(),
                numbers.number(Some(one.x1), &at("x1"), LENGTH, digits(5)),
                numbers.number(one.time, &at("time"), TIME, digits(7)),
            ]
        })
        .collect();
    let columns = ["Receiver", "x₁ (mm)", "Picked time (µs)"];
    out.push_str(&markup_table("Receivers", &columns, &receivers));
    out
}
