//! How many evaluations a job will probably take, before any of them is made.

use osteon_common::job::{Data, JobKind, JobSpecification, SearchMethod};
use osteon_common::parameters::Parameter;

/// Evaluations of the simplex: a number, and so many more for each free parameter. Searches of seven
/// parameters take some 120 to 250, of two some 50 to 100.
const SIMPLEX: [(u64, u64); 2] = [(30, 13), (40, 30)];
/// Evaluations of Newton's search from the first start, and from each other.
const NEWTON: [(u64, u64); 2] = [(4, 3), (10, 8)];
/// Evaluations of a posterior of one or two parameters, which is smooth, and of more.
const POSTERIOR: [(u64, u64); 2] = [(32, 100), (128, 250)];
/// Largest number of parameters whose posterior is one of few.
const FEW: usize = 2;

/// The usual range of the number of evaluations of a job. Most jobs are within it; none takes more than
/// [`JobSpecification::evaluations_max`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExpectedEvaluations {
    /// As few as if everything goes well.
    pub fewest: u64,
    /// As many as a difficult job usually takes.
    pub most: u64,
}

impl ExpectedEvaluations {
    /// Returns the range for a job that has been checked.
    pub fn from_specification(specification: &JobSpecification) -> Self {
        if specification.kind == JobKind::Propagation {
            return Self { fewest: 1, most: 1 };
        }
        let [fewest, most] = [0, 1].map(|end| {
            let sets = specification.data.as_ref().map_or(1, Data::searchable_count) as u64;
            let each = searched(specification, end).saturating_add(sampled(specification, end));
            each.saturating_mul(sets).min(specification.evaluations_max())
        });
        Self { fewest, most }
    }
}

/// Returns the evaluations of the searches of one set of data, from all starts, and of the derivatives;
/// `end` is 0 for few and 1 for many.
fn searched(specification: &JobSpecification, end: usize) -> u64 {
    let search = &specification.search;
    let free = specification.free().count() as u64;
    let is_unknown =
        |one: &Parameter| one.of_setup().is_some() && !Parameter::OF_PORES.contains(one);
    // What no closed form tells of is measured at the first point.
    let unknown = match specification.observables().is_empty() {
        true => specification.free().filter(is_unknown).count() as u64,
        false => free,
    };
    let each = |evaluations: u64| evaluations.min(search.max_evaluations);
    let searches = match search.method {
        SearchMethod::Simplex => {
            let (base, slope) = SIMPLEX[end];
            each(base + slope * free).saturating_mul(search.starts)
        }
        SearchMethod::Newton => {
            let (first, other) = NEWTON[end];
            let others = each(other + unknown).saturating_mul(search.starts.saturating_sub(1));
            each(first + unknown).saturating_add(others)
        }
        SearchMethod::Posterior => return 0,
    };
    searches.saturating_add(if search.sensitivities { free } else { 0 })
}

/// Returns the evaluations of the posterior of one set of data.
fn sampled(specification: &JobSpecification, end: usize) -> u64 {
    let (few, many) = POSTERIOR[end];
    let usual = if specification.free().count() <= FEW { few } else { many };
    specification.posterior.map_or(0, |posterior| usual.min(posterior.max_evaluations))
}

#[cfg(test)]
mod tests {
    use osteon_common::case::Setup;
    use osteon_common::group_settings::GroupSettings;
    use osteon_common::job::{Group, MonteCarlo, Objective, PosteriorSettings, Range, Search};
    use osteon_common::random_quantities::RandomQuantities;
    use osteon_common::systematic::Systematic;

    use super::*;

    /// The paper's search of seven parameters.
    fn job(method: SearchMethod) -> JobSpecification {
        let start = [1750.0, 20e9, 0.32, 4.5e9, 12e9, 0.38, 0.15];
        let free = start.map(|start| Range::Free { start, lower: 0.9 * start, upper: 1.1 * start });
        JobSpecification {
            kind: JobKind::Identification,
            setup: Setup::default(),
            data: Some(Data::from_moments(3900.0, 0.027)),
            parameters: Range::of_bone(free),
            random: RandomQuantities::default(),
            systematic: Systematic::default(),
            groups: GroupSettings::default(),
            monte_carlo: MonteCarlo::default(),
            objective: Objective::Moments,
            search: Search::by(method),
            posterior: None,
        }
    }

    fn range(specification: &JobSpecification) -> (u64, u64) {
        let ExpectedEvaluations { fewest, most } =
            ExpectedEvaluations::from_specification(specification);
        assert!(most <= specification.evaluations_max());
        (fewest, most)
    }

    #[test]
    fn the_range_is_that_of_usual_jobs() {
        // 121 to 250 of the search, and seven for the derivatives.
        assert_eq!(range(&job(SearchMethod::Simplex)), (128, 257));
        assert_eq!(range(&job(SearchMethod::Newton)), (11, 17));
        let propagation = JobSpecification {
            kind: JobKind::Propagation,
            data: None,
            ..job(SearchMethod::Simplex)
        };
        assert_eq!(range(&propagation), (1, 1));
    }

    #[test]
    fn settings_limit_the_range() {
        let mut limited = job(SearchMethod::Simplex);
        limited.search.max_evaluations = 50;
        limited.search.sensitivities = false;
        assert_eq!(range(&limited), (50, 50));
        limited.posterior =
            Some(PosteriorSettings { max_evaluations: 120, ..PosteriorSettings::default() });
        assert_eq!(range(&limited), (150, 170));
        limited.search.method = SearchMethod::Posterior;
        assert_eq!(range(&limited), (100, 120));
    }

    #[test]
    fn every_start_and_every_group_counts() {
        let mut repeated = job(SearchMethod::Newton);
        repeated.search.starts = 30;
        // Thirty starts of the paper's example took 108 evaluations.
        assert_eq!(range(&repeated), (4 + 29 * 3 + 7, 10 + 29 * 8 + 7));
        let group = |name: &str| Group::new(name, vec![3900.0, 3950.0, 4000.0]);
        repeated.search.starts = 1;
        let lonely = Group::new("lonely", vec![3900.0]);
        repeated.data = Some(Data::from_groups(vec![group("a"), lonely, group("b")]));
        assert_eq!(range(&repeated), (22, 34), "a group without variation is not searched");
    }
}
