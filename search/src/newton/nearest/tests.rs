//! Conditions that only the nearest point meets.

use osteon_fuzz::properties;
use proptest::prelude::*;

use super::*;

/// Returns the smallest value over the box of the linear function `slopes` · (y - at).
fn least_over_the_box(slopes: &[f64], at: &[f64]) -> f64 {
    let along = slopes.iter().zip(at).map(|(slope, u)| (slope * -u).min(slope * (1.0 - u)));
    along.sum()
}

fn residual(rows: &Rows, right: MomentVector, at: &[f64]) -> MomentVector {
    array::from_fn(|i| dot(&rows[i], at) - right[i])
}

fn right([first, second]: [f64; 2]) -> MomentVector {
    array::from_fn(|i| [first, second].get(i).copied().unwrap_or(0.0))
}

/// Returns these rows and as many rows of zeros as there are missing.
fn padded<const N: usize>(rows: [Vec<f64>; N]) -> Rows {
    let length = rows[0].len();
    array::from_fn(|i| rows.get(i).cloned().unwrap_or_else(|| vec![0.0; length]))
}

fn unit(dimension: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(prop_oneof![4 => 0.0..1.0_f64, 1 => Just(0.0), 1 => Just(1.0)], dimension)
}

/// A start, a point of the box, and rows; some entries are zero, as for a parameter without
/// influence.
fn problem() -> impl Strategy<Value = (Vec<f64>, Vec<f64>, Rows)> {
    (1_usize..=7).prop_flat_map(|dimension| {
        let entry = prop_oneof![3 => -1.0..1.0_f64, 1 => Just(0.0)];
        let row = || prop::collection::vec(entry.clone(), dimension);
        let third = prop_oneof![1 => row(), 1 => Just(vec![0.0; dimension])];
        (unit(dimension), unit(dimension), row(), row(), third).prop_map(
            |(start, other, first, second, third)| (start, other, padded([first, second, third])),
        )
    })
}

properties! {
    #![cases(2000)]

    /// For the nearest point x of a convex set, no direction from x to another of its points leads
    /// towards the start.
    fn of_the_solutions_it_is_the_nearest((start, other, rows) in problem()) {
        let right = array::from_fn(|i| dot(&rows[i], &other));
        let at = nearest(&start, &rows, right);
        prop_assert!(at.iter().all(|u| (0.0..=1.0).contains(u)));
        let missed = residual(&rows, right, &at);
        // The accuracy permitted by SOFTNESS: about 1e-10 over the smaller singular value of the
        // relevant rows.
        prop_assert!(missed.iter().all(|r| r.abs() < 1e-5), "{missed:?}");
        let turn: f64 =
            (0..at.len()).map(|i| (at[i] - start[i]) * (other[i] - at[i])).sum();
        prop_assert!(turn > -1e-4, "{turn} at {at:?}");
    }

    /// For least squares over the box, the gradient points out of the box or vanishes. The
    /// multipliers are the residuals divided by SOFTNESS, up to 1e11, and so rounding moves
    /// coordinates inside the box by 1e-5.
    fn without_a_solution_it_is_the_least_squares(
        (start, _, rows) in problem(),
        right in prop::array::uniform3(-6.0..6.0_f64),
    ) {
        let right = array::from_fn(|i| right.get(i).copied().unwrap_or(0.0));
        let at = nearest(&start, &rows, right);
        let missed = residual(&rows, right, &at);
        let gradient: Vec<f64> =
            (0..at.len()).map(|i| rows.iter().zip(missed).map(|(row, r)| row[i] * r).sum()).collect();
        let least = least_over_the_box(&gradient, &at);
        prop_assert!(least > -1e-4, "{least} at {at:?}");
    }
}

#[test]
fn a_start_that_solves_stays() {
    let rows = padded([vec![0.5, 0.25, 0.0], vec![0.0, 0.0, 1.0]]);
    let at = nearest(&[0.5, 0.5, 0.25], &rows, right([0.375, 0.25]));
    assert_eq!(at, [0.5, 0.5, 0.25]);
}

#[test]
fn what_one_coordinate_cannot_the_others_do() {
    // The step from (0.9, 0.5) by (0.3, 0.3) leaves the box: the first coordinate stops, the second
    // continues.
    let rows = padded([vec![1.0, 1.0]]);
    let at = nearest(&[0.9, 0.2], &rows, right([1.7, 0.0]));
    assert!((at[0] - 1.0).abs() < 1e-9 && (at[1] - 0.7).abs() < 1e-9, "{at:?}");
}

#[test]
fn without_coordinates_there_is_one_point() {
    assert_eq!(nearest(&[], &padded([vec![]]), [1.0; MOMENTS]), Vec::<f64>::new());
}
