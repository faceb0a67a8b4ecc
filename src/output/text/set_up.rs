//! What usual errors of the setup would move, as text.

use osteon_common::random_quantities::RandomQuantities;
use osteon_common::setup_quantity::SetupQuantity;
use osteon_common::systematic::SystematicQuantity;
use osteon_files::report::{Data, Identification};

use super::layout::{aligned, glued, wrapped};
use super::number::digits;
use crate::usual_shifts::UsualShift;

/// Largest number of quantities that are listed.
const LISTED: usize = 5;
/// Share of the velocities' variance from which it is worth a word.
const SHARE_MIN: f64 = 0.05;

/// Says that intervals hold for the setup as given, and what usual errors of it would move; empty without an
/// interval of √(c1111/ρ). `random` is what differs between the realizations of the job.
pub(super) fn text(
    found: &Identification,
    random: &RandomQuantities,
    shifts: &[UsualShift],
) -> String {
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
    let is_random = random.random().any(|one| one == SetupQuantity::ProbeTilt);
    let tilt = shifts.iter().find(|one| one.quantity == SystematicQuantity::Tilt && !is_random);
    let scatter = tilt.zip(found.data.as_ref()).and_then(|(tilt, data)| scatter(tilt, data));
    format!(
        "\n{}{}{}{}",
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
        )),
        scatter.map(|words| wrapped(&words)).unwrap_or_default()
    )
}

/// Says what the scatter of a usual tilt, anew in each measurement, would do to the dispersion.
fn scatter(tilt: &UsualShift, data: &Data) -> Option<String> {
    let ratio = tilt.change / data.moments.coefficient_of_variation?;
    let share = ratio * ratio;
    let effect = match share {
        _ if share < SHARE_MIN => return None,
        _ if share < 1.0 => format!(
            "makes {} of the velocities' variance; the dispersion is then stated {} too large.",
            percent(share),
            percent(1.0 / (1.0 - share).sqrt() - 1.0)
        ),
        _ => "makes a larger variance than that of the velocities.".to_owned(),
    };
    let tilt = tilt.value - tilt.known.unwrap_or(0.0);
    Some(format!(
        "A hand that tilts the probe anew for each measurement, by {} (standard deviation), {effect} {} says it to \
         the model; measurements in both directions take it out.",
        glued(&format!("{}°", digits(tilt.to_degrees(), 2))),
        glued("`[random.probe_tilt]`")
    ))
}

fn percent(share: f64) -> String {
    glued(&format!("{} %", digits(100.0 * share, 2)))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the text with blanks as a terminal shows them.
    fn unglued(words: &str) -> String {
        wrapped(words).split_whitespace().collect::<Vec<_>>().join(" ")
    }

    fn check(change: f64, expected: Option<&str>) {
        let data =
            serde_json::from_str(r#"{"mean": 4000.0, "coefficient_of_variation": 0.03}"#).unwrap();
        let value = 0.5_f64.to_radians();
        let tilt =
            UsualShift { quantity: SystematicQuantity::Tilt, value, known: Some(0.0), change };
        let words = scatter(&tilt, &data).map(|words| unglued(&words));
        let begins =
            words.as_deref().and_then(|words| words.split_once(" `[random")).map(|all| all.0);
        assert_eq!(begins, expected, "{change}");
    }

    #[test]
    fn a_tilt_that_scatters_as_much_as_the_velocities_is_told() {
        const BY: &str = "A hand that tilts the probe anew for each measurement, by 0.50° (standard deviation), makes ";
        check(0.006, None);
        let part =
            "36 % of the velocities' variance; the dispersion is then stated 25 % too large.";
        check(0.018, Some(&format!("{BY}{part}")));
        check(0.03, Some(&format!("{BY}a larger variance than that of the velocities.")));
    }
}
