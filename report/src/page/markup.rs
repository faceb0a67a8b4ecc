//! Numbers and tables as HTML.

use std::fmt::Write as _;

use crate::quantity::{Precision, Unit};
use crate::text::escape;

/// Numbers of one run: each is in the page with all its digits and its place in `result.json`.
pub(super) struct Numbers {
    run: usize,
}

impl Numbers {
    /// Numbers of the run with this number, from 0.
    pub(super) fn for_run(run: usize) -> Self {
        Self { run }
    }

    /// Returns a number of `result.json`; `place` is its JSON pointer there. A dash where there is none.
    pub(super) fn number(
        &self,
        value: Option<f64>,
        place: &str,
        unit: Unit,
        precision: Precision,
    ) -> String {
        let Some(value) = value else { return none() };
        let Self { run } = self;
        let (place, size, shown) = (escape(place), unit.size, unit.show(value, precision));
        format!(
            "<data value=\"{value:?}\" data-run=\"{run}\" data-at=\"{place}\" data-size=\"{size:e}\">\
             {shown}</data>"
        )
    }

    /// Returns an interval of `result.json`; `place` is that of its list of both ends.
    pub(super) fn interval(&self, ends: Option<[f64; 2]>, place: &str, unit: Unit) -> String {
        let Some([low, high]) = ends else { return none() };
        let precision = width_precision([low, high]);
        let end = |value, which: usize| {
            self.number(Some(value), &format!("{place}/{which}"), unit, precision)
        };
        format!("{} to {}", end(low, 0), end(high, 1))
    }
}

/// Returns the precision that both ends of a 95 % interval, and the value inside, should have: two
/// digits of a standard error, a quarter of its width.
pub(super) fn width_precision([low, high]: [f64; 2]) -> Precision {
    let quarter = (high - low) / 4.0;
    if quarter > 0.0 { Precision::Error(quarter) } else { Precision::Unknown }
}

/// What stands where there is no number.
pub(super) fn none() -> String {
    "<span class=\"none\">–</span>".to_owned()
}

/// Returns a table; the first field of each row is its heading. Fields are HTML.
pub(super) fn table(caption: &str, columns: &[&str], rows: &[Vec<String>]) -> String {
    let mut out = format!(
        "<div class=\"table\" tabindex=\"0\" role=\"group\" aria-label=\"{0}\"><table><caption>{0}\
         </caption><thead><tr>",
        escape(caption)
    );
    for column in columns {
        let _infallible = write!(out, "<th scope=\"col\">{}</th>", escape(column));
    }
    out.push_str("</tr></thead><tbody>");
    for row in rows {
        out.push_str("<tr>");
        for (place, field) in row.iter().enumerate() {
            let _infallible = match place {
                0 => write!(out, "<th scope=\"row\">{field}</th>"),
                _ => write!(out, "<td>{field}</td>"),
            };
        }
        out.push_str("</tr>");
    }
    out.push_str("</tbody></table></div>");
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::{NUMBER, VELOCITY};

    #[test]
    fn a_number_has_all_its_digits_and_its_place() {
        let numbers = Numbers::for_run(1);
        let shown = numbers.number(Some(3907.687), "/a/b", VELOCITY, Precision::Error(2.0));
        assert_eq!(
            shown,
            "<data value=\"3907.687\" data-run=\"1\" data-at=\"/a/b\" data-size=\"1e0\">3907.7</data>"
        );
        assert_eq!(numbers.number(None, "/a", NUMBER, Precision::Unknown), none());
    }

    #[test]
    fn an_interval_is_rounded_to_its_width() {
        let shown = Numbers::for_run(0).interval(Some([0.09, 0.11]), "/a", NUMBER);
        assert!(
            shown.contains(">0.0900</data> to ") && shown.contains(">0.1100</data>"),
            "{shown}"
        );
    }

    #[test]
    fn names_in_tables_are_escaped_by_who_writes_them() {
        let table = table("A & B", &["<x>"], &[vec!["r".to_owned(), "1".to_owned()]]);
        assert!(table.contains("A &amp; B") && table.contains("<th scope=\"col\">&lt;x&gt;</th>"));
        assert!(table.contains("<th scope=\"row\">r</th><td>1</td>"), "{table}");
    }
}
