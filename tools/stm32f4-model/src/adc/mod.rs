//! ADC1 to ADC3 and their common registers (RM0090 chapter 13): regular and injected groups, triggers, overrun, DMA requests.
//!
//! ```text
//! conversion = (sampling time + bits) ADCCLK cycles, ADCCLK = PCLK2 / (2, 4, 6 or 8)
//! code       = round(V / VDDA * 4095), limited to 0 ..= 4095; a lower resolution drops the low bits
//! ```
//! The voltage is read at the end of the sampling time. A conversion starts at the cycle of its trigger: the latency of up to three ADCCLK
//! cycles and the power-up time after ADON are not modelled.
//!
//! 13.6 calls the trigger of a timer channel its "CC event". The model uses OCxREF while CCxE is set: with EXTEN rising in PWM mode 2
//! that is the compare match.
//!
//! Not modelled, and recorded as lints when selected: discontinuous mode, dual and triple mode.

mod channel;
mod common;
mod faults;
mod registers;

pub use channel::{AdcChannel, Conversion};
pub(crate) use common::AdcCommonRegisters;

// SR.
const AWD: u32 = 1;
const EOC: u32 = 1 << 1;
const JEOC: u32 = 1 << 2;
const JSTRT: u32 = 1 << 3;
const STRT: u32 = 1 << 4;
const OVR: u32 = 1 << 5;
// CR1.
const EOCIE: u32 = 1 << 5;
const AWDIE: u32 = 1 << 6;
const JEOCIE: u32 = 1 << 7;
const SCAN: u32 = 1 << 8;
const AWDSGL: u32 = 1 << 9;
const JAUTO: u32 = 1 << 10;
const JAWDEN: u32 = 1 << 22;
const AWDEN: u32 = 1 << 23;
const OVRIE: u32 = 1 << 26;
// CR2.
const ADON: u32 = 1;
const CONT: u32 = 1 << 1;
const DMA: u32 = 1 << 8;
const DDS: u32 = 1 << 9;
const EOCS: u32 = 1 << 10;
const ALIGN: u32 = 1 << 11;

/// Sampling times by the SMPx field, ADCCLK cycles (13.13.4).
const SAMPLING: [u64; 8] = [3, 15, 28, 56, 84, 112, 144, 480];

/// The two groups of conversions (13.3.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Group {
    Regular,
    Injected,
}

/// External trigger of a group, selected by EXTSEL or JEXTSEL (13.6, tables 66 and 67).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trigger {
    /// Timer, channel 0 to 3.
    Compare(u8, u8),
    /// Timer's TRGO.
    Trgo(u8),
    /// EXTI line.
    Line(u8),
}

const REGULAR_TRIGGERS: [Trigger; 16] = [
    Trigger::Compare(1, 0),
    Trigger::Compare(1, 1),
    Trigger::Compare(1, 2),
    Trigger::Compare(2, 1),
    Trigger::Compare(2, 2),
    Trigger::Compare(2, 3),
    Trigger::Trgo(2),
    Trigger::Compare(3, 0),
    Trigger::Trgo(3),
    Trigger::Compare(4, 3),
    Trigger::Compare(5, 0),
    Trigger::Compare(5, 1),
    Trigger::Compare(5, 2),
    Trigger::Compare(8, 0),
    Trigger::Trgo(8),
    Trigger::Line(11),
];

const INJECTED_TRIGGERS: [Trigger; 16] = [
    Trigger::Compare(1, 3),
    Trigger::Trgo(1),
    Trigger::Compare(2, 0),
    Trigger::Trgo(2),
    Trigger::Compare(3, 1),
    Trigger::Compare(3, 3),
    Trigger::Compare(4, 0),
    Trigger::Compare(4, 1),
    Trigger::Compare(4, 2),
    Trigger::Trgo(4),
    Trigger::Compare(5, 3),
    Trigger::Trgo(5),
    Trigger::Compare(8, 1),
    Trigger::Compare(8, 2),
    Trigger::Compare(8, 3),
    Trigger::Line(15),
];

/// The conversion that is running.
#[derive(Debug, Clone, Copy)]
struct RunningConversion {
    group: Group,
    /// Position in the group, from 0.
    rank: usize,
    channel: u8,
    /// Cycles at which sampling and conversion end.
    sampled_at: u64,
    ends_at: u64,
    code: Option<u16>,
}

