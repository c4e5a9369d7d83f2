//! The log: lines for people, by `defmt`, in the first channel of [`crate::rtt`]. Programs read the records beside them.
//!
//! Time stamps come from the free-running timer, so they continue when the control task stops.

use core::fmt::Display;

use crate::board::BOARD;
use firmware_shared::post_mortem::LOCKOUT_STREAK;
use heapless::String;
use joint_units::AdcCode;
use wire::{Boot, BrownOut, Record, Refused, Subject, VERSION, Warnings};

use crate::clocks;
use crate::faults::LastRun;
use crate::parameters::Loaded;
use crate::program;
use crate::rtt;
use crate::variant::{SEAL_REQUIRED, SENSOR_REQUIRED, SHADOW};

/// Reports the boot, and returns its record; `loaded` is `None` if the parameters were refused, which is reported next.
pub(crate) fn boot(last: &LastRun, reference_cal: AdcCode, loaded: Option<&Loaded>) -> Boot {
    // A name longer than its field would become empty; none is so long.
    let text = |name: &str| String::try_from(name).unwrap_or_default();
    let min_supply = loaded.map_or(BOARD.min_supply, |loaded| loaded.parameters.robot.min_supply_on(BOARD.min_supply));
    let boot = Boot {
        version: VERSION,
        board: text(BOARD.name),
        chip: text(BOARD.chip),
        reset: last.reset,
        streak: last.streak,
        reference_cal: reference_cal.0,
        min_supply_v: min_supply.0,
        sensor_required: SENSOR_REQUIRED,
        generator: loaded.map(|loaded| loaded.generator.clone()),
        sensors: loaded.map(|loaded| loaded.sensors.clone()),
        robot: loaded.map(|loaded| loaded.robot.clone()),
        shadow: SHADOW,
        last_outputs: last.outputs,
        sealed: program::sealed(),
        brown_out: clocks::brown_out(),
    };
    lines::boot(&boot);
    send(&Record::Boot(boot.clone()));
    lines::crash(last);
    if let Some(outputs) = &last.outputs {
        lines::last_outputs(outputs);
    }
    if last.streak >= LOCKOUT_STREAK {
        refused(
            Subject::Arming,
            format_args!(
                "{} crashes in a row; allowed is less than {LOCKOUT_STREAK}: switch the power off, or press reset",
                last.streak
            ),
        );
    }
    if loaded.is_some_and(Loaded::lacks_brown_out_reset) {
        refused(
            Subject::Arming,
            format_args!("the brown-out reset is off, and the robot record demands it: {}", clocks::BROWN_OUT_HELP),
        );
    }
    warn(warnings(&boot, loaded.is_some_and(|loaded| loaded.built_in_robot)), boot.brown_out);
    boot
}

/// What a boot warns of and arms all the same.
pub(crate) fn warnings(boot: &Boot, built_in_robot: bool) -> Warnings {
    Warnings::UNSEALED
        .when(boot.sealed == Some(false) && !SEAL_REQUIRED)
        .with(Warnings::BROWN_OUT.when(!boot.brown_out.is_right()))
        .with(Warnings::BUILT_IN_ROBOT.when(built_in_robot))
}

/// Says each of these in words: at the boot, and again whenever the board arms.
pub(crate) fn warn(warnings: Warnings, brown_out: BrownOut) {
    warnings.each().for_each(|one| lines::warning(one, brown_out));
}

/// Reports a refusal with its reason.
pub(crate) fn refused(subject: Subject, reason: impl Display) {
    refusal(&Refused::new(subject, reason));
}

/// The same with its record.
pub(crate) fn refusal(refused: &Refused) {
    lines::refused(refused);
    send(&Record::Refused(refused.clone()));
}

/// Sends a record to the debug probe.
#[inline(never)]
pub(crate) fn send(record: &Record) {
    rtt::send(wire::frame_record(record, &mut [0; wire::MAX_FRAME_BYTES]).unwrap_or_default());
}

pub(crate) use lines::{
    answered, armed_with_debugger, sensor_changed, stalled, state, status, supply_dipped, truncated,
};

/// The messages.
#[cfg(target_os = "none")]
mod lines {
    use defmt::{Format, Formatter};
    use firmware_shared::liveness::Part;
    use firmware_shared::post_mortem::Cause;
    use firmware_shared::status_line;
    use joint_loop::SensorCounts;
    use joint_loop::tuning::Answer;
    use wire::{Boot, BrownOut, Change, Frame, LastOutputs, RecordId, Refused, Warnings};

    use crate::clocks::BROWN_OUT_HELP;
    use crate::faults::LastRun;

    defmt::timestamp!("{=u64:ms}", crate::stopwatch::log_us() / 1000);

    pub(super) fn boot(boot: &Boot) {
        defmt::info!(
            "{=str} {=str}: reset {=str}, {=u32} crashes in a row before; generator {}, sensors {} ({=str}), robot {}; outputs {=str}",
            boot.board.as_str(),
            boot.chip.as_str(),
            boot.reset.name(),
            boot.streak,
            Shown(&boot.generator),
            Shown(&boot.sensors),
            if boot.sensor_required { "required" } else { "not required" },
            Shown(&boot.robot),
            if boot.shadow { "off: shadow mode" } else { "drive the servos" }
        );
    }

