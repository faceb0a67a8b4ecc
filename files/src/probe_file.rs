//! Probe files: probe, layers and criterion as in a case file, and how signals are recorded.

use std::path::Path;

use osteon_common::case::Setup;
use osteon_common::check;
use osteon_common::field_path::{element_path, quoted};
use osteon_common::fields::{Choice, Key};
use osteon_common::limits;
use osteon_common::signal_layout::{SignalAxis, SignalLayout, Transmitter};
use osteon_common::wave_settings::WaveSettings;

use crate::document::Format;
use crate::document_text::DocumentText;
use crate::file_error::{ContentError, FileError, Invalid, SizeLimit};
use crate::input_file::InputFile;
use crate::job_file;
use crate::reader::{self, Reader, Table};

pub use crate::toml_text::probe as to_toml;

/// The section of how signals are recorded.
pub(crate) const SIGNALS: Key = Key { name: "signals", meaning: "how the signals are recorded" };
/// Limit of a probe file's length, as of a case file's.
const SIZE_LIMIT: SizeLimit =
    SizeLimit { bytes: limits::CASE_FILE_BYTES_MAX, suffices_for: "any probe file needs" };
/// The sections of a case file that say nothing of a measurement; they are not read, so that a case may
/// describe its own traces.
const PASSED_OVER: [&str; 2] = ["solver", "bone"];

/// Keys of lists of names, with the largest number of them.
const AXES: (&str, usize) = (SignalLayout::AXES.name, limits::SIGNAL_AXES_MAX);
const TRANSMITTERS: (&str, usize) = (SignalLayout::TRANSMITTERS.name, limits::TRANSMITTERS_MAX);

/// The content of a probe file: a probe, its layers and its picking, and how its signals are recorded.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProbeDescription {
    /// Probe, layers and criterion.
    pub setup: Setup,
    /// How its signals are recorded.
    pub signals: SignalLayout,
    /// Which guided waves are found in them.
    pub waves: WaveSettings,
}

/// Reads and validates the probe file at `path`; its extension determines the format.
///
/// # Errors
/// If the file cannot be read, is malformed, or violates a rule; all violations are reported at once.
pub fn read(path: &Path) -> Result<ProbeDescription, FileError> {
    let input = InputFile::open(path, SIZE_LIMIT, Vec::new())?;
    let read = of_document(input.document(), input.directory());
    read.map_err(|content| FileError::Content { path: input.path().to_owned(), content })
}

/// Reads and validates the text of a probe file. Names of files in it are relative to the current directory.
///
/// # Errors
/// If the text is malformed or violates a rule; all violations are reported at once.
pub fn parse(text: &str, format: Format) -> Result<ProbeDescription, ContentError> {
    of_document(DocumentText::new(text, format), Path::new(""))
}

fn of_document(
    document: DocumentText<'_>,
    directory: &Path,
) -> Result<ProbeDescription, ContentError> {
    let root = document.tree()?;
    let mut reader = Reader::default();
    let [solver, bone] = PASSED_OVER;
    let table = reader.root(
        &root,
        &["layers", "probe", "picking", SIGNALS.name, WaveSettings::KEY.name, solver, bone],
    );
    let refused = |reader: &Reader| -> Result<_, ContentError> {
        let refused: Invalid = reader.refuse(document, &root);
        Err(refused.into())
    };
    if !table.is_table() {
        return refused(&reader);
    }
    // The solver's settings are read with the others, and mean nothing here.
    let setup = job_file::setup(&mut reader, &table, directory);
    let mut signals = SignalLayout::default();
    let section = reader::section(&mut reader, &table, SIGNALS.name, &mut signals);
    let given = names(&mut reader, &section, AXES, SignalAxis::Time);
    signals.axes = given.unwrap_or(signals.axes);
    signals.variable = variable(&mut reader, &section);
    let given = names(&mut reader, &section, TRANSMITTERS, Transmitter::First);
    signals.transmitters = given.unwrap_or(signals.transmitters);
    let mut waves = WaveSettings::default();
    reader::section(&mut reader, &table, WaveSettings::KEY.name, &mut waves);
    check::setup(&setup, &mut reader.violations);
    check::signals(&signals, &mut reader.violations);
    check::waves(&waves, &mut reader.violations);
    if !reader.violations.is_empty() {
        return refused(&reader);
    }
    Ok(ProbeDescription { setup, signals, waves })
}

