//! Least-squares lines.

/// Returns the least-squares slope of values against places: of distances (m) against times (s) the velocity, m/s.
pub fn slope(values: &[f64], places: &[f64]) -> f64 {
    let (mean_value, mean_place) = (mean(values), mean(places));
    let (mut cross, mut square) = (0.0, 0.0);
    for (value, place) in values.iter().zip(places) {
        let off = place - mean_place;
        cross = off.mul_add(value - mean_value, cross);
        square = off.mul_add(off, square);
    }
    cross / square
}

/// Returns the arithmetic mean.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |sum, value| sum + value) / values.len() as f64
}
