//! The outcome of one case.

use osteon_common::visible;
use osteon_solver::{FirstSignal, GuidedWave};

use super::layout::{aligned, wrapped};
use super::number::{DIGITS, VELOCITY_DIGITS, digits, significant};
use super::{check, solver};
use crate::output::ShownSimulation;

/// Significant digits of decay and frequency of a signal.
const SIGNAL_DIGITS: usize = 4;

/// Returns the outcome of one case, its times, its guided waves, and how they were computed.
pub(super) fn table(simulation: &ShownSimulation<'_>) -> String {
    let picking = simulation.solved.setup.picking;
    let mut text = match &simulation.solved.arrival {
        Ok(arrival) => wrapped(&format!(
            "velocity {} m/s ({} extremum, threshold {:?} of the packet's peak)",
            digits(arrival.velocity, VELOCITY_DIGITS),
            picking.extremum.name(),
            picking.threshold
        )),
        Err(failure) => {
            let kind = failure.kind.name().replace('_', " ");
            let detail = Some(&failure.detail).filter(|detail| !detail.is_empty());
            let detail = detail.map(|detail| format!(" ({detail})")).unwrap_or_default();
            wrapped(&format!("no velocity: {kind}{detail}"))
        }
    };
    if let Ok(arrival) = &simulation.solved.arrival {
        if let Some(directions) = arrival.directions {
            let [one, two] = directions.map(|velocity| digits(velocity, VELOCITY_DIGITS));
            text.push_str(&wrapped(&format!(
                "harmonic mean of {one} m/s from the first source and {two} m/s from the second"
            )));
        }
        text.push_str("\nreceiver  x1 (mm)   time (µs)\n");
        let positions = simulation.solved.setup.probe.receivers.positions();
        for (j, (x1, time)) in positions.zip(&arrival.times).enumerate() {
            text.push_str(&format!("{:>8}  {:>7.3}  {:>10.5}\n", j + 1, x1 * 1e3, time * 1e6));
        }
    }
    if let Some(signal) = &simulation.solved.first_signal {
        text.push_str(&format!("\n{}", first_signal(signal)));
    }
    text.push_str(&format!("\n{}", guided_waves(simulation)));
    let solver = solver::single_velocity_line(&simulation.solved.solver());
    text.push_str(&format!("\n{}", wrapped(&solver)));
    if let Some(check) = &simulation.solved.check {
        text.push_str(&format!("\n{}", check::table(check)));
    }
    if let Some(path) = simulation.traces {
        text.push_str(&format!("\n{}", wrapped(&format!("traces in {}", visible::path(path)))));
    }
    text
}

/// Returns the observables of the first signal besides its velocity, a line for each.
fn first_signal(signal: &FirstSignal) -> String {
    let FirstSignal { other_extremum, other_velocity, decay, center_frequency } = signal;
    let name = other_extremum.name();
    let other = match other_velocity {
        Ok(velocity) => {
            format!("velocity of the {name} extremum {} m/s", digits(*velocity, VELOCITY_DIGITS))
        }
        Err(failure) => {
            let kind = failure.kind.name().replace('_', " ");
            format!("no velocity of the {name} extremum: {kind} ({})", failure.detail)
        }
    };
    let decay = format!("decay along the array {} dB/cm", digits(*decay, SIGNAL_DIGITS));
    let frequency = center_frequency.map(|frequency| {
        let frequency = digits(frequency * 1e-6, SIGNAL_DIGITS);
        format!("frequency {frequency} MHz, from the half period between both extrema")
    });
    [Some(other), Some(decay), frequency].into_iter().flatten().map(|line| wrapped(&line)).collect()
}

/// Returns the velocities of the guided waves.
fn guided_waves(simulation: &ShownSimulation<'_>) -> String {
    let waves = &simulation.solved.guided_waves;
    let setup = &simulation.solved.setup;
    let is_attenuated = setup.layers.bone_attenuation.quality_factor.is_some();
    let without = if is_attenuated { ", without its attenuation" } else { "" };
    let but = if setup.probe.a0_in_fluids { " (A0: between its fluids)" } else { "" };
    let frequency = significant(waves.frequency * 1e-6, DIGITS);
    let mut text =
        wrapped(&format!("guided waves of the bone in a vacuum{but}{without}, at {frequency} MHz"));
    let row = |name: &str, wave: Option<GuidedWave>| {
        let wave = wave?;
        let [phase, group] = [wave.phase_velocity, wave.group_velocity]
            .map(|velocity| digits(velocity, VELOCITY_DIGITS));
        Some([
            format!("  {name}"),
            format!("phase velocity {phase} m/s"),
            format!("group velocity {group} m/s"),
        ])
    };
    let rows = [row("A0", waves.a0), row("S0", waves.s0)];
    text.push_str(&aligned(&rows.into_iter().flatten().collect::<Vec<_>>()));
    if let Some(reason) = waves.reason() {
        text.push_str(&wrapped(&format!("not all were found: {reason}")));
    }
    text
}
