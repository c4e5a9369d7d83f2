//! The firmware: boots with its outputs off, then steps the joint loop once a millisecond.
//!
//! Each peripheral is used by one module, by its registers; none is claimed from the HAL. A test compares this table with the modules:
//!
//! | peripherals | module |
//! |---|---|
//! | FLASH | [`clocks`] |
//! | TIM1 | [`servo_pwm`] |
//! | TIM2, ADC1, ADC123_COMMON, ADC1_COMMON, DMA2 | [`sampling`] |
//! | TIM5, and DWT of the core | [`stopwatch`] |
//! | TIM11 | [`crystal_timer`] |
//! | EXTI, SYSCFG | [`sync_input`] |
//! | USART2, DMA1 | [`serial`] |
//! | IWDG | [`watchdog`] |
//! | GPIOA, GPIOB, GPIOC, GPIOD, GPIOE | [`pins`] |
//!
//! Two are shared: in RCC each module enables the clock of its peripherals, and in DBGMCU it stops them with the debugger or reads which chip it is. TIM4 is the clock
//! of embassy-time. The interrupt of I2C1, which is not used, runs the executor of the ticks.
//!
//! Compiled for the host, the program prints one message and touches no register: so the host's compiler checks the firmware without a
//! cross target.
#![cfg_attr(target_os = "none", no_std, no_main)]
// On the host nothing calls the code that needs the chip.
#![cfg_attr(not(target_os = "none"), allow(dead_code, unused_imports))]

mod chip;
mod clocks;
mod crystal_timer;
mod debugger;
mod environment;
mod faults;
#[path = "../../firmware-shared/program/guards.rs"]
mod guards;
#[path = "../../firmware-shared/program/kept.rs"]
mod kept;
#[path = "../../firmware-shared/program/kept_outputs.rs"]
mod kept_outputs;
mod lamps;
#[path = "../../firmware-shared/program/log.rs"]
mod log;
#[path = "../../firmware-shared/program/parameters.rs"]
mod parameters;
mod pins;
mod program;
#[path = "../../firmware-shared/program/queue.rs"]
mod queue;
#[path = "../../firmware-shared/program/removed.rs"]
mod removed;
#[path = "../../firmware-shared/program/requests.rs"]
mod requests;
#[path = "../../firmware-shared/program/rtt.rs"]
mod rtt;
mod sampling;
mod serial;
mod servo_pwm;
mod servo_rail;
#[path = "../../firmware-shared/program/stack.rs"]
mod stack;
mod stopwatch;
mod sync_input;
#[path = "../../firmware-shared/program/tasks/mod.rs"]
mod tasks;
#[path = "../../firmware-shared/program/variant.rs"]
mod variant;
mod watchdog;
#[path = "../../firmware-shared/program/watchdog_clock.rs"]
mod watchdog_clock;

// What all families share names these two by the crate that compiles it, as each family has its own.
use firmware::{board, timing};

