//! Kernel density of a sample, on a grid: the work is proportional to the number of values, not to
//! its product with the number of positions at which the density is evaluated.
//!
//! Values are distributed over the nodes of a grid by cubic B-splines, smoothed there by a Gaussian
//! of discrete steps, and interpolated by cubic B-splines again. The effective kernel is the
//! convolution of the three: smooth, never negative, with integral 1. The splines' variances (a
//! third of a step's square each) are subtracted from the Gaussian's, so the kernel has the
//! requested variance. With a quarter of the width as step it differs from a Gaussian by an excess
//! kurtosis of -3e-4.

/// Steps of the grid in one width of the kernel.
const STEPS: f64 = 4.0;
/// The Gaussian is cut at 8 widths, where it has fallen to 1e-14.
const TAPS: usize = 32;
/// Nodes beyond the values on both sides: the Gaussian's and those of both splines.
const MARGIN: f64 = TAPS as f64 + 4.0;

/// A density on a grid.
pub(super) struct KernelDensity {
    grid: DensityGrid,
    /// Values at the nodes, interpolated by B-splines.
    density: Vec<f64>,
}

impl KernelDensity {
    /// Computes the density of `values` with a kernel of this standard deviation, above 0, in the
    /// unit of the values; there is at least one value, and all are finite.
    pub(super) fn new(values: &[f64], width: f64) -> Self {
        let grid = DensityGrid::around(values, width);
        let share = 1.0 / (values.len() as f64 * grid.step);
        let density = grid.smoothed(values.iter().map(|&value| (value, share)));
        Self { grid, density }
    }

    /// Returns the density at `place` and its derivative.
    pub(super) fn at(&self, place: f64) -> (f64, f64) {
        let Some(spline) = self.grid.spline(place) else { return (0.0, 0.0) };
        let slope = spline.read(&self.density, &spline.slopes()) / self.grid.step;
        (spline.read(&self.density, &spline.weights()), slope)
    }

    /// Returns Σ w_j K(x_j - y) as a function of y for pairs (x_j, w_j), where K is the kernel with
    /// integral 1.
    pub(super) fn reversed(
        &self,
        weighted: impl Iterator<Item = (f64, f64)>,
    ) -> impl Fn(f64) -> f64 {
        let step = self.grid.step;
        let smoothed = self.grid.smoothed(weighted.map(|(place, weight)| (place, weight / step)));
        let grid = self.grid;
        move |value| {
            grid.spline(value).map_or(0.0, |spline| spline.read(&smoothed, &spline.weights()))
        }
    }
}

/// Equidistant nodes.
#[derive(Clone, Copy)]
struct DensityGrid {
    first: f64,
    step: f64,
    nodes: usize,
}

impl DensityGrid {
    /// Creates a grid with room for the kernel around each value.
    fn around(values: &[f64], width: f64) -> Self {
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let step = width / STEPS;
        let nodes = ((largest - least) / step).ceil() + 2.0 * MARGIN + 1.0;
        Self { first: least - MARGIN * step, step, nodes: nodes as usize }
    }

    /// Returns the splines at `place`; `None` outside the grid.
    fn spline(&self, place: f64) -> Option<Spline> {
        let position = (place - self.first) / self.step;
        let inside = position >= 1.0 && position < self.nodes as f64 - 2.0;
        inside.then(|| {
            let below = position.floor();
            Spline { first: below as usize - 1, fraction: position - below }
        })
    }

    /// Distributes the weights over the nodes and smooths them; those outside the grid are left
    /// out.
    fn smoothed(&self, weighted: impl Iterator<Item = (f64, f64)>) -> Vec<f64> {
        let mut spread = vec![0.0; self.nodes];
        for (place, weight) in weighted {
            let Some(spline) = self.spline(place) else { continue };
            for (node, share) in spread[spline.first..].iter_mut().zip(spline.weights()) {
                *node += weight * share;
            }
        }
        let gaussian = gaussian();
        let mut smoothed = vec![0.0; self.nodes];
        for (node, &weight) in spread.iter().enumerate().filter(|&(_, &weight)| weight != 0.0) {
            let from = node.saturating_sub(TAPS);
            let to = (node + TAPS + 1).min(self.nodes);
            for (other, sum) in smoothed[from..to].iter_mut().enumerate() {
                *sum += weight * gaussian[(from + other).abs_diff(node)];
            }
        }
        smoothed
    }
}

