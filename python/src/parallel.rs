//! A computation for each of many indices, on threads of its own, which Ctrl-C stops.
//!
//! Threads live as long as one call: a pool would not survive a fork of the process, and a thousand
//! realizations take a thousand times as long as starting a thread.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::errors;

/// Time between two looks at signals and progress.
const POLL: Duration = Duration::from_millis(50);
/// Indices that a thread takes at a time; a few milliseconds of realizations.
const CHUNK: usize = 8;

/// How to compute, and whom to tell.
pub(crate) struct ParallelMap {
    /// Number of threads, at least 1.
    pub(crate) threads: usize,
    /// Called with the number of results so far; an exception ends the computation.
    pub(crate) progress: Option<Py<PyAny>>,
}

/// The results of one thread, by chunks with their first index.
type Chunks<T> = Vec<(usize, Vec<T>)>;

/// What the threads share.
#[derive(Default)]
struct Shared {
    next: AtomicUsize,
    complete: AtomicUsize,
    stop: AtomicBool,
    /// Number of threads that have ended.
    ended: Mutex<usize>,
    changed: Condvar,
}

impl ParallelMap {
    /// Returns `compute` of 0, 1, … `count` - 1, each with the scratch memory `W` of its thread.
    ///
    /// # Errors
    /// What signals or `progress` raise, or an `InternalError` for a panic.
    pub(crate) fn map<T: Send, W: Default>(
        &self,
        py: Python<'_>,
        count: usize,
        compute: impl Fn(usize, &mut W) -> T + Sync,
    ) -> PyResult<Vec<T>> {
        let shared = Shared::default();
        let threads = self.threads.clamp(1, count.div_ceil(CHUNK).max(1));
        let work = || shared.work(count, &compute);
        let results = py.detach(|| {
            thread::scope(|scope| {
                let spawn = |_| thread::Builder::new().spawn_scoped(scope, work);
                let handles: Vec<_> = (0..threads).map(spawn).filter_map(Result::ok).collect();
                if handles.is_empty() {
                    // The system allows no thread: this one does it all, and looks at signals afterwards.
                    return Ok(vec![work()]);
                }
                let interrupted = self.attend(&shared, handles.len());
                let joined =
                    handles.into_iter().map(|handle| handle.join().and_then(|ended| ended));
                let joined: Vec<_> = joined.collect();
                interrupted.map(|()| joined)
            })
        })?;
        let mut chunks: Chunks<T> = Vec::new();
        for result in results {
            chunks.extend(result.map_err(|payload| errors::panicked(payload.as_ref()))?);
        }
        py.check_signals()?;
        self.report(py, count)?;
        chunks.sort_by_key(|(first, _)| *first);
        Ok(chunks.into_iter().flat_map(|(_, results)| results).collect())
    }

    /// Looks at signals and reports progress until all threads have ended.
    fn attend(&self, shared: &Shared, threads: usize) -> PyResult<()> {
        let mut interrupted = Ok(());
        let mut ended = shared.ended.lock().unwrap_or_else(PoisonError::into_inner);
        while *ended < threads {
            let waited = shared.changed.wait_timeout(ended, POLL);
            let (guard, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
            if !timeout.timed_out() || interrupted.is_err() {
                ended = guard;
                continue;
            }
            drop(guard);
            let complete = shared.complete.load(Ordering::Relaxed);
            interrupted = Python::attach(|py| {
                py.check_signals()?;
                self.report(py, complete)
            });
            if interrupted.is_err() {
                shared.stop.store(true, Ordering::Relaxed);
            }
            ended = shared.ended.lock().unwrap_or_else(PoisonError::into_inner);
        }
        interrupted
    }

    fn report(&self, py: Python<'_>, complete: usize) -> PyResult<()> {
        match &self.progress {
            Some(progress) => progress.call1(py, (complete,)).map(drop),
            None => Ok(()),
        }
    }
}

impl Shared {
    /// Takes chunks of indices until there are none, or until it is told to stop.
    fn work<T, W: Default>(
        &self,
        count: usize,
        compute: &impl Fn(usize, &mut W) -> T,
    ) -> Result<Chunks<T>, Box<dyn Any + Send>> {
        let result = catch_unwind(AssertUnwindSafe(|| {
            let mut memory = W::default();
            let mut chunks = Vec::new();
            loop {
                let first = self.next.fetch_add(CHUNK, Ordering::Relaxed);
                if first >= count || self.stop.load(Ordering::Relaxed) {
                    return chunks;
                }
                let indices = first..(first + CHUNK).min(count);
                let results: Vec<T> = indices.map(|index| compute(index, &mut memory)).collect();
                self.complete.fetch_add(results.len(), Ordering::Relaxed);
                chunks.push((first, results));
            }
        }));
        if result.is_err() {
            self.stop.store(true, Ordering::Relaxed);
        }
        *self.ended.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        self.changed.notify_all();
        result
    }
}
