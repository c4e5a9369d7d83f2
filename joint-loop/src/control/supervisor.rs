//! The supervisor: a state machine that decides when the joints may move. [`next`] is a pure function of status and inputs.
//!
//! Each cell is the next state and, after the slash, the [`Motion`] of this tick. The outputs are on only in the three moving
//! states: arming, walking, stopping. `-` means that the state does not change.
//!
//! | state | go | go, press | stop | stop, press | fault | settled (and no fault) |
//! |---|---|---|---|---|---|---|
//! | boot | disarmed / rest | disarmed / rest | disarmed / rest | disarmed / rest | disarmed / rest | disarmed / rest |
//! | disarmed | - / rest | **arming / rise** | - / rest | - / rest, with the cause | fault / freeze | - |
//! | arming | - / run | stopping / stop | stopping / hurry | stopping / hurry | fault / freeze | go: walking / run |
//! | walking | - / run | stopping / stop | stopping / hurry | stopping / hurry | fault / freeze | - |
//! | stopping | - / run | - / run | - / hurry | - / hurry | fault / freeze | disarmed / rest |
//! | fault | - / freeze | disarmed / rest | - / freeze | disarmed / rest | - / freeze | - |
//!
//! - *go*, *stop*, *fault* are the [`Demand`] of the monitor. *press* is an edge of the button. *settled* means that the ramp of
//!   the state has ended: in arming at the generator's angles, in stopping at the park pose. In arming, a press has priority
//!   over settled. A press in the tick that ends a stop is ignored.
//! - **No motion without a press**: the only way to arming is a press in disarmed with the demand go.
//! - **A fault is latched**: after its condition has ended, one press acknowledges it (to disarmed), and a second press arms.
//!   A press while the condition persists has no effect. The first cause is kept.
//! - **A sensor that is not good** causes a demand to stop, with a cause named after its validity;
//!   [`crate::control::fault_table`] has the times.
//! - **Boot always leads to disarmed**, even with the button pressed; a persistent condition is handled there.

use hgod_adc::Validity;

/// State of the supervisor. The numbers are part of the setpoint hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum SupervisorState {
    /// Before the first tick.
    #[default]
    Boot = 0,
    /// Outputs off; a press arms.
    Disarmed = 1,
    /// Ramp from the park pose to the generator's angles.
    Arming = 2,
    /// The targets are the generator's angles.
    Walking = 3,
    /// Ramp to the park pose.
    Stopping = 4,
    /// Outputs off, latched until a press acknowledges the fault.
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

    /// Name in telemetry.
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

    /// State with this [`SupervisorState::name`]; `None` for an unknown name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|state| state.name() == name)
    }
}

/// Why the supervisor left a state or refused to arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum Cause {
    /// No cause.
    #[default]
    None = 0,
    /// The button was pressed.
    Button = 1,
    /// A required sensor was not good for longer than tolerated: its wire is open. [`crate::control::fault_table`] has the times.
    SensorOpen = 2,
    /// A required sensor was not good for longer than tolerated: its wire is shorted.
    SensorShort = 3,
    /// A required sensor was not good for longer than tolerated: its code is at an end of the converter's range.
    SensorSaturated = 4,
    /// A required sensor was not good for longer than tolerated: its code no longer changes.
    SensorStuck = 5,
    /// A required sensor was not good for longer than tolerated: a spike.
    SensorSpike = 6,
    /// A required sensor was not good for longer than tolerated: it changes faster than a joint can move.
    SensorRate = 7,
    /// A required sensor was not good for longer than tolerated: its volts are outside the calibration table.
    SensorOutOfTable = 8,
    /// A required sensor was not good for longer than tolerated: the converter's supply is too low or has no reading.
    SensorSupplyLow = 9,
    /// The converter lost more samples than tolerated.
    AdcOverrun = 10,
    /// The pose envelope limited the setpoints for longer than tolerated.
    Pose = 11,
    /// The generator does not pass its check: its state is not finite or not bounded.
    Generator = 12,
    /// Control periods passed without a tick.
    Gap = 13,
    /// A target angle was not finite.
    NonFinite = 14,
    /// The break input is active.
    BreakInput = 15,
    /// The clock failed.
    Clock = 16,
    /// A task of the board makes no progress.
    Watchdog = 17,
    /// The outputs were not in the commanded state.
    Outputs = 18,
    /// The board reported a fault bit without a name.
    Board = 19,
    /// A host asked for a stop.
    Request = 20,
}

