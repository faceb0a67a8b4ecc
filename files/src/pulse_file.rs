//! Files of the samples of a pulse: text of two columns, time in s and value, or NPY.

use std::io;
use std::path::Path;

use osteon_common::pulse_samples::{NoPulse, PulseSamples, SAMPLES};
use thiserror::Error;

use crate::arrays::{DamagedArray, npy};
use crate::user_file;

/// Limit of a file's length: two numbers of at most 64 characters for each sample that a pulse may have.
const BYTES_MAX: u64 = 128 * SAMPLES.max;
/// Largest difference of a time from the one that equal steps give, relative to the step.
const UNEVEN_MAX: f64 = 0.01;

/// Why a file holds no samples.
#[derive(Debug, Error)]
pub(crate) enum PulseFileError {
    #[error("cannot be read: {0}")]
    Io(#[from] io::Error),
    #[error("has more than {BYTES_MAX} bytes, enough for {} samples", SAMPLES.max)]
    Long,
    #[error("has a line {line} that is not two numbers, time in s and value")]
    Line { line: usize },
    #[error("is not an array of two columns of numbers, time in s and value: {0}")]
    Array(DamagedArray),
    #[error(
        "is not an array of two columns of numbers, time in s and value: its shape is {shape:?}"
    )]
    Shape { shape: Vec<usize> },
    #[error("has {count} rows; at least {} are needed", SAMPLES.min)]
    Short { count: usize },
    #[error(
        "has times that do not rise by equal steps from the first to the last: row {row} is off"
    )]
    Uneven { row: usize },
}

/// Reads the samples in the file at `path`; one that ends in `.npy` is an array, any other is text.
/// The inner error: the file was read, but its samples are no pulse.
pub(crate) fn read(path: &Path) -> Result<Result<PulseSamples, NoPulse>, PulseFileError> {
    let bytes = user_file::read(path, BYTES_MAX)?.ok_or(PulseFileError::Long)?;
    let is_array = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npy"));
    let rows = if is_array { array(&bytes)? } else { text(&String::from_utf8_lossy(&bytes))? };
    let step = step(&rows)?;
    let values: Vec<f64> = rows.iter().map(|[_, value]| *value).collect();
    Ok(PulseSamples::new(step, &values))
}

/// Returns the rows of a text. Its first line may be a header; empty lines and comments (`#`) are passed over.
fn text(text: &str) -> Result<Vec<[f64; 2]>, PulseFileError> {
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut lines = lines.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let mut rows = Vec::new();
    for (place, (index, line)) in lines.by_ref().enumerate() {
        match row(line) {
            Some(row) => rows.push(row),
            None if place == 0 => {}
            None => return Err(PulseFileError::Line { line: index + 1 }),
        }
    }
    Ok(rows)
}

fn row(line: &str) -> Option<[f64; 2]> {
    let fields = line.split([',', ';', '\t', ' ']).map(str::trim).filter(|field| !field.is_empty());
    let numbers: Option<Vec<f64>> = fields.map(|field| field.parse().ok()).collect();
    numbers?.try_into().ok()
}

/// Returns the rows of an array in NumPy's format.
fn array(bytes: &[u8]) -> Result<Vec<[f64; 2]>, PulseFileError> {
    let header = npy::header(bytes).map_err(PulseFileError::Array)?;
    header.check_length(bytes.len() as u64).map_err(PulseFileError::Array)?;
    let &[rows, 2] = header.shape.as_slice() else {
        return Err(PulseFileError::Shape { shape: header.shape });
    };
    let numbers = header.numbers.decode(bytes.get(header.data..).unwrap_or_default());
    let (by_row, by_column) = if header.is_by_columns { (1, rows) } else { (2, 1) };
    Ok((0..rows).map(|row| [numbers[by_row * row], numbers[by_row * row + by_column]]).collect())
}

