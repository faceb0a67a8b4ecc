//! Tables of one series: a column of times, then a column for each receiver, headed by its position.

use osteon_common::limits::{SIGNAL_LENGTH_MAX, SIGNAL_SAMPLES_MAX};

use crate::reading_error::SignalFault;

/// Largest distance of a time from the one that equal steps give, relative to the step.
const UNEVEN_MAX: f64 = 1e-3;
/// Most characters of a cell that a message repeats.
const SHOWN_MAX: usize = 40;

/// A table as it stands in its file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TraceTable {
    /// Heading of each receiver's column: its x1, m.
    pub(crate) positions: Vec<f64>,
    /// First time and step, in the file's unit.
    pub(crate) start: f64,
    pub(crate) step: f64,
    /// Samples of each receiver.
    pub(crate) receivers: Vec<Vec<f64>>,
}

/// Reads a table from its text. Empty lines and comments (`#`) are passed over.
pub(crate) fn parse(text: &str) -> Result<TraceTable, SignalFault> {
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut lines = lines
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (line, header) = lines.next().ok_or_else(|| SignalFault::damaged("it has no lines"))?;
    let positions = positions(line, header)?;
    let columns = positions.len();
    let (mut times, mut receivers) = (Vec::new(), vec![Vec::new(); columns]);
    for (line, row) in lines {
        let count = row.split(',').count();
        if count != columns + 1 {
            let problem = format!("has {count} fields, and the header has {}", columns + 1);
            return Err(SignalFault::line(line, problem));
        }
        if times.len() >= SIGNAL_LENGTH_MAX || (times.len() * columns) as u64 >= SIGNAL_SAMPLES_MAX
        {
            let problem = format!("is beyond the {} samples that a signal may have", times.len());
            return Err(SignalFault::line(line, problem));
        }
        for (column, cell) in row.split(',').enumerate() {
            let number = number(line, column, cell)?;
            match column.checked_sub(1) {
                None => times.push((line, number)),
                Some(receiver) => receivers[receiver].push(number),
            }
        }
    }
    let (start, step) = axis(&times)?;
    Ok(TraceTable { positions, start, step, receivers })
}

/// Returns the positions in the header.
fn positions(line: usize, header: &str) -> Result<Vec<f64>, SignalFault> {
    let mut names = header.split(',').map(str::trim);
    let first = names.next().unwrap_or_default();
    if first != "time" {
        let problem = format!(
            "its first field is {}; the first column is `time`, and a column for each receiver follows, headed \
             by its x1 in m",
            quoted_beginning(first)
        );
        return Err(SignalFault::line(line, problem));
    }
    let positions = names.enumerate().map(|(index, name)| {
        name.parse().ok().filter(|position: &f64| position.is_finite()).ok_or_else(|| {
            let column = index + 2;
            let problem = format!(
                "column {column} is headed {}; a receiver's column is headed by its x1, a number in m",
                quoted_beginning(name)
            );
            SignalFault::line(line, problem)
        })
    });
    let positions: Vec<f64> = positions.collect::<Result<_, _>>()?;
    match positions.is_empty() {
        true => Err(SignalFault::line(line, "there is no column of a receiver")),
        false => Ok(positions),
    }
}

fn number(line: usize, column: usize, cell: &str) -> Result<f64, SignalFault> {
    let number = cell.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| {
        let problem = format!(
            "column {} is {}; it must be a finite number",
            column + 1,
            quoted_beginning(cell.trim())
        );
        SignalFault::line(line, problem)
    })
}

/// Returns first time and step of the times, which must be equally spaced.
fn axis(times: &[(usize, f64)]) -> Result<(f64, f64), SignalFault> {
    let (Some(&(_, first)), Some(&(_, last))) = (times.first(), times.last()) else {
        return Err(SignalFault::damaged("it has no rows below its header"));
    };
    if times.len() < 2 {
        return Err(SignalFault::damaged("it has one row below its header"));
    }
    let step = (last - first) / (times.len() - 1) as f64;
    let even = |index: usize| (index as f64).mul_add(step, first);
    let is_off = |(index, (_, time)): (usize, &(usize, f64))| {
        let off = (time - even(index)).abs();
        step <= 0.0 || off > UNEVEN_MAX * step
    };
    match times.iter().enumerate().position(is_off) {
        None => Ok((first, step)),
        Some(index) => Err(SignalFault::line(
            times[index].0,
            format!(
                "the time is {:?}; from {first:?} to {last:?} in {} equal steps it would be {:e}",
                times[index].1,
                times.len() - 1,
                even(index)
            ),
        )),
    }
}

/// Returns the beginning of a text in quotation marks, for a message.
fn quoted_beginning(text: &str) -> String {
    let short: String = text.chars().take(SHOWN_MAX).collect();
    let more = if text.chars().count() > SHOWN_MAX { "…" } else { "" };
    format!("{short:?}{more}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: &str) {
        let found = match parse(text) {
            Ok(table) => format!(
                "{:?} from {:e} every {:e}: {:?}",
                table.positions, table.start, table.step, table.receivers
            ),
            Err(fault) => fault.to_string(),
        };
        assert_eq!(found, expected, "{text}");
    }

    #[test]
    fn tables_are_read_and_what_is_wrong_is_located() {
        check(
            "# of a case\ntime,0.01,0.02\n0.0,1,2\n1e-8,3,4e-3\n",
            "[0.01, 0.02] from 0e0 every 1e-8: [[1.0, 3.0], [2.0, 0.004]]",
        );
        for (text, expected) in [
            ("", "is damaged: it has no lines"),
            ("time,0.01\n", "is damaged: it has no rows below its header"),
            ("time,0.01\n0.0,1\n", "is damaged: it has one row below its header"),
            ("time\n0.0\n", "line 1: there is no column of a receiver"),
            (
                "t,0.01\n0.0,1\n",
                "line 1: its first field is \"t\"; the first column is `time`, and a column for each receiver \
                 follows, headed by its x1 in m",
            ),
            (
                "time,r1\n0.0,1\n",
                "line 1: column 2 is headed \"r1\"; a receiver's column is headed by its x1, a number in m",
            ),
            ("time,0.01\n0.0,1\n1e-8\n", "line 3: has 1 fields, and the header has 2"),
            (
                "time,0.01\n0.0,1\n1e-8,NaN\n",
                "line 3: column 2 is \"NaN\"; it must be a finite number",
            ),
            (
                "time,0.01\n0.0,1\n1e-8,1;0\n",
                "line 3: column 2 is \"1;0\"; it must be a finite number",
            ),
            (
                "time,0.01\n0.0,1\n1e-8,2\n3e-8,2\n",
                "line 3: the time is 1e-8; from 0.0 to 3e-8 in 2 equal steps it would be 1.5e-8",
            ),
            (
                "time,0.01\n1e-8,1\n0.0,2\n",
                "line 2: the time is 1e-8; from 1e-8 to 0.0 in 1 equal steps it would be 1e-8",
            ),
        ] {
            check(text, expected);
        }
    }
}
