//! The start, as far as it is the same for every family: records read, loop built, or the board stays off and says why.

use embassy_executor::{SpawnError, SpawnToken};
use firmware_shared::lamp::Shown;
use joint_loop::Conditions;
use joint_loop::SENSORS;
use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop_at};
use joint_units::AdcCode;
use static_cell::StaticCell;
use wire::{Boot, Subject};

use crate::board::BOARD;
use crate::faults::LastRun;
use crate::guards::{self, Guards};
use crate::parameters::{self, Loaded, NoParameters};
use crate::variant::SENSOR_REQUIRED;
use crate::{debugger, lamps, log};

// In statics, because `main` never returns: what is on its stack stays there.
static PARAMETERS: StaticCell<Parameters> = StaticCell::new();
static LOOP: StaticCell<BoardLoop> = StaticCell::new();

/// What telemetry tells of the boot.
pub(crate) struct BootReport {
    pub(crate) boot: Boot,
    /// Check sums of the generator's and the robot's parameters.
    pub(crate) unnamed: [u32; 2],
    pub(crate) sensors: usize,
    pub(crate) built_in_robot: bool,
    pub(crate) conditions: Conditions<SENSORS>,
}

/// What the tasks begin with.
pub(crate) struct Built {
    pub(crate) joint_loop: &'static mut BoardLoop,
    pub(crate) guards: Guards,
    pub(crate) report: BootReport,
}

/// Reads the records, and reports the boot in the log.
pub(crate) fn read(last_run: &LastRun, reference_cal: AdcCode) -> (Result<Loaded, NoParameters>, Boot) {
    let loaded = parameters::read(&PARAMETERS);
    let boot = log::boot(last_run, reference_cal, loaded.as_ref().ok());
    (loaded, boot)
}

/// The parameters; the board stays off without them.
pub(crate) fn loaded(read: &Result<Loaded, NoParameters>) -> &Loaded {
    match read {
        Ok(loaded) => loaded,
        Err(error) => stay_off(error.subject(), error),
    }
}

/// Builds the loop in its place. Every refusal that is left happens here, before anything can move.
pub(crate) fn build(loaded: &Loaded, boot: Boot, last_run: &LastRun, reference_cal: AdcCode) -> Built {
    let parameters = loaded.parameters;
    let min_supply = parameters.robot.min_supply_on(BOARD.min_supply);
    let built = board_loop_at(LOOP.uninit(), parameters, reference_cal, min_supply, SENSOR_REQUIRED);
    let guarded = match built {
        Ok(joint_loop) => guards::build(joint_loop, loaded, last_run).map(|guards| (joint_loop, guards)),
        Err(refusal) => stay_off(Subject::Configuration, refusal),
    };
    match guarded {
        Ok((joint_loop, guards)) => {
            let report = BootReport {
                boot,
                unnamed: loaded.unnamed,
                sensors: parameters.sensors.count(),
                built_in_robot: loaded.built_in_robot,
                conditions: joint_loop.conditions(),
            };
            Built { joint_loop, guards, report }
        }
        Err(refusal) => stay_off(Subject::Configuration, refusal),
    }
}

/// The one instance of a task.
pub(crate) fn only<S>(task: Result<SpawnToken<S>, SpawnError>) -> SpawnToken<S> {
    let Ok(task) = task else { panic!("a task was started twice") };
    task
}

/// Reports the reason in the log and by the lamps, with the servo lines low.
pub(crate) fn stay_off(subject: Subject, reason: impl core::fmt::Display) -> ! {
    log::refused(subject, reason);
    debugger::keep_log_readable();
    lamps::show_for_ever(Shown::Off(subject))
}
