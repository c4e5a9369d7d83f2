//! The telemetry frame: what one tick saw and did, and a running hash that a replay must reproduce.
//!
//! `seq` counts calls and `tick` counts control periods: a reader that sees `seq` jump has lost frames, a reader that sees
//! `tick` grow faster than `seq` knows that the loop has lost periods. Both wrap at 2^32 (50 days at 1 kHz).

use crate::{Cause, GateStatus, SupervisorState};
use cpg_core::entrainment;
use hgod_adc::Validity;
use joint_units::{Joint, PulseMicros, Radians};

/// What one tick saw and did.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame<const S: usize> {
    /// Calls so far, wrapping; 0 before the first.
    pub seq: u32,
    /// Control periods so far, those that were missed included, wrapping.
    pub tick: u32,
    /// SupervisorState of the supervisor in this tick.
    pub state: SupervisorState,
    /// Why the last motion ended or was refused; `None` again from the next arming on.
    pub cause: Cause,
    /// Angle of each gait sensor, filtered; the last good one where the verdict is not good; 0 where none is worn.
    pub measured: [Radians; S],
    /// Validity on each gait sensor's sample; `None` where none is worn.
    pub validity: [Option<Validity>; S],
    /// How a generator that follows the gait sensor stands; `None` of any other.
    pub following: Option<entrainment::FollowStatus>,
    /// The four angles that the gate let pass; the park pose while disarmed, the last ones after a fault.
    pub setpoints: [Radians; Joint::COUNT],
    /// The four pulse widths; 0 while the outputs are off.
    pub pulses: [PulseMicros; Joint::COUNT],
    /// Ticks that ended after their deadline, so far, wrapping.
    pub late: u32,
    /// Control periods that no call was made for, so far, wrapping.
    pub missed: u32,
    /// Ticks with an overrun of the converter, so far, wrapping.
    pub overruns: u32,
    /// What held the setpoints back from their targets in this tick.
    pub limited: GateStatus,
    /// Ticks in which anything did, so far, wrapping.
    pub limited_ticks: u32,
    /// [`SetpointHash`] of all ticks so far.
    pub setpoint_hash: u64,
}

/// FNV-1a, 64 bit, over every tick in order: tick (u32), state (u8) and the bits of the four setpoints (u32), little endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SetpointHash(u64);

impl Default for SetpointHash {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl SetpointHash {
    /// Before the first tick.
    pub const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    /// Going on from a [`SetpointHash::value`].
    #[must_use]
    pub const fn resumed(value: u64) -> Self {
        Self(value)
    }

    /// With one more tick.
    #[must_use]
    pub fn then(self, tick: u32, state: SupervisorState, setpoints: &[Radians; Joint::COUNT]) -> Self {
        let mut hash = self.bytes(&tick.to_le_bytes()).bytes(&[state as u8]);
        for angle in setpoints {
            hash = hash.bytes(&angle.0.to_bits().to_le_bytes());
        }
        hash
    }

    /// As a number.
    #[must_use]
    pub const fn value(self) -> u64 {
        self.0
    }

    fn bytes(self, bytes: &[u8]) -> Self {
        Self(bytes.iter().fold(self.0, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_fnv_1a() {
        // Published test vectors of FNV-1a 64: "", "a", "foobar".
        assert_eq!(SetpointHash::EMPTY.value(), 0xcbf2_9ce4_8422_2325);
        assert_eq!(SetpointHash::EMPTY.bytes(b"a").value(), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(SetpointHash::EMPTY.bytes(b"foobar").value(), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn every_bit_of_a_tick_counts() {
        let angles = [0.0, -0.0, 1.5, 0.1].map(Radians);
        let hash = |tick, state, angles: &[Radians; 4]| SetpointHash::EMPTY.then(tick, state, angles).value();
        let whole = hash(7, SupervisorState::Walking, &angles);
        let as_bytes: Vec<u8> = [7_u32.to_le_bytes().as_slice(), &[3]]
            .into_iter()
            .chain(angles.iter().map(|_| [].as_slice()))
            .flatten()
            .copied()
            .chain(angles.iter().flat_map(|a| a.0.to_bits().to_le_bytes()))
            .collect();
        assert_eq!(whole, SetpointHash::EMPTY.bytes(&as_bytes).value());
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
