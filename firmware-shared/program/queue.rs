//! Puts into and takes from the queues between tasks without a reachable panic.
//!
//! A queue of `heapless` computes its next place by a remainder with the length, which it reads at run time: a division whose panic the
//! compiler keeps, because it cannot see that no queue has the length 0. Here that case returns before the division. `cargo xtask test --only
//! panic-free` shows that no panic is left in the image.

use heapless::spsc::{Consumer, Producer};

/// What `capacity` is for a queue of the length 0, one less than the length: there is none.
const NO_QUEUE: usize = usize::MAX;

/// Puts an item at the end; false if there was no place for it. A closure makes the item, so that nothing is copied where there is no place.
pub(crate) fn put<T>(queue: &mut Producer<'_, T>, item: impl FnOnce() -> T) -> bool {
    if queue.capacity() == NO_QUEUE || !queue.ready() {
        return false;
    }
    queue.enqueue(item()).is_ok()
}

/// Takes the oldest item.
pub(crate) fn take<T>(queue: &mut Consumer<'_, T>) -> Option<T> {
    if queue.capacity() == NO_QUEUE || !queue.ready() {
        return None;
    }
    // Most ticks find nothing.
    queue.dequeue()
}
