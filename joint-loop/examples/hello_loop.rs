//! Arms, walks and stops the loop with the default walk: `cargo run -p joint-loop --example hello_loop` prints state, knee angle and pulses every 250 ms.

use cpg_core::Unguided;
use cpg_core::gait::default_walk::default_walk;
use joint_loop::{LoopConfig, Sample};
use joint_units::{Joint, Period};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The default walk is no follower and needs no sensor.
    let mut config = LoopConfig::default_biped();
    config.monitor.sensor_required = false;
    let walk = Unguided(default_walk(Period::MILLISECOND)?);
    let mut joints = config.build(Period::MILLISECOND, walk, [])?;

    for tick in 0..6_000 {
        // The release after a hold of 0.5 s arms, the second press stops at once.
        let button = (100..600).contains(&tick) || (4_500..4_600).contains(&tick);
        let command = joints.tick(&Sample { button, ..Sample::default() });
        if tick % 250 == 0 {
            let knee = joints.frame().setpoints[Joint::LeftKnee as usize].degrees();
            match command.pulses {
                Some(pulses) => {
                    println!("{:>9} {knee:5.1} deg {:?} us", joints.state().name(), pulses.map(|pulse| pulse.0))
                }
                None => println!("{:>9} {knee:5.1} deg outputs off", joints.state().name()),
            }
        }
    }
    Ok(())
}
