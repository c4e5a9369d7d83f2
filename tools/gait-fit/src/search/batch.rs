//! Runs the blocks of a population on all threads of the pool, generation after generation.
//!
//! A generation takes some tenths of a millisecond, and a sleeping thread needs 20 to 50 microseconds to wake up. So a thread that has
//! nothing to do looks for work for 0.1 ms before it sleeps: the one that began the batch, until the others have done their blocks, and the
//! others, until the next batch begins.

use std::hint::spin_loop;
use std::ops::Range;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use super::lanes::blocks;

/// Longest time that a thread waits awake. Longer than a genetic algorithm needs between two generations, and than one more vector of
/// individuals takes (50 microseconds at 1 ms); short, because other programs may need the core.
const SPIN: Duration = Duration::from_micros(100);

/// Batches that have begun. It only ends waiting early: no result depends on it.
static BEGUN: AtomicUsize = AtomicUsize::new(0);

/// Waits awake for a condition, but not longer than [`SPIN`].
fn spin(until: impl Fn() -> bool) {
    let began = Instant::now();
    while !until() && began.elapsed() < SPIN {
        spin_loop();
    }
}

/// Calls `run` with each block of so many individuals ([`blocks`]), on all threads of the pool; results in the order of the blocks. A pool of
/// one thread never waits awake.
///
/// ```
/// use gait_fit::search::batch::each_block;
/// let sizes = each_block(98, |block| block.len());
/// assert_eq!(sizes.iter().sum::<usize>(), 98);
/// ```
pub fn each_block<R: Send + Sync>(individuals: usize, run: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
    let blocks = blocks(individuals);
    let others = rayon::current_num_threads().min(blocks.len()).saturating_sub(1);
    if others == 0 {
        return blocks.into_iter().map(run).collect();
    }
    let begun = BEGUN.fetch_add(1, Ordering::Relaxed) + 1;
    let results: Vec<OnceLock<R>> = blocks.iter().map(|_| OnceLock::new()).collect();
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    // Whoever is free takes the next block: a thread that comes late delays the batch little.
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some((block, result)) = blocks.get(index).zip(results.get(index)) else { return };
            result.get_or_init(|| run(block.clone()));
            done.fetch_add(1, Ordering::Relaxed);
        }
    };
    rayon::in_place_scope(|scope| {
        for _ in 0..others {
            scope.spawn(|_| work());
        }
        work();
        spin(|| done.load(Ordering::Relaxed) == blocks.len());
    });
    for _ in 0..others {
        rayon::spawn(move || spin(|| BEGUN.load(Ordering::Relaxed) != begun));
    }
    results.into_iter().map(|result| result.into_inner().expect("the scope ends after all blocks")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rayon::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Batch after batch, also of several searches at once, on any number of threads: every block once, in order.
        #[test]
        fn every_block_is_run_once_and_in_order(
            populations in prop::collection::vec(0usize..300, 1..20), threads in 1usize..5, searches in 1usize..4,
        ) {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let search = |_| -> Vec<(Vec<Range<usize>>, usize)> {
                let batch = |&individuals: &usize| {
                    let calls = AtomicUsize::new(0);
                    let run = |block: Range<usize>| {
                        calls.fetch_add(1, Ordering::Relaxed);
                        block
                    };
                    (each_block(individuals, run), calls.into_inner())
                };
                populations.iter().map(batch).collect()
            };
            let of_searches: Vec<_> = pool.install(|| (0..searches).into_par_iter().map(search).collect());
            for batches in of_searches {
                for ((got, calls), &individuals) in batches.into_iter().zip(&populations) {
                    let want = pool.install(|| blocks(individuals));
                    prop_assert_eq!(calls, want.len());
                    prop_assert_eq!(got, want);
                }
            }
        }
    }

    /// From a thread that is none of the pool, as in a fit with a report.
    #[test]
    fn a_thread_outside_of_the_pool_has_all_blocks_too() {
        assert_eq!(each_block(98, |block| block), blocks(98));
    }

    #[test]
    fn waiting_awake_ends() {
        let began = Instant::now();
        spin(|| true);
        (0..10).for_each(|_| spin(|| false));
        // The machine may be busy.
        assert!((10 * SPIN..Duration::from_secs(2)).contains(&began.elapsed()), "{:?}", began.elapsed());
    }

    #[test]
    #[should_panic = "block 0"]
    fn a_panic_of_a_block_is_that_of_the_batch() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        pool.install(|| each_block(98, |block| assert!(block.start > 0, "block 0")));
    }
}
