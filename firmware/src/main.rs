//! The firmware: boots dark, then steps the joint loop once a millisecond.
//!
//! On the host this is a program that says so and touches no register: the compiler of the host checks the firmware without a cross
//! target.
#![cfg_attr(target_os = "none", no_std, no_main)]
// On the host nothing calls what needs the chip.
#![cfg_attr(not(target_os = "none"), allow(dead_code, unused_imports))]

mod board;
mod climate;
mod clocks;
mod faults;
mod parameters;
mod sampling;
mod servo_pwm;
#[cfg(target_os = "none")]
mod stack;
mod stopwatch;
mod sync_input;
mod tasks;
mod watchdog;

/// The feature `no-sensor` lets the legs walk without a sensor worn: its verdicts are reported and nothing follows from them.
const SENSOR_REQUIRED: bool = cfg!(not(feature = "no-sensor"));

/// The feature `shadow` runs everything and drives nothing: the servo pins stay low, the timer's main output is never switched on.
const SHADOW: bool = cfg!(feature = "shadow");

#[cfg(target_os = "none")]
mod boot {
    use defmt_rtt as _;
    use embassy_executor::{Executor, InterruptExecutor, SpawnError, SpawnToken};
    use embassy_stm32::interrupt::{self, InterruptExt, Priority};
    use embassy_stm32::pac::DBGMCU;
    use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
    use firmware::pacing::Pacer;
    use firmware::post_mortem::LOCKOUT_STREAK;
    use heapless::Vec;
    use heapless::spsc::Queue;
    use joint_loop::Frame;
    use joint_loop::SENSORS;
    use joint_loop::setup::default_loop::board_loop;

    use crate::board::{self, BOARD, FOOT_SWITCH};
    use crate::servo_pwm::{self, Outputs};
    use crate::tasks::control::{
        self, Control, EDGES_QUEUED, FRAMES_QUEUED, INPUTS_QUEUED, SyncEdge, TICKS_A_FRAME, TickInputs,
    };
    use crate::tasks::telemetry::{self, Telemetry, wire};
    use crate::tasks::{sensor, watchdog as feeding};
    use crate::{SENSOR_REQUIRED, climate, clocks, faults, parameters, sampling, stopwatch, sync_input, watchdog};

    /// Priorities, high to low. The clock of the tasks is below the ticks: a tick never waits for a timer of telemetry.
    const EDGE: Priority = Priority::P2;
    const CONVERSION: Priority = Priority::P4;
    const TICK: Priority = Priority::P6;
    const TASK_CLOCK: Priority = Priority::P10;

    /// Runs the sensor and control tasks in an interrupt that nothing else uses (no CAN driver in this firmware).
    static TICKS: InterruptExecutor = InterruptExecutor::new();

    #[embassy_stm32::interrupt]
    unsafe fn CAN1_TX() {
        // SAFETY: the handler of the one interrupt that `TICKS` was started on.
        unsafe { TICKS.on_interrupt() }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        static mut INPUTS: Queue<TickInputs, INPUTS_QUEUED> = Queue::new();
        static mut FRAMES: Queue<Frame<SENSORS>, FRAMES_QUEUED> = Queue::new();
        static mut EDGES: Queue<SyncEdge, EDGES_QUEUED> = Queue::new();
        static mut THREAD: Option<Executor> = None;

        // Dark first, then why we are here, then a clock that is worth the name.
        servo_pwm::drive_pins_low();
        let last_run = faults::last_run();
        let vrefint_cal = sampling::vrefint_calibration();
        let climate = climate::Climate::new(vrefint_cal, sampling::temperature_calibration());
        let parameters = match parameters::read() {
            Ok(parameters) => parameters,
            Err(error) => {
                wire::refused(error);
                stay_dark()
            }
        };
        wire::boot(&last_run, vrefint_cal, &parameters);
        let Ok(chip) = clocks::start() else {
            wire::no_hse();
            stay_dark()
        };
        if let Some(mut core) = cortex_m::Peripherals::take() {
            stopwatch::start(&mut core);
        }

        // Everything that can be refused is refused here, before anything can move.
        let walk = match board_loop(&parameters, vrefint_cal, BOARD.min_supply, SENSOR_REQUIRED) {
            Ok(walk) => walk,
            Err(refusal) => {
                wire::refused(refusal);
                stay_dark()
            }
        };
        let outputs = Outputs::new(chip.TIM1);
        BOARD.sync.set(false);
        BOARD.sync.set_mode(Moder::OUTPUT);
        FOOT_SWITCH.set_pull(Pupdr::PULL_DOWN);
        FOOT_SWITCH.set_mode(Moder::INPUT);
        board::lamps().for_each(|lamp| lamp.set_mode(Moder::OUTPUT));
        let (inputs_in, inputs_out) = INPUTS.split();
        let (frames_in, frames_out) = FRAMES.split();
        let (edges_in, edges_out) = EDGES.split();
        let control = Control {
            walk,
            outputs,
            inputs: inputs_in,
            frames: frames_in,
            edges: edges_in,
            locked_out: last_run.streak >= LOCKOUT_STREAK,
            pacer: Pacer::default(),
            ticks_to_frame: TICKS_A_FRAME,
            flooded: false,
        };

        // From here on every hang ends in a reset. The ticks begin disarmed.
        watchdog::start();
        interrupt::TIM4.set_priority(TASK_CLOCK);
        interrupt::CAN1_TX.set_priority(TICK);
        let ticks = TICKS.start(interrupt::CAN1_TX);
        ticks.spawn(only(sensor::sensor_task()));
        ticks.spawn(only(control::control_task(control)));
        sync_input::start(EDGE);
        sampling::start(chip.ADC1, chip.TIM2, chip.DMA2_CH0, CONVERSION);

        let telemetry = Telemetry {
            inputs: inputs_out,
            frames: frames_out,
            edges: edges_out,
            sensors: parameters.sensors.count(),
            climate,
            line: Vec::new(),
            rounds: 0,
            shown: None,
        };
        THREAD.insert(Executor::new()).run(|thread| {
            thread.spawn(only(telemetry::telemetry_task(telemetry)));
            thread.spawn(only(feeding::watchdog_task()));
        })
    }

    /// The one instance of a task.
    fn only<S>(task: Result<SpawnToken<S>, SpawnError>) -> SpawnToken<S> {
        let Ok(task) = task else { panic!("a task was started twice") };
        task
    }

    /// Nothing to run: the servo lines are held low for ever. Asleep, but with the debug clock on, so that a probe can read why.
    fn stay_dark() -> ! {
        DBGMCU.cr().modify(|w| w.set_dbg_sleep(true));
        loop {
            cortex_m::asm::wfi();
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware for the {} board, compiled for this computer: it only shows that it compiles.\n\
         Build it for thumbv7em-none-eabihf; to flash it and watch its log: probe-rs run --chip {} ELF_FILE",
        board::BOARD.name,
        board::BOARD.chip
    );
}
