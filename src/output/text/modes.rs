//! The guided waves of a bone.

use osteon_common::visible;
use osteon_local::modes::{WaveRange, label};
use osteon_solver::Mode;

use super::layout::{aligned, wrapped};
use super::number::{VELOCITY_DIGITS, digits};
use crate::output::ShownModes;

/// Significant digits of a frequency.
const FREQUENCY_DIGITS: usize = 5;

/// Returns the waves of a single frequency, or over which of several frequencies each wave propagates.
pub(super) fn table(shown: &ShownModes<'_>) -> String {
    let mut text = match shown.modes.frequencies.as_slice() {
        [(frequency, modes)] => {
            let megahertz = digits(1e-6 * frequency, FREQUENCY_DIGITS);
            let heading = wrapped(&format!(
                "guided waves of the bone in a vacuum at {megahertz} MHz, without attenuation"
            ));
            format!("{heading}\n{}", single(modes))
        }
        several => {
            let heading = wrapped(&format!(
                "guided waves of the bone in a vacuum at {} frequencies, without attenuation",
                several.len()
            ));
            format!("{heading}\n{}", ranges(&shown.modes.ranges()))
        }
    };
    if let Some(directory) = shown.directory {
        text.push_str(&format!(
            "\n{}",
            wrapped(&format!("a row for each, and a figure, in {}", visible::path(directory)))
        ));
    }
    text
}

fn single(modes: &[Mode]) -> String {
    let heading = ["wave", "wavenumber (rad/mm)", "phase velocity (m/s)", "group velocity (m/s)"];
    let mut rows = vec![heading.map(str::to_owned)];
    for mode in modes {
        let wavenumber = digits(1e-3 * mode.wavenumber, VELOCITY_DIGITS);
        let [phase, group] =
            [mode.phase_velocity, mode.group_velocity].map(|one| digits(one, VELOCITY_DIGITS));
        rows.push([label(mode), wavenumber, phase, group]);
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
