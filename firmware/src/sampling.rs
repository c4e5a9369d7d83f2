//! Sampling: TIM2 triggers ADC1 four times a millisecond, DMA2 collects the scans, and the interrupt at the end of the fourth scan starts a
//! tick.
//!
//! ```text
//! TIM2, 4 kHz     |         |         |         |
//! ADC1 scan       [s v t]   [s v t]   [s v t]   [s v t]        sensors, reference, temperature
//! DMA2 stream 0   -> block 0 or block 1, in turn        ^ transfer complete: the tick of this trigger
//! ```
//! A block is read while the other is filled, so there is a whole millisecond for it. Each channel's four conversions become one code
//! by [`hgod_adc::trimmed_means_of_two`]. Two errors are reported as a fault of their tick:
//! - the interrupt comes more than a millisecond late: the block may be written while it is read, and the set is marked as torn;
//! - a result is lost (overrun of the converter) or the transfer fails: both stop the hardware, and [`restart`] synchronises it again, at the same
//!   place in the servo frames.

use core::cell::{Cell, UnsafeCell};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use embassy_stm32::interrupt::{self, InterruptExt, Priority};
#[cfg(feature = "black-pill-f411")]
use embassy_stm32::pac::ADC1_COMMON as ADC_COMMON;
#[cfg(not(feature = "black-pill-f411"))]
use embassy_stm32::pac::ADC123_COMMON as ADC_COMMON;
use embassy_stm32::pac::adc::regs::Sr;
use embassy_stm32::pac::adc::vals::{Dds, Exten, SampleTime};
use embassy_stm32::pac::adccommon::vals::Adcpre;
use embassy_stm32::pac::dma::regs::Ixr;
use embassy_stm32::pac::dma::vals::{Ct, Pl, Size};
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::pac::timer::vals::Mms;
use embassy_stm32::pac::{ADC1, DMA2, RCC, TIM2};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use firmware::board::{ADC_DIVIDER, BOARD, REFERENCE_CAL, REFERENCE_CHANNEL, TEMPERATURE_CAL};
use firmware::timing::{TRIGGER_US, trigger_us};
use firmware_shared::pacing::PERIOD_US;
use hgod_adc::{OVERSAMPLING, trimmed_means_of_two};
use joint_loop::SENSORS;
use joint_units::AdcCode;

use crate::clocks::{self, APB1_TIMER_MHZ};
use crate::pins::PinRegisters;
use crate::servo_pwm::{TRIGGER_PHASE_US, frame_us};
use crate::stopwatch;

const _: () = assert!(BOARD.sensors.len() == SENSORS, "one input for each channel of the loop");

/// Conversions of one trigger: the sensors, the internal reference, the temperature.
const SCAN: usize = SENSORS + 2;
/// Items of one transfer.
const BLOCK: usize = SCAN * OVERSAMPLING;

/// TIM2_TRGO as the trigger of the regular group (RM0090 table 69, RM0383 11.6, RM0390 table 61).
const REGULAR_TRIGGER_TIM2: u8 = 6;

/// 21 or 25 MHz; 36 MHz are allowed.
const ADC_MHZ: u32 = BOARD.clocks.adc_mhz() as u32;
const _: () = assert!(ADC_DIVIDER == 4, "the divider that `start` writes");
/// A conversion is its sampling time and 12 cycles. Sensors 144 + 12 cycles, 7.4 us each at 21 MHz; the two internal channels need at
/// least 10 us of sampling and get 480 cycles, 22.9 us: 77 us in all, 64 us at 25 MHz.
const SCAN_CYCLES: u32 = SENSORS as u32 * (144 + 12) + 2 * (480 + 12);
/// Microseconds from a trigger to the end of its scan, rounded down.
const SCAN_US: u32 = SCAN_CYCLES / ADC_MHZ;
const _: () = assert!(2 * SCAN_US < TRIGGER_US, "a scan is over long before the next trigger");

/// DMA2 stream 0, channel 0 belongs to ADC1 (RM0090 table 43, RM0383 9.3.3, RM0390 table 29).
const STREAM: usize = 0;
const CHANNEL: u8 = 0;

