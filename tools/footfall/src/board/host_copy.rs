//! The host's copy of the control loop of a board: built from the same records, which the boot record identifies.

use joint_loop::RecordName;
use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop};
use joint_loop::store::{generator_record, robot_record, sensor_record};
use joint_units::{AdcCode, PulseMicros, Volts};
use wire::{Boot, RecordId};

/// The host's copy of the loop of a board with this boot record; an error says why there is none.
///
/// A check sum is of the name too, so the parameters of this program are compared under the name that the board has for them.
pub(crate) fn loop_of(parameters: &Parameters, boot: &Boot) -> Result<BoardLoop, String> {
    let generator = |name: &RecordName| generator_record::record_of(&parameters.generator, name).crc();
    let sensors = |name: &RecordName| sensor_record::record_of(&parameters.sensors, name).crc();
    let robot = |name: &RecordName| robot_record::record_of(&parameters.robot, name).crc();
    for (what, board, known, option) in [
        (
            "generator record",
            &boot.generator,
            &generator as &dyn Fn(&RecordName) -> u32,
            "the file it was made from, with --generator",
        ),
        ("sensor record", &boot.sensors, &sensors, "the sensors of the board, with --sensor"),
        ("robot record", &boot.robot, &robot, "the file it was made from, with --robot"),
    ] {
        let Some(RecordId { name, crc }) = board else {
            return Err("the board refused its flash records; `cargo xtask flash` writes them".into());
        };
        let known = known(&RecordName::cut(name));
        if *crc != known {
            return Err(format!(
                "the board runs the {what} \"{name}\" {crc:08x}, this program has {known:08x}; allowed is {option}"
            ));
        }
    }
    let (reference_cal, min_supply) = (AdcCode(boot.reference_cal), Volts(boot.min_supply_v));
    let mut joints =
        board_loop(parameters, reference_cal, min_supply, boot.sensor_required).map_err(|error| error.to_string())?;
    begin(&mut joints, boot);
    Ok(joints)
}

/// Hands the loop what the board's loop got before its first tick: the last pulses of the run before.
pub fn begin(joints: &mut BoardLoop, boot: &Boot) {
    if let Some(last) = boot.last_outputs {
        joints.start_from(last.pulses_us.map(PulseMicros));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::default_loop::{TYPICAL_MIN_SUPPLY, TYPICAL_VREFINT_CAL};
    use joint_loop::RobotConfig;
    use joint_units::Radians;
    use wire::{BrownOut, LastOutputs, Reset};

    /// The boot record of a board with these parameters, under names that this program does not know.
    fn boot(parameters: &Parameters) -> Boot {
        let name = RecordName::new("as the board has it").unwrap();
        let id = |crc| Some(RecordId::new(name.as_str(), crc));
        Boot {
            version: wire::VERSION,
            board: "f4-discovery".try_into().unwrap(),
            chip: "STM32F407VGTx".try_into().unwrap(),
            reset: Reset::PowerOn,
            streak: 0,
            reference_cal: TYPICAL_VREFINT_CAL.0,
            min_supply_v: TYPICAL_MIN_SUPPLY.0,
            sensor_required: true,
            generator: id(generator_record::record_of(&parameters.generator, &name).crc()),
            sensors: id(sensor_record::record_of(&parameters.sensors, &name).crc()),
            robot: id(robot_record::record_of(&parameters.robot, &name).crc()),
            shadow: false,
            last_outputs: None,
            sealed: Some(true),
            brown_out: BrownOut { level: 3, wanted: 3 },
        }
    }

    fn parameters(robot: RobotConfig) -> Parameters {
        Parameters::with_defaults(None, None, robot).unwrap()
    }

    #[test]
    fn the_copy_knows_the_last_pulses_of_the_board() {
        let known = parameters(RobotConfig::default_biped());
        let knows = |pulses_us: [u16; 4]| {
            let last_outputs = Some(LastOutputs { pulses_us, on: true, cut: 0 });
            loop_of(&known, &Boot { last_outputs, ..boot(&known) }).unwrap().knows_last_pulses()
        };
        assert_eq!([[1_500; 4], [0; 4]].map(knows), [true, false]);
        assert!(!loop_of(&known, &boot(&known)).unwrap().knows_last_pulses());
    }

    #[test]
    fn the_copy_has_the_robot_of_the_board() {
        let mut other = RobotConfig::default_biped();
        other.park[0] = Radians(0.25);
        let [default, other] = [RobotConfig::default_biped(), other].map(parameters);
        for known in [&default, &other] {
            let joints = loop_of(known, &boot(known)).unwrap();
            assert_eq!(joints.frame().setpoints, known.robot.park);
        }
        let error = loop_of(&default, &boot(&other)).unwrap_err();
        assert!(error.contains("the robot record \"as the board has it\"") && error.contains("--robot"), "{error}");
    }

    /// One microsecond at one servo is another robot.
    #[test]
    fn any_other_number_is_another_robot() {
        let mut other = RobotConfig::default_biped();
        other.servos[3].neutral = PulseMicros(1_501);
        assert!(loop_of(&parameters(RobotConfig::default_biped()), &boot(&parameters(other))).is_err());
        let mut refused = boot(&parameters(other));
        refused.robot = None;
        let error = loop_of(&parameters(other), &refused).unwrap_err();
        assert!(error.contains("refused its flash records"), "{error}");
    }
}
