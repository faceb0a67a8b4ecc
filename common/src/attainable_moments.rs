//! Approximate ranges of the moments that the points within a job's bounds can have, in closed form.
//!
//! The first arriving signal is a compressional wave along the bone. In a thick plate its velocity is
//! about √(c1111/ρ) of the mean model. In a thin plate it is lower, but not below the bar velocity
//! √(e_L/ρ). The coefficient of variation of the velocity is about δ/√14, to which random quantities of
//! the setup add theirs.

use crate::bulk_velocity::bulk_velocity;
use crate::case::Setup;
use crate::job::{JobKind, JobSpecification, Measurements, Range};
use crate::moments::Moments;
use crate::parameters::{PARAMETERS, Parameter, Point};
use crate::plausible::short;
use crate::random_quantities::RandomQuantities;
use crate::sampling;
use crate::setup_quantity::SetupQuantity;

/// Factors: the smallest mean velocity is the first times √(e_L/ρ), the largest the second times
/// √(c1111/ρ). In the paper's geometry mean velocities are 0.98 to 1.055 times √(c1111/ρ) throughout
/// the usual bounds.
const VELOCITY_FACTORS: (f64, f64) = (0.98, 1.055);
/// Factors: smallest and largest ratio of the coefficient of variation to δ/√14, measured in the same
/// way.
const VARIATION_FACTORS: (f64, f64) = (0.985, 1.145);
/// Data are refused if their mean lies outside the attainable range by more than this factor.
const MEAN_EXCESS_MAX: f64 = 2.0;
/// Data are refused if their coefficient of variation exceeds the attainable maximum by more than this
/// factor; too small a value is not a sign of a wrong unit.
const VARIATION_EXCESS_MAX: f64 = 5.0;
/// With fewer velocities than this the coefficient of variation can be that far off by chance, and is
/// not checked.
const VELOCITIES_MIN: u64 = 10;
/// If a receiver is nearer to the source than this factor times the sum of both heights above the bone,
/// a reflection may arrive first, and its apparent velocity has no upper limit.
const NEAR_FACTOR: f64 = 2.0;

/// Approximate mean velocities (m/s) and coefficients of variation of all points within some
/// bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttainableMoments {
    /// Smallest and largest mean, m/s; the largest is infinite if the bounds include the edge of
    /// admissibility.
    pub velocity: (f64, f64),
    /// Smallest and largest coefficient of variation.
    pub variation: (f64, f64),
}

impl AttainableMoments {
    /// Returns the ranges of the moments that points within `ranges` can have in `setup`, of which
    /// `random` makes some quantities random.
    pub fn from_ranges(
        ranges: &[Range; PARAMETERS],
        setup: &Setup,
        random: &RandomQuantities,
    ) -> Self {
        let dispersion = ends(ranges, Parameter::Dispersion);
        let variation = |dispersion: f64, factor: f64| factor * dispersion / 14.0_f64.sqrt();
        // Quantities of the setup that are searched are held at their starts: within their bounds they
        // change the mean by less than MEAN_EXCESS_MAX.
        let setup = Point::new(ranges.map(|range| range.start())).setup(setup);
        // Without a range of the velocities what random quantities add to their scatter has no bound.
        let scatter = match setup.structure.is_layered() && random.is_any() {
            true => f64::INFINITY,
            false => scatter_of_velocity(ranges, &setup, random),
        };
        Self {
            velocity: velocities(ranges, &setup),
            variation: (
                variation(dispersion.0, VARIATION_FACTORS.0),
                libm::hypot(variation(dispersion.1, VARIATION_FACTORS.1), scatter),
            ),
        }
    }
}

/// Returns the smallest and the largest mean velocity, m/s, that points within `ranges` can have; of a
/// bone of sublayers no closed form is known.
fn velocities(ranges: &[Range; PARAMETERS], setup: &Setup) -> (f64, f64) {
    if setup.structure.is_layered() {
        return (0.0, f64::INFINITY);
    }
    let (density, modulus) =
        (ends(ranges, Parameter::Density), ends(ranges, Parameter::LongitudinalYoungModulus));
    // e_L is at least this part of that between the pores, and the density is not larger.
    let solid = 1.0 - setup.structure.mean_porosity().unwrap_or(0.0);
    let bar_velocity_min = (solid * modulus.0 / density.1).sqrt();
    let highest = highest_bulk_velocity_point(ranges);
    let bulk_velocity_max = match highest.and_then(|point| bulk_velocity(&point).ok()) {
        Some(velocity) if !is_near(setup) => libm::exp(velocity.logarithm),
        _ => f64::INFINITY,
    };
    // An attenuated arrival consists of the pulse's frequencies and somewhat higher ones.
    let (attenuation, center) = (&setup.layers.bone_attenuation, setup.probe.center_frequency);
    let lowest = VELOCITY_FACTORS.0 * attenuation.speed(center) * bar_velocity_min;
    let highest =
        VELOCITY_FACTORS.1 * attenuation.fastest(setup.probe.band_unit()) * bulk_velocity_max;
    (apparent(setup, lowest), apparent(setup, highest))
}