/// Result of the four scans of a millisecond.
#[derive(Clone, Copy)]
pub(crate) struct SampleSet {
    /// Number of the set.
    pub(crate) sequence: u32,
    /// The sensors.
    pub(crate) sensors: [AdcCode; SENSORS],
    /// Internal reference.
    pub(crate) vrefint: AdcCode,
    /// Temperature of the die.
    pub(crate) temperature: AdcCode,
    /// When the last of the four was triggered, in [`stopwatch`] microseconds.
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

type Block = [[u16; SCAN]; OVERSAMPLING];

const _: () = assert!(SCAN.is_multiple_of(2), "a scan is whole words");

/// Written by DMA, read by the interrupt, by words.
#[repr(C, align(4))]
struct Blocks(UnsafeCell<[Block; 2]>);

// SAFETY: the program only reads, volatile, in one interrupt; any half-word is a valid value.
unsafe impl Sync for Blocks {}

static BLOCKS: Blocks = Blocks(UnsafeCell::new([[[0; SCAN]; OVERSAMPLING]; 2]));

impl Blocks {
    fn address(&self, block: usize) -> *const [u16; SCAN] {
        self.0.get().cast::<Block>().wrapping_add(block).cast()
    }

    /// The codes of two channels, by the place of the first one in the scan, which is even.
    fn codes(&self, block: usize, first: usize) -> [AdcCode; 2] {
        let first = self.address(block).cast::<u32>().wrapping_add(first / 2);
        // SAFETY: `block` is 0 or 1, `scan` and `first` lie in a block; aligned, as a block and a scan are whole words.
        let words = |scan: usize| unsafe { first.wrapping_add(scan * (SCAN / 2)).read_volatile() };
        // One by one: optimised for size, the compiler makes a loop of a function over an array, three times as long. The converter has 12 bits.
        trimmed_means_of_two([words(0), words(1), words(2), words(3)])
    }
}

/// Conversions were lost since the last set.
static LOST: AtomicBool = AtomicBool::new(false);

/// The factory's code of the internal reference.
pub(crate) fn reference_calibration() -> AdcCode {
    factory_code(REFERENCE_CAL)
}

/// The factory's codes of the temperature sensor, at 30 and 110 degrees.
pub(crate) fn temperature_calibration() -> [AdcCode; 2] {
    TEMPERATURE_CAL.map(factory_code)
}

fn factory_code(address: u32) -> AdcCode {
    // SAFETY: a half-word of the system memory of these chips: always mapped, aligned, never written.
    AdcCode(unsafe { (address as *const u16).read_volatile() })
}

/// Sets up trigger, converter and transfer, and starts the ticks.
pub(crate) fn start(priority: Priority) {
    RCC.apb1enr().modify(|w| w.set_tim2en(true));
    RCC.apb2enr().modify(|w| w.set_adc1en(true));
    RCC.ahb1enr().modify(|w| w.set_dma2en(true));
    clocks::settle();

    // The update that loads the divider is a trigger too, so it comes before the converter waits for one.
    TIM2.psc().write_value(APB1_TIMER_MHZ - 1);
    TIM2.arr().write_value(TRIGGER_US - 1);
    TIM2.egr().write(|w| w.set_ug(true));
    TIM2.cr2().write(|w| w.set_mms(Mms::UPDATE));

    ADC_COMMON.ccr().write(|w| {
        w.set_adcpre(Adcpre::DIV4);
        w.set_tsvrefe(true);
    });
    ADC1.sqr1().write(|w| w.set_l(SCAN as u8 - 1));
    for (rank, input) in BOARD.sensors.into_iter().enumerate() {
        input.pin.set_mode(Moder::ANALOG);
        put_in_scan(rank, input.channel, SampleTime::CYCLES144);
    }
    put_in_scan(SENSORS, REFERENCE_CHANNEL, SampleTime::CYCLES480);
    put_in_scan(SENSORS + 1, BOARD.temperature_channel, SampleTime::CYCLES480);
    ADC1.cr1().write(|w| {
        w.set_scan(true);
        w.set_ovrie(true);
    });
    let stream = DMA2.st(STREAM);
    stream.par().write_value(ADC1.dr().as_ptr() as u32);
    stream.m0ar().write_value(BLOCKS.address(0) as u32);
    stream.m1ar().write_value(BLOCKS.address(1) as u32);
    begin();

    for interrupt in [interrupt::ADC, interrupt::DMA2_STREAM0] {
        interrupt.set_priority(priority);
        // SAFETY: everything that the handlers use is ready, and nothing masks these interrupts by itself.
        unsafe { interrupt.enable() };
    }

    // The first trigger is a quarter of a period later: the converter needs 3 us to start, the internal channels 10.
    TIM2.cr1().write(|w| w.set_cen(true));

    for (part, written) in WRITTEN.iter().enumerate() {
        for (register, written) in registers(part).into_iter().zip(written) {
            written.store(register, Ordering::Relaxed);
        }
    }
}

/// Puts a channel at a place of the scan, the first is 0.
fn put_in_scan(rank: usize, channel: u8, sampling: SampleTime) {
    // SQ1 to SQ6 are in SQR3: no scan here is longer.
    ADC1.sqr3().modify(|w| w.set_sq(rank, channel));
    let channel = usize::from(channel);
    if channel < 10 {
        ADC1.smpr2().modify(|w| w.set_smp(channel, sampling));
    } else {
        ADC1.smpr1().modify(|w| w.set_smp(channel - 10, sampling));
    }
}

/// Starts stream and converter: the next trigger writes the first channel to block 0.
fn begin() {
    let stream = DMA2.st(STREAM);
    stream.ndtr().write(|w| w.set_ndt(BLOCK as u16));
    clear(all_flags());
    stream.cr().write(|w| {
        w.set_chsel(CHANNEL);
        w.set_dbm(true);
        w.set_circ(true);
        w.set_minc(true);
        w.set_psize(Size::BITS16);
        w.set_msize(Size::BITS16);
        w.set_pl(Pl::VERY_HIGH);
        w.set_tcie(true);
        w.set_teie(true);
        w.set_dmeie(true);
        w.set_en(true);
    });
    ADC1.cr2().write(|w| {
        w.set_extsel(REGULAR_TRIGGER_TIM2);
        w.set_exten(Exten::RISING_EDGE);
        w.set_dma(true);
        w.set_dds(Dds::CONTINUOUS);
        w.set_adon(true);
    });
}

/// Restarts converter and stream in step (RM0090 13.8.1): after a lost result or a failed transfer both have stopped, perhaps in the middle
/// of a scan. The ticks come at their place in the servo frames again.
fn restart() {
    /// A stream finishes the current transfer before it is off: a few bus cycles.
    const ROUNDS: u32 = 100;
    LOST.store(true, Ordering::Relaxed);
    ADC1.cr2().write(|_| {});
    ADC1.sr().write_value(Sr(0));
    let stream = DMA2.st(STREAM);
    stream.cr().modify(|w| w.set_en(false));
    // If the stream does not stop, there are no ticks, and the watchdog task reports the sampling.
    if (0..ROUNDS).any(|_| !stream.cr().read().en()) {
        realign();
        begin();
    }
}

/// Lengthens the present period of the trigger by as many quarters as it takes for the fourth trigger from now to come at
/// [`TRIGGER_PHASE_US`].
fn realign() {
    /// The next trigger must not come before the converter waits for it, which takes it 3 us.
    const SOONEST_US: u32 = 10;
    const ROUNDS: u32 = 10_000;
    let _ = (0..ROUNDS).any(|_| TIM2.cnt().read() % TRIGGER_US < TRIGGER_US - SOONEST_US);
    let counted_us = TIM2.cnt().read();
    // If the next trigger came as soon as possible, the fourth one would come four quarters after the beginning of this quarter.
    let phase_us = (PERIOD_US + frame_us() - counted_us % TRIGGER_US) % PERIOD_US;
    let wait_us = (PERIOD_US + TRIGGER_PHASE_US - phase_us) % PERIOD_US;
    let quarters = (wait_us + TRIGGER_US / 2) / TRIGGER_US % OVERSAMPLING as u32;
    // The period may have been lengthened already, by a failure shortly before: never below what is counted.
    let begun = counted_us / TRIGGER_US;
    // Without buffering the longer period is in effect at once; with it, the next one is as long as ever.
    TIM2.cr1().modify(|w| w.set_arpe(false));
    TIM2.arr().write_value((begun + quarters + 1) * TRIGGER_US - 1);
    TIM2.cr1().modify(|w| w.set_arpe(true));
    TIM2.arr().write_value(TRIGGER_US - 1);
}

/// Parts of the registers, one of which is compared in a tick: reads of peripherals take time.
const PARTS: usize = 4;

/// The registers as they were after the start.
static WRITTEN: [[AtomicU32; 4]; PARTS] = [const { [const { AtomicU32::new(0) }; 4] }; PARTS];

/// What decides when a tick comes and what its codes are: the trigger, the converter, the stream, and what is left of the first two. Bits that change by
/// themselves are left out, and so is the buffering of the trigger's period, which [`realign`] switches on.
fn registers(part: usize) -> [u32; 4] {
    const ARPE: u32 = 1 << 7;
    /// The stream is off after a failed transfer, until its interrupt starts it again; CT is the block that is being filled.
    const EN_CT: u32 = 1 | 1 << 19;
    let stream = DMA2.st(STREAM);
    match part {
        0 => [TIM2.cr1().read().0 & !ARPE, TIM2.cr2().read().0, TIM2.psc().read().into(), TIM2.arr().read()],
        1 => [ADC1.cr1().read().0, ADC1.cr2().read().0, ADC1.sqr1().read().0, ADC1.sqr3().read().0],
        2 => [stream.cr().read().0 & !EN_CT, stream.par().read(), stream.m0ar().read(), stream.m1ar().read()],
        _ => [TIM2.smcr().read().0, ADC1.smpr1().read().0, ADC1.smpr2().read().0, ADC_COMMON.ccr().read().0],
    }
}

/// Whether trigger, converter and stream are configured as they were started; a quarter of it, another one in each call. With another period of the
/// trigger the joints run at another speed than the servo frames; a stream that writes elsewhere changes variables.
pub(crate) fn is_as_started(call: usize) -> bool {
    let part = call % PARTS;
    registers(part).iter().zip(&WRITTEN[part]).all(|(now, written)| *now == written.load(Ordering::Relaxed))
}

/// The flags of the stream.
fn all_flags() -> Ixr {
    let mut flags = Ixr(0);
    flags.set_tcif(STREAM, true);
    flags.set_htif(STREAM, true);
    flags.set_teif(STREAM, true);
    flags.set_dmeif(STREAM, true);
    flags.set_feif(STREAM, true);
    flags
}

fn clear(flags: Ixr) {
    DMA2.ifcr(STREAM / 4).write_value(flags);
}

/// A block is full, or the transfer has failed. Reads and stamps the samples, and makes the interrupt of the control task pending, which does the rest.
#[cfg(target_os = "none")]
#[embassy_stm32::interrupt]
fn DMA2_STREAM0() {
    on_block_end();
}

/// A result was lost.
#[cfg(target_os = "none")]
#[embassy_stm32::interrupt]
fn ADC() {
    on_overrun();
}

fn on_overrun() {
    if ADC1.sr().read().ovr() {
        restart();
    }
}

fn on_block_end() {
    static SEQUENCE: AtomicU32 = AtomicU32::new(0);

    let since_trigger_us = TIM2.cnt().read();
    let now_us = stopwatch::now_us();
    let stream = DMA2.st(STREAM);
    let status = DMA2.isr(STREAM / 4).read();
    clear(all_flags());
    if status.teif(STREAM) || status.dmeif(STREAM) {
        restart();
        return;
    }
    if !status.tcif(STREAM) {
        return;
    }
    // The current target is the block that is not full.
    let full = match stream.cr().read().ct() {
        Ct::MEMORY0 => 1,
        Ct::MEMORY1 => 0,
    };
    // Scans of the next block that are in memory already: none, unless this interrupt was held off.
    let scans_since = (BLOCK as u32).saturating_sub(stream.ndtr().read().ndt().into()) / SCAN as u32;
    let ([a, b], [c, d]) = (BLOCKS.codes(full, 0), BLOCKS.codes(full, 2));
    let sensors: [AdcCode; SENSORS] = [a, b, c, d];
    let [vrefint, temperature] = BLOCKS.codes(full, SENSORS);
    // After the results: a block that has become full by now was written to while it was read.
    let torn = DMA2.isr(STREAM / 4).read().tcif(STREAM) || LOST.swap(false, Ordering::Relaxed);

    // The only writer is this handler: load and store need not be one.
    let sequence = SEQUENCE.load(Ordering::Relaxed).wrapping_add(1);
    SEQUENCE.store(sequence, Ordering::Relaxed);
    let triggered_us = trigger_us(now_us, since_trigger_us, scans_since, SCAN_US);
    let set = SampleSet { sequence, sensors, vrefint, temperature, triggered_us, torn };
    NEWEST.lock(|newest| newest.set(Some(set)));
    interrupt::I2C1_EV.pend();
}
