//! `materials`: the published stiffness that job and case files can use by name.

use anyhow::anyhow;
use osteon_common::field_path::quoted;
use osteon_files::materials::{self, Material};
use serde_json::{Value, json};

use crate::arguments::MaterialsArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::prepared_command::Ended;
use crate::resolved::OutputFormat;

/// Prints the list, or one material with its values and reference.
pub(super) fn print(arguments: &MaterialsArguments) -> Ended {
    let shown: Vec<_> = match &arguments.name {
        None => materials::all().iter().collect(),
        Some(name) => {
            let found: Vec<_> =
                materials::all().iter().filter(|(known, _)| known == name).collect();
            if found.is_empty() {
                return Err(CommandFailure::bad_input(anyhow!(
                    "there is no material {}; `osteon materials` lists them",
                    quoted(name)
                )));
            }
            found
        }
    };
    let text = match (arguments.json, &shown[..]) {
        (true, _) => format!("{:#}\n", Value::from_iter(shown.iter().map(|one| object(one)))),
        (false, [one]) if arguments.name.is_some() => details(one),
        (false, all) => list(all),
    };
    output::stdout(OutputFormat::Text).verbatim(&text).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

fn list(all: &[&(&str, Material)]) -> String {
    let width = all.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let lines = all.iter().map(|(name, one)| format!("{name:width$}  {}\n", one.description));
    let hint = "\n`osteon materials NAME` prints values and reference. In a case file:\n\n    \
                bone = { material = \"NAME\" }\n\nIn a job file, in [parameters]:\n\n    \
                material = \"NAME\"\n";
    lines.chain([hint.to_owned()]).collect()
}

fn details((name, material): &(&str, Material)) -> String {
    let doi = material.doi.as_ref().map(|doi| format!("https://doi.org/{doi}\n"));
    let values = Material::PARAMETERS.into_iter().filter_map(|parameter| {
        let value = material.value(parameter)?;
        let unit = match parameter.unit() {
            "" => String::new(),
            unit => format!("  # {unit}"),
        };
        // As people write moduli.
        let value = if value < 1e9 { format!("{value:?}") } else { format!("{:?}e9", value / 1e9) };
        Some(format!("{} = {value}{unit}\n", parameter.name()))
    });
    let values: String = values.collect();
    let text = output::wrapped(&format!("{}\nchecked: {}\n", material.reference, material.checked));
    let density = output::wrapped(&format!("density: {}\n", material.density_origin));
    format!(
        "{name}: {}\n\n{values}\n{text}{density}{}",
        material.description,
        doi.unwrap_or_default()
    )
}

fn object((name, material): &(&str, Material)) -> Value {
    let mut object = json!({
        "name": name,
        "description": material.description,
        "reference": material.reference,
        "doi": material.doi,
        "checked": material.checked,
        "density_origin": material.density_origin,
    });
    for parameter in Material::PARAMETERS {
        object[parameter.name()] = material.value(parameter).into();
    }
    object
}
