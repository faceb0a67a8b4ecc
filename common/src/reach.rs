//! The moments that points within the bounds of a job can reach, in closed form.
//!
//! The first arriving signal is a compressional wave along the bone. In a thick plate it runs at
//! about √(c1111/ρ) of the mean model, in a thin one slower, but no slower than in a bar, √(e_L/ρ);
//! its coefficient of variation is about δ/√14.

use crate::bulk_velocity::bulk_velocity;
use crate::case::Setup;
use crate::job::{Data, JobKind, JobSpecification, Range};
use crate::moments::Moments;
use crate::parameters::{Parameter, Point};
use crate::plausible::short;
use crate::sampling;

/// Ratio of mean velocities to √(e_L/ρ) of the slowest and √(c1111/ρ) of the fastest point.
/// Measured in the paper's geometry all over the usual bounds: 0.98 to 1.055 of √(c1111/ρ).
const VELOCITY: (f64, f64) = (0.98, 1.055);
/// Ratio of coefficients of variation to δ/√14, measured in the same way.
const VARIATION: (f64, f64) = (0.985, 1.145);
/// Data are out of reach if their mean is beyond everything that can be reached by more than this
/// factor …
const MEAN_BEYOND: f64 = 2.0;
/// … or if their coefficient of variation is above everything that can be reached by more than this
/// factor. One that is too small does not indicate another unit.
const VARIATION_BEYOND: f64 = 5.0;
/// Smaller numbers of velocities may differ this much by chance.
const VELOCITIES_MIN: usize = 10;
/// If the receivers are nearer to the source than this many times the sum of the heights,
/// reflections arrive first, whose apparent velocity is unbounded.
const NEAR: f64 = 2.0;

/// Approximate mean velocities (m/s) and coefficients of variation of all points within some
/// bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Slowest and fastest mean, m/s; the fastest is infinite if the bounds include the edge of
    /// admissibility.
    pub velocity: (f64, f64),
    /// Smallest and largest coefficient of variation.
    pub variation: (f64, f64),
}

impl Reach {
    /// Returns the moments that points within `ranges` reach in `setup`.
    pub fn from_ranges(ranges: &[Range; 7], setup: &Setup) -> Self {
        let (density, modulus) =
            (ends(ranges, Parameter::Density), ends(ranges, Parameter::LongitudinalYoungModulus));
        let slowest = (modulus.0 / density.1).sqrt();
        let fastest = match fastest(ranges).and_then(|point| bulk_velocity(&point).ok()) {
            Some(velocity) if !is_near(setup) => libm::exp(velocity.logarithm),
            _ => f64::INFINITY,
        };
        let dispersion = ends(ranges, Parameter::Dispersion);
        let variation = |dispersion: f64, factor: f64| factor * dispersion / 14.0_f64.sqrt();
        Self {
            velocity: (VELOCITY.0 * slowest, VELOCITY.1 * fastest),
            variation: (variation(dispersion.0, VARIATION.0), variation(dispersion.1, VARIATION.1)),
        }
    }
}

/// Returns the point within `ranges` whose √(c1111/ρ) is smallest. It has the shear modulus and the
/// dispersion of the start, as √(c1111/ρ) does not depend on them.
pub fn slowest(ranges: &[Range; 7]) -> Point {
    let (from, to) = ends(ranges, Parameter::LongitudinalYoungModulus);
    let transverse = ends(ranges, Parameter::TransverseYoungModulus).0;
    let poisson = smallest_magnitude(ends(ranges, Parameter::LongitudinalPoissonRatio));
    let across = ends(ranges, Parameter::TransversePoissonRatio).0;
    // c1111 falls with e_L below this value, and grows above it.
    let least = 4.0 * transverse * poisson * poisson / (1.0 - across);
    let longitudinal = least.clamp(from, to);
    corner(ranges, [ends(ranges, Parameter::Density).1, longitudinal, poisson, transverse, across])
}

/// Returns the point within `ranges` whose √(c1111/ρ) is largest, as [`slowest`]; `None` if it is
/// unbounded, because the edge of admissibility lies within the ranges.
pub fn fastest(ranges: &[Range; 7]) -> Option<Point> {
    let (from, to) = ends(ranges, Parameter::LongitudinalYoungModulus);
    let transverse = ends(ranges, Parameter::TransverseYoungModulus).1;
    let poisson = largest_magnitude(ends(ranges, Parameter::LongitudinalPoissonRatio));
    let across = ends(ranges, Parameter::TransversePoissonRatio).1;
    let density = ends(ranges, Parameter::Density).0;
    let [soft, stiff] = [from, to].map(|longitudinal| {
        let point = corner(ranges, [density, longitudinal, poisson, transverse, across]);
        Some((bulk_velocity(&point).ok()?.logarithm, point))
    });
    let (soft, stiff) = (soft?, stiff?);
    Some(if soft.0 > stiff.0 { soft.1 } else { stiff.1 })
}

