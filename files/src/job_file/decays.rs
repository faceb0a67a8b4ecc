//! The keys of `[data]` that say how decays were measured.

use osteon_common::array_decay::{ELEMENT_LENGTH, Spreading, decay_error_of_gains};
use osteon_common::data::{Data, Measurements};
use osteon_common::fields::Key;
use osteon_common::observables::Observable;
use osteon_common::probe::Probe;

use crate::document::Value;
use crate::reader::{Reader, Table};

const SPREADING: &str = "decay_spreading";
const ERROR: &str = "decay_error";
const LINE: &str = "line";
const POINT: &str = "point";
/// What may be given instead of a length.
pub(super) const NAMES: [&str; 2] = [LINE, POINT];
const FORMS: &str = "\"line\" or \"point\" or the length of the elements across the array (m)";

/// The keys.
pub(super) const KEYS: [Key; 2] = [
    Key {
        name: SPREADING,
        meaning: "how the device's waves spread at right angles to the plane of the model, which has two dimensions: \
                  `\"line\"` (they do not, as in the model), `\"point\"`, or the length of the elements across the \
                  array (m, up to 0.1); required with decays, from which the part of the spreading is subtracted",
    },
    Key {
        name: ERROR,
        meaning: "standard deviation of an error that all decays have in common (dB/cm, 0 to 100), such as that \
                  of receivers whose gains differ; required with decays",
    },
];

/// Writes the keys for decays as a job has them: without the part of spreading.
pub(crate) fn to_toml(data: &Data) -> String {
    if !data.observables()[Observable::Decay] {
        return String::new();
    }
    format!("{SPREADING} = \"{LINE}\"\n{ERROR} = {:?}  # dB/cm\n", data.decay_error)
}

/// Reads the keys, which measured decays need, and makes the decays those of the model's waves.
pub(super) fn apply(reader: &mut Reader, table: &Table<'_>, probe: &Probe, data: &mut Data) {
    if !data.observables()[Observable::Decay] {
        for key in [SPREADING, ERROR].into_iter().filter(|key| table.has(key)) {
            let message = "is about measured decays, and there are none; leave it out";
            reader.violations.add(table.path(key), message);
        }
        return;
    }
    if !table.has(SPREADING) {
        let point = Spreading::Point.decay(probe, mean_velocity(data));
        let expected = format!(
            "{FORMS}: waves of a point decay by {point:.1} dB/cm more along this array than those of a line"
        );
        reader.missing(table, SPREADING, expected);
    }
    if !table.has(ERROR) {
        let of_gains = decay_error_of_gains(probe, 1.0);
        let expected = format!(
            "the standard deviation of an error that all decays have in common (dB/cm): {of_gains:.2} if the gains \
             of the receivers differ by 1 dB (standard deviation), 0 if they are known to be equal"
        );
        reader.missing(table, ERROR, expected);
    }
    data.decay_error = reader.number(table, ERROR).unwrap_or(0.0);
    if let Some(spreading) = spreading(reader, table) {
        subtract(spreading.decay(probe, mean_velocity(data)), data);
    }
}

fn spreading(reader: &mut Reader, table: &Table<'_>) -> Option<Spreading> {
    let value = &table.get(SPREADING)?.value;
    match value {
        Value::Text(text) if text == LINE => return Some(Spreading::Line),
        Value::Text(text) if text == POINT => return Some(Spreading::Point),
        Value::Integer(_) | Value::Number(_) => {}
        other => {
            reader.wrong_type(table.path(SPREADING), FORMS, other);
            return None;
        }
    }
    let length = reader.number(table, SPREADING)?;
    if !ELEMENT_LENGTH.contains(length) {
        reader.violations.add(table.path(SPREADING), ELEMENT_LENGTH.refusal(length));
        return None;
    }
    Some(Spreading::Elements(length))
}

/// Returns the mean of all velocities, m/s.
fn mean_velocity(data: &Data) -> f64 {
    let sets = (0..data.sets()).filter_map(|set| data.velocities(set));
    let (sum, count) =
        sets.flatten().fold((0.0, 0.0), |(sum, count), one| (sum + one, count + 1.0));
    sum / count
}

fn subtract(part: f64, data: &mut Data) {
    let observed = match &mut data.measurements {
        Measurements::Velocities { observables, .. } => vec![observables],
        Measurements::Groups(groups) => {
            groups.iter_mut().map(|group| &mut group.observables).collect()
        }
        Measurements::Moments { .. } => Vec::new(),
    };
    let decays = observed.into_iter().filter_map(|columns| columns[Observable::Decay].as_mut());
    decays.flatten().for_each(|decay| *decay -= part);
}
