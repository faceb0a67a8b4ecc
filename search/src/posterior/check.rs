//! Comparison of evaluated draws with the interpolated model that made them.

use std::fmt;

use super::pareto;
use super::population::normalised;

/// The interpolation is accepted if this share of a batch counts after weighting.
const EFFICIENCY_MIN: f64 = 0.95;
/// With up to two free parameters the error of the log density must also be at most this, nats.
/// There, more accuracy costs next to nothing.
const ERROR_MAX_OF_FEW: f64 = 1e-3;

/// Largest mean square error of a draw, in units of the data's noise, with which the interpolation is
/// accepted. An error moves a draw along the pivots by that part of the noise, which is a small part
/// of what the other parameters leave open; and the batch itself still reduces it.
const SQUARE_ERROR_MAX: f64 = 1.0;

/// The evaluated draws of a batch.
#[derive(Debug, Clone, Default)]
pub(super) struct BatchCheck {
    /// Expected mean square error over all draws, before calibration.
    pub(super) expected: f64,
    /// Square errors at points to learn from, in units of those expected.
    learnt: Vec<f64>,
    /// Logarithm of the evaluated density minus that of the interpolated one; minus infinity where
    /// the point is infeasible.
    log_ratios: Vec<f64>,
}

/// Why a batch does not show that the result is that of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Doubt {
    /// The batch is too small: its number of draws, and the number needed.
    FewDraws(usize, usize),
    /// The mean square error of all draws is too large: its value, in units of the data's noise.
    SquareError(f64),
    /// Too few of the feasible draws count after weighting: their share.
    Efficiency(f64),
    /// The error of the log density is too large: its value, nats.
    Error(f64),
    /// Too many draws are infeasible: their number, and the number of all draws.
    Infeasible(usize, usize),
}

impl BatchCheck {
    /// Adds a draw.
    pub(super) fn add(&mut self, log_ratio: f64) {
        self.log_ratios.push(log_ratio);
    }

    /// Adds the square error at a point to learn from, in units of that expected.
    pub(super) fn learn(&mut self, ratio: f64) {
        self.learnt.push(ratio);
    }

    /// Returns the mean square error over all draws, in units of the data's noise.
    fn square_error(&self) -> f64 {
        let factor = self.learnt.iter().sum::<f64>() / self.learnt.len().max(1) as f64;
        self.expected * factor
    }

    /// Returns the number of draws.
    pub(super) fn draws(&self) -> usize {
        self.log_ratios.len()
    }

    /// Returns why this is not enough, if it is not: `needed` is the number of draws, `few` whether
    /// there are at most two free parameters.
    pub(super) fn doubt(&self, needed: usize, few: bool) -> Option<Doubt> {
        let draws = self.draws();
        if draws < needed {
            return Some(Doubt::FewDraws(draws, needed));
        }
        let feasible = self.feasible();
        let efficiency = efficiency(&feasible);
        if efficiency < EFFICIENCY_MIN {
            return Some(Doubt::Efficiency(efficiency));
        }
        let square = self.square_error();
        if square > SQUARE_ERROR_MAX {
            return Some(Doubt::SquareError(square));
        }
        let error = self.error();
        if few && error > ERROR_MAX_OF_FEW {
            return Some(Doubt::Error(error));
        }
        let infeasible = draws - feasible.len();
        (self.efficiency() < EFFICIENCY_MIN).then_some(Doubt::Infeasible(infeasible, draws))
    }

    /// Returns the share of the draws that counts after weighting with the ratios, (Σ w)²/(n Σ w²).
    pub(super) fn efficiency(&self) -> f64 {
        efficiency(&self.log_ratios)
    }

    /// Returns the root mean square deviation of the log ratios of feasible draws from their mean.
    pub(super) fn error(&self) -> f64 {
        let feasible = self.feasible();
        let count = feasible.len() as f64;
        let mean = feasible.iter().sum::<f64>() / count;
        let squares: f64 = feasible.iter().map(|ratio| (ratio - mean) * (ratio - mean)).sum();
        (squares / count).sqrt()
    }

    /// Returns the Pareto shape of the largest weights.
    pub(super) fn pareto_shape(&self) -> Option<f64> {
        pareto::shape(&normalised(&self.log_ratios))
    }

    fn feasible(&self) -> Vec<f64> {
        self.log_ratios.iter().copied().filter(|ratio| ratio.is_finite()).collect()
    }
}

fn efficiency(log_ratios: &[f64]) -> f64 {
    if !log_ratios.iter().any(|ratio| ratio.is_finite()) {
        return 0.0;
    }
    let weights = normalised(log_ratios);
    let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
    1.0 / (squares * weights.len() as f64)
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const MORE: &str = "raise [posterior] max_evaluations";
        match *self {
            Self::FewDraws(drawn, needed) => write!(
                f,
                "the interpolated model was checked at {drawn} draws, {needed} are needed; {MORE}"
            ),
            Self::Efficiency(efficiency) => write!(
                f,
                "the interpolated model still differs from the model: {:.0} % of the checked draws \
                 count, {:.0} % are needed; {MORE}",
                100.0 * efficiency,
                100.0 * EFFICIENCY_MIN
            ),
            Self::SquareError(square) => write!(
                f,
                "the interpolated model still differs from the model: by {:.2} of the data's noise, \
                 root mean square over all draws with their tails, {:.2} are allowed; {MORE}",
                square.sqrt(),
                SQUARE_ERROR_MAX.sqrt()
            ),
            Self::Error(error) => write!(
                f,
                "the interpolated model still differs from the model: by {error:.1e} in the log \
                 density, {ERROR_MAX_OF_FEW:.0e} are allowed with up to two free parameters; {MORE}"
            ),
            Self::Infeasible(infeasible, draws) => write!(
                f,
                "{infeasible} of the {draws} checked draws are infeasible, and draws like them are \
                 part of the result: their failures are evidence that more than max_failed_fraction of \
                 all realizations fail there; \
                 raise [monte_carlo] max_failed_fraction, which keeps them, or narrow the bounds"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(ratios: &[f64], few: bool, expected: Option<Doubt>) {
        let check = BatchCheck { log_ratios: ratios.to_vec(), ..BatchCheck::default() };
        assert_eq!(check.doubt(4, few), expected, "{ratios:?}");
    }

    #[test]
    fn a_batch_is_enough_or_says_why_not() {
        const NEVER: f64 = f64::NEG_INFINITY;
        check(&[0.0; 4], true, None);
        check(&[0.0; 3], false, Some(Doubt::FewDraws(3, 4)));
        check(&[0.1, -0.1, 0.1, -0.1], false, None);
        check(&[0.1, -0.1, 0.1, -0.1], true, Some(Doubt::Error(0.1)));
        check(&[0.0, 0.0, 0.0, NEVER], false, Some(Doubt::Infeasible(1, 4)));
        check(&[NEVER; 4], false, Some(Doubt::Efficiency(0.0)));
        check(&[0.0, -1e3, 0.0, -1e3], false, Some(Doubt::Efficiency(0.5)));
    }

    #[test]
    fn errors_in_the_tails_count() {
        let mut check = BatchCheck { expected: 0.25, ..BatchCheck::default() };
        (0..4).for_each(|_| check.add(0.0));
        assert_eq!(check.doubt(4, false), None);
        check.learn(3.0);
        check.learn(5.5);
        let Some(Doubt::SquareError(square)) = check.doubt(4, false) else { panic!() };
        assert!((square - 1.0625).abs() < 1e-12, "{square}");
    }
}
