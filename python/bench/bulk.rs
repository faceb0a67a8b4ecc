//! The side in Rust of `cargo xtask bench python`: computes the velocities of tensors that it is sent,
//! as `osteon.velocities` does, whenever it is told to, and says how long each time took.
//!
//! Arguments: a case file, the number of threads and that of tensors. On stdin: the tensors, as doubles
//! of the machine, then a byte for each round. On stdout, in the same form: for each round its seconds,
//! and the sum of the bits of all velocities, by which both sides compare what they computed.

use std::env;
use std::io::{self, Read as _, Write as _};
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use osteon_common::bone::{Bone, CaseBone};
use osteon_common::elasticity::Elasticity;
use osteon_files::case_file;
use osteon_solver::{Isa, Solver, Workspace};

/// Indices that a thread takes at a time, as in `python/src/parallel.rs`.
const CHUNK: usize = 8;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(io::stderr(), "bulk: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    // Cargo adds `--bench`.
    let words: Vec<_> = env::args().skip(1).filter(|word| word != "--bench").collect();
    let [case, threads, count] = words.as_slice() else {
        // `cargo test --benches` runs it without arguments: there is nothing to measure.
        return Ok(());
    };
    let (threads, count): (usize, usize) = (threads.parse()?, count.parse()?);
    let case = case_file::read(Path::new(case))?;
    let CaseBone::Homogeneous(Bone { density, .. }) = case.bone else {
        return Err("the bone has sublayers".into());
    };
    let solver = Solver::with_isa(&case.setup, Isa::chosen(env::var_os(Isa::VARIABLE))?);
    let mut input = io::stdin().lock();
    let mut bones = Vec::new();
    for _ in 0..count {
        let mut tensor = [[0.0; 6]; 6];
        for entry in tensor.as_flattened_mut() {
            let mut bytes = [0; 8];
            input.read_exact(&mut bytes)?;
            *entry = f64::from_ne_bytes(bytes);
        }
        bones.push(Bone { density, elasticity: Elasticity::new(tensor)? });
    }
    let mut output = io::stdout().lock();
    while input.read(&mut [0])? == 1 {
        let (seconds, bits) = measured(&solver, &bones, threads);
        output.write_all(&seconds.to_ne_bytes())?;
        output.write_all(&bits.to_ne_bytes())?;
        output.flush()?;
    }
    Ok(())
}

/// Returns how long all velocities took, s, and the sum of their bits.
fn measured(solver: &Solver, bones: &[Bone], threads: usize) -> (f64, u64) {
    let begun = Instant::now();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut memory = Workspace::default();
        let mut bits = 0_u64;
        loop {
            let first = next.fetch_add(CHUNK, Ordering::Relaxed);
            if first >= bones.len() {
                return bits;
            }
            for bone in &bones[first..bones.len().min(first + CHUNK)] {
                let velocity = solver.outcome(bone, &mut memory).unwrap_or(f64::NAN);
                bits = bits.wrapping_add(velocity.to_bits());
            }
        }
    };
    let bits = thread::scope(|scope| {
        let handles: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        // A thread that panicked makes the sums differ, which ends the comparison.
        handles.into_iter().filter_map(|handle| handle.join().ok()).fold(0, u64::wrapping_add)
    });
    (begun.elapsed().as_secs_f64(), bits)
}