impl Cause {
    /// Every cause, in the order of its number.
    pub const ALL: [Self; 21] = [
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
        Self::Request,
    ];

    /// Name in telemetry.
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
            Self::Request => "request",
        }
    }

    /// Cause with this [`Cause::name`]; `None` for an unknown name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
    }

    /// Cause for a sensor's validity; [`Cause::None`] for good.
    #[must_use]
    pub const fn of_sensor(validity: Validity) -> Self {
        match validity {
            Validity::Good => Self::None,
            Validity::Open => Self::SensorOpen,
            Validity::Short => Self::SensorShort,
            Validity::Saturated => Self::SensorSaturated,
            Validity::Stuck => Self::SensorStuck,
            Validity::Spike => Self::SensorSpike,
            Validity::Rate => Self::SensorRate,
            Validity::OutOfTable => Self::SensorOutOfTable,
            // `SupplyLow`, and any validity that is added later; a test requires a cause for each.
            _ => Self::SensorSupplyLow,
        }
    }
}

/// Demand of the monitor: the worst of its conditions. Not `non_exhaustive`: the supervisor has to answer each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Demand {
    /// No condition is active.
    Go,
    /// Do not move: take the short ramp to the park pose, or do not arm.
    Stop(Cause),
    /// Switch the outputs off in this tick and latch the fault.
    Fault(Cause),
}

/// State of the supervisor, with its cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct SupervisorStatus {
    /// The state.
    pub state: SupervisorState,
    /// Why the last motion ended or arming was refused.
    pub cause: Cause,
}

/// Inputs of the supervisor in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Inputs {
    /// The button was pressed: a debounced edge.
    pub press: bool,
    /// The ramp of the present state has ended.
    pub settled: bool,
    /// Demand of the monitor.
    pub demand: Demand,
}

/// Instruction to the blend in one tick. Not `non_exhaustive`: the blend has to follow each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Motion {
    /// Reset to the park pose, at rest.
    Rest,
    /// Begin the ramp to the generator's angles.
    Rise,
    /// Continue.
    Run,
    /// Begin or continue the ramp to the park pose.
    Stop,
    /// Begin or continue the short ramp to the park pose.
    Hurry,
    /// Change nothing, so that the frame shows the state at the fault.
    Freeze,
}

/// Outputs of the supervisor in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Actions {
    /// The servos get pulses.
    pub outputs: bool,
    /// Instruction to the blend.
    pub motion: Motion,
}

/// The table of the module as a function, defined for all inputs.
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

    /// Every status with every input, and the result of `next`.
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

    /// Compares each row of the table in the module's documentation with the function.
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
            // The last column applies in stopping unless a fault, and in arming on go without a press.
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
        assert_eq!(checked, 6 * 21 * 43 * 4);
    }

    #[test]
    fn motion_begins_only_by_a_press_without_faults() {
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
                assert_eq!(after.cause, before.cause, "the first cause is kept");
                let leaves = inputs.press && !matches!(inputs.demand, Demand::Fault(_));
                assert_eq!(after.state, if leaves { SupervisorState::Disarmed } else { SupervisorState::Fault });
            }
            assert_ne!(after.state, SupervisorState::Boot);
        }
    }

    #[test]
    fn the_cause_states_the_reason() {
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
    fn names_are_distinct_and_numbers_are_indices() {
        for (index, state) in SupervisorState::ALL.into_iter().enumerate() {
            assert_eq!((state as usize, SupervisorState::from_name(state.name())), (index, Some(state)));
        }
        for (index, cause) in Cause::ALL.into_iter().enumerate() {
            assert_eq!((cause as usize, Cause::from_name(cause.name())), (index, Some(cause)));
        }
        for validity in Validity::ALL {
            let cause = Cause::of_sensor(validity);
            let name = if validity == Validity::Good { "none".into() } else { format!("sensor_{validity}") };
            assert_eq!(cause.name(), name);
        }
        assert_eq!((SupervisorState::from_name("boots"), Cause::from_name("")), (None, None));
    }
}
