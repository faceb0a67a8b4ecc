//! Derivatives of the logarithms of both moments, from differences on common germs.

use crate::conclusions::Sensitivity;
use crate::job::{JobSpecification, Range};
use crate::parameters::{Parameter, Point};
use crate::results::{BestPoint, Evaluation, Moments};

/// d(ln v, ln Δ)/dx, a column for each free parameter, x in units of the box.
#[derive(Debug, Clone, PartialEq)]
pub struct Jacobian {
    /// The free parameters.
    pub free: Vec<Parameter>,
    /// Their columns: derivatives of ln v and ln Δ.
    pub columns: Vec<[f64; 2]>,
}

/// Returns the Jacobian at the best point of set number `set`; `None` if a derivative was not
/// measured.
pub fn jacobian(
    specification: &JobSpecification,
    set: usize,
    best: &BestPoint,
    history: &[Evaluation],
) -> Option<Jacobian> {
    let base = best.velocity?.moments;
    let mut jacobian = Jacobian { free: Vec::new(), columns: Vec::new() };
    for parameter in Parameter::ALL {
        let range = specification.range(parameter);
        if matches!(range, Range::Fixed(_)) {
            continue;
        }
        let varied = |row: &&Evaluation| row.belongs_to(set) && row.role.varied == Some(parameter);
        let row = history.iter().find(varied)?;
        let at = |point: &Point| range.coordinate(point.get(parameter));
        let step = at(&row.point)? - at(&best.point)?;
        let column = log_ratios(row.moments?, base).map(|change| change / step);
        if !column.iter().all(|slope| slope.is_finite()) {
            return None;
        }
        jacobian.free.push(parameter);
        jacobian.columns.push(column);
    }
    (!jacobian.free.is_empty()).then_some(jacobian)
}

impl Jacobian {
    /// Returns the derivatives for relative changes of the parameters.
    pub fn sensitivities(&self, at: &Point, specification: &JobSpecification) -> Vec<Sensitivity> {
        let of = |(&parameter, column): (&Parameter, &[f64; 2])| {
            let relative = at.get(parameter) / specification.range(parameter).edge();
            let [mean, coefficient_of_variation] = column.map(|slope| slope * relative);
            Sensitivity { parameter, mean, coefficient_of_variation }
        };
        self.free.iter().zip(&self.columns).map(of).collect()
    }
}

/// Returns the logarithms of the ratios of both moments to those of `base`.
pub(super) fn log_ratios(moments: Moments, base: Moments) -> [f64; 2] {
    [
        libm::log(moments.mean / base.mean),
        libm::log(moments.coefficient_of_variation / base.coefficient_of_variation),
    ]
}
