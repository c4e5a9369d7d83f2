//! Channels that a debug probe reads and writes in RAM, while the program runs: SEGGER's real-time transfer (RTT).
//!
//! | channel | name | content | bytes |
//! |---|---|---|---|
//! | up 0 | `defmt` | lines for people: at most ten a second, and each change of state | 1024 |
//! | up 1 | `wire` | records in the frames of the serial port ([`wire::frame_record`]) | 4096: 240 ms of them |
//! | down 0 | `unused` | nothing is read | 2 |
//! | down 1 | `requests` | requests in the frames of the serial port | 256 |
//!
//! Requests come in channel 1, because a server of OpenOCD has one number for the channel that it reads and the channel that it writes.
//!
//! **Nothing here waits.** A message or a record goes into its ring whole, or is dropped whole, whatever mode a host sets (SEGGER calls that mode
//! "skip"; it is the one in the flags of both channels). The thread alone writes and reads: a tick never does.
//!
//! The logger is our own and not that of a crate: `defmt-rtt` has one channel; that of `rtt-target` masks interrupts while a message is encoded, which
//! would delay a tick, and waits where the host has set the mode "block", as probe-rs does. Here an interrupt that logs while the thread does loses its
//! message. That needs no atomic exchange, which the RP2040 does not have: an interrupt ends before what it has interrupted goes on.
//!
//! **Channel 1 is silent while the mode of channel 0 is "block".** Only programs that show text set it: `probe-rs run` prints each channel as text, and
//! records would bury the lines. Whatever arrives in the down channel sets the mode back, because who asks reads the answer.

use core::cell::UnsafeCell;
use core::ffi::{CStr, c_char};
use core::sync::atomic::{AtomicU32, Ordering};

const TEXT_BYTES: usize = 1024;
const RECORD_BYTES: usize = 4096;
const UNUSED_BYTES: usize = 2;
const REQUEST_BYTES: usize = 256;

/// The bits of the mode in the flags of a channel.
const MODE: u32 = 3;
/// Mode: what does not fit is dropped whole.
const SKIP: u32 = 0;
/// Mode that a host sets: wait until there is space. This program does not.
const BLOCK: u32 = 2;

/// Memory of a channel, which the debugger shares. It reads whole words faster than bytes.
#[repr(C, align(4))]
struct Memory<const N: usize>(UnsafeCell<[u8; N]>);

// SAFETY: accessed by volatile bytes only, for which any value is valid.
unsafe impl<const N: usize> Sync for Memory<N> {}

impl<const N: usize> Memory<N> {
    const fn new() -> Self {
        assert!(N.is_power_of_two());
        Self(UnsafeCell::new([0; N]))
    }

    fn place(&self, at: u32) -> *mut u8 {
        self.0.get().cast::<u8>().wrapping_add(at as usize & (N - 1))
    }

    fn read(&self, at: u32) -> u8 {
        // SAFETY: the place is taken modulo the length.
        unsafe { self.place(at).read_volatile() }
    }

    fn write(&self, at: u32, byte: u8) {
        // SAFETY: the place is taken modulo the length.
        unsafe { self.place(at).write_volatile(byte) };
    }
}

/// A channel as a host reads it.
#[repr(C)]
struct Channel<const N: usize> {
    name: *const c_char,
    memory: &'static Memory<N>,
    size: u32,
    /// Offset of the next byte to write, and of the next one to read: equal where the channel is empty.
    write: AtomicU32,
    read: AtomicU32,
    flags: AtomicU32,
}

// SAFETY: the name is constant; the rest is shared already.
unsafe impl<const N: usize> Sync for Channel<N> {}

impl<const N: usize> Channel<N> {
    const LAST: u32 = (N - 1) as u32;

    const fn new(name: &'static CStr, memory: &'static Memory<N>) -> Self {
        Self {
            name: name.as_ptr(),
            memory,
            size: N as u32,
            write: AtomicU32::new(0),
            read: AtomicU32::new(0),
            flags: AtomicU32::new(SKIP),
        }
    }

    /// Bytes that can be written from this offset on. Less than the size, whatever a debugger has written to the offset of the reader.
    fn free(&self, at: u32) -> u32 {
        self.read.load(Ordering::Acquire).wrapping_sub(at).wrapping_sub(1) & Self::LAST
    }

    /// Writes all bytes from an offset on, without showing them to the reader; the offset after them. `None`: not all of them fit.
    fn stage(&self, at: u32, bytes: &[u8]) -> Option<u32> {
        if (self.free(at) as usize) < bytes.len() {
            return None;
        }
        let mut at = at;
        for byte in bytes {
            self.memory.write(at, *byte);
            at = at.wrapping_add(1) & Self::LAST;
        }
        Some(at)
    }

    /// Shows the reader what was written up to an offset.
    fn show(&self, until: u32) {
        self.write.store(until & Self::LAST, Ordering::Release);
    }

    fn written(&self) -> u32 {
        self.write.load(Ordering::Relaxed) & Self::LAST
    }
}

