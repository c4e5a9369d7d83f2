//! What the servos may get: from the file of a campaign, or from the records in flash.
//!
//! This reads the records by their description in `joint_loop::store`, not with its code: a mistake there is not repeated here.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use serde::Deserialize;

/// What the servos may get: the joints' ranges and rates, as pulses. In the order of the servo pins.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Limits {
    /// Shortest pulse, us.
    pub(crate) least_us: [f64; 4],
    /// Longest pulse, us.
    pub(crate) most_us: [f64; 4],
    /// Fastest change, us a second.
    pub(crate) us_per_s: [f64; 4],
    /// Pulse in the park pose, us.
    pub(crate) park_us: [f64; 4],
    /// Shortest and longest pulse of each servo in a trim, in which the range of the joint is not known yet, us; `None`: no trim.
    #[serde(skip)]
    pub(crate) trim_us: Option<[[f64; 2]; 4]>,
    /// Longest time of a stop by the button from a pose within the limits, s: longer than the ramp where a joint is slower than it.
    #[serde(skip, default = "Limits::ramp_s")]
    pub(crate) stop_s: f64,
}

/// The ramp of a stop, and the longest time after it in which the joints may still come to the park pose, s.
const RAMP_S: f64 = 1.0;
const GRACE_S: f64 = 0.5;

/// The parameter sectors from the start of flash on: the magic word of the record of each, generator, sensors, robot.
const SECTORS: [(usize, &[u8; 4]); 3] = [(0x4000, b"FFWK"), (0x8000, b"FFSN"), (0xC000, b"FFRB")];
/// Bytes of a sector.
const SECTOR_BYTES: usize = 0x4000;
/// Bytes from the start of flash to the end of the parameter sectors.
pub(crate) const PARAMETERS_END: usize = 0x1_0000;
/// Bytes before the words of a record, and after them.
const HEAD: usize = 36;
const TAIL: usize = 8;
/// Schema and kind of a robot record, without feedback and with it, whose words stand behind those of the joints.
const ROBOT_KINDS: [[u8; 4]; 2] = [[2, 0, 1, 0], [2, 0, 2, 0]];
/// Words before those of the joints: the least supply, and when a follower stops by itself.
const HEAD_WORDS: usize = 3;
/// Words of a joint in it.
const JOINT_WORDS: usize = 11;

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Content of a parameter sector.
enum Sector<'a> {
    Erased,
    /// A record: its schema and kind, and its words.
    Record(&'a [u8], &'a [u8]),
    Damaged,
}

impl<'a> Sector<'a> {
    fn of(flash: &'a [u8], (at, magic): (usize, &[u8; 4])) -> Self {
        // The file of the program need not reach to the sector: the rest of flash is erased.
        let sector = flash.get(at..flash.len().min(at + SECTOR_BYTES)).unwrap_or_default();
        if sector.iter().all(|byte| *byte == 0xFF) {
            return Sector::Erased;
        }
        Self::record(sector, magic).unwrap_or(Sector::Damaged)
    }

    fn record(sector: &'a [u8], magic: &[u8; 4]) -> Option<Self> {
        let count = u32::from_le_bytes(sector.get(8..12)?.try_into().ok()?) as usize;
        let end = HEAD + count.checked_mul(4)?;
        let (covered, rest) = sector.split_at_checked(end)?;
        let (tail, rest) = rest.split_at_checked(TAIL)?;
        let is_whole = covered.starts_with(magic)
            && tail[..4] == CRC.checksum(covered).to_le_bytes()
            && tail[4..] == *b"DONE"
            && rest.iter().all(|byte| *byte == 0xFF);
        is_whole.then(|| Sector::Record(&covered[4..8], &covered[HEAD..]))
    }
}

/// A joint of the robot record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Joint {
    /// Pulse of the servo at `angle_at_neutral`, us.
    pub(crate) neutral_us: f64,
    /// rad.
    pub(crate) angle_at_neutral: f64,
    /// Change of the pulse, us a radian: negative where the servo is mirrored.
    pub(crate) us_per_radian: f64,
    /// Least and most angle, rad.
    pub(crate) range: [f64; 2],
    /// Highest rate, rad/s.
    pub(crate) rate: f64,
    /// Highest acceleration, rad/s^2.
    pub(crate) acceleration: f64,
    /// Angle in the park pose, rad.
    pub(crate) park: f64,
    /// Shortest and longest pulse of the servo, us.
    pub(crate) pulses_us: [f64; 2],
}

