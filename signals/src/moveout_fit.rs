//! From the times of the picked extrema to a velocity with its standard error.
//!
//! The velocity is the model's: the least-squares slope of distance against time over the whole array. Around
//! that line the times of the model are slightly curved, too, since the wave changes on its way. A parabola
//! follows this; what is left is error. A receiver without a time gets the parabola's, so that the velocity is
//! that of the whole array.

use osteon_common::line_fit::{mean, slope};

/// A time off the parabola by more than this multiple of its standard error is rejected.
const OUTLIER: f64 = 4.5;
/// No time is rejected that is nearer to the parabola than this, in periods.
const TOLERATED_PERIODS: f64 = 0.02;
/// Receivers that may be rejected or lack a time, as a share of the array.
pub(crate) const LOST_MAX: f64 = 0.25;
/// Fewest receivers of a parabola of which something is left.
const PARABOLA_MIN: usize = 5;
/// Standard deviations of a normal distribution below which 99.9 % of it lie.
const SURE: f64 = 3.09;

/// The time of a receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PickedTime {
    /// Time, s.
    pub(crate) time: f64,
    /// Its standard error from the noise of the signal, s; 0 if the noise is unknown.
    pub(crate) error: f64,
}

/// A velocity along the array.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FittedVelocity {
    /// Velocity, m/s.
    pub(crate) velocity: f64,
    /// Standard error, m/s.
    pub(crate) standard_error: f64,
    /// Which times were rejected.
    pub(crate) rejected: Vec<bool>,
    /// Largest distance of a used time from the straight line, s.
    pub(crate) residual: f64,
}

/// Fits a velocity; `None` if fewer than three times are left, or the line does not lead away from the source.
pub(crate) fn fit(
    distances: &[f64],
    times: &[Option<PickedTime>],
    period: f64,
) -> Option<FittedVelocity> {
    let mut used: Vec<usize> = (0..times.len()).filter(|&r| times[r].is_some()).collect();
    let lost_max = (LOST_MAX * times.len() as f64) as usize;
    while used.len() >= PARABOLA_MIN && times.len() - used.len() < lost_max {
        match worst(distances, times, &used, period) {
            Some(place) => used.remove(place),
            None => break,
        };
    }
    if used.len() < 3 {
        return None;
    }
    let picked: Vec<PickedTime> = used.iter().filter_map(|&r| times[r]).collect();
    let known: Vec<f64> = used.iter().map(|&r| distances[r]).collect();
    // Each time of the whole array as a sum over the known ones.
    let rows: Vec<Vec<f64>> = (0..times.len())
        .map(|r| match used.iter().position(|&other| other == r) {
            Some(place) => (0..used.len()).map(|j| f64::from(j == place)).collect(),
            None => parabola_weights(&known, distances[r]),
        })
        .collect();
    let complete: Vec<f64> = rows
        .iter()
        .map(|row| row.iter().zip(&picked).fold(0.0, |sum, (w, p)| w.mul_add(p.time, sum)))
        .collect();
    let raw = slope(distances, &complete);
    if !(raw > 0.0 && raw.is_finite()) {
        return None;
    }
    let middle = mean(&complete);
    let spread = complete.iter().fold(0.0, |sum: f64, t| (t - middle).mul_add(t - middle, sum));
    // The relative change of the velocity with each known time.
    let weights: Vec<f64> = (0..used.len())
        .map(|j| {
            rows.iter().zip(&complete).fold(0.0, |sum, (row, t)| (t - middle).mul_add(row[j], sum))
                / spread
        })
        .collect();
    let variances = variances(&known, &picked);
    let relative =
        weights.iter().zip(&variances).fold(0.0, |sum: f64, (w, v)| (w * w).mul_add(*v, sum));
    // Noise widens the spread of the times, by which the slope is divided, and makes it smaller in the mean.
    let widened = picked.iter().fold(0.0, |sum: f64, p| p.error.mul_add(p.error, sum))
        * (1.0 - 1.0 / used.len() as f64);
    let velocity = raw * (1.0 + widened / spread);
    let mean_distance = mean(distances);
    let off = |(x, t): (&f64, &PickedTime)| ((x - mean_distance) / raw - (t.time - middle)).abs();
    let residual = known.iter().zip(&picked).map(off).fold(0.0, f64::max);
    let rejected = (0..times.len()).map(|r| times[r].is_some() && !used.contains(&r)).collect();
    Some(FittedVelocity {
        velocity,
        standard_error: velocity * relative.sqrt(),
        rejected,
        residual,
    })
}

/// Returns the place in `used` of the time that is farthest outside of what the others and its error allow.
fn worst(
    distances: &[f64],
    times: &[Option<PickedTime>],
    used: &[usize],
    period: f64,
) -> Option<usize> {
    let mut worst = None;
    let mut most = 1.0;
    for (place, &r) in used.iter().enumerate() {
        let others: Vec<usize> = used.iter().copied().filter(|&other| other != r).collect();
        let known: Vec<f64> = others.iter().map(|&other| distances[other]).collect();
        let weights = parabola_weights(&known, distances[r]);
        let Some(own) = times[r] else { continue };
        let (mut predicted, mut variance) = (0.0, own.error * own.error);
        for (weight, other) in weights.iter().zip(others.iter().filter_map(|&other| times[other])) {
            predicted = weight.mul_add(other.time, predicted);
            variance = (weight * other.error).mul_add(weight * other.error, variance);
        }
        let allowed = (OUTLIER * variance.sqrt()).max(TOLERATED_PERIODS * period);
        let excess = (own.time - predicted).abs() / allowed;
        if excess > most {
            (worst, most) = (Some(place), excess);
        }
    }
    worst
}

