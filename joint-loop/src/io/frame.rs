//! The telemetry frame: inputs and outputs of one tick, and a running hash that a replay must reproduce.
//!
//! `seq` counts calls and `tick` counts control periods. A jump of `seq` means lost frames; `tick` growing faster than `seq`
//! means missed periods. Both wrap at 2^32 (50 days at 1 kHz).

use crate::control::supervisor::{Cause, SupervisorState};
use crate::motion::gate::GateStatus;
use cpg_core::entrainment;
use hgod_adc::Validity;
use joint_units::{Joint, PulseMicros, Radians};

/// Inputs and outputs of one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame<const S: usize> {
    /// Number of calls, wrapping; 0 before the first.
    pub seq: u32,
    /// Number of control periods, with missed ones, wrapping.
    pub tick: u32,
    /// State of the supervisor in this tick.
    pub state: SupervisorState,
    /// Why the last motion ended or arming was refused; [`Cause::None`] from the next arming on.
    pub cause: Cause,
    /// Filtered angle of each gait sensor; the last good one if the sample is not good; 0 on a channel without a sensor.
    pub measured: [Radians; S],
    /// Validity of each gait sensor's sample; `None` on a channel without a sensor.
    pub validity: [Option<Validity>; S],
    /// Tracking status of a follower; `None` for other generators.
    pub following: Option<entrainment::FollowStatus>,
    /// The four setpoints; the park pose while disarmed, the last setpoints after a fault.
    pub setpoints: [Radians; Joint::COUNT],
    /// The four pulse widths, microseconds; 0 while the outputs are off.
    pub pulses: [PulseMicros; Joint::COUNT],
    /// Number of ticks that began too late ([`Sample::late`](crate::Sample::late)), wrapping.
    pub late: u32,
    /// Number of missed control periods, wrapping.
    pub missed: u32,
    /// Number of ticks with an overrun of the converter, wrapping.
    pub overruns: u32,
    /// Limits that acted in this tick.
    pub limited: GateStatus,
    /// Number of ticks in which a limit acted, wrapping.
    pub limited_ticks: u32,
    /// Value of the [`SetpointHash`] over all ticks.
    pub setpoint_hash: u64,
}

/// Hash of a run: for each word of 32 bits, `hash = (hash ^ word) * 0x100000001b3` modulo 2^64, from 0xcbf29ce484222325 on. Those are the constants of
/// FNV-1a, which takes bytes; words cost a quarter. The words of every tick, in order: tick, number of the state, bits of the four setpoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SetpointHash(u64);

impl Default for SetpointHash {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl SetpointHash {
    /// Hash before the first tick.
    pub const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    /// Hash with this [`SetpointHash::value`], to continue it.
    #[must_use]
    pub const fn resumed(value: u64) -> Self {
        Self(value)
    }

    /// Hash with one more tick.
    #[must_use]
    pub fn then(self, tick: u32, state: SupervisorState, setpoints: &[Radians; Joint::COUNT]) -> Self {
        let begun = self.word(tick).word(state as u32);
        setpoints.iter().fold(begun, |hash, angle| hash.word(angle.0.to_bits()))
    }

    /// Value of the hash.
    #[must_use]
    pub const fn value(self) -> u64 {
        self.0
    }

    fn word(self, word: u32) -> Self {
        Self((self.0 ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_words_below_256_the_hash_is_fnv_1a() {
        // Published test vectors of FNV-1a 64: "", "a", "foobar".
        let hash =
            |bytes: &[u8]| bytes.iter().fold(SetpointHash::EMPTY, |hash, byte| hash.word((*byte).into())).value();
        assert_eq!(hash(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(hash(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(hash(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn every_bit_of_a_tick_changes_the_hash() {
        let angles = [0.0, -0.0, 1.5, 0.1].map(Radians);
        let hash = |tick, state, angles: &[Radians; 4]| SetpointHash::EMPTY.then(tick, state, angles).value();
        let whole = hash(7, SupervisorState::Walking, &angles);
        let words = [7, 3].into_iter().chain(angles.iter().map(|angle| angle.0.to_bits()));
        assert_eq!(whole, words.fold(SetpointHash::EMPTY, SetpointHash::word).value());
        for bit in 0..32 {
            assert_ne!(whole, hash(7 ^ (1 << bit), SupervisorState::Walking, &angles));
            for joint in 0..4 {
                let mut other = angles;
                other[joint] = Radians(f32::from_bits(other[joint].0.to_bits() ^ (1 << bit)));
                assert_ne!(whole, hash(7, SupervisorState::Walking, &other));
            }
        }
        for state in SupervisorState::ALL {
            assert_eq!(whole == hash(7, state, &angles), state == SupervisorState::Walking);
        }
    }
}
