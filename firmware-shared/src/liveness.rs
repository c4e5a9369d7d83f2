//! Decides whether the independent watchdog may be reloaded: only while sampling, control and telemetry all make progress, at the right
//! pace.
//!
//! A watchdog that is reloaded in an interrupt does not detect a hang of the other code; one that only checks for any progress accepts a
//! loop that runs too fast. [`judge`] therefore compares the progress counters with a free-running hardware clock, in both directions.
//!
//! That comparison allows for two ticks that are not counted yet, which hides ticks that are lost again and again. [`keeps_pace`] compares over
//! [`PACE_US`], in which they add up.
//!
//! # Timing
//! The watchdog runs on the chip's low-speed oscillator, which the data sheets of the chips specify as 17 to 47 kHz. The board measures it, and does
//! not arm if it is slower or faster ([`joint_loop::control::watchdog_clock`]).
//! [`timeout_us`] is computed for both ends, and the assertions below check that
//! - there is no false reset: with the fastest oscillator the time-out is longer than [`GRACE_US`] plus the period of the watchdog task;
//! - the reset is in time: with the slowest oscillator within [`WORST_BITE_US`], at most two repeated servo frames.

use joint_loop::control::watchdog_clock::{FASTEST_HZ, SLOWEST_HZ, TOLERANCE_PERMILLE};

/// Slowest low-speed oscillator with which the board arms, Hz (data sheets of the STM32F407, STM32F411 and STM32F446, "LSI oscillator characteristics", and the
/// error of its measurement).
pub const LSI_SLOWEST_HZ: u32 = SLOWEST_HZ / 1000 * (1000 - TOLERANCE_PERMILLE);

/// Fastest low-speed oscillator with which the board arms, Hz.
pub const LSI_FASTEST_HZ: u32 = FASTEST_HZ / 1000 * (1000 + TOLERANCE_PERMILLE);

/// Divider of the oscillator in the watchdog.
pub const PRESCALER: u32 = 4;

/// Reload value of the watchdog: it resets `RELOAD + 1` divided cycles after the last reload.
pub const RELOAD: u16 = 159;

/// Period of the watchdog task, us.
pub const FEED_US: u32 = 5_000;

/// Period of the watchdog task while a part makes no progress, us.
pub const RETRY_US: u32 = 1_000;

/// No progress for this time since the last reload is a stall: the watchdog task then switches the outputs off and resets, with a record
/// of the part that stalled. If the watchdog task itself cannot run, the watchdog resets.
pub const GRACE_US: u32 = 10_000;

/// Longest accepted time from the last reload to the reset, us.
pub const WORST_BITE_US: u32 = 38_000;

/// Accepted difference between the ticks and the clock: the two are not read at the same time, and a tick may be running.
const SLACK_TICKS: u32 = 2;

/// Time from the last reload to the reset, us.
///
/// ```
/// use firmware_shared::liveness::{LSI_FASTEST_HZ, LSI_SLOWEST_HZ, timeout_us};
/// assert_eq!(timeout_us(32_000), 20_000);
/// assert_eq!((timeout_us(LSI_FASTEST_HZ), timeout_us(LSI_SLOWEST_HZ)), (13_576, 37_760));
/// ```
#[must_use]
pub const fn timeout_us(lsi_hz: u32) -> u32 {
    // 640 divided cycles of 1e6 us: far below the range of u32.
    (RELOAD as u32 + 1) * PRESCALER * 1_000_000 / lsi_hz
}

const _: () = assert!(RELOAD < 1 << 12, "the reload register has 12 bits");
const _: () = assert!(timeout_us(LSI_SLOWEST_HZ) <= WORST_BITE_US, "resets too late");
const _: () = assert!(
    timeout_us(LSI_FASTEST_HZ) > GRACE_US + 2 * RETRY_US,
    "resets before the watchdog task can report the part that stalled"
);
const _: () = assert!(GRACE_US >= 2 * FEED_US, "one late round of the watchdog task is no stall");

/// Time over which ticks that are lost add up, us.
pub const PACE_US: u32 = 100_000;

/// Share of the ticks in [`PACE_US`] that may be lost, in percent. The monitor of the loop stops the motion long before.
pub const PACE_LOST_PERCENT: u32 = 10;

