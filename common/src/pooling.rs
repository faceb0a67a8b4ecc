//! Partial pooling: estimates of several groups that share a mean and a scatter.
//!
//! The true values of the groups are normal about a mean μ with standard deviation τ, the scatter between the
//! groups, and the estimate of each group is normal about its true value with an error of its own. Given τ,
//! everything is in closed form, as long as μ may be anything: a group's value is the average of its estimate
//! and of μ, weighted by the inverse variances 1/s² and 1/τ² (A. Gelman et al., Bayesian Data Analysis, 3rd ed.,
//! 2013, sec. 5.4). With few groups τ is hardly known, and any single value of it makes intervals too short, most
//! of all a small one. It is therefore integrated over: values and intervals are those of a mixture of normal
//! laws. The prior is uniform in τ², with which intervals of groups hold the truth as often as they say also where
//! τ is as large as the errors (C. N. Morris, R. Tang, Stat. Sci. 26 (2011) 271), up to a scale A of five times the
//! typical error of a group, and falls beyond as that of a half-Cauchy law in τ (A. Gelman, Bayesian Anal. 1 (2006)
//! 515): the density of τ is A τ/(A² + τ²)^(3/2). It is proper, so that three groups are enough.
//!
//! The error of a group's estimate is itself an estimate, from a few velocities: `variances.rs`.
//!
//! What moves all estimates together (one model, one setup) is no scatter between groups, and does not become
//! smaller with their number. It enters by the change that one standard deviation of each such error makes in each
//! group: it stays in the interval of the mean and of every group, and is the same on both sides of a difference.

mod mixture;
mod variances;

use self::mixture::{Component, Mixture};
use self::variances::moderated_variances;

pub use self::mixture::PooledNumber;

/// Fewest groups whose scatter can be told from the errors of their estimates.
pub const POOLED_MIN: usize = 3;
/// Scale of the prior of the scatter, in typical errors of a group.
const PRIOR_SCALE: f64 = 5.0;
/// Number of values of the scatter from which the range of the plausible ones is taken.
const SCANNED: usize = 256;
/// Number of plausible values over which is integrated.
const NODES: usize = 64;
/// A density below the largest by this factor, as a logarithm, is not plausible.
const NEGLIGIBLE: f64 = 20.0;

/// The estimate of one group, on a scale on which it is nearly normal.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupEstimate {
    /// The estimate.
    pub value: f64,
    /// Standard error by the group's own data.
    pub error: f64,
    /// Degrees of freedom behind the standard error: one less than there are independent data.
    pub freedom: u64,
    /// Change of the estimate by one standard deviation of each error that all groups share; the same errors, in
    /// the same order, in every group.
    pub common: Vec<f64>,
}

/// The estimates of several groups, which share a mean and a scatter.
#[derive(Debug, Clone, PartialEq)]
pub struct Pooling {
    estimates: Vec<GroupEstimate>,
    /// Variances of the estimates by the groups' own data.
    variances: Vec<f64>,
    /// A, the scale of the prior.
    scale: f64,
    /// Part of the prior's probability between two nodes.
    step: f64,
    nodes: Vec<ScatterNode>,
}

/// One value of the scatter, and what follows for the mean.
#[derive(Debug, Clone, PartialEq)]
struct ScatterNode {
    /// Prior probability of a smaller scatter.
    below: f64,
    scatter: f64,
    /// Posterior probability.
    weight: f64,
    mean: f64,
    /// Variance of the mean without the common errors.
    variance: f64,
    /// Change of the mean by one standard deviation of each shared error.
    common: Vec<f64>,
}

