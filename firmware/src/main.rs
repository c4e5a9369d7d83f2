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
#[path = "../../firmware-shared/program/start.rs"]
mod start;
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
    use embassy_executor::Executor;
    use embassy_stm32::interrupt::{self, InterruptExt, Priority};
    use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
    use firmware::board::{BOARD, OtherChip};
    use firmware::crystal::HseFault;
    use firmware::interrupts::{BLOCK_END, BREAK, EDGE, Enabled, TASK_CLOCK, TICK};
    use joint_units::AdcCode;
    use static_cell::StaticCell;
    use wire::Subject;

    use crate::environment::Environment;
    use crate::faults::LastRun;
    use crate::pins::PinRegisters;
    use crate::requests::Requests;
    use crate::servo_pwm::{self, Outputs};
    use crate::start::Built;
    use crate::tasks::control::{self, Control};
    use crate::tasks::telemetry::{self, Telemetry};
    use crate::tasks::{queues, watchdog as reloading};
    use crate::{
        chip, clocks, faults, lamps, sampling, serial, start, stopwatch, sync_input, watchdog, watchdog_clock,
    };

    /// The ticks. No I2C driver is in this firmware; every chip of the family has this interrupt.
    #[embassy_stm32::interrupt]
    fn I2C1_EV() {
        control::on_interrupt();
    }

    static CONTROL: StaticCell<Control> = StaticCell::new();
    static TELEMETRY: StaticCell<Telemetry> = StaticCell::new();
    static THREAD: StaticCell<Executor> = StaticCell::new();

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let telemetry = start_up();
        THREAD.init(Executor::new()).run(|thread| {
            thread.spawn(start::only(telemetry::telemetry_task(telemetry)));
            thread.spawn(start::only(reloading::watchdog_task()));
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
        let built = build_loop(&last_run, reference_cal, chip, clock);
        let outputs = Outputs::new(urgency(&BREAK));
        BOARD.sync_output.set(false);
        BOARD.sync_output.set_mode(Moder::OUTPUT);
        BOARD.foot_switch.set_pull(Pupdr::PULL_DOWN);
        BOARD.foot_switch.set_mode(Moder::INPUT);
        if !BOARD.button_is_held {
            BOARD.button.set_pull(if BOARD.button_pressed { Pupdr::PULL_DOWN } else { Pupdr::PULL_UP });
        }
        lamps::start();
        let (of_control, of_telemetry, requests) = queues::split();
        let Built { joint_loop, guards, report } = built;
        let control = CONTROL.init(Control::new(joint_loop, guards, outputs, report.built_in_robot, of_control));

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

        let port = serial::start(Requests::new(requests));
        TELEMETRY.init(Telemetry::new(port, of_telemetry, environment, report))
    }

    /// The priority of an interrupt for the HAL: the chips have the upper four bits of its byte.
    fn urgency(interrupt: &Enabled) -> Priority {
        Priority::from(interrupt.priority << 4)
    }

    /// Reads the parameters and builds the loop. Every refusal happens here, before anything can move.
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
        let (read, boot) = start::read(last_run, reference_cal);
        if let Err(other) = chip {
            start::stay_off(Subject::Configuration, other);
        }
        let loaded = start::loaded(&read);
        if let Err(fault) = clock {
            start::stay_off(Subject::Clock, fault);
        }
        stopwatch::start();
        start::build(loaded, boot, last_run, reference_cal)
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
