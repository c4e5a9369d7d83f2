//! Watches the supply of the chip, which is also the reference of its converter: a condition of the board, not of a sensor.
//!
//! Below its minimum the chip may not execute what is in its flash (at 168 MHz five wait states are enough from 2.7 V on), so a ramp to the park
//! pose cannot be relied on: the reaction is a fault, which switches the outputs off. It also needs no sensor and no follower's consent.

use hgod_adc::Reference;
use joint_units::{AdcCode, Period};

use crate::control::burst::Burst;
use crate::control::supervisor::{Cause, Demand};

/// How long the supply may be below its minimum while the joints move, in ms: with the tick and the reaction of the board the outputs are off
/// within 50 ms.
pub const SUPPLY_TOLERANCE_MS: u16 = 40;
/// How long dips that are shorter may go on while the joints move, in ms.
pub const RIPPLE_MS: u16 = 1_000;
/// Dips belong to one ripple if they are not further apart than this, in ms.
const RIPPLE_PAUSE_MS: u16 = 100;
/// Dips within [`DIPS_MS`] of the first of them that do not stop the motion, however short and far apart they are; those of one ripple are one. One
/// dip may come from a servo that starts; a supply that dips more than once a second does so in every stride, and the next dip may be deeper or longer.
pub const DIPS: u32 = 10;
/// Time in which dips are counted, in ms.
pub const DIPS_MS: u16 = 10_000;

/// The minimum, and the tolerances in ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Supply {
    reference: Reference,
    tolerance: u32,
    ripple: u32,
    pause: u32,
    window: u32,
}

/// The last dips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct SupplyState {
    /// Periods below the minimum, minus periods above it.
    low: u32,
    /// Periods until the ripple counts as over.
    pause: u32,
    /// Periods since the first dip of the ripple.
    rippling: u32,
    /// The last tick was below the minimum.
    is_low: bool,
    /// Dips since the boot, wrapping.
    pub(crate) dips: u32,
    /// Dips of the last [`DIPS_MS`].
    recent: Burst,
}

impl Supply {
    /// For this reference, whose minimum it is.
    pub(crate) fn new(reference: Reference, period: Period) -> Self {
        let ticks = |ms: u16| (f32::from(ms) * 1e-3 / period.seconds() + 0.5) as u32;
        Self {
            reference,
            tolerance: ticks(SUPPLY_TOLERANCE_MS),
            ripple: ticks(RIPPLE_MS),
            pause: ticks(RIPPLE_PAUSE_MS),
            window: ticks(DIPS_MS),
        }
    }

    /// Takes the code of the internal reference in one tick. At rest there is no tolerance, and nothing is latched.
    pub(crate) fn judge(&self, state: &mut SupplyState, vrefint: AdcCode, elapsed: u32, moving: bool) -> Demand {
        let is_low = self.reference.supply(vrefint).is_err();
        let recent = self.count(state, is_low, elapsed);
        if is_low {
            state.low = state.low.saturating_add(elapsed).min(self.tolerance.saturating_add(1));
            state.pause = self.pause;
        } else {
            state.low = state.low.saturating_sub(elapsed);
            state.pause = state.pause.saturating_sub(elapsed);
        }
        state.rippling = if state.pause == 0 { 0 } else { state.rippling.saturating_add(elapsed) };
        if moving && state.low > self.tolerance {
            Demand::Fault(Cause::Supply)
        } else if state.rippling > self.ripple || recent > DIPS || (!moving && state.pause > 0) {
            Demand::Stop(Cause::Supply)
        } else {
            Demand::Go
        }
    }

