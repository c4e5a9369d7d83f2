//! The monitor: watches the conditions of a tick and decides what it asks of the supervisor.
//!
//! | condition | while moving | otherwise |
//! |---|---|---|
//! | break input, before the emergency stop was tested | (cannot occur) | arming refused |
//! | the emergency stop was not tested since the boot, if `stop_test_required` | (cannot occur) | arming refused |
//! | break input otherwise, clock, watchdog, outputs, a fault bit without a name | fault | fault |
//! | more than `fault_gap_s` of control periods without a tick, or more of them missed than `missed_per_s` | fault | fault |
//! | the chip's supply below its minimum for more than 40 ms | fault | arming refused, with no tolerance |
//! | the measured clock of the watchdog is too slow or too fast, or not measured if `watchdog_clock_required` | stop | arming refused |
//! | a debugger is attached, which the board refuses | stop | arming refused |
//! | the program in flash is not proven to be the one that was built | stop | arming refused |
//! | more than `stop_gap_s` of control periods without a tick | stop | arming refused |
//! | more late ticks of the last 100 than `late_ticks` | stop | arming refused |
//! | dips of the supply that go on for more than 1 s | stop | arming refused |
//! | the generator does not pass its check | stop | arming refused |
//! | more overruns of the converter than `overruns_per_s` | stop | arming refused |
//! | a required sensor not good for more than `sensor_tolerance_s` | stop | arming refused, with no tolerance |
//! | a follower whose person has made no stride for more than `stand_s` | stop | (not counted) |
//! | the pose envelope limited the setpoints for more than `pose_tolerance_s` | stop | (cannot occur) |
//!
//! Below its tolerance a condition is only counted. A count rises by one in each bad period and falls by one in each good
//! period, so a sensor that is bad more often than good exceeds its tolerance too, even if each interval is short. At rest the count of a sensor is
//! at most that of the default tolerance: a sensor that is good for 49 ms arms, however long it was bad. A person makes
//! strides while the follower is locked, or bridges a fault of its sensor. Only a lock that lasts for [`WALK_S`] ends the time of the stand: a movement that is no
//! walk, such as a hand that waves the sensor, is locked to now and then for a stride or two, and moves the joints.
//!
//! The cause of a sensor's stop is named after its validity. If validities alternate, the cause is the worst
//! ([`Validity::worse`]) of the last `sensor_tolerance_s`: an open wire with intermittent contact, which also shows spikes and
//! impossible rates, is reported as open. With several sensors, each tick counts with its worst validity.
//! [`crate::control::fault_table`] lists validities, times and reactions, [`crate::control::supply`] and [`crate::control::timeliness`] have the
//! conditions of supply and ticks.

use crate::control::burst::Burst;
use crate::control::stop_test::{StopTest, StopTestState};
use crate::control::supervisor::{Cause, Demand};
use crate::control::timeliness::{LATE_WINDOW, Timeliness, TimelinessState};
use crate::error::{LoopError, inside, ticks};
use crate::io::board::{BoardFaults, Debugger, MAX_ELAPSED};
use crate::setup::robot_config::FollowerRules;
use hgod_adc::Validity;
use joint_units::Period;

/// How long a follower must have been locked to its person before that counts as a walk, s. A sine or triangle of a knee's size at 0.5 to 1 Hz is locked to
/// for 0.2 to 2.4 s at a time, over and over.
pub const WALK_S: f32 = 2.5;

/// Longest time for which a required sensor may be not good, s.
pub(crate) const LONGEST_TOLERANCE_S: f32 = 60.0;

