//! Results as CSV: `history.csv` and `realizations.csv`, of groups `groups.csv` and `comparison.csv`.

use std::fmt::{self, Write as _};

use crate::inference::{Inference, Known, Quantity};
use crate::job::{Data, JobSpecification};
use crate::outcome::Outcome;
use crate::parameters::Parameter;
use crate::results::{Evaluation, JobResult};

/// The text of `history.csv`: one row per evaluation of the search, the seven parameters between its
/// number and its moments; with groups or several starts, also which of them it was for.
///
/// Moments are empty where every realization failed; a cost is `inf` at an infeasible point.
pub fn history(specification: &JobSpecification, evaluations: &[Evaluation]) -> String {
    let parameters = Parameter::ALL.map(Parameter::name).join(",");
    let names: Vec<&str> = specification.data.iter().flat_map(Data::names).collect();
    let several = specification.search.starts > 1;
    let mut out = format!("evaluation,{parameters},mean,coefficient_of_variation,cost,failures");
    out.push_str(if several { ",start" } else { "" });
    out.push_str(if names.is_empty() { "\n" } else { ",group\n" });
    for evaluation in evaluations.iter().filter(|evaluation| evaluation.role.varied.is_none()) {
        // Writing to a string does not fail.
        let _infallible = history_row(&mut out, evaluation);
        if several {
            let _infallible = write!(out, ",{}", evaluation.role.start);
        }
        if let Some(name) = names.get(evaluation.role.group as usize) {
            let _infallible = write!(out, ",{}", field(name));
        }
        out.push('\n');
    }
    out
}

/// A text as a field that no spreadsheet takes for a formula: a `'` is put before a [`FORMULA`] that
/// begins it or, since some take `;` for the end of a field, that follows a `;`; before a `'` in such
/// a place, too, so that whoever takes one `'` away there has the text again. In quotes where that is
/// needed.
fn field(text: &str) -> String {
    let mut harmless = String::with_capacity(text.len());
    let mut begins = true;
    for c in text.chars() {
        if begins && (c == '\'' || FORMULA.contains(&c)) {
            harmless.push('\'');
        }
        begins = c == ';' || (begins && c == ' ');
        harmless.push(c);
    }
    let changed = harmless.len() > text.len();
    if changed || text.contains([',', ';', '"', '#', '\t', '\r', '\n']) || text.trim() != text {
        format!("\"{}\"", harmless.replace('"', "\"\""))
    } else {
        harmless
    }
}

/// What begins a formula, or is passed over before one (OWASP, "CSV Injection").
const FORMULA: [char; 11] = ['=', '+', '-', '@', '\t', '\r', '\n', '＝', '＋', '－', '＠'];

fn history_row(out: &mut String, evaluation: &Evaluation) -> fmt::Result {
    write!(out, "{}", evaluation.number)?;
    for value in evaluation.point.0 {
        write!(out, ",{value:?}")?;
    }
    let moments = evaluation.moments;
    for value in [
        moments.map(|moments| moments.mean),
        moments.map(|moments| moments.coefficient_of_variation),
        evaluation.cost,
    ] {
        match value {
            Some(value) => write!(out, ",{value:?}")?,
            None => out.push(','),
        }
    }
    write!(out, ",{}", evaluation.failures.total())
}

/// Most groups of which each is compared with each other; more are compared with the first.
const COMPARED_MAX: usize = 200;

/// The text of `groups.csv`: one row per group, with what is identified of it (m/s; dimensionless) and
/// the ends of its confidence intervals, empty where they are unknown; given what the data say of each.
pub fn groups(
    specification: &JobSpecification,
    result: &JobResult,
    found: &[Option<Inference>],
) -> String {
    let quantities = ["bulk_velocity", "dispersion"];
    let columns = quantities.map(|name| format!("{name},{name}_lower,{name}_upper"));
    let parameters = Parameter::ALL.map(|parameter| format!("best_{}", parameter.name()));
    let columns = [columns.join(","), parameters.join(",")].join(",");
    let mut out = format!("group,velocities,status,cost,{columns}\n");
    for (set, (group, found)) in result.groups.iter().zip(found).enumerate() {
        let data = specification.data.as_ref();
        let count = data.and_then(|data| data.velocities(set)).map_or(0, <[f64]>::len);
        let cost = group.best.as_ref().and_then(|best| best.cost);
        let mut fields = vec![
            field(&group.name),
            count.to_string(),
            group.status.name().to_owned(),
            number(cost),
        ];
        for quantity in quantities_of(found.as_ref()) {
            let interval = quantity.and_then(|quantity| quantity.known).map(|known| known.interval);
            fields.push(number(quantity.map(|quantity| quantity.value)));
            fields.extend([0, 1].map(|end| number(interval.map(|ends| ends[end]))));
        }
        let point = group.best.as_ref().map(|best| best.point);
        fields.extend(Parameter::ALL.map(|name| number(point.map(|point| point.get(name)))));
        out.push_str(&fields.join(","));
        out.push('\n');
    }
    out
}

