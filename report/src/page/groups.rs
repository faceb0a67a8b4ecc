//! Tables of groups: one row each, and the differences between them.

use super::markup::{Numbers, none, width_precision};
use crate::finding::Finding;
use crate::input::JobContext;
use crate::quantity::{NUMBER, Precision, Unit, VELOCITY};
use crate::table::NumberTable;
use crate::text::{escape, shorten};

/// Most groups of which all differences are shown.
const COMPARED_MAX: usize = 12;
/// Most rows of the table of groups.
const ROWS_MAX: usize = 400;

/// Returns the table of the groups.
pub(super) fn table(numbers: &Numbers, findings: &[Finding<'_>]) -> String {
    let rows: Vec<Vec<String>> =
        findings.iter().take(ROWS_MAX).map(|finding| row(numbers, finding)).collect();
    let columns = [
        "Group",
        "Velocities",
        "Search",
        "√(c₁₁₁₁/ρ) (m/s)",
        "95 % interval",
        "Dispersion δ",
        "95 % interval",
        "Failures",
    ];
    let mut out = super::markup::table("Results of the groups", &columns, &rows);
    if findings.len() > rows.len() {
        out.push_str(&format!(
            "<p>The first {} of {} groups; groups.csv has all.</p>",
            rows.len(),
            findings.len()
        ));
    }
    out
}

fn row(numbers: &Numbers, finding: &Finding<'_>) -> Vec<String> {
    let place = &finding.place;
    let count = finding.data.and_then(|data| data.count.flatten());
    let status = finding.status.map_or("", |status| status.name()).replace('_', " ");
    let quantity = |dispersion: bool, unit: Unit| -> [String; 2] {
        let (value, ends, at, interval) = if let Some(posterior) = finding.posterior {
            let dispersed = osteon_common::parameters::Parameter::Dispersion;
            let one = if dispersion {
                posterior.parameters.get(&dispersed)
            } else {
                Some(&posterior.bulk_velocity)
            };
            let name = if dispersion { "parameters/dispersion" } else { "bulk_velocity" };
            let at = format!("{place}/posterior/{name}");
            let ends = one.and_then(|one| one.ends());
            (one.and_then(|one| one.mean), ends, format!("{at}/mean"), format!("{at}/interval_95"))
        } else {
            let one = finding
                .identified
                .map(|found| if dispersion { &found.dispersion } else { &found.bulk_velocity });
            let name = if dispersion { "dispersion" } else { "bulk_velocity" };
            let at = format!("{place}/identified/{name}");
            let ends = one.and_then(|one| one.ends());
            (one.and_then(|one| one.value), ends, format!("{at}/value"), format!("{at}/interval"))
        };
        let precision = ends.map_or(Precision::Free, width_precision);
        [numbers.number(value, &at, unit, precision), numbers.interval(ends, &interval, unit)]
    };
    let [bulk, bulk_interval] = quantity(false, VELOCITY);
    let [dispersion, dispersion_interval] = quantity(true, NUMBER);
    vec![
        escape(finding.group.unwrap_or_default()),
        count.map_or_else(none, |count| count.to_string()),
        status,
        bulk,
        bulk_interval,
        dispersion,
        dispersion_interval,
        finding.failed_realizations().to_string(),
    ]
}

/// Returns the matrix of the differences between groups, from `comparison.csv`; `None` without one.
pub(super) fn differences(context: &JobContext, findings: &[Finding<'_>]) -> Option<String> {
    let table = context.comparison.as_ref()?;
    let names: Vec<&str> = findings.iter().filter_map(|one| one.group).take(COMPARED_MAX).collect();
    if names.len() < 2 {
        return None;
    }
    let bulk = matrix(table, &names, "bulk_velocity_difference", VELOCITY)?;
    let dispersion = matrix(table, &names, "dispersion_difference", NUMBER)?;
    let mut columns = vec!["Minus →"];
    let short: Vec<String> = names.iter().map(|name| shorten(name, 24)).collect();
    columns.extend(short.iter().map(String::as_str));
    let mut out = super::markup::table(
        "√(c₁₁₁₁/ρ) of the row’s group minus that of the column’s (m/s), with 95 % interval",
        &columns,
        &bulk,
    );
    out.push_str(&super::markup::table(
        "Dispersion of the row’s group minus that of the column’s, with 95 % interval",
        &columns,
        &dispersion,
    ));
    out.push_str(
        "<p>A difference in bold has an interval that does not contain 0. There is no correction for \
         multiple comparisons: of twenty pairs of equal groups one is bold by chance.",
    );
    if findings.len() > names.len() {
        out.push_str(" Only the first groups are shown; comparison.csv has the others.");
    }
    out.push_str("</p>");
    Some(out)
}

/// Returns the rows of a matrix of differences; `None` if the table lacks the columns.
fn matrix(table: &NumberTable, names: &[&str], key: &str, unit: Unit) -> Option<Vec<Vec<String>>> {
    let (first, second) = (table.texts("first")?, table.texts("second")?);
    let numbers = |name: String| table.numbers(&name).ok().flatten();
    let value = numbers(key.to_owned())?;
    let (lower, upper) = (numbers(format!("{key}_lower"))?, numbers(format!("{key}_upper"))?);
    let cell = |row: &str, column: &str| -> String {
        let pair = |a: &str, b: &str| {
            (0..table.len()).find(|place| first[*place] == a && second[*place] == b)
        };
        let found = match (pair(row, column), pair(column, row)) {
            (Some(at), _) => [value[at], lower[at], upper[at]],
            (None, Some(at)) => [-value[at], -upper[at], -lower[at]],
            _ => return none(),
        };
        difference(found, unit)
    };
    let row = |name: &&str| {
        let cells = names.iter().map(|column| cell(name, column));
        std::iter::once(escape(name)).chain(cells).collect()
    };
    Some(names.iter().map(row).collect())
}

/// Returns a difference with its interval as HTML, in bold if 0 is outside of it; a dash if it is not
/// known.
pub(super) fn difference([value, low, high]: [f64; 3], unit: Unit) -> String {
    if !value.is_finite() {
        return none();
    }
    if !(low.is_finite() && high.is_finite()) {
        return format!("{} (no interval)", unit.show(value, Precision::Free));
    }
    let precision = width_precision([low, high]);
    let [shown, low_shown, high_shown] =
        [value, low, high].map(|number| unit.show(number, precision));
    let text = format!("{shown} ({low_shown} to {high_shown})");
    if low > 0.0 || high < 0.0 { format!("<strong>{text}</strong>") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_read_in_both_directions() {
        let text = "first,second,d,d_lower,d_upper\na,b,10,4,16\n";
        let table = NumberTable::read(text).unwrap();
        let rows = matrix(&table, &["a", "b"], "d", VELOCITY).unwrap();
        assert_eq!(rows[0], ["a", &none(), "<strong>10.0 (4.0 to 16.0)</strong>"]);
        assert_eq!(rows[1], ["b", "<strong>-10.0 (-16.0 to -4.0)</strong>", &none()]);
        assert_eq!(matrix(&table, &["a", "b"], "e", VELOCITY), None);
    }

    #[test]
    fn a_difference_without_an_interval_says_so() {
        for (numbers, expected) in [
            ([f64::NAN; 3], none()),
            ([1.0, f64::NAN, 2.0], "1.00 (no interval)".to_owned()),
            ([1.0, -1.0, 3.0], "1.0 (-1.0 to 3.0)".to_owned()),
        ] {
            assert_eq!(difference(numbers, VELOCITY), expected);
        }
    }
}