/// Monitored conditions and their tolerances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MonitorConfig {
    /// Whether the gait sensors must be good to move; default true. False is for a generator that needs no sensor: validities and angles are
    /// still reported, but have no effect on the supervisor.
    pub sensor_required: bool,
    /// Time for which a required sensor may be not good while moving, s; 0 to 60, default 0.048. Of a follower, which continues without a sensor
    /// for a limited time and then stands, [`crate::FOLLOWER_LOST_MS`].
    pub sensor_tolerance_s: f32,
    /// Time for which the person whom a follower follows may make no stride while the outputs are on, s; [`FollowerRules::STAND_S`], default 10.
    pub stand_s: f32,
    /// Whether the emergency stop must be tested before the first arming, see [`crate::control::stop_test`]; default false, for a loop without one at
    /// its break input. The loop of a board requires it.
    pub stop_test_required: bool,
    /// Whether the clock of the watchdog must have been measured before the first arming, see [`crate::control::watchdog_clock`]; default false, for a
    /// loop without a watchdog. The loop of a board requires it.
    pub watchdog_clock_required: bool,
    /// Time for which the pose envelope may limit the setpoints, s; 0 to 1, default 0.05.
    pub pose_tolerance_s: f32,
    /// Longest gap between two ticks that does not stop the motion, s; at most `fault_gap_s`, default 0.005.
    pub stop_gap_s: f32,
    /// Longest gap between two ticks that is not a fault, s; at most 0.1 and at most 254 periods, default 0.01.
    pub fault_gap_s: f32,
    /// Number of late ticks among the last 100 that do not stop the motion; 0 to 100, default 5.
    pub late_ticks: u32,
    /// Number of missed control periods within one second of the first of them that are not a fault; 0 to 254, default 9.
    pub missed_per_s: u32,
    /// Number of overruns of the converter within one second that do not stop the motion; 0 to 100, default 2.
    pub overruns_per_s: u32,
}

impl MonitorConfig {
    /// Sensor required; tolerances of 48 ms for a sensor, so that a wire that breaks at any moment stops the motion within 50 ms, and of 50 ms for the
    /// pose; a stand of 10 s, longer than one before a step or at a door; gaps of 5 and 10 ms; 5 late ticks of 100, 9 missed periods and 2 overruns per
    /// second.
    pub const DEFAULT: Self = Self {
        sensor_required: true,
        sensor_tolerance_s: 0.048,
        stand_s: FollowerRules::DEFAULT.disarm_after_stand_s,
        stop_test_required: false,
        watchdog_clock_required: false,
        pose_tolerance_s: 0.05,
        stop_gap_s: 0.005,
        fault_gap_s: 0.01,
        late_ticks: 5,
        missed_per_s: 9,
        overruns_per_s: 2,
    };

    /// Checks the fields and converts times to ticks.
    ///
    /// # Errors
    /// [`LoopError`] names the first field that is not allowed.
    pub fn build(&self, period: Period) -> Result<Monitor, LoopError> {
        let tolerance = |field, seconds, most| -> Result<u32, LoopError> {
            let seconds = inside(field, None, seconds, 0.0, most, "s")?;
            Ok((seconds / period.seconds() + 0.5) as u32)
        };
        let most = (period.seconds() * (MAX_ELAPSED - 1) as f32).min(0.1);
        let fault_gap = ticks("monitor.fault_gap_s", self.fault_gap_s, period.seconds(), most, period)?;
        let stop_gap = ticks("monitor.stop_gap_s", self.stop_gap_s, 0.0, self.fault_gap_s, period)?;
        inside("monitor.late_ticks", None, self.late_ticks as f32, 0.0, LATE_WINDOW as f32, "")?;
        inside("monitor.missed_per_s", None, self.missed_per_s as f32, 0.0, (MAX_ELAPSED - 1) as f32, "1/s")?;
        let second = ticks("second", 1.0, 1.0, 1.0, period)?;
        inside("monitor.overruns_per_s", None, self.overruns_per_s as f32, 0.0, 100.0, "1/s")?;
        Ok(Monitor {
            sensor_required: self.sensor_required,
            sensor_tolerance: tolerance("monitor.sensor_tolerance_s", self.sensor_tolerance_s, LONGEST_TOLERANCE_S)?,
            most_at_rest: tolerance(
                "monitor.sensor_tolerance_s",
                Self::DEFAULT.sensor_tolerance_s,
                LONGEST_TOLERANCE_S,
            )?,
            stop_test: if self.stop_test_required { Some(StopTest::build(period)?) } else { None },
            watchdog_clock_required: self.watchdog_clock_required,
            stand: ticks("monitor.stand_s", self.stand_s, FollowerRules::STAND_S.0, FollowerRules::STAND_S.1, period)?,
            walk: ticks("walk", WALK_S, WALK_S, WALK_S, period)?,
            pose_tolerance: tolerance("monitor.pose_tolerance_s", self.pose_tolerance_s, 1.0)?,
            stop_gap,
            fault_gap,
            overruns: self.overruns_per_s,
            timeliness: Timeliness { late: self.late_ticks, missed: self.missed_per_s, second },
            second,
        })
    }
}

