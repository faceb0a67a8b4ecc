//! The tables of groups: one below the other, so that each is narrow, followed by the reasons why
//! groups have no result or no intervals.

use osteon_common::parameters::Parameter;
use osteon_common::results::Status;
use osteon_common::visible;
use osteon_files::report::{
    Data, Group, GroupPooling, Moment, PooledValue, QuantityEstimate, QuantityPosterior,
    SharedQuantity,
};

use super::layout::wrapped;
use super::result::{scale, uncontrolled};
use super::{aligned, data_notes, posterior, significant};

/// A column of numbers: its heading, and for each group a value with its interval.
struct Column {
    heading: String,
    cells: Vec<GroupCell>,
}

#[derive(Clone, Copy)]
struct GroupCell {
    value: Option<f64>,
    ends: Option<[f64; 2]>,
}

impl GroupCell {
    fn scaled(self, scale: f64) -> Self {
        Self {
            value: self.value.map(|value| value * scale),
            ends: self.ends.map(|ends| ends.map(|end| end * scale)),
        }
    }
}

impl From<Option<QuantityEstimate>> for GroupCell {
    fn from(found: Option<QuantityEstimate>) -> Self {
        let ends = found.and_then(|found| found.ends());
        Self { value: found.and_then(|found| found.value), ends }
    }
}

impl From<&QuantityPosterior> for GroupCell {
    fn from(found: &QuantityPosterior) -> Self {
        Self { value: found.mean, ends: found.ends() }
    }
}

impl From<PooledValue> for GroupCell {
    fn from(found: PooledValue) -> Self {
        Self { value: found.value, ends: found.ends() }
    }
}

/// Returns the tables of groups, and of what they share, whose job asked for the control variate or did not.
pub(super) fn table(
    groups: &[Group],
    pooling: Option<&GroupPooling>,
    control_variate: bool,
) -> String {
    let mut text = "\n".to_owned();
    let measured = [
        data(groups, Moment::Mean, "DATA: MEAN VELOCITY (m/s)"),
        data(groups, Moment::CoefficientOfVariation, "COEFFICIENT OF VARIATION"),
    ];
    let identified = [
        quantities(groups, "√(c1111/ρ) (m/s)", 1.0, |group| match &group.posterior {
            Some(known) => (&known.bulk_velocity).into(),
            None => group.identified.as_ref().map(|known| known.bulk_velocity).into(),
        }),
        quantities(groups, "DISPERSION", 1.0, |group| {
            let dispersion = group.identified.as_ref().map(|known| known.dispersion);
            known_after(group, Parameter::Dispersion).unwrap_or(dispersion.into())
        }),
    ];
    text.push_str(&overview(groups));
    let names: Vec<&str> = groups.iter().map(|group| group.name.as_str()).collect();
    text.push_str(&side_by_side("GROUP", &names, measured));
    text.push_str(&side_by_side("GROUP", &names, identified));
    let known = known_parameters(groups);
    let columns = known.into_iter().map(|parameter| of_parameter(groups, parameter));
    text.push_str(&in_pairs("GROUP", &names, columns));
    let of_posterior = groups.iter().any(|group| group.posterior.is_some());
    let intervals = if of_posterior {
        "confidence intervals of the data, and 95 % intervals of the posterior"
    } else {
        "confidence intervals"
    };
    let brackets = wrapped(&format!("In brackets: 95 % {intervals}, each group by itself."));
    text.push_str(&format!("\n{brackets}"));
    text.push_str(&pooling.map_or_else(String::new, |pooling| pooled(groups, pooling)));
    text.push_str(&notes(groups, control_variate));
    text.push_str(&caveat(groups));
    text
}

fn overview(groups: &[Group]) -> String {
    let mut rows = vec![["GROUP", "VELOCITIES", "STATUS", "COST"].map(str::to_owned)];
    for group in groups {
        let mark = if note(group).is_some() { " *" } else { "" };
        let cost = group.cost.map(|cost| significant(cost, 3));
        let count = group.data.count.flatten().map(|count| count.to_string());
        rows.push([
            group.name.clone(),
            count.unwrap_or_default(),
            format!("{}{mark}", group.status.name()),
            cost.unwrap_or_default(),
        ]);
    }
    format!("\n{}", aligned(&rows))
}

/// Returns tables of two columns each, below each other.
fn in_pairs(heading: &str, names: &[&str], columns: impl Iterator<Item = Column>) -> String {
    let (mut columns, mut text) = (columns, String::new());
    while let Some(first) = columns.next() {
        let none = || Column { heading: String::new(), cells: Vec::new() };
        text.push_str(&side_by_side(heading, names, [first, columns.next().unwrap_or_else(none)]));
    }
    text
}

