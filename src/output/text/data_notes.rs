//! Remarks on measured data as text.

use osteon_common::moments::FormTest;
use osteon_files::report::Data;

use super::layout::{glued, wrapped};
use super::number::{VELOCITY_DIGITS, digits, significant};

/// Maximum number of outlying velocities that are named.
const LISTED_MAX: usize = 5;
/// Step of rounding, in standard deviations of the velocities, from which it is stated.
const COARSE: f64 = 0.1;
/// Probability of a test below which its assumption is said to be wrong.
const SIGNIFICANT: f64 = 0.05;
/// The same of tests that are not shown otherwise.
const STRIKING: f64 = 0.01;

/// Why few velocities have no intervals.
pub(super) const TOO_FEW: &str =
    "they need at least five velocities, or five subjects where subjects are named";

/// Returns all remarks, each on lines of its own.
pub(super) fn text(data: &Data) -> String {
    let remarks = [outliers(data), rounding(data), order(data), kolmogorov(data), form(data)];
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

/// Returns that skewness or tails are not the model's, if a test says so.
fn form(data: &Data) -> Option<String> {
    let tests = data.form?;
    let part = |name: &str, test: FormTest, [less, more]: [&str; 2]| {
        let (data, model) = (digits(test.data, 2), digits(test.model, 2));
        let numbers =
            glued(&format!("{data}, of the model {model}, p = {}", digits(test.p_value, 2)));
        let which = if test.data < test.model { less } else { more };
        (test.p_value < STRIKING).then(|| format!("{which} ({name} {numbers})"))
    };
    let skewness = part("L-skewness", tests.skewness, ["reach farther down", "reach farther up"]);
    let kurtosis = part("L-kurtosis", tests.kurtosis, ["have lighter tails", "have heavier tails"]);
    let parts: Vec<String> = [skewness, kurtosis].into_iter().flatten().collect();
    (!parts.is_empty())
        .then(|| format!("The velocities {} than the model's velocities do.", parts.join(" and ")))
}

/// Returns that neighbours in the file are alike, if they are.
pub(super) fn order(data: &Data) -> Option<String> {
    let test = data.order.filter(|test| test.p_value < STRIKING)?;
    let numbers = format!("ratio {}, p = {}", digits(test.ratio, 2), digits(test.p_value, 2));
    Some(format!(
        "Velocities that follow each other are alike (Bartels' rank test: {}), and the intervals take them for \
         independent. If several are of one bone, name the column of bones (`subject` of [data]). A device that \
         drifts looks the same.",
        glued(&numbers)
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

    fn with(more: &str) -> Data {
        let data = format!(r#"{{"mean": 3900.0, "coefficient_of_variation": 0.03, {more}}}"#);
        serde_json::from_str(&data).unwrap()
    }

    #[test]
    fn another_form_than_the_models_is_told() {
        let of = |skewed: f64, heavy: f64| {
            form(&with(&format!(
                r#""form": {{"skewness": {{"data": -0.2, "model": 0.01, "p_value": {skewed:?}}},
                    "kurtosis": {{"data": 0.25, "model": 0.12, "p_value": {heavy:?}}}}}"#
            )))
        };
        assert_eq!(of(0.02, 0.5), None);
        let one = of(0.004, 0.5).unwrap();
        assert!(one.starts_with("The velocities reach farther down (L-skewness"), "{one}");
        let both = of(0.004, 0.002).unwrap();
        assert!(both.contains("and have heavier tails (L-kurtosis"), "{both}");
    }

    #[test]
    fn neighbours_that_are_alike_are_told() {
        let of = |p: f64| order(&with(&format!(r#""order": {{"ratio": 1.24, "p_value": {p:?}}}"#)));
        assert_eq!(of(0.02), None);
        assert!(of(0.002).unwrap().contains("name the column of bones"), "{:?}", of(0.002));
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