/// Reads the name of an array; `None` if it is absent, or no name.
fn variable(reader: &mut Reader, table: &Table<'_>) -> Option<String> {
    let key = SignalLayout::VARIABLE.name;
    let name = reader.text(table, key, "the name of an array in quotes")?;
    if name.is_empty() || name.len() > limits::NAME_BYTES_MAX {
        let most = limits::NAME_BYTES_MAX;
        let message = format!("has {} bytes; it must have 1 to {most}", name.len());
        reader.violations.add(table.path(key), message);
        return None;
    }
    Some(name.to_owned())
}

/// Reads the list `key` of at most `most` choices, each as `any` is; `None` if it is absent, or one of them is no such choice.
fn names<T: Choice + Copy>(
    reader: &mut Reader,
    table: &Table<'_>,
    (key, most): (&str, usize),
    any: T,
) -> Option<Vec<T>> {
    let accepted: Vec<_> = any.names().iter().map(|name| format!("\"{name}\"")).collect();
    let accepted = accepted.join(", ");
    let nodes = reader.list(table, key, &format!("a list of {accepted}"))?;
    let path = table.path(key);
    let texts = reader.texts(&path, nodes)?;
    if texts.is_empty() || texts.len() > most {
        let count = texts.len();
        reader.violations.add(path, format!("has {count} elements; it must have 1 to {most}"));
        return None;
    }
    let mut found = Vec::with_capacity(texts.len());
    for (index, text) in texts.into_iter().enumerate() {
        let mut one = any;
        if one.choose(text) {
            found.push(one);
        } else {
            let message = format!("is {}; it must be one of {accepted}", quoted(text));
            reader.violations.add(element_path(&path, index), message);
        }
    }
    (found.len() == nodes.len()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: &str) {
        let found = match parse(text, Format::Toml) {
            Ok(ProbeDescription { setup, signals, .. }) => format!(
                "{} receivers, {:?}, {:?}, {:?}",
                setup.probe.receivers.count, signals.axes, signals.band, signals.transmitters
            ),
            Err(error) => error.to_string(),
        };
        assert!(found.contains(expected), "{text}\n{found}");
    }

    #[test]
    fn sections_of_a_case_and_signals_are_read() {
        check("", "14 receivers, [], [], [First]");
        check(
            "[probe.receivers]\ncount = 5\n[signals]\naxes = [\"receiver\", \"time\"]\nband = [0, 3e6]\n\
             transmitters = [\"second\", \"first\"]\n[bone]\ndensity = 1.0\n",
            "5 receivers, [Receiver, Time], [0.0, 3000000.0], [Second, First]",
        );
    }

    #[test]
    fn a_written_description_is_read_back() {
        let text = "[probe.receivers]\ncount = 5\n[signals]\naxes = [\"series\", \"receiver\", \"time\"]\n\
                    band = [0, 3e6]\nsampling_interval = 3e-8\nunit = \"counts\"\nfull_scale = 100.0\n\
                    transmitters = [\"second\", \"first\"]\n[picking]\nextremum = \"second\"\n";
        let description = parse(text, Format::Toml).unwrap();
        assert_eq!(parse(&to_toml(&description), Format::Toml).unwrap(), description);
        let usual = ProbeDescription::default();
        assert_eq!(parse(&to_toml(&usual), Format::Toml).unwrap(), usual);
    }

    #[test]
    fn every_violation_is_reported() {
        for (text, expected) in [
            ("[signals]\naxes = []", "signals.axes: has 0 elements; it must have 1 to 4"),
            ("[signals]\naxes = [\"time\", \"time\"]", "signals.axes: has \"time\" 2 times"),
            ("[signals]\naxes = \"time\"", "it must be a list of \"series\", \"transmitter\""),
            ("[signals]\naxes = [1]", "signals.axes[0]: is 1; it must be a text in quotes"),
            ("[signals]\nvariable = \"\"", "signals.variable: has 0 bytes; it must have 1 to 256"),
            ("[signals]\nvariable = 1", "it must be the name of an array in quotes"),
            ("[signals]\nband = [3e6, 1e6]", "its first frequency must be below its second"),
            ("[signals]\nband = [-1.0, 1e6]", "signals.band[0]: is -1"),
            ("[signals]\nsampling_interval = 0.0", "signals.sampling_interval: is 0"),
            ("[signals]\ntime_unit = \"min\"", "it must be \"s\" or \"ms\" or \"us\" or \"ns\""),
            ("[signals]\nfull_scale = -1.0", "signals.full_scale: is -1"),
            ("[probe]\ncentre_frequency = 1e6", "did you mean `center_frequency`?"),
            ("[parameters]\n", "parameters: unknown key"),
        ] {
            check(text, expected);
        }
    }
}
