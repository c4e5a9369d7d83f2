//! The serial port: records out and requests in, by USART2 and DMA1, without an interrupt.
//!
//! Telemetry copies frames ([`wire::frame_record`]) into a ring and, in each of its rounds, hands DMA the next piece of it and takes what the
//! other stream has received. Neither waits, and neither runs in the tick: a record for which the ring has no space is dropped and counted.
//!
//! | direction | stream | memory |
//! |---|---|---|
//! | out | DMA1 stream 6, channel 4, one piece at a time | ring of 4096 bytes: 41 ms of the line |
//! | in | DMA1 stream 5, channel 4, circular | ring of 1024 bytes: 10 ms of the line, five rounds of telemetry |
//!
//! 1 Mbaud, 8 data bits, no parity, one stop bit: the ST-LINK's port loses characters at twice as much. At 1,000 frames a second the records of a board with
//! one sensor take 72 of the 100 kB/s; those of a follower with four sensors more than all, and the rest is counted as not sent. A byte that is lost or damaged costs its frame and no other.

use core::cell::UnsafeCell;
use core::sync::atomic::{Ordering, compiler_fence};

use embassy_stm32::pac::dma::regs::Ixr;
use embassy_stm32::pac::dma::vals::{Dir, Pl};
use embassy_stm32::pac::usart::regs::Brr;
use embassy_stm32::pac::{DMA1, RCC, USART2};
use firmware::board::BOARD;
use wire::{MAX_FRAME_BYTES, Record, Unframer, frame_record};

use crate::clocks;
use crate::pins::PinRegisters;
use crate::requests::Requests;

/// Bits a microsecond. 42 MHz / 42 or 50 MHz / 50: exact.
const MEGABAUD: u16 = 1;
const PCLK1_MHZ: u16 = BOARD.clocks.apb1_mhz();
const DIVISOR: u16 = PCLK1_MHZ / MEGABAUD;
const _: () = assert!(DIVISOR * MEGABAUD == PCLK1_MHZ && DIVISOR >= 16, "RM0090 30.3.4");
/// Alternate function of both pins.
const FUNCTION: u8 = 7;

/// RM0090 table 42, RM0383 9.3.3, RM0390 table 28.
const RECEIVE: usize = 5;
const SEND: usize = 6;
const CHANNEL: u8 = 4;

const OUT: usize = 4096;
const IN: usize = 1024;

/// Memory that DMA and one owner share.
#[repr(transparent)]
struct Ring<const N: usize>(UnsafeCell<[u8; N]>);

// SAFETY: only the one `Port` accesses it beside DMA, by volatile bytes; any byte is a valid value.
unsafe impl<const N: usize> Sync for Ring<N> {}

static SENT: Ring<OUT> = Ring(UnsafeCell::new([0; OUT]));
static RECEIVED: Ring<IN> = Ring(UnsafeCell::new([0; IN]));

impl<const N: usize> Ring<N> {
    fn address(&self) -> *mut u8 {
        self.0.get().cast()
    }

    fn read(&self, place: usize) -> u8 {
        // SAFETY: the place is taken modulo the length.
        unsafe { self.address().wrapping_add(place % N).read_volatile() }
    }

    fn write(&self, place: usize, byte: u8) {
        // SAFETY: the place is taken modulo the length.
        unsafe { self.address().wrapping_add(place % N).write_volatile(byte) };
    }
}

/// The port. [`start`] makes the one that there is.
pub(crate) struct Port {
    /// Bytes that were written to the ring, and those that were sent: both modulo its length.
    written: usize,
    sent: usize,
    /// Bytes that DMA is sending.
    under_way: usize,
    /// Place of the next received byte.
    taken: usize,
    unframer: Unframer,
    pub(crate) requests: Requests,
}

/// Starts the port.
pub(crate) fn start(requests: Requests) -> Port {
    RCC.apb1enr().modify(|w| w.set_usart2en(true));
    RCC.ahb1enr().modify(|w| w.set_dma1en(true));
    clocks::settle();
    for pin in [BOARD.serial_out, BOARD.serial_in] {
        pin.set_function(FUNCTION);
    }
    // A line that is not wired is idle.
    BOARD.serial_in.set_pull(embassy_stm32::pac::gpio::vals::Pupdr::PULL_UP);
    USART2.brr().write_value(Brr(DIVISOR.into()));
    USART2.cr3().write(|w| {
        w.set_dmat(true);
        w.set_dmar(true);
    });
    begin_receiving();
    USART2.cr1().write(|w| {
        w.set_ue(true);
        w.set_te(true);
        w.set_re(true);
    });
    Port { written: 0, sent: 0, under_way: 0, taken: 0, unframer: Unframer::default(), requests }
}

