//! The hardware that paces everything: TIM2 triggers ADC1 every millisecond, and the end of its two conversions is the interrupt that
//! starts a tick.
//!
//! One injected sequence a tick, sensor first, then the internal reference that tells the supply. Injected results have a register each
//! and need no DMA, so there is no ring to overrun. What can still happen is that the interrupt comes so late that the next sequence has
//! begun: the set is then marked as torn.

use embassy_stm32::Peri;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac::adc::regs::Sr;
use embassy_stm32::pac::adc::vals::{Exten, SampleTime};
use embassy_stm32::pac::adccommon::vals::Adcpre;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::pac::timer::vals::Mms;
use embassy_stm32::pac::{ADC1, ADC123_COMMON, GPIOA, RCC, TIM2};
use embassy_stm32::peripherals;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use firmware::pacing::{PERIOD_US, trigger_us};
use joint_units::AdcCode;

use crate::board::Pin;
use crate::clocks::{self, APB1_TIMER_MHZ};
use crate::stopwatch;

const SENSOR_PIN: Pin = Pin { port: GPIOA, number: 1 };
const SENSOR_CHANNEL: u8 = 1;
const VREFINT_CHANNEL: u8 = 17;
/// TIM2_TRGO as the trigger of the injected group (RM0090 table 70, RM0390 table 62).
const INJECTED_TRIGGER_TIM2: u8 = 3;

/// The two conversions take (144 + 12) + (480 + 12) cycles of 21 MHz, 30.9 us; a result cannot be there before this.
const SHORTEST_CONVERSION_US: u32 = 25;

/// Factory reading of the internal reference at 3.3 V and 30 degrees Celsius, in system memory (data sheets, "Embedded reference
/// voltage").
const VREFINT_CAL: *const u16 = 0x1FFF_7A2A as *const u16;

/// What one trigger delivered.
#[derive(Clone, Copy)]
pub(crate) struct SampleSet {
    /// Counts the sets.
    pub(crate) sequence: u32,
    /// Gait sensor.
    pub(crate) sensor: AdcCode,
    /// Internal reference.
    pub(crate) vrefint: AdcCode,
    /// When it was triggered, in [`stopwatch`] microseconds.
    pub(crate) triggered_us: u32,
    /// The next sequence had begun before this one was read, or a conversion was lost: the two codes may not belong together.
    pub(crate) torn: bool,
}

/// The newest set, from the interrupt to the sensor task.
pub(crate) static NEWEST: Signal<CriticalSectionRawMutex, SampleSet> = Signal::new();

/// The factory's reading of the internal reference.
pub(crate) fn vrefint_calibration() -> AdcCode {
    // SAFETY: system memory of both chips, always mapped, aligned, never written.
    AdcCode(unsafe { VREFINT_CAL.read_volatile() })
}

/// Sets up trigger and converter, and lets the ticks begin.
pub(crate) fn start(
    _converter: Peri<'static, peripherals::ADC1>,
    _pacer: Peri<'static, peripherals::TIM2>,
    priority: Priority,
) {
    RCC.apb1enr().modify(|w| w.set_tim2en(true));
    RCC.apb2enr().modify(|w| w.set_adc1en(true));
    clocks::settle();

    // The update that loads the divider is a trigger too, so it comes before the converter listens.
    TIM2.psc().write_value(APB1_TIMER_MHZ - 1);
    TIM2.arr().write_value(PERIOD_US - 1);
    TIM2.egr().write(|w| w.set_ug(true));
    TIM2.cr2().write(|w| w.set_mms(Mms::UPDATE));

    SENSOR_PIN.set_mode(Moder::ANALOG);
    ADC123_COMMON.ccr().write(|w| {
        // 84 MHz / 4 = 21 MHz; 36 MHz are allowed.
        w.set_adcpre(Adcpre::DIV4);
        w.set_tsvrefe(true);
    });
    ADC1.smpr2().write(|w| w.set_smp(SENSOR_CHANNEL as usize, SampleTime::CYCLES144));
    // The reference wants 10 us at least: 480 / 21 MHz = 22.9 us.
    ADC1.smpr1().write(|w| w.set_smp(VREFINT_CHANNEL as usize - 10, SampleTime::CYCLES480));
    ADC1.jsqr().write(|w| {
        // A sequence of two is taken from the upper end: JSQ3, JSQ4 (RM0090 13.13.12), results in JDR1, JDR2.
        w.set_jl(1);
        w.set_jsq(2, SENSOR_CHANNEL);
        w.set_jsq(3, VREFINT_CHANNEL);
    });
    ADC1.cr1().write(|w| {
        w.set_scan(true);
        w.set_jeocie(true);
    });
    ADC1.cr2().write(|w| {
        w.set_jextsel(INJECTED_TRIGGER_TIM2);
        w.set_jexten(Exten::RISING_EDGE);
        w.set_adon(true);
    });

    interrupt::ADC.set_priority(priority);
    // SAFETY: everything that the handler touches is ready, and nothing masks this interrupt by itself.
    unsafe { interrupt::ADC.enable() };

    // The first trigger comes a period from here: the converter wants 3 us to wake up, the reference 10.
    TIM2.cr1().write(|w| w.set_cen(true));
}

/// End of an injected sequence. Reads, stamps, hands over; everything else is the sensor task's.
#[cfg(target_os = "none")]
#[embassy_stm32::interrupt]
fn ADC() {
    on_sequence_end();
}

fn on_sequence_end() {
    use core::sync::atomic::{AtomicU32, Ordering};
    /// The flags of the status register; the rest is reserved.
    const FLAGS: u32 = 0x3F;
    static SEQUENCE: AtomicU32 = AtomicU32::new(0);

    let since_trigger_us = TIM2.cnt().read();
    let now_us = stopwatch::now_us();
    let status = ADC1.sr().read();
    // Cleared by writing 0, before the results are read: whatever is set afterwards is of the next sequence.
    ADC1.sr().write_value(Sr(!status.0 & FLAGS));
    if !status.jeoc() {
        return;
    }
    let sensor = AdcCode(ADC1.jdr(0).read().jdata());
    let vrefint = AdcCode(ADC1.jdr(1).read().jdata());
    let torn = ADC1.sr().read().jstrt() || status.ovr();

    // The only writer is this handler: load and store need not be one.
    let sequence = SEQUENCE.load(Ordering::Relaxed).wrapping_add(1);
    SEQUENCE.store(sequence, Ordering::Relaxed);
    let triggered_us = trigger_us(now_us, since_trigger_us, SHORTEST_CONVERSION_US);
    NEWEST.signal(SampleSet { sequence, sensor, vrefint, triggered_us, torn });
}
