//! Derivatives of the compared moments, from differences on common germs.

use super::agreement::ModelAtPoint;
use crate::conclusions::Sensitivity;
use crate::job::{JobSpecification, Range};
use crate::moments::{MomentVector, log_ratios, moment_vector};
use crate::observables::{ObservableSet, PerObservable};
use crate::parameters::{Parameter, Point};
use crate::results::{BestPoint, Evaluation};

/// Derivatives of the compared moments, a column for each free parameter x in units of the box.
#[derive(Debug, Clone, PartialEq)]
pub struct Jacobian {
    /// The free parameters.
    pub free: Vec<Parameter>,
    /// Their columns.
    pub columns: Vec<MomentVector>,
    /// The observables that were measured.
    pub(super) observables: ObservableSet,
}

/// Returns the Jacobian at the best point of set number `set`; `None` if a derivative was not
/// measured.
pub fn jacobian(
    specification: &JobSpecification,
    set: usize,
    best: &BestPoint,
    history: &[Evaluation],
) -> Option<Jacobian> {
    let observables = specification.data.as_ref()?.compared(set).observables.which();
    let model = ModelAtPoint::of_best(best)?;
    let mut jacobian = Jacobian { free: Vec::new(), columns: Vec::new(), observables };
    for parameter in Parameter::ALL {
        let range = specification.range(parameter);
        if matches!(range, Range::Fixed(_)) {
            continue;
        }
        let varied = |row: &&Evaluation| row.belongs_to(set) && row.role.varied == Some(parameter);
        let row = history.iter().find(varied)?;
        let at = |point: &Point| range.coordinate(point.get(parameter));
        let step = at(&row.point)? - at(&best.point)?;
        let column = changes(specification, set, model, row)?.map(|change| change / step);
        if !column.iter().all(|slope| slope.is_finite()) {
            return None;
        }
        jacobian.free.push(parameter);
        jacobian.columns.push(column);
    }
    (!jacobian.free.is_empty()).then_some(jacobian)
}

/// Returns the changes of the compared moments from a point to an evaluation on the same germs; `None`
/// without moments. An observable that is not known is not a number.
pub(super) fn changes(
    specification: &JobSpecification,
    set: usize,
    model: ModelAtPoint<'_>,
    row: &Evaluation,
) -> Option<MomentVector> {
    let base = model.velocity.moments;
    let means = model.observables.map(|found| found.map(|found| found.mean));
    let of_data = specification.data.as_ref()?.compared(set).observables;
    Some(moment_vector(log_ratios(row.moments?, base), |one| match of_data[one] {
        Some(measured) => {
            let [found, base] = [row.observables[one], means[one]];
            found.zip(base).map_or(f64::NAN, |(found, base)| (found - base) / measured)
        }
        None => 0.0,
    }))
}

impl Jacobian {
    /// Returns the derivatives for relative changes of the parameters.
    pub fn sensitivities(&self, at: &Point, specification: &JobSpecification) -> Vec<Sensitivity> {
        let of = |(&parameter, column): (&Parameter, &MomentVector)| {
            let relative = at.get(parameter) / specification.range(parameter).edge();
            let [mean, coefficient_of_variation, others @ ..] =
                column.map(|slope| slope * relative);
            let observables =
                PerObservable::new(|one| self.observables[one].then_some(others[one as usize]));
            Sensitivity { parameter, mean, coefficient_of_variation, observables }
        };
        self.free.iter().zip(&self.columns).map(of).collect()
    }
}
