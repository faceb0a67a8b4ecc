//! How a result was computed: what decides its bits, and the derivatives behind its intervals.

use osteon_files::report::{Identification, Moment, ResultFile};

use super::layout::aligned;
use super::number::digits;
use super::result::readable;

/// Returns the details, after an empty line.
pub(super) fn text(result: &ResultFile) -> String {
    let mut text = String::from("\n");
    if let ResultFile::Identification(found) = result {
        text.push_str(&slopes(found));
    }
    text.push_str(&aligned(&origin(result)));
    text
}

/// Returns what decides the bits of the result.
fn origin(result: &ResultFile) -> Vec<[String; 2]> {
    let row = |name: &str, value: String| [name.to_owned(), value];
    let (mut rows, seed, sampling, scrambles, control_variate, version, numerics) = match result {
        ResultFile::Identification(found) => {
            let rows = vec![
                row("search", found.search.method.name().to_owned()),
                row("objective", found.objective.name().to_owned()),
            ];
            let Identification { seed, sampling, scrambles, control_variate, .. } = &**found;
            (rows, seed, sampling, scrambles, control_variate, &found.version, found.numerics)
        }
        ResultFile::Propagation(found) => (
            Vec::new(),
            &found.seed,
            &found.sampling,
            &found.scrambles,
            &found.control_variate,
            &found.version,
            found.numerics,
        ),
    };
    let scrambled = if *scrambles > 1 { format!(", {scrambles} scrambles") } else { String::new() };
    let controlled = if *control_variate { ", control variate" } else { "" };
    rows.push(row("sampling", format!("{}{scrambled}{controlled}", sampling.name())));
    rows.push(row("seed", seed.to_string()));
    rows.push(row("computed by", format!("osteon {version}, numerics {numerics}")));
    rows
}

/// Returns the relative changes of the moments for a relative change of each free parameter.
fn slopes(found: &Identification) -> String {
    let Some(slopes) = found.sensitivities().filter(|slopes| !slopes.is_empty()) else {
        return String::new();
    };
    let header = ["if a parameter grows by 1 %", "mean velocity", "coefficient of variation"];
    let mut rows = vec![header.map(str::to_owned)];
    for (parameter, of) in slopes {
        let change = |moment: Moment| {
            let slope = of.moments.get(moment);
            slope.map_or("unknown".to_owned(), |slope| format!("{} %", digits(slope, 3)))
        };
        rows.push([
            readable(*parameter),
            change(Moment::Mean),
            change(Moment::CoefficientOfVariation),
        ]);
    }
    format!("{}\n", aligned(&rows))
}
