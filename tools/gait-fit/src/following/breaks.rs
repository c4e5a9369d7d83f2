//! False stops and phase slips of a follower, found with the recording alone: its angle and its phase, never the follower's own detector.
//!
//! **The person moves on** at a time if, from one stride before it to one stride after it,
//! - the phase of the recording ([`Learned::phase`], which uses later samples and all joints) advances in each quarter of a stride by half to
//!   twice of what the mean stride does,
//! - the recorded joint's range in the stride before and in the stride after is at least half of its template's, and
//! - it travels in each half of a stride at least [`TRAVEL_FRACTION`] of what its template does there.
//!
//! A time without a full stride to both sides is not judged, nor is one within a stride of samples that were not measured.
//!
//! A **false stop** is a span, after the first lock with all of the amplitude, in which the follower fades, stands or holds. It begins while
//! the person moves on, or it lasts while the person has moved on for [`LATE_S`].
//!
//! A **phase slip** is a phase error that passes half a cycle, or changes by [`JUMP_DEG`] or more within [`JUMP_S`], while a lock with all of
//! the amplitude is reported and the person moves on. The next slip counts when the error has been steady for a stride.

use cpg_core::entrainment::phase_lock::Template;
use cpg_core::entrainment::{Lock, SensorFault};
use gait_trace::Recording;
use joint_units::Joint;

use super::learn::{Learned, RATE_HZ, angle_deg};
use super::tick::{TICKS_PER_S, Tick, phase_error_deg};

/// Travel of the joint in half a stride, as a fraction of that of its template, from which on it moves.
pub const TRAVEL_FRACTION: f64 = 0.5;
/// Time after which a person who walks again must be followed again, s: a certified follower locks within 4 s.
pub const LATE_S: f64 = 5.0;
/// Change of the phase error that is a slip, degrees of the stride, and the time within which it changes, s.
pub const JUMP_DEG: f64 = 60.0;
/// See [`JUMP_DEG`].
pub const JUMP_S: f64 = 0.5;

/// A span in which the follower does not walk although the person does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FalseStop {
    /// Begin of the fade or of the hold, s.
    pub from_s: f64,
    /// When the follower is locked again with all of its amplitude, or the end of the recording, s.
    pub to_s: f64,
    /// State at the begin.
    pub state: Lock,
    /// Fault of the sensor that the follower reports at the begin.
    pub fault: Option<SensorFault>,
}

/// A phase slip during a reported lock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slip {
    /// When, s.
    pub at_s: f64,
    /// The phase error then, degrees of the stride.
    pub error_deg: f64,
}

/// The recorded joint with the sensor, its template and its phase.
#[derive(Debug, Clone, Copy)]
pub struct Person<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// The joint with the sensor.
    pub sensor: Joint,
    /// Phase and stride.
    pub learned: &'a Learned,
    /// The template of the joint.
    pub template: &'a Template,
    /// Spans that were not measured, s.
    pub holes: &'a [(f64, f64)],
}

