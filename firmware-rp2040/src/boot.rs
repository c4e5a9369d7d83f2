//! The start: outputs off, records read, loop built, tasks started.

use embassy_executor::Executor;
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use firmware_rp2040::board::{BOARD, NO_FOLLOWER};
use static_cell::StaticCell;
use wire::Subject;

use crate::environment::Environment;
use crate::faults::LastRun;
use crate::pins::{PinRegisters, Pull};
use crate::requests::Requests;
use crate::sampling::REFERENCE;
use crate::servo_pwm::{self, Outputs};
use crate::start::Built;
use crate::tasks::control::{self, Control};
use crate::tasks::telemetry::{self, Telemetry};
use crate::tasks::{queues, watchdog as reloading};
use crate::{
    clocks, emergency_stop, faults, lamps, protections, sampling, serial, start, stopwatch, watchdog, watchdog_clock,
};

/// The ticks, in an interrupt that no peripheral has.
#[embassy_rp::interrupt]
fn SWI_IRQ_0() {
    control::on_interrupt();
}

// In statics, because `main` never returns: what is on its stack stays there.
static CONTROL: StaticCell<Control> = StaticCell::new();
static TELEMETRY: StaticCell<Telemetry> = StaticCell::new();
static THREAD: StaticCell<Executor> = StaticCell::new();

#[cortex_m_rt::entry]
fn main() -> ! {
    let (telemetry, usb) = start_up();
    THREAD.init(Executor::new()).run(|thread| {
        thread.spawn(start::only(telemetry::telemetry_task(telemetry)));
        thread.spawn(start::only(reloading::watchdog_task()));
        thread.spawn(start::only(serial::usb_device_task(usb.device)));
        thread.spawn(start::only(serial::usb_send_task(usb.sender)));
        thread.spawn(start::only(serial::usb_receive_task(usb.receiver)));
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
    let Built { joint_loop, guards, report } = build_loop(&last_run);
    let outputs = Outputs::new();
    BOARD.sync_output.set(false);
    BOARD.sync_output.make_output();
    BOARD.foot_switch.make_input(Pull::Down);
    BOARD.button.make_input(if BOARD.button_pressed { Pull::Down } else { Pull::Up });
    let (of_control, of_telemetry, requests) = queues::split();
    let control = CONTROL.init(Control::new(joint_loop, guards, outputs, report.built_in_robot, of_control));

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

    let (port, tasks) = serial::start(usb, Requests::new(requests));
    (TELEMETRY.init(Telemetry::new(port, of_telemetry, Environment, report)), tasks)
}

/// Reads the parameters and builds the loop. Every refusal happens here, before anything can move.
///
/// A function of its own, because the stack that it takes is free again afterwards.
#[inline(never)]
fn build_loop(last_run: &LastRun) -> Built {
    let (read, boot) = start::read(last_run, REFERENCE);
    protections::report();
    let loaded = start::loaded(&read);
    let parameters = loaded.parameters;
    if parameters.generator.follows().is_some() {
        start::stay_off(Subject::GeneratorRecord, NO_FOLLOWER);
    }
    if parameters.sensors.count() > BOARD.sensors.len() {
        start::stay_off(
            Subject::SensorRecord,
            format_args!("{} sensors; this board has inputs for {}", parameters.sensors.count(), BOARD.sensors.len()),
        );
    }
    start::build(loaded, boot, last_run, REFERENCE)
}