/// The text of `comparison.csv`: one row per pair of groups, with the differences of what is
/// identified, the first less the second, and the ends of their confidence intervals, each of level
/// [`crate::inference::CONFIDENCE`] by itself; empty where they are unknown.
///
/// The noise of sampling, which all groups share, is counted in both: intervals are rather too wide.
pub fn comparison(result: &JobResult, found: &[Option<Inference>]) -> String {
    let mut out = "first,second".to_owned();
    for name in ["bulk_velocity", "dispersion"] {
        out.push_str(&format!(
            ",{name}_difference,{name}_difference_lower,{name}_difference_upper"
        ));
    }
    out.push('\n');
    let groups: Vec<_> = result.groups.iter().zip(found).collect();
    let firsts = if groups.len() > COMPARED_MAX { 1 } else { groups.len() };
    for (first, (one, of_one)) in groups.iter().enumerate().take(firsts) {
        for (other, of_other) in &groups[first + 1..] {
            let mut fields = vec![field(&one.name), field(&other.name)];
            let pairs =
                quantities_of(of_one.as_ref()).into_iter().zip(quantities_of(of_other.as_ref()));
            for pair in pairs {
                fields.extend(difference(pair).map(number));
            }
            out.push_str(&fields.join(","));
            out.push('\n');
        }
    }
    out
}

/// Difference of two quantities, and the ends of its interval.
fn difference((first, second): (Option<Quantity>, Option<Quantity>)) -> [Option<f64>; 3] {
    let Some((first, second)) = first.zip(second) else { return [None; 3] };
    let difference = first.value - second.value;
    let Some((one, other)) = first.known.zip(second.known) else {
        return [Some(difference), None, None];
    };
    // Half the length of each interval counts the degrees of freedom of its data.
    let half = |known: Known| 0.5 * (known.interval[1] - known.interval[0]);
    let reach = libm::hypot(half(one), half(other));
    [Some(difference), Some(difference - reach), Some(difference + reach)]
}

fn quantities_of(found: Option<&Inference>) -> [Option<Quantity>; 2] {
    [found.map(|found| found.bulk_velocity), found.map(|found| found.dispersion)]
}

/// A number, if there is one that is finite.
fn number(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map_or_else(String::new, |value| format!("{value:?}"))
}

/// The text of `realizations.csv`: one row per index; the velocity (m/s) is empty where there is
/// a failure, and the failure where there is a velocity.
pub fn realizations(outcomes: &[Outcome]) -> String {
    let mut out = "index,velocity,failure\n".to_owned();
    for (index, outcome) in outcomes.iter().enumerate() {
        // Writing to a string does not fail.
        let _infallible = match outcome {
            Ok(velocity) => writeln!(out, "{index},{velocity:?},"),
            Err(kind) => writeln!(out, "{index},,{}", kind.name()),
        };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The text of a field, as docs/results.md says that it is got back.
    fn text_of(field: &str) -> String {
        let inner = field.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
        let text = inner.unwrap_or(field).replace("\"\"", "\"");
        let mut found = String::new();
        let mut begins = true;
        for c in text.chars() {
            if begins && c == '\'' {
                begins = false;
                continue;
            }
            begins = c == ';' || (begins && c == ' ');
            found.push(c);
        }
        found
    }

    #[test]
    fn no_field_is_a_formula() {
        for (text, expected) in [
            ("left", "left"),
            ("left tibia, 2", "\"left tibia, 2\""),
            ("say \"a\"", "\"say \"\"a\"\"\""),
            ("x-1+2=y@z'", "x-1+2=y@z'"),
            ("=1+1", "\"'=1+1\""),
            ("+1", "\"'+1\""),
            ("-1", "\"'-1\""),
            ("@SUM(A1)", "\"'@SUM(A1)\""),
            ("\t=1", "\"'\t=1\""),
            ("\r=1", "\"'\r=1\""),
            ("\n=1", "\"'\n=1\""),
            ("＝1", "\"'＝1\""),
            (" =1", "\" '=1\""),
            ("'=1", "\"''=1\""),
            ("'", "\"''\""),
            ("a;=1", "\"a;'=1\""),
            ("a; -b;'c", "\"a; '-b;''c\""),
            ("a;b", "\"a;b\""),
            ("a\rb", "\"a\rb\""),
            ("a\nb", "\"a\nb\""),
            ("#1", "\"#1\""),
            (" a ", "\" a \""),
        ] {
            assert_eq!(field(text), expected, "{text:?}");
            assert_eq!(text_of(expected), text, "{expected}");
        }
    }

    /// Every text of up to five of the characters that matter.
    #[test]
    fn names_that_differ_have_fields_that_differ() {
        let mut texts = vec![String::new()];
        for _ in 0..5 {
            let longer: Vec<String> = texts
                .iter()
                .flat_map(|text| "='; \"a".chars().map(move |c| format!("{text}{c}")))
                .collect();
            texts.extend(longer);
            texts.sort();
            texts.dedup();
        }
        assert!(texts.len() > 9000, "{}", texts.len());
        for text in &texts {
            assert_eq!(&text_of(&field(text)), text, "{}", field(text));
        }
    }
}
