//! Finite elements across a stack, and what they need: an independent way to its waves.

use faer::prelude::Solve as _;
use faer::{Mat, Side, c64};
use osteon_common::bone::{Sublayer, Sublayers};

/// All positive roots of a function, by its signs at `count` points up to `last`.
pub(crate) fn roots(function: impl Fn(f64) -> f64, last: f64, count: usize) -> Vec<f64> {
    let at = |point: usize| last * (point as f64 + 0.5) / count as f64;
    let mut found = Vec::new();
    for point in 1..count {
        let (mut low, mut high) = (at(point - 1), at(point));
        if function(low) * function(high) > 0.0 {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let same = function(middle) * function(low) > 0.0;
            *(if same { &mut low } else { &mut high }) = middle;
        }
        found.push(low);
    }
    found
}

/// Finite elements across a stack: in each sublayer linear functions and integrated Legendre polynomials up to
/// `degree`. The first three displacements are those of the lower face, the last three those of the upper one.
pub(crate) struct FiniteElements {
    mass: Mat<c64>,
    /// Stiffness = `constant` + k `linear` + k² `square`.
    constant: Mat<c64>,
    linear: Mat<c64>,
    square: Mat<c64>,
    /// Inverse of the Cholesky factor of the mass.
    inverse: Mat<c64>,
    /// Entries this far from the diagonal are zero.
    bandwidth: usize,
}

impl FiniteElements {
    pub(crate) fn new(stack: &Sublayers, degree: usize) -> Self {
        let nodes = 1 + degree * stack.iter().count();
        let zero = || Mat::<c64>::zeros(3 * nodes, 3 * nodes);
        let (mut mass, mut constant, mut linear, mut square) = (zero(), zero(), zero(), zero());
        let (basis, weights) =
            (basis(degree), gauss().into_iter().map(|(_, w)| w).collect::<Vec<_>>());
        // Upwards in x3; a function's number is that of its node, and the last of a sublayer the next's first.
        let upwards: Vec<&Sublayer> = stack.iter().collect();
        for (place, sublayer) in upwards.into_iter().rev().enumerate() {
            let (h, c) = (sublayer.thickness, &sublayer.solid.elasticity);
            for (m, (value_m, slope_m)) in basis.iter().enumerate() {
                for (n, (value_n, slope_n)) in basis.iter().enumerate() {
                    let sum = |a: &[f64], b: &[f64]| {
                        a.iter().zip(b).zip(&weights).map(|((a, b), w)| a * b * w).sum::<f64>()
                    };
                    let (both, left) = (sum(value_m, value_n), sum(slope_m, value_n));
                    let (right, bend) = (sum(value_m, slope_n), sum(slope_m, slope_n));
                    for i in 0..3 {
                        for j in 0..3 {
                            let at = (3 * (place * degree + m) + i, 3 * (place * degree + n) + j);
                            let block = |a, b| c.component(i, a, j, b);
                            if i == j {
                                mass[at] += c64::from(sublayer.solid.density * 0.5 * h * both);
                            }
                            constant[at] += c64::from(block(2, 2) * bend * 2.0 / h);
                            linear[at] += c64::new(0.0, block(0, 2) * right - block(2, 0) * left);
                            square[at] += c64::from(block(0, 0) * both * 0.5 * h);
                        }
                    }
                }
            }
        }
        let lower = mass.llt(Side::Lower).unwrap().L().to_owned();
        let inverse = lower.partial_piv_lu().solve(Mat::<c64>::identity(3 * nodes, 3 * nodes));
        Self { mass, constant, linear, square, inverse, bandwidth: 3 * degree + 2 }
    }

    /// Returns the stiffness at a wavenumber, rad/m.
    pub(crate) fn stiffness(&self, k: c64) -> Mat<c64> {
        let size = self.mass.nrows();
        Mat::from_fn(size, size, |i, j| {
            self.constant[(i, j)] + self.linear[(i, j)] * k + self.square[(i, j)] * (k * k)
        })
    }