impl Joint {
    /// The built-in robot, which walks where the sector of the robot is erased: hips from -30 to 60 degrees, knees from -2 to 120, 500 degrees a second and 20,000 a second squared,
    /// parked with the knees at 5 degrees; 1500 us at 0 degrees of a hip and 45 of a knee, 1000 us for 90 degrees, the right side mirrored.
    fn built_in() -> [Self; 4] {
        let joint = |[least, most]: [f64; 2], at_neutral: f64, park: f64, us_per_radian: f64| Joint {
            neutral_us: 1500.0,
            angle_at_neutral: at_neutral.to_radians(),
            us_per_radian,
            range: [least.to_radians(), most.to_radians()],
            rate: 500.0_f64.to_radians(),
            acceleration: 20_000.0_f64.to_radians(),
            park: park.to_radians(),
            pulses_us: [500.0, 2500.0],
        };
        let (hip, knee) = ([-30.0, 60.0], [-2.0, 120.0]);
        [
            joint(hip, 0.0, 0.0, 636.62),
            joint(hip, 0.0, 0.0, -636.62),
            joint(knee, 45.0, 5.0, 636.62),
            joint(knee, 45.0, 5.0, -636.62),
        ]
    }

    /// The joints of the robot record in flash, which begins at the vector table; those of the built-in robot where its sector is erased. `None`: the board
    /// may give no pulse, because a sector is damaged.
    pub(crate) fn of_flash(flash: &[u8]) -> Option<[Self; 4]> {
        let [generator, sensors, robot] = SECTORS.map(|sector| Sector::of(flash, sector));
        if matches!(generator, Sector::Damaged) || matches!(sensors, Sector::Damaged) {
            return None;
        }
        let (schema, words) = match robot {
            Sector::Record(schema, words) => (schema, words),
            Sector::Erased => return Some(Self::built_in()),
            Sector::Damaged => return None,
        };
        if !ROBOT_KINDS.iter().any(|kind| schema == kind) {
            return None;
        }
        let words: Vec<u32> =
            words.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
        let joints: Vec<Self> =
            words.get(HEAD_WORDS..)?.chunks_exact(JOINT_WORDS).take(4).map(Self::of_words).collect();
        joints.try_into().ok()
    }

    fn of_words(words: &[u32]) -> Self {
        let float = |place: usize| f64::from(f32::from_bits(words[place]));
        let micros = |place: usize| f64::from(words[place]);
        Joint {
            neutral_us: micros(5),
            angle_at_neutral: float(6),
            us_per_radian: if words[8] == 1 { -float(7) } else { float(7) },
            range: [float(0), float(1)],
            rate: float(2),
            acceleration: float(3),
            park: float(4),
            pulses_us: [micros(9), micros(10)],
        }
    }

    /// Longest time of a stop of this joint, s: it turns round, and goes the longest way to its park pose at its rate; then its time is up.
    fn stop_s(&self) -> f64 {
        let way = self.range.map(|end| (end - self.park).abs()).into_iter().fold(0.0, f64::max);
        // To turn round takes twice the time of a full acceleration, and the way of it is the same out and back; to brake takes one more.
        let turns_s = self.rate / self.acceleration;
        (way / self.rate + 4.0 * turns_s).clamp(RAMP_S, RAMP_S + GRACE_S)
    }

    /// Pulse of an angle, us.
    fn pulse_us(&self, angle: f64) -> f64 {
        self.neutral_us + self.us_per_radian * (angle - self.angle_at_neutral)
    }

    /// Angle of a pulse, rad.
    pub(crate) fn angle(&self, us: f64) -> f64 {
        self.angle_at_neutral + (us - self.neutral_us) / self.us_per_radian
    }
}

impl Limits {
    /// The limits of the robot record in flash, or of the built-in robot. `None`: the board may give no pulse.
    pub(crate) fn of_flash(flash: &[u8]) -> Option<Self> {
        let joints = Joint::of_flash(flash)?;
        let ends = joints.map(|joint| joint.range.map(|angle| joint.pulse_us(angle)));
        Some(Limits {
            least_us: ends.map(|[first, second]| first.min(second)),
            most_us: ends.map(|[first, second]| first.max(second)),
            us_per_s: joints.map(|joint| joint.us_per_radian.abs() * joint.rate),
            park_us: joints.map(|joint| joint.pulse_us(joint.park)),
            trim_us: Some(joints.map(|joint| joint.pulses_us)),
            stop_s: joints.iter().map(Joint::stop_s).fold(RAMP_S, f64::max),
        })
    }

