//! Warnings about unusual values before anything is computed.

use std::fmt;

use crate::case::{Case, Setup};
use crate::field_path::entry_path;
use crate::fields::{self, DeclaredKey, DeclaredValue, Number};
use crate::job::{Data, JobSpecification, Range};
use crate::origin::Origin;
use crate::parameters::Parameter;
use crate::quantile::quantile;

use crate::plausible::{self, PlausibleRange, short};

/// A velocity that differs from the median by more than this factor is an outlier.
const OUTLIER: f64 = 3.0;
/// Maximum number of outliers that are listed for one set.
const OUTLIERS_LISTED_MAX: usize = 5;
/// Maximum number of groups with individual warnings.
const GROUPS_LISTED_MAX: usize = 5;

/// Warning about a value that is unusual but accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// Path of the field in the user's file.
    pub field: String,
    /// The value found, the usual range, and the probable meaning.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.field, self.message)
    }
}

/// Returns the warnings about a case that has passed its checks.
pub fn case_warnings(case: &Case) -> Vec<Warning> {
    let mut warnings = Warnings::default();
    warnings.setup(&case.setup);
    warnings.number("bone.density", case.bone.density, &plausible::DENSITY);
    let diagonal = (0..6).map(|i| case.bone.elasticity.rows()[i][i]);
    let largest = diagonal.fold(0.0, f64::max);
    if let Some(doubt) = plausible::MODULUS.doubt(largest) {
        warnings.add("bone", format!("the largest stiffness {doubt}"));
    }
    warnings.0
}

/// Returns the warnings about a job that has passed its checks.
pub fn job_warnings(specification: &JobSpecification) -> Vec<Warning> {
    job_warnings_from(specification, None)
}

/// Same as [`job_warnings`], for a job whose measured velocities are in the file `origin`.
pub fn job_warnings_from(
    specification: &JobSpecification,
    origin: Option<&Origin>,
) -> Vec<Warning> {
    let mut warnings = Warnings::default();
    warnings.setup(&specification.setup);
    for parameter in Parameter::ALL {
        warnings.parameter(parameter, specification.range(parameter));
    }
    if let Some(data) = &specification.data {
        warnings.data(data, origin);
    }
    warnings.0
}

#[derive(Debug, Default)]
struct Warnings(Vec<Warning>);

impl Warnings {
    fn add(&mut self, field: &str, message: impl Into<String>) {
        self.0.push(Warning { field: field.to_owned(), message: message.into() });
    }

    fn number(&mut self, field: &str, value: f64, kind: &PlausibleRange) {
        if let Some(doubt) = kind.doubt(value) {
            self.add(field, doubt);
        }
    }

    fn setup(&mut self, setup: &Setup) {
        let mut setup = *setup;
        for (key, section) in setup.sections() {
            self.entries(key.name, &fields::entries(section));
        }
        let probe = &setup.probe;
        let distance = (probe.receivers.first_x1 - probe.source.x1).abs();
        if let Some(doubt) = plausible::DISTANCE.doubt(distance) {
            self.add("probe.receivers.first_x1", format!("its distance from the source {doubt}"));
        }
    }

    fn entries(&mut self, table: &str, entries: &[DeclaredKey]) {
        for entry in entries.iter().filter(|entry| entry.applies()) {
            let field = entry_path(table, entry.key.name);
            match &entry.value {
                DeclaredValue::Number(Some(value), Number { plausible: Some(range), .. }) => {
                    self.number(&field, *value, range);
                }
                DeclaredValue::Table(entries) => self.entries(&field, entries),
                _ => {}
            }
        }
    }

    /// Checks only a fixed value or the start: bounds may be arbitrarily wide.
    fn parameter(&mut self, parameter: Parameter, range: Range) {
        let key = match range {
            Range::Fixed(_) => "fixed",
            Range::Free { .. } => "start",
        };
        let field = format!("parameters.{}.{key}", parameter.name());
        self.number(&field, range.start(), &PlausibleRange::of(parameter));
    }

    fn data(&mut self, data: &Data, origin: Option<&Origin>) {
        match data {
            Data::Moments { mean, coefficient_of_variation } => {
                self.number("data.mean", *mean, &plausible::VELOCITY);
                let variation = *coefficient_of_variation;
                self.number("data.coefficient_of_variation", variation, &plausible::VARIATION);
            }
            Data::Velocities(velocities) => {
                self.velocities("data.velocities", velocities, (origin, 0));
            }
            Data::Groups(groups) => {
                let mut warned = 0;
                for (set, group) in groups.iter().enumerate() {
                    let mut of_group = Self::default();
                    let field = entry_path("data.groups", &group.name);
                    of_group.velocities(&field, &group.velocities, (origin, set));
                    warned += usize::from(!of_group.0.is_empty());
                    if warned <= GROUPS_LISTED_MAX {
                        self.0.append(&mut of_group.0);
                    }
                }
                let more = warned.saturating_sub(GROUPS_LISTED_MAX);
                if more > 0 {
                    self.add("data.groups", format!("{more} more groups are unusual"));
                }
            }
        }
    }

    /// Checks the median and the scatter of a set, and lists outliers.
    fn velocities(
        &mut self,
        field: &str,
        velocities: &[f64],
        (origin, set): (Option<&Origin>, usize),
    ) {
        let mut ascending = velocities.to_vec();
        ascending.sort_unstable_by(f64::total_cmp);
        let Some(median) = quantile(&ascending, 0.5) else { return };
        if let Some(doubt) = plausible::VELOCITY.doubt(median) {
            self.add(field, format!("their median {doubt}"));
        }
        let outside = |velocity: f64| velocity > OUTLIER * median || velocity < median / OUTLIER;
        let outliers: Vec<(usize, f64)> = velocities
            .iter()
            .copied()
            .enumerate()
            .filter(|&(_, velocity)| outside(velocity))
            .collect();
        if outliers.is_empty() {
            return;
        }
        let listed: Vec<String> = outliers
            .iter()
            .take(OUTLIERS_LISTED_MAX)
            .map(|&(index, velocity)| match origin.and_then(|origin| origin.line(set, index)) {
                Some(line) => format!("{} (line {line})", short(velocity)),
                None => format!("{} (number {})", short(velocity), index + 1),
            })
            .collect();
        let more = match outliers.len() - listed.len() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let file = origin.map(|origin| format!("{}: ", origin.path().display()));
        self.add(
            field,
            format!(
                "{}{}{more} m/s: more than a factor {OUTLIER} from the median {} m/s; in other units, \
                 or a slip of the decimal point?",
                file.unwrap_or_default(),
                listed.join(", "),
                short(median)
            ),
        );
    }
}