/// Returns the approximate coefficient of variation that random quantities of the setup give the
/// velocity, from the velocities one standard deviation below and above their means. The bone's
/// thickness does not occur in [`velocities`]: what it adds to the variation is less than
/// [`VARIATION_EXCESS_MAX`] lets pass.
fn scatter_of_velocity(
    ranges: &[Range; PARAMETERS],
    setup: &Setup,
    random: &RandomQuantities,
) -> f64 {
    let of_quantity = |quantity: SetupQuantity| {
        let mean = quantity.value_in(setup)?;
        let [low, high] = random.scatter(quantity).about(mean);
        let at = |value| velocities(ranges, &quantity.with(value, setup.clone()));
        let (below, above) = (at(low), at(high));
        let relative = |below: f64, above: f64| ((above - below) / (above + below)).abs();
        let ends = [relative(below.0, above.0), relative(below.1, above.1)];
        // Without a largest velocity its scatter is not a number either.
        ends.into_iter().filter(|scatter| scatter.is_finite()).reduce(f64::max)
    };
    random.random().filter_map(of_quantity).fold(0.0, libm::hypot)
}

/// Returns the point within `ranges` whose √(c1111/ρ) is smallest. It has the shear modulus and the
/// dispersion of the start, as √(c1111/ρ) does not depend on them.
pub fn lowest_bulk_velocity_point(ranges: &[Range; PARAMETERS]) -> Point {
    let (from, to) = ends(ranges, Parameter::LongitudinalYoungModulus);
    let e_t = ends(ranges, Parameter::TransverseYoungModulus).0;
    let nu_l = smallest_magnitude(ends(ranges, Parameter::LongitudinalPoissonRatio));
    let nu_t = ends(ranges, Parameter::TransversePoissonRatio).0;
    // c1111 falls with e_L below this value, and grows above it.
    let e_l_at_minimum = 4.0 * e_t * nu_l * nu_l / (1.0 - nu_t);
    let e_l = e_l_at_minimum.clamp(from, to);
    corner(ranges, [ends(ranges, Parameter::Density).1, e_l, nu_l, e_t, nu_t])
}

/// Returns the point within `ranges` whose √(c1111/ρ) is largest, with shear modulus and dispersion as
/// in [`lowest_bulk_velocity_point`]. Returns `None` if √(c1111/ρ) is unbounded because the ranges
/// contain the edge of admissibility.
pub fn highest_bulk_velocity_point(ranges: &[Range; PARAMETERS]) -> Option<Point> {
    let (from, to) = ends(ranges, Parameter::LongitudinalYoungModulus);
    let e_t = ends(ranges, Parameter::TransverseYoungModulus).1;
    let nu_l = largest_magnitude(ends(ranges, Parameter::LongitudinalPoissonRatio));
    let nu_t = ends(ranges, Parameter::TransversePoissonRatio).1;
    let density = ends(ranges, Parameter::Density).0;
    let [soft, stiff] = [from, to].map(|e_l| {
        let point = corner(ranges, [density, e_l, nu_l, e_t, nu_t]);
        Some((bulk_velocity(&point).ok()?.logarithm, point))
    });
    let (soft, stiff) = (soft?, stiff?);
    Some(if soft.0 > stiff.0 { soft.1 } else { stiff.1 })
}

/// If no set of the data can be matched even approximately within the bounds, returns the offending
/// field and the error message.
pub(crate) fn unattainable_data(
    specification: &JobSpecification,
) -> Option<(&'static str, String)> {
    let data = specification.data.as_ref()?;
    if specification.kind != JobKind::Identification {
        return None;
    }
    let attainable = AttainableMoments::from_ranges(
        &specification.parameters,
        &specification.setup,
        &specification.random,
    );
    let mut first = None;
    for set in 0..data.sets() {
        let found = attainable.unattainable_moment(data.moments(set), data.count(set));
        // One set within reach is enough: the data are no error then.
        first.get_or_insert(found?);
    }
    let Unattainable { moment, value, advice } = first?;
    Some(match &data.measurements {
        Measurements::Moments { .. } => (moment.field(), format!("is {value:?}; {advice}")),
        Measurements::Velocities { .. } => {
            ("data.velocities", format!("their {} is {}; {advice}", moment.name(), short(value)))
        }
        Measurements::Groups(groups) => (
            "data.groups",
            format!(
                "none of the {} groups can be matched; the {} of the first is {}; {advice}",
                groups.len(),
                moment.name(),
                short(value)
            ),
        ),
    })
}

