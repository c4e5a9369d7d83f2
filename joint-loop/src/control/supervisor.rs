//! The supervisor: when the joints may move. One pure function of the present status and what this tick brought.
//!
//! Each cell is the next state and, after the slash, the [`Motion`] of this tick. The outputs are on in exactly the three
//! moving states: arming, walking, stopping. `-` is "stay as it is".
//!
//! | state | go | go, press | stop | stop, press | fault | settled (and no fault) |
//! |---|---|---|---|---|---|---|
//! | boot | disarmed / rest | disarmed / rest | disarmed / rest | disarmed / rest | disarmed / rest | disarmed / rest |
//! | disarmed | - / rest | **arming / rise** | - / rest | - / rest, the cause says why not | fault / freeze | - |
//! | arming | - / run | stopping / stop | stopping / hurry | stopping / hurry | fault / freeze | go: walking / run |
//! | walking | - / run | stopping / stop | stopping / hurry | stopping / hurry | fault / freeze | - |
//! | stopping | - / run | - / run | - / hurry | - / hurry | fault / freeze | disarmed / rest |
//! | fault | - / freeze | disarmed / rest | - / freeze | disarmed / rest | - / freeze | - |
//!
//! - *go*, *stop*, *fault* are the [`Demand`] of the watched conditions; *press* is an edge of the button; *settled* means that
//!   the ramp that runs has ended: in arming at the full rhythm, in stopping in the park pose. A press comes before settled in
//!   arming, and a press in the tick that ends a stop is lost.
//! - **No motion without a press**: arming has one entry, from disarmed, by a press, and only while nothing is wrong.
//! - **A fault is latched**: when its condition is gone, one press acknowledges it (to disarmed), and only another one arms.
//!   A press while the condition lasts does nothing. The first cause stays.
//! - **A sensor's verdict** comes as a demand to stop whose cause has its name; [`crate::control::fault_table`] tells after how many ms.
//! - **Boot always leads to disarmed**, whatever is pressed; a condition that persists is met there.

use hgod_adc::Validity;

/// Where the machine is. The numbers are part of the telemetry's hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum SupervisorState {
    /// Before the first tick.
    #[default]
    Boot = 0,
    /// Outputs off, waiting for a press.
    Disarmed = 1,
    /// From the park pose to the full rhythm.
    Arming = 2,
    /// The gate passes the generator's rhythm.
    Walking = 3,
    /// Back to the park pose.
    Stopping = 4,
    /// Outputs off, latched until acknowledged.
    Fault = 5,
}

impl SupervisorState {
    /// Every state, in the order of its number.
    pub const ALL: [Self; 6] = [Self::Boot, Self::Disarmed, Self::Arming, Self::Walking, Self::Stopping, Self::Fault];

    /// Whether the outputs are on.
    #[must_use]
    pub const fn moving(self) -> bool {
        matches!(self, Self::Arming | Self::Walking | Self::Stopping)
    }

    /// The word for it in telemetry.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Boot => "boot",
            Self::Disarmed => "disarmed",
            Self::Arming => "arming",
            Self::Walking => "walking",
            Self::Stopping => "stopping",
            Self::Fault => "fault",
        }
    }

    /// The state of that [`SupervisorState::name`].
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|state| state.name() == name)
    }
}

/// Why a motion ended, or was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Cause {
    /// Nothing to tell.
    #[default]
    None = 0,
    /// The button was pressed.
    Button = 1,
    /// A sensor that is required was not good for longer than tolerated: its wire is open. [`crate::control::fault_table`] has the times.
    SensorOpen = 2,
    /// The same: its wire is shorted.
    SensorShort = 3,
    /// The same: at an end of the converter's range.
    SensorSaturated = 4,
    /// The same: its code has stopped changing.
    SensorStuck = 5,
    /// The same: a spike.
    SensorSpike = 6,
    /// The same: faster than a joint.
    SensorRate = 7,
    /// The same: outside of the calibration table.
    SensorOutOfTable = 8,
    /// The same: the converter's supply is too low or has no reading.
    SensorSupplyLow = 9,
    /// The converter lost more samples than tolerated.
    AdcOverrun = 10,
    /// The gate held the pose back for longer than tolerated.
    Pose = 11,
    /// The generator's state is not finite or not bounded.
    Generator = 12,
    /// Control periods went by without a tick.
    Gap = 13,
    /// An angle at the gate was not finite.
    NonFinite = 14,
    /// The break input is active.
    BreakInput = 15,
    /// The clock failed.
    Clock = 16,
    /// A task of the board makes no progress.
    Watchdog = 17,
    /// The outputs were not as commanded.
    Outputs = 18,
    /// The board reported a fault that has no name here.
    Board = 19,
}

