use super::*;

/// Checks the question asked about a refused value; `None` if it is not refused.
fn check(kind: &PlausibleRange, values: &[f64], expected: Option<&str>) {
    let question = kind.question(values, Interval::finite(kind.unit));
    assert_eq!(question.as_deref(), expected, "{values:?} {}", kind.unit);
}

#[test]
fn another_unit_that_explains_a_number_is_named() {
    for (kind, value, expected) in [
        (VELOCITY, 3.8, "did you mean 3.8 km/s (3.8e3)?"),
        (VELOCITY, 3.9e6, "did you mean 3900000 mm/s (3900000e-3)?"),
        (VARIATION, 2.7, "did you mean 2.7 % (0.027)?"),
        (BONE_THICKNESS, 4.0, "did you mean 4 mm (4e-3)?"),
        (BONE_THICKNESS, 1.0, "did you mean 1 mm (1e-3)?"),
        (BONE_THICKNESS, 3500.0, "did you mean 3500 µm (3500e-6)?"),
        (SOUND_SPEED, 1.5, "did you mean 1.5 km/s (1.5e3)?"),
        (SOUND_SPEED, 1.5e6, "did you mean 1500000 mm/s (1500000e-3)?"),
        (FREQUENCY, 1.0, "did you mean 1 MHz (1e6)?"),
        (FREQUENCY, 0.25, "did you mean 0.25 MHz (0.25e6)?"),
        (FREQUENCY, 1000.0, "did you mean 1000 kHz (1000e3)?"),
        (HEIGHT, 2.0, "did you mean 2 mm (2e-3)?"),
        (DISTANCE, 11.0, "did you mean 11 mm (11e-3)?"),
        (PITCH, 0.8, "did you mean 0.8 mm (0.8e-3)?"),
        (ELEMENT_SIZE, 0.5, "did you mean 0.5 mm (0.5e-3)?"),
        (ELEMENT_SIZE, 500.0, "did you mean 500 µm (500e-6)?"),
        (DENSITY, 1.6, "did you mean 1.6 g/cm³ (1.6e3)?"),
        (MODULUS, 20.0, "did you mean 20 GPa (20e9)?"),
        (MODULUS, 4.795, "did you mean 4.795 GPa (4.795e9)?"),
        (MODULUS, 20_000.0, "did you mean 20000 MPa (20000e6)?"),
        (POISSON_RATIO, 38.16, "did you mean 38.16 % (0.3816)?"),
        (DISPERSION, 15.0, "did you mean 15 % (0.15)?"),
    ] {
        check(&kind, &[value], Some(expected));
    }
    check(&MODULUS, &[12.0, 25.0], Some("did you mean 12 and 25 GPa (12e9 and 25e9)?"));
}

/// The softest, heaviest, thinnest (and so on) meaningful values, and values that no unit explains.
#[test]
fn whatever_can_be_meant_is_not_asked_about() {
    for (kind, values) in [
        (VELOCITY, &[100.0, 340.0, 1500.0, 12_000.0, 1e300][..]),
        (VARIATION, &[1e-9, 0.2, 0.99, 1e9]),
        (BONE_THICKNESS, &[1e-12, 1e-6, 0.2e-3, 50e-3, 0.5, 1e300]),
        (FLUID_THICKNESS, &[1e-6, 1.0, 10.0, 1e15]),
        (FLUID_DENSITY, &[1e-300, 1e-12, 1.0, 5300.0, 1e300]),
        (SOUND_SPEED, &[30.0, 300.0, 6000.0, 1e300]),
        (FREQUENCY, &[1e-9, 20e3, 0.25e6, 4e6, 50e6, 1e12]),
        (HEIGHT, &[1e-9, 12e-3, 0.5]),
        (DISTANCE, &[0.0, 1e-300, 50e-3, 1.0, 1e300]),
        (PITCH, &[1e-30, 0.1e-3, 10e-3, 50e-3]),
        (TIME_STEP, &[1e-12, 1e-3, 10.0]),
        (DENSITY, &[1e-300, 10.0, 100.0, 20_000.0, 1e300]),
        (MODULUS, &[1e-9, 1e6, 10e6, 400e9, 1e300]),
        (POISSON_RATIO, &[-1.0, -0.5, 0.0, 0.4999, 1.3, -38.0]),
        (DISPERSION, &[1e-4, 0.5, 0.8]),
    ] {
        values.iter().for_each(|&value| check(&kind, &[value], None));
    }
    // If the bounds are wide, one end may have any value.
    check(&MODULUS, &[1.0, 100e9], None);
    for kind in [VELOCITY, MODULUS, BONE_THICKNESS] {
        for value in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
            check(&kind, &[value], None);
        }
    }
}

#[test]
fn a_number_that_is_refused_anyway_is_asked_about_only_if_the_other_is_accepted() {
    let inside = Interval::between(0.0, 10e-3, "m");
    assert_eq!(HEIGHT.question(&[2.0], inside).as_deref(), Some("did you mean 2 mm (2e-3)?"));
    assert_eq!(HEIGHT.question(&[20.0], inside), None);
}

#[test]
fn what_is_unusual_is_worth_a_doubt() {
    let check = |kind: &PlausibleRange, value: f64, expected: Option<&str>| {
        assert_eq!(kind.doubt(value).as_deref(), expected, "{value}");
    };
    check(&BONE_THICKNESS, 4e-3, None);
    for (kind, value, expected) in [
        (BONE_THICKNESS, 50e-3, "is 0.05 m; usual is 0.0002 to 0.03 m"),
        (BONE_THICKNESS, 0.4, "is 0.4 m; usual is 0.0002 to 0.03 m; did you mean 0.4 mm (0.4e-3)?"),
        (BONE_THICKNESS, 1e-4, "is 0.0001 m; usual is 0.0002 to 0.03 m"),
        (FLUID_THICKNESS, 10.0, "is 10 m; usual is up to 0.3 m; did you mean 10 mm (10e-3)?"),
        (
            FLUID_DENSITY,
            1.0,
            "is 1 kg/m³; usual is 100 to 15000 kg/m³; did you mean 1 g/cm³ (1e3)?",
        ),
        (FLUID_DENSITY, 1e-12, "is 1e-12 kg/m³; usual is 100 to 15000 kg/m³"),
        (
            FREQUENCY,
            5000.0,
            "is 5000 Hz; usual is 20000 to 2e7 Hz; did you mean 5000 kHz (5000e3)?",
        ),
        (VARIATION, 0.6, "is 0.6; usual is 0.0001 to 0.5; did you mean 0.6 % (0.006)?"),
        (TIME_STEP, 10.0, "is 10 s; usual is 1e-12 to 1e-6 s; did you mean 10 ns (10e-9)?"),
        (POISSON_RATIO, -0.7, "is -0.7; usual is -0.5 to 1"),
        (VELOCITY, 390.0, "is 390 m/s; usual is 1000 to 8000 m/s"),
    ] {
        check(&kind, value, Some(expected));
    }
    check(&MODULUS, f64::NAN, None);
}

#[test]
fn numbers_of_sentences_are_short() {
    for (value, expected) in [
        (3.835_848, "3.836"),
        (12_000.4, "12000"),
        (2e7, "2e7"),
        (1e-6, "1e-6"),
        (0.091_8, "0.0918"),
        (1e300, "1e300"),
        (-2.5, "-2.5"),
        (f64::INFINITY, "inf"),
    ] {
        assert_eq!(short(value), expected);
    }
}