/// TimerFeatures of the next event of a converter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AdcEvent {
    /// Sampling of a channel ends; the caller passes the code to [`Adc::sampled`].
    Sample(u8),
    /// A conversion ends; the caller calls [`Adc::finish`].
    Finish,
}

/// State of one converter.
#[derive(Debug, Clone)]
pub(crate) struct Adc {
    /// 0 to 2.
    index: usize,
    sr: u32,
    cr1: u32,
    cr2: u32,
    smpr: [u32; 2],
    jofr: [u32; 4],
    htr: u32,
    ltr: u32,
    sqr: [u32; 3],
    jsqr: u32,
    jdr: [u32; 4],
    dr: u32,
    /// A DMA request is pending.
    dma_pending: bool,
    /// The last transfer of the stream was made with DDS = 0: no further request until the DMA bit is set again.
    dma_finished: bool,
    /// The next regular result is an overrun.
    overrun_forced: bool,
    /// A conversion that has begun does not end.
    is_held: bool,
    /// Bits of the result that are always 0, and bits that are always 1.
    stuck: (u16, u16),
    /// HCLK cycles per ADCCLK cycle; `None`: no clock.
    clock: Option<u64>,
    running: Option<RunningConversion>,
    /// A regular group to start, or to resume at a rank, after the injected one.
    pending_regular: Option<usize>,
}

impl Adc {
    pub(crate) fn new(index: usize) -> Self {
        Adc {
            index,
            sr: 0,
            cr1: 0,
            cr2: 0,
            smpr: [0; 2],
            jofr: [0; 4],
            htr: 0xFFF,
            ltr: 0,
            sqr: [0; 3],
            jsqr: 0,
            jdr: [0; 4],
            dr: 0,
            dma_pending: false,
            dma_finished: false,
            overrun_forced: false,
            is_held: false,
            stuck: (0, 0),
            clock: None,
            running: None,
            pending_regular: None,
        }
    }

    /// Sets the HCLK cycles per ADCCLK cycle; `None`: no clock. A running conversion keeps its times.
    pub(crate) fn set_clock(&mut self, clock: Option<u64>) {
        self.clock = clock;
        if clock.is_none() {
            self.running = None;
        }
    }

    /// Cycle of the next event; `u64::MAX`: none.
    pub(crate) fn next_event(&self) -> u64 {
        match self.running {
            None => u64::MAX,
            Some(_) if self.is_held => u64::MAX,
            Some(RunningConversion { code: None, sampled_at, .. }) => sampled_at,
            Some(running) => running.ends_at,
        }
    }

    /// Cycle of the next event if it can change an interrupt line or request a transfer; otherwise `u64::MAX`.
    pub(crate) fn next_visible(&self) -> u64 {
        let seen = self.cr1 & (EOCIE | JEOCIE | AWDIE | OVRIE) != 0 || self.cr2 & DMA != 0;
        if seen { self.next_event() } else { u64::MAX }
    }

    /// TimerFeatures of the event at [`Adc::next_event`]; `None`: no conversion is running.
    pub(crate) fn due(&self) -> Option<AdcEvent> {
        self.running.map(|running| match running.code {
            None => AdcEvent::Sample(running.channel),
            Some(_) => AdcEvent::Finish,
        })
    }

    /// Sets the 12 bit code at the end of sampling, 0 to 4095.
    pub(crate) fn sampled(&mut self, code: u16) {
        if let Some(running) = &mut self.running {
            running.code = Some(code & !self.stuck.0 | self.stuck.1);
        }
    }

    /// Selected triggers of both groups, each with its group and whether rising and falling edges start it.
    pub(crate) fn triggers(&self) -> [Option<(Group, Trigger, bool, bool)>; 2] {
        let on = self.cr2 & ADON != 0 && self.clock.is_some();
        let wanted =
            |group, exten: u32, trigger| (on && exten != 0).then_some((group, trigger, exten & 1 != 0, exten & 2 != 0));
        // EXTEN: 1 rising, 2 falling, 3 both. 13.3.3: JAUTO excludes an external injected trigger.
        let injected = if self.cr1 & JAUTO != 0 { 0 } else { self.cr2 >> 20 & 3 };
        [
            wanted(Group::Regular, self.cr2 >> 28 & 3, REGULAR_TRIGGERS[(self.cr2 >> 24 & 0xF) as usize]),
            wanted(Group::Injected, injected, INJECTED_TRIGGERS[(self.cr2 >> 16 & 0xF) as usize]),
        ]
    }

