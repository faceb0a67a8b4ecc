//! A first job file for a file of velocities, as people have them.
//!
//! How the file is written is found out by the reader of jobs (`velocities.rs`); here are added the
//! columns of groups and subjects. What was understood is said in words, and written as keys of `[data]`,
//! so that nothing is guessed again when the job is run.

mod roles;
mod template;

use std::path::Path;

use thiserror::Error;

use crate::velocities::{self, CsvError};

use self::roles::Roles;

pub use self::template::without_data;

/// Why no job file can be written for a file of velocities.
#[derive(Debug, Error)]
#[error("{}", first_of(problems))]
pub struct InitError {
    problems: Vec<CsvError>,
}

/// Returns the first problems, a line each.
fn first_of(problems: &[CsvError]) -> String {
    let shown: Vec<_> = problems.iter().take(PROBLEMS_MAX).map(CsvError::to_string).collect();
    shown.join("\n")
}

/// Most problems that are shown.
const PROBLEMS_MAX: usize = 2;

/// A job file for a CSV file.
#[derive(Debug)]
pub struct FirstJob {
    /// The text of the job file.
    pub text: String,
    /// Findings about the CSV file, a sentence each.
    pub understood: Vec<String>,
}

/// Looks at the file at `path`, and returns a job file that names it `name`.
///
/// # Errors
/// If the file cannot be read, or has no column that may be one of velocities, or more than one.
pub fn of_csv(path: &Path, name: &str) -> Result<FirstJob, InitError> {
    let refused = |problems| InitError { problems };
    let table = velocities::understand(path).map_err(refused)?;
    let roles = Roles::from_table(&table);
    let mut understood = vec![table.described()];
    let data = template::data_section(name, &table, &roles);
    let missing = table.missing().to_vec();
    let measured = velocities::read_as_understood(path, table, &roles.named()).map_err(refused)?;
    understood.extend(measured.account.described(&missing));
    understood.extend(roles.described());
    let picking = measured.origin.picking.as_ref().map(template::picking_section);
    let text = template::of_data(&data) + &picking.unwrap_or_default();
    Ok(FirstJob { text, understood })
}
