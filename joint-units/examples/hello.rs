//! Units, and a phase that wraps: `cargo run -p joint-units --example hello`.

use joint_units::{Period, Phase, Radians};

fn main() {
    let knee = Radians::from_degrees(60.0);
    println!("a knee of 60 degrees is {:.4} rad", knee.0);

    // A stride of 1.1 s at 1 kHz, for 2.75 strides.
    let tick = Phase::from_cycles(Period::MILLISECOND.seconds() / 1.1);
    let mut phase = Phase::ZERO;
    for _ in 0..3025 {
        phase += tick;
    }
    println!("after 2.75 strides the phase is {:.3} cycles", phase.cycles());
    println!("that is {:.3} cycles after the start by the shorter way", phase.cycles_after(Phase::ZERO));
}