    pub(crate) fn mass(&self) -> &Mat<c64> {
        &self.mass
    }

    fn reduced(&self, k: f64) -> Mat<c64> {
        &self.inverse * self.stiffness(c64::from(k)) * self.inverse.adjoint()
    }

    /// Returns the frequencies (rad/s) of all waves at a wavenumber (rad/m), in ascending order.
    pub(crate) fn frequencies(&self, k: f64) -> Vec<f64> {
        let values = self.reduced(k).self_adjoint_eigenvalues(Side::Lower).unwrap();
        values.into_iter().map(|value| value.max(0.0).sqrt()).collect()
    }

    /// Returns how many waves at a wavenumber (rad/m) have a frequency below `omega` (rad/s): the negative pivots
    /// of stiffness - omega² mass, by Sylvester's law of inertia.
    pub(crate) fn count_below(&self, k: f64, omega: f64) -> usize {
        let stiffness = self.stiffness(c64::from(k));
        let size = self.mass.nrows();
        let mut rest = Mat::from_fn(size, size, |i, j| {
            stiffness[(i, j)] - self.mass[(i, j)] * (omega * omega)
        });
        for pivot in 0..size {
            let last = (pivot + self.bandwidth).min(size - 1);
            for j in pivot + 1..=last {
                let factor = rest[(j, pivot)].conj() / rest[(pivot, pivot)].re;
                for i in j..=last {
                    let change = rest[(i, pivot)] * factor;
                    rest[(i, j)] -= change;
                }
            }
        }
        (0..size).filter(|&i| rest[(i, i)].re < 0.0).count()
    }

    /// Returns the displacement of the wave at a wavenumber (rad/m) whose frequency is nearest to `omega`, of unit
    /// mass.
    pub(crate) fn displacement(&self, k: f64, omega: f64) -> Vec<c64> {
        let eigen = self.reduced(k).self_adjoint_eigen(Side::Lower).unwrap();
        let distance = |n: &usize| (eigen.S()[*n].re.max(0.0).sqrt() - omega).abs();
        let size = self.mass.nrows();
        let n = (0..size).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
        let found = self.inverse.adjoint() * eigen.U().col(n);
        (0..size).map(|i| found[i]).collect()
    }
}

/// Values and slopes from -1 to 1 of the functions of an element at the points of [`gauss`], the ones that
/// are not zero at its ends first and last.
fn basis(degree: usize) -> Vec<(Vec<f64>, Vec<f64>)> {
    let points = gauss();
    let of = |f: &dyn Fn(f64) -> f64| points.iter().map(|(x, _)| f(*x)).collect::<Vec<f64>>();
    let mut all = vec![(of(&|x| 0.5 * (1.0 - x)), of(&|_| -0.5))];
    for n in 2..=degree {
        let scale = (n as f64 - 0.5).sqrt();
        let value = |x: f64| (legendre(n, x) - legendre(n - 2, x)) / (2.0 * scale);
        all.push((of(&value), of(&|x| scale * legendre(n - 1, x))));
    }
    all.push((of(&|x| 0.5 * (1.0 + x)), of(&|_| 0.5)));
    all
}

fn legendre(degree: usize, x: f64) -> f64 {
    let (mut before, mut value) = (0.0, 1.0);
    for n in 0..degree {
        let n = n as f64;
        (before, value) = (value, ((2.0 * n + 1.0) * x * value - n * before) / (n + 1.0));
    }
    value
}

/// Points and weights of the Gauss rule of order 24.
fn gauss() -> Vec<(f64, f64)> {
    const ORDER: usize = 24;
    let points = roots(|x| legendre(ORDER, x - 1.0), 2.0, 2000);
    let weight = |x: f64| {
        let slope =
            ORDER as f64 * (legendre(ORDER - 1, x) - x * legendre(ORDER, x)) / (1.0 - x * x);
        2.0 / ((1.0 - x * x) * slope * slope)
    };
    points.into_iter().map(|x| (x - 1.0, weight(x - 1.0))).collect()
}
