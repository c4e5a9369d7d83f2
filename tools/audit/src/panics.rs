//! Whether the panic handler is reachable: no instruction of the image leads there from the tick, from the interrupts of the control loop, or
//! from the handlers of faults.

use anyhow::{Result, bail, ensure};

use crate::graph::{Calls, way};
use crate::image::Image;

/// The panic handler, in which every panic ends.
pub const PANIC_HANDLER: &str = "__rustc::rust_begin_unwind";

/// Functions from which no panic may be reachable: name, and what it is.
pub const ROOTS: &[(&str, &str)] = &[
    ("firmware::tasks::control::control_step", "the tick"),
    ("I2C1_EV", "the ticks"),
    ("DMA2_STREAM0", "the interrupt of the samples"),
    ("ADC", "the interrupt of a lost conversion"),
    ("EXTI9_5", "the interrupt of the synchronisation input"),
    ("TIM1_BRK_TIM9", "the interrupt of the break"),
    ("HardFault", "the handler of hard faults"),
    ("NonMaskableInt", "the handler of the clock failure"),
    ("DefaultHandler", "the handler of all other interrupts"),
    (PANIC_HANDLER, "the panic handler itself"),
];

/// A function from which a panic is reachable on purpose: a task that is started twice. The analysis must find it, otherwise it shows
/// nothing.
pub const CONTROL: &str = "main";

/// Shows that no panic is reachable from the [`ROOTS`], and that one is found from [`CONTROL`]. Returns the number of functions that were
/// followed.
///
/// # Errors
///
/// With the calls that lead to the panic handler; and when the control finds none.
pub fn none_reachable(image: &Image, calls: &Calls) -> Result<usize> {
    let handler = image.only(PANIC_HANDLER)?;
    let mut followed = std::collections::BTreeSet::new();
    let mut found = Vec::new();
    for (name, what) in ROOTS {
        let root = image.only(name)?;
        let reached = calls.reached(image, root)?;
        // The panic handler reaches itself only through a call.
        let again = root == handler && reached.keys().any(|&at| calls.callees[at].contains(&handler));
        if again || (root != handler && reached.contains_key(&handler)) {
            found.push(format!("a panic is reachable from {name} ({what}):\n{}", way(image, &reached, handler)));
        }
        followed.extend(reached.into_keys());
    }
    if !found.is_empty() {
        bail!("{}", found.join("\n"));
    }
    let control = image.only(CONTROL)?;
    ensure!(
        calls.reached(image, control)?.contains_key(&handler),
        "no panic was found from `{CONTROL}`, where one is reachable on purpose: the analysis shows nothing"
    );
    Ok(followed.len())
}
