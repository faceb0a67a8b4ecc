//! Shape of the tail of importance weights.

/// Minimum number of weights in the tail.
const TAIL_MIN: usize = 5;

/// Returns the shape k of the generalised Pareto law of the largest weights, the diagnosis of Pareto
/// smoothed importance sampling (A. Vehtari et al., J. Mach. Learn. Res. 25 (2024)): the largest
/// min(n/5, 3√n) weights, k by J. Zhang and M. A. Stephens (Technometrics 51 (2009)) with the weak
/// prior of the former. `None` for too few weights, or if they are all equal.
pub(super) fn shape(weights: &[f64]) -> Option<f64> {
    let count = weights.len() as f64;
    let tail = (0.2 * count).min(3.0 * count.sqrt()).ceil() as usize;
    if tail < TAIL_MIN || weights.len() <= tail {
        return None;
    }
    let mut sorted = weights.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let (below, largest) = sorted.split_at(sorted.len() - tail);
    let threshold = *below.last()?;
    let excesses: Vec<f64> = largest.iter().map(|weight| weight - threshold).collect();
    let k = zhang_stephens(&excesses)?;
    let tail = tail as f64;
    Some((k * tail + 5.0) / (tail + 10.0))
}

/// Estimates k from excesses in ascending order.
fn zhang_stephens(excesses: &[f64]) -> Option<f64> {
    let count = excesses.len();
    let largest = *excesses.last()?;
    let quartile = excesses[(count as f64 / 4.0 + 0.5) as usize - 1];
    if !(largest > 0.0 && quartile > 0.0) {
        return None;
    }
    let nodes = 30 + (count as f64).sqrt() as usize;
    let theta = |j: usize| {
        let root = (nodes as f64 / (j as f64 + 0.5)).sqrt();
        1.0 / largest + (1.0 - root) / (3.0 * quartile)
    };
    let shape =
        |theta: f64| excesses.iter().map(|x| libm::log1p(-theta * x)).sum::<f64>() / count as f64;
    let likelihood = |theta: f64| {
        let k = shape(theta);
        count as f64 * (libm::log(-theta / k) - k - 1.0)
    };
    let thetas: Vec<f64> = (0..nodes).map(theta).collect();
    let logs: Vec<f64> = thetas.iter().map(|theta| likelihood(*theta)).collect();
    let weight = |j: usize| 1.0 / logs.iter().map(|log| libm::exp(log - logs[j])).sum::<f64>();
    let mean: f64 = thetas.iter().enumerate().map(|(j, theta)| weight(j) * theta).sum();
    let k = shape(mean);
    k.is_finite().then_some(k)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of the generalised Pareto law with this shape.
    fn law(k: f64, count: usize) -> Vec<f64> {
        let of = |i: usize| {
            let u = (i as f64 + 0.5) / count as f64;
            (libm::pow(1.0 - u, -k) - 1.0) / k
        };
        (0..count).map(of).collect()
    }

    #[test]
    fn the_shape_of_a_tail_is_found() {
        for k in [0.2, 0.5, 0.9] {
            let found = shape(&law(k, 2000)).unwrap();
            assert!((found - k).abs() < 0.1, "{k}: {found}");
        }
        assert_eq!(shape(&[1.0; 100]), None);
        assert_eq!(shape(&[1.0, 2.0, 3.0]), None);
    }
}
