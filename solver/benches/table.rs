//! The tables of docs/performance.md: `cargo bench -p osteon-solver --bench table`.
//!
//! Everything is measured in turns, many times over, with slices of the peak in between, and the
//! smallest time of each bone is kept: the machine's clock and its neighbours vary, and only ever
//! make it longer. Without `--bench`, as under `cargo test --benches`, it is a short run that shows that
//! all of it works.

#![expect(clippy::expect_used, reason = "the bones are known to have a velocity")]
#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
#![expect(clippy::print_stdout, reason = "the tables go to stdout")]

use std::num::NonZero;
use std::sync::Barrier;
use std::thread;
use std::time::Instant;

use osteon_common::case::Bone;
use osteon_common::settings::Method;
use osteon_solver::stages::{StageWorkspace, Stages};
use osteon_solver::{Isa, Solver, Workspace};

mod measure {
    pub(crate) mod draws;
    pub(crate) mod machine;
    pub(crate) mod peak;
}

use measure::draws::{SEED, bones, ensemble, setup};
use measure::{machine, peak};

/// How much is measured.
struct Effort {
    /// Bones of the exact method, of its refined form, and of the hybrid one.
    bones: [usize; 3],
    /// Turns of each.
    turns: [usize; 3],
    /// Slices of the peak in each turn.
    slices: usize,
    /// Realizations of a thread.
    share: u64,
}

const FULL: Effort = Effort { bones: [200, 20, 3], turns: [25, 5, 5], slices: 50, share: 1000 };
const SHORT: Effort = Effort { bones: [2, 1, 1], turns: [1, 1, 1], slices: 1, share: 2 };

/// One row: a way to compute, and the smallest time of each bone, s.
struct Row {
    name: String,
    solver: Solver,
    bones: Vec<Bone>,
    turns: usize,
    times: Vec<f64>,
}

/// Names of the stages, in order.
const STAGES: [&str; 6] =
    ["draw of the germs", "tensor", "admittance", "wavenumber sum", "time synthesis", "picking"];

fn main() {
    let full = std::env::args().any(|argument| argument == "--bench");
    let effort = if full { FULL } else { SHORT };
    let mut peak = 0.0;
    let mut rows = rows(&effort);
    let mut stages = vec![[f64::INFINITY; STAGES.len()]; effort.bones[0]];
    let mut pairs = 0;
    let solver = Stages::new(&setup(Method::Exact, 1.0), Isa::fastest());
    for turn in 0..effort.turns.into_iter().max().unwrap_or(0) {
        for row in rows.iter_mut().filter(|row| turn < row.turns) {
            peak = highest_peak(peak, effort.slices);
            row.measure();
        }
        peak = highest_peak(peak, effort.slices);
        pairs = measure_stages(&solver, &mut stages);
    }
    println!("Processor: {}, {} cores", machine::processor(), cores());
    println!("Compiler:  {}", machine::compiler());
    println!("Commit:    {}", machine::commit());
    println!("Peak:      {:.1} GFLOP/s of f64 fused multiply-adds, one core\n", peak * 1e-9);
    print_rows(&rows, peak);
    print_stages(&stages, pairs, peak);
    print_scaling(&effort);
}

fn cores() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

fn highest_peak(peak: f64, slices: usize) -> f64 {
    (0..slices).map(|_| peak::slice()).fold(peak, f64::max)
}

fn rows(effort: &Effort) -> Vec<Row> {
    let row = |name: String, method, refinement, isa, kind: usize| Row {
        name,
        solver: Solver::with_isa(&setup(method, refinement), isa),
        bones: bones(0, effort.bones[kind] as u64),
        turns: effort.turns[kind],
        times: vec![f64::INFINITY; effort.bones[kind]],
    };
    let mut sets = Isa::available();
    sets.reverse();
    let mut rows: Vec<Row> = sets
        .into_iter()
        .map(|isa| {
            // Where every fused multiply-add is a call, fewer turns must do.
            let kind = usize::from(isa.name() == "baseline");
            let mut row = row(format!("exact, {}", isa.name()), Method::Exact, 1.0, isa, 0);
            row.turns = effort.turns[kind];
            row
        })
        .collect();
    let widest = Isa::fastest();
    let refined = format!("exact, {}, refinement 5", widest.name());
    rows.push(row(refined, Method::Exact, 5.0, widest, 1));
    rows.push(row(format!("hybrid, {}", widest.name()), Method::Hybrid, 1.0, widest, 2));
    rows
}

impl Row {
    /// One turn: every bone once.
    fn measure(&mut self) {
        let mut workspace = Workspace::default();
        for (bone, time) in self.bones.iter().zip(&mut self.times) {
            let start = Instant::now();
            self.solver.outcome(bone, &mut workspace).expect("a velocity");
            *time = time.min(start.elapsed().as_secs_f64());
        }
    }
}

