//! Damaged files of arrays: each is read or refused with few words, without a panic, and in bounded memory.

#![expect(unsafe_code, reason = "an allocator that counts")]

#[path = "support/fixtures.rs"]
mod fixtures;

use std::alloc::{GlobalAlloc, Layout, System};
use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};

use fixtures::{description, fixture, open};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// Bytes that are allocated, and the most that ever were since the last look.
static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

struct CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

// SAFETY: every call is handed on as it is.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        MOST.fetch_max(now, Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// The fixtures, each with the array that is read.
const FIXTURES: [(&str, Option<&str>); 11] = [
    ("signals.npy", None),
    ("signals.npz", Some("signals")),
    ("scipy-6.mat", None),
    ("scipy-7.mat", Some("probe.data.rf")),
    ("octave-6.mat", None),
    ("octave-7.mat", None),
    ("matlab-7.3.mat", None),
    ("arrays.h5", Some("/raw/rf")),
    ("arrays.h5", Some("/raw/time_first")),
    ("odd.h5", Some("huge")),
    ("receivers.rcv2D", None),
];
/// Files that are cut off, and files with wrong bytes, of each.
const CUT: usize = 60;
const FLIPPED: usize = 250;
/// Most memory for a file of at most 14 kB, bytes, and most bytes of a message.
const MEMORY_MAX: usize = 32 << 20;
const MESSAGE_MAX: usize = 2000;

/// One test: whatever runs beside it would be counted, too.
#[test]
fn damaged_files_are_refused_in_bounded_memory() {
    let directory = tempfile::tempdir().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(20_261);
    let mut below = move |end: usize| (random.next_u64() % end as u64) as usize;
    for (name, variable) in FIXTURES {
        let whole = fs::read(fixture(name)).unwrap();
        let path = directory.path().join(name);
        let check = |bytes: &[u8], what: &str| {
            fs::write(&path, bytes).unwrap();
            let before = NOW.load(Ordering::Relaxed);
            MOST.store(before, Ordering::Relaxed);
            let read = open(&path, &description(variable));
            let taken = MOST.load(Ordering::Relaxed).saturating_sub(before);
            assert!(taken < MEMORY_MAX, "{name}, {what}: {taken} bytes of memory");
            if let Err(message) = &read {
                assert!(message.len() < MESSAGE_MAX, "{name}, {what}: {message}");
            }
            read
        };
        for part in 0..CUT {
            let length = whole.len() * part / CUT;
            assert!(check(&whole[..length], "cut").is_err(), "{name}: {length} bytes are read");
        }
        for number in 0..FLIPPED {
            let mut bytes = whole.clone();
            for _ in 0..=below(3) {
                let at = below(bytes.len());
                bytes[at] = [0, 1, 0x7f, 0x80, 0xff, bytes[at] ^ 0x10][below(6)];
            }
            let _read_or_refused = check(&bytes, &format!("damage {number}"));
        }
    }
}
