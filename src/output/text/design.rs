//! What further measurements would tell.

use osteon_common::parameters::Parameter;
use osteon_common::systematic::SystematicQuantity;
use osteon_local::design::{
    Accuracy, DesignTarget, DesignedQuantity, Measurement, MeasurementPlan, PredictedDeviation,
};

use super::layout::{aligned, wrapped};
use super::number::{digits, measured, significant};
use super::result::{readable, scale};
use crate::output::ShownDesign;

/// Number of measurements shown for each quantity, unless all are.
const BEST: usize = 3;
/// A measurement is not shown, unless all are, if it leaves more than this part of the deviation.
const HARDLY: f64 = 0.98;
/// Half widths of a 95 % interval in standard deviations.
const HALF_WIDTH: f64 = 1.96;

/// Returns a table for each quantity.
pub(super) fn table(shown: &ShownDesign<'_>) -> String {
    let design = shown.design;
    let mut text = wrapped(&format!(
        "What further measurements would leave of each 95 % interval, by linear theory about this point; as it is: \
         with {} velocities.",
        design.velocities
    ));
    text.push_str(&wrapped(
        "of prior: the standard deviation in parts of that of the prior; worth: number of velocities, in all, that \
         would tell as much, – if none would",
    ));
    for quantity in &design.quantities {
        text.push('\n');
        text.push_str(&of_quantity(quantity, shown.ranked));
    }
    text
}

fn of_quantity(quantity: &DesignedQuantity, ranked: bool) -> String {
    let DesignedQuantity { target, value, prior, deviation, ranking } = quantity;
    let (name, (factor, unit)) = match target {
        DesignTarget::BulkVelocity => ("√(c1111/ρ)".to_owned(), (1.0, " m/s")),
        DesignTarget::Parameter(parameter) => (readable(*parameter), scale(*parameter)),
    };
    let width = |deviation: f64| {
        format!("{}{unit}", measured(value * factor, HALF_WIDTH * deviation * factor))
    };
    let share = |deviation: f64| format!("{:.0} %", 100.0 * deviation / prior);
    let mut rows = vec![
        ["95 % interval", "of prior", "worth", "with"].map(str::to_owned),
        [width(*deviation), share(*deviation), String::new(), "as it is".to_owned()],
    ];
    let narrows = |one: &PredictedDeviation| one.deviation < HARDLY * deviation;
    let most = if ranked { usize::MAX } else { BEST };
    for one in ranking.iter().filter(|one| ranked || narrows(one)).take(most) {
        let worth = match one.worth {
            _ if !narrows(one) => String::new(),
            Some(count) => rounded(count),
            None => "–".to_owned(),
        };
        rows.push([width(one.deviation), share(one.deviation), worth, plan_title(&one.plan)]);
    }
    let none = rows.len() == 2;
    let mut text = format!("{name}\n{}", aligned(&rows));
    if none {
        text.push_str(&wrapped("none of the measurements narrows it by more than 2 %"));
    }
    text
}

/// Returns a number with two digits if it is large.
fn rounded(count: u64) -> String {
    if count < 100 {
        return count.to_string();
    }
    let power = 10_u64.pow(count.ilog10() - 1);
    ((count + power / 2) / power * power).to_string()
}

fn plan_title(plan: &MeasurementPlan) -> String {
    plan.0.iter().map(title).collect::<Vec<String>>().join(", ")
}

/// Returns what is measured, for people.
fn title(measurement: &Measurement) -> String {
    match measurement {
        Measurement::Velocities(count) => format!("{count} velocities"),
        Measurement::BothDirections => "both directions".to_owned(),
        Measurement::Frequency(frequency) => {
            format!("also at {} MHz", significant(1e-6 * frequency, 3))
        }
        Measurement::Height(height) => {
            format!("also from {} mm above the bone", significant(1e3 * height, 3))
        }
        Measurement::Mean(observable, accuracy) => {
            let row = observable.row();
            format!("{} to {}", row.short, shown_accuracy(*accuracy, 1.0, row.unit))
        }
        Measurement::Searched(parameter, accuracy) => of_parameter(*parameter, *accuracy),
        Measurement::OfSetup(quantity, accuracy) => of_setup(*quantity, *accuracy),
    }
}

fn of_parameter(parameter: Parameter, accuracy: Accuracy) -> String {
    let (factor, unit) = scale(parameter);
    format!("{} to {}", readable(parameter), shown_accuracy(accuracy, factor, unit.trim()))
}

fn of_setup(quantity: SystematicQuantity, accuracy: Accuracy) -> String {
    let name = quantity.name().replace('_', " ");
    let (factor, unit) = match quantity.unit() {
        "m" => (1e3, "mm"),
        "Hz" => (1e-6, "MHz"),
        "rad" => (1.0_f64.to_degrees(), "°"),
        unit => (1.0, unit),
    };
    format!("{name} to {}", shown_accuracy(accuracy, factor, unit))
}

fn shown_accuracy(accuracy: Accuracy, factor: f64, unit: &str) -> String {
    match accuracy {
        Accuracy::Relative(part) => format!("{} %", significant(100.0 * part, 3)),
        Accuracy::Absolute(error) => {
            let number = digits(error * factor, 2);
            match unit {
                "" | "°" => format!("{number}{unit}"),
                unit => format!("{number} {unit}"),
            }
        }
    }
}
