//! How a result was computed: the settings and the program that decide its bits, and the sensitivities
//! behind its intervals.

use osteon_files::report::{Identification, Moment, ResultFile};

use super::layout::aligned;
use super::number::digits;
use super::result::readable;

/// Returns the details, after an empty line.
pub(super) fn text(result: &ResultFile) -> String {
    let mut text = String::from("\n");
    if let ResultFile::Identification(found) = result {
        text.push_str(&sensitivities(found));
    }
    text.push_str(&aligned(&settings_and_program(result)));
    text
}

/// Returns a row for each setting that decides the bits of the result, and one for the program.
fn settings_and_program(result: &ResultFile) -> Vec<[String; 2]> {
    let row = |name: &str, value: String| [name.to_owned(), value];
    let (mut rows, sampling, scrambles, control_variate) = match result {
        ResultFile::Identification(found) => {
            let rows = vec![
                row("search", found.search.method.name().to_owned()),
                row("objective", found.objective.name().to_owned()),
            ];
            (rows, found.sampling, found.scrambles, found.control_variate)
        }
        ResultFile::Propagation(found) => {
            (Vec::new(), found.sampling, found.scrambles, found.control_variate)
        }
    };
    let scrambled = if scrambles > 1 { format!(", {scrambles} scrambles") } else { String::new() };
    let controlled = if control_variate { ", control variate" } else { "" };
    rows.push(row("sampling", format!("{}{scrambled}{controlled}", sampling.name())));
    rows.push(row("seed", result.seed().to_string()));
    let program = result.program();
    let program = format!("osteon {}, numerics {}", program.version, program.numerics);
    rows.push(row("computed by", program));
    rows
}

/// Returns the table of the sensitivities: by how much each moment changes with each free parameter.
fn sensitivities(found: &Identification) -> String {
    let Some(parameters) = found.sensitivities().filter(|found| !found.is_empty()) else {
        return String::new();
    };
    let header = ["if a parameter grows by 1 %", "mean velocity", "coefficient of variation"];
    let mut rows = vec![header.map(str::to_owned)];
    for (parameter, sensitivity) in parameters {
        let cell = |moment: Moment| {
            let slope = sensitivity.moments.get(moment);
            slope.map_or("unknown".to_owned(), |slope| format!("{} %", digits(slope, 3)))
        };
        rows.push([readable(*parameter), cell(Moment::Mean), cell(Moment::CoefficientOfVariation)]);
    }
    format!("{}\n", aligned(&rows))
}