/// Returns the field at fault and the reason if no set of the data can be approached.
pub(crate) fn unreachable(specification: &JobSpecification) -> Option<(&'static str, String)> {
    let data = specification.data.as_ref()?;
    if specification.kind != JobKind::Identification {
        return None;
    }
    let reach = Reach::from_ranges(&specification.parameters, &specification.setup);
    let mut first = None;
    for set in 0..data.sets() {
        let count = data.velocities(set).map(<[f64]>::len);
        // If other groups can be matched, one that cannot be is not an error.
        let missed = reach.missed(data.moments(set), count)?;
        first.get_or_insert(missed);
    }
    let (moment, value, reached) = first?;
    Some(match data {
        Data::Moments { .. } => (moment.field(), format!("is {value:?}; {reached}")),
        Data::Velocities(_) => {
            ("data.velocities", format!("their {} is {}; {reached}", moment.name(), short(value)))
        }
        Data::Groups(groups) => (
            "data.groups",
            format!(
                "none of the {} groups can be matched; the {} of the first is {}; {reached}",
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

impl Reach {
    /// Returns the moment of data with this number of velocities that is far out of reach: its
    /// kind, its value, and the reachable range.
    fn missed(&self, data: Moments, count: Option<usize>) -> Option<(MomentKind, f64, String)> {
        let (mean, variation) = (data.mean, data.coefficient_of_variation);
        let (slowest, fastest) = self.velocity;
        if mean < slowest / MEAN_BEYOND || mean > fastest * MEAN_BEYOND {
            let reached = format!(
                "the bounds of [parameters] allow mean velocities of about {}: check the units of \
                 data and parameters, or widen the bounds",
                span(self.velocity, " m/s")
            );
            return Some((MomentKind::Mean, mean, reached));
        }
        let enough = count.is_none_or(|count| count >= VELOCITIES_MIN);
        if enough && variation > self.variation.1 * VARIATION_BEYOND {
            let reached = format!(
                "the bounds of parameters.dispersion allow coefficients of variation of about {}: check \
                 the data, or widen the bounds",
                span(self.variation, "")
            );
            return Some((MomentKind::Variation, variation, reached));
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

fn is_near(setup: &Setup) -> bool {
    let heights = setup.probe.source.x3 + setup.probe.receivers.x3;
    let nearest = sampling::distances(setup).fold(f64::INFINITY, f64::min);
    nearest < NEAR * heights
}

/// Returns the bounds of a parameter, or its fixed value twice.
fn ends(ranges: &[Range; 7], parameter: Parameter) -> (f64, f64) {
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

/// Returns the point with this density, e_L, ν_L, e_T and ν_T.
fn corner(ranges: &[Range; 7], [density, e_l, nu_l, e_t, nu_t]: [f64; 5]) -> Point {
    let start = |parameter: Parameter| ranges[parameter as usize].start();
    let (shear, dispersion) =
        (start(Parameter::LongitudinalShearModulus), start(Parameter::Dispersion));
    Point([density, e_l, nu_l, shear, e_t, nu_t, dispersion])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bulk_velocity::tests::{BOUNDS, OPTIMUM};
    use crate::ensemble::Germs;

    /// Returns ranges that leave all parameters free within `bounds`.
    fn free(bounds: [(f64, f64); 7]) -> [Range; 7] {
        bounds.map(|(lower, upper)| Range::Free { start: 0.5 * (lower + upper), lower, upper })
    }

    fn logarithm(point: &Point) -> f64 {
        bulk_velocity(point).unwrap().logarithm
    }

    /// In random boxes within the usual one, no random point is slower or faster than the corners.
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
            let (slow, fast) = (slowest(&ranges), fastest(&ranges));
            for draw in 0..40 {
                let germs = Germs::draw(6 + index, draw);
                let mut germs = germs.values().iter().copied();
                let point = Point(cut.map(|(from, to)| from + (to - from) * germs.next().unwrap()));
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
    fn the_usual_box_has_no_fastest_point() {
        let ranges = free(BOUNDS);
        assert_eq!(fastest(&ranges), None);
        let reach = Reach::from_ranges(&ranges, &Setup::default());
        assert!((2400.0..2401.0).contains(&reach.velocity.0), "{reach:?}");
        assert_eq!(reach.velocity.1, f64::INFINITY);
    }

    /// e_L and δ are free, as in a search for these two alone.
    #[test]
    fn what_is_out_of_reach_is_told() {
        let mut ranges = OPTIMUM.0.map(Range::Fixed);
        for axis in [1, 6] {
            let (lower, upper) = BOUNDS[axis];
            ranges[axis] = Range::Free { start: OPTIMUM.0[axis], lower, upper };
        }
        let reach = Reach::from_ranges(&ranges, &Setup::default());
        let missed = |mean: f64, coefficient_of_variation: f64, count| {
            let missed = reach.missed(Moments { mean, coefficient_of_variation }, count);
            missed.map(|(moment, _, text)| (moment, text.split(':').next().unwrap().to_owned()))
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
            assert_eq!(missed(mean, variation, count), expected, "{mean} {variation} {count:?}");
        }
    }

    /// Reflections that arrive first may have any apparent velocity.
    #[test]
    fn near_receivers_have_no_fastest_velocity() {
        let ranges = OPTIMUM.0.map(Range::Fixed);
        let mut setup = Setup::default();
        assert!(Reach::from_ranges(&ranges, &setup).velocity.1 < 4200.0);
        setup.probe.receivers.first_x1 = 7e-3;
        assert_eq!(Reach::from_ranges(&ranges, &setup).velocity.1, f64::INFINITY);
    }
}
