//! Groups of the data as forest plots.

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::finding::Finding;

/// Most groups that are drawn.
pub(crate) const GROUPS_MAX: usize = 60;

/// How to read what a group has by itself.
const OWN: &str = "Each row is a group: its value and its 95 % interval. Intervals that do not overlap are \
                   different; two that overlap a little may be, too, which the table of differences decides.";
/// How to read a value without an interval.
const WITHOUT: &str = " Without an interval nothing is known of how far a value may be off: the data are too \
                       few, leave directions open, or are missed by the model.";
/// How to read what follows with the help of the others.
const POOLED: &str = " Below it is what follows with the help of all groups, which share a mean and a scatter: a \
                      group of few velocities is drawn towards the others.";

/// Returns the figures that compare the groups: what was identified, and what was measured.
pub(crate) fn forest(findings: &[Finding<'_>]) -> Vec<Figure> {
    let shown = &findings[..findings.len().min(GROUPS_MAX)];
    let identified_row = |finding: &Finding<'_>, dispersion: bool| -> ForestRow {
        if let Some(posterior) = finding.posterior {
            let quantity = if dispersion {
                posterior.parameters.get(&osteon_common::parameters::Parameter::Dispersion)
            } else {
                Some(&posterior.bulk_velocity)
            };
            return (quantity.and_then(|one| one.mean), quantity.and_then(|one| one.ends()));
        }
        let found = finding.identified;
        let quantity =
            found.map(|found| if dispersion { &found.dispersion } else { &found.bulk_velocity });
        (quantity.and_then(|one| one.value), quantity.and_then(|one| one.ends()))
    };
    let measured_row = |finding: &Finding<'_>, variation: bool| -> ForestRow {
        let moment = osteon_files::report::Moment::ALL[usize::from(variation)];
        let data = finding.data;
        let ends = data.and_then(|data| data.intervals()).map(|both| both.get(moment));
        (data.and_then(|data| data.moments.get(moment)), ends)
    };
    let pooled_rows = |name: &str| -> Vec<ForestRow> {
        let of = |finding: &Finding<'_>| {
            let found = finding.pooled.and_then(|pooled| pooled.get(name));
            found.map_or((None, None), |found| (found.pooled.value, found.pooled.ends()))
        };
        shown.iter().map(of).collect()
    };
    let left_out = findings.len() - shown.len();
    let identified = |dispersion| shown.iter().map(|one| identified_row(one, dispersion)).collect();
    let measured = |variation| shown.iter().map(|one| measured_row(one, variation)).collect();
    let all = [
        ForestPlot {
            name: "groups-bulk-velocity",
            title: "√(c₁₁₁₁/ρ) of each group",
            label: "√(c₁₁₁₁/ρ) (m/s)",
            own: identified(false),
            pooled: pooled_rows("bulk_velocity"),
        },
        ForestPlot {
            name: "groups-dispersion",
            title: "Dispersion of each group",
            label: "dispersion δ",
            own: identified(true),
            pooled: pooled_rows("dispersion"),
        },
        ForestPlot {
            name: "groups-mean",
            title: "Mean of each group's measured velocities",
            label: "mean (m/s)",
            own: measured(false),
            pooled: Vec::new(),
        },
        ForestPlot {
            name: "groups-variation",
            title: "Coefficient of variation of each group's measured velocities",
            label: "coefficient of variation",
            own: measured(true),
            pooled: Vec::new(),
        },
    ];
    all.iter().map(|plot| plot.figure(shown, left_out)).collect()
}

/// A value and its interval.
type ForestRow = (Option<f64>, Option<[f64; 2]>);

/// A figure with a row for each group.
struct ForestPlot {
    name: &'static str,
    title: &'static str,
    label: &'static str,
    /// Value and interval of each group, from its own data alone.
    own: Vec<ForestRow>,
    /// Value and interval of each group after pooling with the others; empty where nothing is pooled.
    pooled: Vec<ForestRow>,
}

impl ForestPlot {
    fn figure(&self, findings: &[Finding<'_>], left_out: usize) -> Figure {
        let Self { name, title, label, own, pooled } = self;
        let names = findings.iter().map(|one| one.group.unwrap_or_default().to_owned()).collect();
        let y = Axis::with_categories("", names);
        let mut chart = Chart::new(*name, *title, Axis::linear(*label), y);
        chart.height = (0.1 * own.len() as f64).max(0.35);
        let rows = || own.iter().enumerate();
        let intervals =
            rows().filter_map(|(row, (_, ends))| ends.map(|[low, high]| [low, high, row as f64]));
        chart.layer("95 % interval", Ink::First, Shape::Intervals(intervals.collect()));
        let points_with = |interval: bool| {
            let of = rows().filter(move |(_, (_, ends))| ends.is_some() == interval);
            of.filter_map(|(row, (value, _))| Some([(*value)?, row as f64])).collect::<Vec<_>>()
        };
        chart.layer("value", Ink::First, Shape::Points(points_with(true)));
        let without = points_with(false);
        let mut reading = OWN.to_owned();
        if !without.is_empty() {
            chart.layer("no interval known", Ink::Second, Shape::Points(without));
            reading.push_str(WITHOUT);
        }
        // Below their own ones.
        let pooled_rows =
            || pooled.iter().enumerate().map(|(row, place)| (row as f64 + 0.3, place));
        let intervals: Vec<_> = pooled_rows()
            .filter_map(|(row, (_, ends))| ends.map(|[low, high]| [low, high, row]))
            .collect();
        if !intervals.is_empty() {
            chart.height *= 1.5;
            chart.layer("with the help of all groups", Ink::Third, Shape::Intervals(intervals));
            let points = pooled_rows().filter_map(|(row, (value, _))| Some([(*value)?, row]));
            chart.layer("pooled value", Ink::Third, Shape::Points(points.collect()));
            reading.push_str(POOLED);
        }
        if left_out > 0 {
            reading.push_str(&format!(" The last {left_out} groups are not drawn."));
        }
        chart.description = format!("{} groups.", own.len());
        Figure { chart, reading }
    }
}
