//! Warnings about unusual values before anything is computed.

use std::fmt;

use crate::bone_structure::MeanSolid;
use crate::case::{Bone, Case, Setup};
use crate::field_path::{element_path, entry_path};
use crate::fields::{self, DeclaredKey, DeclaredValue, Number};
use crate::job::{Data, JobSpecification, Measurements, Range};
use crate::moments::Outlier;
use crate::origin::Origin;
use crate::parameters::Parameter;
use crate::quantile::quantile;
use crate::robust::outliers;
use crate::settings::Picking;
use crate::setup_quantity::SetupQuantity;

use crate::plausible::{self, PlausibleRange, short};

/// Path of the sublayers of a bone.
const SUBLAYERS: &str = "bone.sublayers";
/// Most rows that are named which are no measurements.
const NO_ROWS_MAX: usize = 5;
/// A velocity that differs from the median by more than this factor is probably in another unit.
const FACTOR: f64 = 3.0;
/// Maximum number of outliers that are listed for one set.
const OUTLIERS_LISTED_MAX: usize = 5;
/// Number of equal velocities in a row that are not expected by chance, and smallest number of
/// velocities in a block that repeats.
const COPIES_MIN: usize = 5;
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
    if case.bone.sublayers().is_some() {
        warnings.rename_whole_thickness();
    }
    for (table, solid) in case.bone.solids() {
        warnings.solid(&table, solid);
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
    let structure = &specification.setup.structure;
    if structure.is_layered() {
        warnings.rename_whole_thickness();
    }
    for (index, sublayer) in structure.sublayers.iter().enumerate() {
        if let MeanSolid::Given(solid) = &sublayer.solid {
            warnings.solid(&element_path(SUBLAYERS, index), solid);
        }
    }
    for parameter in specification.parameters_ranged() {
        warnings.parameter(parameter, specification.range(parameter));
    }
    if let Some(data) = &specification.data {
        warnings.known(data);
        warnings.data(data, origin);
    }
    if let Some(picked) = origin.and_then(|origin| origin.picking) {
        warnings.picking(&specification.setup.picking, &picked);
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

    /// Gives the warnings about the thickness of the bone to its sublayers, which add up to it.
    fn rename_whole_thickness(&mut self) {
        let whole = SetupQuantity::BoneThickness.mean_key();
        for warning in self.0.iter_mut().filter(|warning| warning.field == whole) {
            SUBLAYERS.clone_into(&mut warning.field);
            warning.message = format!("the thickness of all together {}", warning.message);
        }
    }

    fn solid(&mut self, table: &str, solid: &Bone) {
        self.number(&entry_path(table, "density"), solid.density, &plausible::DENSITY);
        let diagonal = (0..6).map(|i| solid.elasticity.rows()[i][i]);
        let largest = diagonal.fold(0.0, f64::max);
        if let Some(doubt) = plausible::MODULUS.doubt(largest) {
            self.add(table, format!("the largest stiffness {doubt}"));
        }
    }

    fn setup(&mut self, setup: &Setup) {
        let mut setup = setup.clone();
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
                DeclaredValue::List { elements, .. } => {
                    for (index, entries) in elements.iter().enumerate() {
                        self.entries(&element_path(&field, index), entries);
                    }
                }
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
        self.number(&field, range.start(), parameter.row().plausible);
    }

    /// Names, for each quantity that is known of the groups, the first group whose value is unusual.
    fn known(&mut self, data: &Data) {
        for parameter in Parameter::OF_SETUP {
            let range = parameter.row().plausible;
            let doubt = data.groups().iter().find_map(|group| {
                let doubt = range.doubt(group.known.get(parameter)?)?;
                Some(format!("that of the group {:?} {doubt}", group.name))
            });
            if let Some(doubt) = doubt {
                self.add(&format!("data.known.{}", parameter.name()), doubt);
            }
        }
    }

    /// Warns if the model's signals and the measured ones are picked by different criteria.
    fn picking(&mut self, of_model: &Picking, of_data: &Picking) {
        if of_model == of_data {
            return;
        }
        let stated = |one: &Picking| {
            format!("extremum = \"{}\", threshold = {:?}", one.extremum.name(), one.threshold)
        };
        let (model, data) = (stated(of_model), stated(of_data));
        self.add(
            "picking",
            format!(
                "has {model}, and the file of velocities says that they were picked with {data}; velocities by \
                 different criteria differ by tens of m/s: write the latter into [picking]"
            ),
        );
    }

    fn data(&mut self, data: &Data, origin: Option<&Origin>) {
        if let Some(column) = origin.and_then(|origin| origin.unused_subjects.as_deref()) {
            self.add(
                "data.velocities",
                format!(
                    "the column {column:?} of the file repeats; if these are velocities of the same \
                     subject, name it: subject = {column:?}"
                ),
            );
        }
        if let Some(left_out) = origin.map(|origin| origin.left_out).filter(|&count| count > 0) {
            let message = match left_out {
                1 => "a row has a missing value and is left out".to_owned(),
                _ => format!("{left_out} rows have a missing value and are left out"),
            };
            self.add("data.missing", message);
        }
        if let Some(rows) = origin.map(|origin| &origin.no_rows).filter(|rows| !rows.is_empty()) {
            let message = format!(
                "{} of the file {} no measurement and left out: {}",
                if rows.len() == 1 { "a line".to_owned() } else { format!("{} lines", rows.len()) },
                if rows.len() == 1 { "is" } else { "are" },
                rows.iter().take(NO_ROWS_MAX).map(String::as_str).collect::<Vec<_>>().join(", ")
            );
            self.add("data.velocities", message);
        }
        match &data.measurements {
            Measurements::Moments { mean, coefficient_of_variation, .. } => {
                self.number("data.mean", *mean, &plausible::VELOCITY);
                let variation = *coefficient_of_variation;
                self.number("data.coefficient_of_variation", variation, &plausible::VARIATION);
            }
            Measurements::Velocities { velocities, .. } => {
                self.velocities("data.velocities", velocities, (origin, 0));
            }
            Measurements::Groups(groups) => {
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

    /// Doubts that all velocities of a set are measurements of their own.
    fn copies(&mut self, field: &str, velocities: &[f64], place: (Option<&Origin>, usize)) {
        if let Some((first, count)) = longest_run(velocities).filter(|run| run.1 >= COPIES_MIN) {
            self.add(
                field,
                format!(
                    "{count} velocities in a row are {:?} m/s, from {} on: are these copies?",
                    velocities[first],
                    place_of(place, first)
                ),
            );
        }
        if let Some(period) = period(velocities) {
            let times = velocities.len() / period;
            self.add(
                field,
                format!(
                    "the first {period} velocities are repeated in the same order, {times} times in \
                     all: are these copies?"
                ),
            );
        }
    }

    /// Checks the median and the scatter of a set, and lists outliers.
    fn velocities(
        &mut self,
        field: &str,
        velocities: &[f64],
        (origin, set): (Option<&Origin>, usize),
    ) {
        let Some(median) = median(velocities) else { return };
        if let Some(doubt) = plausible::VELOCITY.doubt(median) {
            self.add(field, format!("their median {doubt}"));
        }
        self.copies(field, velocities, (origin, set));
        let place = |index| place_of((origin, set), index);
        let file = origin.map(|origin| format!("{}: ", origin.path().display()));
        let file = file.unwrap_or_default();
        let outside = |velocity: f64| velocity > FACTOR * median || velocity < median / FACTOR;
        self.outside(field, &file, median, (velocities, &outside), &place);
        let mut far = outliers(velocities);
        far.retain(|outlier| !outside(outlier.velocity));
        if let Some(listed) = far_apart(&far, &place) {
            let (median, more) = (short(median), and_more(far.len()));
            self.add(
                field,
                format!(
                    "{file}{listed} robust standard deviations from the median {median} m/s{more}; check \
                     this: it changes both moments, but hardly a likelihood or a posterior"
                ),
            );
        }
    }

    /// Lists the velocities that differ from the median by a factor.
    fn outside(
        &mut self,
        field: &str,
        file: &str,
        median: f64,
        (velocities, outside): (&[f64], &dyn Fn(f64) -> bool),
        place: &dyn Fn(usize) -> String,
    ) {
        let all = velocities.iter().enumerate().filter(|(_, velocity)| outside(**velocity));
        let all: Vec<String> = all
            .map(|(index, &velocity)| format!("{} ({})", short(velocity), place(index)))
            .collect();
        if all.is_empty() {
            return;
        }
        self.add(
            field,
            format!(
                "{file}{}{} m/s: more than a factor {FACTOR} from the median {} m/s; in other units, or a \
                 slip of the decimal point?",
                all[..all.len().min(OUTLIERS_LISTED_MAX)].join(", "),
                and_more(all.len()),
                short(median)
            ),
        );
    }
}

/// Says by how many robust standard deviations velocities are away; `None` for no velocity.
fn far_apart(far: &[Outlier], place: &dyn Fn(usize) -> String) -> Option<String> {
    let listed: Vec<String> = far
        .iter()
        .take(OUTLIERS_LISTED_MAX)
        .map(|outlier| {
            let Outlier { index, velocity, deviations } = *outlier;
            let index = usize::try_from(index).unwrap_or(usize::MAX);
            let (velocity, place) = (short(velocity), place(index));
            format!("{velocity} m/s ({place}) is {:.0}", deviations.abs())
        })
        .collect();
    (!listed.is_empty()).then(|| listed.join(", "))
}

/// Returns how many of this number of velocities are not listed, as the end of a list.
fn and_more(count: usize) -> String {
    match count.saturating_sub(OUTLIERS_LISTED_MAX) {
        0 => String::new(),
        more => format!(" and {more} more"),
    }
}

/// Returns the line of a velocity, or its number in the list.
fn place_of((origin, set): (Option<&Origin>, usize), index: usize) -> String {
    match origin.and_then(|origin| origin.line(set, index)) {
        Some(line) => format!("line {line}"),
        None => format!("number {}", index + 1),
    }
}

/// Returns the first of the longest runs of equal velocities: its first index, and its length.
fn longest_run(velocities: &[f64]) -> Option<(usize, usize)> {
    let mut longest: Option<(usize, usize)> = None;
    let mut first = 0;
    for run in velocities.chunk_by(|a, b| a == b) {
        if longest.is_none_or(|(_, count)| run.len() > count) {
            longest = Some((first, run.len()));
        }
        first += run.len();
    }
    longest
}

/// Returns the length of the shortest block of which all velocities are repetitions; `None` if it
/// would have fewer than [`COPIES_MIN`] velocities, or equal ones only.
fn period(velocities: &[f64]) -> Option<usize> {
    let count = velocities.len();
    let is_period = |&period: &usize| {
        count.is_multiple_of(period) && velocities[period..] == velocities[..count - period]
    };
    let period = (1..=count / 2).find(is_period)?;
    (period >= COPIES_MIN).then_some(period)
}

fn median(velocities: &[f64]) -> Option<f64> {
    let mut ascending = velocities.to_vec();
    ascending.sort_unstable_by(f64::total_cmp);
    quantile(&ascending, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_and_repeated_blocks_are_found() {
        let six: Vec<f64> = (0..6).map(|k| 3900.0 + f64::from(k * k)).collect();
        for (velocities, run, block) in [
            (vec![], None, None),
            (vec![3900.0; 7], Some((0, 7)), None),
            (vec![1.0, 2.0, 2.0, 3.0, 3.0], Some((1, 2)), None),
            (six.clone(), Some((0, 1)), None),
            (six.repeat(2), Some((0, 1)), Some(6)),
            (six.repeat(3), Some((0, 1)), Some(6)),
            (six.repeat(4), Some((0, 1)), Some(6)),
            (six[..4].repeat(4), Some((0, 1)), None),
            ([&six[..], &six[..5]].concat(), Some((0, 1)), None),
        ] {
            assert_eq!((longest_run(&velocities), period(&velocities)), (run, block));
        }
    }

    #[test]
    fn copies_and_an_unused_column_of_subjects_cause_a_warning() {
        let velocities = [[3900.0; 5], [3911.0, 3922.0, 3933.0, 3944.0, 3955.0]].concat().repeat(2);
        let origin = Origin {
            path: "v.csv".into(),
            lines: vec![(2..22).collect()],
            unused_subjects: Some("patient".to_owned()),
            ..Origin::default()
        };
        let mut warnings = Warnings::default();
        warnings.data(&Data::from_velocities(velocities), Some(&origin));
        let found: Vec<String> = warnings.0.iter().map(ToString::to_string).collect();
        assert_eq!(
            found,
            [
                "data.velocities: the column \"patient\" of the file repeats; if these are velocities of \
                 the same subject, name it: subject = \"patient\"",
                "data.velocities: 5 velocities in a row are 3900.0 m/s, from line 2 on: are these copies?",
                "data.velocities: the first 10 velocities are repeated in the same order, 2 times in all: \
                 are these copies?",
            ]
        );
    }

    #[test]
    fn velocities_far_from_the_median_are_named_with_their_lines() {
        let mut velocities: Vec<f64> = (0..40).map(|k| 3900.0 + f64::from(k % 7)).collect();
        let warnings = |velocities: &[f64], origin: Option<&Origin>| {
            let mut warnings = Warnings::default();
            warnings.data(&Data::from_velocities(velocities.to_vec()), origin);
            warnings.0.iter().map(ToString::to_string).collect::<Vec<String>>()
        };
        assert_eq!(warnings(&velocities, None), [""; 0]);
        velocities[17] = 7800.0;
        let origin =
            Origin { path: "v.csv".into(), lines: vec![(2..42).collect()], ..Origin::default() };
        assert_eq!(
            warnings(&velocities, Some(&origin)),
            [
                "data.velocities: v.csv: 7800 m/s (line 19) is 1314 robust standard deviations from the \
                 median 3903 m/s; check this: it changes both moments, but hardly a likelihood or a \
                 posterior"
            ]
        );
        // One of another unit is listed by itself.
        velocities[30] = 390.0;
        for (k, velocity) in velocities[20..27].iter_mut().enumerate() {
            *velocity = 3800.0 - k as f64;
        }
        let found = warnings(&velocities, None);
        assert!(found[0].contains("390 (number 31) m/s: more than a factor 3"), "{found:?}");
        let listed = "7800 m/s (number 18) is 1315, 3800 m/s (number 21) is ";
        assert!(found[1].contains(listed), "{found:?}");
        assert!(found[1].contains(" from the median 3902 m/s and 3 more; check"), "{found:?}");
    }
}
