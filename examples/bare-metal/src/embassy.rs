//! The same under embassy, with the drivers of its HAL: one task samples a potentiometer goniometer, another steps a generator at 1 kHz.
//!
//! For an STM32F407; with another chip, change the feature of `embassy-stm32` and the pins. Build it with
//! `cargo build -p bare-metal-example --bin embassy-example --features embassy --target thumbv7em-none-eabihf --release`.
//! It shows the structure: there is no watchdog, no emergency stop and no arming here, which the firmware of this project has.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(any(target_os = "none", test))]
mod servos;

#[cfg(target_os = "none")]
mod board {
    use cpg_core::Generator;
    use cpg_core::gait::default_walk::default_walk;
    use embassy_executor::Spawner;
    use embassy_stm32::Peri;
    use embassy_stm32::adc::{Adc, SampleTime};
    use embassy_stm32::gpio::OutputType;
    use embassy_stm32::peripherals::{ADC1, PC0, TIM1};
    use embassy_stm32::time::Hertz;
    use embassy_stm32::timer::low_level::CountingMode;
    use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
    use embassy_sync::blocking_mutex::raw::ThreadModeRawMutex;
    use embassy_sync::signal::Signal;
    use embassy_time::{Duration, Ticker};
    use hgod_adc::{
        Calibration, CalibrationPoint, FilterConfig, HealthConfig, Interpolation, Reading, ReferenceConfig,
    };
    use hgod_adc::{Sensor, SensorConfig, SensorState, Validity};
    use joint_units::{AdcCode, Period, Radians, Volts};

    use crate::servos::Servos;

    /// Time of a tick, and of a sample.
    const TICK: Duration = Duration::from_millis(1);
    /// The factory's code of the internal reference at 3.3 V (data sheet of the STM32F407, "Embedded internal reference voltage").
    const VREFINT_CAL: *const u16 = 0x1FFF_7A2A as *const u16;

    /// The newest angle of the goniometer.
    static ANGLE: Signal<ThreadModeRawMutex, Reading> = Signal::new();

    /// A linear table of two points; take yours from `footfall calibrate`.
    fn goniometer(factory_code: u16) -> Option<Sensor> {
        let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
        let config = SensorConfig {
            reference: ReferenceConfig::stm32f4(AdcCode(factory_code)),
            calibration: Calibration::new(&[point(0.5, 120.0), point(2.5, 0.0)], Interpolation::Linear).ok()?,
            filter: FilterConfig::default(),
            health: HealthConfig::default(),
        };
        config.build(Period::MILLISECOND).ok()
    }

    #[embassy_executor::task]
    async fn hgod_adc(adc: Peri<'static, ADC1>, mut pin: Peri<'static, PC0>, sensor: Sensor) {
        let mut adc = Adc::new(adc);
        let mut reference = adc.enable_vrefint();
        let mut state = SensorState::default();
        let mut ticker = Ticker::every(TICK);
        loop {
            ticker.next().await;
            let code = AdcCode(adc.blocking_read(&mut pin, SampleTime::CYCLES112));
            let reference_code = AdcCode(adc.blocking_read(&mut reference, SampleTime::CYCLES480));
            ANGLE.signal(sensor.sample(&mut state, code, reference_code));
        }
    }

    /// Steps the walk while the goniometer's samples are good, and holds the pose while they are not.
    #[embassy_executor::task]
    async fn control(pwm: SimplePwm<'static, TIM1>) {
        let channels = pwm.split();
        let mut channels = [channels.ch1, channels.ch2, channels.ch3, channels.ch4];
        channels.iter_mut().for_each(|channel| channel.enable());
        let mut servos = Servos { channels };
        let Ok(mut walk) = default_walk(Period::MILLISECOND) else { return };
        let mut good = false;
        let mut ticker = Ticker::every(TICK);
        // A generator that fails its check must not move a joint.
        while walk.check().is_ok() {
            ticker.next().await;
            if let Some(reading) = ANGLE.try_take() {
                good = reading.validity == Validity::Good;
            }
            if good {
                walk.step();
            }
            let Ok(()) = servos.write(walk.angles());
        }
    }

    #[embassy_executor::main]
    async fn main(spawner: Spawner) {
        // 16 MHz from the internal oscillator: a product sets its crystal and PLL here.
        let chip = embassy_stm32::init(embassy_stm32::Config::default());
        let pin = OutputType::PushPull;
        let pwm = SimplePwm::new(
            chip.TIM1,
            Some(PwmPin::new(chip.PE9, pin)),
            Some(PwmPin::new(chip.PE11, pin)),
            Some(PwmPin::new(chip.PE13, pin)),
            Some(PwmPin::new(chip.PE14, pin)),
            Hertz(50),
            CountingMode::EdgeAlignedUp,
        );
        // SAFETY: a half word in system memory, which every chip of the family has and nothing writes.
        let factory_code = unsafe { VREFINT_CAL.read_volatile() };
        // Without a sensor there is no walk.
        if let Some(sensor) = goniometer(factory_code)
            && let (Ok(adc), Ok(control)) = (hgod_adc(chip.ADC1, chip.PC0, sensor), control(pwm))
        {
            spawner.spawn(adc);
            spawner.spawn(control);
        }
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("This program is for a microcontroller: build it for thumbv7em-none-eabihf.");
}