impl Pooling {
    /// Pools the estimates; `None` if there are fewer than [`POOLED_MIN`], one is not a number, an own error is
    /// not above 0, or degrees of freedom are fewer than three.
    pub fn new(estimates: Vec<GroupEstimate>) -> Option<Self> {
        let is_usable = |one: &GroupEstimate| {
            let is_known = one.error.is_finite() && one.error > 0.0 && one.freedom > 2;
            is_known && one.value.is_finite() && one.common.iter().all(|moved| moved.is_finite())
        };
        if estimates.len() < POOLED_MIN || !estimates.iter().all(is_usable) {
            return None;
        }
        let errors = estimates.iter().map(|one| (one.error, one.freedom));
        let variances = moderated_variances(errors);
        let precision: f64 = variances.iter().map(|variance| 1.0 / variance).sum();
        let scale = PRIOR_SCALE * (estimates.len() as f64 / precision).sqrt();
        let mut pooling = Self { estimates, variances, scale, step: 0.0, nodes: Vec::new() };
        pooling.place_nodes();
        Some(pooling)
    }

    /// Returns the mean over the groups of which these are some.
    pub fn mean(&self) -> PooledNumber {
        let component = |node: &ScatterNode| (node.mean, node.variance + square_sum(&node.common));
        self.mixture(component).summary()
    }

    /// Returns the scatter: the standard deviation of the true values between groups.
    pub fn scatter(&self) -> PooledNumber {
        let [low, lower, median, upper, high] =
            [0.025, 0.16, 0.5, 0.84, 0.975].map(|part| self.scatter_quantile(part));
        PooledNumber { value: median, standard_error: 0.5 * (upper - lower), interval: [low, high] }
    }

    /// Returns the value of group number `group`, which is in range.
    pub fn group(&self, group: usize) -> PooledNumber {
        let component = |node: &ScatterNode| {
            let (mean, own, towards) = self.value_for_scatter(node, group);
            let moved = self.changes_by_shared_errors(node, group);
            (mean, own + towards * towards * node.variance + square_sum(&moved))
        };
        self.mixture(component).summary()
    }

    /// Returns the first group's value minus the second's; both are in range, and differ.
    pub fn difference(&self, first: usize, second: usize) -> PooledNumber {
        let component = |node: &ScatterNode| {
            let (one, own, towards) = self.value_for_scatter(node, first);
            let (other, other_own, other_towards) = self.value_for_scatter(node, second);
            let by_mean = towards - other_towards;
            let moved = self
                .changes_by_shared_errors(node, first)
                .into_iter()
                .zip(self.changes_by_shared_errors(node, second));
            let moved: Vec<f64> = moved.map(|(one, other)| one - other).collect();
            let variance = own + other_own + by_mean * by_mean * node.variance;
            (one - other, variance + square_sum(&moved))
        };
        self.mixture(component).summary()
    }

    /// Returns how much a group's own estimate counts for its value, 0 to 1; the rest is the mean's.
    pub fn own_weight(&self, group: usize) -> f64 {
        self.nodes.iter().map(|node| node.weight * (1.0 - self.towards_mean(node, group))).sum()
    }

    /// Places the nodes where the scatter is plausible, and weighs them.
    fn place_nodes(&mut self) {
        let scanned = self.nodes_between([0.0, 1.0], SCANNED);
        let largest = scanned.iter().map(|node| node.weight).fold(0.0, f64::max);
        let is_plausible = |node: &ScatterNode| node.weight > largest * libm::exp(-NEGLIGIBLE);
        let first = scanned.iter().position(is_plausible).unwrap_or(0);
        let last = scanned.iter().rposition(is_plausible).unwrap_or(SCANNED - 1);
        let range = [first, last + 1].map(|number| number as f64 / SCANNED as f64);
        self.step = (range[1] - range[0]) / NODES as f64;
        self.nodes = self.nodes_between(range, NODES);
    }

    /// Returns nodes in the middle of equal parts of a range of the prior's probability.
    fn nodes_between(&self, [low, high]: [f64; 2], count: usize) -> Vec<ScatterNode> {
        let step = (high - low) / count as f64;
        let node = |number: usize| self.node((number as f64 + 0.5).mul_add(step, low));
        let (mut nodes, logarithms): (Vec<ScatterNode>, Vec<f64>) = (0..count).map(node).unzip();
        let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        for (node, logarithm) in nodes.iter_mut().zip(logarithms) {
            node.weight = libm::exp(logarithm - largest);
        }
        let sum: f64 = nodes.iter().map(|node| node.weight).sum();
        nodes.iter_mut().for_each(|node| node.weight /= sum);
        nodes
    }

