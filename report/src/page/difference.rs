//! The table of differences between runs.

use osteon_common::parameters::Parameter;
use osteon_files::report::Moment;

use super::groups::difference;
use super::markup::table as markup_table;
use crate::finding::Finding;
use crate::input::{ReportedRun, RunContent};
use crate::quantity::{NUMBER, Unit, VELOCITY, unit};
use crate::sample::NORMAL_95;
use crate::text::{escape, shorten};

/// Most runs or groups in the table.
const COLUMNS_MAX: usize = 8;

/// A value with the ends of its interval, NaN where they are not known.
type EstimateWithEnds = [f64; 3];

/// Returns the table of the differences from the first run: name, number of the run, finding.
pub(super) fn table(all: &[(String, usize, &Finding<'_>)], runs: &[ReportedRun]) -> String {
    let velocities: Vec<(String, Option<f64>)> = runs
        .iter()
        .filter_map(|run| match &run.content {
            RunContent::Simulation(result, _) => Some((run.name.clone(), result.velocity)),
            _ => None,
        })
        .collect();
    let mut out = String::new();
    if velocities.len() > 1 {
        out.push_str(&simulations_table(&velocities));
    }
    if all.len() > 1 {
        out.push_str(&findings_table(&all[..all.len().min(COLUMNS_MAX)]));
        if all.len() > COLUMNS_MAX {
            out.push_str(&format!("<p>The first {COLUMNS_MAX} of {} are compared.</p>", all.len()));
        }
    }
    out
}

fn simulations_table(velocities: &[(String, Option<f64>)]) -> String {
    let first = velocities[0].1.unwrap_or(f64::NAN);
    let rows: Vec<Vec<String>> = velocities
        .iter()
        .map(|(name, velocity)| {
            let velocity = velocity.unwrap_or(f64::NAN);
            let show = |value| VELOCITY.show(value, crate::quantity::Precision::Digits(7));
            vec![escape(name), show(velocity), show(velocity - first)]
        })
        .collect();
    let columns = ["Run", "Velocity (m/s)", "Minus that of the first (m/s)"];
    markup_table("Velocities of the simulations", &columns, &rows)
}

fn findings_table(all: &[(String, usize, &Finding<'_>)]) -> String {
    let mut columns = vec!["Quantity".to_owned(), shorten(&all[0].0, 40)];
    columns.extend(all[1..].iter().map(|(name, ..)| format!("{} minus it", shorten(name, 40))));
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    let findings: Vec<&Finding<'_>> = all.iter().map(|(_, _, finding)| *finding).collect();
    let mut rows = Vec::new();
    let mut add =
        |name: String, unit: Unit, of: &dyn Fn(&Finding<'_>) -> Option<EstimateWithEnds>| {
            let found: Vec<Option<EstimateWithEnds>> = findings.iter().map(|one| of(one)).collect();
            if found.iter().flatten().count() < 2 {
                return;
            }
            let mut row = vec![escape(&unit.axis_label(&name))];
            let first = found[0].unwrap_or([f64::NAN; 3]);
            row.push(difference(first, unit).replace("<strong>", "").replace("</strong>", ""));
            let minus_first = |one: &Option<EstimateWithEnds>| {
                difference(one.map_or([f64::NAN; 3], |one| minus(one, first)), unit)
            };
            row.extend(found[1..].iter().map(minus_first));
            rows.push(row);
        };
    add("mean of the model".to_owned(), VELOCITY, &|one| model(one, Moment::Mean));
    add("coefficient of variation of the model".to_owned(), NUMBER, &|one| {
        model(one, Moment::CoefficientOfVariation)
    });
    add("mean of the data".to_owned(), VELOCITY, &|one| data(one, Moment::Mean));
    add("coefficient of variation of the data".to_owned(), NUMBER, &|one| {
        data(one, Moment::CoefficientOfVariation)
    });
    add("√(c₁₁₁₁/ρ)".to_owned(), VELOCITY, &bulk_velocity);
    for parameter in Parameter::ALL {
        let name = format!("{} {}", parameter.row().title, parameter.row().symbol);
        add(name, unit(parameter), &|one| determined_estimate(one, parameter));
    }
    let mut out = markup_table("Differences from the first, with 95 % intervals", &columns, &rows);
    out.push_str(
        "<p>A difference in bold has an interval that does not contain 0. Intervals of differences are \
         those of independent data (combined by the method of variance estimates recovery); the first \
         column is the quantity itself. Only what the data of both determine is compared.</p>",
    );
    out
}

/// Returns the difference of two independent quantities with its interval (G. Y. Zou, A. Donner, Stat.
/// Med. 27 (2008)).
fn minus(
    [a, a_low, a_high]: EstimateWithEnds,
    [b, b_low, b_high]: EstimateWithEnds,
) -> EstimateWithEnds {
    let [down, up] = [[a - a_low, b_high - b], [a_high - a, b - b_low]]
        .map(|[one, other]| libm::sqrt(one * one + other * other));
    [a - b, a - b - down, a - b + up]
}

fn model(finding: &Finding<'_>, moment: Moment) -> Option<EstimateWithEnds> {
    let value = finding.velocity.moments.get(moment)?;
    let half = NORMAL_95 * finding.velocity.standard_error.get(moment).unwrap_or(f64::NAN);
    Some([value, value - half, value + half])
}

fn data(finding: &Finding<'_>, moment: Moment) -> Option<EstimateWithEnds> {
    let data = finding.data?;
    let ends = data.intervals().map_or([f64::NAN; 2], |both| both.get(moment));
    Some([data.moments.get(moment)?, ends[0], ends[1]])
}

fn bulk_velocity(finding: &Finding<'_>) -> Option<EstimateWithEnds> {
    if let Some(posterior) = finding.posterior {
        let [low, high] = posterior.bulk_velocity.ends()?;
        return Some([posterior.bulk_velocity.mean?, low, high]);
    }
    let found = &finding.identified?.bulk_velocity;
    let [low, high] = found.ends()?;
    Some([found.value?, low, high])
}

/// Returns a parameter that the data determine; `None` for one that they leave open, or that is fixed.
fn determined_estimate(finding: &Finding<'_>, parameter: Parameter) -> Option<EstimateWithEnds> {
    if let Some(posterior) = finding.posterior {
        let found = posterior.parameters.get(&parameter)?;
        let [low, high] = found.ends()?;
        return Some([found.mean?, low, high]);
    }
    let found = finding.identified?.parameters.get(&parameter)?.as_ref()?;
    let [low, high] = found.ends()?;
    Some([found.value?, low, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_of_differences_grow_like_independent_errors() {
        let found = minus([10.0, 7.0, 13.0], [4.0, 0.0, 8.0]);
        assert_eq!(found, [6.0, 1.0, 11.0]);
        let uneven = minus([10.0, 7.0, 22.0], [4.0, -1.0, 8.0]);
        assert_eq!(uneven, [6.0, 1.0, 19.0]);
    }
}
