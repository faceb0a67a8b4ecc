//! The measured data of a job: velocities, in groups or not, or their moments, and the keys that
//! describe their noise.

use std::collections::BTreeMap;

use thiserror::Error;

use crate::known_quantities::KnownQuantities;
use crate::observables::{ObservableSet, ObservedColumns, PerObservable};

/// The measured velocities, or their moments, with the instrument's own scatter.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// The measurements.
    pub measurements: Measurements,
    /// Standard deviation of repeated measurements of the same place, m/s, at least 0. Its square is
    /// a part of the data's variance, and not of the model's; 0 if it is not known.
    pub repeatability: f64,
    /// Standard deviation of an error that all decays have in common, dB/cm, at least 0: that of the receivers'
    /// gains. No scatter of the data shows it.
    pub decay_error: f64,
}

/// The measured velocities, or their moments.
#[derive(Debug, Clone, PartialEq)]
pub enum Measurements {
    /// The velocities themselves.
    Velocities {
        /// Velocities, m/s, each finite and above 0, at least two.
        velocities: Vec<f64>,
        /// Subject of each velocity, as for [`Group::subjects`].
        subjects: Option<Vec<u32>>,
        /// Observables measured with each velocity, as for [`Group::observables`].
        observables: ObservedColumns,
    },
    /// Several sets of velocities. Each group is identified separately, in this order; at least one
    /// of them has two different velocities.
    Groups(Vec<Group>),
    /// Their moments.
    Moments {
        /// Mean, m/s.
        mean: f64,
        /// Coefficient of variation.
        coefficient_of_variation: f64,
        /// Number of independent velocities behind these moments, at least two; `None` if it is not
        /// known.
        count: Option<u64>,
    },
}

/// The measured velocities of one group: a bone, a patient, a site.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Unique name, not empty, without hidden characters.
    pub name: String,
    /// Velocities, m/s, each finite and above 0, at least one.
    pub velocities: Vec<f64>,
    /// Subject of each velocity, from 0, numbered by [`numbered`]: velocities of one subject are
    /// not independent. `None` if all velocities are independent.
    pub subjects: Option<Vec<u32>>,
    /// Values of other observables that were measured with each velocity; in every group of a job the
    /// same observables.
    pub observables: ObservedColumns,
    /// Quantities of the setup that are known of this group: in every group of a job the same ones, each with
    /// the group's own value.
    pub known: KnownQuantities,
}

/// The velocities of one set, with what is known of their noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocitySet<'a> {
    /// Velocities, m/s.
    pub velocities: &'a [f64],
    /// Subject of each velocity, as for [`Group::subjects`].
    pub subjects: Option<&'a [u32]>,
    /// Observables measured with each velocity, as for [`Group::observables`].
    pub observables: PerObservable<Option<&'a [f64]>>,
    /// The instrument's own standard deviation, m/s.
    pub repeatability: f64,
}

/// Reason why velocities have no coefficient of variation that a model could match.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum NoVariation {
    /// There is only one velocity.
    #[error("only one velocity: {NEEDS_TWO}")]
    OneVelocity,
    /// All velocities are equal.
    #[error("all {count} velocities are {velocity:?} m/s: {NEEDS_TWO}")]
    AllEqual {
        /// Number of velocities.
        count: usize,
        /// The velocity, m/s.
        velocity: f64,
    },
}

const NEEDS_TWO: &str = "a coefficient of variation needs at least two different ones";

/// Returns a number for each name, from 0 in the order of their first appearance.
pub fn numbered<T: Ord>(names: impl IntoIterator<Item = T>) -> Vec<u32> {
    let mut known = BTreeMap::new();
    let number = |name| {
        // Files and messages have far fewer velocities than this.
        let next = u32::try_from(known.len()).unwrap_or(u32::MAX);
        *known.entry(name).or_insert(next)
    };
    names.into_iter().map(number).collect()
}

impl Group {
    /// Creates a group of independent velocities, m/s.
    pub fn new(name: impl Into<String>, velocities: Vec<f64>) -> Self {
        let (observables, known) = (ObservedColumns::default(), KnownQuantities::default());
        Self { name: name.into(), velocities, subjects: None, observables, known }
    }

    /// Returns the reason why this group cannot be searched; `None` if it can.
    pub fn no_variation(&self) -> Option<NoVariation> {
        match self.velocities.as_slice() {
            [_] => Some(NoVariation::OneVelocity),
            [velocity, others @ ..] if others.iter().all(|other| other == velocity) => {
                Some(NoVariation::AllEqual { count: self.velocities.len(), velocity: *velocity })
            }
            _ => None,
        }
    }
}

impl Data {
    /// Creates data of one set of independent velocities, m/s.
    pub fn from_velocities(velocities: Vec<f64>) -> Self {
        let observables = ObservedColumns::default();
        Self::exact(Measurements::Velocities { velocities, subjects: None, observables })
    }

    /// Creates data of several sets of velocities.
    pub const fn from_groups(groups: Vec<Group>) -> Self {
        Self::exact(Measurements::Groups(groups))
    }

    /// Creates data of which only mean (m/s) and coefficient of variation are known.
    pub const fn from_moments(mean: f64, coefficient_of_variation: f64) -> Self {
        Self::exact(Measurements::Moments { mean, coefficient_of_variation, count: None })
    }

    /// Creates data of an instrument without scatter of its own.
    const fn exact(measurements: Measurements) -> Self {
        Self { measurements, repeatability: 0.0, decay_error: 0.0 }
    }

