//! Pressures of a simulation with the picked times, and the line that gives the velocity.

use osteon_files::report::Simulation;

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::input::SimulationContext;
use crate::quantity::{LENGTH, Precision, TIME, VELOCITY};

/// Most points of a trace: the extrema of each part are kept.
const PARTS_MAX: usize = 500;
/// Part of the distance of neighbours that the first packet fills.
const FILL: f64 = 0.45;

/// Returns the figures of the traces.
pub(crate) fn trace_figures(result: &Simulation, context: &SimulationContext) -> Vec<Figure> {
    let mut figures = Vec::new();
    if let Some((times, traces)) = &context.traces {
        figures.push(record(result, context, times, traces));
    }
    figures.extend(line(result));
    figures
}

fn record(
    result: &Simulation,
    context: &SimulationContext,
    times: &[f64],
    traces: &[Vec<f64>],
) -> Figure {
    let places: Vec<f64> = result.receivers.iter().map(|one| one.x1 / LENGTH.size).collect();
    let pitch = places.windows(2).map(|two| (two[1] - two[0]).abs()).fold(f64::INFINITY, f64::min);
    let pitch = if pitch.is_finite() { pitch } else { 1.0 };
    let picked_times = || result.receivers.iter().filter_map(|one| one.time);
    // The guided waves that follow are far larger than the first packet.
    let period = 1.0 / context.case.setup.probe.center_frequency;
    let (first, last) = picked_times()
        .fold((f64::INFINITY, 0.0_f64), |(first, last), time| (first.min(time), last.max(time)));
    let shown = if first <= last {
        [(first - 2.0 * period).max(0.0), last + 1.5 * period]
    } else {
        [0.0, f64::INFINITY]
    };
    let from = times.partition_point(|time| *time < shown[0]);
    let to = times.partition_point(|time| *time <= shown[1]);
    let x = Axis::linear(TIME.axis_label("time"));
    let y = Axis::linear(LENGTH.axis_label("receiver’s x₁, with its pressure"));
    let mut chart = Chart::new("traces", "Pressures at the receivers, and picked times", x, y);
    chart.height = 1.6;
    chart.description = format!("{} receivers.", traces.len());
    let at = |trace: &[f64], time: f64| {
        let after = times.partition_point(|one| *one < time).min(times.len().saturating_sub(1));
        trace.get(after).copied().unwrap_or(0.0)
    };
    let (mut picks, mut thresholds) = (Vec::new(), Vec::new());
    for ((trace, place), receiver) in traces.iter().zip(&places).zip(&result.receivers) {
        let own = match receiver.time {
            Some(time) => largest_around(times, trace, time, period),
            None => trace.iter().fold(0.0_f64, |most, one| most.max(one.abs())),
        };
        let scale = if own > 0.0 { FILL * pitch / own } else { 0.0 };
        let to = to.min(trace.len());
        let points = thin_trace(&times[from.min(to)..to], &trace[from.min(to)..to]);
        let height = |one: f64| place + (one * scale).clamp(-pitch, pitch);
        let line = points.into_iter().map(|[time, one]| [time / TIME.size, height(one)]);
        chart.layer("", Ink::First, Shape::Line(line.collect()));
        if let Some(time) = receiver.time {
            picks.push([time / TIME.size, height(at(trace, time))]);
            let level = result.picking.threshold * own;
            let (from, to) = ((time - period) / TIME.size, (time + period) / TIME.size);
            thresholds.extend([1.0, -1.0].map(|sign| [from, to, place + sign * level * scale]));
        }
    }
    chart.layer("threshold", Ink::Muted, Shape::Intervals(thresholds));
    chart.layer("picked time", Ink::Second, Shape::Points(picks));
    let reading = format!(
        "Each line is the pressure at one receiver from the exact method, scaled so that the largest \
         pressure within a period of the pick has the same height everywhere, and cut where it is \
         larger later. The marks are the picked {} extremum of the first packet; the short lines around \
         each are {} of that height, the share which the criterion asks for.",
        result.picking.extremum.name(),
        result.picking.threshold
    );
    Figure { chart, reading }
}

fn largest_around(times: &[f64], trace: &[f64], time: f64, period: f64) -> f64 {
    let near = times.iter().zip(trace).filter(|(one, _)| (*one - time).abs() <= period);
    near.fold(0.0_f64, |most, (_, pressure)| most.max(pressure.abs()))
}

/// Returns a trace with the smallest and the largest pressure of each part.
fn thin_trace(times: &[f64], trace: &[f64]) -> Vec<[f64; 2]> {
    let size = times.len().div_ceil(PARTS_MAX).max(1);
    let mut points = Vec::new();
    for part in (0..times.len()).collect::<Vec<_>>().chunks(size) {
        let by = |a: &&usize, b: &&usize| trace[**a].total_cmp(&trace[**b]);
        let (low, high) = (part.iter().min_by(by), part.iter().max_by(by));
        let mut both: Vec<usize> = low.into_iter().chain(high).copied().collect();
        both.sort_unstable();
        both.dedup();
        points.extend(both.into_iter().map(|place| [times[place], trace[place]]));
    }
    points
}

/// Returns the figure of the picked times over the receivers' places, with the fitted line.
fn line(result: &Simulation) -> Option<Figure> {
    let points: Vec<[f64; 2]> = result
        .receivers
        .iter()
        .filter_map(|one| Some([one.x1 / LENGTH.size, one.time? / TIME.size]))
        .collect();
    if points.len() < 2 {
        return None;
    }
    let n = points.len() as f64;
    let [x, t] = [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / n);
    let spread: f64 = points.iter().map(|point| (point[0] - x) * (point[0] - x)).sum();
    let both: f64 = points.iter().map(|point| (point[0] - x) * (point[1] - t)).sum();
    let slope = both / spread;
    let line_time = |place: f64| t + slope * (place - x);
    let axis = Axis::linear(LENGTH.axis_label("receiver’s x₁"));
    let y = Axis::linear(TIME.axis_label("picked time"));
    let mut chart = Chart::new("times", "Picked times and the fitted line", axis, y);
    let ends = [points[0][0], points[points.len() - 1][0]].map(|place| [place, line_time(place)]);
    chart.layer("least-squares line", Ink::First, Shape::Line(ends.to_vec()));
    let off =
        points.iter().map(|[place, time]| (time - line_time(*place)).abs()).fold(0.0, f64::max);
    chart.description = format!("{} picked times.", points.len());
    chart.layer("picked time", Ink::Second, Shape::Points(points));
    let velocity = result.velocity.map_or_else(String::new, |velocity| {
        format!(
            "The velocity of the result is {} m/s. ",
            VELOCITY.show(velocity, Precision::Digits(7))
        )
    });
    let reading = format!(
        "{velocity}The velocity is the inverse of the line’s slope. No time is farther than {} ns from \
         the line; a bend would mean that different waves were picked.",
        crate::number::digits(off * TIME.size / 1e-9, 2)
    );
    Some(Figure { chart, reading })
}
