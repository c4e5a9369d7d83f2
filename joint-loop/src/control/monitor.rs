//! What is watched, and what the supervisor is asked to do about it.
//!
//! | condition | while moving | otherwise |
//! |---|---|---|
//! | break input, clock, watchdog, outputs, a fault bit without a name | fault | fault |
//! | more than `fault_gap_s` of control periods without a tick | fault | fault |
//! | more than `stop_gap_s` of control periods without a tick | stop | arming refused |
//! | the generator does not pass its check | stop | arming refused |
//! | more overruns of the converter than `overruns_per_s` | stop | arming refused |
//! | a required sensor not good for more than `sensor_tolerance_s` | stop | arming refused, with no tolerance |
//! | the pose envelope held the setpoints back for more than `pose_tolerance_s` | stop | (cannot be) |
//!
//! Below its tolerance a condition is only counted. Tolerated times run down as fast as they run up: a sensor that is bad more
//! often than it is good uses its tolerance up too, however short each spell is.
//!
//! The cause of a sensor's stop is the name of its verdict. Where verdicts alternate it is the gravest ([`Validity::graver`]) of the last
//! `sensor_tolerance_s`, so at the end of the tolerance the gravest of all that used it up: an open wire that touches now and then, with
//! spikes and impossible rates in between, is an open wire. Of several sensors it is the gravest of each tick. [`crate::control::fault_table`] is the table
//! of verdicts, times and what follows.

use crate::control::button::Button;
use crate::control::supervisor::{Cause, Demand};
use crate::error::{LoopError, inside, ticks};
use crate::io::board::{BoardFaults, MAX_ELAPSED};
use hgod_adc::Validity;
use joint_units::Period;

/// What is tolerated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MonitorConfig {
    /// Whether the gait sensors must be good to move. Set it to false to walk from the generator's own rhythm, with no sensor
    /// worn: verdicts and angles are then still reported, and nothing follows from them.
    pub sensor_required: bool,
    /// How long a required sensor may be not good while moving. s, 0 to 1; or infinite for a generator that itself goes on without a
    /// sensor for a while and then comes to rest: the sensor is then only required to arm.
    pub sensor_tolerance_s: f32,
    /// How long the pose envelope may hold the setpoints back. s, 0 to 1.
    pub pose_tolerance_s: f32,
    /// Longest gap between two ticks that is only counted. s, less than `fault_gap_s`.
    pub stop_gap_s: f32,
    /// Longest gap between two ticks that only stops. s, at most 0.1, and at most 254 periods.
    pub fault_gap_s: f32,
    /// How many overruns of the converter within one second are only counted. 0 to 100.
    pub overruns_per_s: u32,
    /// How long the button must be stable. s, 0.005 to 0.2.
    pub debounce_s: f32,
}

impl MonitorConfig {
    /// Sensor required; 50 ms of tolerance (the time within which a broken wire must have its effect); gaps of 5 and 20 ms;
    /// 2 overruns a second; 20 ms of debounce, longer than a tactile switch bounces.
    pub const DEFAULT: Self = Self {
        sensor_required: true,
        sensor_tolerance_s: 0.05,
        pose_tolerance_s: 0.05,
        stop_gap_s: 0.005,
        fault_gap_s: 0.02,
        overruns_per_s: 2,
        debounce_s: 0.02,
    };

    /// Checks the fields and turns times into ticks.
    ///
    /// # Errors
    /// The first field that is not as its documentation says.
    pub fn build(&self, period: Period) -> Result<Monitor, LoopError> {
        let tolerance = |field, seconds| -> Result<u32, LoopError> {
            let seconds = inside(field, None, seconds, 0.0, 1.0, "s")?;
            Ok((seconds / period.seconds() + 0.5) as u32)
        };
        let most = (period.seconds() * (MAX_ELAPSED - 1) as f32).min(0.1);
        let fault_gap = ticks("monitor.fault_gap_s", self.fault_gap_s, period.seconds(), most, period)?;
        inside("monitor.stop_gap_s", None, self.stop_gap_s, 0.0, self.fault_gap_s, "s")?;
        let stop_gap = ticks("monitor.stop_gap_s", self.stop_gap_s, 0.0, 0.1, period)?;
        if stop_gap > fault_gap {
            return Err(LoopError::Inverted { field: "monitor.stop_gap_s..fault_gap_s", joint: None });
        }
        inside("monitor.overruns_per_s", None, self.overruns_per_s as f32, 0.0, 100.0, "1/s")?;
        Ok(Monitor {
            sensor_required: self.sensor_required,
            sensor_tolerance: match self.sensor_tolerance_s {
                f32::INFINITY => None,
                seconds => Some(tolerance("monitor.sensor_tolerance_s", seconds)?),
            },
            pose_tolerance: tolerance("monitor.pose_tolerance_s", self.pose_tolerance_s)?,
            stop_gap,
            fault_gap,
            overruns: self.overruns_per_s,
            second: ticks("second", 1.0, 1.0, 1.0, period)?,
        })
    }

