//! Feedback of the joints' angles: makes a joint stiffer or softer than its servo.
//!
//! ```text
//! target = blend + weight * added,     added = feedback * (last setpoint - measured angle),   at most 10 degrees to either side
//! ```
//! `added` is computed once in a servo frame, in the tick whose setpoint becomes the next pulse. It compares what the servo has followed in the frame
//! that ends with where the joint is now: the *last setpoint* is that of the pulse before, with what was added to it then, and the measured angle is that
//! of this tick. In the 20 ms between, `added` stays as it is, and the gate leads the setpoint there within rate and acceleration.
//!
//! Since the last setpoint has the feedback of its own frame, a joint that stays at a distance from the blend gets `feedback / (1 - feedback)` of it in
//! the end, in steps of which each is `feedback` times the one before. A share of at most [`MOST_SHARE`] keeps that at four times the distance, and
//! [`MOST_ADDED`] bounds it.
//!
//! The sum is the target of the blend, bit for bit, where a sample of the joint's sensor is not good; and by the weight it begins and ends with the ramps
//! at the park pose. With a feedback above 0 a joint is stiffer, below 0 softer.

use core::num::NonZeroU32;

use crate::error::{LoopError, inside, ticks};
use joint_units::{Joint, Period, Radians};

/// Largest share of either sign.
pub const MOST_SHARE: f32 = 0.8;
/// Largest angle that is added to a target, to either side. A hobby servo has its whole torque at some 5 degrees from its pulse: as much again is left for
/// the motion of a servo frame, and more would only be a larger motion when the joint is free again.
pub const MOST_ADDED: Radians = Radians::from_degrees(10.0);
/// Time from one servo pulse to the next, s.
const FRAME_S: f32 = 0.02;

/// Feedback of each joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedbackConfig {
    /// Share of the distance from a joint to its last setpoint that is added to its next target. Above 0 stiffer, below 0 softer, 0 none; no unit, -0.8 to 0.8.
    pub share: [f32; Joint::COUNT],
    /// Channel of the sensor on each joint, counted from 0; `None` on a joint without a sensor, which has no share.
    pub channel: [Option<usize>; Joint::COUNT],
}

impl FeedbackConfig {
    /// No feedback.
    pub const NONE: Self = Self { share: [0.0; Joint::COUNT], channel: [None; Joint::COUNT] };

    /// Checks the shares alone.
    pub(crate) fn check_shares(share: &[f32; Joint::COUNT]) -> Result<(), LoopError> {
        for (joint, share) in Joint::ALL.into_iter().zip(share) {
            inside("robot.feedback", Some(joint), *share, -MOST_SHARE, MOST_SHARE, "")?;
        }
        Ok(())
    }

    /// Checks the shares and their sensors; `None` if no joint has feedback. `has_sensor` says whether a channel has one, `followed` is the channel of the
    /// person whom the generator follows.
    ///
    /// # Errors
    /// [`LoopError`] names the first joint whose share is not allowed, and why.
    pub(crate) fn build(
        &self,
        period: Period,
        has_sensor: impl Fn(usize) -> bool,
        followed: Option<usize>,
    ) -> Result<Option<Feedback>, LoopError> {
        Self::check_shares(&self.share)?;
        let mut sources = [None; Joint::COUNT];
        let joints = Joint::ALL.into_iter().zip(self.share).zip(self.channel);
        for (source, ((joint, share), channel)) in sources.iter_mut().zip(joints) {
            if share == 0.0 {
                continue;
            }
            let Some(channel) = channel.filter(|channel| has_sensor(*channel)) else {
                return Err(LoopError::FeedbackWithoutSensor { joint, share });
            };
            if followed == Some(channel) {
                return Err(LoopError::FeedbackOfPerson { joint, share });
            }
            *source = Some(Source { channel, share });
        }
        let frame = ticks("feedback.frame_s", FRAME_S, FRAME_S, FRAME_S, period)?;
        let frame = NonZeroU32::new(frame).unwrap_or(NonZeroU32::MIN);
        Ok(sources.iter().any(Option::is_some).then_some(Feedback { sources, frame }))
    }
}

/// What the feedback of a joint is computed from.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Source {
    channel: usize,
    share: f32,
}

/// A checked [`FeedbackConfig`] in which at least one joint has feedback.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Feedback {
    /// `None` for a joint without feedback.
    sources: [Option<Source>; Joint::COUNT],
    /// Servo frame, in ticks.
    frame: NonZeroU32,
}

/// State of the feedback.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FeedbackState {
    /// Setpoints of the last pulses; `None` from the tick that they are of to the next one, which takes them.
    last: Option<[Radians; Joint::COUNT]>,
    added: [Radians; Joint::COUNT],
}

