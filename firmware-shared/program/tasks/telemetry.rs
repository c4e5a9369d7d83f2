//! The telemetry task: sends the contents of the control task's queues to the log and the serial port, as records of the crate `wire`.

use embassy_time::Timer;
use firmware_shared::liveness::FEED_US;
use joint_loop::control::watchdog_clock::{FASTEST_HZ, SLOWEST_HZ};
use joint_loop::{Conditions, Debugger, Frame, SENSORS, Sample, SupervisorState, WatchdogHz};
use wire::{
    Answered, BrownOut, Call, Cost, Inputs, MAX_FRAME_BYTES, Record, Refused, Subject, Unframer, Warnings, frame_record,
};

use super::control::{dropped, take_not_sent, take_worst};
use super::progress::TELEMETRY;
use super::queues::OfTelemetry;
use crate::environment::Environment;
use crate::log;
use crate::program::ProgramCheck;
use crate::rtt;
use crate::serial::Port;
use crate::servo_pwm;
use crate::stack;
use crate::start::BootReport;
use crate::{debugger, watchdog_clock};

/// Period of the task, us: less than half the period of the watchdog task, which must see progress each time.
const ROUND_US: u32 = 2_000;
const _: () = assert!(2 * ROUND_US < FEED_US, "the watchdog task must see a round each time");
const ROUNDS_A_SECOND: u32 = 1_000_000 / ROUND_US;
/// Frames from one line for people to the next: 100 ms.
const FRAMES_A_LINE: u8 = 10;

/// State of the telemetry task.
pub(crate) struct Telemetry {
    port: Port,
    queues: OfTelemetry,
    environment: Environment,
    /// Finds the requests in what a debug probe writes.
    probe: Unframer,
    /// What was not as it should be, as it was last reported.
    reported: Conditions<SENSORS>,
    /// Check sums of the generator's and the robot's parameters.
    unnamed: [u32; 2],
    /// Sensors that the board has: the first channels.
    sensors: usize,
    /// Calls of the record that is being collected.
    inputs: Inputs,
    /// Tick of the last of them.
    last_tick: u32,
    rounds: u32,
    /// Frames until the next line for people.
    frames_to_line: u8,
    /// Mean supply of the last second, V.
    supply_v: Option<f32>,
    /// Pulses that were cut short, as of the last report.
    truncated: u32,
    program: ProgramCheck,
    /// What the boot warned of, and the level of the brown-out reset.
    warnings: Warnings,
    brown_out: BrownOut,
    /// The clock of the watchdog that was reported as wrong.
    refused_clock: Option<WatchdogHz>,
}

/// Runs every [`ROUND_US`].
#[embassy_executor::task]
pub(crate) async fn telemetry_task(telemetry: &'static mut Telemetry) -> ! {
    loop {
        telemetry_step(telemetry);
        Timer::after_micros(ROUND_US.into()).await;
    }
}

/// Empties the queues.
#[inline(never)]
fn telemetry_step(telemetry: &mut Telemetry) {
    telemetry.check_program();
    telemetry.report_watchdog_clock();
    while let Some((tick, sample)) = telemetry.queues.samples.dequeue() {
        telemetry.collect(tick, &sample);
    }
    while let Some(change) = telemetry.queues.changes.dequeue() {
        log::state(&change);
        if change.state == SupervisorState::Arming {
            if debugger::attached() != Debugger::Absent {
                log::armed_with_debugger();
            }
            log::warn(telemetry.warnings_now(), telemetry.brown_out);
        }
        telemetry.send(&Record::Change(change));
    }
    while let Some(frame) = telemetry.queues.frames.dequeue() {
        telemetry.report(&frame);
    }
    while let Some(edge) = telemetry.queues.edges.dequeue() {
        telemetry.send(&Record::Edge(edge));
    }
    while let Some(frame) = telemetry.queues.records.dequeue() {
        telemetry.port.send(&Record::Frame(wire::Frame::from(&frame)));
    }
    // Before the answers: with one that says `in effect` a host has the settings already.
    while let Some((tick, values)) = telemetry.queues.settings.dequeue() {
        let [generator, robot] = telemetry.unnamed;
        telemetry.send(&Record::Settings(wire::Settings { tick, generator, robot, values }));
    }
    while let Some(conditions) = telemetry.queues.conditions.dequeue() {
        telemetry.report_conditions(conditions);
    }
    while let Some(answer) = telemetry.queues.answers.dequeue() {
        log::answered(&answer);
        telemetry.send(&Record::Answered(Answered::from(answer)));
    }
    telemetry.rounds += 1;
    if telemetry.rounds == ROUNDS_A_SECOND {
        telemetry.rounds = 0;
        let (longest_cycles, latest_start_us) = take_worst();
        let (used, size) = stack::high_water();
        let truncated = servo_pwm::truncated();
        if telemetry.truncated != truncated {
            log::truncated(truncated.wrapping_sub(telemetry.truncated));
            telemetry.truncated = truncated;
        }
        telemetry.send(&Record::Cost(Cost {
            longest_cycles,
            latest_start_us,
            dropped: dropped(),
            stack_used: used as u32,
            stack_size: size as u32,
            truncated,
        }));
        let environment = wire::Environment {
            watchdog_hz: watchdog_clock::last().map(|WatchdogHz(hz)| hz),
            debugger: debugger::attached() != Debugger::Absent,
            warnings: telemetry.warnings_now(),
            ..telemetry.environment.take()
        };
        telemetry.supply_v = environment.supply_v;
        telemetry.send(&Record::Environment(environment));
        telemetry.port.drop_records(take_not_sent());
        let counts = telemetry.port.requests.counts;
        telemetry.send(&Record::Port(counts));
    }
    let Telemetry { port, probe, .. } = telemetry;
    rtt::receive(|byte| port.requests.take(probe, byte));
    telemetry.port.receive();
    telemetry.port.pump();
    TELEMETRY.count();
}

