//! The start: outputs off, records read, loop built, tasks started.

use embassy_executor::{Executor, SpawnError, SpawnToken};
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use firmware_rp2040::board::{BOARD, NO_FOLLOWER};
use firmware_shared::lamp::Shown;
use firmware_shared::licence::Licence;
use firmware_shared::pacing::Pacer;
use firmware_shared::pulse_check::PulseCheck;
use heapless::spsc::Queue;
use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop_at};
use joint_loop::tuning::{Answer, Request, Settings};
use joint_loop::{Cause, Conditions, Frame, SENSORS, Sample, SupervisorState};
use static_cell::{ConstStaticCell, StaticCell};
use wire::{Boot, Change, Edge, Inputs, Record, Subject, Unframer};

use crate::environment::Environment;
use crate::faults::LastRun;
use crate::guards;
use crate::pins::{PinRegisters, Pull};
use crate::program::ProgramCheck;
use crate::requests::{REQUESTS_QUEUED, Requests};
use crate::sampling::REFERENCE;
use crate::servo_pwm::{self, Outputs};
use crate::tasks::control::{
    self, CHANGES_QUEUED, CONDITIONS_QUEUED, Control, EDGES_QUEUED, FIRST_RECORD, FRAMES_QUEUED, RECORDS_QUEUED,
    SAMPLES_QUEUED, TICKS_A_FRAME,
};
use crate::tasks::telemetry::{self, FRAMES_A_LINE, Telemetry};
use crate::tasks::watchdog as reloading;
use crate::variant::SENSOR_REQUIRED;
use crate::{
    clocks, emergency_stop, faults, lamps, log, parameters, protections, sampling, serial, stopwatch, watchdog,
    watchdog_clock,
};

/// The ticks, in an interrupt that no peripheral has.
#[embassy_rp::interrupt]
fn SWI_IRQ_0() {
    control::on_interrupt();
}

/// The queues between the tasks.
struct Queues {
    samples: Queue<(u32, Sample<SENSORS>), SAMPLES_QUEUED>,
    frames: Queue<Frame<SENSORS>, FRAMES_QUEUED>,
    changes: Queue<Change, CHANGES_QUEUED>,
    edges: Queue<Edge, EDGES_QUEUED>,
    records: Queue<Frame<SENSORS>, RECORDS_QUEUED>,
    requests: Queue<Request, REQUESTS_QUEUED>,
    answers: Queue<Answer, REQUESTS_QUEUED>,
    settings: Queue<(u32, Settings), REQUESTS_QUEUED>,
    conditions: Queue<Conditions<SENSORS>, CONDITIONS_QUEUED>,
}

static PARAMETERS: StaticCell<Parameters> = StaticCell::new();
static LOOP: StaticCell<BoardLoop> = StaticCell::new();
static CONTROL: StaticCell<Control> = StaticCell::new();
static TELEMETRY: StaticCell<Telemetry> = StaticCell::new();
static THREAD: StaticCell<Executor> = StaticCell::new();
static QUEUES: ConstStaticCell<Queues> = ConstStaticCell::new(Queues {
    samples: Queue::new(),
    frames: Queue::new(),
    changes: Queue::new(),
    edges: Queue::new(),
    records: Queue::new(),
    requests: Queue::new(),
    answers: Queue::new(),
    settings: Queue::new(),
    conditions: Queue::new(),
});

#[cortex_m_rt::entry]
fn main() -> ! {
    let (telemetry, usb) = start_up();
    THREAD.init(Executor::new()).run(|thread| {
        thread.spawn(only(telemetry::telemetry_task(telemetry)));
        thread.spawn(only(reloading::watchdog_task()));
        thread.spawn(only(serial::usb_device_task(usb.device)));
        thread.spawn(only(serial::usb_send_task(usb.sender)));
        thread.spawn(only(serial::usb_receive_task(usb.receiver)));
    })
}

