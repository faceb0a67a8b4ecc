//! Files of the samples of a pulse: text of two columns, time in s and value, or NPY.

use std::io;
use std::path::Path;

use npyz::{NpyFile, Order};
use osteon_common::pulse_samples::{NoPulse, PulseSamples, SAMPLES};
use thiserror::Error;

use crate::user_file;

/// Limit of a file's length: two numbers of 64 bytes for each sample that a pulse may have.
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
    #[error(
        "is not an array of two columns of floating-point numbers, time in s and value: {reason}"
    )]
    Array { reason: String },
    #[error("has {count} rows; at least {} are needed", SAMPLES.min)]
    Short { count: usize },
    #[error("has times at unequal steps, first at row {row}")]
    Uneven { row: usize },
}

/// Reads the samples in the file at `path`; one that ends in `.npy` is an array, any other is text.
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
    let refused = |reason: String| PulseFileError::Array { reason };
    let open = || NpyFile::new(bytes).map_err(|error| refused(error.to_string()));
    let header = open()?;
    let (shape, order) = (header.shape().to_vec(), header.order());
    let &[count, 2] = shape.as_slice() else {
        return Err(refused(format!("its shape is {shape:?}")));
    };
    let numbers: Vec<f64> = match open()?.into_vec::<f64>() {
        Ok(numbers) => numbers,
        Err(error) => {
            let numbers = open()?.into_vec::<f32>();
            numbers.map_err(|_| refused(error.to_string()))?.into_iter().map(f64::from).collect()
        }
    };
    let count = usize::try_from(count).unwrap_or(usize::MAX);
    let at = |row: usize, column: usize| match order {
        Order::C => numbers[2 * row + column],
        Order::Fortran => numbers[count * column + row],
    };
    // The array has 2 × `count` numbers: `into_vec` has read as many.
    Ok((0..count.min(numbers.len() / 2)).map(|row| [at(row, 0), at(row, 1)]).collect())
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
    use npyz::WriterBuilder as _;

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
            (format!("{plain}3e-6,0.0\n"), "has times at unequal steps, first at row 2"),
            (written(",", &rows()[..7]), "has 7 rows; at least 8 are needed"),
            (
                format!("{plain}1,2,3\n"),
                "has a line 41 that is not two numbers, time in s and value",
            ),
        ] {
            assert_eq!(check("pulse.csv", content.as_bytes()), expected, "{content:.60}");
        }
    }

    fn npy<T: npyz::AutoSerialize + Copy>(numbers: &[T], order: Order, shape: &[u64]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let options = npyz::WriteOptions::new().shape(shape).order(order);
        let mut writer = options.default_dtype().writer(&mut bytes).begin_nd().unwrap();
        writer.extend(numbers).unwrap();
        writer.finish().unwrap();
        bytes
    }

    #[test]
    fn arrays_of_numpy_are_read_in_both_orders_and_precisions() {
        let rows = rows();
        let flat: Vec<f64> = rows.iter().flatten().copied().collect();
        let columns: Vec<f64> =
            [0, 1].iter().flat_map(|&k| rows.iter().map(move |r| r[k])).collect();
        let single: Vec<f32> = flat.iter().map(|&x| x as f32).collect();
        for bytes in [
            npy(&flat, Order::C, &[40, 2]),
            npy(&columns, Order::Fortran, &[40, 2]),
            npy(&single, Order::C, &[40, 2]),
        ] {
            assert_eq!(check("pulse.npy", &bytes), "40 at 5e-8");
        }
        let wide = check("pulse.npy", &npy(&columns, Order::C, &[2, 40]));
        assert!(wide.contains("its shape is [2, 40]"), "{wide}");
        assert!(check("pulse.npy", b"no array").contains("is not an array"));
    }
}