/// Returns the variance of each time, s²: that of the noise, unless the times scatter about their parabola by
/// more than that with a certainty of 99.9 %; then the difference is added to each.
fn variances(distances: &[f64], picked: &[PickedTime]) -> Vec<f64> {
    let own: Vec<f64> = picked.iter().map(|p| p.error * p.error).collect();
    if picked.len() < PARABOLA_MIN {
        return own;
    }
    let (mut scatter, mut expected) = (0.0, 0.0);
    for (place, one) in picked.iter().enumerate() {
        let weights = parabola_weights(distances, distances[place]);
        let at = weights.iter().zip(picked).fold(0.0, |sum, (w, p)| w.mul_add(p.time, sum));
        scatter += (one.time - at) * (one.time - at);
        let by_own = own[place] * (1.0 - 2.0 * weights[place]);
        expected += weights.iter().zip(&own).fold(by_own, |sum, (w, v)| (w * w).mul_add(*v, sum));
    }
    let freedom = (picked.len() - 3) as f64;
    // The bound of a chi-squared variable, by the approximation of Wilson and Hilferty.
    let part = 2.0 / (9.0 * freedom);
    let bound = 1.0 - part + SURE * part.sqrt();
    if scatter <= expected * bound * bound * bound {
        return own;
    }
    let excess = (scatter - expected) / freedom;
    own.into_iter().map(|variance| variance + excess).collect()
}

/// Returns the weights with which values at `known` distances give that of their least-squares parabola at
/// `distance`: of fewer than four, of their line.
fn parabola_weights(known: &[f64], distance: f64) -> Vec<f64> {
    let count = known.len() as f64;
    let middle = mean(known);
    let scale = known.iter().fold(f64::MIN_POSITIVE, |max: f64, x| max.max((x - middle).abs()));
    let u: Vec<f64> = known.iter().map(|x| (x - middle) / scale).collect();
    let at = (distance - middle) / scale;
    let moment = |power: i32| u.iter().map(|u| power_of(*u, power)).sum::<f64>();
    let (second, third) = (moment(2), moment(3));
    // Orthogonal polynomials of degree 0, 1 and 2 over the known distances.
    let quadratic = |u: f64| u * u - third / second * u - second / count;
    let square: f64 = u.iter().map(|u| quadratic(*u) * quadratic(*u)).sum();
    let bend = if known.len() >= 4 && square > 1e-9 { quadratic(at) / square } else { 0.0 };
    u.iter().map(|u| 1.0 / count + at * u / second + bend * quadratic(*u)).collect()
}

fn power_of(u: f64, power: i32) -> f64 {
    (0..power).fold(1.0, |product, _| product * u)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distances() -> Vec<f64> {
        (0..14).map(|r| 0.011 + 8e-4 * f64::from(r)).collect()
    }

    fn curved(x: &f64) -> f64 {
        3e-6 + x / 3900.0 + 1e-6 * (x - 0.016) * (x - 0.016) / 1e-4 * 0.01
    }

    /// Times on a parabola; `change` spoils some of them.
    fn check(
        change: impl Fn(&mut Vec<Option<PickedTime>>),
        expected_rejections: usize,
        error_max: f64,
    ) -> FittedVelocity {
        let distances = distances();
        let mut times: Vec<_> =
            distances.iter().map(|x| Some(PickedTime { time: curved(x), error: 1e-9 })).collect();
        change(&mut times);
        let fitted = fit(&distances, &times, 1e-6).unwrap();
        assert_eq!(fitted.rejected.iter().filter(|&&is| is).count(), expected_rejections);
        let exact: Vec<f64> = distances.iter().map(curved).collect();
        let expected = slope(&distances, &exact);
        assert!((fitted.velocity / expected - 1.0).abs() < error_max, "{}", fitted.velocity);
        fitted
    }

    #[test]
    fn lost_receivers_do_not_move_the_velocity() {
        let whole = check(|_| (), 0, 1e-5);
        let lost = check(|times| [0, 5, 13].into_iter().for_each(|r| times[r] = None), 0, 1e-5);
        assert!(lost.standard_error > whole.standard_error);
        check(|times| times[3].iter_mut().for_each(|p| p.time += 1e-6), 1, 1e-5);
        check(
            |times| {
                times[3].iter_mut().for_each(|p| p.time += 1e-6);
                times[12].iter_mut().for_each(|p| p.time -= 0.1e-6);
            },
            2,
            1e-5,
        );
    }

    #[test]
    fn scatter_beyond_the_noise_widens_the_error() {
        let jitter = |size: f64| {
            check(
                |times| {
                    for (r, picked) in times.iter_mut().enumerate() {
                        let sign = [1.0, -1.0, -1.0, 1.0][r % 4];
                        picked.iter_mut().for_each(|p| p.time += sign * size);
                    }
                },
                0,
                1e-3,
            )
            .standard_error
        };
        let within = jitter(0.5e-9) / jitter(0.0);
        assert!((within - 1.0).abs() < 1e-3, "{within}");
        let ratio = jitter(0.6e-8) / jitter(0.0);
        assert!((4.0..10.0).contains(&ratio), "{ratio}");
    }
}
