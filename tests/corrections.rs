//! Corrections of a follower on recorded people, on the host core: learned in one recording, used in another and with sensors that are not
//! those of the recording.

use cpg_core::entrainment::{Corrections, Follower};
use footfall::command::entrain::run::{self, Tick};
use footfall_tests::degraded::{self, Series};
use footfall_tests::people::{PEOPLE, Person, people_of};
use footfall_tests::statistics::rms;
use gait_fit::corrections::{Learned, Recorded, learn};
use joint_units::Joint;
use std::process::ExitCode;
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        another_gait_is_at_most_a_little_worse(Traces),
        a_degraded_sensor_does_not_spoil_the_joints(Traces),
    ])
}

fn learned(person: &Person, sensor: Joint) -> Learned {
    let samples: Series = person.samples(sensor).into_iter().map(Some).collect();
    let joints = Joint::ALL.map(|joint| person.samples(joint));
    let recorded = Recorded { samples: &samples, joints: joints.each_ref().map(Vec::as_slice) };
    learn(person.legs(sensor), &recorded).expect("enough strides")
}

/// Root mean square error of each joint from the 15th second on, degrees.
fn errors(person: &Person, ticks: &[Tick]) -> [f64; Joint::COUNT] {
    Joint::ALL.map(|joint| {
        let recorded = person.samples(joint);
        let off = ticks.iter().zip(recorded).skip(15_000).map(|(tick, angle)| tick.angles[joint as usize] - angle);
        rms(&off.collect::<Vec<_>>())
    })
}

fn with_and_without(person: &Person, legs: Follower, corrections: Corrections, samples: &Series) -> [[f64; 4]; 2] {
    [legs.with_corrections(&corrections).expect("corrections"), legs].map(|mut legs| {
        let ticks = run::run(&mut legs, samples.iter().copied());
        errors(person, &ticks)
    })
}

/// A runner whose knees bend by a third more or less: the corrections of the other run are a guess there, and some joints are worse for it.
fn another_gait_is_at_most_a_little_worse() {
    let names = ["welker_007_run_natural", "welker_007_run_exotendon"];
    for sensor in Joint::ALL {
        let people = people_of(&names, sensor);
        for (person, other) in [(&people[0], &people[1]), (&people[1], &people[0])] {
            let corrections = learned(other, sensor).corrections;
            let samples = degraded::sound(&person.samples(sensor));
            let legs = run::follower(other.templates, sensor, other.learned.stride_s).expect("built");
            let [with, without] = with_and_without(person, legs, corrections, &samples);
            report!("{} {}: {with:.2?} with, {without:.2?} without", person.name, sensor.name());
            let worse = with.iter().zip(without).map(|(with, without)| with - without).fold(0.0, f64::max);
            assert!(worse < 2.6, "{} {}: {worse} degrees worse", person.name, sensor.name());
        }
    }
}

/// 13 copies of each sensor.
fn a_degraded_sensor_does_not_spoil_the_joints() {
    for sensor in [Joint::LeftHip, Joint::RightKnee] {
        for person in people_of(&PEOPLE, sensor) {
            let corrections = learned(&person, sensor).corrections;
            let angles = person.samples(sensor);
            for (name, samples) in [
                ("sound", degraded::sound(&angles)),
                ("noise 0.1", degraded::noise(&angles, 0.1, 3)),
                ("noise 0.5", degraded::noise(&angles, 0.5, 3)),
                ("noise 1.0", degraded::noise(&angles, 1.0, 3)),
                ("quantised", degraded::quantised(&angles, 300.0)),
                ("offset 8", degraded::miscalibrated(&angles, 8.0, 1.0)),
                ("gain 1.2", degraded::miscalibrated(&angles, 0.0, 1.2)),
                ("gain 0.8", degraded::miscalibrated(&angles, 0.0, 0.8)),
                ("spikes", degraded::spikes(&angles, 200, 20.0, 1)),
                ("hum", degraded::mains_hum(&angles, 1.0)),
                ("drift", degraded::drift(&angles, 0.1)),
                ("dropout", degraded::dropout(&angles, 20_000..21_000)),
                ("stuck", degraded::stuck(&angles, 20_000..21_000)),
            ] {
                let [with, without] = with_and_without(&person, person.legs(sensor), corrections, &samples);
                report!("{} {} {name}: {with:.2?} with, {without:.2?} without", person.name, sensor.name());
                for joint in Joint::ALL {
                    let (with, without) = (with[joint as usize], without[joint as usize]);
                    let most = 1.03 * without + 0.1;
                    assert!(with <= most, "{} {} {name}, {joint:?}: {with} {without}", person.name, sensor.name());
                }
                if !["drift", "dropout", "stuck"].contains(&name) {
                    assert!(with[sensor as usize] < 0.6, "{} {} {name}: {with:?}", person.name, sensor.name());
                }
            }
        }
    }
}