/// What a host finds by its first 16 bytes, or by the name of the symbol.
#[repr(C)]
struct ControlBlock {
    id: [u8; 16],
    up_channels: u32,
    down_channels: u32,
    text: Channel<TEXT_BYTES>,
    records: Channel<RECORD_BYTES>,
    unused: Channel<UNUSED_BYTES>,
    requests: Channel<REQUEST_BYTES>,
}

static TEXT: Memory<TEXT_BYTES> = Memory::new();
static RECORDS: Memory<RECORD_BYTES> = Memory::new();
static UNUSED: Memory<UNUSED_BYTES> = Memory::new();
static REQUESTS: Memory<REQUEST_BYTES> = Memory::new();

#[unsafe(export_name = "_SEGGER_RTT")]
static CONTROL_BLOCK: ControlBlock = ControlBlock {
    id: *b"SEGGER RTT\0\0\0\0\0\0",
    up_channels: 2,
    down_channels: 2,
    text: Channel::new(c"defmt", &TEXT),
    records: Channel::new(c"wire", &RECORDS),
    unused: Channel::new(c"unused", &UNUSED),
    requests: Channel::new(c"requests", &REQUESTS),
};

/// Sends the frame of a record; one that does not fit is dropped whole.
pub(crate) fn send(frame: &[u8]) {
    if CONTROL_BLOCK.text.flags.load(Ordering::Relaxed) & MODE == BLOCK {
        return;
    }
    let records = &CONTROL_BLOCK.records;
    if let Some(end) = records.stage(records.written(), frame) {
        records.show(end);
    }
}

/// Takes what a host has sent since the last call.
pub(crate) fn receive(mut each: impl FnMut(u8)) {
    let ControlBlock { text, requests, .. } = &CONTROL_BLOCK;
    let end = requests.write.load(Ordering::Acquire) & Channel::<REQUEST_BYTES>::LAST;
    let mut at = requests.read.load(Ordering::Relaxed) & Channel::<REQUEST_BYTES>::LAST;
    if at == end {
        return;
    }
    text.flags.store(SKIP, Ordering::Relaxed);
    while at != end {
        each(requests.memory.read(at));
        at = at.wrapping_add(1) & Channel::<REQUEST_BYTES>::LAST;
    }
    requests.read.store(at, Ordering::Release);
}

#[cfg(target_os = "none")]
mod logger {
    use core::cell::UnsafeCell;
    use core::sync::atomic::{AtomicU32, Ordering, compiler_fence};

    use defmt::Encoder;

    use super::CONTROL_BLOCK;

    #[defmt::global_logger]
    struct Logger;

    /// Messages that are being written: of the thread, and of interrupts above it.
    static DEPTH: AtomicU32 = AtomicU32::new(0);

    /// The message of the first of them.
    static MESSAGE: Message = Message(UnsafeCell::new(Staged { encoder: Encoder::new(), end: None }));

    struct Message(UnsafeCell<Staged>);

    // SAFETY: only `Staged::of_first` gives access, to one at a time.
    unsafe impl Sync for Message {}

    struct Staged {
        encoder: Encoder,
        /// Offset in the channel up to which it is written; `None`: it does not fit.
        end: Option<u32>,
    }

    impl Staged {
        /// Works on the message of who began first; nothing for one that began while that is being written.
        fn of_first(work: impl FnOnce(&mut Self)) {
            if DEPTH.load(Ordering::Relaxed) == 1 {
                compiler_fence(Ordering::SeqCst);
                // SAFETY: who interrupts this finds a greater depth until it returns; and `work`, in this file, does not log.
                work(unsafe { &mut *MESSAGE.0.get() });
                compiler_fence(Ordering::SeqCst);
            }
        }

        /// The encoder, and what takes its bytes.
        fn parts(&mut self) -> (&mut Encoder, impl FnMut(&[u8])) {
            let Self { encoder, end } = self;
            (encoder, |bytes: &[u8]| *end = end.and_then(|end| CONTROL_BLOCK.text.stage(end, bytes)))
        }
    }

    // SAFETY: `acquire` gives what is written until `release` to the first that asks; who interrupts it writes nothing.
    unsafe impl defmt::Logger for Logger {
        fn acquire() {
            // Load and store need not be one: an interrupt between them leaves the number as it was.
            DEPTH.store(DEPTH.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
            Staged::of_first(|message| {
                message.end = Some(CONTROL_BLOCK.text.written());
                let (encoder, write) = message.parts();
                encoder.start_frame(write);
            });
        }

        unsafe fn flush() {
            // That would wait for the host.
        }

        unsafe fn write(bytes: &[u8]) {
            Staged::of_first(|message| {
                let (encoder, write) = message.parts();
                encoder.write(bytes, write);
            });
        }

        unsafe fn release() {
            Staged::of_first(|message| {
                let (encoder, write) = message.parts();
                encoder.end_frame(write);
                if let Some(end) = message.end {
                    CONTROL_BLOCK.text.show(end);
                }
            });
            DEPTH.store(DEPTH.load(Ordering::Relaxed).wrapping_sub(1), Ordering::Relaxed);
        }
    }
}