impl Cause {
    /// Every cause, in the order of its number.
    pub const ALL: [Self; 20] = [
        Self::None,
        Self::Button,
        Self::SensorOpen,
        Self::SensorShort,
        Self::SensorSaturated,
        Self::SensorStuck,
        Self::SensorSpike,
        Self::SensorRate,
        Self::SensorOutOfTable,
        Self::SensorSupplyLow,
        Self::AdcOverrun,
        Self::Pose,
        Self::Generator,
        Self::Gap,
        Self::NonFinite,
        Self::BreakInput,
        Self::Clock,
        Self::Watchdog,
        Self::Outputs,
        Self::Board,
    ];

    /// The word for it in telemetry.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Button => "button",
            Self::SensorOpen => "sensor_open",
            Self::SensorShort => "sensor_short",
            Self::SensorSaturated => "sensor_saturated",
            Self::SensorStuck => "sensor_stuck",
            Self::SensorSpike => "sensor_spike",
            Self::SensorRate => "sensor_rate",
            Self::SensorOutOfTable => "sensor_out_of_table",
            Self::SensorSupplyLow => "sensor_supply_low",
            Self::AdcOverrun => "adc_overrun",
            Self::Pose => "pose",
            Self::Generator => "generator",
            Self::Gap => "gap",
            Self::NonFinite => "non_finite",
            Self::BreakInput => "break_input",
            Self::Clock => "clock",
            Self::Watchdog => "watchdog",
            Self::Outputs => "outputs",
            Self::Board => "board",
        }
    }

    /// The cause of that [`Cause::name`].
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
    }

    /// The cause that names a sensor's verdict; none for good.
    #[must_use]
    pub const fn of_sensor(verdict: Validity) -> Self {
        match verdict {
            Validity::Good => Self::None,
            Validity::Open => Self::SensorOpen,
            Validity::Short => Self::SensorShort,
            Validity::Saturated => Self::SensorSaturated,
            Validity::Stuck => Self::SensorStuck,
            Validity::Spike => Self::SensorSpike,
            Validity::Rate => Self::SensorRate,
            Validity::OutOfTable => Self::SensorOutOfTable,
            // `SupplyLow`; a validity that is added later stops the joints too, and the tests ask for a cause of its own.
            _ => Self::SensorSupplyLow,
        }
    }
}

/// What the watched conditions ask for, the gravest of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Demand {
    /// Nothing is wrong.
    Go,
    /// Do not move: ramp to the park pose in a hurry, or do not arm.
    Stop(Cause),
    /// Outputs off in this tick, latched.
    Fault(Cause),
}

/// Where the machine is, and why it is not moving.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct SupervisorStatus {
    /// The state.
    pub state: SupervisorState,
    /// Why the last motion ended or was refused.
    pub cause: Cause,
}

/// What one tick brought.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Inputs {
    /// The button was pressed: an edge, debounced.
    pub press: bool,
    /// The ramp that runs has ended.
    pub settled: bool,
    /// What the watched conditions ask for.
    pub demand: Demand,
}

/// What the blend does in this tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Motion {
    /// Everything back to the park pose, at rest.
    Rest,
    /// Begin the ramp to the rhythm.
    Rise,
    /// Go on with whatever runs.
    Run,
    /// Begin the ramp to the park pose, or go on with it.
    Stop,
    /// Begin the short ramp to the park pose, or go on with it.
    Hurry,
    /// Leave everything as it is, for the record.
    Freeze,
}

