//! Sampling: the converter runs freely at 16 kHz over three sensors and the die's temperature; DMA collects blocks of four scans, and the interrupt
//! at the end of a block starts a tick.
//!
//! ```text
//! conversions, 16 kHz   0 1 2 t 0 1 2 t 0 1 2 t 0 1 2 t        sensors 1 to 3, temperature
//! DMA channels 0 and 1  -> block 0 or block 1, in turn  ^ block full: the tick of this block
//! ```
//! A block is read while the other is filled, so there is a whole millisecond for it. Each sensor's four conversions become one code by
//! [`hgod_adc::trimmed_mean`]. A result that is lost stops nothing on this chip, but moves the channels in the block: the converter's flags are
//! checked in every block, and [`restart`] begins again.

use core::cell::{Cell, UnsafeCell};

use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::pac::adc::regs::{Cs, Div, Fcs};
use embassy_rp::pac::dma::regs::CtrlTrig;
use embassy_rp::pac::dma::vals::{DataSize, TreqSel};
use embassy_rp::pac::{ADC, DMA};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use firmware_rp2040::board::BOARD;
use firmware_rp2040::timing::{BLOCK, CONVERSION_CYCLES, SCAN, converted_us};
use hgod_adc::{OVERSAMPLING, trimmed_mean};
use joint_loop::SENSORS;
use joint_units::AdcCode;
use portable_atomic::{AtomicU32, Ordering};

use crate::pins::PinRegisters;
use crate::stopwatch;

/// The chip has no internal reference that its converter could measure. Every sample has this code, and the boot record has it as the factory's: so
/// the loop computes with the supply at which the factory reads the reference of the other family, 3.3 V.
pub(crate) const REFERENCE: AdcCode = AdcCode(1501);

/// Channels in a scan, in the order of conversion; 4 is the temperature.
const CHANNELS: [u8; SCAN] = [0, 1, 2, 4];
const _: () = assert!(CHANNELS.len() == BOARD.sensors.len() + 1, "the sensors and the temperature");

/// Result of the four scans of a millisecond.
#[derive(Clone, Copy)]
pub(crate) struct SampleSet {
    /// Number of the set.
    pub(crate) sequence: u32,
    /// The sensors; 0 on the channel that this board does not have.
    pub(crate) sensors: [AdcCode; SENSORS],
    /// [`REFERENCE`].
    pub(crate) vrefint: AdcCode,
    /// Temperature of the die.
    pub(crate) temperature: AdcCode,
    /// When the last conversion ended, in [`stopwatch`] microseconds.
    pub(crate) triggered_us: u32,
    /// The block was written while it was read, or conversions were lost before it: the codes may not belong together.
    pub(crate) torn: bool,
}

/// The newest set, until the control task takes it.
static NEWEST: CriticalSectionMutex<Cell<Option<SampleSet>>> = CriticalSectionMutex::new(Cell::new(None));

/// Takes the newest set, if it has not been taken.
pub(crate) fn take_newest() -> Option<SampleSet> {
    NEWEST.lock(Cell::take)
}

/// Bytes of a block, a power of two.
const BLOCK_BYTES: usize = BLOCK * size_of::<u16>();
const _: () = assert!(BLOCK_BYTES == 32, "the alignment of the blocks is that of their ring");

/// Written by DMA, read by the interrupt. The address of a channel wraps within its block (RP2040 datasheet, 2.5.7, RING_SIZE), whatever the program does: a reset
/// of the core alone leaves the converter and DMA at work, while the start fills the memory.
#[repr(C, align(32))]
struct Blocks(UnsafeCell<[[u16; BLOCK]; 2]>);

// SAFETY: the program only reads, volatile, in one interrupt; any half-word is a valid value.
unsafe impl Sync for Blocks {}

static BLOCKS: Blocks = Blocks(UnsafeCell::new([[0; BLOCK]; 2]));

impl Blocks {
    fn address(&self, block: usize) -> *const u16 {
        self.0.get().cast::<u16>().wrapping_add((block & 1) * BLOCK)
    }

    /// The four conversions of a channel, by its place in the scan.
    fn conversions(&self, block: usize, rank: usize) -> [AdcCode; OVERSAMPLING] {
        let first = self.address(block).wrapping_add(rank);
        // SAFETY: `block`, `scan` and `rank` lie in the blocks; aligned.
        let code = |scan: usize| AdcCode(unsafe { first.wrapping_add(scan * SCAN).read_volatile() });
        [code(0), code(1), code(2), code(3)]
    }
}

/// Sets up converter and DMA, and starts the ticks.
pub(crate) fn start(priority: Priority) {
    embassy_rp::pac::RESETS.reset().modify(|w| {
        w.set_adc(false);
        w.set_dma(false);
    });
    while !(embassy_rp::pac::RESETS.reset_done().read().adc() && embassy_rp::pac::RESETS.reset_done().read().dma()) {}
    BOARD.sensors.iter().for_each(|pin| pin.make_analog());
    DMA.inte(0).write_value(0b11);
    interrupt::DMA_IRQ_0.set_priority(priority);
    // SAFETY: everything that the handler uses is ready, and nothing masks this interrupt by itself.
    unsafe { interrupt::DMA_IRQ_0.enable() };
    begin();
}

