//! Numbers as text, with as many digits as their error justifies.

/// Significant digits of a number whose error is unknown.
pub(super) const DIGITS: usize = 5;
/// Significant digits of the velocity of one case, which the solvers compute to about 1e-5.
pub(super) const VELOCITY_DIGITS: usize = 7;
/// Significant digits of a parameter that the data leave free: they show where in its bounds the
/// point lies.
pub(super) const FREE_DIGITS: usize = 3;
/// Maximum number of decimals: a double has about fifteen digits, and smaller errors are
/// meaningless.
const DECIMALS_MAX: i32 = 12;

/// Number of decimals shown: 2 means hundredths, -1 means tens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Decimals(i32);

impl Decimals {
    /// Returns the decimals that show two significant digits of a standard error; `None` if it is
    /// not above 0.
    pub(super) fn for_standard_error(error: f64) -> Option<Self> {
        Self::new(error, 2)
    }

    /// Returns the decimals that show this many significant digits of `value`; `None` if it is 0,
    /// not finite, or smaller than any decimal that is shown.
    pub(super) fn new(value: f64, digits: usize) -> Option<Self> {
        if value == 0.0 || !value.is_finite() {
            return None;
        }
        let last = i32::try_from(digits).unwrap_or(DECIMALS_MAX) - 1;
        Some(last - exponent(value, digits)).filter(|decimals| *decimals <= DECIMALS_MAX).map(Self)
    }

    /// Returns the number with these decimals, including trailing zeros.
    pub(super) fn show(self, value: f64) -> String {
        if self.0 >= 0 {
            let decimals = usize::try_from(self.0).unwrap_or_default();
            // Zero is shown without a sign.
            let text = format!("{value:.decimals$}");
            let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
            return if zero { text.trim_start_matches('-').to_owned() } else { text };
        }
        let unit = 10_f64.powi(-self.0);
        format!("{:.0}", (value / unit).round() * unit + 0.0)
    }
}

/// Returns `value ± error`, the error with two significant digits and the value with the same
/// decimals; the value with [`DIGITS`] digits if there is no error.
pub(super) fn measured(value: f64, error: f64) -> String {
    match Decimals::for_standard_error(error) {
        Some(decimals) => format!("{} ± {}", decimals.show(value), decimals.show(error)),
        None => digits(value, DIGITS),
    }
}

/// Returns a number with this many significant digits, including trailing zeros.
pub(super) fn digits(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    match Decimals::new(value, digits) {
        Some(decimals) if (-4..=9).contains(&exponent(value, digits)) => decimals.show(value),
        _ => format!("{value:.*e}", digits.saturating_sub(1)),
    }
}

/// Returns a number with at most this many significant digits, without trailing zeros; used for
/// given values, such as settings and bounds.
pub(super) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let exponent = exponent(value, digits);
    if !(-4..=9).contains(&exponent) {
        return format!("{value:.*e}", digits.saturating_sub(1));
    }
    let plain = Decimals::new(value, digits)
        .map_or_else(|| format!("{value}"), |decimals| decimals.show(value));
    if plain.contains('.') {
        plain.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        plain
    }
}

/// Returns the decimal exponent of a finite number rounded to this many digits.
fn exponent(value: f64, digits: usize) -> i32 {
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    scientific.split('e').nth(1).and_then(|e| e.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_has_the_decimals_of_its_error() {
        for (value, error, expected) in [
            (3907.687, 2.0203, "3907.7 ± 2.0"),
            (3907.687, 2.0, "3907.7 ± 2.0"),
            (0.026_706_35, 0.000_35, "0.02671 ± 0.00035"),
            (0.0271, 0.000_366, "0.02710 ± 0.00037"),
            // The error is rounded before the decimals are chosen.
            (1598.8, 9.96, "1599 ± 10"),
            (1598.8, 99.6, "1600 ± 100"),
            (45_678.0, 1234.0, "45700 ± 1200"),
            (3.8, 200.0, "0 ± 200"),
            (-0.001, 0.23, "0.00 ± 0.23"),
            (-1.234, 0.23, "-1.23 ± 0.23"),
            (21.113, 0.000_12, "21.11300 ± 0.00012"),
            (6.071_647, 0.002_34, "6.0716 ± 0.0023"),
            // Without an error the default number of digits is used.
            (3907.687, 0.0, "3907.7"),
            (3907.687, f64::NAN, "3907.7"),
            (0.1, f64::INFINITY, "0.10000"),
            (1.0, 1e-30, "1.0000"),
        ] {
            assert_eq!(measured(value, error), expected, "{value} ± {error}");
        }
    }

    #[test]
    fn digits_are_counted_and_kept() {
        for (value, count, expected) in [
            (3908.7, 7, "3908.700"),
            (0.1029, 3, "0.103"),
            (17.0, 3, "17.0"),
            (9.999, 3, "10.0"),
            (1.25e-7, 3, "1.25e-7"),
            (4.5e12, 2, "4.5e12"),
            (1234.5, 2, "1200"),
            (0.0, 3, "0"),
            (f64::NAN, 3, "NaN"),
        ] {
            assert_eq!(digits(value, count), expected, "{value}, {count}");
        }
    }

    #[test]
    fn what_was_given_has_no_zeros_at_its_end() {
        for (value, count, expected) in [
            (1598.8, 6, "1598.8"),
            (12.0, 6, "12"),
            (1500.0, 3, "1500"),
            (6_083_934_201.0, 3, "6080000000"),
            (0.02, 6, "0.02"),
            (1e-12, 3, "1.00e-12"),
            (0.0, 3, "0"),
        ] {
            assert_eq!(significant(value, count), expected, "{value}, {count}");
        }
    }
}
