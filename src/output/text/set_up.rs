//! What usual errors of the setup would move, as text.

use osteon_common::systematic::SystematicQuantity;
use osteon_files::report::Identification;

use super::layout::{aligned, glued, wrapped};
use super::number::digits;
use crate::usual_shifts::UsualShift;

/// Largest number of quantities that are listed.
const LISTED: usize = 5;

/// Says that intervals hold for the setup as given, and what usual errors of it would move; empty without an
/// interval of √(c1111/ρ).
pub(super) fn text(found: &Identification, shifts: &[UsualShift]) -> String {
    let Some((value, half_width)) = bulk_velocity(found).filter(|_| !shifts.is_empty()) else {
        return String::new();
    };
    let in_widths = |change: f64| digits(change * value / half_width, 2);
    let row = |one: &UsualShift| {
        let moved = format!("{} m/s", digits(one.change * value, 2));
        [possible(one), moved, in_widths(one.change)]
    };
    let title = ["usual error".to_owned(), "moves by".to_owned(), "half widths".to_owned()];
    let rows: Vec<_> = [title].into_iter().chain(shifts.iter().take(LISTED).map(row)).collect();
    let together = shifts.iter().map(|one| one.change * one.change).sum::<f64>().sqrt();
    let count = match shifts.len().saturating_sub(LISTED) {
        0 => "All".to_owned(),
        more => format!("With {more} smaller ones all"),
    };
    format!(
        "\n{}{}{}",
        wrapped(
            "These intervals hold for the setup as given. What usual errors of it would move \
             √(c1111/ρ) by, also in half widths of its interval:"
        ),
        aligned(&rows),
        wrapped(&format!(
            "{count} together: {}, {} half widths. {} takes them into the intervals; {} leaves this out.",
            glued(&format!("{} m/s", digits(together * value, 2))),
            in_widths(together),
            glued("`[systematic] usual = true`"),
            glued("`--no-budget`"),
        ))
    )
}

/// Returns √(c1111/ρ) and half the width of its interval, m/s.
fn bulk_velocity(found: &Identification) -> Option<(f64, f64)> {
    let of_posterior = || {
        let known = &found.posterior()?.bulk_velocity;
        Some((known.mean?, known.ends()?))
    };
    let of_search = || {
        let known = &found.identified().filter(|known| known.matched)?.bulk_velocity;
        Some((known.value?, known.ends()?))
    };
    let (value, [lower, upper]) = of_posterior().or_else(of_search)?;
    let half_width = 0.5 * (upper - lower);
    (half_width > 0.0).then_some((value, half_width))
}

/// Returns the quantity with the value that it may usually have.
fn possible(shift: &UsualShift) -> String {
    let (scale, unit) = match shift.quantity {
        SystematicQuantity::BoneThickness
        | SystematicQuantity::SourceHeight
        | SystematicQuantity::ReceiverHeight
        | SystematicQuantity::FirstReceiver
        | SystematicQuantity::Pitch => (1e3, " mm"),
        SystematicQuantity::CenterFrequency => (1e-6, " MHz"),
        SystematicQuantity::Tilt => (1f64.to_degrees(), "°"),
        SystematicQuantity::CouplingSoundSpeed
        | SystematicQuantity::MarrowSoundSpeed
        | SystematicQuantity::VelocityOffset => (1.0, " m/s"),
        SystematicQuantity::BoneQualityFactor | SystematicQuantity::PorosityGradient => (1.0, ""),
    };
    let shown = |value: f64| format!("{}{unit}", digits(value * scale, 3));
    let known = shift.known.map_or_else(|| "none".to_owned(), shown);
    format!("{} {} for {known}", shift.quantity.name().replace('_', " "), shown(shift.value))
}