    /// Returns the groups; none if the data are not grouped.
    pub fn groups(&self) -> &[Group] {
        match &self.measurements {
            Measurements::Groups(groups) => groups,
            Measurements::Velocities { .. } | Measurements::Moments { .. } => &[],
        }
    }

    /// Returns whether the data are groups.
    pub fn is_grouped(&self) -> bool {
        matches!(self.measurements, Measurements::Groups(_))
    }

    /// Returns whether only the moments of the data are known.
    pub fn has_only_moments(&self) -> bool {
        matches!(self.measurements, Measurements::Moments { .. })
    }

    /// Returns the number of sets of data, each of which is identified separately.
    pub fn sets(&self) -> usize {
        match &self.measurements {
            Measurements::Groups(groups) => groups.len(),
            Measurements::Velocities { .. } | Measurements::Moments { .. } => 1,
        }
    }

    /// Returns the number of sets that can be searched.
    pub fn searchable_count(&self) -> usize {
        self.searchable_sets().count()
    }

    /// Returns the numbers of the sets that can be searched.
    pub fn searchable_sets(&self) -> impl Iterator<Item = usize> {
        let no_variation = |set: &usize| self.groups().get(*set).and_then(Group::no_variation);
        (0..self.sets()).filter(move |set| no_variation(set).is_none())
    }

    /// Returns the quantities of the setup that are known of a set, by its number.
    pub fn known(&self, set: usize) -> KnownQuantities {
        self.groups().get(set).map(|group| group.known).unwrap_or_default()
    }

    /// Returns the name of each group; none if the data are not grouped.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.groups().iter().map(|group| group.name.as_str())
    }

    /// Returns a set of velocities, by its number; `None` if only the moments are known.
    pub fn set(&self, set: usize) -> Option<VelocitySet<'_>> {
        let (velocities, subjects, observables) = match &self.measurements {
            Measurements::Velocities { velocities, subjects, observables } => {
                (velocities, subjects, observables)
            }
            Measurements::Groups(groups) => {
                let group = groups.get(set)?;
                (&group.velocities, &group.subjects, &group.observables)
            }
            Measurements::Moments { .. } => return None,
        };
        let observables = observables.as_ref().map(Option::as_deref);
        let (subjects, repeatability) = (subjects.as_deref(), self.repeatability);
        Some(VelocitySet { velocities, subjects, observables, repeatability })
    }

    /// Returns the velocities of a set, by its number; `None` if only their moments are known.
    pub fn velocities(&self, set: usize) -> Option<&[f64]> {
        self.set(set).map(|set| set.velocities)
    }

    /// Returns the subject of each velocity of a set; `None` if its velocities are independent, or
    /// if only their moments are known.
    pub fn subjects(&self, set: usize) -> Option<&[u32]> {
        self.set(set)?.subjects
    }

    /// Returns the observables that were measured.
    pub fn observables(&self) -> ObservableSet {
        self.set(0).map(|set| set.observables.which()).unwrap_or_default()
    }

    /// Returns the instrument's own standard deviation, m/s; 0 if it is not known.
    pub fn repeatability(&self) -> f64 {
        self.repeatability
    }

    /// Returns the number of velocities of a set, or behind its moments; `None` if it is not known.
    pub fn count(&self, set: usize) -> Option<u64> {
        match self.measurements {
            Measurements::Moments { count, .. } => count,
            _ => self.velocities(set).map(|velocities| velocities.len() as u64),
        }
    }
}

impl<'a> VelocitySet<'a> {
    /// Creates a set of independent velocities, m/s, without scatter of the instrument.
    pub fn independent(velocities: &'a [f64]) -> Self {
        let observables = PerObservable::default();
        Self { velocities, subjects: None, observables, repeatability: 0.0 }
    }

    /// Returns the number of independent parts: of subjects, or else of velocities.
    pub fn independent_count(&self) -> usize {
        let last = |subjects: &[u32]| subjects.iter().max().map_or(0, |&last| last as usize + 1);
        self.subjects.map_or(self.velocities.len(), last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_numbered_by_their_first_appearance() {
        assert_eq!(numbered(["b", "a", "b", "c", "a"]), [0, 1, 0, 2, 1]);
        assert_eq!(numbered([7_u32, 7, 3]), [0, 0, 1]);
        assert!(numbered::<u32>([]).is_empty());
    }

    #[test]
    fn each_set_knows_its_subjects_and_its_number() {
        let grouped = |subjects| Group { subjects, ..Group::new("left", vec![3900.0, 3901.0]) };
        let data = Data {
            repeatability: 5.0,
            ..Data::from_groups(vec![grouped(None), grouped(Some(vec![0, 1]))])
        };
        assert_eq!((data.subjects(0), data.subjects(1)), (None, Some(&[0, 1][..])));
        assert_eq!((data.count(0), data.count(2), data.repeatability()), (Some(2), None, 5.0));
        assert_eq!(
            data.set(1).map(|set| (set.independent_count(), set.repeatability)),
            Some((2, 5.0))
        );
        let mut moments = Data::from_moments(3900.0, 0.03);
        assert_eq!((moments.count(0), moments.set(0)), (None, None));
        let (mean, coefficient_of_variation) = (3900.0, 0.03);
        moments.measurements =
            Measurements::Moments { mean, coefficient_of_variation, count: Some(2747) };
        assert_eq!((moments.count(0), moments.subjects(0)), (Some(2747), None));
    }
}
