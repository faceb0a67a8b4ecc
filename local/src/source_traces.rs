//! The signals of a case for each of several sources.

use osteon_common::case::Case;
use osteon_common::probe::Probe;
use osteon_common::signal_layout::Transmitter;
use osteon_solver::{Isa, Solver, TraceError};

/// Returns the sources of a probe with `further` ones, `pitch` (m) apart, beyond each of its own: their side, and how
/// much farther than the probe's own each is, m.
pub fn sources(probe: &Probe, further: u32, pitch: f64) -> Vec<(Transmitter, f64)> {
    let sides = if probe.bidirectional { &Transmitter::ALL[..] } else { &[Transmitter::First] };
    let of_side = |&side| (0..=further).map(move |n| (side, f64::from(n) * pitch));
    sides.iter().flat_map(of_side).collect()
}

/// Returns the pressure (Pa) at each receiver along the probe for one source, which is `offset` (m) farther from
/// the receivers than the probe's own on its side; from 0 to `duration`, every `step` (s).
///
/// # Errors
/// If the traces would be empty or too large.
pub fn source_traces(
    case: &Case,
    (side, offset): (Transmitter, f64),
    (duration, step): (f64, f64),
    isa: Isa,
) -> Result<Vec<Vec<f64>>, TraceError> {
    let mut setup = case.setup.clone();
    if side == Transmitter::Second {
        setup.probe = setup.probe.from_other_side();
    }
    if offset != 0.0 {
        setup.probe = setup.probe.with_source_farther(offset);
    }
    let solver = Solver::with_isa(&setup, isa);
    let mut traces = solver.traces(&case.bone, duration, step)?.pressures;
    if side == Transmitter::Second {
        // The solver counts receivers from the source on, and an array along the probe.
        traces.reverse();
    }
    Ok(traces)
}
