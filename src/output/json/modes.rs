//! The guided waves of a bone as JSON.

use osteon_common::version::Program;
use osteon_local::modes::{attenuation, label};
use osteon_solver::Mode;
use serde_json::{Value, json};

use crate::output::ShownModes;
use crate::program;

/// Returns the object; a wave without a usual name has null, and the number of others if it is not known.
pub(super) fn value(shown: &ShownModes<'_>) -> Value {
    let frequencies = shown.modes.frequencies.iter().map(|(frequency, found)| {
        json!({
            "frequency": frequency,
            "waves": found.modes.iter().map(wave).collect::<Vec<_>>(),
            "lost": found.lost.iter().map(label).collect::<Vec<_>>(),
            "others": found.others,
        })
    });
    let Program { version, numerics, commit } = program::current();
    json!({
        "modes": frequencies.collect::<Vec<_>>(),
        "version": version,
        "numerics": numerics,
        "commit": commit,
    })
}

fn wave(mode: &Mode) -> Value {
    json!({
        "wave": mode.name,
        "family": mode.family,
        "rank": mode.rank,
        "wavenumber": mode.wavenumber,
        "phase_velocity": mode.phase_velocity,
        "group_velocity": mode.group_velocity,
        "attenuation": attenuation(mode),
    })
}