#[cfg(target_os = "none")]
mod boot {
    use embassy_executor::{Executor, SpawnError, SpawnToken};
    use embassy_stm32::interrupt::{self, InterruptExt, Priority};
    use embassy_stm32::pac::DBGMCU;
    use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
    use firmware::board::{BOARD, OtherChip};
    use firmware::crystal::HseFault;
    use firmware::interrupts::{BLOCK_END, BREAK, EDGE, Enabled, TASK_CLOCK, TICK};
    use firmware_shared::lamp::Shown;
    use firmware_shared::licence::Licence;
    use firmware_shared::pacing::Pacer;
    use firmware_shared::pulse_check::PulseCheck;
    use heapless::spsc::Queue;
    use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop_at};
    use joint_loop::tuning::{Answer, Request, Settings};
    use joint_loop::{Cause, Conditions, Frame, SENSORS, Sample, SupervisorState};
    use joint_units::AdcCode;
    use static_cell::{ConstStaticCell, StaticCell};
    use wire::{Boot, Change, Edge, Inputs, Record, Subject, Unframer};

    use crate::environment::Environment;
    use crate::faults::LastRun;
    use crate::guards;
    use crate::pins::PinRegisters;
    use crate::program::ProgramCheck;
    use crate::requests::{REQUESTS_QUEUED, Requests};
    use crate::serial;
    use crate::servo_pwm::{self, Outputs};
    use crate::tasks::control::{
        self, CHANGES_QUEUED, CONDITIONS_QUEUED, Control, EDGES_QUEUED, FIRST_RECORD, FRAMES_QUEUED, RECORDS_QUEUED,
        SAMPLES_QUEUED, TICKS_A_FRAME,
    };
    use crate::tasks::telemetry::{self, FRAMES_A_LINE, Telemetry};
    use crate::tasks::watchdog as reloading;
    use crate::variant::SENSOR_REQUIRED;
    use crate::{
        chip, clocks, faults, lamps, log, parameters, sampling, stopwatch, sync_input, watchdog, watchdog_clock,
    };

    /// The ticks. No I2C driver is in this firmware; every chip of the family has this interrupt.
    #[embassy_stm32::interrupt]
    fn I2C1_EV() {
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

    // What the tasks use is in statics, because `main` never returns: what is on its stack stays there.
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
        let telemetry = start_up();
        THREAD.init(Executor::new()).run(|thread| {
            thread.spawn(only(telemetry::telemetry_task(telemetry)));
            thread.spawn(only(reloading::watchdog_task()));
        })
    }

    /// Starts everything but the tasks of the thread; the ticks run when it returns.
    ///
    /// A function of its own, as [`build_loop`]: the stack that it takes is free again afterwards.
    #[inline(never)]
    fn start_up() -> &'static mut Telemetry {
        // Drive the pins low, read the reset cause, then start the crystal.
        servo_pwm::drive_pins_low();
        let last_run = faults::last_run();
        let reference_cal = sampling::reference_calibration();
        let environment = Environment::new(reference_cal, sampling::temperature_calibration());
        // Another chip may not bear this one's clock.
        let chip = chip::compare();
        let clock = if chip.is_ok() { clocks::start() } else { Ok(()) };
        let Built { joint_loop, check, licence, boot, unnamed, sensors, built_in_robot } =
            build_loop(&last_run, reference_cal, chip, clock);
        let outputs = Outputs::new(urgency(&BREAK));
        BOARD.sync_output.set(false);
        BOARD.sync_output.set_mode(Moder::OUTPUT);
        BOARD.foot_switch.set_pull(Pupdr::PULL_DOWN);
        BOARD.foot_switch.set_mode(Moder::INPUT);
        if !BOARD.button_is_held {
            BOARD.button.set_pull(if BOARD.button_pressed { Pupdr::PULL_DOWN } else { Pupdr::PULL_UP });
        }
        lamps::start();
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

        // Before the watchdog starts: a clock that is too fast resets the board soon after.
        watchdog_clock::measure();
        // From here on the watchdog resets the board after a hang. The ticks begin disarmed.
        watchdog::start();
        interrupt::TIM4.set_priority(urgency(&TASK_CLOCK));
        control::begin(control);
        interrupt::I2C1_EV.set_priority(urgency(&TICK));
        // SAFETY: what its handler uses is ready, and nothing masks this interrupt by itself.
        unsafe { interrupt::I2C1_EV.enable() };
        sync_input::start(urgency(&EDGE));
        // Servo frames and ticks keep the distance that they have here: their timers have one clock.
        cortex_m::interrupt::free(|_| {
            sampling::start(urgency(&BLOCK_END));
            servo_pwm::start_frames();
        });

        let mut port = serial::start(Requests::new(requests_in));
        let (warnings, brown_out) = (log::warnings(&boot, built_in_robot), boot.brown_out);
        port.send(&Record::Boot(boot));
        TELEMETRY.init(Telemetry {
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
            environment,
            rounds: 0,
            frames_to_line: FRAMES_A_LINE,
            supply_v: None,
            truncated: 0,
            program: ProgramCheck::new(),
            warnings,
            brown_out,
            refused_clock: None,
        })
    }

    /// The priority of an interrupt for the HAL: the chips have the upper four bits of its byte.
    fn urgency(interrupt: &Enabled) -> Priority {
        Priority::from(interrupt.priority << 4)
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
    ///
    /// A function of its own, because the stack that it takes is free again afterwards.
    #[inline(never)]
    fn build_loop(
        last_run: &LastRun,
        reference_cal: AdcCode,
        chip: Result<(), OtherChip>,
        clock: Result<(), HseFault>,
    ) -> Built {
        // The sectors are searched to their ends, which takes a tenth of the time with the fast clock.
        let loaded = parameters::read(&PARAMETERS);
        let boot = log::boot(last_run, reference_cal, loaded.as_ref().ok());
        if let Err(other) = chip {
            stay_off(Subject::Configuration, other);
        }
        let loaded = match &loaded {
            Ok(loaded) => loaded,
            Err(error) => stay_off(error.subject(), error),
        };
        let parameters = loaded.parameters;
        if let Err(fault) = clock {
            stay_off(Subject::Clock, fault);
        }
        stopwatch::start();
        let min_supply = parameters.robot.min_supply_on(BOARD.min_supply);
        match board_loop_at(LOOP.uninit(), parameters, reference_cal, min_supply, SENSOR_REQUIRED) {
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

    /// Reports the reason in the log and by the lamps, with the servo lines low. The debug clock stays on in sleep, so that a probe can read
    /// the log.
    fn stay_off(subject: Subject, reason: impl core::fmt::Display) -> ! {
        log::refused(subject, reason);
        DBGMCU.cr().modify(|w| w.set_dbg_sleep(true));
        lamps::show_for_ever(Shown::Off(subject))
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    let board = &firmware::board::BOARD;
    println!(
        "This is the firmware for the {} board, compiled for this computer: it only shows that it compiles.\n\
         `cargo xtask flash --board {}` builds it for the board, seals it, flashes it and shows its log.",
        board.name, board.name
    );
}