    /// The debounced button.
    ///
    /// # Errors
    /// `debounce_s` is not as its documentation says.
    pub fn button(&self, period: Period) -> Result<Button, LoopError> {
        Ok(Button::new(ticks("monitor.debounce_s", self.debounce_s, 0.005, 0.2, period)?))
    }
}

/// A checked [`MonitorConfig`], in ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Monitor {
    sensor_required: bool,
    /// None tolerates everything while moving.
    sensor_tolerance: Option<u32>,
    pose_tolerance: u32,
    stop_gap: u32,
    fault_gap: u32,
    overruns: u32,
    second: u32,
}

/// What one tick saw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Observation {
    /// The joints are moving.
    pub moving: bool,
    /// Control periods since the last tick.
    pub elapsed: u32,
    /// What the board reports.
    pub faults: BoardFaults,
    /// The gravest verdict of all sensors. Where the board reports an overrun of the converter they count as not good all the same.
    pub sensors: Validity,
    /// The generator passes its check.
    pub generator_sound: bool,
    /// The pose envelope held the setpoints back in the last tick.
    pub pose_limited: bool,
}

/// What has accumulated so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MonitorState {
    /// Periods that the sensors were not good, less those that they were.
    sensor: u32,
    /// The gravest verdict of late: good where the spell above is over, or where it was all overruns.
    gravest: Validity,
    /// Periods since there was one as grave.
    since_gravest: u32,
    /// Ticks that the pose was held back, less those that it was not.
    pose: u32,
    /// Overruns since the one that opened the window, with it.
    overruns: u32,
    /// Periods since then.
    window: u32,
}

impl Monitor {
    /// Takes what one tick saw, and says what follows.
    pub fn judge(&self, monitor_state: &mut MonitorState, seen: &Observation) -> Demand {
        // Spells are held at just above the tolerance, so that they are over as long after their end as they lasted to count.
        let overrun = seen.faults.contains(BoardFaults::ADC_OVERRUN);
        let tolerance = self.sensor_tolerance.unwrap_or(0);
        spell(&mut monitor_state.sensor, overrun || seen.sensors != Validity::Good, seen.elapsed, tolerance);
        monitor_state.remember(seen.sensors, seen.elapsed, tolerance);
        spell(&mut monitor_state.pose, seen.pose_limited, 1, self.pose_tolerance);
        monitor_state.window = monitor_state.window.saturating_add(seen.elapsed);
        if overrun {
            if monitor_state.overruns == 0 || monitor_state.window >= self.second {
                (monitor_state.overruns, monitor_state.window) = (0, 0);
            }
            monitor_state.overruns = monitor_state.overruns.saturating_add(1);
        } else if monitor_state.window >= self.second {
            monitor_state.overruns = 0;
        }

        let sensor_bad = match self.sensor_tolerance {
            None if seen.moving => false,
            tolerance => monitor_state.sensor > if seen.moving { tolerance.unwrap_or(0) } else { 0 },
        };
        if let Some(cause) = named(seen.faults) {
            Demand::Fault(cause)
        } else if seen.elapsed > self.fault_gap {
            Demand::Fault(Cause::Gap)
        } else if seen.elapsed > self.stop_gap {
            Demand::Stop(Cause::Gap)
        } else if !seen.generator_sound {
            Demand::Stop(Cause::Generator)
        } else if monitor_state.overruns > self.overruns {
            Demand::Stop(Cause::AdcOverrun)
        } else if self.sensor_required && sensor_bad {
            Demand::Stop(match Cause::of_sensor(monitor_state.gravest) {
                Cause::None => Cause::AdcOverrun,
                cause => cause,
            })
        } else if monitor_state.pose > self.pose_tolerance {
            Demand::Stop(Cause::Pose)
        } else {
            Demand::Go
        }
    }
}

impl MonitorState {
    /// Keeps the gravest verdict of a spell; one of longer ago than `window` periods gives way to any other.
    fn remember(&mut self, verdict: Validity, elapsed: u32, window: u32) {
        self.since_gravest = self.since_gravest.saturating_add(elapsed);
        let newer = verdict.worse(self.gravest) == verdict || self.since_gravest > window;
        if self.sensor == 0 {
            self.gravest = Validity::Good;
        } else if verdict != Validity::Good && newer {
            (self.gravest, self.since_gravest) = (verdict, 0);
        }
    }
}

fn spell(spell: &mut u32, on: bool, by: u32, tolerance: u32) {
    *spell = if on { spell.saturating_add(by).min(tolerance.saturating_add(1)) } else { spell.saturating_sub(by) };
}

