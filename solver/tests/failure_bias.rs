//! What failed realizations do to the moments, where it is known: of draws whose velocities are all there, the
//! slowest are made failures.

use osteon_common::case::Setup;
use osteon_common::job::MonteCarlo;
use osteon_common::job::Sampling;
use osteon_common::outcome::{FailureKind, Outcome};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_common::statistics::{estimate, failure_bias};
use osteon_solver::{Solver, Workspace};

fn at(dispersion: f64) -> Point {
    Point([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion])
}

fn outcomes(monte_carlo: &MonteCarlo, point: &Point) -> Vec<Outcome> {
    let ensemble = Ensemble::drawn(point, monte_carlo.germs()).unwrap();
    let solver = Solver::new(&Setup::default());
    let mut workspace = Workspace::default();
    (0..monte_carlo.realizations)
        .map(|i| solver.outcome(&ensemble.bone(i).unwrap(), &mut workspace))
        .collect()
}

#[test]
fn probe() {
    for dispersion in [0.1029, 0.3, 0.6] {
        let point = at(dispersion);
        let monte_carlo = MonteCarlo { realizations: 4000, ..MonteCarlo::default() };
        let all = outcomes(&monte_carlo, &point);
        let f = all.iter().filter(|o| o.is_err()).count();
        let full = estimate(&monte_carlo, &point, &all).unwrap();
        println!("{dispersion}: {f} failed, {full:?}, bias {:?}", failure_bias(&monte_carlo, &point, &all));
        for part in [0.005, 0.03, 0.1] {
            let mut sorted: Vec<f64> = all.iter().filter_map(|o| o.ok()).collect();
            sorted.sort_by(f64::total_cmp);
            let limit = sorted[(part * sorted.len() as f64) as usize];
            let cut: Vec<Outcome> = all.iter().map(|o| match o { Ok(v) if *v < limit => Err(FailureKind::NoArrival), o => *o }).collect();
            let found = estimate(&monte_carlo, &point, &cut).unwrap();
            let truth = [full.moments.mean - found.moments.mean, full.moments.coefficient_of_variation - found.moments.coefficient_of_variation];
            println!("  {part}: truth {truth:?}, {:?}", failure_bias(&monte_carlo, &point, &cut));
        }
    }
}

#[test]
fn probe_edf() {
    for dispersion in [0.1029, 0.3] {
        let point = at(dispersion);
        for n in [64_u64, 256, 1024] {
            let m = MonteCarlo { realizations: n * 40, scrambles: 40, sampling: Sampling::Sobol, ..MonteCarlo::default() };
            let all: Vec<f64> = outcomes(&m, &point).iter().map(|o| o.unwrap_or(0.0)).collect();
            let mut sorted = all.clone();
            sorted.sort_by(f64::total_cmp);
            for p in [0.07, 0.3, 0.5, 0.9] {
                let limit = sorted[(p * sorted.len() as f64) as usize];
                let f: Vec<f64> = all.chunks(n as usize).map(|c| c.iter().filter(|&&v| v < limit).count() as f64 / n as f64).collect();
                let var = f.iter().map(|x| (x - p) * (x - p)).sum::<f64>() / 39.0;
                println!("{dispersion} {n} {p}: worth {}", p * (1.0 - p) / n as f64 / var);
            }
        }
    }
}
