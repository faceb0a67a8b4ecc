//! Time of one realization, by method and instruction set, and of its stages: `cargo bench -p
//! osteon-solver --bench realization`.

#![expect(clippy::expect_used, reason = "the bones are known to have a velocity")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use osteon_common::case::Bone;
use osteon_common::settings::Method;
use osteon_solver::stages::{StageWorkspace, Stages};
use osteon_solver::{Isa, Solver, Workspace};

mod measure {
    pub(crate) mod draws;
}

use measure::draws::{bones, ensemble, setup};

/// Bones that are computed in turn, so that a mean includes second passes in their share.
const BONES: u64 = 200;

/// Times the realizations of `bones` in turn.
fn time_in_turn(criterion: &mut Criterion, method: Method, isa: Isa, bones: &[Bone]) {
    let solver = Solver::with_isa(&setup(method, 1.0), isa);
    let mut workspace = Workspace::default();
    let mut bones = bones.iter().cycle();
    let mut group = criterion.benchmark_group(method.name());
    if method == Method::Hybrid {
        group.sample_size(10).measurement_time(Duration::from_secs(10));
    }
    group.bench_function(BenchmarkId::from_parameter(isa.name()), |bencher| {
        bencher.iter(|| {
            let bone = bones.next().expect("a cycle has no end");
            solver.outcome(black_box(bone), &mut workspace).expect("a velocity")
        });
    });
}

fn methods(criterion: &mut Criterion) {
    let bones = bones(0, BONES);
    for isa in Isa::available() {
        time_in_turn(criterion, Method::Exact, isa, &bones);
    }
    // A realization takes a quarter of a second: the few samples are of the same bone, so that they compare.
    time_in_turn(criterion, Method::Hybrid, Isa::fastest(), &bones[..1]);
}

fn stages(criterion: &mut Criterion) {
    let stages = Stages::new(&setup(Method::Exact, 1.0), Isa::fastest());
    let mut memory = StageWorkspace::default();
    let ensemble = ensemble();
    let bone = ensemble.bone(0).expect("a bone");
    let mut group = criterion.benchmark_group("stages");
    group.bench_function("draw", |bencher| bencher.iter(|| ensemble.bone(black_box(0))));
    group.bench_function("tensor", |bencher| {
        bencher.iter(|| stages.tensor(black_box(&bone), &mut memory).is_ok());
    });
    let mut plate = stages.tensor(&bone, &mut memory).expect("a plate");
    group.bench_function("admittance", |bencher| {
        bencher.iter(|| {
            black_box(plate.admittance());
        });
    });
    let mut response = plate.admittance();
    group.bench_function("wavenumber sum", |bencher| {
        bencher.iter(|| {
            black_box(response.sum());
        });
    });
    let mut spectra = response.sum();
    group.bench_function("time synthesis", |bencher| bencher.iter(|| spectra.synthesis().is_ok()));
    let extrema = spectra.synthesis().expect("a finite pressure");
    group.bench_function("picking", |bencher| bencher.iter(|| extrema.picking()));
}

criterion_group!(realization, methods, stages);
criterion_main!(realization);
