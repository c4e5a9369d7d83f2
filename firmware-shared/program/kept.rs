//! Words in RAM that neither a reset nor the start-up code clears. What they hold after a power-on is anything, so a reader checks it.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// The words; the static that holds them names a section below `.uninit`.
#[repr(transparent)]
pub(crate) struct Kept<const WORDS: usize>(UnsafeCell<MaybeUninit<[u32; WORDS]>>);

// SAFETY: read and written here only, word by word and volatile. A record that an interrupt or a fault cut in two fails its check sum.
unsafe impl<const WORDS: usize> Sync for Kept<WORDS> {}

impl<const WORDS: usize> Kept<WORDS> {
    pub(crate) const fn new() -> Self {
        Self(UnsafeCell::new(MaybeUninit::uninit()))
    }

    pub(crate) fn load(&self) -> [u32; WORDS] {
        let words = self.0.get().cast::<u32>();
        let mut copy = [0; WORDS];
        for (index, word) in copy.iter_mut().enumerate() {
            // SAFETY: in bounds, aligned; any content of the RAM is a valid u32, and volatile reads stop the compiler from assuming a content.
            *word = unsafe { words.add(index).read_volatile() };
        }
        copy
    }

    pub(crate) fn store(&self, copy: [u32; WORDS]) {
        let words = self.0.get().cast::<u32>();
        for (index, word) in copy.into_iter().enumerate() {
            // SAFETY: in bounds, aligned; see `Sync` for concurrent access.
            unsafe { words.add(index).write_volatile(word) };
        }
    }
}