    /// Counts a dip at its beginning; the dips of the last [`DIPS_MS`], without those that belong to a ripple.
    fn count(&self, state: &mut SupplyState, is_low: bool, elapsed: u32) -> u32 {
        state.dips = state.dips.wrapping_add(u32::from(is_low && !state.is_low));
        state.is_low = is_low;
        // Those of one ripple, which ends within its own time, are one here.
        state.recent.note(u32::from(is_low && state.rippling == 0), elapsed, self.window)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hgod_adc::ReferenceConfig;
    use joint_units::Volts;

    fn supply() -> Supply {
        let config = ReferenceConfig { min_supply: Volts(2.7), ..ReferenceConfig::stm32f4(AdcCode(1501)) };
        Supply::new(config.build().expect("valid"), Period::MILLISECOND)
    }

    /// Code of the reference at these volts.
    fn code(volts: f32) -> AdcCode {
        AdcCode((3.3 * 1501.0 / volts) as u16)
    }

    /// The first tick that demands something, and what, for volts over the ticks.
    fn first(moving: bool, volts: impl Fn(u32) -> f32) -> Option<(u32, Demand)> {
        first_of(5_000, moving, volts)
    }

    /// The same among so many ticks.
    fn first_of(ticks: u32, moving: bool, volts: impl Fn(u32) -> f32) -> Option<(u32, Demand)> {
        let (supply, mut state) = (supply(), SupplyState::default());
        let demands = (0..ticks).map(|tick| (tick, supply.judge(&mut state, code(volts(tick)), 1, moving)));
        demands.into_iter().find(|(_, demand)| *demand != Demand::Go)
    }

    #[test]
    fn a_low_supply_is_a_fault_after_the_tolerance() {
        let fault = Demand::Fault(Cause::Supply);
        for low in [0.3, 2.0, 2.6, 2.69] {
            let steps = |tick| if tick < 100 { 3.0 } else { low };
            assert_eq!(first(true, steps), Some((100 + u32::from(SUPPLY_TOLERANCE_MS), fault)), "{low} V");
            assert_eq!(first(false, steps), Some((100, Demand::Stop(Cause::Supply))), "{low} V at rest");
        }
        assert_eq!(first(true, |_| 2.71), None);
        // No reading at all, and beyond what the chip may have.
        let (supply, mut state) = (supply(), SupplyState::default());
        for vrefint in [AdcCode(0), AdcCode(1_000)] {
            assert!((0..50).any(|_| supply.judge(&mut state, vrefint, 1, true) == fault), "{vrefint:?}");
            state = SupplyState::default();
        }
        // Missed periods count.
        assert_eq!(supply.judge(&mut state, code(2.0), 41, true), fault);
    }

    #[test]
    fn a_ripple_stops_after_a_second() {
        // 50 Hz between 2.6 and 3.4 V.
        let hum = |tick: u32| 3.0 + 0.4 * (f64::from(tick) * 0.05 * std::f64::consts::TAU).sin() as f32;
        let (tick, demand) = first(true, hum).expect("a stop");
        let dips = (0..).find(|tick| supply().reference.supply(code(hum(*tick))).is_err()).expect("a dip");
        assert_eq!((tick, demand), (dips + u32::from(RIPPLE_MS), Demand::Stop(Cause::Supply)));
        // Dips of 30 ms: each is over before the next. One a second goes on for ever, two a second do not.
        assert_eq!(first_of(60_000, true, |tick| if tick % 1_000 < 30 { 2.6 } else { 3.0 }), None);
        let (tick, demand) = first_of(60_000, true, |tick| if tick % 500 < 30 { 2.6 } else { 3.0 }).expect("a stop");
        assert_eq!((tick, demand), (DIPS * 500, Demand::Stop(Cause::Supply)));
        // More often below than above: a low supply.
        let (tick, demand) = first(true, |tick| if tick % 20 < 12 { 2.6 } else { 3.0 }).expect("a fault");
        assert_eq!(demand, Demand::Fault(Cause::Supply));
        assert!(tick < 300, "{tick}");
    }

    /// Each dip once, whatever its length, in every state; and the supply that is low from the first tick on.
    #[test]
    fn dips_are_counted() {
        for moving in [false, true] {
            let (supply, mut state) = (supply(), SupplyState::default());
            let mut see = |volts: f32, ticks: u32| {
                for _ in 0..ticks {
                    let _ = supply.judge(&mut state, code(volts), 1, moving);
                }
                state.dips
            };
            assert_eq!(see(3.0, 1_000), 0);
            assert_eq!([see(2.6, 1), see(3.0, 1), see(2.6, 30), see(3.0, 20_000), see(0.3, 5_000)], [1, 1, 2, 2, 3]);
            assert_eq!(see(2.6, 10), 3);
        }
    }

    #[test]
    fn at_rest_a_press_is_refused_until_the_ripple_is_over() {
        let (supply, mut state) = (supply(), SupplyState::default());
        assert_eq!(supply.judge(&mut state, code(2.6), 1, false), Demand::Stop(Cause::Supply));
        let refused = (0..500).filter(|_| supply.judge(&mut state, code(3.0), 1, false) != Demand::Go).count();
        assert_eq!(refused, 99);
    }
}
