//! The course of a search: what its figures show, be it read from the files of a run or followed while
//! the job runs.

use osteon_common::job::{JobSpecification, Range};
use osteon_common::parameters::Parameter;
use osteon_common::results::{DataSummary, Evaluation};
use osteon_files::report::{Moment, MomentIntervals, Moments};

use crate::figure_names::{prefix, suffix};
use crate::finding::Finding;

/// Most rows of a job that is followed; then every second one is dropped.
const ROWS_KEPT_MAX: usize = 8192;

/// The evaluations of a search for one set of data.
#[derive(Debug, Clone, Default)]
pub struct SearchCourse {
    /// Beginning of the names of its figures.
    pub(crate) prefix: String,
    /// End of the titles of its figures.
    pub(crate) suffix: String,
    /// The evaluations, in order.
    pub(crate) rows: Vec<CourseRow>,
    pub(crate) free: Vec<Parameter>,
    /// Moments of the data.
    pub(crate) measured: Moments,
    /// Confidence intervals of these.
    pub(crate) intervals: Option<MomentIntervals>,
    /// The cost that sampling noise alone causes.
    pub(crate) noise_level: Option<f64>,
    /// Place of the first evaluation below it.
    pub(crate) below_noise_from: Option<f64>,
    /// Ranges of the free parameters, in their order.
    ranges: Vec<Range>,
    /// Number of evaluations, with those that were dropped.
    count: u64,
}

/// One evaluation; NaN where there is no number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CourseRow {
    /// Its number within the search, from 0.
    pub(crate) place: f64,
    /// Its cost, infinite at an infeasible point.
    pub(crate) cost: f64,
    /// Its mean (m/s) and coefficient of variation.
    pub(crate) moments: [f64; 2],
    /// Places of the free parameters between their bounds.
    pub(crate) within: Vec<f64>,
}

impl SearchCourse {
    /// The course of a search that is followed from its beginning.
    pub fn for_job(specification: &JobSpecification, set: usize) -> Self {
        let free = specification.ranges_of(set);
        let free = Parameter::ALL.into_iter().zip(free);
        let (free, ranges) = free.filter(|(_, range)| matches!(range, Range::Free { .. })).unzip();
        let groups = specification.data.as_ref().map(|data| data.groups()).unwrap_or_default();
        let name = groups.get(set).map(|group| group.name.as_str());
        Self { prefix: prefix(name, set), suffix: suffix(name), free, ranges, ..Self::default() }
    }

    /// Shows the moments of these data.
    pub fn set_data(&mut self, data: &DataSummary) {
        self.measured = data.moments.into();
        self.intervals = data.intervals.map(MomentIntervals::from);
    }

    /// Adds an evaluation, unless it only measures a derivative or a posterior.
    pub fn add(&mut self, row: &Evaluation) {
        if !row.role.is_of_search() {
            return;
        }
        let moments = row.moments.map(|moments| [moments.mean, moments.coefficient_of_variation]);
        let within = self.free.iter().zip(&self.ranges).map(|(parameter, range)| {
            range.coordinate(row.point.get(*parameter)).unwrap_or(f64::NAN)
        });
        self.rows.push(CourseRow {
            place: self.count as f64,
            cost: row.cost.unwrap_or(f64::NAN),
            moments: moments.unwrap_or([f64::NAN; 2]),
            within: within.collect(),
        });
        self.count += 1;
        if self.rows.len() > ROWS_KEPT_MAX {
            // The lower cost of each two, so that the best so far stays what it was.
            let kept = self.rows.chunks(2).filter_map(|both| {
                let cost =
                    |row: &&CourseRow| if row.cost.is_nan() { f64::INFINITY } else { row.cost };
                both.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)))
            });
            self.rows = kept.cloned().collect();
        }
    }

    /// Returns the number of evaluations of the search so far.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The course of a search whose files are read; `None` where its history is not known.
    pub(crate) fn from_finding(finding: &Finding<'_>) -> Option<Self> {
        let table = finding.context.history.as_ref()?;
        let groups = table.texts("group");
        let belongs = |place: &usize| match (&groups, finding.group) {
            (Some(groups), Some(name)) => groups[*place] == name,
            _ => true,
        };
        let places: Vec<usize> = (0..table.len()).filter(belongs).collect();
        let column = |name: &str| table.numbers(name).ok().flatten();
        let at = |column: &Option<Vec<f64>>, place: usize| {
            column.as_ref().map_or(f64::NAN, |column| column[place])
        };
        let (numbers, costs) = (column("evaluation"), column("cost"));
        let moments = ["mean", "coefficient_of_variation"].map(column);
        let named_column = |parameter: &Parameter| Some((*parameter, column(parameter.name())?));
        let free: Vec<_> = finding.free_parameters().iter().filter_map(named_column).collect();
        let within = |parameter: Parameter, value: f64| {
            finding.range(parameter).coordinate(value).unwrap_or(f64::NAN)
        };
        let row = |(number, place): (usize, &usize)| CourseRow {
            place: number as f64,
            cost: at(&costs, *place),
            moments: [at(&moments[0], *place), at(&moments[1], *place)],
            within: free.iter().map(|(name, values)| within(*name, values[*place])).collect(),
        };
        let first_below = finding.below_noise_from.and_then(|number| {
            let numbers = numbers.as_ref()?;
            let found = places.iter().position(|place| numbers[*place] == number as f64);
            found.map(|place| place as f64)
        });
        Some(Self {
            prefix: finding.prefix(),
            suffix: finding.suffix(),
            rows: places.iter().enumerate().map(row).collect(),
            measured: finding.data.map(|data| data.moments).unwrap_or_default(),
            intervals: finding.data.and_then(|data| data.intervals().copied()),
            noise_level: finding.noise_level(),
            below_noise_from: first_below,
            count: places.len() as u64,
            ranges: free.iter().map(|(name, _)| finding.range(*name)).collect(),
            free: free.into_iter().map(|(name, _)| name).collect(),
        })
    }

    /// Returns one of the moments of each evaluation.
    pub(crate) fn moments(&self, moment: Moment) -> Vec<f64> {
        let place = match moment {
            Moment::Mean => 0,
            Moment::CoefficientOfVariation => 1,
        };
        self.rows.iter().map(|row| row.moments[place]).collect()
    }
}