fn begin_receiving() {
    let stream = DMA1.st(RECEIVE);
    clear(RECEIVE);
    stream.par().write_value(USART2.dr().as_ptr() as u32);
    stream.m0ar().write_value(RECEIVED.address() as u32);
    stream.ndtr().write(|w| w.set_ndt(IN as u16));
    stream.cr().write(|w| {
        w.set_chsel(CHANNEL);
        w.set_circ(true);
        w.set_minc(true);
        w.set_pl(Pl::LOW);
        w.set_en(true);
    });
}

/// Clears the flags of a stream; it does not start with one set.
fn clear(stream: usize) {
    let mut flags = Ixr(0);
    let place = stream % 4;
    flags.set_tcif(place, true);
    flags.set_htif(place, true);
    flags.set_teif(place, true);
    flags.set_dmeif(place, true);
    flags.set_feif(place, true);
    DMA1.ifcr(stream / 4).write_value(flags);
}

impl Port {
    /// Puts a record into the ring, or counts that there was no space.
    #[inline(never)]
    pub(crate) fn send(&mut self, record: &Record) {
        self.send_frame(frame_record(record, &mut [0; MAX_FRAME_BYTES]).unwrap_or_default());
    }

    /// The same for a record's frame.
    #[inline(never)]
    pub(crate) fn send_frame(&mut self, frame: &[u8]) {
        let free = OUT - self.written.wrapping_sub(self.sent);
        if frame.is_empty() || frame.len() > free {
            self.drop_records(1);
            return;
        }
        for byte in frame {
            SENT.write(self.written, *byte);
            self.written = self.written.wrapping_add(1);
        }
    }

    /// Counts records that are not sent.
    pub(crate) fn drop_records(&mut self, records: u32) {
        let counts = &mut self.requests.counts;
        counts.not_sent = counts.not_sent.wrapping_add(records);
    }

    /// Hands DMA the next bytes if it has none.
    pub(crate) fn pump(&mut self) {
        let stream = DMA1.st(SEND);
        if stream.cr().read().en() {
            return;
        }
        // A transfer that failed has lost its frames; the next ones are right again.
        self.sent = self.sent.wrapping_add(core::mem::take(&mut self.under_way));
        let from = self.sent % OUT;
        let piece = self.written.wrapping_sub(self.sent).min(OUT - from);
        if piece == 0 {
            return;
        }
        self.under_way = piece;
        clear(SEND);
        stream.par().write_value(USART2.dr().as_ptr() as u32);
        stream.m0ar().write_value(SENT.address().wrapping_add(from) as u32);
        stream.ndtr().write(|w| w.set_ndt(piece as u16));
        // The bytes are in memory before the stream reads them.
        compiler_fence(Ordering::SeqCst);
        cortex_m::asm::dmb();
        stream.cr().write(|w| {
            w.set_chsel(CHANNEL);
            w.set_dir(Dir::MEMORY_TO_PERIPHERAL);
            w.set_minc(true);
            w.set_pl(Pl::LOW);
            w.set_en(true);
        });
    }

    /// Takes what was received, and hands the requests in it to the loop.
    pub(crate) fn receive(&mut self) {
        // RM0090 30.3.3: reading SR, then DR, ends an overrun or a framing error. The character is lost, and with it its frame.
        let status = USART2.sr().read();
        if status.ore() || status.fe() || status.ne() {
            let _ = USART2.dr().read();
        }
        let stream = DMA1.st(RECEIVE);
        if !stream.cr().read().en() {
            self.taken = 0;
            begin_receiving();
            return;
        }
        let end = IN - usize::from(stream.ndtr().read().ndt());
        while self.taken != end % IN {
            let byte = RECEIVED.read(self.taken);
            self.taken = (self.taken + 1) % IN;
            self.requests.take(&mut self.unframer, byte);
        }
    }
}