impl FeedbackState {
    /// Nothing is added.
    pub(crate) const NONE: Self = Self { last: None, added: [Radians(0.0); Joint::COUNT] };
}

impl Feedback {
    /// What is added to the targets in a tick, rad, before its weight. `tick` and `elapsed` count periods since the boot and since the tick before,
    /// `before` are the setpoints of the tick before; `measured` gives the angle of a channel, `None` while its sample is not good.
    ///
    /// Frames and ticks start together on a board: a pulse has the width of a tick whose number is one less than a multiple of the frame, or
    /// of the next one, as the firmware's timer has it.
    pub(crate) fn step(
        &self,
        state: &mut FeedbackState,
        tick: u32,
        elapsed: u32,
        before: [Radians; Joint::COUNT],
        measured: impl Fn(usize) -> Option<Radians>,
    ) -> [Radians; Joint::COUNT] {
        let last = *state.last.get_or_insert(before);
        let is_new_frame = tick.wrapping_add(1) % self.frame < elapsed;
        for ((added, source), last) in state.added.iter_mut().zip(&self.sources).zip(last) {
            let Some(source) = source else { continue };
            *added = match measured(source.channel) {
                None => Radians(0.0),
                Some(angle) if is_new_frame => bounded(source.share * (last.0 - angle.0)),
                Some(_) => *added,
            };
        }
        if is_new_frame {
            state.last = None;
        }
        state.added
    }
}

