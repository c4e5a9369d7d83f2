//! The control task: sample, tick and pulses of each control period, in an interrupt of its own.
//!
//! [`sensor_step`] turns a sample set of the converter into a measurement, [`control_step`] hands it to the loop, writes the pulses and
//! leaves a copy of both in telemetry's queues.

use core::ptr;

use portable_atomic::{AtomicPtr, AtomicU32, Ordering};

use crate::board::BOARD;
use crate::timing::{LATE_END_US, LATE_US};
use firmware_shared::lamp::Shown;
use firmware_shared::licence::Licence;
#[cfg(feature = "controls")]
use firmware_shared::licence::Permit;
use firmware_shared::pacing::{Pacer, since};
use firmware_shared::pulse_check::PulseCheck;
use joint_loop::io::time_code;
use joint_loop::setup::default_loop::BoardLoop;
use joint_loop::tuning::Outcome;
use joint_loop::{BoardFaults, Cause, MAX_ELAPSED, SENSORS, Sample, SupervisorState};
use wire::{CALLS, Change, Edge};

use super::progress::CONTROL;
use super::queues::OfControl;
use super::sensor::{Measurement, sensor_step};
use crate::clocks;
use crate::debugger;
use crate::guards::Guards;
use crate::kept_outputs;
use crate::lamps;
use crate::pins::PinRegisters;
use crate::program;
use crate::queue;
use crate::removed::{Protection, lacks};
use crate::requests;
use crate::sampling;
use crate::servo_pwm::Outputs;
use crate::stopwatch;
use crate::sync_input;
use crate::variant::SHADOW;
use crate::watchdog_clock;

/// One frame in this many ticks goes to telemetry: 100 Hz.
const TICKS_A_FRAME: u8 = CALLS as u8;
/// The first tick with a frame for the serial port. At the default of 100 frames a second, and until a request is answered, no tick has two copies: settings
/// in tick 1 and then once a second, counts of conditions in the tick after, frames for the serial port in ticks 6, 16, 26, for telemetry in 10, 20, 30.
const FIRST_RECORD: u32 = 6;
/// The lamps are set in the tick that begins with this count of ticks to telemetry's frame: 5, 15, 25 and so on, 100 times a second. It has no copy.
const TICKS_AFTER_LAMPS: u8 = 6;
/// Ticks from one report of the settings to the next, without a change: a second.
const TICKS_A_REPORT: u32 = 1000;

/// Longest tick since telemetry's last report, core cycles.
static LONGEST_CYCLES: AtomicU32 = AtomicU32::new(0);
/// Latest start of a tick after its trigger since telemetry's last report, us.
static LATEST_START_US: AtomicU32 = AtomicU32::new(0);
/// Records dropped because their queue was full.
static DROPPED: AtomicU32 = AtomicU32::new(0);

/// Frames for the serial port that were dropped since telemetry's last report.
static NOT_SENT: AtomicU32 = AtomicU32::new(0);

/// Frames for the serial port that were dropped since the last call because telemetry was behind.
pub(super) fn take_not_sent() -> u32 {
    NOT_SENT.swap(0, Ordering::Relaxed)
}

/// Since the last call: the longest tick, in core cycles, and the latest start of one, in microseconds after its trigger.
pub(super) fn take_worst() -> (u32, u32) {
    (LONGEST_CYCLES.swap(0, Ordering::Relaxed), LATEST_START_US.swap(0, Ordering::Relaxed))
}

/// Records dropped since the start because telemetry was behind.
pub(super) fn dropped() -> u32 {
    DROPPED.load(Ordering::Relaxed)
}

/// State of the control task.
pub(crate) struct Control {
    joint_loop: &'static mut BoardLoop,
    outputs: Outputs,
    check: PulseCheck,
    /// Locked out after too many crashes in a row, or by a brown-out reset that the robot demands and that is off: the button is not passed on.
    licence: Licence,
    /// The robot is the built-in one.
    built_in_robot: bool,
    queues: OfControl,
    /// The pulses of the last tick had no permit, or the check has refused them.
    refused: bool,
    /// Number of the last sample set.
    last_sequence: Option<u32>,
    /// State and cause of the last tick.
    reported: (SupervisorState, Cause),
    ticks_to_settings: u32,
    ticks_to_record: u32,
    pacer: Pacer,
    ticks_to_frame: u8,
    /// Comparisons of the registers with what was written, wrapping.
    compared: usize,
    /// The last tick ended late.
    ended_late: bool,
    /// More edges came before the last tick than could be taken.
    flooded: bool,
}

