//! What stands between the control loop and the outputs from the boot on: the check of the pulses, and the licence to move.

use crate::faults::LastRun;
use crate::parameters::Loaded;
use crate::removed::{Protection, lacks};
use firmware_shared::licence::Licence;
use firmware_shared::post_mortem::LOCKOUT_STREAK;
use firmware_shared::pulse_check::PulseCheck;
use joint_loop::LoopError;
use joint_loop::setup::default_loop::BoardLoop;
use joint_units::PulseMicros;

/// Both, which the control task asks in each tick.
pub(crate) struct Guards {
    pub(crate) check: PulseCheck,
    pub(crate) licence: Licence,
}

/// Check and licence at the boot, and the pulses from which loop and check start: the last ones of the run before, where they are known.
///
/// # Errors
/// A servo map or the button is refused; the loop, which has the same ones, is built before.
pub(crate) fn build(joint_loop: &mut BoardLoop, loaded: &Loaded, last_run: &LastRun) -> Result<Guards, LoopError> {
    let mut check = PulseCheck::new(&loaded.parameters.robot)?;
    if let Some(last) = last_run.outputs.map(|last| last.pulses_us.map(PulseMicros))
        && joint_loop.start_from(last)
    {
        check.start_from(last);
    }
    let crashed = last_run.streak >= LOCKOUT_STREAK && !lacks(Protection::LockOut);
    let unsupplied = loaded.lacks_brown_out_reset() && !lacks(Protection::BrownOut);
    Ok(Guards { check, licence: Licence::new(crashed || unsupplied)? })
}