    /// Returns the node below which the scatter has this prior probability, and the logarithm of the likelihood
    /// of its scatter, with the mean integrated out.
    fn node(&self, below: f64) -> (ScatterNode, f64) {
        let scatter = self.prior_quantile(below);
        let precision = |variance: &f64| 1.0 / scatter.mul_add(scatter, *variance);
        let weights: Vec<f64> = self.variances.iter().map(precision).collect();
        let sum: f64 = weights.iter().sum();
        let average = |of: &dyn Fn(&GroupEstimate) -> f64| {
            let terms = weights.iter().zip(&self.estimates).map(|(weight, one)| weight * of(one));
            terms.sum::<f64>() / sum
        };
        let mean = average(&|one| one.value);
        let sources = self.estimates[0].common.len();
        let common = (0..sources).map(|source| average(&|one| one.common[source])).collect();
        let terms = weights.iter().zip(&self.estimates).map(|(weight, one)| {
            let off = one.value - mean;
            0.5 * (libm::log(*weight) - weight * off * off)
        });
        let logarithm = terms.sum::<f64>() - 0.5 * libm::log(sum);
        let node = ScatterNode { below, scatter, weight: 0.0, mean, variance: 1.0 / sum, common };
        (node, logarithm)
    }

    /// Returns the scatter below which the prior has this probability, 1 - A/√(A² + τ²).
    fn prior_quantile(&self, below: f64) -> f64 {
        let above = 1.0 - below;
        self.scale * (below * (1.0 + above)).sqrt() / above
    }

    fn scatter_quantile(&self, part: f64) -> f64 {
        let mut sum = 0.0;
        for node in &self.nodes {
            if sum + node.weight >= part {
                let within = (part - sum) / node.weight;
                return self.prior_quantile((within - 0.5).mul_add(self.step, node.below));
            }
            sum += node.weight;
        }
        self.nodes.last().map_or(f64::NAN, |node| node.scatter)
    }

    /// Returns how much the mean counts for the value of a group, given a scatter.
    fn towards_mean(&self, node: &ScatterNode, group: usize) -> f64 {
        let own = self.variances[group];
        own / node.scatter.mul_add(node.scatter, own)
    }

    /// Returns the mean of a group's value for one scatter, its variance if the mean of all groups were known, and
    /// the weight of that mean.
    fn value_for_scatter(&self, node: &ScatterNode, group: usize) -> (f64, f64, f64) {
        let towards = self.towards_mean(node, group);
        let value = self.estimates[group].value;
        let mean = towards.mul_add(node.mean - value, value);
        (mean, self.variances[group] * (1.0 - towards), towards)
    }

    /// Returns the change of a group's value by one standard deviation of each shared error, for one scatter.
    fn changes_by_shared_errors(&self, node: &ScatterNode, group: usize) -> Vec<f64> {
        let towards = self.towards_mean(node, group);
        let both = self.estimates[group].common.iter().zip(&node.common);
        both.map(|(own, of_mean)| towards.mul_add(of_mean - own, *own)).collect()
    }

    /// Returns the mixture of normal laws with these means and variances.
    fn mixture(&self, of: impl Fn(&ScatterNode) -> (f64, f64)) -> Mixture {
        let component = |node: &ScatterNode| {
            let (mean, variance) = of(node);
            Component { weight: node.weight, mean, deviation: variance.sqrt() }
        };
        Mixture(self.nodes.iter().map(component).collect())
    }
}

fn square_sum(numbers: &[f64]) -> f64 {
    numbers.iter().map(|number| number * number).sum()
}

#[cfg(test)]
mod tests;
