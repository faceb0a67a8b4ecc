//! Remarks on measured data as text.

use osteon_files::report::Data;

use super::layout::{glued, wrapped};
use super::number::{VELOCITY_DIGITS, digits, significant};

/// Maximum number of outlying velocities that are named.
const LISTED_MAX: usize = 5;
/// Step of rounding, in standard deviations of the velocities, from which it is stated.
const COARSE: f64 = 0.1;
/// Probability of a test below which its assumption is said to be wrong.
const SIGNIFICANT: f64 = 0.05;

/// Why few velocities have no intervals.
pub(super) const TOO_FEW: &str =
    "they need at least five velocities, or five subjects where subjects are named";

/// Returns all remarks, each on lines of its own.
pub(super) fn text(data: &Data) -> String {
    let remarks = [outliers(data), rounding(data), kolmogorov(data)];
    remarks.into_iter().flatten().map(|remark| wrapped(&remark)).collect()
}

/// Names the velocities that are far from the others.
pub(super) fn outliers(data: &Data) -> Option<String> {
    let count = data.outlier_count.filter(|_| !data.outliers.is_empty())?;
    let listed = data.outliers.iter().take(LISTED_MAX).map(|outlier| {
        let by = digits(outlier.deviations.abs(), 2);
        format!("{} m/s (by {by})", significant(outlier.velocity, VELOCITY_DIGITS))
    });
    let listed: Vec<String> = listed.collect();
    let more = match count.saturating_sub(listed.len() as u64) {
        0 => String::new(),
        more => format!(" and {more} more (`data.outliers` in result.json)"),
    };
    let (velocities, are) = if count == 1 { ("velocity", "is") } else { ("velocities", "are") };
    Some(format!(
        "{count} {velocities} {are} far from the median, in robust standard deviations: {}{more}.",
        listed.join(", ")
    ))
}

/// Names the step to which the velocities are rounded, if it is large enough to matter.
pub(super) fn rounding(data: &Data) -> Option<String> {
    let deviation = data.moments.mean? * data.moments.coefficient_of_variation?;
    let step = data.rounding.filter(|step| *step >= COARSE * deviation)?;
    Some(format!(
        "The velocities are rounded to {} m/s; test and posterior allow for that.",
        significant(step, VELOCITY_DIGITS)
    ))
}

/// Returns whether the data agree with the model's law, if that was tested.
fn kolmogorov(data: &Data) -> Option<String> {
    let test = data.kolmogorov.flatten()?;
    let (distance, p) = (digits(test.distance, 2), digits(test.p_value, 2));
    let numbers = glued(&format!("D = {distance}, p = {p}"));
    let verdict = match test.p_value < SIGNIFICANT {
        true => {
            ": these velocities do not have the model's distribution, and the intervals are those of \
             velocities that have it. Wrong velocities and groups of different bones make such data."
        }
        false => "",
    };
    Some(format!(
        "Kolmogorov–Smirnov test, data vs model: {numbers} (allows for the model being \
         fitted to these data){verdict}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlying_velocities_are_named() {
        let of = |count: u64| {
            let list: Vec<String> = (0..count.min(100))
                .map(|k| format!(r#"{{"index": {k}, "velocity": 7800.5, "deviations": -37.25}}"#))
                .collect();
            let data = format!(
                r#"{{"mean": 3900.0, "coefficient_of_variation": 0.03, "outliers": [{}],
                    "outlier_count": {count}}}"#,
                list.join(",")
            );
            outliers(&serde_json::from_str(&data).unwrap())
        };
        assert_eq!(of(0), None);
        let one = "1 velocity is far from the median, in robust standard deviations: 7800.5 m/s \
                   (by 37).";
        assert_eq!(of(1).as_deref(), Some(one));
        let many = of(200).unwrap();
        assert!(many.starts_with("200 velocities are far"), "{many}");
        assert!(many.ends_with("(by 37) and 195 more (`data.outliers` in result.json)."), "{many}");
    }

    #[test]
    fn another_distribution_than_the_models_is_told() {
        let of = |p: f64| {
            let data = format!(
                r#"{{"mean": 3900.0, "coefficient_of_variation": 0.03,
                    "kolmogorov": {{"distance": 0.1, "p_value": {p:?}}}}}"#
            );
            kolmogorov(&serde_json::from_str(&data).unwrap()).unwrap()
        };
        assert!(of(0.06).ends_with("fitted to these data)"), "{}", of(0.06));
        assert!(of(0.003).contains("do not have the model's distribution"), "{}", of(0.003));
    }

    #[test]
    fn coarse_rounding_is_told() {
        let of = |step: f64| {
            let data = format!(
                r#"{{"mean": 3900.0, "coefficient_of_variation": 0.03, "rounding": {step:?}}}"#
            );
            rounding(&serde_json::from_str(&data).unwrap())
        };
        assert_eq!(of(1.0), None);
        assert!(of(25.0).unwrap().starts_with("The velocities are rounded to 25 m/s;"));
    }
}
