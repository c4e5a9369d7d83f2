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
    /// Shortest and longest pulse of each servo in a trim, in which the range of the joint is not known yet, us; `None`: no trim.
    #[serde(skip)]
    pub(crate) trim_us: Option<[[f64; 2]; 4]>,
}

/// The parameter sectors from the start of flash on: the magic word of the record of each, generator, sensors, robot.
const SECTORS: [(usize, &[u8; 4]); 3] = [(0x4000, b"FFWK"), (0x8000, b"FFSN"), (0xC000, b"FFRB")];
/// Bytes of a sector.
const SECTOR_BYTES: usize = 0x4000;
/// Bytes before the words of a record, and after them.
const HEAD: usize = 36;
const TAIL: usize = 8;
/// Schema and kind of a robot record.
const ROBOT_SCHEMA: [u8; 4] = [1, 0, 1, 0];
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
        let (body, rest) = sector.split_at_checked(end)?;
        let (tail, rest) = rest.split_at_checked(TAIL)?;
        let is_whole = body.starts_with(magic)
            && tail[..4] == CRC.checksum(body).to_le_bytes()
            && tail[4..] == *b"DONE"
            && rest.iter().all(|byte| *byte == 0xFF);
        is_whole.then(|| Sector::Record(&body[4..8], &body[HEAD..]))
    }
}

impl Limits {
    /// The limits of the robot record in flash, which begins at the vector table. `None`: the board may give no pulse, because there is no robot
    /// record or a sector is damaged.
    pub(crate) fn of_flash(flash: &[u8]) -> Option<Self> {
        let [generator, sensors, robot] = SECTORS.map(|sector| Sector::of(flash, sector));
        if matches!(generator, Sector::Damaged) || matches!(sensors, Sector::Damaged) {
            return None;
        }
        let Sector::Record(schema, words) = robot else { return None };
        if *schema != ROBOT_SCHEMA {
            return None;
        }
        let words: Vec<u32> =
            words.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
        let mut limits = Limits { least_us: [0.0; 4], most_us: [0.0; 4], us_per_s: [0.0; 4], trim_us: None };
        let mut trim = [[0.0; 2]; 4];
        // The least supply is before the joints.
        for (servo, joint) in words.get(1..)?.chunks_exact(JOINT_WORDS).take(4).enumerate() {
            let float = |place: usize| f64::from(f32::from_bits(joint[place]));
            let micros = |place: usize| f64::from(joint[place]);
            let (scale, mirrored) = (float(7), joint[8] == 1);
            let pulse = |angle: f64| micros(5) + if mirrored { -scale } else { scale } * (angle - float(6));
            let [first, second] = [pulse(float(0)), pulse(float(1))];
            (limits.least_us[servo], limits.most_us[servo]) = (first.min(second), first.max(second));
            limits.us_per_s[servo] = scale * float(2);
            trim[servo] = [micros(9), micros(10)];
        }
        if words.len() < 1 + 4 * JOINT_WORDS {
            return None;
        }
        Some(Limits { trim_us: Some(trim), ..limits })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A flash whose robot has, for each joint, -1 to 1 rad at 2 rad/s and 600 us/rad around 1500 us, the last one mirrored around 0.5 rad.
    pub(in crate::judge) fn flash() -> Vec<u8> {
        let mut words = vec![3.0_f32.to_bits()];
        for joint in 0..4 {
            let mirrored = u32::from(joint == 3);
            let floats = [-1.0, 1.0, 2.0, 100.0, 0.0].map(f32::to_bits);
            words.extend(floats);
            words.extend([1500, (0.5_f32 * mirrored as f32).to_bits(), 600.0_f32.to_bits(), mirrored, 550, 2450]);
        }
        let mut record = b"FFRB\x01\x00\x01\x00".to_vec();
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
    }

    #[test]
    fn a_damaged_sector_allows_no_pulse() {
        let good = flash();
        assert_eq!(Limits::of_flash(&good[..0xC000]), None, "no robot");
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
