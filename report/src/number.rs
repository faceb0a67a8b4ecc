//! Numbers as text, with as many digits as their error justifies.

/// Maximum number of decimals: smaller errors are meaningless.
const DECIMALS_MAX: i32 = 12;

/// Number of decimals shown: 2 means hundredths, -1 means tens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RoundedPlaces(i32);

impl RoundedPlaces {
    /// Returns the decimals that show this many significant digits of `value`; `None` if it is 0, not
    /// finite, or smaller than any decimal that is shown.
    pub(crate) fn new(value: f64, digits: i32) -> Option<Self> {
        if value == 0.0 || !value.is_finite() {
            return None;
        }
        let last = digits.max(1) - 1;
        Some(last - exponent(value, last)).filter(|decimals| *decimals <= DECIMALS_MAX).map(Self)
    }

    /// Returns the decimals that show two significant digits of an error.
    pub(crate) fn for_error(error: f64) -> Option<Self> {
        Self::new(error, 2).filter(|_| error > 0.0)
    }

    /// Returns the number with these decimals, including zeros at its end.
    pub(crate) fn show(self, value: f64) -> String {
        if self.0 >= 0 {
            let decimals = usize::try_from(self.0).unwrap_or_default();
            return without_negative_zero(&format!("{value:.decimals$}"));
        }
        let unit = (0..-self.0).fold(1.0, |unit, _| unit * 10.0);
        without_negative_zero(&format!("{:.0}", (value / unit).round() * unit))
    }
}

/// Returns a number with this many significant digits; with a power of ten where it would be long.
pub(crate) fn digits(value: f64, digits: i32) -> String {
    match RoundedPlaces::new(value, digits) {
        Some(decimals) if (-4..=7).contains(&exponent(value, digits - 1)) => decimals.show(value),
        _ if value == 0.0 => "0".to_owned(),
        _ if value.is_finite() => {
            scientific(&format!("{value:.*e}", usize::try_from(digits - 1).unwrap_or_default()))
        }
        _ => "–".to_owned(),
    }
}

/// Returns a given number with at most six significant digits, without zeros at its end.
pub(crate) fn format_given(value: f64) -> String {
    let text = digits(value, 6);
    if text.contains('.') && !text.contains('·') {
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    text
}

/// Returns numbers at equal distances `step`, all with the decimals of the step; with powers of ten
/// where they would be long.
pub(crate) fn with_equal_decimals(values: &[f64], step: f64) -> Vec<String> {
    let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let plain = RoundedPlaces::new(step, 1).filter(|_| step >= 1e-4 && largest < 1e6);
    let label = |value: &f64| match plain {
        Some(decimals) => RoundedPlaces(decimals.0.max(0)).show(*value),
        // The sum of steps is not exactly the decimal.
        None if value.abs() < step / 2.0 => "0".to_owned(),
        None => {
            let text = format!("{value:.6e}");
            let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
            let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
            format!("{mantissa}e{power}")
        }
    };
    values.iter().map(label).collect()
}

/// Returns a power of ten; the usual ones as decimals.
pub(crate) fn power_of_ten(power: i32) -> String {
    match power {
        0..=4 => format!("1{}", "0".repeat(usize::try_from(power).unwrap_or_default())),
        -3..=-1 => format!("0.{}1", "0".repeat(usize::try_from(-power - 1).unwrap_or_default())),
        _ => format!("10{}", superscript(&power.to_string())),
    }
}

/// Returns `1.2e-7` as `1.2·10⁻⁷`.
fn scientific(text: &str) -> String {
    let (mantissa, power) = text.split_once('e').unwrap_or((text, "0"));
    format!("{mantissa}·10{}", superscript(power))
}

fn superscript(power: &str) -> String {
    let superscript_of = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => digit.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(digit),
    };
    power.chars().map(superscript_of).collect()
}

fn without_negative_zero(text: &str) -> String {
    let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if zero { text.trim_start_matches('-').to_owned() } else { text.to_owned() }
}

/// Returns the decimal exponent of a finite number rounded to this many digits after the first.
fn exponent(value: f64, after_first: i32) -> i32 {
    let scientific = format!("{value:.*e}", usize::try_from(after_first).unwrap_or_default());
    scientific.split('e').nth(1).and_then(|e| e.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_has_the_decimals_of_its_error() {
        for (value, error, expected) in [
            (3907.687, 2.0203, "3907.7"),
            (0.026_706_35, 0.000_35, "0.02671"),
            (1598.8, 9.96, "1599"),
            (1598.8, 99.6, "1600"),
            (45_678.0, 1234.0, "45700"),
            (-0.001, 0.23, "0.00"),
        ] {
            let decimals = RoundedPlaces::for_error(error).unwrap();
            assert_eq!(decimals.show(value), expected, "{value} ± {error}");
        }
        for error in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-30] {
            assert_eq!(RoundedPlaces::for_error(error), None, "{error}");
        }
    }

    #[test]
    fn digits_are_counted() {
        for (value, count, expected) in [
            (3908.7, 7, "3908.700"),
            (17.0, 3, "17.0"),
            (9.999, 3, "10.0"),
            (1.25e-7, 3, "1.25·10⁻⁷"),
            (4.5e12, 2, "4.5·10¹²"),
            (0.0, 3, "0"),
            (f64::NAN, 3, "–"),
        ] {
            assert_eq!(digits(value, count), expected, "{value}, {count}");
        }
        for (value, expected) in [(12.0, "12"), (0.3816, "0.3816"), (1500.0, "1500"), (0.0, "0")] {
            assert_eq!(format_given(value), expected);
        }
    }
}