    /// Starts a group at a cycle, from software or a trigger, by the priorities of 13.3.9.
    pub(crate) fn start(&mut self, group: Group, cycle: u64) {
        if self.cr2 & ADON == 0 || self.clock.is_none() {
            return;
        }
        match (group, self.running.map(|running| (running.group, running.rank))) {
            // 13.8.1: after an overrun regular triggers are ignored.
            (Group::Regular, _) if self.sr & OVR != 0 => {}
            (Group::Regular, None) => self.begin(Group::Regular, 0, cycle),
            // The regular group starts after the injected one.
            (Group::Regular, Some((Group::Injected, _))) => self.pending_regular = self.pending_regular.or(Some(0)),
            (Group::Injected, None) => self.begin(Group::Injected, 0, cycle),
            // The regular conversion is aborted and repeated after the injected group.
            (Group::Injected, Some((Group::Regular, rank))) => {
                self.pending_regular = Some(rank);
                self.begin(Group::Injected, 0, cycle);
            }
            (Group::Regular, Some((Group::Regular, _))) | (Group::Injected, Some((Group::Injected, _))) => {}
        }
    }

    fn begin(&mut self, group: Group, rank: usize, cycle: u64) {
        let channel = self.channel_at(group, rank);
        let sampling = SAMPLING[self.sampling_field(channel)];
        let clock = self.clock.unwrap_or(1);
        let bits = u64::from(12 - 2 * (self.cr1 >> 24 & 3));
        self.sr |= if group == Group::Regular { STRT } else { JSTRT };
        let sampled_at = cycle + sampling * clock;
        self.running = Some(RunningConversion {
            group,
            rank,
            channel,
            sampled_at,
            ends_at: sampled_at + bits * clock,
            code: None,
        });
    }

    fn sampling_field(&self, channel: u8) -> usize {
        let (register, place) = if channel >= 10 { (0, channel - 10) } else { (1, channel) };
        (self.smpr[register] >> (place * 3) & 7) as usize
    }

    /// Sampling time of a channel, s, at an HCLK frequency in Hz.
    pub(crate) fn sampling_seconds(&self, channel: u8, hclk: f64) -> f64 {
        SAMPLING[self.sampling_field(channel)] as f64 * self.clock.unwrap_or(1) as f64 / hclk
    }

    /// Number of conversions in a group: 1 without SCAN, else L + 1 or JL + 1 (13.3.7).
    fn length(&self, group: Group) -> usize {
        if self.cr1 & SCAN == 0 {
            return 1;
        }
        1 + match group {
            Group::Regular => self.sqr[0] >> 20 & 0xF,
            Group::Injected => self.jsqr >> 20 & 3,
        } as usize
    }

    /// Channel at a position of a group. The injected group ends at JSQ4: with JL + 1 conversions it starts at JSQ(4 - JL) (13.13.12).
    fn channel_at(&self, group: Group, rank: usize) -> u8 {
        let field = match group {
            Group::Regular => self.sqr[2 - (rank / 6).min(2)] >> (rank % 6 * 5),
            Group::Injected => self.jsqr >> ((3 - (self.jsqr >> 20 & 3) as usize + rank) * 5),
        };
        (field & 0x1F) as u8
    }

