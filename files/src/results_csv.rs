//! Results as CSV: `history.csv` and `realizations.csv`, for groups also `groups.csv` and
//! `comparison.csv`.

use std::fmt::{self, Write as _};

use osteon_common::job::{Data, JobSpecification, Range};
use osteon_common::observables::ObservableSet;
use osteon_common::outcome::Outcome;
use osteon_common::parameters::Parameter;
use osteon_common::results::{Evaluation, Status};

use crate::report::{Group, Moments, PooledGroups, QuantityEstimate, QuantityPosterior};

/// Returns the text of `history.csv`: one row per evaluation of the search, with the
/// parameters between its number and its moments; with groups or several starts, also the group and
/// start.
///
/// Moments are empty if every realization failed; a cost is `inf` at an infeasible point.
pub fn history(specification: &JobSpecification, evaluations: &[Evaluation]) -> String {
    let parameters: Vec<_> = specification.parameters_given().map(Parameter::name).collect();
    let parameters = parameters.join(",");
    let names: Vec<&str> = specification.data.iter().flat_map(Data::names).collect();
    let several = specification.search.starts > 1;
    let measured = specification.observables();
    let observables: String = measured.members().map(|one| format!("{},", one.name())).collect();
    let mut out =
        format!("evaluation,{parameters},mean,coefficient_of_variation,{observables}cost,failures");
    out.push_str(if several { ",start" } else { "" });
    out.push_str(if names.is_empty() { "\n" } else { ",group\n" });
    for evaluation in evaluations.iter().filter(|evaluation| evaluation.role.is_of_search()) {
        // Writing to a string does not fail.
        let _infallible = history_row(&mut out, evaluation, measured);
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

/// Returns a text as a field that no spreadsheet interprets as a formula. A `'` is put before a
/// character of `FORMULA` at the beginning or, since some programs take `;` for the end of a field,
/// after a `;`. It is also put before a `'` in such a place, so that the text is recovered by
/// removing one `'` there. The field is quoted if necessary.
pub fn field(text: &str) -> String {
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

/// Characters that begin a formula, or are skipped before one (OWASP, "CSV Injection").
const FORMULA: [char; 11] = ['=', '+', '-', '@', '\t', '\r', '\n', '＝', '＋', '－', '＠'];

fn history_row(out: &mut String, evaluation: &Evaluation, measured: ObservableSet) -> fmt::Result {
    write!(out, "{}", evaluation.number)?;
    for (_, value) in evaluation.point.given() {
        write!(out, ",{value:?}")?;
    }
    let moments = evaluation.moments;
    let moments = [
        moments.map(|moments| moments.mean),
        moments.map(|moments| moments.coefficient_of_variation),
    ];
    let observables = measured.members().map(|one| evaluation.observables[one]);
    for value in moments.into_iter().chain(observables).chain([evaluation.cost]) {
        match value {
            Some(value) => write!(out, ",{value:?}")?,
            None => out.push(','),
        }
    }
    write!(out, ",{}", evaluation.failures.total())
}

/// Maximum number of groups of which all pairs are compared; more groups are compared with the
/// first only.
const COMPARED_MAX: usize = 200;

/// Returns the text of `groups.csv`: one row per group, with the measured and the identified
/// quantities (m/s, kg/m³, Pa, dimensionless) and the ends of their confidence intervals, empty if
/// they are unknown.
pub fn groups(
    specification: &JobSpecification,
    groups: &[Group],
    history: &[Evaluation],
) -> String {
    let free = |name: &Parameter| matches!(specification.range(*name), Range::Free { .. });
    // The dispersion has its own columns whether it is free or not.
    let elastic = Parameter::ALL.into_iter().filter(|name| *name != Parameter::Dispersion);
    let free: Vec<Parameter> = elastic.filter(free).collect();
    let pooled = pooled_names(specification, &free);
    let mut out = header(specification, &free, &pooled);
    for (set, group) in groups.iter().enumerate() {
        let best = group.best_point();
        let mut fields = vec![
            field(&group.name),
            group.data.count.flatten().unwrap_or(0).to_string(),
            group.status.name().to_owned(),
            number(group.cost),
        ];
        for quantity in quantities_of(group) {
            fields.push(number(quantity.and_then(|quantity| quantity.value)));
            fields.extend(ends(quantity.and_then(|quantity| quantity.interval)));
        }
        let known = specification.data.as_ref().map(|data| data.known(set)).unwrap_or_default();
        let of_best =
            |name: Parameter| number(known.get(name).or_else(|| best.map(|point| point.get(name))));
        fields.extend(specification.parameters_given().map(of_best));
        fields.extend(free.iter().flat_map(|&name| identified(name, group)));
        fields.extend(pooled.iter().flat_map(|name| pooled_fields(name, group)));
        fields.extend(data_fields(group));
        let failed = group.failures.values().copied().fold(0, u64::saturating_add);
        fields.push(best.map_or_else(String::new, |_| failed.to_string()));
        let of_group = |row: &&Evaluation| row.role.group as usize == set;
        let searched = history.iter().filter(|row| row.role.is_of_search());
        fields.push(searched.filter(of_group).count().to_string());
        fields.push(field(reason(group)));
        out.push_str(&fields.join(","));
        out.push('\n');
    }
    out
}

/// Returns the names of the quantities that may be pooled, given the free parameters other than the dispersion;
/// none if the job does not ask for it.
fn pooled_names(specification: &JobSpecification, free: &[Parameter]) -> Vec<&'static str> {
    if !specification.groups.pooled {
        return Vec::new();
    }
    let all = ["bulk_velocity", Parameter::Dispersion.name()].into_iter();
    all.chain(free.iter().map(|parameter| parameter.name())).collect()
}

/// Returns a pooled value of a group with the ends of its interval.
fn pooled_fields(name: &str, group: &Group) -> [String; 3] {
    let pooled = group.pooled.get(name).map(|found| found.pooled);
    let [lower, upper] = ends(pooled.and_then(|found| found.ends()));
    [number(pooled.and_then(|found| found.value)), lower, upper]
}

/// Returns the header of `groups.csv`, given the free parameters other than the dispersion, and the quantities
/// that may be pooled.
fn header(specification: &JobSpecification, free: &[Parameter], pooled: &[&str]) -> String {
    let with_interval =
        |name: &str| [name.to_owned(), format!("{name}_lower"), format!("{name}_upper")];
    let single = |name: &str| vec![name.to_owned()];
    let columns = ["group", "velocities", "status", "cost"].into_iter().flat_map(single);
    let columns =
        columns.chain(["bulk_velocity", "dispersion"].into_iter().flat_map(with_interval));
    let best = specification.parameters_given().map(|name| format!("best_{}", name.name()));
    let columns = columns.chain(best);
    let columns = columns.chain(free.iter().flat_map(|name| with_interval(name.name())));
    let pooled = pooled.iter().flat_map(|name| with_interval(&format!("{name}_pooled")));
    let columns = columns.chain(pooled);
    let data = ["data_mean", "data_coefficient_of_variation"];
    let columns = columns.chain(data.into_iter().flat_map(with_interval));
    let last = ["kolmogorov_distance", "kolmogorov_p_value", "failures", "evaluations", "reason"];
    let columns: Vec<String> = columns.chain(last.into_iter().flat_map(single)).collect();
    columns.join(",") + "\n"
}

/// Returns a free parameter with the ends of its interval, if the data determine it or there is a
/// posterior.
fn identified(name: Parameter, group: &Group) -> [String; 3] {
    let by_point =
        || group.identified.as_ref()?.parameters.get(&name)?.as_ref().map(GroupQuantity::from);
    let quantity = match &group.posterior {
        Some(posterior) => posterior.parameters.get(&name).map(GroupQuantity::from),
        None => by_point(),
    };
    let quantity = quantity.filter(|quantity| quantity.interval.is_some());
    let [lower, upper] = ends(quantity.and_then(|quantity| quantity.interval));
    [number(quantity.and_then(|quantity| quantity.value)), lower, upper]
}

/// Returns the moments of a group's data with their intervals, and the test against the model's
/// law.
fn data_fields(group: &Group) -> [String; 8] {
    let Moments { mean, coefficient_of_variation } = group.data.moments;
    let intervals = group.data.intervals();
    let [mean_lower, mean_upper] = ends(intervals.map(|found| found.mean));
    let [variation_lower, variation_upper] =
        ends(intervals.map(|found| found.coefficient_of_variation));
    let test = group.data.kolmogorov.flatten();
    [
        number(mean),
        mean_lower,
        mean_upper,
        number(coefficient_of_variation),
        variation_lower,
        variation_upper,
        number(test.map(|test| test.distance)),
        number(test.map(|test| test.p_value)),
    ]
}

/// Returns the reason why a group did not converge, or has no intervals; empty if neither is the
/// case.
fn reason(group: &Group) -> &str {
    let told = group.reason.as_deref().and_then(|reason| reason.lines().next());
    let has_posterior = group.posterior.is_some();
    let unknown = match (group.best_point(), &group.identified) {
        (None, _) => "no point was feasible",
        (Some(_), None) if !has_posterior => "the derivatives are not known: no intervals",
        (Some(_), Some(found)) if !found.matched => {
            "the model does not match the data within their noise: no intervals"
        }
        _ if group.status == Status::MaxEvaluations => "the evaluations are used up",
        (_, Some(_)) if group.data.intervals().is_none() && !has_posterior => {
            "fewer than five velocities or subjects: no intervals"
        }
        (_, Some(found)) if !found.free_directions.is_empty() && !has_posterior => {
            "the data leave directions free: no intervals without a posterior"
        }
        _ => "",
    };
    told.unwrap_or(unknown)
}

/// Formats both ends of an interval.
fn ends(interval: Option<[f64; 2]>) -> [String; 2] {
    [0, 1].map(|end| number(interval.map(|ends| ends[end])))
}

/// Returns the text of `comparison.csv`: one row per pair of groups, with the differences (first
/// minus second) of the identified quantities and the ends of their confidence intervals, empty if
/// they are unknown. Each interval has the confidence level of the groups' own intervals.
///
/// The sampling noise, which all groups share, is counted in both groups: intervals tend to be too
/// wide. It is not in the differences of the pooled values, which follow if groups are pooled.
pub fn comparison(groups: &[Group]) -> String {
    let names = ["bulk_velocity", Parameter::Dispersion.name()];
    let errors: Vec<_> = groups.iter().map(|group| &group.errors).collect();
    let is_pooled = groups.iter().any(|group| !group.pooled.is_empty());
    let pooled: Vec<Option<PooledGroups>> = match is_pooled {
        true => names.map(|name| PooledGroups::new(&errors, name)).into(),
        false => Vec::new(),
    };
    let columns = names.map(|name| format!("{name}_difference")).into_iter();
    let columns = columns
        .chain(names.iter().take(pooled.len()).map(|name| format!("{name}_difference_pooled")));
    let mut out = "first,second".to_owned();
    columns.for_each(|name| out.push_str(&format!(",{name},{name}_lower,{name}_upper")));
    out.push('\n');
    let firsts = if groups.len() > COMPARED_MAX { 1 } else { groups.len() };
    for (first, one) in groups.iter().enumerate().take(firsts) {
        for (second, other) in groups.iter().enumerate().skip(first + 1) {
            let mut fields = vec![field(&one.name), field(&other.name)];
            for pair in quantities_of(one).into_iter().zip(quantities_of(other)) {
                fields.extend(difference(pair).map(number));
            }
            for pooled in &pooled {
                let found = pooled.as_ref().and_then(|pooled| pooled.difference(first, second));
                fields.extend([0, 1, 2].map(|place| number(found.map(|found| found[place]))));
            }
            out.push_str(&fields.join(","));
            out.push('\n');
        }
    }
    out
}

/// Returns the difference of two quantities, and the ends of its interval, which follow from the
/// distances of the ends of both intervals from their values (MOVER: G. Y. Zou and A. Donner, Stat.
/// Med. 27 (2008)): intervals of few data are far from symmetric.
fn difference((first, second): (Option<GroupQuantity>, Option<GroupQuantity>)) -> [Option<f64>; 3] {
    let values = first.zip(second).and_then(|(one, other)| one.value.zip(other.value));
    let Some((first_value, second_value)) = values else { return [None; 3] };
    let difference = first_value - second_value;
    let intervals = first.and_then(|one| one.interval).zip(second.and_then(|one| one.interval));
    let Some((one, other)) = intervals else { return [Some(difference), None, None] };
    let reach = |first_end: f64, second_end: f64| {
        libm::hypot(first_end - first_value, second_end - second_value)
    };
    // The difference is smallest where the first is at its lower end and the second at its upper.
    let (below, above) = (reach(one[0], other[1]), reach(one[1], other[0]));
    [Some(difference), Some(difference - below), Some(difference + above)]
}

/// A quantity of a group: by its posterior if there is one, as on the terminal, otherwise by the best
/// point.
#[derive(Debug, Clone, Copy)]
struct GroupQuantity {
    value: Option<f64>,
    interval: Option<[f64; 2]>,
}

impl From<&QuantityEstimate> for GroupQuantity {
    fn from(found: &QuantityEstimate) -> Self {
        Self { value: found.value, interval: found.ends() }
    }
}

impl From<&QuantityPosterior> for GroupQuantity {
    fn from(found: &QuantityPosterior) -> Self {
        Self { value: found.mean, interval: found.ends() }
    }
}

/// Returns √(c1111/ρ) and the dispersion.
fn quantities_of(group: &Group) -> [Option<GroupQuantity>; 2] {
    let found = group.identified.as_ref();
    let by_point = [found.map(|found| &found.bulk_velocity), found.map(|found| &found.dispersion)];
    let by_point = by_point.map(|quantity| quantity.map(GroupQuantity::from));
    let Some(posterior) = &group.posterior else { return by_point };
    let dispersion = posterior.parameters.get(&Parameter::Dispersion).map(GroupQuantity::from);
    [Some((&posterior.bulk_velocity).into()), dispersion.or(by_point[1])]
}

/// Formats a number; empty if it is absent or not finite.
pub(crate) fn number(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map_or_else(String::new, |value| format!("{value:?}"))
}

/// Returns the text of `realizations.csv` for groups, given the name and the outcomes of each: the rows of
/// each group at its best point, one group after another.
pub fn realizations_of_groups<'a>(
    groups: impl IntoIterator<Item = (&'a str, &'a [Outcome])>,
) -> String {
    let mut out = "index,velocity,failure,group\n".to_owned();
    for (name, outcomes) in groups {
        let name = field(name);
        for (index, outcome) in outcomes.iter().enumerate() {
            out.push_str(&realization(index, outcome));
            out.push_str(&format!(",{name}\n"));
        }
    }
    out
}

/// Returns the text of `realizations.csv`: one row per index; the velocity (m/s) is empty for a
/// failure, and the failure is empty for a velocity.
pub fn realizations(outcomes: &[Outcome]) -> String {
    let mut out = "index,velocity,failure\n".to_owned();
    for (index, outcome) in outcomes.iter().enumerate() {
        out.push_str(&realization(index, outcome));
        out.push('\n');
    }
    out
}

/// Formats a row without the columns after its failure.
fn realization(index: usize, outcome: &Outcome) -> String {
    match outcome {
        Ok(velocity) => format!("{index},{velocity:?},"),
        Err(kind) => format!("{index},,{}", kind.name()),
    }
}

#[cfg(test)]
mod tests {
    use osteon_common::data_statistics::intervals_of_data;
    use osteon_common::ensemble::Germs;
    use osteon_common::special::standard_normal_quantile;

    use super::*;

    /// Returns the coefficient of variation of velocities of one normal law, with its interval.
    fn variation(seed: u64, count: usize) -> GroupQuantity {
        let germs = (0..).flat_map(|index| *Germs::draw(seed, index).values());
        let velocity = |u| 3900.0 * (1.0 + 0.03 * standard_normal_quantile(u));
        let data = Data::from_velocities(germs.take(count).map(velocity).collect());
        let interval = intervals_of_data(&data, 0).unwrap().coefficient_of_variation;
        let value = Some(data.moments(0).coefficient_of_variation);
        GroupQuantity { value, interval: Some([interval.low, interval.high]) }
    }

    /// Both groups have the same law, so that the interval of the difference should be above 0 for
    /// 2.5 % of 1000 pairs, with a standard deviation of 0.5 %, and below it for as many.
    #[test]
    fn differences_of_small_and_large_groups_hold_the_truth_as_often_as_they_say() {
        let [mut above, mut below] = [0; 2];
        for seed in 0..1000 {
            let groups = (variation(2 * seed, 5), variation(2 * seed + 1, 200));
            let [_, lower, upper] = difference((Some(groups.0), Some(groups.1)));
            above += u32::from(lower.unwrap() > 0.0);
            below += u32::from(upper.unwrap() < 0.0);
        }
        assert!((10..=40).contains(&above) && (10..=40).contains(&below), "{above} {below}");
    }

    /// Recovers the text of a field as described in docs/results.md.
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

    /// Every text of up to five of the relevant characters.
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
