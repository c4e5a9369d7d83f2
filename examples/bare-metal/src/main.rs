//! A firmware without operating system: steps a generator at 1 kHz and writes four servo pulses through `embedded_hal`.
//!
//! The channels here are those of TIM1 of an STM32F4, written as registers, so that no chip crate is needed; with a HAL, put its PWM
//! channels in their place. Build it for a Cortex-M4F with `cargo build -p bare-metal-example --target thumbv7em-none-eabihf --release`.
//! Clocks and pins are left at reset: the program shows the structure, it does not move a servo.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(any(target_os = "none", test))]
mod servos;

#[cfg(target_os = "none")]
mod board {
    use core::convert::Infallible;

    use cortex_m::peripheral::Peripherals;
    use cortex_m::peripheral::syst::SystClkSource;
    use cpg_core::Generator;
    use cpg_core::gait::default_walk::default_walk;
    use embedded_hal::pwm::{ErrorType, SetDutyCycle};
    use joint_units::Period;

    use crate::servos::Servos;

    /// CCR1 of TIM1, see the reference manual RM0090.
    const TIM1_CCR1: usize = 0x4001_0034;
    /// Ticks of the timer in a PWM period of 20 ms: 1 us each.
    const RELOAD: u16 = 20_000;
    /// Frequency of the core after reset, Hz.
    const CORE_HZ: u32 = 16_000_000;

    /// One compare channel of TIM1.
    struct Channel {
        index: usize,
    }

    impl ErrorType for Channel {
        type Error = Infallible;
    }

    impl SetDutyCycle for Channel {
        fn max_duty_cycle(&self) -> u16 {
            RELOAD
        }

        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
            let register = (TIM1_CCR1 + 4 * self.index) as *mut u32;
            // SAFETY: CCR1 to CCR4 are adjacent 32 bit registers, and no other code uses TIM1.
            unsafe { register.write_volatile(duty.into()) };
            Ok(())
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let mut servos = Servos { channels: [0, 1, 2, 3].map(|index| Channel { index }) };
        if let (Some(mut core), Ok(mut walk)) = (Peripherals::take(), default_walk(Period::MILLISECOND)) {
            core.SYST.set_clock_source(SystClkSource::Core);
            core.SYST.set_reload(CORE_HZ / 1000 - 1);
            core.SYST.clear_current();
            core.SYST.enable_counter();
            // A generator that fails its check must not move a joint.
            while walk.check().is_ok() {
                while !core.SYST.has_wrapped() {}
                walk.step();
                let Ok(()) = servos.write(walk.angles());
            }
        }
        loop {
            cortex_m::asm::wfi();
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
