//! A value in memory of the caller, with a mark that says that it is there.

/// Alignment of the objects of the caller, bytes.
pub(crate) const ALIGNMENT: usize = 16;

/// A kind of values that a caller has memory for.
pub(crate) trait Kind {
    /// Marks a slot that is filled with one; another number for each kind. Memory of zeros is an empty slot.
    const MARK: u64;
}

/// A value behind its mark.
#[repr(C)]
struct Slot<T> {
    mark: u64,
    value: T,
}

/// Whether a value of type `T` with its mark fits into `words` words of 8 bytes.
pub(crate) const fn fits<T>(words: usize) -> bool {
    size_of::<Slot<T>>() <= words * 8 && align_of::<Slot<T>>() <= ALIGNMENT
}

/// Puts a value into the words. What was there is forgotten: no value here owns anything outside of its own bytes.
///
/// # Safety
/// `words` points to as many words as [`fits`] was asked about, aligned to [`ALIGNMENT`], that nobody else uses.
pub(crate) unsafe fn fill<T: Kind>(words: *mut u64, value: T) {
    // SAFETY: the caller guarantees size, alignment and exclusive use.
    unsafe { words.cast::<Slot<T>>().write(Slot { mark: T::MARK, value }) };
}

/// The value in the words; `None` if they are null, not aligned or not filled with this kind.
///
/// # Safety
/// `words` is null, or points to as many words as [`fits`] was asked about, that nobody else uses while the result lives, and
/// that are zeros or were filled here.
pub(crate) unsafe fn value<'a, T: Kind>(words: *mut u64) -> Option<&'a mut T> {
    if words.is_null() || !words.cast::<Slot<T>>().is_aligned() {
        return None;
    }
    // SAFETY: the words are readable; the mark is the first of them.
    if unsafe { words.read() } != T::MARK {
        return None;
    }
    // SAFETY: the mark is there, so a value of this type is behind it, and the caller guarantees exclusive use.
    Some(unsafe { &mut (*words.cast::<Slot<T>>()).value })
}
