//! The variables of a file of MATLAB 5 to 7.2.
//!
//! Vectors of numbers are columns, those in structures, too; matrices and all else are passed over.

use osteon_common::limits;

use super::content::{Content, NumberColumn, is_vector, tables_of};
use super::problem::Problem;
use crate::arrays::matlab::{self, MatlabContent, MatlabVariable};

const WHAT: &str = "a MATLAB file";

/// Returns a table of the file's vectors for each length.
pub(super) fn tables(bytes: &[u8]) -> Result<Vec<Content>, Problem> {
    let mut columns = Vec::new();
    let mut take = |MatlabVariable { name, shape, content }: MatlabVariable<'_>| {
        if let MatlabContent::Numbers(numbers, bytes) = content
            && is_vector(&shape)
        {
            columns.push(NumberColumn { name, numbers: numbers.decode(bytes) });
        }
    };
    let visited = matlab::visit(bytes, limits::FILE_BYTES_MAX, &mut take);
    visited.map_err(|error| Problem::Damaged { what: WHAT, reason: error.to_string() })?;
    if columns.is_empty() {
        return Err(Problem::NoVectors { what: WHAT });
    }
    Ok(tables_of(&columns, WHAT))
}