impl Telemetry {
    /// Before the first round; the boot record goes to the serial port.
    pub(crate) fn new(mut port: Port, queues: OfTelemetry, environment: Environment, report: BootReport) -> Self {
        let BootReport { boot, unnamed, sensors, built_in_robot, conditions } = report;
        let (warnings, brown_out) = (log::warnings(&boot, built_in_robot), boot.brown_out);
        port.send(&Record::Boot(boot));
        Self {
            port,
            queues,
            environment,
            probe: Unframer::default(),
            reported: conditions,
            unnamed,
            sensors,
            inputs: Inputs::default(),
            last_tick: 0,
            rounds: 0,
            frames_to_line: FRAMES_A_LINE,
            supply_v: None,
            truncated: 0,
            program: ProgramCheck::new(),
            warnings,
            brown_out,
            refused_clock: None,
        }
    }

    /// What the boot warned of, and what a debugger has set since.
    fn warnings_now(&self) -> Warnings {
        self.warnings.with(Warnings::CATCHES.when(debugger::catches()))
    }

    /// Sends a record to the debug probe and to the serial port.
    fn send(&mut self, record: &Record) {
        let mut buffer = [0; MAX_FRAME_BYTES];
        let frame = frame_record(record, &mut buffer).unwrap_or_default();
        rtt::send(frame);
        self.port.send_frame(frame);
    }

    /// Checks a piece of the program in flash, and reports in words why the board does not arm with it.
    fn check_program(&mut self) {
        if let Some(wrong) = self.program.step() {
            self.refuse(&Refused::new(Subject::Arming, wrong));
        }
    }

    /// Reports a refusal in the log and at the serial port.
    fn refuse(&mut self, refused: &Refused) {
        log::refusal(refused);
        self.port.send(&Record::Refused(refused.clone()));
    }

    /// Reports a clock of the watchdog that is not allowed, in words, once for each measurement that differs.
    fn report_watchdog_clock(&mut self) {
        let wrong = watchdog_clock::last().filter(|hz| !hz.is_allowed());
        if let Some(WatchdogHz(hz)) = wrong
            && self.refused_clock != wrong
        {
            let reason = format_args!(
                "the clock of the watchdog runs at {hz} Hz; allowed are {SLOWEST_HZ} to {FASTEST_HZ} Hz: reset the board, and replace it if this remains"
            );
            self.refuse(&Refused::new(Subject::Arming, reason));
        }
        self.refused_clock = wrong;
    }

    /// Reports what was not as it should be: in numbers, and in words what has changed since the last report, a second before. However often a contact
    /// opens, that is one line.
    fn report_conditions(&mut self, now: Conditions<SENSORS>) {
        let before = core::mem::replace(&mut self.reported, now);
        let ms = now.tick.wrapping_sub(before.tick);
        let dips = now.supply_dips.wrapping_sub(before.supply_dips);
        if dips > 0 {
            log::supply_dipped(dips, ms);
        }
        for (channel, (now, before)) in (1..).zip(now.sensors.iter().zip(&before.sensors)) {
            let counts = now.since(before);
            if counts.changes > 0 {
                log::sensor_changed(channel, &counts, ms);
            }
        }
        self.send(&Record::Conditions(wire::Conditions::of(&now, self.sensors)));
    }

    /// Collects a record of successive calls; after a gap a new record begins.
    fn collect(&mut self, tick: u32, sample: &Sample<SENSORS>) {
        if tick != self.last_tick.wrapping_add(sample.elapsed) {
            self.flush();
        }
        if self.inputs.calls.is_empty() {
            self.inputs.first_tick = tick;
        }
        self.last_tick = tick;
        // Never full here: a full record has been sent.
        let _ = self.inputs.calls.push(Call::of(sample, self.sensors));
        if self.inputs.calls.is_full() {
            self.flush();
        }
    }

    fn flush(&mut self) {
        if !self.inputs.calls.is_empty() {
            let inputs = core::mem::take(&mut self.inputs);
            self.send(&Record::Inputs(inputs));
        }
    }

    fn report(&mut self, frame: &Frame<SENSORS>) {
        let frame = wire::Frame::from(frame);
        self.frames_to_line -= 1;
        if self.frames_to_line == 0 {
            self.frames_to_line = FRAMES_A_LINE;
            log::status(&frame, self.supply_v);
        }
        log::send(&Record::Frame(frame));
    }
}