/// Whether the person moves on at each row of [`Learned::phase`].
#[must_use]
pub fn moves_on(person: &Person<'_>) -> Vec<bool> {
    let Person { recording, sensor, learned, template, holes } = *person;
    let rows = learned.phase.len();
    let Ok(channel) = recording.of_joint(sensor) else { return vec![false; rows] };
    let start = recording.time_s()[0];
    let time = |row: usize| row as f64 / RATE_HZ;
    let angle: Vec<f64> = (0..rows).map(|row| recording.at(channel, start + time(row))).collect();
    let expected: Vec<f64> = learned.phase.iter().map(|&phase| angle_deg(template, phase)).collect();
    let travel = |of: &[f64]| {
        let steps = of.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        std::iter::once(0.0)
            .chain(steps.scan(0.0, |sum, step| {
                *sum += step;
                Some(*sum)
            }))
            .collect::<Vec<f64>>()
    };
    let (gone, due) = (travel(&angle), travel(&expected));
    let stride = ((learned.stride_s * RATE_HZ) as usize).max(8);
    let (quarter, half) = (stride / 4, stride / 2);
    let cycle = (0..200).map(|n| angle_deg(template, f64::from(n) / 200.0));
    let range = spread(cycle.clone());
    let quarter_cycles = quarter as f64 / (RATE_HZ * learned.stride_s);
    // Of the spans that begin at a row: a quarter of a stride advances, half a stride travels, a stride has its range.
    let good: Vec<bool> = (0..rows)
        .map(|row| {
            let turned = learned.phase.get(row + quarter).map(|after| (after - learned.phase[row]) / quarter_cycles);
            let travelled = gone.get(row + half).zip(due.get(row + half));
            turned.is_some_and(|turned| (0.5..=2.0).contains(&turned))
                && travelled.is_some_and(|(to, due_to)| to - gone[row] >= TRAVEL_FRACTION * (due_to - due[row]))
                && !holes.iter().any(|&(from, to)| from <= time(row + half) && time(row) <= to)
        })
        .collect();
    let wide: Vec<bool> = (0..rows)
        .map(|row| angle.get(row..=row + stride).is_some_and(|part| spread(part.iter().copied()) >= 0.5 * range))
        .collect();
    let bad = good
        .iter()
        .scan(0usize, |sum, &good| {
            *sum += usize::from(!good);
            Some(*sum)
        })
        .collect::<Vec<_>>();
    (0..rows)
        .map(|row| {
            let (Some(from), to) = (row.checked_sub(stride), row + stride - half) else { return false };
            wide[from] && wide[row] && bad[to] == from.checked_sub(1).map_or(0, |at| bad[at])
        })
        .collect()
}

/// The value of the row of a tick; no row, no motion.
fn at_tick(moves_on: &[bool], tick: usize) -> bool {
    moves_on.get((tick as f64 * RATE_HZ / TICKS_PER_S) as usize).copied().unwrap_or(false)
}

/// Largest less least value.
fn spread(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
    high - low
}

/// The false stops of a run.
#[must_use]
pub fn false_stops(ticks: &[Tick], moves_on: &[bool]) -> Vec<FalseStop> {
    let time = |tick: usize| tick as f64 / TICKS_PER_S;
    let moves = |tick: usize| at_tick(moves_on, tick);
    let walks = |tick: &Tick| tick.amplitude >= 1.0 && matches!(tick.state, Lock::Locked | Lock::Seeking);
    let Some(first) = ticks.iter().position(|tick| tick.amplitude >= 1.0) else { return vec![] };
    let late = (LATE_S * TICKS_PER_S) as usize;
    let (mut found, mut begin, mut moved, mut counts) = (vec![], None::<(Tick, usize)>, 0, false);
    for (n, tick) in ticks.iter().enumerate().skip(first) {
        if !walks(tick) {
            if begin.is_none() {
                (begin, counts, moved) = (Some((*tick, n)), moves(n), 0);
            }
            moved = if moves(n) { moved + 1 } else { 0 };
            counts |= moved >= late;
        }
        if walks(tick) || n + 1 == ticks.len() {
            if let Some((tick, at)) = begin.take().filter(|_| counts) {
                found.push(FalseStop { from_s: time(at), to_s: time(n), state: tick.state, fault: tick.fault });
            }
            counts = false;
        }
    }
    found
}

