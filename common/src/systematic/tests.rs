use super::*;
use crate::parameters::Point;

/// The setup of a job of which nothing is given, and with a porosity.
fn setups() -> [Setup; 2] {
    let plain = Setup::default();
    let mut porous = plain.clone();
    porous.structure.porosity = Some(0.1);
    [plain, porous]
}

#[test]
fn every_quantity_of_a_setup_has_a_usual_law_that_moves_it() {
    let usual = Systematic { usual: true, ..Systematic::default() };
    let [plain, porous] = setups();
    let names = |setup: &Setup| {
        let uncertain = usual.uncertain(setup, |_| false);
        uncertain.iter().map(|one| one.quantity).collect::<Vec<_>>()
    };
    assert_eq!(names(&porous), SystematicQuantity::ALL);
    let without = SystematicQuantity::ALL.into_iter();
    let without = without.filter(|one| *one != SystematicQuantity::PorosityGradient);
    assert_eq!(names(&plain), without.collect::<Vec<_>>());
    for one in usual.uncertain(&porous, |_| false) {
        for shift in one.shifts() {
            let shifted = shift.quantity.with(shift.value, porous.clone());
            let value = shift.quantity.value_in(&shifted).unwrap();
            assert!((value / shift.value - 1.0).abs() < 1e-12, "{shift:?}: {value}");
            assert_ne!(shifted, porous, "{shift:?}");
        }
    }
}

#[test]
fn a_bone_without_losses_is_shifted_to_the_usual_one_only() {
    let usual = Systematic { usual: true, ..Systematic::default() };
    let [plain, _] = setups();
    let uncertain = usual.uncertain(&plain, |_| false);
    let quality =
        uncertain.iter().find(|one| one.quantity == SystematicQuantity::BoneQualityFactor);
    let quality = quality.unwrap();
    assert_eq!((quality.below, quality.above.value), (None, usual::QUALITY_FACTOR));
}

#[test]
fn a_law_of_its_own_a_search_or_a_spread_of_0_replace_the_usual_one() {
    let mut systematic = Systematic { usual: true, ..Systematic::default() };
    let law = |spread| SystematicLaw { spread: Some(spread), ..SystematicLaw::default() };
    systematic.laws[SystematicQuantity::Tilt as usize] = law(0.0);
    systematic.laws[SystematicQuantity::Pitch as usize] = law(1e-5);
    let [plain, _] = setups();
    let thickness = SystematicQuantity::BoneThickness;
    let uncertain = systematic.uncertain(&plain, |quantity| quantity == thickness);
    let of = |quantity| uncertain.iter().find(|one| one.quantity == quantity);
    assert_eq!((of(SystematicQuantity::Tilt), of(thickness)), (None, None));
    let pitch = of(SystematicQuantity::Pitch).unwrap();
    let value = plain.probe.receivers.pitch;
    assert_eq!((pitch.below.unwrap().value, pitch.above.value), (value - 1e-5, value + 1e-5));
}

#[test]
fn the_gradient_of_a_porosity_changes_about_its_mean() {
    let [_, mut porous] = setups();
    porous.structure.set_gradient(0.05);
    let profile = &porous.structure.profile;
    let ends = [profile.surface.unwrap(), profile.marrow.unwrap()];
    assert!((ends[0] - 0.075).abs() < 1e-15 && (ends[1] - 0.125).abs() < 1e-15, "{ends:?}");
    assert_eq!(porous.structure.porosity, None);
    assert!((porous.structure.mean_porosity().unwrap() - 0.1).abs() < 1e-15);
}

/// What was computed of one must never be taken for the other.
#[test]
fn points_differ_by_their_shift() {
    let point = Point::of_bone([1.0; 7]);
    let shift = |value| Shift { quantity: SystematicQuantity::Tilt, value };
    let points = [point, point.shifted(Some(shift(0.1))), point.shifted(Some(shift(0.2)))];
    for (k, one) in points.iter().enumerate() {
        for (other, same) in points.iter().zip([0, 1, 2].map(|place| place == k)) {
            assert_eq!(one.bits() == other.bits(), same);
        }
    }
}