/// One turn of the stages on the widest registers: smallest times, s, of each bone; returns the
/// number of (frequency, wavenumber) pairs of the last one.
fn measure_stages(stages: &Stages, times: &mut [[f64; STAGES.len()]]) -> usize {
    let mut memory = StageWorkspace::default();
    let ensemble = ensemble();
    let mut pairs = 0;
    for (index, times) in times.iter_mut().enumerate() {
        let mut clock = vec![Instant::now()];
        let bone = ensemble.bone(index as u64).expect("a bone");
        clock.push(Instant::now());
        let mut plate = stages.tensor(&bone, &mut memory).expect("a plate");
        clock.push(Instant::now());
        let mut response = plate.admittance();
        clock.push(Instant::now());
        let mut spectra = response.sum();
        clock.push(Instant::now());
        let extrema = spectra.synthesis().expect("a finite pressure");
        clock.push(Instant::now());
        extrema.picking().expect("a velocity");
        clock.push(Instant::now());
        for (time, step) in times.iter_mut().zip(clock.windows(2)) {
            *time = time.min((step[1] - step[0]).as_secs_f64());
        }
        pairs = plate.pairs();
    }
    pairs
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// A time in a unit that suits it.
fn time(seconds: f64) -> String {
    if seconds < 1e-4 {
        format!("{:.1} µs", seconds * 1e6)
    } else if seconds < 0.1 {
        format!("{:.3} ms", seconds * 1e3)
    } else {
        format!("{seconds:.2} s")
    }
}

fn print_rows(rows: &[Row], peak: f64) {
    println!("| method | bones | median | mean | slowest | mean × peak, Mflop |");
    println!("|:--|--:|--:|--:|--:|--:|");
    for row in rows {
        let mut times = row.times.clone();
        times.sort_by(f64::total_cmp);
        let mean = mean(times.iter().copied());
        println!(
            "| {} | {} | {} | {} | {} | {:.1} |",
            row.name,
            times.len(),
            time(times[times.len() / 2]),
            time(mean),
            time(times[times.len() - 1]),
            mean * peak * 1e-6
        );
    }
    println!();
}

fn print_stages(times: &[[f64; STAGES.len()]], pairs: usize, peak: f64) {
    println!("| stage of a first pass, {} | mean | share | Mflop |", Isa::fastest().name());
    println!("|:--|--:|--:|--:|");
    let means: [f64; STAGES.len()] =
        std::array::from_fn(|stage| mean(times.iter().map(|times| times[stage])));
    let all: f64 = means.iter().sum();
    for (name, mean) in STAGES.into_iter().zip(means).chain([("all", all)]) {
        let (share, work) = (100.0 * mean / all, mean * peak * 1e-6);
        println!("| {name} | {} | {share:.1} % | {work:.2} |", time(mean));
    }
    let pair = 1e9 * means[2] / pairs as f64;
    println!("\nAdmittance: {pairs} (frequency, wavenumber) pairs, {pair:.0} ns each.\n");
}

/// Realizations per second of all threads together, drawn and solved.
fn rate(solver: &Solver, threads: usize, share: u64) -> f64 {
    let ensemble = ensemble();
    let barrier = Barrier::new(threads + 1);
    let work = |thread: usize| {
        let mut workspace = Workspace::default();
        let from = thread as u64 * share;
        barrier.wait();
        for index in from..from + share {
            let bone = ensemble.bone(index).expect("a bone");
            solver.outcome(&bone, &mut workspace).expect("a velocity");
        }
    };
    let start = thread::scope(|scope| {
        for thread in 0..threads {
            let work = &work;
            scope.spawn(move || work(thread));
        }
        // Before the barrier, so that no thread begins unseen.
        let start = Instant::now();
        barrier.wait();
        start
    });
    (threads as u64 * share) as f64 / start.elapsed().as_secs_f64()
}

fn print_scaling(effort: &Effort) {
    let solver = Solver::new(&setup(Method::Exact, 1.0));
    let counts: Vec<usize> = (1..=cores()).collect();
    let mut rates = vec![0.0_f64; counts.len()];
    for _ in 0..effort.turns[0] {
        for (&threads, highest) in counts.iter().zip(&mut rates) {
            *highest = highest.max(rate(&solver, threads, effort.share));
        }
    }
    println!("| threads | realizations per second | over one thread |");
    println!("|--:|--:|--:|");
    for (threads, rate) in counts.iter().zip(&rates) {
        println!("| {threads} | {rate:.0} | {:.2} |", rate / rates[0]);
    }
    println!("\nEverything drawn at the paper's optimum with seed {SEED}.");
}