/// What shall be done in this tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Actions {
    /// The servos get pulses.
    pub outputs: bool,
    /// What the blend does.
    pub motion: Motion,
}

/// The table above, as a function: total, and without any state of its own.
#[must_use]
pub const fn next(status: SupervisorStatus, inputs: Inputs) -> (SupervisorStatus, Actions) {
    use SupervisorState::{Arming, Boot, Disarmed, Fault, Stopping, Walking};
    let SupervisorStatus { state, cause } = status;
    let (state, cause, motion) = match (state, inputs.demand) {
        (Boot, _) => (Disarmed, Cause::None, Motion::Rest),

        (Fault, Demand::Go | Demand::Stop(_)) if inputs.press => (Disarmed, cause, Motion::Rest),
        (Fault, _) => (Fault, cause, Motion::Freeze),
        (_, Demand::Fault(why)) => (Fault, why, Motion::Freeze),

        (Disarmed, Demand::Go) if inputs.press => (Arming, Cause::None, Motion::Rise),
        (Disarmed, Demand::Stop(why)) if inputs.press => (Disarmed, why, Motion::Rest),
        (Disarmed, _) => (Disarmed, cause, Motion::Rest),

        (Arming | Walking, Demand::Stop(why)) => (Stopping, why, Motion::Hurry),
        (Arming | Walking, Demand::Go) if inputs.press => (Stopping, Cause::Button, Motion::Stop),
        (Arming, Demand::Go) if inputs.settled => (Walking, cause, Motion::Run),
        (Arming | Walking, Demand::Go) => (state, cause, Motion::Run),

        (Stopping, Demand::Stop(why)) if matches!(cause, Cause::Button) && !inputs.settled => {
            (Stopping, why, Motion::Hurry)
        }
        (Stopping, _) if inputs.settled => (Disarmed, cause, Motion::Rest),
        (Stopping, Demand::Stop(_)) => (Stopping, cause, Motion::Hurry),
        (Stopping, Demand::Go) => (Stopping, cause, Motion::Run),
    };
    (SupervisorStatus { state, cause }, Actions { outputs: state.moving(), motion })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every status and every input there is, with the successor that `next` gives.
    fn rows() -> impl Iterator<Item = (SupervisorStatus, Inputs, SupervisorStatus, Actions)> {
        let demands = [Demand::Go]
            .into_iter()
            .chain(Cause::ALL.map(Demand::Stop))
            .chain(Cause::ALL.map(Demand::Fault))
            .collect::<Vec<_>>();
        SupervisorState::ALL.into_iter().flat_map(move |state| {
            let demands = demands.clone();
            Cause::ALL.into_iter().flat_map(move |cause| {
                demands.clone().into_iter().flat_map(move |demand| {
                    (0..4).map(move |bits| {
                        let inputs = Inputs { press: bits & 1 != 0, settled: bits & 2 != 0, demand };
                        let status = SupervisorStatus { state, cause };
                        let (after, actions) = next(status, inputs);
                        (status, inputs, after, actions)
                    })
                })
            })
        })
    }

    /// The table of the module's documentation is the specification: each row is read back and compared with the function.
    #[test]
    fn the_function_is_the_documented_table() {
        let doc = include_str!("supervisor.rs");
        let table: Vec<Vec<&str>> = doc
            .lines()
            .filter_map(|line| line.strip_prefix("//! | "))
            .map(|line| line.trim_end_matches('|').split('|').map(str::trim).collect())
            .collect();
        assert_eq!(table[0].len(), 7);
        let mut checked = 0;
        for (status, inputs, after, actions) in rows() {
            let row = table.iter().find(|row| row[0] == status.state.name()).expect("a row for each state");
            let column = match (inputs.demand, inputs.press) {
                (Demand::Go, false) => 1,
                (Demand::Go, true) => 2,
                (Demand::Stop(_), false) => 3,
                (Demand::Stop(_), true) => 4,
                (Demand::Fault(_), _) => 5,
            };
            // The last column rules where the prose says so: in stopping unless a fault, in arming on go without a press.
            let settles = match status.state {
                SupervisorState::Stopping => column != 5,
                SupervisorState::Arming => column == 1,
                _ => false,
            };
            let cell = if inputs.settled && settles { row[6] } else { row[column] };
            let cell = cell.trim_start_matches("go: ").replace("**", "");
            let (state, motion) = cell.split_once(" / ").expect("state / motion");
            let state = if state == "-" { status.state.name() } else { state };
            let motion = motion.split(',').next().expect("first word");
            let given = format!("{status:?} {inputs:?}");
            assert_eq!(after.state.name(), state, "{given}");
            assert_eq!(format!("{:?}", actions.motion).to_lowercase(), motion, "{given}");
            assert_eq!(actions.outputs, ["arming", "walking", "stopping"].contains(&state), "{given}");
            checked += 1;
        }
        assert_eq!(checked, 6 * 20 * 41 * 4);
    }

    #[test]
    fn no_motion_begins_without_a_press_while_all_is_well() {
        for (before, inputs, after, actions) in rows() {
            if !before.state.moving() && after.state.moving() {
                assert_eq!((before.state, after.state), (SupervisorState::Disarmed, SupervisorState::Arming));
                assert!(inputs.press && inputs.demand == Demand::Go);
                assert_eq!(actions.motion, Motion::Rise);
            }
            if actions.motion == Motion::Rise {
                assert_eq!(after, SupervisorStatus { state: SupervisorState::Arming, cause: Cause::None });
            }
            assert!(
                before.state == SupervisorState::Arming
                    || after.state != SupervisorState::Walking
                    || before.state == SupervisorState::Walking
            );
        }
    }

    #[test]
    fn a_fault_is_latched_and_needs_two_presses_to_move_again() {
        for (before, inputs, after, actions) in rows() {
            if let (Demand::Fault(_), true) = (inputs.demand, before.state != SupervisorState::Boot) {
                assert_eq!(after.state, SupervisorState::Fault);
                assert!(!actions.outputs);
            }
            if before.state == SupervisorState::Fault {
                assert_eq!(after.cause, before.cause, "the first cause stays");
                let leaves = inputs.press && !matches!(inputs.demand, Demand::Fault(_));
                assert_eq!(after.state, if leaves { SupervisorState::Disarmed } else { SupervisorState::Fault });
            }
            assert_ne!(after.state, SupervisorState::Boot);
        }
    }

    #[test]
    fn the_cause_tells_what_happened() {
        for (before, inputs, after, _) in rows().filter(|(before, ..)| before.state != SupervisorState::Boot) {
            let entered = after.state != before.state;
            match (after.state, inputs.demand) {
                (SupervisorState::Fault, Demand::Fault(why)) if entered => assert_eq!(after.cause, why),
                (SupervisorState::Stopping, Demand::Stop(why)) if entered => assert_eq!(after.cause, why),
                (SupervisorState::Stopping, Demand::Go) if entered => assert_eq!(after.cause, Cause::Button),
                (SupervisorState::Stopping, Demand::Stop(why)) if before.cause == Cause::Button => {
                    assert_eq!(after.cause, why)
                }
                (SupervisorState::Disarmed, Demand::Stop(why)) if !entered && inputs.press => {
                    assert_eq!(after.cause, why)
                }
                (SupervisorState::Arming, _) if entered => assert_eq!(after.cause, Cause::None),
                _ => assert_eq!(after.cause, before.cause),
            }
        }
    }

    #[test]
    fn names_are_distinct_and_numbers_are_places() {
        for (index, state) in SupervisorState::ALL.into_iter().enumerate() {
            assert_eq!((state as usize, SupervisorState::from_name(state.name())), (index, Some(state)));
        }
        for (index, cause) in Cause::ALL.into_iter().enumerate() {
            assert_eq!((cause as usize, Cause::from_name(cause.name())), (index, Some(cause)));
        }
        for verdict in Validity::ALL {
            let cause = Cause::of_sensor(verdict);
            let name = if verdict == Validity::Good { "none".into() } else { format!("sensor_{verdict}") };
            assert_eq!(cause.name(), name);
        }
        assert_eq!((SupervisorState::from_name("boots"), Cause::from_name("")), (None, None));
    }
}