fn side_by_side(heading: &str, names: &[&str], columns: [Column; 2]) -> String {
    let mut rows =
        vec![[heading.to_owned(), columns[0].heading.clone(), columns[1].heading.clone()]];
    let [first, second] = columns.map(|column| shown(&column.cells));
    for (at, name) in names.iter().enumerate() {
        let cell = |cells: &[String]| cells.get(at).cloned().unwrap_or_default();
        rows.push([(*name).to_owned(), cell(&first), cell(&second)]);
    }
    format!("\n{}", aligned(&rows))
}

/// Returns the tables of what groups share.
fn pooled(groups: &[Group], pooling: &GroupPooling) -> String {
    if let Some(reason) = &pooling.reason {
        return format!("\n{}", wrapped(&visible::line(&format!("Not pooled: {reason}."))));
    }
    let is_pooled = |group: &&Group| !group.pooled.is_empty();
    let members: Vec<&Group> = groups.iter().filter(is_pooled).collect();
    let names = members.iter().map(|group| group.name.as_str());
    let names: Vec<&str> = names.chain(["mean of all", "scatter"]).collect();
    let column = |(name, shared): (&String, &SharedQuantity)| {
        let cells = members.iter().map(|group| group.pooled.get(name).map(|one| one.pooled));
        let cells = cells.chain([Some(shared.mean), Some(shared.scatter)]);
        let (heading, scale) = match Parameter::ALL.into_iter().find(|one| one.name() == name) {
            None => ("√(c1111/ρ) (m/s)".to_owned(), 1.0),
            Some(parameter) => (heading(parameter), scale(parameter).0),
        };
        let none = GroupCell { value: None, ends: None };
        let cells = cells.map(|cell| cell.map_or(none, GroupCell::from).scaled(scale));
        Column { heading, cells: cells.collect() }
    };
    let mut text = in_pairs("POOLED", &names, pooling.quantities.iter().map(column));
    let what = "Pooled: each group with the help of all others; mean and scatter are those of the true values of \
                all groups like these.";
    text.push_str(&format!("\n{}", wrapped(what)));
    if !pooling.left_out.is_empty() {
        let names = pooling.left_out.join(", ");
        let left = format!("Not pooled, without an interval of their own: {names}.");
        text.push_str(&wrapped(&visible::line(&left)));
    }
    text
}

/// Returns the column of a moment of the data.
fn data(groups: &[Group], moment: Moment, heading: &str) -> Column {
    let cell = |Group { data, .. }: &Group| GroupCell {
        value: data.moments.get(moment),
        ends: Data::intervals(data).map(|intervals| intervals.get(moment)),
    };
    Column { heading: heading.to_owned(), cells: groups.iter().map(cell).collect() }
}

/// Returns the column of a quantity whose uncertainty is known, in a readable unit.
fn quantities(
    groups: &[Group],
    heading: &str,
    scale: f64,
    of: impl Fn(&Group) -> GroupCell,
) -> Column {
    let cell = |group| of(group).scaled(scale);
    Column { heading: heading.to_owned(), cells: groups.iter().map(cell).collect() }
}

fn of_parameter(groups: &[Group], parameter: Parameter) -> Column {
    quantities(groups, &heading(parameter), scale(parameter).0, |group| known(group, parameter))
}

/// Returns the heading of the column of a parameter.
fn heading(parameter: Parameter) -> String {
    let heading = parameter.name().replace('_', " ").to_uppercase();
    match scale(parameter).1.trim() {
        "" => heading,
        unit => format!("{heading} ({unit})"),
    }
}

/// Returns what the data of a group say of a parameter.
fn known(group: &Group, parameter: Parameter) -> GroupCell {
    known_after(group, parameter).unwrap_or_else(|| {
        let estimate = || *group.identified.as_ref()?.parameters.get(&parameter)?;
        estimate().into()
    })
}

/// Returns the posterior of a parameter, if there is one.
fn known_after(group: &Group, parameter: Parameter) -> Option<GroupCell> {
    Some(group.posterior.as_ref()?.parameters.get(&parameter)?.into())
}

/// Returns the free parameters of the mean model that the data of at least one group determine, or
/// that have a posterior.
fn known_parameters(groups: &[Group]) -> Vec<Parameter> {
    let is_known =
        |parameter: &Parameter| groups.iter().any(|group| known(group, *parameter).ends.is_some());
    let elastic = Parameter::ALL.into_iter().filter(|name| *name != Parameter::Dispersion);
    elastic.filter(is_known).collect()
}