/// Starts both DMA channels and the converter: the next conversion is that of the first channel, into block 0.
fn begin() {
    ADC.cs().write_value(Cs(0));
    // What was converted before, and the flags of lost results.
    ADC.fcs().write_value(fifo());
    while !ADC.fcs().read().empty() {
        let _ = ADC.fifo().read();
    }
    ADC.fcs().write(|w| {
        *w = fifo();
        w.set_over(true);
        w.set_under(true);
    });
    ADC.div().write_value(pace());
    for block in 0..2 {
        let channel = DMA.ch(block);
        channel.read_addr().write_value(ADC.fifo().as_ptr() as u32);
        channel.write_addr().write_value(BLOCKS.address(block) as u32);
        channel.trans_count().write_value(BLOCK as u32);
        // Without a trigger: the second channel is started by the first.
        channel.al1_ctrl().write_value(transfer(block).0);
    }
    DMA.ints(0).write_value(0b11);
    DMA.multi_chan_trigger().write(|w| w.set_multi_chan_trigger(0b01));
    // One write enables, another starts: the converter needs a moment in between (RP2040 datasheet, 4.9.3.1).
    let mut on = converting();
    on.set_start_many(false);
    ADC.cs().write_value(on);
    while !ADC.cs().read().ready() {}
    on.set_start_many(true);
    ADC.cs().write_value(on);
}

/// The converter at work: all channels in turn, the first one next.
fn converting() -> Cs {
    let mut w = Cs(0);
    w.set_en(true);
    w.set_ts_en(true);
    w.set_ainsel(CHANNELS[0]);
    w.set_rrobin(CHANNELS.iter().fold(0, |mask, channel| mask | 1 << channel));
    w.set_start_many(true);
    w
}

/// The distance of the conversions, which paces the ticks.
fn pace() -> Div {
    let mut w = Div(0);
    w.set_int((CONVERSION_CYCLES - 1) as u16);
    w
}

/// Whether the converter is as it was started; all of it in each call.
pub(crate) fn is_as_started(_: usize) -> bool {
    // Its channel and its flags change by themselves.
    let (mut now, mut started) = (ADC.cs().read(), converting());
    for w in [&mut now, &mut started] {
        w.set_ainsel(0);
        w.set_ready(false);
        w.set_err(false);
        w.set_err_sticky(false);
    }
    now == started && ADC.div().read() == pace()
}

/// The queue of results: on, each result requests a transfer.
fn fifo() -> Fcs {
    let mut w = Fcs(0);
    w.set_en(true);
    w.set_dreq_en(true);
    w.set_thresh(1);
    w
}

/// The control word of a channel: results of the converter to a block, then the other channel.
fn transfer(block: usize) -> CtrlTrig {
    let mut w = CtrlTrig(0);
    w.set_en(true);
    w.set_high_priority(true);
    w.set_data_size(DataSize::SIZE_HALFWORD);
    w.set_incr_write(true);
    w.set_ring_sel(true);
    w.set_ring_size(BLOCK_BYTES.trailing_zeros() as u8);
    w.set_treq_sel(TreqSel::ADC);
    w.set_chain_to(1 - block as u8 % 2);
    w
}

/// Begins again after a lost result. The control task finds the gap by the time stamps.
fn restart() {
    ADC.cs().write_value(Cs(0));
    for block in 0..2 {
        // Disabled, then aborted (erratum RP2040-E13: the end of an aborted transfer may raise its interrupt).
        DMA.ch(block).al1_ctrl().write_value(0);
    }
    DMA.chan_abort().write(|w| w.set_chan_abort(0b11));
    const ROUNDS: u32 = 1_000;
    let _ = (0..ROUNDS).any(|_| !DMA.ch(0).ctrl_trig().read().busy() && !DMA.ch(1).ctrl_trig().read().busy());
    begin();
}

/// A block is full. Reads and stamps the samples, and makes the interrupt of the control task pending, which does the rest.
#[embassy_rp::interrupt]
fn DMA_IRQ_0() {
    static SEQUENCE: AtomicU32 = AtomicU32::new(0);

    let ended = DMA.ints(0).read() & 0b11;
    DMA.ints(0).write_value(ended);
    let full = match ended {
        0b01 => 0,
        0b10 => 1,
        0 => return,
        // Both: this interrupt was held off for a whole period. The newer one is that whose channel is not running.
        _ => usize::from(DMA.ch(0).ctrl_trig().read().busy()),
    };
    let now_us = stopwatch::now_us();
    let later = (BLOCK as u32).saturating_sub(DMA.ch(1 - full).trans_count().read());
    let code = |rank| trimmed_mean(BLOCKS.conversions(full, rank));
    let sensors = [code(0), code(1), code(2), AdcCode(0)];
    let temperature = code(SCAN - 1);
    let status = ADC.fcs().read();
    let lost = status.over() || status.under();
    // After the results: a block that has become full by now was written to while it was read.
    let torn = ended == 0b11 || lost || DMA.ints(0).read() & 0b11 != 0;
    if lost {
        restart();
    }
    // The only writer is this handler: load and store need not be one.
    let sequence = SEQUENCE.load(Ordering::Relaxed).wrapping_add(1);
    SEQUENCE.store(sequence, Ordering::Relaxed);
    let triggered_us = converted_us(now_us, later);
    let set = SampleSet { sequence, sensors, vrefint: REFERENCE, temperature, triggered_us, torn };
    NEWEST.lock(|newest| newest.set(Some(set)));
    interrupt::SWI_IRQ_0.pend();
}
