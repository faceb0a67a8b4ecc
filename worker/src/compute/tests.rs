use std::sync::mpsc;
use std::time::Duration;

use osteon_common::germ_source::{GermScheme, GermSource};
use osteon_common::parameters::Point;
use osteon_common::random_quantities::{RandomQuantities, Scatter};
use osteon_proto::evaluation::EvaluationInput;

use super::*;

const POINT: Point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
const TASK: Task = Task { attachment: 1, batch: 1 };
const DEADLINE: Duration = Duration::from_secs(60);

fn work(point: Point, first: u64, count: u32) -> Work {
    draw_work(point, GermSource::streams(5), first, count)
}

fn draw_work(point: Point, germs: GermSource, first: u64, count: u32) -> Work {
    let evaluation = EvaluationInput {
        id: 1,
        setup: Setup::default(),
        point,
        germs,
        random: RandomQuantities::default(),
        observables: osteon_common::observables::ObservableSet::NONE,
    };
    Work { evaluation: Arc::new(evaluation), first, count }
}

fn solve(threads: u32, work: Work) -> Vec<RealizationResult> {
    let (sender, receiver) = mpsc::channel();
    let mut cores = Cores::new(threads, Isa::fastest()).unwrap();
    assert_eq!(cores.slots(), threads);
    cores.start(TASK, work, Box::new(move |computed| sender.send(computed).unwrap()));
    match receiver.recv_timeout(DEADLINE).unwrap() {
        Computed::Complete { solved, .. } => solved,
        other => panic!("{other:?}"),
    }
}

#[test]
fn outcomes_do_not_depend_on_threads_or_batches() {
    let whole = solve(1, work(POINT, 0, 12));
    assert_eq!(solve(3, work(POINT, 0, 12)), whole);
    let parts = [(0, 5), (5, 1), (6, 6)];
    let joined: Vec<_> =
        parts.iter().flat_map(|&(first, count)| solve(2, work(POINT, first, count))).collect();
    assert_eq!(joined, whole);
}

#[test]
fn outcomes_are_those_of_the_solver_alone() {
    let solver = Solver::new(&Setup::default());
    for scheme in [GermScheme::Streams, GermScheme::Sobol { points: 5 }] {
        let germs = GermSource { seed: 5, scheme };
        let ensemble = Ensemble::drawn(&POINT, germs).unwrap();
        let expected: Vec<_> = (3..7)
            .map(|index| {
                let bone = ensemble.bone(index).unwrap();
                let arrival = solver.arrival(&bone, &mut Workspace::default()).unwrap();
                RealizationResult::solved(arrival.velocity, arrival.estimated_error)
            })
            .collect();
        assert_eq!(solve(2, draw_work(POINT, germs, 3, 4)), expected, "{scheme:?}");
    }
}

/// Each realization with a random setup has that of its index.
#[test]
fn outcomes_with_random_setups_do_not_depend_on_threads_or_batches() {
    let thickness = Scatter { standard_deviation: Some(0.3e-3), ..Scatter::default() };
    let random = RandomQuantities { bone_thickness: thickness, ..RandomQuantities::default() };
    let germs = GermSource { seed: 5, scheme: GermScheme::Sobol { points: 5 } };
    let work = |first, count| {
        let Work { evaluation, .. } = draw_work(POINT, germs, first, count);
        let evaluation = EvaluationInput { random, ..EvaluationInput::clone(&evaluation) };
        Work { evaluation: Arc::new(evaluation), first, count }
    };
    let whole = solve(1, work(0, 7));
    let joined = [solve(3, work(0, 4)), solve(2, work(4, 3))].concat();
    assert_eq!(joined, whole);
    let ensemble = Ensemble::drawn(&POINT, germs).unwrap();
    let thicknesses = ensemble.clone().with_random(random);
    for (index, result) in (0..).zip(whole) {
        let setup = thicknesses.own_setup(index, &Setup::default()).unwrap();
        assert_ne!(setup, Setup::default());
        let bone = ensemble.bone(index).unwrap();
        let arrival = Solver::new(&setup).arrival(&bone, &mut Workspace::default()).unwrap();
        assert_eq!(result.outcome, Ok(arrival.velocity), "{index}");
    }
}

#[test]
fn a_point_without_an_ensemble_fails_at_every_index() {
    let mut inadmissible = POINT;
    inadmissible.0[5] = 1.2;
    assert_eq!(
        solve(2, work(inadmissible, 0, 3)),
        [RealizationResult::failed(FailureKind::NotFinite); 3]
    );
}

#[test]
fn a_batch_that_is_forgotten_is_given_up() {
    let (sender, receiver) = mpsc::channel();
    let mut cores = Cores::new(1, Isa::fastest()).unwrap();
    cores.start(TASK, work(POINT, 0, 65_536), Box::new(move |it| sender.send(it).unwrap()));
    cores.forget(TASK);
    assert_eq!(receiver.recv_timeout(DEADLINE).unwrap(), Computed::Abandoned);
    assert!(cores.stops.is_empty());
}

#[test]
fn few_solvers_are_kept_and_each_is_made_once() {
    let solvers = Solvers::new(Isa::fastest());
    let setup = |thickness: f64| {
        let mut setup = Setup::default();
        setup.layers.bone_thickness = thickness;
        setup
    };
    let first = solvers.get(&setup(4e-3));
    assert!(Arc::ptr_eq(&first, &solvers.get(&setup(4e-3))));
    let others: Vec<_> = (1..SOLVERS_MAX).map(|i| setup(4e-3 + 1e-4 * i as f64)).collect();
    // Jobs that take turns: nothing is rebuilt, and the most recently used solvers are kept.
    let second = solvers.get(&others[0]);
    for _ in 0..2 {
        others.iter().for_each(|other| drop(solvers.get(other)));
        assert!(Arc::ptr_eq(&first, &solvers.get(&setup(4e-3))));
    }
    solvers.get(&setup(3e-3));
    assert_eq!(solvers.kept.lock().unwrap().len(), SOLVERS_MAX);
    assert!(Arc::ptr_eq(&first, &solvers.get(&setup(4e-3))));
    assert!(!Arc::ptr_eq(&second, &solvers.get(&others[0])));
}