/// Returns the cells of a column, all with the decimals of the narrowest interval: two digits of
/// half its width.
fn shown(cells: &[GroupCell]) -> Vec<String> {
    let halves = cells.iter().filter_map(|cell| cell.ends).map(|[low, high]| 0.5 * (high - low));
    let narrowest = halves.filter(|half| *half > 0.0).fold(f64::INFINITY, f64::min);
    let decimals = (1.0 - narrowest.log10().floor()).clamp(0.0, 9.0);
    let number = |value: f64| {
        if narrowest.is_finite() && value.abs() < 1e9 {
            format!("{value:.*}", decimals as usize)
        } else {
            significant(value, 5)
        }
    };
    let cell = |cell: &GroupCell| match (cell.value, cell.ends) {
        (Some(value), Some([low, high])) => {
            format!("{} ({} to {})", number(value), number(low), number(high))
        }
        (Some(value), None) => number(value),
        (None, _) => "unknown".to_owned(),
    };
    cells.iter().map(cell).collect()
}

/// Returns the reason why a group has no result, or no intervals.
fn note(group: &Group) -> Option<String> {
    let reason = group.reason.as_deref().and_then(|reason| reason.lines().next());
    let unmatched = group.identified.as_ref().is_some_and(|known| !known.matched);
    let vague = group.posterior.as_ref().filter(|known| !known.converged);
    match (reason, group.status) {
        (Some(reason), _) => Some(reason.to_owned()),
        (None, Status::MaxEvaluations) => Some("the evaluations are used up".to_owned()),
        (None, _) if vague.is_some() => {
            let reason = vague.and_then(|known| known.reason.as_deref()?.lines().next());
            let reason = reason.map_or_else(String::new, |reason| format!(": {reason}"));
            Some(format!("the posterior did not converge{reason}"))
        }
        (None, _) if unmatched && group.posterior.is_none() => {
            Some("the model does not match the data within their noise: no intervals".to_owned())
        }
        (None, _) if group.data.intervals().is_none() && group.posterior.is_none() => {
            Some(format!("no intervals: {}", data_notes::TOO_FEW))
        }
        _ => None,
    }
}

/// Returns the reasons, followed by the remarks on each group.
fn notes(groups: &[Group], control_variate: bool) -> String {
    let reasons = groups.iter().filter_map(|group| {
        let reason = format!("* {}: {}", group.name, note(group)?);
        Some(format!("{}\n", visible::line(&reason)))
    });
    let remarks = groups.iter().flat_map(|group| {
        let remarks = remarks(group, control_variate);
        remarks.map(|remark| wrapped(&visible::line(&format!("{}: {remark}", group.name))))
    });
    let notes: String = reasons.chain(remarks).collect();
    if notes.is_empty() { notes } else { format!("\n{notes}") }
}

/// Returns what is to be known of a group's data and its best point besides the table.
fn remarks(group: &Group, control_variate: bool) -> impl Iterator<Item = String> {
    let uncontrolled = match group.status {
        Status::Failed => None,
        _ => uncontrolled(control_variate, &group.velocity, &group.failures),
    };
    let data = &group.data;
    let of_data = [data_notes::outliers(data), data_notes::rounding(data), data_notes::order(data)];
    let of_posterior = group.posterior.as_ref().and_then(posterior::outliers);
    of_data.into_iter().chain([of_posterior, uncontrolled]).flatten()
}

/// Returns a caveat if several parameters of the mean model are searched, which so few data cannot
/// determine.
fn caveat(groups: &[Group]) -> String {
    let fits = |group: &&Group| {
        let missed = group.identified.as_ref().is_some_and(|known| !known.matched);
        group.status != Status::NotMatched && !missed
    };
    let searched = groups.iter().filter(fits).find_map(|group| group.sensitivities.as_ref());
    let Some(searched) = searched else { return String::new() };
    let dispersion = searched.contains_key(&Parameter::Dispersion);
    if searched.len() < 2 + usize::from(dispersion) {
        return String::new();
    }
    let by_likelihood = groups.iter().any(|group| group.cost_standard_error.is_some());
    let known = if by_likelihood { "The distribution of one velocity" } else { "Two moments" };
    let mut text = format!(
        "{known} cannot determine {} parameters. The data of a group that the model fits fix its \
         mean velocity and its coefficient of variation; many other parameter sets fit equally \
         well. Fix parameters that are known from other measurements (`fixed = …`) to compare \
         single ones.",
        searched.len()
    );
    if groups.iter().all(|group| group.posterior.is_none()) {
        text.push_str(
            " A section `[posterior]` in the job file gives intervals that include what is left \
             free.",
        );
    }
    format!("\n{}", wrapped(&text))
}

#[cfg(test)]
mod tests;
