//! Gauss-Legendre quadrature on panels.

/// Number of nodes of one panel; exact for polynomials of degree 31, and accurate to rounding for
/// an oscillation of up to about 10 rad over the panel.
const NODES: usize = 16;

/// Phase of an oscillating integrand that one panel resolves to rounding, rad.
pub(crate) const PANEL_PHASE: f64 = 8.0;

/// Calls `visit(x, weight)` for every node of `panels` equal panels of `[from, to]`, ascending.
pub(crate) fn for_each_node(from: f64, to: f64, panels: usize, mut visit: impl FnMut(f64, f64)) {
    let rule = rule();
    let width = (to - from) / panels as f64;
    for panel in 0..panels {
        let middle = from + (panel as f64 + 0.5) * width;
        for (x, weight) in rule {
            visit((0.5 * width).mul_add(x, middle), 0.5 * width * weight);
        }
    }
}

/// Nodes on [-1, 1] with their weights, ascending (Newton's method on the Legendre polynomial).
fn rule() -> [(f64, f64); NODES] {
    let mut rule = [(0.0, 0.0); NODES];
    let n = NODES as f64;
    for (i, entry) in rule.iter_mut().enumerate() {
        let mut x = -libm::cos(std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5));
        let mut slope = 1.0;
        for _ in 0..8 {
            let (value, derivative) = legendre(x);
            slope = derivative;
            x -= value / derivative;
        }
        *entry = (x, 2.0 / ((1.0 - x * x) * slope * slope));
    }
    rule
}

/// The Legendre polynomial of degree [`NODES`] and its derivative.
fn legendre(x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for degree in 2..=NODES {
        let d = degree as f64;
        let next = ((2.0 * d - 1.0) * x * value - (d - 1.0) * before) / d;
        before = value;
        value = next;
    }
    let derivative = NODES as f64 * (x * value - before) / (x * x - 1.0);
    (value, derivative)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oscillation_of_one_panel_phase_is_integrated_to_rounding() {
        let mut integral = 0.0;
        for_each_node(0.0, PANEL_PHASE, 1, |x, weight| integral += weight * libm::cos(x));
        assert!((integral - libm::sin(PANEL_PHASE)).abs() < 1e-14, "{integral}");
    }

    #[test]
    fn panels_add_up() {
        let mut integral = 0.0;
        for_each_node(-1.0, 3.0, 5, |x, weight| integral += weight * x * x * x);
        assert!((integral - 20.0).abs() < 1e-13, "{integral}");
    }
}