/// Returns the step of the rows' times, s.
fn step(rows: &[[f64; 2]]) -> Result<f64, PulseFileError> {
    let count = rows.len();
    if (count as u64) < SAMPLES.min {
        return Err(PulseFileError::Short { count });
    }
    let (first, last) = (rows[0][0], rows[count - 1][0]);
    let step = (last - first) / (count - 1) as f64;
    let even = |index: usize| first + step * index as f64;
    let is_off = |(index, row): (usize, &[f64; 2])| {
        let off = (row[0] - even(index)).abs();
        off.is_nan() || off > UNEVEN_MAX * step
    };
    match rows.iter().enumerate().position(is_off) {
        None => Ok(step),
        Some(index) => Err(PulseFileError::Uneven { row: index + 1 }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forty samples of a pulse of about 1 MHz at steps of 50 ns.
    fn rows() -> Vec<[f64; 2]> {
        let value = |t: f64| libm::sin(6.3 * t) * libm::exp(-4.0 * (t - 1.0) * (t - 1.0));
        (1..=40).map(|j| 0.05 * f64::from(j)).map(|t| [1e-6 * t, value(t)]).collect()
    }

    fn check(name: &str, content: &[u8]) -> String {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join(name);
        std::fs::write(&path, content).unwrap();
        match read(&path) {
            Ok(Ok(samples)) => format!("{} at {:e}", samples.values().len(), samples.step() as f32),
            Ok(Err(refused)) => refused.to_string(),
            Err(error) => error.to_string(),
        }
    }

    fn written(separator: &str, rows: &[[f64; 2]]) -> String {
        rows.iter().map(|[t, value]| format!("{t:e}{separator}{value}\n")).collect()
    }

    #[test]
    fn texts_of_two_columns_are_read_and_others_refused() {
        let plain = written(",", &rows());
        for (content, expected) in [
            (plain.clone(), "40 at 5e-8"),
            (format!("time,pressure\n{plain}"), "40 at 5e-8"),
            (
                format!("# recorded in water\n\ntime (s);value\n{}", written(";", &rows())),
                "40 at 5e-8",
            ),
            (written("\t", &rows()), "40 at 5e-8"),
            (
                format!("{plain}2e-6,oops\n"),
                "has a line 41 that is not two numbers, time in s and value",
            ),
            (
                format!("{plain}3e-6,0.0\n"),
                "has times that do not rise by equal steps from the first to the last: row 2 is off",
            ),
            (written(",", &rows()[..7]), "has 7 rows; at least 8 are needed"),
            (
                format!("{plain}1,2,3\n"),
                "has a line 41 that is not two numbers, time in s and value",
            ),
        ] {
            assert_eq!(check("pulse.csv", content.as_bytes()), expected, "{content:.60}");
        }
    }

    /// Returns a file as NumPy 2.4 writes it.
    fn npy(descr: &str, is_by_columns: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let header =
            format!("{{'descr': '{descr}', 'fortran_order': {is_by_columns}, 'shape': {shape}, }}");
        let header = format!("{header:117}\n");
        let length = u16::try_from(header.len()).unwrap().to_le_bytes();
        [&b"\x93NUMPY\x01\x00"[..], &length, header.as_bytes(), data].concat()
    }

    #[test]
    fn arrays_of_numpy_are_read_in_both_orders_and_precisions() {
        let rows = rows();
        let bytes = |numbers: &[f64]| -> Vec<u8> {
            numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
        };
        let flat: Vec<f64> = rows.iter().flatten().copied().collect();
        let columns: Vec<f64> =
            [0, 1].iter().flat_map(|&k| rows.iter().map(move |row| row[k])).collect();
        let single: Vec<u8> = flat.iter().flat_map(|&x| (x as f32).to_le_bytes()).collect();
        let (flat, columns) = (bytes(&flat), bytes(&columns));
        let is_no_array = "is not an array of two columns of numbers, time in s and value: ";
        for (content, expected) in [
            (npy("<f8", "False", "(40, 2)", &flat), "40 at 5e-8".to_owned()),
            (npy("<f8", "True", "(40, 2)", &columns), "40 at 5e-8".to_owned()),
            (npy("<f4", "False", "(40, 2)", &single), "40 at 5e-8".to_owned()),
            (
                npy("<f8", "False", "(2, 40)", &columns),
                format!("{is_no_array}its shape is [2, 40]"),
            ),
            (
                npy("<f8", "False", "(18446744073709551615, 2)", &flat),
                format!(
                    "{is_no_array}its shape is [18446744073709551615, 2], more than any file has"
                ),
            ),
            (
                npy("<f8", "False", "(40, 2)", &flat[..300]),
                format!("{is_no_array}it has 428 bytes, and an array of the shape [40, 2] has 768"),
            ),
            (
                npy("<c8", "False", "(40, 2)", &flat),
                format!(
                    "{is_no_array}its numbers are \"<c8\"; they must be integers or floating-point numbers of \
                     1 to 8 bytes"
                ),
            ),
            (b"no array".to_vec(), format!("{is_no_array}it is no array of NumPy")),
            (
                b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec(),
                format!("{is_no_array}its header has 4294967295 bytes"),
            ),
        ] {
            assert_eq!(check("pulse.npy", &content), expected);
        }
    }
}