/// What the interrupt of the ticks works with; null until they begin.
static STATE: AtomicPtr<Control> = AtomicPtr::new(ptr::null_mut());

/// Lets the ticks begin: from here on each sample set is a control period.
pub(crate) fn begin(control: &'static mut Control) {
    STATE.store(control, Ordering::Release);
}

/// The handler of the interrupt of the ticks, which nothing else uses. The end of the samples makes it pending, once a millisecond. It is not a
/// task of the executor, whose queue and waker cost about 90 instructions in each tick.
pub(crate) fn on_interrupt() {
    // SAFETY: `begin` was given the only reference there will ever be, and nothing but this handler uses it, which does not interrupt itself.
    let control = unsafe { STATE.load(Ordering::Acquire).as_mut() };
    if let Some(control) = control
        && let Some(measured) = sensor_step(&mut control.last_sequence)
    {
        control_step(control, &measured);
    }
}

/// One control period.
#[inline(never)]
fn control_step(control: &mut Control, measured: &Measurement) {
    let started = stopwatch::cycles();
    let elapsed = control.pacer.elapsed(measured.triggered_us).min(MAX_ELAPSED);
    if elapsed == 0 {
        return;
    }

    // Read the hardware first: it may have switched the outputs off already. A break that comes between the two is a break.
    let mut faults = measured.faults;
    control.compared = control.compared.wrapping_add(1);
    let is_as_written =
        control.outputs.as_written() && clocks::is_as_started() && sampling::is_as_started(control.compared);
    if !is_as_written && !lacks(Protection::ReadBack) || control.refused {
        control.refused = false;
        faults = faults.with(BoardFaults::OUTPUTS);
    }
    if control.outputs.take_break() {
        faults = faults.with(BoardFaults::BREAK_INPUT);
    }
    let start_us = since(stopwatch::now_us(), measured.triggered_us);
    let sample = Sample {
        elapsed,
        codes: measured.sensors,
        vrefint: measured.vrefint,
        button: measured.button && !control.licence.is_locked_out(),
        foot: measured.foot,
        late: start_us > LATE_US || control.ended_late,
        faults,
        watchdog_clock: watchdog_clock::take(),
        debugger: debugger::attached(),
        program_unproven: program::is_unproven(),
        request: requests::take(&mut control.queues.requests),
    };

    let command = control.joint_loop.tick(&sample);
    // Not the whole frame, which is copied only into a queue.
    let (tick, state) = (control.joint_loop.tick_number(), control.joint_loop.state());
    // Only a hold of the button makes a permit: whatever the loop's memory holds, its pulses go no further without one.
    let permit = control.licence.tick(sample.button, elapsed, state, command.pulses.is_some());
    #[cfg(feature = "controls")]
    let permit = permit
        .or_else(|| lacks(Protection::Licence).then(|| Permit::without_licence(state == SupervisorState::Trimming)));
    match (command.pulses, permit) {
        (Some(_), _) if SHADOW => {}
        (Some(widths), Some(permit))
            if control.check.allows(widths, permit.is_trim()) || lacks(Protection::PulseCheck) =>
        {
            control.outputs.drive(permit, widths)
        }
        (Some(_), _) => {
            control.refused = true;
            control.check.rest(elapsed);
            control.outputs.release_without_supply();
        }
        (None, _) => {
            control.check.rest(elapsed);
            if state == SupervisorState::Fault {
                control.outputs.release_without_supply();
            } else {
                control.outputs.release();
            }
        }
    }
    if !control.joint_loop.knows_last_pulses() {
        kept_outputs::forget();
    }

    // After the pulses, which matter more. The edges come about 10 us after the start of the tick, nearly constant.
    BOARD.sync_output.set(time_code::level(tick));
    if control.ticks_to_frame == TICKS_AFTER_LAMPS {
        lamps::show(control.shown(state, command.pulses.is_some()), tick);
    }
    control.report(&sample, tick);
    control.report_edges(tick, measured.triggered_us);
    CONTROL.count();
    control.ended_late = since(stopwatch::now_us(), measured.triggered_us) > LATE_END_US;
    let cycles = stopwatch::cycles().wrapping_sub(started);
    raise(&LONGEST_CYCLES, cycles);
    raise(&LATEST_START_US, start_us);
}

