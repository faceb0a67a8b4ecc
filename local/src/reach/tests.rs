use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{Data, Group, MonteCarlo, Objective, Search};
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::systematic::Systematic;

use super::*;

/// The optimum of the paper.
const OPTIMUM: [f64; 7] = [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029];

/// Creates a search for e_L and δ, and for the density if `density` is free.
fn job(data: Data, density: Range) -> JobSpecification {
    let mut parameters = Range::of_bone(OPTIMUM.map(Range::Fixed));
    parameters[0] = density;
    parameters[1] = Range::Free { start: 17e9, lower: 12e9, upper: 25e9 };
    parameters[6] = Range::Free { start: 0.1, lower: 0.02, upper: 0.3 };
    JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(data),
        parameters,
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo::default(),
        objective: Objective::default(),
        search: Search::default(),
        posterior: None,
    }
}

fn moments(mean: f64, coefficient_of_variation: f64) -> Data {
    Data::from_moments(mean, coefficient_of_variation)
}

const FIXED: Range = Range::Fixed(1598.8);

#[test]
fn data_within_reach_are_passed_over() {
    for (mean, variation) in [(3906.0, 0.0271), (3650.0, 0.01), (4400.0, 0.09)] {
        assert_eq!(out_of_reach(&job(moments(mean, variation), FIXED)), [""; 0], "{mean}");
    }
    let propagation = JobSpecification {
        kind: JobKind::Propagation,
        data: None,
        ..job(moments(1.0, 1.0), FIXED)
    };
    assert_eq!(out_of_reach(&propagation), [""; 0]);
}

#[test]
fn a_mean_out_of_reach_is_told_with_the_bounds_to_widen() {
    let density = Range::Free { start: 1600.0, lower: 1500.0, upper: 2000.0 };
    for (mean, density, expected) in [
        (
            5500.0,
            FIXED,
            "above what points within the bounds reach (3621 to 4382 m/s): the search will end at its \
             bounds; widen the upper bound of longitudinal_young_modulus",
        ),
        (
            3400.0,
            FIXED,
            "below what points within the bounds reach (3621 to 4382 m/s): the search will end at its \
             bounds; widen the lower bound of longitudinal_young_modulus",
        ),
        (
            5500.0,
            density,
            "widen the lower bound of density, or the upper bound of longitudinal_young_modulus",
        ),
    ] {
        let lines = out_of_reach(&job(moments(mean, 0.0271), density));
        assert_eq!(lines.len(), 1, "{lines:?}");
        assert!(lines[0].starts_with(&format!("the mean is {mean}, ")), "{lines:?}");
        assert!(lines[0].contains(expected), "{lines:?}");
    }
}

#[test]
fn a_coefficient_of_variation_out_of_reach_is_told() {
    assert_eq!(
        out_of_reach(&job(moments(3900.0, 0.12), FIXED)),
        [
            "the coefficient of variation is 1.200e-1, above what points within the bounds reach (about \
          5.27e-3 to 9.18e-2): the search will end at its bounds; widen the upper bound of \
          parameters.dispersion"
        ]
    );
    let mut fixed = job(moments(3900.0, 0.12), FIXED);
    fixed.parameters[6] = Range::Fixed(0.1);
    let lines = out_of_reach(&fixed);
    assert!(lines[0].ends_with("; free parameters.dispersion"), "{lines:?}");
    // Two velocities may differ by any amount.
    let two = Data::from_velocities(vec![3600.0, 4400.0]);
    assert_eq!(out_of_reach(&job(two, FIXED)), [""; 0]);
}

#[test]
fn groups_are_named_and_counted() {
    let group = |name: String, mean: f64| {
        Group::new(name, (0..20).map(|i| mean * (1.0 + 0.01 * f64::from(i % 5))).collect())
    };
    let mut groups = vec![group("fine".to_owned(), 3900.0)];
    groups.extend((0..7).map(|i| group(format!("P{i}"), 5500.0)));
    let lines = out_of_reach(&job(Data::from_groups(groups), FIXED));
    assert_eq!(lines.len(), 6, "{lines:?}");
    assert!(lines[0].starts_with("the mean of the group \"P0\" is 5610, above"), "{lines:?}");
    assert_eq!(lines[5], "2 more groups are out of reach of the bounds");
}

#[test]
fn a_start_without_velocity_is_told() {
    let mut job = job(moments(3906.0, 0.0271), FIXED);
    job.setup.layers.coupling.sound_speed = 6000.0;
    let lines = out_of_reach(&job);
    assert_eq!(lines.len(), 1, "{lines:?}");
    let expected =
        "the mean model of the starts has no velocity (direct_wave_first): at receiver 1";
    assert!(lines[0].starts_with(expected), "{lines:?}");
}

/// If the fastest model is unbounded, and corners cannot be solved, there is no warning about them.
#[test]
fn what_is_not_known_is_not_told() {
    let mut job = job(moments(7000.0, 0.0271), FIXED);
    job.parameters[2] = Range::Free { start: 0.35, lower: 0.2, upper: 0.6 };
    assert_eq!(out_of_reach(&job), [""; 0]);
    job.setup.probe.receivers.first_x1 = 1.5;
    assert_eq!(out_of_reach(&job), [""; 0], "too many pairs");
}

/// Data out of reach of the job's plate of 4 mm can be within reach of a group's own, and the other way
/// round.
#[test]
fn a_group_is_compared_with_its_own_setup() {
    let velocities: Vec<f64> =
        (0..20).map(|i| 3400.0 * (1.0 + 0.02 * f64::from(i % 5 - 2))).collect();
    let lines = |thickness: Option<f64>| {
        let known = KnownQuantities::new(
            Parameter::OF_SETUP.map(|one| thickness.filter(|_| one == Parameter::BoneThickness)),
        );
        let slow = Group { known, ..Group::new("slow", velocities.clone()) };
        out_of_reach(&job(Data::from_groups(vec![slow]), FIXED)).join("\n")
    };
    let (of_job, same, thin) = (lines(None), lines(Some(4e-3)), lines(Some(0.5e-3)));
    assert!(of_job.starts_with("the mean of the group \"slow\" is 3400, below"), "{of_job}");
    assert_eq!(of_job, same);
    assert_eq!(thin, "", "a thin plate is slower");
}
