//! State, angles and supply in a line of the log, in columns.

use core::fmt::{self, Write as _};

use heapless::String;
use joint_loop::Cause;
use joint_units::Radians;
use wire::Frame;

/// Bytes of the longest line: four sensors that are out of their tables, and the longest cause.
pub const MAX_BYTES: usize = 192;

/// The line. With one sensor and no cause it has at most 66 characters, so that it fits into 80 columns behind the time.
///
/// ```text
/// walking: hips  12 -30 knees   5  60 deg, sensor  14 good, 3.01 V
/// ```
/// The angles are the setpoints of left hip, right hip, left knee and right knee, then each sensor's angle with its validity, in whole degrees; the
/// supply is missing where the board does not measure it. A cause follows the state, so that each line of a board that does not arm says why:
/// `disarmed (stop_untested): hips ...`.
#[must_use]
pub fn of(frame: &Frame, supply_v: Option<f32>) -> String<MAX_BYTES> {
    let mut line = String::new();
    // What does not fit is left out.
    let _ = write(&mut line, frame, supply_v);
    line
}

fn write(line: &mut String<MAX_BYTES>, frame: &Frame, supply_v: Option<f32>) -> fmt::Result {
    let [left_hip, right_hip, left_knee, right_knee] = frame.setpoints_rad.map(whole_degrees);
    line.push_str(frame.state.name()).map_err(|_| fmt::Error)?;
    if frame.cause != Cause::None {
        write!(line, " ({})", frame.cause.name())?;
    }
    write!(line, ": hips {left_hip:>3} {right_hip:>3} knees {left_knee:>3} {right_knee:>3} deg")?;
    for sensor in frame.sensors.iter().flatten() {
        write!(line, ", sensor {:>3} {}", whole_degrees(sensor.angle_rad), sensor.validity.name())?;
    }
    if let Some(volts) = supply_v {
        let hundredths = (volts * 100.0 + 0.5) as u32;
        write!(line, ", {}.{:02} V", hundredths / 100, hundredths % 100)?;
    }
    Ok(())
}

fn whole_degrees(radians: f32) -> i32 {
    let degrees = Radians(radians).degrees();
    // The cast rounds towards zero.
    (degrees + if degrees < 0.0 { -0.5 } else { 0.5 }) as i32
}

#[cfg(test)]
mod tests {
    use hgod_adc::Validity;
    use joint_loop::SupervisorState;
    use wire::Reading;

    use super::*;

    fn frame(state: SupervisorState, degrees: [f32; 4], sensors: [Option<Reading>; 4]) -> Frame {
        Frame {
            tick: 1,
            seq: 1,
            state,
            cause: Cause::None,
            sensors,
            following: None,
            setpoints_rad: degrees.map(f32::to_radians),
            pulses_us: [1500; 4],
            late: 0,
            missed: 0,
            overruns: 0,
            limited: 0,
            limited_ticks: 0,
            setpoint_hash: 0,
        }
    }

    fn reading(degrees: f32, validity: Validity) -> Option<Reading> {
        Some(Reading { angle_rad: degrees.to_radians(), validity })
    }

    #[test]
    fn angles_are_rounded_and_stand_in_columns() {
        let walking = frame(
            SupervisorState::Walking,
            [12.4, -29.6, 5.0, 60.4],
            [reading(14.2, Validity::Good), None, None, None],
        );
        assert_eq!(of(&walking, Some(3.006)), "walking: hips  12 -30 knees   5  60 deg, sensor  14 good, 3.01 V");
        let disarmed = frame(SupervisorState::Disarmed, [0.0; 4], [None; 4]);
        assert_eq!(of(&disarmed, None), "disarmed: hips   0   0 knees   0   0 deg");
        let untested = Frame { cause: Cause::StopUntested, ..disarmed };
        assert_eq!(of(&untested, None), "disarmed (stop_untested): hips   0   0 knees   0   0 deg");
    }

    #[test]
    fn the_longest_lines_fit() {
        for state in SupervisorState::ALL {
            for validity in Validity::ALL {
                let one = frame(state, [-120.0; 4], [reading(-120.0, validity), None, None, None]);
                let line = of(&one, Some(3.29));
                assert!(line.ends_with("3.29 V"), "{line}");
                let mut four = frame(state, [-120.0; 4], [reading(-120.0, validity); 4]);
                for cause in Cause::ALL {
                    four.cause = cause;
                    assert!(of(&four, Some(3.29)).ends_with("3.29 V"), "{}", of(&four, Some(3.29)));
                }
            }
        }
        // Walking with a good sensor, angles of three characters: 80 columns with `[defmt] ` and a time below 100 s in front.
        let usual = frame(SupervisorState::Walking, [-60.0; 4], [reading(-30.0, Validity::Good), None, None, None]);
        assert!("[defmt] 12.345 ".len() + of(&usual, Some(3.01)).len() <= 80, "{}", of(&usual, Some(3.01)));
    }
}