/// The cause of the gravest fault of the board that is not merely counted.
fn named(faults: BoardFaults) -> Option<Cause> {
    let graves = [
        (BoardFaults::BREAK_INPUT, Cause::BreakInput),
        (BoardFaults::CLOCK, Cause::Clock),
        (BoardFaults::OUTPUTS, Cause::Outputs),
        (BoardFaults::WATCHDOG, Cause::Watchdog),
    ];
    let rest = faults.without(BoardFaults::ADC_OVERRUN);
    let found = graves.into_iter().find(|(bit, _)| rest.contains(*bit)).map(|(_, cause)| cause);
    if rest.is_empty() { None } else { Some(found.unwrap_or(Cause::Board)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WELL: Observation = Observation {
        moving: true,
        elapsed: 1,
        faults: BoardFaults::NONE,
        sensors: Validity::Good,
        generator_sound: true,
        pose_limited: false,
    };

    fn watch() -> Monitor {
        MonitorConfig::DEFAULT.build(Period::MILLISECOND).expect("valid")
    }

    /// Overruns at these ticks: on which ticks is a stop asked for?
    fn stops(overruns: &[u32], ticks: u32) -> Vec<u32> {
        let (watch, mut monitor_state) = (watch(), MonitorState::default());
        (0..ticks)
            .filter(|tick| {
                let faults = if overruns.contains(tick) { BoardFaults::ADC_OVERRUN } else { BoardFaults::NONE };
                let demand = watch.judge(&mut monitor_state, &Observation { faults, ..WELL });
                assert!(demand == Demand::Go || demand == Demand::Stop(Cause::AdcOverrun));
                demand != Demand::Go
            })
            .collect()
    }

    #[test]
    fn the_third_overrun_within_a_second_stops_until_the_second_is_over() {
        assert!(stops(&[1_500, 1_700], 4_000).is_empty());
        assert_eq!(stops(&[1_500, 1_700, 2_499], 4_000), [2_499]);
        assert_eq!(stops(&[1_500, 1_700, 2_490], 4_000), (2_490..2_500).collect::<Vec<_>>());
        // A second after the first of them the count begins again.
        assert_eq!(stops(&[1_500, 1_700, 2_500, 2_600, 3_499], 4_000), [3_499]);
        assert!(stops(&[1_500, 1_700, 2_500, 2_600, 3_500], 4_000).is_empty());
    }

    /// 254 periods of 0.1 ms: what lies beyond could not be told from it.
    #[test]
    fn a_gap_must_fit_into_what_is_counted() {
        let build = |fault_gap_s| {
            MonitorConfig { fault_gap_s, ..MonitorConfig::DEFAULT }.build(Period::from_micros(100).expect("valid"))
        };
        assert_eq!(build(0.025).map(|watch| (watch.stop_gap, watch.fault_gap)), Ok((50, 250)));
        let error = build(0.026).expect_err("too long").to_string();
        assert_eq!(error, "monitor.fault_gap_s is 0.026 s; allowed are 0.0001 to 0.025 s");
    }

    #[test]
    fn a_tolerance_is_exact_and_recovers_as_fast_as_it_went() {
        let (watch, mut monitor_state) = (watch(), MonitorState::default());
        let mut see = |ticks: u32, good, moving| {
            let sensors = if good { Validity::Good } else { Validity::OutOfTable };
            let seen = Observation { sensors, moving, ..WELL };
            (0..ticks).map(|_| watch.judge(&mut monitor_state, &seen)).last().expect("some")
        };
        assert_eq!(see(50, false, true), Demand::Go);
        assert_eq!(see(1, false, true), Demand::Stop(Cause::SensorOutOfTable));
        // However long it was: 51 ticks to be wholly good again, which is what arming wants; moving wants less.
        see(10_000, false, true);
        assert_eq!(see(1, true, true), Demand::Go);
        assert_eq!(see(49, true, false), Demand::Stop(Cause::SensorOutOfTable));
        assert_eq!(see(1, true, false), Demand::Go);
        assert_eq!(see(1, false, false), Demand::Stop(Cause::SensorOutOfTable));
        // Periods that were missed count as the tick that follows them.
        see(100, true, true);
        let seen = Observation { sensors: Validity::OutOfTable, elapsed: 5, ..WELL };
        let demands: Vec<_> = (0..11).map(|_| watch.judge(&mut monitor_state, &seen)).collect();
        assert_eq!(demands[9..], [Demand::Go, Demand::Stop(Cause::SensorOutOfTable)]);
    }

    #[test]
    fn the_gravest_comes_first() {
        let all = Observation {
            elapsed: 255,
            faults: BoardFaults::from_bits(0x3f),
            sensors: Validity::OutOfTable,
            generator_sound: false,
            pose_limited: true,
            moving: true,
        };
        let judge = |seen: Observation| {
            watch().judge(
                &mut MonitorState { sensor: 51, pose: 51, overruns: 9, window: 1, ..MonitorState::default() },
                &seen,
            )
        };
        let faults = |bits| Observation { faults: BoardFaults::from_bits(bits), ..all };
        assert_eq!(judge(all), Demand::Fault(Cause::BreakInput));
        assert_eq!(judge(faults(0x3d)), Demand::Fault(Cause::Clock));
        assert_eq!(judge(faults(0x39)), Demand::Fault(Cause::Outputs));
        assert_eq!(judge(faults(0x29)), Demand::Fault(Cause::Watchdog));
        assert_eq!(judge(faults(0x21)), Demand::Fault(Cause::Board));
        assert_eq!(judge(faults(0x01)), Demand::Fault(Cause::Gap));
        let none = Observation { elapsed: 20, ..faults(0) };
        assert_eq!(judge(none), Demand::Stop(Cause::Gap));
        let none = Observation { elapsed: 5, ..none };
        assert_eq!(judge(none), Demand::Stop(Cause::Generator));
        let none = Observation { generator_sound: true, ..none };
        assert_eq!(judge(none), Demand::Stop(Cause::AdcOverrun));
        let later = Observation { elapsed: 1, ..none };
        let judge = |seen: Observation, sensor| {
            watch().judge(&mut MonitorState { sensor, pose: 51, ..MonitorState::default() }, &seen)
        };
        assert_eq!(judge(later, 51), Demand::Stop(Cause::SensorOutOfTable));
        assert_eq!(judge(Observation { sensors: Validity::Good, ..later }, 0), Demand::Stop(Cause::Pose));
    }

    /// The cause at the end of the tolerance, for a course of verdicts that begins anew when it is over.
    fn cause_of(course: &[Validity]) -> Cause {
        let (watch, mut monitor_state) = (watch(), MonitorState::default());
        let demands = course.iter().cycle().take(10_000).map(|&sensors| {
            let demand = watch.judge(&mut monitor_state, &Observation { sensors, ..WELL });
            if let Demand::Stop(cause) = demand { Some(cause) } else { None }
        });
        demands.flatten().next().expect("it stops")
    }

    #[test]
    fn each_verdict_names_its_cause_and_the_gravest_of_several_wins() {
        for verdict in Validity::ALL.into_iter().filter(|&verdict| verdict != Validity::Good) {
            assert_eq!(cause_of(&[verdict]), Cause::of_sensor(verdict));
            for other in Validity::ALL {
                let gravest = Cause::of_sensor(verdict.worse(other));
                // Turn and turn about, in either order, and one of the graver among many.
                for course in [vec![verdict, verdict, other], vec![other, verdict, verdict]] {
                    assert_eq!(cause_of(&course), gravest, "{verdict} and {other}");
                }
                let one = [vec![other], vec![verdict; 50]].concat();
                if other != Validity::Good {
                    assert_eq!(cause_of(&one), gravest, "one {other} among {verdict}");
                }
            }
        }
    }

    /// What is over is not told for ever: 50 ms after the last of a graver verdict the cause is the one that there is now.
    #[test]
    fn a_graver_verdict_is_forgotten_after_the_tolerance() {
        let (watch, mut monitor_state) = (watch(), MonitorState::default());
        let mut see = |sensors: Validity, ticks: u32| {
            let seen = Observation { sensors, moving: false, ..WELL };
            (0..ticks).map(|_| watch.judge(&mut monitor_state, &seen)).last().expect("some")
        };
        assert_eq!(see(Validity::SupplyLow, 200), Demand::Stop(Cause::SensorSupplyLow));
        assert_eq!(see(Validity::Open, 50), Demand::Stop(Cause::SensorSupplyLow));
        assert_eq!(see(Validity::Open, 1), Demand::Stop(Cause::SensorOpen));
        // Good again: until the spell is over it has the same name; the next one begins afresh.
        assert_eq!(see(Validity::Good, 50), Demand::Stop(Cause::SensorOpen));
        assert_eq!(see(Validity::Good, 1), Demand::Go);
        assert_eq!(see(Validity::Spike, 1), Demand::Stop(Cause::SensorSpike));
    }

    /// An overrun leaves no sample to be judged: until it is forgotten a press does not arm, and the cause is its own.
    #[test]
    fn samples_that_were_lost_are_not_good() {
        let (watch, mut monitor_state) = (watch(), MonitorState::default());
        let lost = Observation { faults: BoardFaults::ADC_OVERRUN, moving: false, ..WELL };
        assert_eq!(watch.judge(&mut monitor_state, &lost), Demand::Stop(Cause::AdcOverrun));
        assert_eq!(watch.judge(&mut monitor_state, &Observation { moving: false, ..WELL }), Demand::Go);
    }
}
