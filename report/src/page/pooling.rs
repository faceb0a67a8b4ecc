//! The table of pooled groups: mean and scatter of each quantity over all groups.

use osteon_common::parameters::Parameter;
use osteon_files::report::{GroupPooling, PooledValue};

use super::markup::{Numbers, none, table, width_precision};
use crate::quantity::{Precision, Unit, VELOCITY, unit};
use crate::text::escape;

/// Returns the table of the mean and the scatter that the groups share, or why there is none.
pub(super) fn shared(numbers: &Numbers, pooling: &GroupPooling) -> String {
    let mut out = String::new();
    let rows: Vec<Vec<String>> = pooling
        .quantities
        .iter()
        .map(|(name, quantity)| {
            let place = format!("/pooling/quantities/{name}");
            let (title, unit) = heading(name);
            let cells = [("mean", quantity.mean), ("scatter", quantity.scatter)]
                .into_iter()
                .flat_map(|(key, one)| cells(numbers, &one, &format!("{place}/{key}"), unit));
            let first = [escape(&unit.axis_label(&title)), quantity.groups.to_string()];
            first.into_iter().chain(cells).collect()
        })
        .collect();
    if !rows.is_empty() {
        let columns =
            ["Quantity", "Groups", "Mean of all", "95 % interval", "Scatter", "95 % interval"];
        out.push_str(&table("What the groups share", &columns, &rows));
        out.push_str(
            "<p>Mean and standard deviation of the true values of all groups like these, without the noise of their \
             data.</p>",
        );
    }
    if let Some(reason) = &pooling.reason {
        out.push_str(&format!("<p>The groups are not pooled: {}.</p>", escape(reason)));
    }
    if !pooling.left_out.is_empty() {
        let names = escape(&pooling.left_out.join(", "));
        out.push_str(&format!("<p>Not pooled, without an interval of their own: {names}.</p>"));
    }
    out
}

/// Returns the title and the unit of a quantity of groups.
fn heading(name: &str) -> (String, Unit) {
    match Parameter::ALL.into_iter().find(|parameter| parameter.name() == name) {
        None => ("√(c₁₁₁₁/ρ)".to_owned(), VELOCITY),
        Some(parameter) => (parameter.row().title.to_owned(), unit(parameter)),
    }
}

fn cells(numbers: &Numbers, one: &PooledValue, place: &str, unit: Unit) -> [String; 2] {
    let precision = one.ends().map_or(Precision::Unknown, width_precision);
    let value = one.value.map_or_else(none, |value| {
        numbers.number(Some(value), &format!("{place}/value"), unit, precision)
    });
    [value, numbers.interval(one.ends(), &format!("{place}/interval"), unit)]
}
