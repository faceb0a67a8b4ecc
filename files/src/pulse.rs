//! `pulse` of a section `[probe]`: a name, a tone, samples, or the name of a file of samples.

use std::path::Path;

use osteon_common::fields::Key;
use osteon_common::pulse::PulseForm;
use osteon_common::pulse_samples::{NoPulse, PulseSamples, SAMPLES, STEP};

use crate::document::Value;
use crate::pulse_file;
use crate::reader::{Reader, Table};

/// The keys of a pulse that is a table.
pub(crate) const KEYS: [Key; 4] = [
    Key { name: "tone", meaning: "cycles of a tone; with 2 it is the paper's pulse" },
    Key {
        name: "file",
        meaning: "path of a file of samples, relative to this file's directory: CSV or another text of two \
                  columns, time in s and value, or NPY with an array of two columns",
    },
    Key { name: "step", meaning: "with `samples`: the time between them, s" },
    Key {
        name: "samples",
        meaning: "the pulse at equal steps, in any unit, from one step after its beginning",
    },
];
const FORMS: &str = "must be \"paper\", \"ricker\", { tone = CYCLES }, { file = PATH } or { step = SECONDS, samples = […] }";

/// Reads the pulse of the table `probe` of a file in `directory`; the default after recording a violation.
pub(crate) fn read(reader: &mut Reader, probe: &Table<'_>, directory: &Path) -> PulseForm {
    let key = PulseForm::KEY.name;
    let Some(node) = probe.get(key) else { return PulseForm::default() };
    match &node.value {
        Value::Table(_) => {}
        Value::Text(name) => return named(reader, probe, name),
        _ => {
            reader.violations.add(probe.path(key), format!("is {}; it {FORMS}", node.value));
            return PulseForm::default();
        }
    }
    let table = reader.table(probe, key, &KEYS.map(|key| key.name));
    let given = ["tone", "file", "samples"].map(|key| table.has(key));
    let found = match given {
        [true, false, false] => tone(reader, &table),
        [false, true, false] => from_file(reader, &table, directory),
        [false, false, true] => samples(reader, &table),
        _ => {
            let cures = KEYS.map(|key| table.path(key.name));
            reader.lacks(
                table.own_path(),
                &cures,
                format!(
                    "has {} of tone, file and samples; it {FORMS}",
                    given.iter().filter(|&&is| is).count()
                ),
            );
            None
        }
    };
    if table.has("step") && !given[2] {
        reader
            .violations
            .add(table.path("step"), "belongs to `samples`, which are not given; leave it out");
    }
    found.unwrap_or_default()
}

fn named(reader: &mut Reader, probe: &Table<'_>, name: &str) -> PulseForm {
    let found = PulseForm::NAMED.into_iter().find(|(known, _)| *known == name);
    found.map(|(_, form)| form).unwrap_or_else(|| {
        let message = format!("is \"{}\"; it {FORMS}", name.escape_debug());
        reader.violations.add(probe.path(PulseForm::KEY.name), message);
        PulseForm::default()
    })
}

fn tone(reader: &mut Reader, table: &Table<'_>) -> Option<PulseForm> {
    reader.number(table, "tone").map(|cycles| PulseForm::Tone { cycles })
}

fn samples(reader: &mut Reader, table: &Table<'_>) -> Option<PulseForm> {
    let path = table.path("samples");
    if !table.has("step") {
        reader.missing(table, "step", STEP);
    }
    let nodes = reader.list(table, "samples", &format!("a list of {SAMPLES} numbers"))?;
    let values = if nodes.len() as u64 > SAMPLES.max {
        reader.violations.add(path.as_str(), NoPulse::Count { count: nodes.len() }.to_string());
        None
    } else {
        reader.numbers(&path, nodes)
    };
    let step = reader.number(table, "step")?;
    pulse(reader, path, PulseSamples::new(step, &values?))
}

fn from_file(reader: &mut Reader, table: &Table<'_>, directory: &Path) -> Option<PulseForm> {
    let name = reader.text(table, "file", "the path of a file of samples, in quotes")?;
    let path = table.path("file");
    match pulse_file::read(&directory.join(name)) {
        Ok(samples) => pulse(reader, path, samples),
        Err(error) => {
            reader.violations.add(path, format!("is \"{}\", which {error}", name.escape_debug()));
            None
        }
    }
}

fn pulse(
    reader: &mut Reader,
    path: String,
    samples: Result<PulseSamples, NoPulse>,
) -> Option<PulseForm> {
    match samples {
        Ok(samples) => Some(PulseForm::Samples(samples)),
        Err(refused) => {
            reader.violations.add(path, refused.to_string());
            None
        }
    }
}