/// A checked [`MonitorConfig`], in ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Monitor {
    sensor_required: bool,
    sensor_tolerance: u32,
    /// Most that counts against a sensor at rest.
    most_at_rest: u32,
    stand: u32,
    walk: u32,
    /// `None` if it is not required.
    stop_test: Option<StopTest>,
    watchdog_clock_required: bool,
    pose_tolerance: u32,
    stop_gap: u32,
    fault_gap: u32,
    overruns: u32,
    timeliness: Timeliness,
    second: u32,
}

/// Inputs of the monitor in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Observation {
    /// The joints are moving.
    pub moving: bool,
    /// Control periods since the last tick.
    pub elapsed: u32,
    /// The tick began late, or the one before ended late.
    pub late: bool,
    /// Demand of the supply's condition.
    pub supply: Demand,
    /// Demand of the clock of the watchdog.
    pub watchdog_clock: Demand,
    /// Whether a debugger is attached.
    pub debugger: Debugger,
    /// The program in flash is not proven to be the one that was built.
    pub program_unproven: bool,
    /// Faults that the board reports.
    pub faults: BoardFaults,
    /// Worst validity of all sensors. An overrun of the converter counts as not good even if this is good.
    pub sensors: Validity,
    /// The generator passes its check.
    pub generator_sound: bool,
    /// The pose envelope limited the setpoints in the last tick.
    pub pose_limited: bool,
    /// The generator is a follower, and its person makes no stride: it stands, or is not locked to what they do.
    pub person_stands: bool,
}

/// State of the monitor: the counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MonitorState {
    /// Periods in which the sensors were not good, minus periods in which they were.
    sensor: u32,
    /// Worst recent validity; good if the count above is 0 or came from overruns only.
    worst: Validity,
    /// Periods since a validity at least as bad.
    since_worst: u32,
    /// How far the test of the emergency stop is.
    stop_test: StopTestState,
    /// Periods without a stride of the person while the joints moved, since the last walk.
    stood: u32,
    /// Periods of strides without a break.
    walked: u32,
    /// Ticks in which the pose was limited, minus ticks in which it was not.
    pose: u32,
    /// Overruns of the converter.
    overruns: Burst,
    timeliness: TimelinessState,
}

impl Monitor {
    /// Updates the counts with one tick and returns the demand on the supervisor.
    pub fn judge(&self, monitor_state: &mut MonitorState, seen: &Observation) -> Demand {
        // A count stops at one above the tolerance, so that it returns to 0 within tolerance + 1 good periods.
        let overrun = seen.faults.contains(BoardFaults::ADC_OVERRUN);
        let tolerance = if seen.moving { self.sensor_tolerance } else { self.sensor_tolerance.min(self.most_at_rest) };
        count(&mut monitor_state.sensor, overrun || seen.sensors != Validity::Good, seen.elapsed, tolerance);
        monitor_state.remember(seen.sensors, seen.elapsed, tolerance);
        self.note_person(monitor_state, seen);
        count(&mut monitor_state.pose, seen.pose_limited, 1, self.pose_tolerance);
        let overruns = monitor_state.overruns.note(overrun.into(), seen.elapsed, self.second);
        let timeliness = self.timeliness.judge(&mut monitor_state.timeliness, seen.late, seen.elapsed);

        let is_pressed = seen.faults.contains(BoardFaults::BREAK_INPUT);
        if let Some(test) = self.stop_test {
            test.observe(&mut monitor_state.stop_test, is_pressed);
        }
        let is_untested = self.awaits_stop_test(monitor_state);
        // Until then nothing moves, and the press that tests the stop is no fault that an operator has to acknowledge.
        let faults = if is_untested { seen.faults.without(BoardFaults::BREAK_INPUT) } else { seen.faults };
        let sensor_bad = monitor_state.sensor > if seen.moving { tolerance } else { 0 };
        if let Some(cause) = named(faults) {
            Demand::Fault(cause)
        } else if seen.elapsed > self.fault_gap {
            Demand::Fault(Cause::Gap)
        } else if let Some(fault) = [timeliness, seen.supply].into_iter().find(|one| matches!(one, Demand::Fault(_))) {
            fault
        } else if seen.elapsed > self.stop_gap {
            Demand::Stop(Cause::Gap)
        } else if let Some(stop) = [timeliness, seen.supply].into_iter().find(|one| *one != Demand::Go) {
            stop
        } else if !seen.generator_sound {
            Demand::Stop(Cause::Generator)
        } else if overruns > self.overruns {
            Demand::Stop(Cause::AdcOverrun)
        } else if seen.watchdog_clock != Demand::Go {
            seen.watchdog_clock
        } else if seen.debugger == Debugger::Refused {
            Demand::Stop(Cause::Debugger)
        } else if is_untested {
            // Before the sensors, whose causes do not concern a trim.
            Demand::Stop(if is_pressed { Cause::BreakInput } else { Cause::StopUntested })
        } else if seen.program_unproven {
            Demand::Stop(Cause::Program)
        } else if self.sensor_required && sensor_bad {
            Demand::Stop(match Cause::of_sensor(monitor_state.worst) {
                Cause::None => Cause::AdcOverrun,
                cause => cause,
            })
        } else if monitor_state.stood > self.stand {
            Demand::Stop(Cause::PersonStands)
        } else if monitor_state.pose > self.pose_tolerance {
            Demand::Stop(Cause::Pose)
        } else {
            Demand::Go
        }
    }

