//! The reference element [-1, 1] with Gauss-Lobatto-Legendre nodes.
//!
//! Nodes of interpolation and of integration are the same, so that mass is diagonal.

use std::f64::consts::PI;

/// Newton steps on a node; convergence is quadratic from Chebyshev's nodes.
const NEWTON_STEPS: usize = 10;

/// Nodes of an element of the default degree, for which loops are unrolled.
pub(super) const USUAL_NODES: usize = 9;

/// Nodes, weights and derivatives of one polynomial degree.
#[derive(Debug, Clone)]
pub(super) struct Element {
    /// Ascending, both ends included.
    pub(super) nodes: Vec<f64>,
    /// Weights of integration.
    pub(super) weights: Vec<f64>,
    /// Derivative of polynomial j at node i: `[i][j]`.
    pub(super) derivative: Vec<Vec<f64>>,
}

impl Element {
    /// The element of polynomial degree `order` ≥ 1.
    pub(super) fn new(order: usize) -> Self {
        let nodes: Vec<f64> = (0..=order).map(|i| node(order, i)).collect();
        let values: Vec<f64> = nodes.iter().map(|&x| legendre(order, x).0).collect();
        let n = order as f64;
        let weights = values.iter().map(|p| 2.0 / (n * (n + 1.0) * p * p)).collect();
        let corner = 0.25 * n * (n + 1.0);
        let entry = |i: usize, j: usize| match (i, j) {
            (0, 0) => -corner,
            _ if i == j && i == order => corner,
            _ if i == j => 0.0,
            _ => values[i] / (values[j] * (nodes[i] - nodes[j])),
        };
        let derivative = (0..=order).map(|i| (0..=order).map(|j| entry(i, j)).collect()).collect();
        Self { nodes, weights, derivative }
    }

    pub(super) fn count(&self) -> usize {
        self.nodes.len()
    }

    /// Returns -E D / J of an element of half length `half` (m), by rows.
    pub(super) fn stiffness(&self, half: f64) -> Vec<Vec<f64>> {
        let count = self.count();
        let (d, w) = (&self.derivative, &self.weights);
        let entry = |i: usize, j: usize| {
            let sum = (0..count).fold(0.0, |sum, m| (w[m] * d[m][i]).mul_add(d[m][j], sum));
            -sum / (w[i] * half * half)
        };
        (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect()
    }

    /// Values of the interpolating polynomials at `x`.
    pub(super) fn polynomials_at(&self, x: f64) -> Vec<f64> {
        let polynomial = |j: usize| {
            let others = (0..self.count()).filter(|&m| m != j);
            others.fold(1.0, |product, m| {
                product * (x - self.nodes[m]) / (self.nodes[j] - self.nodes[m])
            })
        };
        (0..self.count()).map(polynomial).collect()
    }
}

/// Node `i`: a zero of (1 - x²) P'(x), P of degree `order`.
fn node(order: usize, i: usize) -> f64 {
    if 2 * i == order {
        return 0.0;
    }
    if 2 * i > order {
        return -node(order, order - i);
    }
    let mut x = -libm::cos(PI * i as f64 / order as f64);
    for _ in 0..NEWTON_STEPS {
        let (value, before) = legendre(order, x);
        x -= (x * value - before) / ((order as f64 + 1.0) * value);
    }
    x
}

/// The Legendre polynomials of degrees `order` and `order` - 1.
fn legendre(order: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for degree in 2..=order {
        let d = degree as f64;
        let next = ((2.0 * d - 1.0) * x * value - (d - 1.0) * before) / d;
        before = value;
        value = next;
    }
    (value, before)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_and_differentiated_exactly() {
        for order in 1..=16 {
            let element = Element::new(order);
            assert_eq!((element.nodes[0], element.nodes[order]), (-1.0, 1.0));
            for degree in 0..2 * order {
                let power = |x: f64| (0..degree).fold(1.0, |p, _| p * x);
                let sum: f64 =
                    element.nodes.iter().zip(&element.weights).map(|(&x, w)| w * power(x)).sum();
                let exact = if degree % 2 == 0 { 2.0 / (degree as f64 + 1.0) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-14, "order {order}, degree {degree}");
            }
            for (i, row) in element.derivative.iter().enumerate() {
                let power = |x: f64, n: usize| (0..n).fold(1.0, |p, _| p * x);
                let slope: f64 =
                    row.iter().zip(&element.nodes).map(|(d, &x)| d * power(x, order)).sum();
                let exact = order as f64 * power(element.nodes[i], order - 1);
                assert!((slope - exact).abs() < 1e-11 * order as f64, "order {order}, node {i}");
            }
        }
    }

    #[test]
    fn interpolation_reproduces_polynomials() {
        let element = Element::new(5);
        let x = 0.3217;
        let cube = |x: f64| x * x * x - 2.0 * x;
        let values = element.polynomials_at(x);
        let sum: f64 = values.iter().zip(&element.nodes).map(|(v, &x)| v * cube(x)).sum();
        assert!((sum - cube(x)).abs() < 1e-15);
    }
}