/// The phase slips of a run.
#[must_use]
pub fn slips(ticks: &[Tick], learned: &Learned, moves_on: &[bool]) -> Vec<Slip> {
    let time = |tick: usize| tick as f64 / TICKS_PER_S;
    let (back, steady) = ((JUMP_S * TICKS_PER_S) as usize, (learned.stride_s * TICKS_PER_S) as usize);
    // The unwrapped errors of the lock so far.
    let (mut errors, mut found): (Vec<f64>, Vec<Slip>) = (vec![], vec![]);
    let mut quiet = usize::MAX;
    for (n, tick) in ticks.iter().enumerate() {
        if tick.state != Lock::Locked || tick.amplitude < 1.0 || !at_tick(moves_on, n) {
            errors.clear();
            quiet = usize::MAX;
            continue;
        }
        let wrapped = phase_error_deg(tick, learned.phase_at(time(n)));
        let error = errors.last().map_or(wrapped, |last: &f64| wrapped + 360.0 * ((last - wrapped) / 360.0).round());
        let half_turns = |error: f64| ((error + 180.0) / 360.0).floor();
        let passed = errors.last().is_some_and(|&last| half_turns(last) != half_turns(error));
        let jumped = errors.len() >= back && (error - errors[errors.len() - back]).abs() >= JUMP_DEG;
        errors.push(error);
        if passed || jumped {
            if quiet >= steady {
                found.push(Slip { at_s: time(n), error_deg: wrapped });
            }
            quiet = 0;
        } else {
            quiet = quiet.saturating_add(1);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use cpg_core::waveform::shape::Shape;
    use gait_trace::{Channel, Quantity};
    use joint_units::{Phase, Radians};
    use std::f64::consts::TAU;

    const STRIDE_S: f64 = 1.0;

    fn template() -> Template {
        Template::new(Radians(0.1), [0.35, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 8]).unwrap()
    }

    /// A person who walks for 40 s with a pause from 15 to 18 s, and when the person moves on.
    fn person() -> (Recording, Learned, Vec<bool>) {
        let cycles = |t: f64| (t.min(15.0) + (t - 18.0).max(0.0)) / STRIDE_S;
        let times: Vec<f64> = (0..=8000).map(|n| f64::from(n) / RATE_HZ).collect();
        let angle = times.iter().map(|&t| angle_deg(&template(), cycles(t))).collect();
        let phase = times.iter().map(|&t| cycles(t)).collect();
        let recording = Recording::build(times, vec![Channel::new("left_hip", Quantity::Angle, angle)]).unwrap();
        let templates = [Some(template()), None, None, None];
        let learned = Learned { templates, stride_s: STRIDE_S, window_s: (0.0, 12.0), phase };
        let person = Person {
            recording: &recording,
            sensor: Joint::LeftHip,
            learned: &learned,
            template: &template(),
            holes: &[(30.0, 31.0)],
        };
        let moves_on = moves_on(&person);
        (recording, learned, moves_on)
    }

    /// A follower that is locked on the phase plus an error in degrees.
    fn ticks(learned: &Learned, error_deg: impl Fn(f64) -> f64, amplitude: impl Fn(f64) -> f32) -> Vec<Tick> {
        let tick = |n: usize| {
            let time = n as f64 / TICKS_PER_S;
            let cycles = learned.phase_at(time) - error_deg(time) / 360.0;
            let phase = Phase::from_cycles(cycles.rem_euclid(1.0) as f32);
            let amplitude = amplitude(time);
            let state = if amplitude < 1.0 { Lock::Stopped } else { Lock::Locked };
            let (angles, rates) = ([0.0; 4], [0.0; 4]);
            Tick { angles, rates, phase, estimate: phase, amplitude, state, fault: None, frequency: TAU }
        };
        (0..40_000).map(tick).collect()
    }

    #[test]
    fn a_person_moves_on_except_near_pauses_holes_and_ends() {
        let (_, _, moves_on) = person();
        let at = |time: f64| moves_on[(time * RATE_HZ) as usize];
        for (time, expected) in [
            (0.5, false),
            (1.5, true),
            (13.5, true),
            (14.5, false),
            (16.5, false),
            (18.5, false),
            (19.5, true),
            (28.5, true),
            (30.5, false),
            (32.5, true),
            (38.5, true),
            (39.5, false),
        ] {
            assert_eq!(at(time), expected, "{time} s");
        }
    }

    /// Whether a person moves on at 10 s: of the angle by time and cycles, and of the cycles by time.
    fn moves_at_10_s(angle: impl Fn(f64, f64) -> f64, cycles: impl Fn(f64) -> f64) -> bool {
        let times: Vec<f64> = (0..=4000).map(|n| f64::from(n) / RATE_HZ).collect();
        let values = times.iter().map(|&t| angle(t, cycles(t))).collect();
        let phase = times.iter().map(|&t| cycles(t)).collect();
        let recording = Recording::build(times, vec![Channel::new("left_hip", Quantity::Angle, values)]).unwrap();
        let templates = [Some(template()), None, None, None];
        let learned = Learned { templates, stride_s: STRIDE_S, window_s: (0.0, 12.0), phase };
        let (sensor, template) = (Joint::LeftHip, &template());
        let moves = moves_on(&Person { recording: &recording, sensor, learned: &learned, template, holes: &[] });
        moves[(10.0 * RATE_HZ) as usize]
    }

    #[test]
    fn a_phase_or_a_joint_that_does_not_go_on_is_no_walk() {
        let (walks, steady) = (|_: f64, c: f64| angle_deg(&template(), c), |t: f64| t / STRIDE_S);
        assert!(moves_at_10_s(walks, steady));
        let mean = f64::from(template().mean()).to_degrees();
        let scaled = |by: f64| move |_: f64, c: f64| mean + by * (angle_deg(&template(), c) - mean);
        assert!(moves_at_10_s(scaled(0.6), steady) && !moves_at_10_s(scaled(0.4), steady), "range");
        // The phase pauses, or goes on three times as fast, for 0.3 s before or after.
        for (from, rate) in [(9.3, 0.0), (10.4, 0.0), (9.3, 3.0), (10.4, 3.0)] {
            let hurries = |t: f64| steady(t) + (rate - 1.0) * (t - from).clamp(0.0, 0.3) / STRIDE_S;
            assert!(!moves_at_10_s(walks, hurries), "rate {rate} from {from} s");
        }
        // The joint rests for 0.6 s, and moves in the rest of the stride.
        for from in [9.1, 10.3] {
            let rests = |t: f64, c: f64| if (from..from + 0.6).contains(&t) { walks(t, from) } else { walks(t, c) };
            assert!(!moves_at_10_s(rests, steady), "rests from {from} s");
        }
        // In one of the two strides beside it the joint trembles: a long way, and a small range.
        let trembles = |c: f64| mean + 4.0 * (6.0 * TAU * c).cos();
        for side in [-1.0, 1.0] {
            let half = |t: f64, c: f64| if side * (t - 10.0) > -0.01 { trembles(c) } else { walks(t, c) };
            assert!(!moves_at_10_s(half, steady), "side {side}");
        }
    }

    #[test]
    fn a_hold_is_a_stop_and_a_search_at_full_amplitude_is_none() {
        let (_, learned, moves_on) = person();
        let stops = |change: &dyn Fn(&mut Tick)| {
            let mut run = ticks(&learned, |_| 0.0, |_| 1.0);
            run[10_000..11_000].iter_mut().for_each(change);
            false_stops(&run, &moves_on)
        };
        let [stop] = stops(&|tick| (tick.state, tick.fault) = (Lock::Holding, Some(SensorFault::Stuck)))[..] else {
            panic!("one stop")
        };
        assert_eq!((stop.state, stop.fault), (Lock::Holding, Some(SensorFault::Stuck)));
        assert!((stop.from_s - 10.0).abs() < 0.01 && (stop.to_s - 11.0).abs() < 0.01, "{stop:?}");
        assert_eq!(stops(&|tick| tick.state = Lock::Seeking), []);
        assert_eq!(stops(&|tick| tick.amplitude = 0.9).len(), 1, "a fade");
        // Two stops are two, and one that is true does not count for the next.
        let twice = |t: f64| if (6.0..7.0).contains(&t) || (10.0..11.0).contains(&t) { 0.0 } else { 1.0 };
        assert_eq!(false_stops(&ticks(&learned, |_| 0.0, twice), &moves_on).len(), 2);
        let next = |t: f64| if (10.0..11.0).contains(&t) || (15.3..18.2).contains(&t) { 0.0 } else { 1.0 };
        assert_eq!(false_stops(&ticks(&learned, |_| 0.0, next), &moves_on).len(), 1);
        // While it stands the person moves on for 4 s twice, and never for 5 s at a stretch.
        let rows = (0..8000).map(|row| f64::from(row) / RATE_HZ);
        let twice: Vec<bool> = rows.map(|t| (4.0..8.0).contains(&t) || (9.0..13.0).contains(&t)).collect();
        let stands = |t: f64| if (3.5..13.5).contains(&t) { 0.0 } else { 1.0 };
        assert_eq!(false_stops(&ticks(&learned, |_| 0.0, stands), &twice), []);
    }

    #[test]
    fn a_stop_is_false_while_the_person_moves_on_or_when_it_lasts() {
        let (_, learned, moves_on) = person();
        let stops = |from: f64, to: f64| {
            let stood = |t: f64| if t < 3.0 || (from..to).contains(&t) { 0.0 } else { 1.0 };
            false_stops(&ticks(&learned, |_| 0.0, stood), &moves_on)
        };
        assert_eq!(stops(0.0, 0.0), [], "the time before the first lock is no stop");
        let late_lock = |t: f64| if t < 8.0 { 0.0 } else { 1.0 };
        assert_eq!(false_stops(&ticks(&learned, |_| 0.0, late_lock), &moves_on), [], "nor if it is long");
        let [stop] = stops(10.0, 11.2)[..] else { panic!("one stop") };
        assert!((stop.from_s - 10.0).abs() < 0.01 && (stop.to_s - 11.2).abs() < 0.01, "{stop:?}");
        assert_eq!((stop.state, stop.fault), (Lock::Stopped, None));
        assert_eq!(stops(15.3, 21.0), [], "a real pause, and 3 s until it is followed again");
        assert_eq!(stops(30.2, 33.0), [], "a sensor without samples");
        assert_eq!(stops(15.3, 25.5).len(), 1, "stands 6.5 s after the person walks again");
        assert_eq!(stops(35.0, 50.0).len(), 1, "until the end");
    }

    #[test]
    fn jumps_and_half_cycles_are_slips_and_a_slow_error_is_none() {
        let (_, learned, moves_on) = person();
        let found = |error: &dyn Fn(f64) -> f64| slips(&ticks(&learned, error, |_| 1.0), &learned, &moves_on);
        assert_eq!(found(&|t| 20.0 * (0.5 * t).sin()), []);
        let [slip] = found(&|t| if t < 10.0 { 5.0 } else { 80.0 })[..] else { panic!("one slip") };
        assert!((slip.at_s - 10.0).abs() < 0.01 && (slip.error_deg - 80.0).abs() < 1.0, "{slip:?}");
        // 20 degrees a second: half a cycle is passed at 9 s, one and a half after the pause and the hole, at 27 s.
        let passed: Vec<f64> = found(&|t| 20.0 * t).iter().map(|slip| slip.at_s).collect();
        assert!(passed.len() == 2 && (passed[0] - 9.0).abs() < 0.01 && (passed[1] - 27.0).abs() < 0.01, "{passed:?}");
        assert_eq!(found(&|t| if t < 16.5 { 5.0 } else { 80.0 }), [], "in a pause there is no phase");
        // In the other direction; twice within a stride is once, later it is twice; a change of 60 degrees in a second is none.
        assert_eq!(found(&|t| if t < 10.0 { 5.0 } else { -70.0 }).len(), 1);
        let back_after = |later: f64| move |t: f64| if (10.0..10.0 + later).contains(&t) { 80.0 } else { 5.0 };
        assert_eq!((found(&back_after(0.7)).len(), found(&back_after(3.0)).len()), (1, 2));
        assert_eq!(found(&|t| 50.0 * (t - 10.0).clamp(0.0, 2.0)), []);
        // Not while it fades or searches.
        let jump = |t: f64| if t < 10.0 { 5.0 } else { 80.0 };
        let mut run = ticks(&learned, jump, |_| 1.0);
        run[9_000..].iter_mut().for_each(|tick| tick.amplitude = 0.9);
        assert_eq!(slips(&run, &learned, &moves_on), []);
        let mut run = ticks(&learned, jump, |_| 1.0);
        run[9_900..10_100].iter_mut().for_each(|tick| tick.state = Lock::Seeking);
        assert_eq!(slips(&run, &learned, &moves_on), []);
    }
}