/// The angle within [`MOST_ADDED`]; 0 for NaN. Compares, since `clamp` can panic, and `f32::max` and `f32::min` are calls on this processor.
fn bounded(angle: f32) -> Radians {
    let most = MOST_ADDED.0;
    Radians(if angle >= -most && angle <= most {
        angle
    } else if angle > most {
        most
    } else if angle < -most {
        -most
    } else {
        0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const KNEE: usize = Joint::LeftKnee as usize;

    fn config(share: f32) -> FeedbackConfig {
        let mut config = FeedbackConfig::NONE;
        (config.share[KNEE], config.channel[KNEE]) = (share, Some(1));
        config
    }

    fn feedback(share: f32) -> Feedback {
        config(share).build(Period::MILLISECOND, |channel| channel == 1, None).expect("allowed").expect("a share")
    }

    /// What is added to the left knee over so many ticks from the boot on, with these setpoints and angles of it.
    fn added(share: f32, ticks: u32, setpoint: impl Fn(u32) -> f32, angle: impl Fn(u32) -> Option<f32>) -> Vec<f32> {
        let (feedback, mut state) = (feedback(share), FeedbackState::NONE);
        let one = |tick| {
            let mut before = [Radians(9.0); Joint::COUNT];
            before[KNEE] = Radians(setpoint(tick - 1));
            let all = feedback.step(&mut state, tick, 1, before, |channel| {
                assert_eq!(channel, 1);
                angle(tick).map(Radians)
            });
            assert!((0..Joint::COUNT).all(|joint| joint == KNEE || all[joint] == Radians(0.0)), "{all:?}");
            all[KNEE].0
        };
        (1..=ticks).map(one).collect()
    }

    #[test]
    fn it_is_the_share_of_the_distance_to_the_last_setpoint() {
        // The setpoint of a tick is its number, so that each is another one: the pulse before tick 39 has that of tick 19.
        let setpoint = |tick: u32| 0.001 * tick as f32;
        for share in [0.3_f32, -0.8] {
            let found = added(share, 70, setpoint, |tick| Some(0.001 * tick as f32 - 0.05));
            assert_eq!(found[..18], [0.0; 18]);
            for (tick, pulse) in [(39_u32, 19_u32), (59, 39)] {
                let want = share * (setpoint(pulse) - (0.001 * tick as f32 - 0.05));
                // From this tick on for a servo frame.
                for at in tick..(tick + 20).min(70) {
                    assert_eq!(found[at as usize - 1], want, "tick {at}");
                }
                assert!(want.signum() == share.signum() && want != 0.0);
            }
        }
    }

    #[test]
    fn a_joint_that_stays_away_gets_no_more_than_the_sum_of_a_series() {
        // The setpoint is the pattern's, 0, and what was added; the joint does not move.
        let (feedback, mut state) = (feedback(0.5), FeedbackState::NONE);
        let mut setpoints = [Radians(0.0); Joint::COUNT];
        let mut seen = Vec::new();
        for tick in 1..=400 {
            setpoints = feedback.step(&mut state, tick, 1, setpoints, |_| Some(Radians(-0.1)));
            seen.push(setpoints[KNEE].0);
        }
        // 0.5 / (1 - 0.5) of the distance, by halves: nothing accumulates.
        for (frame, want) in [(1, 0.05), (2, 0.075), (3, 0.0875), (19, 0.1)] {
            assert!((seen[20 * frame] - want).abs() < 1e-6, "frame {frame}: {}", seen[20 * frame]);
        }
    }

    #[test]
    fn what_is_added_is_bounded() {
        let most = MOST_ADDED.0;
        for (share, distance, want) in [(0.8, 1.0, most), (0.8, -1.0, -most), (-0.8, 1.0, -most), (-0.8, -1.0, most)] {
            let found = added(share, 40, |_| distance, |_| Some(0.0));
            assert_eq!(found[39], want);
        }
        assert_eq!([f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(|angle| bounded(angle).0), [0.0, most, -most]);
    }

    #[test]
    fn a_sample_that_is_not_good_ends_it_at_once() {
        let found = added(0.3, 80, |_| 0.1, |tick| (!(45..50).contains(&tick)).then_some(0.0));
        assert_eq!((found[43], found[44]), (0.3 * 0.1, 0.0));
        // Until the next servo frame.
        assert_eq!((found[57], found[58]), (0.0, 0.3 * 0.1));
    }

    #[test]
    fn a_frame_with_missed_ticks_has_one_step() {
        let (feedback, mut state) = (feedback(0.3), FeedbackState::NONE);
        let mut step = |tick, elapsed, setpoint: f32| {
            let all = feedback.step(&mut state, tick, elapsed, [Radians(setpoint); 4], |_| Some(Radians(0.0)));
            all[KNEE].0
        };
        assert_eq!(step(1, 1, 0.0), 0.0);
        // Ticks 18 to 20 are missed, 19 among them.
        assert_eq!((step(17, 16, 0.1), step(21, 4, 0.2)), (0.0, 0.0));
        // The setpoint of tick 21 is that of the pulse.
        assert_eq!((step(22, 1, 0.1), step(38, 16, 0.5), step(39, 1, 0.6)), (0.0, 0.0, 0.3 * 0.1));
        // After a gap of more than a frame.
        assert_eq!((step(40, 1, 0.2), step(105, 65, 0.3)), (0.3 * 0.1, 0.3 * 0.2));
    }

    #[test]
    fn what_is_not_allowed_is_refused_with_its_joint() {
        let build = |config: FeedbackConfig, followed| {
            config.build(Period::MILLISECOND, |channel| channel == 1, followed).map(|found| found.is_some())
        };
        assert_eq!(build(FeedbackConfig::NONE, Some(0)), Ok(false));
        for share in [-0.8, 0.8, 0.001] {
            assert_eq!((build(config(share), None), build(config(share), Some(0))), (Ok(true), Ok(true)));
        }
        for (share, words) in [
            (0.81, "robot.feedback[left_knee] is 0.81; allowed are -0.8 to 0.8"),
            (-1.0, "robot.feedback[left_knee] is -1; allowed are -0.8 to 0.8"),
            (f32::NAN, "robot.feedback[left_knee] is not a finite number"),
            (f32::INFINITY, "robot.feedback[left_knee] is not a finite number"),
        ] {
            assert_eq!(build(config(share), None).unwrap_err().to_string(), words);
        }
        for channel in [None, Some(0), Some(7)] {
            let mut config = config(-0.25);
            config.channel[KNEE] = channel;
            let error = build(config, None).unwrap_err();
            assert_eq!(error, LoopError::FeedbackWithoutSensor { joint: Joint::LeftKnee, share: -0.25 });
        }
        let error = build(config(0.3), Some(1)).unwrap_err();
        assert_eq!(error, LoopError::FeedbackOfPerson { joint: Joint::LeftKnee, share: 0.3 });
    }

    proptest! {
        #[test]
        fn it_is_bounded_and_finite_for_any_numbers(
            share in -0.8_f32..=0.8, calls in prop::collection::vec((any::<u32>(), 1_u32..=255, any::<u32>(), prop::option::of(any::<u32>())), 1..60),
        ) {
            let (feedback, mut state) = (feedback(if share == 0.0 { 0.1 } else { share }), FeedbackState::NONE);
            for (tick, elapsed, setpoint, angle) in calls {
                let before = [Radians(f32::from_bits(setpoint)); Joint::COUNT];
                let all = feedback.step(&mut state, tick, elapsed, before, |_| angle.map(|bits| Radians(f32::from_bits(bits))));
                prop_assert!(all.iter().all(|angle| angle.0.abs() <= MOST_ADDED.0));
            }
        }
    }
}
