//! The table of docs/performance.md on signals: `cargo bench -p osteon-signals --bench picking`.
//!
//! Everything is measured in turns, and the smallest time is kept: the machine's neighbours only ever make it
//! longer. The solver's time for the same bone stands beside it. Without `--bench`, as under `cargo test
//! --benches`, it is a short run.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on should say where")]
#![expect(clippy::print_stdout, reason = "the table goes to stdout")]

use std::hint::black_box;
use std::time::Instant;

use osteon_common::signal_layout::Transmitter;
use osteon_signals::{SeriesPicker, SignalSeries};
use osteon_solver::{Isa, Solver, Workspace};

#[path = "../tests/support/mod.rs"]
mod support;

use support::{CASE, CLEAN, description, packet_peak, signals, with_noise};

/// One row: what is done, and the smallest time, s.
struct Row {
    name: String,
    work: Box<dyn FnMut()>,
    time: f64,
}

fn main() {
    let is_full = std::env::args().any(|argument| argument == "--bench");
    let turns = if is_full { 200 } else { 1 };
    let mut rows = vec![solving()];
    let fine = signals(&CASE.setup, Transmitter::First, 8e-9);
    for clean in [CLEAN.clone(), SignalSeries { directions: vec![fine] }] {
        let samples = clean.directions[0].receivers[0].len();
        let deviation = packet_peak(&clean) * libm::pow(10.0, -30.0 / 20.0);
        rows.push(picking(format!("no noise, no filter, {samples} samples"), None, clean.clone()));
        let noisy = with_noise(&clean, deviation, 1);
        rows.push(picking(format!("30 dB, filter, {samples} samples"), Some([0.0, 2.5e6]), noisy));
    }
    for _ in 0..turns {
        for row in &mut rows {
            let start = Instant::now();
            (row.work)();
            row.time = row.time.min(start.elapsed().as_secs_f64());
        }
    }
    println!("| 14 receivers | ms | realizations of the solver |\n|---|--:|--:|");
    let of_solver = rows[0].time;
    for row in &rows {
        println!("| {} | {:.2} | {:.1} |", row.name, row.time * 1e3, row.time / of_solver);
    }
}

fn solving() -> Row {
    let solver = Solver::with_isa(&CASE.setup, Isa::fastest());
    let mut workspace = Workspace::default();
    let work = Box::new(move || {
        black_box(solver.arrival(&CASE.bone, &mut workspace).unwrap());
    });
    Row { name: "the solver's velocity".to_owned(), work, time: f64::INFINITY }
}

fn picking(name: String, band: Option<[f64; 2]>, series: SignalSeries) -> Row {
    let picker = SeriesPicker::new(description(band));
    let work = Box::new(move || {
        black_box(picker.pick(&series).estimate.unwrap());
    });
    Row { name, work, time: f64::INFINITY }
}