    /// Ends the running conversion at `cycle`: stores the result, sets flags, starts the next conversion.
    /// Returns the result; `None` on overrun.
    pub(crate) fn finish(&mut self, cycle: u64) -> Option<Conversion> {
        let running = self.running.take()?;
        let resolution = self.cr1 >> 24 & 3;
        let code = running.code.unwrap_or(0) >> (2 * resolution);
        let last = running.rank + 1 >= self.length(running.group);
        let delivered = match running.group {
            Group::Injected => {
                self.store_injected(running.rank, code, resolution);
                true
            }
            Group::Regular => self.store_regular(code, resolution, last),
        };
        self.check_analog_watchdog(running, code, resolution);
        match running.group {
            Group::Injected if last => {
                self.sr |= JEOC;
                if let Some(rank) = self.pending_regular.take() {
                    self.begin(Group::Regular, rank, cycle);
                } else if self.cr1 & JAUTO != 0 && self.cr2 & CONT != 0 && self.sr & OVR == 0 {
                    self.begin(Group::Regular, 0, cycle);
                }
            }
            // 13.8.1: an overrun ends the regular group.
            Group::Regular if !delivered => {}
            Group::Regular if last => {
                if self.cr1 & JAUTO != 0 {
                    self.begin(Group::Injected, 0, cycle);
                } else if self.cr2 & CONT != 0 {
                    self.begin(Group::Regular, 0, cycle);
                }
            }
            group => self.begin(group, running.rank + 1, cycle),
        }
        let channel = AdcChannel { adc: self.index as u8 + 1, channel: running.channel };
        let injected = running.group == Group::Injected;
        delivered.then_some(Conversion { cycle, channel, injected, code })
    }

    /// Stores an injected result: JDRx = code - JOFRx, signed (13.13.11); left-aligned below the sign bits (figure 48).
    fn store_injected(&mut self, rank: usize, code: u16, resolution: u32) {
        let value = i32::from(code) - (self.jofr[rank] & 0xFFF) as i32;
        let shift = match (self.cr2 & ALIGN != 0, resolution) {
            (false, _) => 0,
            (true, 3) => 1,
            (true, resolution) => 3 + 2 * resolution,
        };
        self.jdr[rank] = (value << shift) as u32 & 0xFFFF;
    }

    /// Stores a regular result in DR; false on an overrun, which keeps the old result.
    fn store_regular(&mut self, code: u16, resolution: u32, last: bool) -> bool {
        // 13.8.1, 13.8.2, 13.13.3: with DMA it is an overrun if the last request is not yet served, with EOC after each conversion if
        // EOC is still set.
        let overrun_forced = std::mem::take(&mut self.overrun_forced);
        let lost = match self.cr2 & (DMA | EOCS) {
            0 => false,
            EOCS => overrun_forced || self.sr & EOC != 0,
            _ => overrun_forced || self.dma_pending,
        };
        if lost {
            self.sr |= OVR;
            self.dma_pending = false;
            return false;
        }
        let shift = match (self.cr2 & ALIGN != 0, resolution) {
            (false, _) => 0,
            (true, 3) => 2,
            (true, resolution) => 4 + 2 * resolution,
        };
        self.dr = u32::from(code) << shift;
        if self.cr2 & DMA != 0 && !self.dma_finished {
            self.dma_pending = true;
        }
        if last || self.cr2 & EOCS != 0 {
            self.sr |= EOC;
        }
        true
    }

    /// Checks the analog watchdog (13.3.8); the thresholds apply to all twelve bits.
    fn check_analog_watchdog(&mut self, running: RunningConversion, code: u16, resolution: u32) {
        let enable = if running.group == Group::Regular { AWDEN } else { JAWDEN };
        let guarded = self.cr1 & AWDSGL == 0 || self.cr1 & 0x1F == u32::from(running.channel);
        let full = u32::from(code) << (2 * resolution);
        if self.cr1 & enable != 0 && guarded && (full > self.htr & 0xFFF || full < self.ltr & 0xFFF) {
            self.sr |= AWD;
        }
    }

    /// True while a transfer of DR is requested.
    pub(crate) fn dma_request(&self) -> bool {
        self.dma_pending && self.cr2 & DMA != 0
    }

    /// Ends the DMA request after its transfer. `last`: it was the last of the buffer, after which DDS = 0 makes no more requests (13.8.1).
    pub(crate) fn dma_served(&mut self, last: bool) {
        self.dma_pending = false;
        self.dma_finished |= last && self.cr2 & DDS == 0;
    }

    /// SR.
    pub(crate) fn status(&self) -> u32 {
        self.sr
    }

    /// Level of the interrupt line.
    pub(crate) fn interrupt(&self) -> bool {
        [(EOC, EOCIE), (AWD, AWDIE), (JEOC, JEOCIE), (OVR, OVRIE)]
            .iter()
            .any(|&(flag, enable)| self.sr & flag != 0 && self.cr1 & enable != 0)
    }
}
