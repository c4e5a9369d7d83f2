//! One damaged file after the other: each must give a clear error, soon, and hold little memory.
#![allow(dead_code, reason = "each test binary uses its part")]

use gait_trace::ReadOptions;
use gait_trace::format::open;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::time::{Duration, Instant};

thread_local! {
    static LIVE: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

/// The system's allocator, with a count of what this thread holds.
struct Counting;

fn count(bytes: isize) {
    // A thread that ends frees after its counters are gone.
    let _ = LIVE.try_with(|live| {
        live.set(live.get() + bytes);
        let _ = PEAK.try_with(|peak| peak.set(peak.get().max(live.get())));
    });
}

// SAFETY: every call goes to the system's allocator with what it was called with; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What a reader may hold beside its file: names of columns, an error.
pub(crate) const MARGIN: isize = 1 << 20;
/// A tenth of it is more than any file here takes on an idle machine.
const LONG: Duration = Duration::from_secs(20);

/// One damaged file: what is wrong with it, its name, its bytes, and what the error has to say.
pub(crate) struct Damage {
    what: &'static str,
    name: &'static str,
    bytes: Vec<u8>,
    says: &'static [&'static str],
}

pub(crate) fn damage(
    what: &'static str,
    name: &'static str,
    bytes: impl Into<Vec<u8>>,
    says: &'static [&'static str],
) -> Damage {
    Damage { what, name, bytes: bytes.into(), says }
}

pub(crate) fn check(damages: Vec<Damage>, how: &ReadOptions<'_>) {
    for Damage { what, name, bytes, says } in damages {
        let start = Instant::now();
        let (result, held) = held(|| open::of_bytes(name, &bytes, how));
        let took = start.elapsed();
        let error = match result {
            Ok(raw) => panic!("{what}: was read: {:?} {:?}", raw.format, raw.notes),
            Err(error) => error.to_string(),
        };
        for part in says {
            assert!(error.contains(part), "{what}: no `{part}` in: {error}");
        }
        assert!(error.starts_with(name), "{what}: {error}");
        assert!(error.contains("allowed"), "{what}: the error does not say what is allowed: {error}");
        assert!(error.len() < 3000, "{what}: {} bytes of error", error.len());
        assert!(took < LONG, "{what}: {took:?}");
        assert!(held < 3 * bytes.len() as isize + MARGIN, "{what}: {held} bytes held for {} of file", bytes.len());
        println!("{what}: {error}");
    }
}

/// What `act` returns, and the most bytes that it held at a time.
pub(crate) fn held<T>(act: impl FnOnce() -> T) -> (T, isize) {
    let before = LIVE.get();
    PEAK.set(before);
    let result = act();
    (result, PEAK.get() - before)
}
