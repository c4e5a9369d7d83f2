//! Puts what the control task left in its queues on the wire. The format strings here are a contract with the parser of the host tool:
//! a change here is a change there.
//!
//! ```text
//! boot {board} {chip} reset {cause} streak {n} vrefint_cal {code} min_supply {volts} sensor {required|ignored} walker {crc}
//!      sensors {crc} outputs {servos|shadow}                    once, in one line
//! state {tick} {state} cause {cause}                            at every change that a reported frame shows
//! inputs {first tick} {count} {sensor} ... {vrefint} {elapsed} {flags} {sensor} ...    every tick's inputs, ten a line
//! follow {tick} {state} fault {fault} stride {} s off {} deg confidence {}    after each tick line of a walker that follows a sensor
//! edge {tick} {offset} us {level}                               each edge at the synchronisation input; `edges lost {tick}` before one if so
//! tick {n} {state} sensor {} deg {verdict} ... set {} {} {} {} deg pulse {} {} {} {} us late {} missed {} limited {} seq {} hash {}
//! cost {longest tick} cycles dropped {records}                once a second
//! margin start {latest} us stack {deepest} of {size} bytes      once a second
//! env {die} C supply {volts} V                                  once a second, the means of the second
//! ```
//!
//! The log is written without waiting: a frame that does not fit into the ring is dropped whole. A drop shows as a gap of `seq` (one
//! `tick` line is ten ticks) and of the first tick of an `inputs` line.

use embassy_time::Timer;
use firmware::liveness::FEED_US;
use heapless::Vec;
use heapless::spsc::Consumer;
use joint_loop::{Cause, Frame, SENSORS, SupervisorState};

use super::TELEMETRY;
use super::control::{SyncEdge, TICKS_A_FRAME, TickInputs, dropped, take_worst};
use crate::climate::Climate;

/// How often the queues are looked at. Well inside the watchdog's question, which wants progress each time.
const ROUND_US: u32 = 2_000;
const _: () = assert!(2 * ROUND_US < FEED_US, "the watchdog has to see a round each time");
const ROUNDS_A_SECOND: u32 = 1_000_000 / ROUND_US;

pub(crate) struct Telemetry {
    pub(crate) inputs: Consumer<'static, TickInputs>,
    pub(crate) frames: Consumer<'static, Frame<SENSORS>>,
    pub(crate) edges: Consumer<'static, SyncEdge>,
    /// Sensors that are worn: the first channels.
    pub(crate) sensors: usize,
    pub(crate) line: Vec<TickInputs, { TICKS_A_FRAME as usize }>,
    pub(crate) climate: Climate,
    pub(crate) rounds: u32,
    /// SupervisorState and cause of the last frame.
    pub(crate) shown: Option<(SupervisorState, Cause)>,
}

/// Comes round every [`ROUND_US`].
#[embassy_executor::task]
pub(crate) async fn telemetry_task(mut telemetry: Telemetry) -> ! {
    loop {
        telemetry_step(&mut telemetry);
        Timer::after_micros(ROUND_US.into()).await;
    }
}

/// Empties the queues.
#[inline(never)]
#[cfg_attr(target_os = "none", unsafe(no_mangle))]
fn telemetry_step(telemetry: &mut Telemetry) {
    while let Some(inputs) = telemetry.inputs.dequeue() {
        telemetry.take(inputs);
    }
    while let Some(frame) = telemetry.frames.dequeue() {
        if telemetry.shown.replace((frame.state, frame.cause)) != Some((frame.state, frame.cause)) {
            wire::state(&frame);
        }
        wire::tick(&frame);
        if let Some(following) = &frame.following {
            wire::follow(frame.tick, following);
        }
    }
    while let Some(edge) = telemetry.edges.dequeue() {
        wire::edge(&edge);
    }
    telemetry.rounds += 1;
    if telemetry.rounds == ROUNDS_A_SECOND {
        telemetry.rounds = 0;
        wire::cost(take_worst(), dropped());
        wire::env(telemetry.climate.take());
    }
    TELEMETRY.count();
}

impl Telemetry {
    /// Collects a line of successive ticks; after a gap a new line begins.
    fn take(&mut self, inputs: TickInputs) {
        let follows = self.line.last().is_none_or(|last| inputs.tick == last.tick.wrapping_add(inputs.elapsed.into()));
        if !follows {
            self.flush();
        }
        // Never full here: a full line has been flushed.
        let _ = self.line.push(inputs);
        if self.line.is_full() {
            self.flush();
        }
    }

