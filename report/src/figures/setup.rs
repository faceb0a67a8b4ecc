//! The set-up drawn to scale: layers, source, receivers.

use osteon_common::case::Setup;

use super::figure::Figure;
use crate::chart::{Axis, Chart, Ink, Shape};
use crate::quantity::{LENGTH, Precision};

/// Returns the figure of the set-up.
pub(crate) fn setup_figure(setup: &Setup) -> Figure {
    let mm = |length: f64| length / LENGTH.size;
    let (layers, probe) = (&setup.layers, &setup.probe);
    let places: Vec<[f64; 2]> = probe
        .places()
        .zip(probe.receivers.positions())
        .map(|(place, x1)| {
            let direction = if x1 < probe.source.x1 { -1.0 } else { 1.0 };
            [mm(probe.source.x1 + direction * place.x), mm(place.x3)]
        })
        .collect();
    let mut sources = vec![[mm(probe.source.x1), mm(probe.source.x3)]];
    if probe.bidirectional {
        let (first, last) =
            (probe.receivers.x1(0), probe.receivers.x1(probe.receivers.count.saturating_sub(1)));
        sources.push([mm(first + last - probe.source.x1), mm(probe.from_other_side().source.x3)]);
    }
    let all = || places.iter().chain(&sources).map(|place| place[0]);
    let (low, high) =
        all().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    let (left, right) = (low - 4.0, high + 4.0);
    let bone = mm(layers.bone_thickness);
    let [above, below] =
        [&layers.coupling, &layers.marrow].map(|fluid| mm(fluid.whole_thickness()));
    // Fluid layers may be far thicker than anything else.
    let most = (right - left) * 0.4;
    let [shown_above, shown_below] = [above.min(most), below.min(most)];
    let top = all_heights(&places, &sources).fold(shown_above, f64::max);
    let x = Axis::linear(LENGTH.axis_label("x₁ along the bone")).with_ends(left, right);
    let y = Axis::linear(LENGTH.axis_label("x₃")).with_ends(-bone - shown_below, top);
    let mut chart = Chart::new("setup", "The set-up, to scale", x, y);
    chart.to_scale = true;
    let show = |length: f64| LENGTH.show(length * LENGTH.size, Precision::Digits(3));
    chart.description = format!(
        "Coupling layer of {} mm, bone of {} mm, marrow of {} mm; {} receivers.",
        show(above),
        show(bone),
        show(below),
        places.len()
    );
    chart.layer("coupling", Ink::First, Shape::Rectangles(vec![[left, right, 0.0, top]]));
    chart.layer("bone", Ink::Muted, Shape::Rectangles(vec![[left, right, -bone, 0.0]]));
    let marrow = vec![[left, right, -bone - shown_below, -bone]];
    chart.layer("marrow", Ink::Fourth, Shape::Rectangles(marrow));
    chart.layer("source", Ink::Second, Shape::Points(sources));
    chart.layer("receivers", Ink::Third, Shape::Points(places));
    let cut = if shown_above < above || shown_below < below {
        " Fluid layers that are far thicker than the bone are cut."
    } else {
        ""
    };
    let reading = format!(
        "{} A millimetre has the same length in both directions; source and receivers are lines \
         across the plane of the drawing.{cut}",
        chart.description
    );
    Figure { chart, reading }
}

fn all_heights<'a>(
    places: &'a [[f64; 2]],
    sources: &'a [[f64; 2]],
) -> impl Iterator<Item = f64> + 'a {
    places.iter().chain(sources).map(|place| place[1] + 0.5)
}