/// Returns the smoothing weights by distance in steps; both sides together add up to 1.
fn gaussian() -> [f64; TAPS + 1] {
    let variance = STEPS * STEPS - 2.0 / 3.0;
    let mut weights = [0.0; TAPS + 1];
    for (distance, weight) in weights.iter_mut().enumerate() {
        *weight = libm::exp(-0.5 * (distance * distance) as f64 / variance);
    }
    let sides: f64 = weights[1..].iter().sum();
    let all = weights[0] + 2.0 * sides;
    weights.map(|weight| weight / all)
}

/// The four cubic B-splines that are not 0 at a position.
struct Spline {
    first: usize,
    /// Position in units of a step, from the second of their nodes.
    fraction: f64,
}

impl Spline {
    fn weights(&self) -> [f64; 4] {
        let u = self.fraction;
        let (square, rest) = (u * u, 1.0 - u);
        [
            rest * rest * rest / 6.0,
            (square * (3.0 * u - 6.0) + 4.0) / 6.0,
            (3.0 * (u + square - square * u) + 1.0) / 6.0,
            square * u / 6.0,
        ]
    }

    /// Returns the derivatives of the weights by the position in steps.
    fn slopes(&self) -> [f64; 4] {
        let u = self.fraction;
        let rest = 1.0 - u;
        [-0.5 * rest * rest, u * (1.5 * u - 2.0), 0.5 + u - 1.5 * u * u, 0.5 * u * u]
    }

    fn read(&self, nodes: &[f64], weights: &[f64; 4]) -> f64 {
        nodes[self.first..].iter().zip(weights).map(|(node, weight)| node * weight).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal(x: f64, width: f64) -> f64 {
        libm::exp(-0.5 * x * x / (width * width)) / (width * (2.0 * std::f64::consts::PI).sqrt())
    }

    /// Compares with the sum over Gaussians; the difference is the kurtosis of the kernel.
    #[test]
    fn it_is_the_sum_over_gaussians() {
        let values = [-1.0, 0.3, 0.31, 2.0, 7.77];
        for width in [0.05, 0.3, 2.0] {
            let density = KernelDensity::new(&values, width);
            let exact = |x: f64| {
                values.iter().map(|value| normal(x - value, width)).sum::<f64>()
                    / values.len() as f64
            };
            for k in -200..1000 {
                let x = 0.01 * f64::from(k);
                let (found, slope) = density.at(x);
                let scale = normal(0.0, width);
                assert!((found - exact(x)).abs() < 1e-4 * scale, "{width}, {x}: {found}");
                assert!(found >= 0.0);
                let step = 1e-4 * width;
                let difference = (density.at(x + step).0 - density.at(x - step).0) / (2.0 * step);
                assert!((slope - difference).abs() < 1e-6 * scale / width, "{width}, {x}: {slope}");
            }
        }
    }

    #[test]
    fn integral_mean_and_variance_are_exact() {
        let (values, width) = ([0.137], 0.25);
        let density = KernelDensity::new(&values, width);
        let step = 1e-3;
        let mut sums = [0.0; 3];
        for k in -4000..4000 {
            let x = step * f64::from(k) + values[0];
            let weight = density.at(x).0 * step;
            for (power, sum) in sums.iter_mut().enumerate() {
                *sum += weight * [1.0, x - values[0], (x - values[0]) * (x - values[0])][power];
            }
        }
        assert!((sums[0] - 1.0).abs() < 1e-9, "{sums:?}");
        assert!(sums[1].abs() < 1e-9, "{sums:?}");
        assert!((sums[2] / (width * width) - 1.0).abs() < 1e-6, "{sums:?}");
    }

    #[test]
    fn reversed_is_the_same_kernel() {
        let values = [-1.0, 0.3, 0.31, 2.0, 7.77];
        let density = KernelDensity::new(&values, 0.4);
        let places = [(0.2, 1.5), (2.2, 0.25), (100.0, 3.0)];
        let forward: f64 = places.iter().map(|&(x, weight)| weight * density.at(x).0).sum();
        let reversed = density.reversed(places.into_iter());
        let backward = values.iter().map(|&y| reversed(y)).sum::<f64>() / values.len() as f64;
        assert!((forward / backward - 1.0).abs() < 1e-12, "{forward} {backward}");
    }

    #[test]
    fn nothing_is_far_away() {
        let density = KernelDensity::new(&[1.0], 0.1);
        for place in [-1e300, -5.0, 5.0, 1e300, f64::INFINITY, f64::NAN] {
            assert_eq!(density.at(place), (0.0, 0.0), "{place}");
        }
    }
}