/// Starts everything but the tasks of the thread; the ticks run when it returns.
///
/// A function of its own, as [`build_loop`]: the stack that it takes is free again afterwards.
#[inline(never)]
fn start_up() -> (&'static mut Telemetry, serial::Tasks) {
    // Drive the pins low, then read the reset cause, then start the clocks. That resets the pins with nearly all other blocks: until they are driven
    // again their pull-downs hold them.
    servo_pwm::drive_pins_low();
    let last_run = faults::last_run();
    let usb = clocks::start();
    servo_pwm::drive_pins_low();
    stopwatch::start();
    lamps::start();
    let Built { joint_loop, check, licence, boot, unnamed, sensors, built_in_robot } = build_loop(&last_run);
    let outputs = Outputs::new();
    BOARD.sync_output.set(false);
    BOARD.sync_output.make_output();
    BOARD.foot_switch.make_input(Pull::Down);
    BOARD.button.make_input(if BOARD.button_pressed { Pull::Down } else { Pull::Up });
    let queues = QUEUES.take();
    let (samples_in, samples_out) = queues.samples.split();
    let (frames_in, frames_out) = queues.frames.split();
    let (changes_in, changes_out) = queues.changes.split();
    let (edges_in, edges_out) = queues.edges.split();
    let (records_in, records_out) = queues.records.split();
    let (requests_in, requests_out) = queues.requests.split();
    let (answers_in, answers_out) = queues.answers.split();
    let (settings_in, settings_out) = queues.settings.split();
    let (conditions_in, conditions_out) = queues.conditions.split();
    let counted = joint_loop.conditions();
    let control = CONTROL.init(Control {
        joint_loop,
        outputs,
        check,
        refused: false,
        last_sequence: None,
        samples: samples_in,
        frames: frames_in,
        changes: changes_in,
        reported: (SupervisorState::Boot, Cause::None),
        edges: edges_in,
        records: records_in,
        requests: requests_out,
        answers: answers_in,
        settings: settings_in,
        conditions: conditions_in,
        ticks_to_settings: 1,
        ticks_to_record: FIRST_RECORD,
        licence,
        built_in_robot,
        pacer: Pacer::default(),
        compared: 0,
        ticks_to_frame: TICKS_A_FRAME,
        ended_late: false,
        flooded: false,
    });

    // From here on the watchdog resets the board after a hang. The ticks begin disarmed.
    watchdog::start();
    watchdog_clock::measure();
    interrupt::TIMER_IRQ_0.set_priority(Priority::P3);
    interrupt::SWI_IRQ_0.set_priority(Priority::P2);
    control::begin(control);
    // SAFETY: what its handler uses is ready, and nothing masks this interrupt by itself.
    unsafe { interrupt::SWI_IRQ_0.enable() };
    emergency_stop::start();
    // Servo frames and ticks keep the distance that they have here: their clocks are of one crystal.
    cortex_m::interrupt::free(|_| {
        sampling::start(Priority::P1);
        servo_pwm::start_frames();
    });

    let (mut port, tasks) = serial::start(usb, Requests::new(requests_in));
    let (warnings, brown_out) = (log::warnings(&boot, built_in_robot), boot.brown_out);
    port.send(&Record::Boot(boot));
    let telemetry = TELEMETRY.init(Telemetry {
        port,
        probe: Unframer::default(),
        records: records_out,
        answers: answers_out,
        settings: settings_out,
        conditions: conditions_out,
        reported: counted,
        unnamed,
        samples: samples_out,
        frames: frames_out,
        changes: changes_out,
        edges: edges_out,
        sensors,
        inputs: Inputs::default(),
        last_tick: 0,
        environment: Environment,
        rounds: 0,
        frames_to_line: FRAMES_A_LINE,
        supply_v: None,
        truncated: 0,
        program: ProgramCheck::new(),
        warnings,
        brown_out,
        refused_clock: None,
    });
    (telemetry, tasks)
}

/// The loop, the boot record, and how many sensors there are.
struct Built {
    joint_loop: &'static mut BoardLoop,
    check: PulseCheck,
    licence: Licence,
    boot: Boot,
    /// Check sums of the generator's and the robot's parameters.
    unnamed: [u32; 2],
    sensors: usize,
    built_in_robot: bool,
}

/// Reads the parameters and builds the loop in its place. Every refusal happens here, before anything can move.
#[inline(never)]
fn build_loop(last_run: &LastRun) -> Built {
    let loaded = parameters::read(&PARAMETERS);
    let boot = log::boot(last_run, REFERENCE, loaded.as_ref().ok());
    protections::report();
    let loaded = match &loaded {
        Ok(loaded) => loaded,
        Err(error) => stay_off(error.subject(), error),
    };
    let parameters = loaded.parameters;
    if parameters.generator.follows().is_some() {
        stay_off(Subject::GeneratorRecord, NO_FOLLOWER);
    }
    if parameters.sensors.count() > BOARD.sensors.len() {
        stay_off(
            Subject::SensorRecord,
            format_args!("{} sensors; this board has inputs for {}", parameters.sensors.count(), BOARD.sensors.len()),
        );
    }
    let min_supply = parameters.robot.min_supply_on(BOARD.min_supply);
    match board_loop_at(LOOP.uninit(), parameters, REFERENCE, min_supply, SENSOR_REQUIRED) {
        Ok(joint_loop) => match guards::build(joint_loop, loaded, last_run) {
            Ok((check, licence)) => Built {
                joint_loop,
                check,
                licence,
                boot,
                unnamed: loaded.unnamed,
                sensors: parameters.sensors.count(),
                built_in_robot: loaded.built_in_robot,
            },
            Err(refusal) => stay_off(Subject::Configuration, refusal),
        },
        Err(refusal) => stay_off(Subject::Configuration, refusal),
    }
}

/// The one instance of a task.
fn only<S>(task: Result<SpawnToken<S>, SpawnError>) -> SpawnToken<S> {
    let Ok(task) = task else { panic!("a task was started twice") };
    task
}

/// Reports the reason in the log and by the lamp, with the servo lines low.
fn stay_off(subject: Subject, reason: impl core::fmt::Display) -> ! {
    log::refused(subject, reason);
    lamps::show_for_ever(Shown::Off(subject))
}
