//! Says at each boot which protections of the STM32F4 family this chip has not, and what stands in for them.

/// Prints one line a protection.
pub(crate) fn report() {
    defmt::warn!(
        "no break input: the program switches the servos' supply and the pulses off in the non-maskable interrupt of the emergency \
         stop; if the processor hangs, the watchdog does within 20 ms"
    );
    defmt::warn!(
        "no measured supply: 3.3 V are assumed; a low supply is not found, and a wrong one falsifies the sensors' angles"
    );
    defmt::warn!(
        "no oscillator of the watchdog's own: a crystal that stops, stops the watchdog too, and the servos keep their last level"
    );
    defmt::warn!(
        "no view of a debugger: one that halts the processor is not noticed; the watchdog resets the chip then"
    );
}