    fn flush(&mut self) {
        if let Some(first) = self.line.first() {
            wire::inputs(first.tick, &self.line, self.sensors);
        }
        self.line.clear();
    }
}

/// The lines themselves.
#[cfg(target_os = "none")]
pub(crate) mod wire {
    use cpg_core::entrainment::FollowStatus;
    use defmt::{Format, Formatter, Str, intern};
    use firmware::liveness::Part;
    use firmware::post_mortem::{Cause as CrashCause, LOCKOUT_STREAK};
    use joint_loop::setup::default_loop::Parameters;
    use joint_loop::store::{generator_record, sensor_record};
    use joint_loop::{Frame, SENSORS};
    use joint_units::{AdcCode, Celsius, Volts};

    use super::{SyncEdge, TickInputs};
    use crate::board::BOARD;
    use crate::faults::{LastRun, Reset};
    use crate::{SENSOR_REQUIRED, SHADOW};

    // Seconds of ticks: this clock exists before the hardware ones do.
    defmt::timestamp!("{=u32:ms}", crate::tasks::ticks());

    pub(crate) fn boot(last: &LastRun, vrefint_cal: AdcCode, parameters: &Parameters) {
        let sensor = if SENSOR_REQUIRED { intern!("required") } else { intern!("ignored") };
        let outputs = if SHADOW { intern!("shadow") } else { intern!("servos") };
        defmt::info!(
            "boot {=str} {=str} reset {=istr} streak {=u32} vrefint_cal {=u16} min_supply {=f32} sensor {=istr} walker {=u32:08x} \
             sensors {=u32:08x} outputs {=istr}",
            BOARD.name,
            BOARD.chip,
            reset(last.reset),
            last.streak,
            vrefint_cal.0,
            BOARD.min_supply.0,
            sensor,
            generator_record::record_of(&parameters.generator).crc(),
            sensor_record::record_of(&parameters.sensors).crc(),
            outputs
        );
        crash(last);
        if crate::clocks::brown_out_reset_is_off() {
            // An option byte, which only a person with a probe should write.
            defmt::warn!(
                "brown-out reset is off in the option bytes: a servo that pulls the supply down is not met by a reset"
            );
        }
        if last.streak >= LOCKOUT_STREAK {
            defmt::error!("{=u32} crashes in a row: not to be armed before power off or the reset button", last.streak);
        }
    }

    fn crash(last: &LastRun) {
        let Some(crash) = &last.crash else { return };
        let [first, second] = crash.details;
        let cause = crash.cause.name();
        match crash.cause {
            CrashCause::Panic => {
                defmt::error!("last run ended by {=str} in {=str} line {=u32}", cause, crash.text(), first)
            }
            CrashCause::HardFault => {
                defmt::error!("last run ended by {=str} at pc {=u32:#x} cfsr {=u32:#x}", cause, first, second)
            }
            CrashCause::StackOverflow => {
                defmt::error!("last run ended by {=str} at sp {=u32:#x} cfsr {=u32:#x}", cause, first, second)
            }
            CrashCause::Stalled | CrashCause::Racing => {
                let part = Part::from_number(first).map_or("?", Part::name);
                defmt::error!("last run ended by {=str} task {=str}", cause, part);
            }
            CrashCause::UnexpectedInterrupt => defmt::error!("last run ended by {=str} {=u32}", cause, first),
            CrashCause::None | CrashCause::ClockFailure | CrashCause::NonMaskable => {
                defmt::error!("last run ended by {=str}", cause)
            }
        }
    }

    /// The crystal is dead: said once, and nothing else happens.
    pub(crate) fn no_hse() {
        defmt::error!("no 8 MHz from HSE; staying dark");
    }

    /// The loop refused its configuration.
    pub(crate) fn refused(why: impl core::fmt::Display) {
        defmt::error!("configuration refused: {}; staying dark", defmt::Display2Format(&why));
    }

