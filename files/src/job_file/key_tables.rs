//! The tables of `docs/job-files.md`, in Markdown.

use osteon_common::bone_structure::PorosityProfile;
use osteon_common::case::Setup;
use osteon_common::fields::{DeclaredKey, DeclaredValue, Key, entries};
use osteon_common::job::{PosteriorSettings, RunSettings};
use osteon_common::parameters::{BONE_PARAMETERS, Parameter};
use osteon_common::porosity::{self, CasePorosityModel, POROSITY, PorosityModel};

use crate::toml_text;

use super::{data_section, parameters, posterior, priors};

/// Returns the table of the keys that case and job files share.
pub fn setup_table() -> String {
    let mut setup = Setup::default();
    let sections = setup.sections().map(|(key, section)| rows(key.name, &entries(section)));
    table(&sections.concat())
}

/// Returns the table of the keys that give a bone by its porosity. Those of the matrix belong to case files
/// alone.
pub fn porosity_table() -> String {
    let (model, path) = (PorosityModel::KEY, format!("bone.{}", POROSITY.name));
    table(&format!(
        "{}{}{}{}",
        row(&path, "", &porosity::ACCEPTED.to_string(), POROSITY.meaning),
        rows(&path, &entries(&mut PorosityProfile::default())),
        row(&format!("bone.{}", model.name), "", "", model.meaning),
        rows(&format!("bone.{}", model.name), &entries(&mut CasePorosityModel::default())),
    ))
}

/// Returns the table of the other keys of a job file.
pub fn job_table() -> String {
    let special = |path: &str, keys: &[Key]| -> String {
        keys.iter().map(|key| row(&format!("{path}.{}", key.name), "", "", key.meaning)).collect()
    };
    let names = |parameters: &[Parameter]| {
        let quoted: Vec<_> =
            parameters.iter().map(|parameter| format!("`{}`", parameter.name())).collect();
        quoted.join(", ")
    };
    let (of_bone, of_setup) = Parameter::ALL.split_at(BONE_PARAMETERS);
    let each = format!(
        "either `start` and `bounds`, or `fixed`, for each of {}; to search a quantity of the setup, \
         `bounds` for {}",
        names(of_bone),
        names(of_setup)
    );
    let section = PosteriorSettings::KEY;
    let mut settings = RunSettings::default();
    let declared = settings.sections().map(|(key, section)| rows(key.name, &entries(section)));
    table(&format!(
        "{}{}{}{}{}{}{}{}{}",
        special("data", &data_section::keys()),
        special("parameters", &[parameters::MATERIAL]),
        row("parameters.NAME", "", "", &each),
        special("parameters.NAME", &parameters::KEYS),
        declared.concat(),
        special("search.priors.NAME", &priors::KEYS),
        row(section.name, "", "", section.meaning),
        rows(section.name, &entries(&mut PosteriorSettings::default())),
        special("posterior.priors.NAME", &posterior::KEYS),
    ))
}

fn table(rows: &str) -> String {
    format!("| key | default | allowed | meaning |\n|---|---|---|---|\n{rows}")
}

fn row(path: &str, default: &str, allowed: &str, meaning: &str) -> String {
    // A bar ends a cell, within code, too.
    let meaning = meaning.replace('|', "\\|");
    format!("| `{path}` | {default} | {allowed} | {meaning} |\n")
}

fn rows(table: &str, entries: &[DeclaredKey]) -> String {
    entries.iter().map(|entry| rows_of(table, entry)).collect()
}

fn rows_of(table: &str, DeclaredKey { key, value, condition }: &DeclaredKey) -> String {
    let path = format!("{table}.{}", key.name);
    let meaning = match condition {
        Some(condition) => format!("only {}: {}", condition.description, key.meaning),
        None => key.meaning.to_owned(),
    };
    let default = match value {
        DeclaredValue::Table(_) | DeclaredValue::List { .. } => None,
        value => toml_text::value(value),
    };
    let default = default.map(|text| format!("`{text}`")).unwrap_or_default();
    let own = row(&path, &default, &allowed(value), &meaning);
    match value {
        DeclaredValue::Table(entries) => own + &rows(&path, entries),
        DeclaredValue::List { keys, .. } => own + &elements(&path, keys),
        _ => own,
    }
}

/// Returns the rows of the keys of a list's elements, which have no defaults.
fn elements(list: &str, keys: &[DeclaredKey]) -> String {
    let each = |entry: &DeclaredKey| {
        let path = format!("{list}[].{}", entry.key.name);
        row(&path, "", &allowed(&entry.value), entry.key.meaning)
    };
    keys.iter().map(each).collect()
}

fn allowed(value: &DeclaredValue) -> String {
    match value {
        DeclaredValue::Number(_, accepted) => accepted.interval.to_string(),
        DeclaredValue::Whole(_, accepted) => accepted.to_string(),
        DeclaredValue::Boolean(_) => "`true` or `false`".to_owned(),
        DeclaredValue::Choice { names, .. } => {
            names.iter().map(|name| format!("`\"{name}\"`")).collect::<Vec<_>>().join(" or ")
        }
        DeclaredValue::List { max, .. } => format!("a list of 1 to {max} tables"),
        DeclaredValue::Numbers { accepted, max, .. } => {
            format!("a list of at most {max} numbers, each {accepted}")
        }
        DeclaredValue::Table(_) | DeclaredValue::CustomTable => String::new(),
    }
}