    /// Longest time of a stop by the button from anywhere, s.
    pub(crate) const LONGEST_STOP_S: f64 = RAMP_S + GRACE_S;

    const fn ramp_s() -> f64 {
        RAMP_S
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A flash whose robot has, for each joint, -1 to 1 rad at 2 rad/s and 600 us/rad around 1500 us, the last one mirrored around 0.5 rad.
    pub(in crate::judge) fn flash() -> Vec<u8> {
        flash_of(1, &[])
    }

    /// The same with another kind of record, and words behind those of the joints.
    fn flash_of(kind: u8, more: &[u32]) -> Vec<u8> {
        let mut words = vec![3.0_f32.to_bits(), 10.0_f32.to_bits(), 0];
        for joint in 0..4 {
            let mirrored = u32::from(joint == 3);
            let floats = [-1.0, 1.0, 2.0, 100.0, 0.5 * mirrored as f32].map(f32::to_bits);
            words.extend(floats);
            words.extend([1500, (0.5_f32 * mirrored as f32).to_bits(), 600.0_f32.to_bits(), mirrored, 550, 2450]);
        }
        words.extend(more);
        let mut record = [&b"FFRB\x02\x00"[..], &[kind, 0]].concat();
        record.extend((words.len() as u32).to_le_bytes());
        record.extend([b'a'; 24]);
        words.iter().for_each(|word| record.extend(word.to_le_bytes()));
        record.extend(CRC.checksum(&record).to_le_bytes());
        record.extend(b"DONE");
        let mut flash = vec![0xFF; 0xC000];
        flash.extend(record);
        flash
    }

    #[test]
    fn the_limits_are_those_of_the_record() {
        let limits = Limits::of_flash(&flash()).expect("a robot");
        assert_eq!(
            (limits.least_us, limits.most_us),
            ([900.0, 900.0, 900.0, 1200.0], [2100.0, 2100.0, 2100.0, 2400.0])
        );
        assert_eq!((limits.us_per_s, limits.trim_us), ([1200.0; 4], Some([[550.0, 2450.0]; 4])));
        assert_eq!((limits.park_us, limits.stop_s), ([1500.0; 4], 1.0));
    }

    #[test]
    fn feedback_changes_no_limit_and_another_kind_allows_no_pulse() {
        let feedback = [0.0_f32, 0.0, 0.3, 0.3].map(f32::to_bits);
        assert_eq!(Limits::of_flash(&flash_of(2, &feedback)), Limits::of_flash(&flash()));
        assert_eq!(Limits::of_flash(&flash_of(3, &feedback)), None);
    }

    #[test]
    fn a_damaged_sector_allows_no_pulse() {
        let good = flash();
        let built_in = Limits::of_flash(&good[..0xC000]).expect("the built-in robot");
        // As the files of the campaign have them, which a test compares with the default robot.
        let near = |one: [f64; 4], other: [f64; 4]| one.iter().zip(other).all(|(one, other)| (one - other).abs() < 0.1);
        assert!(near(built_in.least_us, [1166.6, 833.3, 977.7, 666.6]), "{built_in:?}");
        assert!(near(built_in.most_us, [2166.7, 1833.4, 2333.4, 2022.3]), "{built_in:?}");
        assert!(
            near(built_in.us_per_s, [5555.6; 4]) && near(built_in.park_us, [1500.0, 1500.0, 1055.6, 1944.4]),
            "{built_in:?}"
        );
        // 60 degrees a second and 200 a second squared: the knee's 115 degrees take longer than the ramp and what may follow it.
        let slow = Joint { rate: 60.0_f64.to_radians(), acceleration: 200.0_f64.to_radians(), ..Joint::built_in()[2] };
        assert_eq!((built_in.stop_s, slow.stop_s()), (1.0, 1.5));
        for at in 0xC000..good.len() {
            let mut changed = good.clone();
            changed[at] ^= 0x10;
            assert_eq!(Limits::of_flash(&changed), None, "byte {at:#x}");
        }
        for at in [0x4000, 0x7FFF, 0x8000, 0xBFFF] {
            let mut changed = good.clone();
            changed[at] = 0;
            assert_eq!(Limits::of_flash(&changed), None, "byte {at:#x} of another sector");
        }
        let longer = [good.clone(), vec![0xFF; 100], vec![0]].concat();
        assert_eq!(Limits::of_flash(&longer), None, "something after the record");
        let next_sector = [good.clone(), vec![0xFF; 0x1_0000 - good.len()], vec![0; 8]].concat();
        assert!(Limits::of_flash(&next_sector).is_some(), "the program begins at 0x10000");
    }
}