/// Whether ticks and samples have kept pace with the clock since `from`: [`Liveness::Alive`] if they have, [`Liveness::Wait`] before
/// [`PACE_US`] have passed, [`Liveness::Stalled`] otherwise.
///
/// ```
/// use firmware_shared::liveness::{Liveness, Part, Progress, keeps_pace};
/// let from = Progress::default();
/// let now = Progress { control: 92, sensor: 92, telemetry: 40, now_us: 100_000 };
/// assert_eq!(keeps_pace(&from, &now), Liveness::Alive);
/// assert_eq!(keeps_pace(&from, &Progress { control: 60, ..now }), Liveness::Stalled(Part::Control));
/// ```
#[must_use]
pub fn keeps_pace(from: &Progress, now: &Progress) -> Liveness {
    let passed_us = now.now_us.wrapping_sub(from.now_us);
    if passed_us < PACE_US {
        return Liveness::Wait;
    }
    let expected = passed_us / crate::pacing::PERIOD_US;
    let least = (expected - expected / (100 / PACE_LOST_PERCENT)).saturating_sub(SLACK_TICKS);
    if now.sensor.wrapping_sub(from.sensor) < least {
        Liveness::Stalled(Part::Sensor)
    } else if now.control.wrapping_sub(from.control) < least {
        Liveness::Stalled(Part::Control)
    } else {
        Liveness::Alive
    }
}

/// A part of the program that must make progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Part {
    /// Runs the loop, writes the pulses.
    Control = 0,
    /// Reads the samples, in the control task: it makes no progress if the converter delivers none.
    Sensor = 1,
    /// Sends the log.
    Telemetry = 2,
}

impl Part {
    /// From its number in a crash record.
    #[must_use]
    pub const fn from_number(number: u32) -> Option<Self> {
        match number {
            0 => Some(Part::Control),
            1 => Some(Part::Sensor),
            2 => Some(Part::Telemetry),
            _ => None,
        }
    }

    /// Its name in the log.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Part::Control => "control",
            Part::Sensor => "sensor",
            Part::Telemetry => "telemetry",
        }
    }
}

/// Progress of each part, and when it was read. All four wrap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Progress {
    /// Ticks that were finished.
    pub control: u32,
    /// Samples that were taken.
    pub sensor: u32,
    /// Rounds of the telemetry task.
    pub telemetry: u32,
    /// Free-running clock, us.
    pub now_us: u32,
}

/// Whether all parts make progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Liveness {
    /// All three make progress at the right pace: reload.
    Alive,
    /// Not yet: do not reload, check again.
    Wait,
    /// This part made no progress, or too little, for [`GRACE_US`]: switch off, reset.
    Stalled(Part),
    /// This part runs faster than the clock: switch off, reset.
    Racing(Part),
}