    /// Counts the time without a stride, and ends it after a walk. A lock that may become one neither counts nor ends it.
    fn note_person(&self, monitor_state: &mut MonitorState, seen: &Observation) {
        let MonitorState { stood, walked, .. } = monitor_state;
        *walked = if seen.person_stands { 0 } else { walked.saturating_add(seen.elapsed) };
        if !seen.moving || *walked > self.walk {
            *stood = 0;
        } else if seen.person_stands {
            *stood = stood.saturating_add(seen.elapsed);
        }
    }

    /// Whether the clock of the watchdog must have been measured.
    pub(crate) const fn requires_watchdog_clock(&self) -> bool {
        self.watchdog_clock_required
    }

    /// Whether the emergency stop has to be tested before the board arms.
    #[must_use]
    pub fn awaits_stop_test(&self, state: &MonitorState) -> bool {
        self.stop_test.is_some() && !state.stop_test.is_done()
    }
}

impl MonitorState {
    /// Keeps the worst validity while the sensor count is above 0. One older than `window` periods is replaced by any other.
    fn remember(&mut self, validity: Validity, elapsed: u32, window: u32) {
        self.since_worst = self.since_worst.saturating_add(elapsed);
        let newer = validity.worse(self.worst) == validity || self.since_worst > window;
        if self.sensor == 0 {
            self.worst = Validity::Good;
        } else if validity != Validity::Good && newer {
            (self.worst, self.since_worst) = (validity, 0);
        }
    }
}

/// Counts up to one above the tolerance while the condition holds, and down to 0 otherwise.
fn count(count: &mut u32, on: bool, by: u32, tolerance: u32) {
    *count = if on { count.saturating_add(by).min(tolerance.saturating_add(1)) } else { count.saturating_sub(by) };
}

