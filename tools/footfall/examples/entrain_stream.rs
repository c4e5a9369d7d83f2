//! The core that entrains as a filter, for benches: angles of the left hip in degrees from standard input, one a line and a millisecond
//! (`nan` for a sample that is none); to standard output phase in cycles (of the estimator and driven), stride frequency in Hz, amplitude
//! and state, one line each; to standard error the mean time of an update. The argument is the stride in seconds that it starts from.
//!
//! ```text
//! cargo run --profile host -p footfall --example entrain_stream -- 1.3 < angles.txt
//! ```

use cpg_core::{Follow, Generator};
use footfall::command::entrain::default_generator;
use gait_fit::following::run;
use joint_units::{Joint, Radians};
use std::fmt::Write as _;
use std::io::Read as _;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let default = default_generator(Joint::LeftHip)?;
    let [Some(a), Some(b), Some(c), Some(d)] = default.templates else {
        return Err("the default recording has four joints".into());
    };
    let stride_s = std::env::args().nth(1).map_or(Ok(1.1), |text| text.parse())?;
    let mut legs = run::follower([a, b, c, d], Joint::LeftHip, stride_s)?;
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text)?;
    let samples = text.lines().map(|line| line.trim().parse::<f32>()).collect::<Result<Vec<_>, _>>()?;

    let (mut out, mut spent) = (String::new(), std::time::Duration::ZERO);
    for &sample in &samples {
        let begin = Instant::now();
        legs.observe(Some(Radians::from_degrees(sample)));
        legs.step();
        let angles = legs.angles();
        spent += begin.elapsed();
        std::hint::black_box(angles);
        let (lock, status) = (legs.phase_lock(), legs.status());
        writeln!(
            out,
            "{:.6} {:.6} {:.5} {:.4} {}",
            lock.phase().cycles(),
            legs.phase().cycles(),
            1.0 / status.stride_s,
            legs.amplitude(),
            status.state.name()
        )?;
    }
    print!("{out}");
    eprintln!("{:.3}", spent.as_secs_f64() * 1e6 / samples.len() as f64);
    Ok(())
}