/// The two moments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MomentKind {
    Mean,
    Variation,
}

impl MomentKind {
    fn name(self) -> &'static str {
        match self {
            Self::Mean => "mean",
            Self::Variation => "coefficient of variation",
        }
    }

    fn field(self) -> &'static str {
        match self {
            Self::Mean => "data.mean",
            Self::Variation => "data.coefficient_of_variation",
        }
    }
}

/// A moment of the data that is far outside the attainable range.
struct Unattainable {
    moment: MomentKind,
    value: f64,
    /// End of the message: the range within the bounds, and what the user can do.
    advice: String,
}

impl AttainableMoments {
    /// Returns the first moment of `data` that is far outside the attainable range. `count` is the
    /// number of velocities, if known.
    fn unattainable_moment(&self, data: Moments, count: Option<u64>) -> Option<Unattainable> {
        let (mean, variation) = (data.mean, data.coefficient_of_variation);
        let (lowest, highest) = self.velocity;
        if mean < lowest / MEAN_EXCESS_MAX || mean > highest * MEAN_EXCESS_MAX {
            let advice = format!(
                "the bounds of [parameters] allow mean velocities of about {}: check the units of \
                 data and parameters, or widen the bounds",
                span(self.velocity, " m/s")
            );
            return Some(Unattainable { moment: MomentKind::Mean, value: mean, advice });
        }
        let enough = count.is_none_or(|count| count >= VELOCITIES_MIN);
        if enough && variation > self.variation.1 * VARIATION_EXCESS_MAX {
            let advice = format!(
                "the bounds of parameters.dispersion allow coefficients of variation of about {}: check \
                 the data, or widen the bounds",
                span(self.variation, "")
            );
            return Some(Unattainable { moment: MomentKind::Variation, value: variation, advice });
        }
        None
    }
}

/// Formats a range with its unit.
fn span((from, to): (f64, f64), unit: &str) -> String {
    let round = |value: f64| {
        let rounded: f64 = format!("{value:.1e}").parse().unwrap_or(value);
        short(rounded)
    };
    if to.is_finite() {
        format!("{} to {}{unit}", round(from), round(to))
    } else {
        format!("{}{unit} and more", round(from))
    }
}

/// Returns the velocity, m/s, that a probe shows for a wave that travels along the bone at `velocity`.
/// On a tilted probe the path through the coupling changes from receiver to receiver; with two sources
/// this contribution cancels, and only cos(tilt) remains.
fn apparent(setup: &Setup, velocity: f64) -> f64 {
    let probe = &setup.probe;
    if probe.tilt == 0.0 {
        return velocity;
    }
    let (sin, cos) = libm::sincos(probe.tilt);
    let fluid = setup.layers.coupling_fluids().at(probe.receivers.x3);
    let across = fluid.map_or(0.0, |fluid| sampling::slowness(fluid.sound_speed, velocity));
    let across = if probe.bidirectional { 0.0 } else { sin * across };
    let slowness = cos / velocity + across;
    if slowness > 0.0 { 1.0 / slowness } else { f64::INFINITY }
}

fn is_near(setup: &Setup) -> bool {
    let heights = setup.probe.source.x3 + setup.probe.lowest_receiver();
    let (nearest, _) = sampling::nearest_and_farthest(setup);
    nearest < NEAR_FACTOR * heights
}

/// Returns the bounds of a parameter, or its fixed value twice.
fn ends(ranges: &[Range; PARAMETERS], parameter: Parameter) -> (f64, f64) {
    match ranges[parameter as usize] {
        Range::Fixed(value) => (value, value),
        Range::Free { lower, upper, .. } => (lower, upper),
    }
}

fn smallest_magnitude((from, to): (f64, f64)) -> f64 {
    0.0_f64.clamp(from, to)
}

fn largest_magnitude((from, to): (f64, f64)) -> f64 {
    if from.abs() > to.abs() { from } else { to }
}

