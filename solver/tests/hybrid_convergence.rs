//! The hybrid method's error falls with the orders of its elements and of its time steps.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use osteon_common::case::{Bone, Setup};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_solver::hybrid::{ConvergenceRow, element_convergence, time_step_convergence};

/// A triclinic draw.
fn bone() -> Bone {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.2]);
    Ensemble::new(&point, 5).unwrap().bone(0).unwrap()
}

/// Slopes of log error against log of what is halved.
fn orders(rows: &[ConvergenceRow], of: fn(&ConvergenceRow) -> f64) -> Vec<f64> {
    rows.windows(2)
        .map(|pair| {
            libm::log(pair[0].error / pair[1].error) / libm::log(of(&pair[0]) / of(&pair[1]))
        })
        .collect()
}

#[test]
fn elements_of_degree_n_are_of_order_n_plus_one() {
    for (order, sizes) in [
        (2, [0.25e-3, 0.125e-3, 0.0625e-3]),
        (3, [0.5e-3, 0.25e-3, 0.125e-3]),
        (4, [0.5e-3, 0.25e-3, 0.125e-3]),
        (6, [1e-3, 0.5e-3, 0.25e-3]),
    ] {
        let rows = element_convergence(&Setup::default(), &bone(), order, &sizes).unwrap();
        let orders = orders(&rows, |row| row.element_size);
        assert!(orders[1] > f64::from(order) + 0.5, "degree {order}: orders {orders:?}, {rows:?}");
    }
}

#[test]
fn time_steps_are_of_fourth_order() {
    let rows = time_step_convergence(&Setup::default(), &bone(), 2).unwrap();
    let orders = orders(&rows, |row| row.time_step);
    assert!(orders.iter().all(|order| (order - 4.0).abs() < 0.1), "orders {orders:?}, {rows:?}");
}