    pub(super) fn tick(frame: &Frame<SENSORS>) {
        let [set_lh, set_rh, set_lk, set_rk] = frame.setpoints;
        let [pulse_lh, pulse_rh, pulse_lk, pulse_rk] = frame.pulses;
        defmt::info!(
            "tick {=u32} {=str}{} set {=f32} {=f32} {=f32} {=f32} deg \
             pulse {=u16} {=u16} {=u16} {=u16} us late {=u32} missed {=u32} limited {=u8} seq {=u32} hash {=u64:016x}",
            frame.tick,
            frame.state.name(),
            Ears(frame),
            set_lh.degrees(),
            set_rh.degrees(),
            set_lk.degrees(),
            set_rk.degrees(),
            pulse_lh.0,
            pulse_rh.0,
            pulse_lk.0,
            pulse_rk.0,
            frame.late,
            frame.missed,
            frame.limited.bits(),
            frame.seq,
            frame.setpoint_hash
        );
    }

    pub(super) fn state(frame: &Frame<SENSORS>) {
        defmt::info!("state {=u32} {=str} cause {=str}", frame.tick, frame.state.name(), frame.cause.name());
    }

    pub(super) fn follow(tick: u32, status: &FollowStatus) {
        defmt::info!(
            "follow {=u32} {=str} fault {=str} stride {=f32} s off {=f32} deg confidence {=f32}",
            tick,
            status.state.name(),
            status.fault.map_or("none", |fault| fault.name()),
            status.stride_s,
            status.phase_error.degrees(),
            status.confidence
        );
    }

    pub(super) fn edge(edge: &SyncEdge) {
        if edge.flooded {
            defmt::warn!("edges lost {=u32}", edge.tick);
        }
        defmt::info!("edge {=u32} {=i32} us {=u8}", edge.tick, edge.offset_us, u8::from(edge.high));
    }

    pub(super) fn inputs(first_tick: u32, line: &[TickInputs], worn: usize) {
        // The line holds ten at most.
        defmt::info!("inputs {=u32} {=u8}{}", first_tick, line.len() as u8, Groups(line, worn));
    }

    pub(super) fn cost((longest_cycles, latest_start_us): (u32, u32), dropped: u32) {
        defmt::info!("cost {=u32} cycles dropped {=u32}", longest_cycles, dropped);
        let (used, size) = crate::stack::high_water();
        defmt::info!("margin start {=u32} us stack {=usize} of {=usize} bytes", latest_start_us, used, size);
    }

    pub(super) fn env((die, supply): (Celsius, Volts)) {
        defmt::info!("env {=f32} C supply {=f32} V", die.0, supply.0);
    }

    struct Ears<'a>(&'a Frame<SENSORS>);

    impl Format for Ears<'_> {
        fn format(&self, to: Formatter<'_>) {
            for (measured, verdict) in self.0.measured.iter().zip(&self.0.validity) {
                if let Some(verdict) = verdict {
                    defmt::write!(to, " sensor {=f32} deg {=str}", measured.degrees(), verdict.name());
                }
            }
        }
    }

    struct Groups<'a>(&'a [TickInputs], usize);

    impl Format for Groups<'_> {
        fn format(&self, to: Formatter<'_>) {
            for tick in self.0 {
                for sensor in tick.sensors.iter().take(self.1) {
                    defmt::write!(to, " {=u16}", sensor.0);
                }
                defmt::write!(to, " {=u16} {=u8} {=u16}", tick.vrefint.0, tick.elapsed, tick.flags);
            }
        }
    }

    fn reset(reset: Reset) -> Str {
        match reset {
            Reset::PowerOn => intern!("power_on"),
            Reset::BrownOut => intern!("brown_out"),
            Reset::IndependentWatchdog => intern!("iwdg"),
            Reset::WindowWatchdog => intern!("wwdg"),
            Reset::Software => intern!("software"),
            Reset::LowPower => intern!("low_power"),
            Reset::Pin => intern!("pin"),
        }
    }
}

/// The host has no wire: it only checks the types.
#[cfg(not(target_os = "none"))]
pub(crate) mod wire {
    use cpg_core::entrainment::FollowStatus;
    use joint_loop::{Frame, SENSORS};
    use joint_units::{Celsius, Volts};

    use super::{SyncEdge, TickInputs};

    pub(super) fn tick(_frame: &Frame<SENSORS>) {}
    pub(super) fn follow(_tick: u32, _status: &FollowStatus) {}
    pub(super) fn edge(_edge: &SyncEdge) {}
    pub(super) fn state(_frame: &Frame<SENSORS>) {}
    pub(super) fn inputs(_first_tick: u32, _line: &[TickInputs], _worn: usize) {}
    pub(super) fn cost(_worst: (u32, u32), _dropped: u32) {}
    pub(super) fn env(_means: (Celsius, Volts)) {}
}