/// Raises a number that nothing else raises: load and store need not be one, as telemetry, which takes the number, does not interrupt a tick.
fn raise(most: &AtomicU32, now: u32) {
    if now > most.load(Ordering::Relaxed) {
        most.store(now, Ordering::Relaxed);
    }
}

impl Control {
    /// Disarmed, before the first tick.
    pub(crate) fn new(
        joint_loop: &'static mut BoardLoop,
        guards: Guards,
        outputs: Outputs,
        built_in_robot: bool,
        queues: OfControl,
    ) -> Self {
        let Guards { check, licence } = guards;
        Self {
            joint_loop,
            outputs,
            check,
            licence,
            built_in_robot,
            queues,
            refused: false,
            last_sequence: None,
            reported: (SupervisorState::Boot, Cause::None),
            ticks_to_settings: 1,
            ticks_to_record: FIRST_RECORD,
            pacer: Pacer::default(),
            ticks_to_frame: TICKS_A_FRAME,
            compared: 0,
            ended_late: false,
            flooded: false,
        }
    }

    /// What the lamps show.
    fn shown(&self, state: SupervisorState, pulses: bool) -> Shown {
        match state {
            SupervisorState::Fault => Shown::Fault,
            _ if self.licence.is_locked_out()
                || program::is_wrong()
                || self.joint_loop.wrong_watchdog_clock().is_some() =>
            {
                Shown::LockedOut
            }
            _ if self.joint_loop.awaits_stop_test() => Shown::StopUntested,
            SupervisorState::TrimReady => Shown::TrimReady,
            _ if !pulses => Shown::Disarmed,
            _ if SHADOW => Shown::Shadow,
            _ if self.built_in_robot => Shown::ArmedBuiltIn,
            _ => Shown::Armed,
        }
    }

    fn report(&mut self, sample: &Sample<SENSORS>, tick: u32) {
        let mut dropped = u32::from(!queue::put(&mut self.queues.samples, || (tick, *sample)));
        let now = (self.joint_loop.state(), self.joint_loop.cause());
        if self.reported != now {
            self.reported = now;
            let (state, cause) = now;
            dropped += u32::from(!queue::put(&mut self.queues.changes, || Change { tick, state, cause }));
        }
        self.ticks_to_frame -= 1;
        if self.ticks_to_frame == 0 {
            self.ticks_to_frame = TICKS_A_FRAME;
            dropped += u32::from(!queue::put(&mut self.queues.frames, || self.joint_loop.frame()));
        }
        self.ticks_to_settings = self.ticks_to_settings.saturating_sub(1);
        for answer in self.joint_loop.answers() {
            if answer.outcome == Outcome::InEffect {
                self.ticks_to_settings = 0;
            }
            dropped += u32::from(!queue::put(&mut self.queues.answers, || answer));
        }
        if self.ticks_to_settings == 0 {
            self.ticks_to_settings = TICKS_A_REPORT;
            dropped += u32::from(!queue::put(&mut self.queues.settings, || (tick, *self.joint_loop.settings())));
        } else if self.ticks_to_settings == TICKS_A_REPORT - 1 {
            // In the tick after the settings, so that the longest tick has one of the two.
            dropped += u32::from(!queue::put(&mut self.queues.conditions, || self.joint_loop.conditions()));
        }
        self.ticks_to_record -= 1;
        if self.ticks_to_record == 0 {
            self.ticks_to_record = self.joint_loop.settings().ticks_a_record();
            if !queue::put(&mut self.queues.records, || self.joint_loop.frame()) {
                NOT_SENT.fetch_add(1, Ordering::Relaxed);
            }
        }
        if dropped > 0 {
            DROPPED.fetch_add(dropped, Ordering::Relaxed);
        }
    }

    fn report_edges(&mut self, tick: u32, triggered_us: u32) {
        let mut dropped = 0;
        let mut lost_before = self.flooded;
        self.flooded = sync_input::take(|edge| {
            let offset_us = edge.at_us.wrapping_sub(triggered_us) as i32;
            let edge = Edge { tick, offset_us, high: edge.high, lost_before };
            lost_before = false;
            dropped += u32::from(!queue::put(&mut self.queues.edges, || edge));
        });
        if dropped > 0 {
            DROPPED.fetch_add(dropped, Ordering::Relaxed);
        }
    }
}
