//! Measures the deepest use of the stack: the start-up code fills it with a value, and words with another value were used.

#[cfg(target_os = "none")]
mod painted {
    use cortex_m_rt::STACK_PAINT_VALUE;

    unsafe extern "C" {
        // From the linker script: the lowest word of the stack, and the one above its highest.
        static _stack_end: u32;
        static _stack_start: u32;
    }

    /// The lowest address of the stack.
    pub(crate) fn bottom() -> usize {
        (&raw const _stack_end).addr()
    }

    /// Largest number of bytes used, and size of the stack.
    pub(crate) fn high_water() -> (usize, usize) {
        let bottom = &raw const _stack_end;
        let top = &raw const _stack_start;
        let size = top.addr() - bottom.addr();
        let untouched = (0..size / 4)
            // SAFETY: inside of the stack, aligned; volatile, because what is read may be in use by this very function.
            .take_while(|word| unsafe { bottom.add(*word).read_volatile() } == STACK_PAINT_VALUE)
            .count();
        (size - untouched * 4, size)
    }
}

#[cfg(target_os = "none")]
pub(crate) use painted::{bottom, high_water};

/// The host's stack is not painted.
#[cfg(not(target_os = "none"))]
pub(crate) fn high_water() -> (usize, usize) {
    (0, 0)
}
