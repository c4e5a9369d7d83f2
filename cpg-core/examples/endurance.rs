//! The default walk for days: `cargo run -p cpg-core --profile host --example endurance -- 72` steps 72 h of 1 ms ticks, prints
//! stride counts, periods and the error of the phase, and fails when that is more than 0.001 rad or a stride is lost.
//!
//! The error is against the clock of the ticks: how far that clock itself goes wrong, 20 ppm for a usual crystal, is not in it.

use std::f64::consts::TAU;
use std::process::ExitCode;
use std::time::Instant;

use cpg_core::gait::default_walk::{STRIDE_SECONDS, default_walk};
use cpg_core::{Generator, OscillatorState};
use joint_units::Period;

const TICKS_AN_HOUR: u64 = 3_600_000;

/// Largest error of the phase over the whole run, rad: the strides against the ticks.
const MOST_ERROR: f64 = 1e-3;

fn main() -> ExitCode {
    let hours = match std::env::args().nth(1).map(|hours| hours.parse::<u64>()) {
        None => 72,
        Some(Ok(hours)) if (1..=10_000).contains(&hours) => hours,
        Some(_) => {
            eprintln!("usage: endurance [HOURS], whole hours from 1 to 10000");
            return ExitCode::from(2);
        }
    };
    let Ok(mut walk) = default_walk(Period::MILLISECOND) else {
        eprintln!("the default walk refuses a period of 1 ms");
        return ExitCode::FAILURE;
    };
    let started = Instant::now();

    // Upward crossings of the left hip's offset, placed between two ticks by the line through them: how many, and when in ms.
    let (mut strides, mut last) = (0_u64, 0.0);
    let (mut first, mut hour_begin) = (0.0, (1, 0.0));
    let mut before = walk.state().displacement[0];
    for hour in 0..hours {
        for tick in hour * TICKS_AN_HOUR..(hour + 1) * TICKS_AN_HOUR {
            walk.step();
            let OscillatorState { displacement: [now, ..], .. } = walk.state();
            if before < 0.0 && now >= 0.0 {
                last = tick as f64 + f64::from(before / (before - now));
                strides += 1;
                if strides == 1 {
                    (first, hour_begin) = (last, (1, last));
                }
            }
            before = now;
        }
        if let Err(fault) = walk.check() {
            eprintln!("hour {hour}: {fault}");
            return ExitCode::FAILURE;
        }
        let mean = (last - hour_begin.1) / (strides - hour_begin.0) as f64;
        if hour == 0 || hour + 1 == hours {
            println!("hour {hour}: {mean:.6} ms a stride, amplitude {:.4}", walk.amplitude());
        }
        hour_begin = (strides, last);
    }

    let want = f64::from(STRIDE_SECONDS * 1e3);
    let slip = last - first - (strides - 1) as f64 * want;
    let nanos = started.elapsed().as_secs_f64() * 1e9 / (hours * TICKS_AN_HOUR) as f64;
    let error = TAU * slip / want;
    // All strides but the two at the ends, which are not whole: a walk that stands keeps the phase of its last stride.
    let least = (hours * TICKS_AN_HOUR) as f64 / want - 2.0;
    println!(
        "{hours} h: {strides} strides, {slip:.3} ms or {error:.5} rad from {want} ms each, at most {MOST_ERROR} rad; {nanos:.1} ns a tick"
    );
    let is_right = error.abs() <= MOST_ERROR && strides as f64 >= least;
    if is_right { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