    /// A record: its name in quotes, and its check sum.
    struct Shown<'a>(&'a Option<RecordId>);

    impl Format for Shown<'_> {
        fn format(&self, to: Formatter<'_>) {
            match self.0 {
                Some(id) => defmt::write!(to, "\"{=str}\" {=u32:08x}", id.name.as_str(), id.crc),
                None => defmt::write!(to, "refused"),
            }
        }
    }

    pub(super) fn crash(last: &LastRun) {
        let Some(crash) = &last.crash else { return };
        let [first, second] = crash.details;
        let cause = crash.cause.name();
        match crash.cause {
            Cause::Panic => {
                defmt::error!("last run ended by {=str} in {=str} line {=u32}", cause, crash.text(), first)
            }
            Cause::HardFault => {
                defmt::error!("last run ended by {=str} at pc {=u32:#x} cfsr {=u32:#x}", cause, first, second)
            }
            Cause::StackOverflow => {
                defmt::error!("last run ended by {=str} at sp {=u32:#x} cfsr {=u32:#x}", cause, first, second)
            }
            Cause::Stalled | Cause::Racing => {
                let part = Part::from_number(first).map_or("?", Part::name);
                defmt::error!("last run ended by {=str} task {=str}", cause, part);
            }
            Cause::UnexpectedInterrupt => defmt::error!("last run ended by {=str} {=u32}", cause, first),
            Cause::None | Cause::ClockFailure | Cause::NonMaskable => {
                defmt::error!("last run ended by {=str}", cause)
            }
        }
    }

    /// What became of the pulses of the run before.
    pub(super) fn last_outputs(last: &LastOutputs) {
        if last.cut > 0 {
            defmt::warn!(
                "{=u32} servo pulses of the last run cut short by the break input or a clock failure",
                last.cut
            );
        }
        if last.on {
            defmt::warn!("the reset came while the outputs were on: up to 4 servo pulses cut short by it");
        }
    }

    /// What the board warns of.
    pub(super) fn warning(warning: Warnings, BrownOut { level, wanted }: BrownOut) {
        match warning {
            Warnings::UNSEALED => defmt::warn!(
                "the image has no seal: its program is not checked; `cargo xtask flash` and the runner of `cargo run` write one"
            ),
            Warnings::BROWN_OUT => defmt::warn!(
                "the brown-out reset is at level {=u8}, 0 is off; this board wants level {=u8}: {=str}",
                level,
                wanted,
                BROWN_OUT_HELP
            ),
            Warnings::BUILT_IN_ROBOT => {
                defmt::warn!(
                    "no robot record: the built-in robot walks; `cargo xtask flash --keep --robot` writes yours"
                )
            }
            Warnings::CATCHES => defmt::warn!(
                "a debugger halts the core in a fault or after a reset, and no handler runs: end its program, then switch the board off and on"
            ),
            _ => {}
        }
    }

    /// The board arms while a debugger is attached.
    pub(crate) fn armed_with_debugger() {
        defmt::warn!(
            "armed with a debugger attached: it may halt the core; then the pulses go on until the watchdog resets the board"
        );
    }

    pub(super) fn refused(refused: &Refused) {
        defmt::error!("{=str} refused: {=str}", refused.subject.name(), refused.reason.as_str());
    }

    /// The watchdog task is about to reset the board.
    pub(crate) fn stalled(part: Part, how: &'static str) {
        defmt::error!("{=str} {=str}: outputs off, reset", part.name(), how);
    }

    /// Servo pulses were cut short in the last second.
    pub(crate) fn truncated(count: u32) {
        defmt::warn!("{=u32} servo pulses cut short by the break input or a clock failure", count);
    }

    /// Dips of the supply in so many milliseconds.
    pub(crate) fn supply_dipped(dips: u32, ms: u32) {
        defmt::warn!("the supply fell below its minimum {=u32} times in {=u32} ms", dips, ms);
    }

    /// Changes of the validity of a sensor, counted from 1, in so many milliseconds.
    pub(crate) fn sensor_changed(channel: u32, counts: &SensorCounts, ms: u32) {
        let (not_good, most) = counts.not_good();
        defmt::warn!(
            "sensor {=u32}: its validity changed {=u32} times in {=u32} ms, not good for {=u32} ms of them, most of that {=str}",
            channel,
            counts.changes,
            ms,
            not_good,
            most.name()
        );
    }

    /// A change of state.
    pub(crate) fn state(change: &Change) {
        defmt::info!("{=str}, cause {=str}", change.state.name(), change.cause.name());
    }

    /// The answer to a request.
    pub(crate) fn answered(answer: &Answer) {
        defmt::info!("request {=u16}: {=str} at tick {=u32}", answer.number, answer.outcome.name(), answer.tick);
    }

    /// State, angles and supply, ten times a second.
    pub(crate) fn status(frame: &Frame, supply_v: Option<f32>) {
        defmt::println!("{=str}", status_line::of(frame, supply_v).as_str());
    }
}

/// The host has no log: it only checks the types.
#[cfg(not(target_os = "none"))]
mod lines {
    use firmware_shared::liveness::Part;
    use joint_loop::SensorCounts;
    use joint_loop::tuning::Answer;
    use wire::{Boot, BrownOut, Change, Frame, LastOutputs, Refused, Warnings};

    use crate::faults::LastRun;

    pub(super) fn boot(_boot: &Boot) {}
    pub(super) fn crash(_last: &LastRun) {}
    pub(super) fn last_outputs(_last: &LastOutputs) {}
    pub(super) fn warning(_warning: Warnings, _brown_out: BrownOut) {}
    pub(crate) fn armed_with_debugger() {}
    pub(super) fn refused(_refused: &Refused) {}
    pub(crate) fn stalled(_part: Part, _how: &'static str) {}
    pub(crate) fn truncated(_count: u32) {}
    pub(crate) fn supply_dipped(_dips: u32, _ms: u32) {}
    pub(crate) fn sensor_changed(_channel: u32, _counts: &SensorCounts, _ms: u32) {}
    pub(crate) fn answered(_answer: &Answer) {}
    pub(crate) fn state(_change: &Change) {}
    pub(crate) fn status(_frame: &Frame, _supply_v: Option<f32>) {}
}