/// Compares the progress since the last reload with the time since then.
///
/// ```
/// use firmware_shared::liveness::{Part, Progress, Liveness, judge};
/// let fed = Progress::default();
/// let healthy = Progress { control: 5, sensor: 5, telemetry: 2, now_us: 5_000 };
/// assert_eq!(judge(&fed, &healthy), Liveness::Alive);
/// assert_eq!(judge(&fed, &Progress { control: 50, ..healthy }), Liveness::Racing(Part::Control));
/// ```
#[must_use]
pub fn judge(fed: &Progress, now: &Progress) -> Liveness {
    let passed_us = now.now_us.wrapping_sub(fed.now_us);
    let expected = passed_us / crate::pacing::PERIOD_US;
    let ticks = now.control.wrapping_sub(fed.control);
    let samples = now.sensor.wrapping_sub(fed.sensor);
    let rounds = now.telemetry.wrapping_sub(fed.telemetry);

    let too_many = expected + SLACK_TICKS;
    if ticks > too_many {
        return Liveness::Racing(Part::Control);
    }
    if samples > too_many {
        return Liveness::Racing(Part::Sensor);
    }
    let enough = |count: u32| count > 0 && count + SLACK_TICKS >= expected;
    // Sampling first: without samples there are no ticks either.
    let stalled = match (enough(samples), enough(ticks), rounds > 0) {
        (false, _, _) => Part::Sensor,
        (_, false, _) => Part::Control,
        (_, _, false) => Part::Telemetry,
        (true, true, true) => return Liveness::Alive,
    };
    if passed_us < GRACE_US { Liveness::Wait } else { Liveness::Stalled(stalled) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FED: Progress = Progress { control: u32::MAX - 1, sensor: u32::MAX, telemetry: 7, now_us: u32::MAX - 999 };

    fn after(ticks: u32, samples: u32, rounds: u32, passed_us: u32) -> Liveness {
        let now = Progress {
            control: FED.control.wrapping_add(ticks),
            sensor: FED.sensor.wrapping_add(samples),
            telemetry: FED.telemetry.wrapping_add(rounds),
            now_us: FED.now_us.wrapping_add(passed_us),
        };
        judge(&FED, &now)
    }

    #[test]
    fn alive_at_the_right_pace_through_every_wrap() {
        assert_eq!(after(5, 5, 2, 5_000), Liveness::Alive);
        assert_eq!(after(4, 5, 3, 5_200), Liveness::Alive);
    }

    #[test]
    fn each_stalled_task_is_reported_by_name() {
        for (ticks, samples, rounds, part) in [
            (10, 10, 0, Part::Telemetry),
            (0, 10, 5, Part::Control),
            (0, 0, 5, Part::Sensor),
            (3, 10, 5, Part::Control),
        ] {
            assert_eq!(after(ticks, samples, rounds, GRACE_US - 1), Liveness::Wait, "{part:?}");
            assert_eq!(after(ticks, samples, rounds, GRACE_US), Liveness::Stalled(part), "{part:?}");
        }
    }

    #[test]
    fn racing_is_caught_at_once() {
        assert_eq!(after(8, 5, 2, 5_000), Liveness::Racing(Part::Control));
        assert_eq!(after(5, 8, 2, 5_000), Liveness::Racing(Part::Sensor));
        assert_eq!(after(3, 3, 1, 0), Liveness::Racing(Part::Control));
    }

    #[test]
    fn no_progress_is_not_alive_after_any_time() {
        for passed_us in [0, 1_000, 2_999] {
            assert_eq!(after(0, 1, 1, passed_us), Liveness::Wait, "{passed_us}");
            assert_eq!(after(1, 0, 1, passed_us), Liveness::Wait, "{passed_us}");
        }
    }

    #[test]
    fn half_the_pace_is_too_slow() {
        assert_eq!(after(5, 5, 5, GRACE_US), Liveness::Stalled(Part::Sensor));
        assert_eq!(after(8, 8, 5, GRACE_US), Liveness::Alive);
    }

    /// Rounds of the watchdog task while this share of ticks is lost, until one reports it.
    fn rounds_until_found(lost_percent: u32) -> Option<u32> {
        let at = |ms: u32| {
            let ticks = ms - ms * lost_percent / 100;
            Progress { control: ticks, sensor: ticks, telemetry: ms / 2, now_us: ms * 1_000 }
        };
        let mut from = at(0);
        (1..1_000).find(|round| match keeps_pace(&from, &at(round * 5)) {
            Liveness::Wait => false,
            Liveness::Alive => {
                from = at(round * 5);
                false
            }
            _ => true,
        })
    }

    #[test]
    fn lost_ticks_add_up() {
        assert_eq!(rounds_until_found(40), Some(PACE_US / FEED_US));
        assert_eq!(rounds_until_found(15), Some(PACE_US / FEED_US));
        assert_eq!((rounds_until_found(10), rounds_until_found(0)), (None, None));
        // The comparison of single rounds does not find them.
        assert_eq!(after(3, 3, 2, 5_000), Liveness::Alive);
    }

    #[test]
    fn the_time_out_exceeds_the_grace_at_every_frequency() {
        for hz in (LSI_SLOWEST_HZ..=LSI_FASTEST_HZ).step_by(100) {
            assert!(timeout_us(hz) > GRACE_US + RETRY_US && timeout_us(hz) <= WORST_BITE_US, "{hz} Hz");
        }
    }

    #[test]
    fn parts_survive_the_crash_record() {
        for part in [Part::Control, Part::Sensor, Part::Telemetry] {
            assert_eq!(Part::from_number(part as u32), Some(part));
        }
        assert_eq!(Part::from_number(3), None);
    }
}