/// Cause of the worst fault of the board; overruns of the converter are only counted.
fn named(faults: BoardFaults) -> Option<Cause> {
    let in_order = [
        (BoardFaults::BREAK_INPUT, Cause::BreakInput),
        (BoardFaults::CLOCK, Cause::Clock),
        (BoardFaults::OUTPUTS, Cause::Outputs),
        (BoardFaults::WATCHDOG, Cause::Watchdog),
    ];
    let rest = faults.without(BoardFaults::ADC_OVERRUN);
    if rest.is_empty() {
        return None;
    }
    let found = in_order.into_iter().find(|(bit, _)| rest.contains(*bit)).map(|(_, cause)| cause);
    Some(found.unwrap_or(Cause::Board))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAULTLESS: Observation = Observation {
        moving: true,
        elapsed: 1,
        late: false,
        supply: Demand::Go,
        watchdog_clock: Demand::Go,
        debugger: Debugger::Absent,
        program_unproven: false,
        faults: BoardFaults::NONE,
        sensors: Validity::Good,
        generator_sound: true,
        pose_limited: false,
        person_stands: false,
    };

    fn monitor() -> Monitor {
        MonitorConfig::DEFAULT.build(Period::MILLISECOND).expect("valid")
    }

    /// The ticks on which a stop is demanded, with overruns on the given ticks.
    fn stops(overruns: &[u32], ticks: u32) -> Vec<u32> {
        let (monitor, mut monitor_state) = (monitor(), MonitorState::default());
        (0..ticks)
            .filter(|tick| {
                let faults = if overruns.contains(tick) { BoardFaults::ADC_OVERRUN } else { BoardFaults::NONE };
                let demand = monitor.judge(&mut monitor_state, &Observation { faults, ..FAULTLESS });
                assert!(demand == Demand::Go || demand == Demand::Stop(Cause::AdcOverrun));
                demand != Demand::Go
            })
            .collect()
    }

    #[test]
    fn the_third_overrun_in_a_second_stops_until_it_is_over() {
        assert!(stops(&[1_500, 1_700], 4_000).is_empty());
        assert_eq!(stops(&[1_500, 1_700, 2_499], 4_000), [2_499]);
        assert_eq!(stops(&[1_500, 1_700, 2_490], 4_000), (2_490..2_500).collect::<Vec<_>>());
        // The count restarts one second after the first overrun.
        assert_eq!(stops(&[1_500, 1_700, 2_500, 2_600, 3_499], 4_000), [3_499]);
        assert!(stops(&[1_500, 1_700, 2_500, 2_600, 3_500], 4_000).is_empty());
    }

    /// The limit is 254 periods of 0.1 ms: `elapsed` is clamped to 255.
    #[test]
    fn a_gap_must_fit_into_the_range_of_elapsed() {
        let build = |fault_gap_s| {
            MonitorConfig { fault_gap_s, ..MonitorConfig::DEFAULT }.build(Period::from_micros(100).expect("valid"))
        };
        assert_eq!(build(0.025).map(|built| (built.stop_gap, built.fault_gap)), Ok((50, 250)));
        let error = build(0.026).expect_err("too long").to_string();
        assert_eq!(error, "monitor.fault_gap_s is 0.026 s; allowed are 0.0001 to 0.025 s");
    }

    /// Each limit of a number is allowed, the next one is not, and the error names the field.
    #[test]
    fn numbers_beyond_their_limits_are_refused() {
        let default = MonitorConfig::DEFAULT;
        let late = |late_ticks| MonitorConfig { late_ticks, ..default };
        let missed = |missed_per_s| MonitorConfig { missed_per_s, ..default };
        let overruns = |overruns_per_s| MonitorConfig { overruns_per_s, ..default };
        for (name, most, allowed, refused) in [
            ("late_ticks", 100, late(100), late(101)),
            ("missed_per_s", 254, missed(254), missed(255)),
            ("overruns_per_s", 100, overruns(100), overruns(101)),
        ] {
            assert!(allowed.build(Period::MILLISECOND).is_ok(), "{name} {most}");
            let error = refused.build(Period::MILLISECOND).expect_err(name).to_string();
            assert!(error.contains(&format!("monitor.{name} is {}", most + 1)), "{error}");
        }
    }

    /// A motion that the envelope bounds goes on for the tolerance, 50 ms, and stops with the next tick; one tick without gives back one.
    #[test]
    fn a_bounded_pose_is_tolerated_for_its_time() {
        let (monitor, mut monitor_state) = (monitor(), MonitorState::default());
        let mut see = |ticks: u32, pose_limited| {
            let seen = Observation { pose_limited, ..FAULTLESS };
            (0..ticks).map(|_| monitor.judge(&mut monitor_state, &seen)).last().expect("some")
        };
        assert_eq!(see(50, true), Demand::Go);
        assert_eq!(see(1, false), Demand::Go);
        assert_eq!(see(1, true), Demand::Go);
        assert_eq!(see(1, true), Demand::Stop(Cause::Pose));
        assert_eq!(see(1, false), Demand::Go);
    }

    /// Until the stop was tested, pressed or not, arming is refused and the press is no fault; afterwards it is one.
    #[test]
    fn the_stop_must_be_tested_before_the_first_arming() {
        let config = MonitorConfig { stop_test_required: true, ..MonitorConfig::DEFAULT };
        let (monitor, mut monitor_state) = (config.build(Period::MILLISECOND).expect("valid"), MonitorState::default());
        let mut see = |ticks: u32, is_pressed, sensors| {
            let faults = if is_pressed { BoardFaults::BREAK_INPUT } else { BoardFaults::NONE };
            let seen = Observation { faults, sensors, moving: false, ..FAULTLESS };
            (0..ticks).map(|_| monitor.judge(&mut monitor_state, &seen)).last().expect("some")
        };
        assert_eq!(see(60_000, false, Validity::Good), Demand::Stop(Cause::StopUntested));
        // Also in a trim, for which a sensor does not count.
        assert_eq!(see(100, false, Validity::Open).in_trim(), Demand::Stop(Cause::StopUntested));
        assert_eq!(see(200, true, Validity::Good), Demand::Stop(Cause::BreakInput));
        assert_eq!(see(19, false, Validity::Good), Demand::Stop(Cause::StopUntested));
        assert_eq!(see(1, false, Validity::Good), Demand::Go);
        assert_eq!(see(1, true, Validity::Good), Demand::Fault(Cause::BreakInput));
        assert_eq!(see(1, false, Validity::Good), Demand::Go);
    }

    /// Both stop a motion and refuse an arming, before the test of the emergency stop, and in a trim too.
    #[test]
    fn a_wrong_watchdog_clock_and_a_refused_debugger_stop() {
        let config = MonitorConfig { stop_test_required: true, ..MonitorConfig::DEFAULT };
        let monitor = config.build(Period::MILLISECOND).expect("valid");
        let judge = |seen: Observation| monitor.judge(&mut MonitorState::default(), &seen).in_trim();
        let clock = Observation { watchdog_clock: Demand::Stop(Cause::WatchdogClock), ..FAULTLESS };
        let probe = Observation { debugger: Debugger::Refused, ..FAULTLESS };
        for moving in [false, true] {
            assert_eq!(judge(Observation { moving, ..clock }), Demand::Stop(Cause::WatchdogClock));
            assert_eq!(judge(Observation { moving, ..probe }), Demand::Stop(Cause::Debugger));
            let both = Observation { debugger: Debugger::Refused, ..clock };
            assert_eq!(judge(Observation { moving, ..both }), Demand::Stop(Cause::WatchdogClock));
        }
        let attached = Observation { debugger: Debugger::Attached, ..FAULTLESS };
        assert_eq!(judge(attached), Demand::Stop(Cause::StopUntested));
    }

    /// A stand counts while the joints move. A walk of more than 2.5 s ends it; shorter ones, however many, do not, and do not count either.
    #[test]
    fn a_stand_is_tolerated_for_its_time() {
        let (monitor, mut monitor_state) = (monitor(), MonitorState::default());
        let mut see = |ticks: u32, person_stands, moving| {
            let seen = Observation { person_stands, moving, ..FAULTLESS };
            (0..ticks).map(|_| monitor.judge(&mut monitor_state, &seen)).last().expect("some")
        };
        assert_eq!(see(60_000, true, false), Demand::Go);
        assert_eq!(see(10_000, true, true), Demand::Go);
        assert_eq!(see(2_501, false, true), Demand::Go);
        assert_eq!(see(10_000, true, true), Demand::Go);
        assert_eq!(see(2_500, false, true), Demand::Go);
        assert_eq!(see(1, true, true), Demand::Stop(Cause::PersonStands));
        // At rest a hold arms again, for another such time.
        assert_eq!(see(1, true, false), Demand::Go);
        for _ in 0..10 {
            assert_eq!(see(1_000, true, true), Demand::Go);
            assert_eq!(see(2_000, false, true), Demand::Go);
        }
        assert_eq!(see(1, true, true), Demand::Stop(Cause::PersonStands));
        // A walk that began at rest counts.
        assert_eq!(see(3_000, false, false), Demand::Go);
        assert_eq!(see(10_000, true, true), Demand::Go);
    }

    /// A sensor that was bad for as long as a follower tolerates arms again after 49 good ticks.
    #[test]
    fn a_long_tolerance_is_for_motion_only() {
        let config = MonitorConfig { sensor_tolerance_s: 5.0, ..MonitorConfig::DEFAULT };
        let (monitor, mut monitor_state) = (config.build(Period::MILLISECOND).expect("valid"), MonitorState::default());
        let mut see = |ticks: u32, sensors, moving| {
            let seen = Observation { sensors, moving, ..FAULTLESS };
            (0..ticks).map(|_| monitor.judge(&mut monitor_state, &seen)).last().expect("some")
        };
        assert_eq!(see(5_000, Validity::Open, true), Demand::Go);
        assert_eq!(see(1, Validity::Open, true), Demand::Stop(Cause::SensorOpen));
        see(10_000, Validity::Open, false);
        assert_eq!(see(48, Validity::Good, false), Demand::Stop(Cause::SensorOpen));
        assert_eq!(see(1, Validity::Good, false), Demand::Go);
    }

    #[test]
    fn a_tolerance_is_exact_and_recovers_at_the_same_rate() {
        let (monitor, mut monitor_state) = (monitor(), MonitorState::default());
        let mut see = |ticks: u32, good, moving| {
            let sensors = if good { Validity::Good } else { Validity::OutOfTable };
            let seen = Observation { sensors, moving, ..FAULTLESS };
            (0..ticks).map(|_| monitor.judge(&mut monitor_state, &seen)).last().expect("some")
        };
        assert_eq!(see(48, false, true), Demand::Go);
        assert_eq!(see(1, false, true), Demand::Stop(Cause::SensorOutOfTable));
        // After any duration: arming needs 49 good ticks, moving needs one.
        see(10_000, false, true);
        assert_eq!(see(1, true, true), Demand::Go);
        assert_eq!(see(47, true, false), Demand::Stop(Cause::SensorOutOfTable));
        assert_eq!(see(1, true, false), Demand::Go);
        assert_eq!(see(1, false, false), Demand::Stop(Cause::SensorOutOfTable));
        // Missed periods count with the tick after them.
        see(100, true, true);
        let bad = |elapsed| Observation { sensors: Validity::OutOfTable, elapsed, ..FAULTLESS };
        assert_eq!(monitor.judge(&mut monitor_state, &bad(5)), Demand::Go);
        let demands: Vec<_> = (6..=49).map(|_| monitor.judge(&mut monitor_state, &bad(1))).collect();
        assert_eq!(demands[42..], [Demand::Go, Demand::Stop(Cause::SensorOutOfTable)]);
    }

    /// It refuses an arming and a trim, after the test of the emergency stop, and stops a motion.
    #[test]
    fn a_program_that_is_not_proven_stops() {
        let monitor = monitor();
        let judge = |seen: Observation| monitor.judge(&mut MonitorState::default(), &seen).in_trim();
        for moving in [false, true] {
            let seen = Observation { moving, program_unproven: true, ..FAULTLESS };
            assert_eq!(judge(seen), Demand::Stop(Cause::Program));
            assert_eq!(judge(Observation { program_unproven: false, ..seen }), Demand::Go);
        }
    }

    #[test]
    fn the_worst_condition_comes_first() {
        let all = Observation {
            elapsed: 255,
            late: false,
            supply: Demand::Stop(Cause::Supply),
            watchdog_clock: Demand::Stop(Cause::WatchdogClock),
            debugger: Debugger::Refused,
            program_unproven: true,
            faults: BoardFaults::from_bits(0x3f),
            sensors: Validity::OutOfTable,
            generator_sound: false,
            pose_limited: true,
            person_stands: true,
            moving: true,
        };
        let mut overruns = Burst::default();
        overruns.note(9, 1, 1_000);
        let judge = |seen: Observation| {
            monitor().judge(&mut MonitorState { sensor: 51, pose: 51, overruns, ..MonitorState::default() }, &seen)
        };
        let faults = |bits| Observation { faults: BoardFaults::from_bits(bits), ..all };
        assert_eq!(judge(all), Demand::Fault(Cause::BreakInput));
        assert_eq!(judge(faults(0x3d)), Demand::Fault(Cause::Clock));
        assert_eq!(judge(faults(0x39)), Demand::Fault(Cause::Outputs));
        assert_eq!(judge(faults(0x29)), Demand::Fault(Cause::Watchdog));
        assert_eq!(judge(faults(0x21)), Demand::Fault(Cause::Board));
        assert_eq!(judge(faults(0x01)), Demand::Fault(Cause::Gap));
        let none = Observation { elapsed: 10, supply: Demand::Fault(Cause::Supply), ..faults(0) };
        assert_eq!(judge(none), Demand::Fault(Cause::Supply));
        let none = Observation { supply: Demand::Stop(Cause::Supply), ..none };
        assert_eq!(judge(none), Demand::Stop(Cause::Gap));
        let none = Observation { elapsed: 5, ..none };
        assert_eq!(judge(none), Demand::Stop(Cause::Supply));
        let none = Observation { supply: Demand::Go, ..none };
        assert_eq!(judge(none), Demand::Stop(Cause::Generator));
        let none = Observation { generator_sound: true, ..none };
        assert_eq!(judge(none), Demand::Stop(Cause::AdcOverrun));
        let none = Observation { elapsed: 1, ..none };
        let judge = |seen: Observation| {
            monitor().judge(&mut MonitorState { sensor: 51, pose: 51, stood: 10_000, ..MonitorState::default() }, &seen)
        };
        assert_eq!(judge(none), Demand::Stop(Cause::WatchdogClock));
        let none = Observation { watchdog_clock: Demand::Go, ..none };
        assert_eq!(judge(none), Demand::Stop(Cause::Debugger));
        let later = Observation { debugger: Debugger::Absent, ..none };
        let judge = |seen: Observation, sensor| {
            monitor().judge(&mut MonitorState { sensor, pose: 51, stood: 10_000, ..MonitorState::default() }, &seen)
        };
        assert_eq!(judge(later, 51), Demand::Stop(Cause::Program));
        let later = Observation { program_unproven: false, ..later };
        assert_eq!(judge(later, 51), Demand::Stop(Cause::SensorOutOfTable));
        let good = Observation { sensors: Validity::Good, ..later };
        assert_eq!(judge(good, 0), Demand::Stop(Cause::PersonStands));
        assert_eq!(judge(Observation { person_stands: false, ..good }, 0), Demand::Stop(Cause::Pose));
    }

    /// The cause at the end of the tolerance, for a repeated sequence of validities.
    fn cause_of(course: &[Validity]) -> Cause {
        let (monitor, mut monitor_state) = (monitor(), MonitorState::default());
        let demands = course.iter().cycle().take(10_000).map(|&sensors| {
            let demand = monitor.judge(&mut monitor_state, &Observation { sensors, ..FAULTLESS });
            if let Demand::Stop(cause) = demand { Some(cause) } else { None }
        });
        demands.flatten().next().expect("a stop")
    }

    #[test]
    fn the_cause_is_named_after_the_worst_validity() {
        for validity in Validity::ALL.into_iter().filter(|&validity| validity != Validity::Good) {
            assert_eq!(cause_of(&[validity]), Cause::of_sensor(validity));
            for other in Validity::ALL {
                let worst = Cause::of_sensor(validity.worse(other));
                // Alternating, in both orders, and one of the other among many.
                for course in [vec![validity, validity, other], vec![other, validity, validity]] {
                    assert_eq!(cause_of(&course), worst, "{validity} and {other}");
                }
                let one = [vec![other], vec![validity; 50]].concat();
                if other != Validity::Good {
                    assert_eq!(cause_of(&one), worst, "one {other} among {validity}");
                }
            }
        }
    }

    /// 48 ms after the last sample with a worse validity, the cause is the present one.
    #[test]
    fn a_worse_validity_is_dropped_after_the_tolerance() {
        let (monitor, mut monitor_state) = (monitor(), MonitorState::default());
        let mut see = |sensors: Validity, ticks: u32| {
            let seen = Observation { sensors, moving: false, ..FAULTLESS };
            (0..ticks).map(|_| monitor.judge(&mut monitor_state, &seen)).last().expect("some")
        };
        assert_eq!(see(Validity::SupplyLow, 200), Demand::Stop(Cause::SensorSupplyLow));
        assert_eq!(see(Validity::Open, 48), Demand::Stop(Cause::SensorSupplyLow));
        assert_eq!(see(Validity::Open, 1), Demand::Stop(Cause::SensorOpen));
        // Good again: the cause stays until the count is 0; the next cause does not depend on it.
        assert_eq!(see(Validity::Good, 48), Demand::Stop(Cause::SensorOpen));
        assert_eq!(see(Validity::Good, 1), Demand::Go);
        assert_eq!(see(Validity::Spike, 1), Demand::Stop(Cause::SensorSpike));
    }

    /// An overrun leaves no sample: while the count is above 0 a press does not arm, and the cause is the overrun.
    #[test]
    fn lost_samples_are_not_good() {
        let (monitor, mut monitor_state) = (monitor(), MonitorState::default());
        let lost = Observation { faults: BoardFaults::ADC_OVERRUN, moving: false, ..FAULTLESS };
        assert_eq!(monitor.judge(&mut monitor_state, &lost), Demand::Stop(Cause::AdcOverrun));
        assert_eq!(monitor.judge(&mut monitor_state, &Observation { moving: false, ..FAULTLESS }), Demand::Go);
    }
}
