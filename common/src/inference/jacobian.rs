//! Derivatives of the logarithms of both moments, and of the mean decay, from differences on common germs.

use super::decay::DecayWeights;
use crate::conclusions::Sensitivity;
use crate::job::{JobSpecification, Range};
use crate::moments::log_ratios;
use crate::parameters::{Parameter, Point};
use crate::results::{BestPoint, Evaluation};

/// d(ln v, ln Δ, relative decay)/dx, a column for each free parameter, x in units of the box.
#[derive(Debug, Clone, PartialEq)]
pub struct Jacobian {
    /// The free parameters.
    pub free: Vec<Parameter>,
    /// Their columns: derivatives of ln v and ln Δ, and of the mean decay relative to that of the data;
    /// 0 if no decays were measured.
    pub columns: Vec<[f64; 3]>,
    /// Whether decays were measured.
    pub(super) has_decays: bool,
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
    let has_decays = specification.has_decays();
    let decay = match has_decays {
        true => Some((DecayWeights::of_data(specification.data.as_ref()?, set)?, best.decay?.mean)),
        false => None,
    };
    let mut jacobian = Jacobian { free: Vec::new(), columns: Vec::new(), has_decays };
    for parameter in Parameter::ALL {
        let range = specification.range(parameter);
        if matches!(range, Range::Fixed(_)) {
            continue;
        }
        let varied = |row: &&Evaluation| row.belongs_to(set) && row.role.varied == Some(parameter);
        let row = history.iter().find(varied)?;
        let at = |point: &Point| range.coordinate(point.get(parameter));
        let step = at(&row.point)? - at(&best.point)?;
        let [mean, variation] = log_ratios(row.moments?, base);
        let of_decay = match &decay {
            Some((weights, base)) => weights.relative(row.decay? - base),
            None => 0.0,
        };
        let column = [mean, variation, of_decay].map(|change| change / step);
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
        let of = |(&parameter, column): (&Parameter, &[f64; 3])| {
            let relative = at.get(parameter) / specification.range(parameter).edge();
            let [mean, coefficient_of_variation, decay] = column.map(|slope| slope * relative);
            let decay = self.has_decays.then_some(decay);
            Sensitivity { parameter, mean, coefficient_of_variation, decay }
        };
        self.free.iter().zip(&self.columns).map(of).collect()
    }
}
