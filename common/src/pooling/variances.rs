//! Variances of estimates whose errors are known from a few data each.
//!
//! The scatter of eight velocities is known to a quarter, and a group whose velocities lie close by chance would
//! count far too much. Groups share a law of their variances as well: an inverse χ² law, in which s² is the
//! typical variance of one velocity, with d degrees of freedom: few where the variances of the groups differ,
//! many where they are alike (G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) 3). s² is that of the largest
//! likelihood for each d, and d, of which few groups tell little, is integrated over. The mean of a variance given
//! its estimate makes normal intervals as long as Student's.

/// Largest d is 2 to this power.
const DOUBLINGS: i32 = 10;
/// Halvings of an interval of ln s².
const HALVINGS: usize = 60;

/// The variance of one velocity by the data of a group.
struct GroupVariance {
    variance: f64,
    freedom: f64,
}

/// Returns the variance of each estimate, given the standard errors of all and the degrees of freedom behind
/// them, at least three.
pub(super) fn moderated_variances(errors: impl Iterator<Item = (f64, u64)>) -> Vec<f64> {
    let of = |(error, freedom): (f64, u64)| {
        let freedom = freedom as f64;
        GroupVariance { variance: error * error * (freedom + 1.0), freedom }
    };
    let groups: Vec<GroupVariance> = errors.map(of).collect();
    let prior = |doublings: i32| {
        let freedom = libm::ldexp(1.0, doublings);
        let typical = typical_variance(&groups, freedom);
        (freedom, typical, log_likelihood(&groups, freedom, typical))
    };
    let priors: Vec<_> = (0..=DOUBLINGS).map(prior).collect();
    let largest = priors.iter().map(|(.., logarithm)| *logarithm).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> =
        priors.iter().map(|(.., logarithm)| libm::exp(logarithm - largest)).collect();
    let sum: f64 = weights.iter().sum();
    let all: f64 = groups.iter().map(|group| group.freedom).sum();
    // The typical variance has an error of its own.
    let uncertain = all / (all - 2.0);
    let mean = |group: &GroupVariance| {
        let given = |(freedom, typical, _): &(f64, f64, f64)| {
            let both = freedom * typical * uncertain + group.freedom * group.variance;
            both / (freedom + group.freedom - 2.0)
        };
        let terms = priors.iter().zip(&weights).map(|(prior, weight)| weight * given(prior));
        terms.sum::<f64>() / sum / (group.freedom + 1.0)
    };
    groups.iter().map(mean).collect()
}

/// Returns the typical variance of largest likelihood under a law with `d` degrees of freedom.
fn typical_variance(groups: &[GroupVariance], d: f64) -> f64 {
    let logarithms = || groups.iter().map(|group| libm::log(group.variance));
    let mut low = logarithms().fold(f64::INFINITY, f64::min);
    let mut high = logarithms().fold(f64::NEG_INFINITY, f64::max);
    let is_above = |typical: f64| {
        let term = |group: &GroupVariance| {
            (group.freedom + d) * typical / (d * typical + group.freedom * group.variance)
        };
        groups.iter().map(term).sum::<f64>() > groups.len() as f64
    };
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if is_above(libm::exp(middle)) { high = middle } else { low = middle }
    }
    libm::exp(0.5 * (low + high))
}

/// Returns the logarithm of the likelihood of the variances, without what does not depend on their law.
fn log_likelihood(groups: &[GroupVariance], d: f64, typical: f64) -> f64 {
    let prior = d * typical;
    let term = |group: &GroupVariance| {
        let both = group.freedom + d;
        libm::lgamma(0.5 * both) - libm::lgamma(0.5 * d) + 0.5 * d * libm::log(prior)
            - 0.5 * both * libm::log(prior + group.freedom * group.variance)
    };
    groups.iter().map(term).sum()
}