/// Returns the point of fixed values and starts, but with this density, e_L, ν_L, e_T and ν_T.
fn corner(ranges: &[Range; PARAMETERS], [density, e_l, nu_l, e_t, nu_t]: [f64; 5]) -> Point {
    let mut point = Point::new(ranges.map(|range| range.start()));
    for (parameter, value) in [
        (Parameter::Density, density),
        (Parameter::LongitudinalYoungModulus, e_l),
        (Parameter::LongitudinalPoissonRatio, nu_l),
        (Parameter::TransverseYoungModulus, e_t),
        (Parameter::TransversePoissonRatio, nu_t),
    ] {
        point.0[parameter as usize] = value;
    }
    point
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bulk_velocity::tests::{BOUNDS, OPTIMUM};
    use crate::ensemble::Germs;

    /// Returns ranges that leave all parameters free within `bounds`.
    fn free(bounds: [(f64, f64); 7]) -> [Range; PARAMETERS] {
        let range = |(lower, upper)| Range::Free { start: 0.5 * (lower + upper), lower, upper };
        Range::of_bone(bounds.map(range))
    }

    fn logarithm(point: &Point) -> f64 {
        bulk_velocity(point).unwrap().logarithm
    }

    /// In random boxes within the usual one, no random point has a lower or a higher bulk velocity
    /// than the two corners.
    #[test]
    fn no_point_is_beyond_the_corners() {
        let mut bounded = 0;
        for index in 0..300 {
            let germs = Germs::draw(5, index);
            let mut germs = germs.values().iter().copied();
            let mut uniform = || germs.next().unwrap();
            let cut = BOUNDS.map(|(from, to)| {
                let (a, b) = (uniform(), uniform());
                (from + (to - from) * a.min(b), from + (to - from) * a.max(b))
            });
            let ranges = free(cut);
            let (slow, fast) =
                (lowest_bulk_velocity_point(&ranges), highest_bulk_velocity_point(&ranges));
            for draw in 0..40 {
                let germs = Germs::draw(6 + index, draw);
                let mut germs = germs.values().iter().copied();
                let point = Point::of_bone(
                    cut.map(|(from, to)| from + (to - from) * germs.next().unwrap()),
                );
                let Ok(velocity) = bulk_velocity(&point) else { continue };
                assert!(velocity.logarithm >= logarithm(&slow) - 1e-12, "{cut:?} {point:?}");
                if let Some(fast) = fast {
                    assert!(velocity.logarithm <= logarithm(&fast) + 1e-12, "{cut:?} {point:?}");
                    bounded += 1;
                }
            }
        }
        assert!(bounded > 1000, "{bounded}");
    }

    #[test]
    fn the_usual_box_has_no_highest_bulk_velocity() {
        let ranges = free(BOUNDS);
        assert_eq!(highest_bulk_velocity_point(&ranges), None);
        let attainable = AttainableMoments::from_ranges(
            &ranges,
            &Setup::default(),
            &RandomQuantities::default(),
        );
        assert!((2400.0..2401.0).contains(&attainable.velocity.0), "{attainable:?}");
        assert_eq!(attainable.velocity.1, f64::INFINITY);
    }

    /// e_L and δ are free, as in a search for these two alone.
    #[test]
    fn data_far_out_of_range_are_reported() {
        let mut ranges = OPTIMUM.0.map(Range::Fixed);
        for axis in [1, 6] {
            let (lower, upper) = BOUNDS[axis];
            ranges[axis] = Range::Free { start: OPTIMUM.0[axis], lower, upper };
        }
        let attainable = AttainableMoments::from_ranges(
            &ranges,
            &Setup::default(),
            &RandomQuantities::default(),
        );
        let reported = |mean: f64, coefficient_of_variation: f64, count| {
            let data = Moments { mean, coefficient_of_variation };
            let found = attainable.unattainable_moment(data, count);
            found.map(|it| (it.moment, it.advice.split(':').next().unwrap().to_owned()))
        };
        let velocities =
            "the bounds of [parameters] allow mean velocities of about 2700 to 4700 m/s";
        let variations = "the bounds of parameters.dispersion allow coefficients of variation of about \
                          0.0053 to 0.092";
        for (mean, variation, count, expected) in [
            (3906.0, 0.0271, None, None),
            (3900.0, 0.12, None, None),
            (1400.0, 0.0271, None, None),
            (9000.0, 0.0271, None, None),
            (12_000.0, 0.0271, None, Some((MomentKind::Mean, velocities))),
            (1300.0, 0.0271, Some(2), Some((MomentKind::Mean, velocities))),
            (3906.0, 0.4, None, None),
            (3906.0, 0.5, None, Some((MomentKind::Variation, variations))),
            (3906.0, 0.5, Some(9), None),
            (3906.0, 0.5, Some(10), Some((MomentKind::Variation, variations))),
            (3906.0, 0.001, None, None),
        ] {
            let expected = expected.map(|(moment, text)| (moment, text.to_owned()));
            assert_eq!(reported(mean, variation, count), expected, "{mean} {variation} {count:?}");
        }
    }

    /// Reflections that arrive first may have any apparent velocity.
    #[test]
    fn near_receivers_have_no_largest_velocity() {
        let ranges = OPTIMUM.0.map(Range::Fixed);
        let mut setup = Setup::default();
        assert!(
            AttainableMoments::from_ranges(&ranges, &setup, &RandomQuantities::default())
                .velocity
                .1
                < 4200.0
        );
        setup.probe.receivers.first_x1 = 7e-3;
        assert_eq!(
            AttainableMoments::from_ranges(&ranges, &setup, &RandomQuantities::default())
                .velocity
                .1,
            f64::INFINITY
        );
    }
}
