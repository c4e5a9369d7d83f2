//! Link proof: this program links for the board only if no panic is reachable from the cores and `wire`. It is never run.
//!
//! The panic handler calls a function that does not exist. If the optimiser cannot remove every panic, the call remains and the linker
//! reports `undefined symbol: a_panic_is_reachable`. Every input passes through a black box, so that the optimiser cannot use its value.
//!
//! To find the panic, give the function an address and search the disassembly for calls into `core::panicking`:
//! `cargo rustc -p link-proof ... -- -C link-arg=--defsym=a_panic_is_reachable=0`.
//!
//! ```text
//! cargo build -p link-proof --release --target thumbv7em-none-eabihf                              links
//! cargo build -p link-proof --release --target thumbv7em-none-eabihf --features unchecked-index   does not
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod generators;

#[cfg(target_os = "none")]
mod records;

#[cfg(target_os = "none")]
mod proof {
    use core::hint::black_box;
    use core::panic::PanicInfo;

    use hgod_adc::{
        Calibration, CalibrationPoint, FilterConfig, HealthConfig, Interpolation, ReferenceConfig, SensorConfig,
        SensorState,
    };
    use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop_with};
    use joint_loop::store::{generator_record, robot_record, sensor_record};
    use joint_loop::tuning::Request;
    use joint_loop::{BoardFaults, Debugger, LoopConfig, SENSORS, Sample, WatchdogHz};
    use joint_units::{AdcCode, Joint, Period, PulseMicros, Volts};

    unsafe extern "C" {
        /// Not defined, so that a reachable call fails to link.
        fn a_panic_is_reachable() -> !;
    }

    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        // SAFETY: cannot be linked, so cannot be called.
        unsafe { a_panic_is_reachable() }
    }

    /// Entry point for the linker.
    #[unsafe(no_mangle)]
    extern "C" fn prove() {
        let Some(period) = Period::from_micros(black_box(1000)) else { return };
        crate::generators::prove(period);
        sensors(period);
        joint_loop();
        crate::records::prove();
        #[cfg(feature = "unchecked-index")]
        unchecked_index();
    }

    /// A sensor: build from any table, reference, filter and limits, then one sample in any state.
    fn sensors(period: Period) {
        let points: &[CalibrationPoint] = black_box(&[]);
        let Ok(calibration) = Calibration::new(points, black_box(Interpolation::MonotoneCubic)) else { return };
        let config = SensorConfig {
            reference: black_box(ReferenceConfig::stm32f4(AdcCode(1500))),
            calibration,
            filter: black_box(FilterConfig::default()),
            health: black_box(HealthConfig::default()),
        };
        let Ok(sensor) = black_box(config).build(period) else { return };
        let mut state = black_box(SensorState::default());
        black_box(black_box(sensor).sample(&mut state, black_box(AdcCode(0)), black_box(AdcCode(0))));
        black_box(state);
    }

    /// The control loop: any bytes of the parameter sectors, any configuration, then one tick from any state with any sample, and its records.
    fn joint_loop() {
        let bytes: &[u8] = black_box(&[]);
        let (Ok(generator), Ok(sensors)) = (generator_record::read(bytes), sensor_record::read(bytes)) else { return };
        let Ok(Some(robot)) = robot_record::read(bytes) else { return };
        let names = (generator.as_ref().map(|stored| stored.name), sensors.as_ref().map(|stored| stored.name));
        let name = black_box(names.0.or(names.1).unwrap_or(robot.name));
        black_box(name.as_str());
        let parameters = Parameters::with_defaults(
            generator.map(|stored| stored.config),
            sensors.map(|stored| stored.sensors),
            robot.robot,
        );
        let Ok(parameters) = parameters else { return };
        black_box(generator_record::record_of(black_box(&parameters.generator), &name).bytes());
        black_box(sensor_record::record_of(black_box(&parameters.sensors), &name).bytes());
        black_box(robot_record::record_of(black_box(&parameters.robot), &name).bytes());
        let cal = AdcCode(black_box(1502));
        let config = black_box(LoopConfig::of(&parameters.robot));
        let min_supply = parameters.robot.min_supply_on(Volts(black_box(2.7)));
        let built = board_loop_with(&config, black_box(&parameters), cal, min_supply);
        let Ok(built) = built else { return };
        let mut joints: BoardLoop = black_box(built);
        let sample = Sample {
            elapsed: black_box(1),
            codes: black_box([AdcCode(0); SENSORS]),
            vrefint: black_box(AdcCode(0)),
            button: black_box(false),
            foot: black_box(false),
            late: black_box(false),
            faults: BoardFaults::from_bits(black_box(0)),
            watchdog_clock: black_box(Some(WatchdogHz(32_000))),
            debugger: black_box(Debugger::Absent),
            program_unproven: black_box(false),
            request: black_box(None::<Request>),
        };
        black_box(joints.start_from(black_box([PulseMicros(1_500); Joint::COUNT])));
        black_box((joints.wrong_watchdog_clock(), joints.knows_last_pulses()));
        black_box(joints.tick(&sample));
        crate::records::of_tick(&sample, &black_box(joints.frame()), joints.answers());
        black_box(joints.settings().ticks_a_record());
        black_box(&joints);
    }

    #[cfg(feature = "unchecked-index")]
    fn unchecked_index() {
        let angles = [0.0_f32; 4];
        black_box(angles[black_box(2)]);
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This program does nothing on the host. It proves by linking for the board that the cores cannot panic: see its source."
    );
}
