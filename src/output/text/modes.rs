//! The guided waves of a bone.

use osteon_common::visible;
use osteon_local::modes::{BandModes, BoneSurroundings, WaveRange, attenuation, label};
use osteon_solver::{FluidModes, Mode};

use super::layout::{aligned, wrapped};
use super::number::{VELOCITY_DIGITS, digits};
use crate::output::ShownModes;

/// Significant digits of a frequency.
const FREQUENCY_DIGITS: usize = 5;

/// Significant digits of an attenuation.
const ATTENUATION_DIGITS: usize = 4;

/// Returns the waves of a single frequency, or over which of several frequencies each wave propagates.
pub(super) fn table(shown: &ShownModes<'_>) -> String {
    let BandModes { surroundings, frequencies } = shown.modes;
    let place = match surroundings {
        BoneSurroundings::Vacuum => "in a vacuum, without attenuation",
        BoneSurroundings::Fluids => "between coupling and marrow as half-spaces",
    };
    let (at, waves) = match frequencies.as_slice() {
        [(frequency, found)] => {
            (format!("{} MHz", digits(1e-6 * frequency, FREQUENCY_DIGITS)), single(&found.modes))
        }
        several => (format!("{} frequencies", several.len()), ranges(&shown.modes.ranges())),
    };
    let mut text = wrapped(&format!("guided waves of the bone at {at}, {place}"));
    text.push_str(&format!("\n{waves}"));
    if *surroundings == BoneSurroundings::Fluids {
        text.push_str(&format!("\n{}", completeness(frequencies)));
    }
    if let Some(directory) = shown.directory {
        text.push_str(&format!(
            "\n{}",
            wrapped(&format!("a row for each, and a figure, in {}", visible::path(directory)))
        ));
    }
    text
}

/// Returns which waves are missing.
fn completeness(frequencies: &[(f64, FluidModes)]) -> String {
    let mut lost: Vec<String> = Vec::new();
    for mode in frequencies.iter().flat_map(|(_, found)| &found.lost) {
        if !lost.contains(&label(mode)) {
            lost.push(label(mode));
        }
    }
    let mut text = String::new();
    if !lost.is_empty() {
        text.push_str(&wrapped(&format!(
            "could not be followed from the vacuum everywhere: {}",
            lost.join(", ")
        )));
    }
    let unknown = frequencies.iter().filter(|(_, found)| found.others.is_none()).count();
    let most = frequencies.iter().filter_map(|(_, found)| found.others).max();
    if let Some(most) = most.filter(|most| *most > 0) {
        text.push_str(&wrapped(&format!(
            "at most {most} other waves at a frequency have no more attenuation than these, such as slow \
             ones of the fluids along the bone"
        )));
    }
    if unknown > 0 {
        text.push_str(&wrapped(&format!(
            "other waves could not be counted at {unknown} frequencies"
        )));
    }
    text
}

fn single(modes: &[Mode]) -> String {
    let heading = ["wave", "k (rad/mm)", "phase (m/s)", "group (m/s)", "attenuation (dB/cm)"];
    let mut rows = vec![heading.map(str::to_owned)];
    for mode in modes {
        let wavenumber = digits(1e-3 * mode.wavenumber, VELOCITY_DIGITS);
        let [phase, group] =
            [mode.phase_velocity, mode.group_velocity].map(|one| digits(one, VELOCITY_DIGITS));
        let attenuation = digits(attenuation(mode), ATTENUATION_DIGITS);
        rows.push([label(mode), wavenumber, phase, group, attenuation]);
    }
    aligned(&rows)
}

fn ranges(ranges: &[WaveRange]) -> String {
    let heading = ["wave", "from (MHz)", "to (MHz)", "phase velocities (m/s)", "backward at"];
    let mut rows = vec![heading.map(str::to_owned)];
    for WaveRange { label, first, last, backward } in ranges {
        let [from, to] =
            [first, last].map(|[frequency, _]| digits(1e-6 * frequency, FREQUENCY_DIGITS));
        let [begin, end] = [first, last].map(|[_, velocity]| digits(*velocity, FREQUENCY_DIGITS));
        let backward = match backward {
            0 => String::new(),
            1 => "1 frequency".to_owned(),
            several => format!("{several} frequencies"),
        };
        rows.push([label.clone(), from, to, format!("{begin} to {end}"), backward]);
    }
    aligned(&rows)
}
