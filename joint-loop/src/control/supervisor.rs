//! The supervisor: a state machine that decides when the joints may move. [`next`] is a pure function of status and inputs.
//!
//! Each cell is the next state and, after the slash, the [`Motion`] of this tick. The outputs are on only in the four moving
//! states: arming, walking, stopping, trimming. `-` means that the state does not change.
//!
//! | state | go | go, press | go, hold | stop | stop, hold | fault | settled (and no fault) | stop request | trim request (and no fault) |
//! |---|---|---|---|---|---|---|---|---|---|
//! | boot | disarmed / rest | disarmed / rest | disarmed / rest | disarmed / rest | disarmed / rest | disarmed / rest | - | - | - |
//! | disarmed | - / rest | - / rest | **arming / rise** | - / rest | - / rest, with the cause | fault / freeze | - | - | trim_ready / rest |
//! | arming | - / run | stopping / stop | - / run | stopping / hurry | stopping / hurry | fault / freeze | go: walking / run | - | - |
//! | walking | - / run | stopping / stop | - / run | stopping / hurry | stopping / hurry | fault / freeze | - | - | - |
//! | stopping | - / run | - / run | - / run | - / hurry | - / hurry | fault / freeze | disarmed / rest | - | - |
//! | fault | - / freeze | - / freeze | disarmed / rest | - / freeze | disarmed / rest | - / freeze | - | - | - |
//! | trim_ready | - / rest | - / rest | **trimming / trim** | - / rest | - / rest, with the cause | fault / freeze | - | disarmed / rest | - |
//! | trimming | - / trim | trim_ready / rest | - / trim | trim_ready / rest | trim_ready / rest | fault / freeze | - | - | - |
//!
//! - *go*, *stop*, *fault* are the [`Demand`] of the monitor. *press* and *hold* are events of the button
//!   ([`crate::control::button`]): the debounced edge, and the release after a deliberate hold. *settled* means that the ramp of
//!   the state has ended: in arming at the generator's angles, in stopping at the park pose. In arming, a press has priority
//!   over settled. A press in the tick that ends a stop is ignored. A stop request is a stop with the cause `request`. Where one of the
//!   last three columns has `-`, the others apply. With the demand stop, a press has no effect of its own.
//! - **No motion without a hold**: the only ways to motion are a hold in disarmed and one in trim_ready, with the demand go.
//! - **A press that is no hold** is refused in disarmed and in trim_ready: the cause says whether it was too short, too long, or one of too many.
//!   Otherwise its release has no effect.
//! - **Trim** is apart from walking: a host's request chooses it at rest, and from then on a hold begins a trim, until a stop request, a fault
//!   or a reset. After a fault it has to be chosen again, which `footfall trim` does before it asks for a hold. A trim moves one servo, slowly ([`crate::control::trim`]). It ends where the servo
//!   is: the outputs go off. It needs no gait sensor ([`Demand::in_trim`]).
//! - **A fault is latched**: after its condition has ended, one hold acknowledges it (to disarmed), and a second hold arms.
//!   A hold while the condition persists has no effect. The first cause is kept.
//! - **A sensor that is not good** causes a demand to stop, with a cause named after its validity;
//!   [`crate::control::fault_table`] has the times.
//! - **Boot always leads to disarmed**, even with the button pressed; a persistent condition is handled there.

use crate::control::button::ButtonEvent;
use hgod_adc::Validity;

/// State of the supervisor. The numbers are part of the setpoint hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum SupervisorState {
    /// Before the first tick.
    #[default]
    Boot = 0,
    /// Outputs off; a hold of the button arms.
    Disarmed = 1,
    /// From the last pulses, if they are known, to the park pose; then the ramp to the generator's angles.
    Arming = 2,
    /// The targets are the generator's angles.
    Walking = 3,
    /// Ramp to the park pose.
    Stopping = 4,
    /// Outputs off, latched until a hold of the button acknowledges the fault.
    Fault = 5,
    /// Outputs off; a hold of the button begins the trim of a servo.
    TrimReady = 6,
    /// One servo is moved slowly, the others are in the park pose.
    Trimming = 7,
}

impl SupervisorState {
    /// Every state, in the order of its number.
    pub const ALL: [Self; 8] = [
        Self::Boot,
        Self::Disarmed,
        Self::Arming,
        Self::Walking,
        Self::Stopping,
        Self::Fault,
        Self::TrimReady,
        Self::Trimming,
    ];

    /// Whether the outputs are on.
    #[must_use]
    pub const fn moving(self) -> bool {
        matches!(self, Self::Arming | Self::Walking | Self::Stopping | Self::Trimming)
    }

    /// Whether the button begins or ends a trim.
    #[must_use]
    pub const fn is_trim(self) -> bool {
        matches!(self, Self::TrimReady | Self::Trimming)
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
            Self::TrimReady => "trim_ready",
            Self::Trimming => "trimming",
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
    /// Control periods passed without a tick: too many in one gap, or in a second.
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
    /// In trim, no request came for too long.
    HostSilent = 21,
    /// The supply of the chip was below its minimum for longer than tolerated. [`crate::control::supply`] has the times.
    Supply = 22,
    /// Too many ticks began or ended late.
    Late = 23,
    /// The button was released too soon to arm: [`crate::control::button`] has the times.
    HoldShort = 24,
    /// The button was released too late to arm.
    HoldLong = 25,
    /// The button was pressed too often to arm.
    Presses = 26,
    /// The person whom the follower follows has stood for longer than tolerated.
    PersonStands = 27,
    /// The emergency stop was not pressed and released since the boot: [`crate::control::stop_test`].
    StopUntested = 28,
    /// The clock of the watchdog is too slow, too fast, or not measured: [`crate::control::watchdog_clock`].
    WatchdogClock = 29,
    /// A debugger is attached, which the board refuses.
    Debugger = 30,
    /// The program in flash is not proven to be the one that was built.
    Program = 31,
    /// The memory that holds the supervisor's state has changed by itself: it held no state.
    Memory = 32,
}

impl Cause {
    /// Every cause, in the order of its number.
    pub const ALL: [Self; 33] = [
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
        Self::HostSilent,
        Self::Supply,
        Self::Late,
        Self::HoldShort,
        Self::HoldLong,
        Self::Presses,
        Self::PersonStands,
        Self::StopUntested,
        Self::WatchdogClock,
        Self::Debugger,
        Self::Program,
        Self::Memory,
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
            Self::HostSilent => "host_silent",
            Self::Supply => "supply",
            Self::Late => "late",
            Self::HoldShort => "hold_short",
            Self::HoldLong => "hold_long",
            Self::Presses => "presses",
            Self::PersonStands => "person_stands",
            Self::StopUntested => "stop_untested",
            Self::WatchdogClock => "watchdog_clock",
            Self::Debugger => "debugger",
            Self::Program => "program",
            Self::Memory => "memory",
        }
    }

    /// Cause with this [`Cause::name`]; `None` for an unknown name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
    }

    /// Cause for a press that is refused; `None` for any other event of the button.
    #[must_use]
    const fn of_refused(event: ButtonEvent) -> Option<Self> {
        match event {
            ButtonEvent::TooShort => Some(Self::HoldShort),
            ButtonEvent::TooLong => Some(Self::HoldLong),
            ButtonEvent::TooMany => Some(Self::Presses),
            ButtonEvent::Stopped => Some(Self::BreakInput),
            ButtonEvent::None | ButtonEvent::Press | ButtonEvent::Hold => None,
        }
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

impl Demand {
    /// The demand as far as it concerns a trim, which needs no gait sensor: a robot is trimmed before it has one. The supply counts.
    #[must_use]
    pub const fn in_trim(self) -> Self {
        use Cause::{SensorOpen, SensorOutOfTable, SensorRate, SensorSaturated, SensorShort, SensorSpike, SensorStuck};
        match self {
            Self::Stop(
                SensorOpen | SensorShort | SensorSaturated | SensorStuck | SensorSpike | SensorRate | SensorOutOfTable,
            ) => Self::Go,
            other => other,
        }
    }
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
    /// Event of the button.
    pub button: ButtonEvent,
    /// The ramp of the present state has ended.
    pub settled: bool,
    /// Demand of the monitor, or of a host that asks for a stop.
    pub demand: Demand,
    /// A host asks for the trim of a servo.
    pub trim: bool,
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
    /// One servo as the trim has it, the others in the park pose.
    Trim,
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
    use SupervisorState::{Arming, Boot, Disarmed, Fault, Stopping, TrimReady, Trimming, Walking};
    let SupervisorStatus { state, cause } = status;
    let (press, hold) = (matches!(inputs.button, ButtonEvent::Press), matches!(inputs.button, ButtonEvent::Hold));
    let refused = match Cause::of_refused(inputs.button) {
        Some(refused) => refused,
        None => cause,
    };
    let (state, cause, motion) = match (state, inputs.demand) {
        (Boot, _) => (Disarmed, Cause::None, Motion::Rest),

        (Fault, Demand::Go | Demand::Stop(_)) if hold => (Disarmed, cause, Motion::Rest),
        (Fault, _) => (Fault, cause, Motion::Freeze),
        (_, Demand::Fault(why)) => (Fault, why, Motion::Freeze),

        (Disarmed, _) if inputs.trim => (TrimReady, Cause::None, Motion::Rest),
        (Disarmed, Demand::Go) if hold => (Arming, Cause::None, Motion::Rise),
        (Disarmed, Demand::Stop(why)) if hold => (Disarmed, why, Motion::Rest),
        (Disarmed, _) => (Disarmed, refused, Motion::Rest),

        (Arming | Walking, Demand::Stop(why)) => (Stopping, why, Motion::Hurry),
        (Arming | Walking, Demand::Go) if press => (Stopping, Cause::Button, Motion::Stop),
        (Arming, Demand::Go) if inputs.settled => (Walking, cause, Motion::Run),
        (Arming | Walking, Demand::Go) => (state, cause, Motion::Run),

        (Stopping, Demand::Stop(why)) if matches!(cause, Cause::Button) && !inputs.settled => {
            (Stopping, why, Motion::Hurry)
        }
        (Stopping, _) if inputs.settled => (Disarmed, cause, Motion::Rest),
        (Stopping, Demand::Stop(_)) => (Stopping, cause, Motion::Hurry),
        (Stopping, Demand::Go) => (Stopping, cause, Motion::Run),

        (TrimReady, Demand::Stop(Cause::Request)) => (Disarmed, Cause::Request, Motion::Rest),
        (TrimReady, Demand::Go) if hold => (Trimming, Cause::None, Motion::Trim),
        (TrimReady, Demand::Stop(why)) if hold => (TrimReady, why, Motion::Rest),
        (TrimReady, _) => (TrimReady, refused, Motion::Rest),

        (Trimming, Demand::Stop(why)) => (TrimReady, why, Motion::Rest),
        (Trimming, Demand::Go) if press => (TrimReady, Cause::Button, Motion::Rest),
        (Trimming, Demand::Go) => (Trimming, cause, Motion::Trim),
    };
    (SupervisorStatus { state, cause }, Actions { outputs: state.moving(), motion })
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVENTS: [ButtonEvent; 7] = [
        ButtonEvent::None,
        ButtonEvent::Press,
        ButtonEvent::Hold,
        ButtonEvent::TooShort,
        ButtonEvent::TooLong,
        ButtonEvent::TooMany,
        ButtonEvent::Stopped,
    ];

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
                    (0..4 * EVENTS.len()).map(move |place| {
                        let [settled, trim] = [1, 2].map(|bit| place & bit != 0);
                        let inputs = Inputs { button: EVENTS[place / 4], settled, demand, trim };
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
        assert_eq!(table[0].len(), 10);
        let mut checked = 0;
        for (status, inputs, after, actions) in rows() {
            let row = table.iter().find(|row| row[0] == status.state.name()).expect("a row for each state");
            let column = match (inputs.demand, inputs.button) {
                (Demand::Go, ButtonEvent::Press) => 2,
                (Demand::Go, ButtonEvent::Hold) => 3,
                (Demand::Go, _) => 1,
                (Demand::Stop(_), ButtonEvent::Hold) => 5,
                (Demand::Stop(_), _) => 4,
                (Demand::Fault(_), _) => 6,
            };
            // That column applies in stopping unless a fault, and in arming on go without a press.
            let settles = match status.state {
                SupervisorState::Stopping => column != 6,
                SupervisorState::Arming => column == 1 || column == 3,
                _ => false,
            };
            let stop_request = inputs.demand == Demand::Stop(Cause::Request);
            // A trim request goes first, then a settled ramp. A column with `-` does not apply.
            let special = [(inputs.trim && column != 6, 9), (inputs.settled && settles, 7), (stop_request, 8)];
            let special = special.iter().find(|(applies, place)| *applies && row[*place] != "-");
            let cell = row[special.map_or(column, |(_, place)| *place)];
            let cell = cell.trim_start_matches("go: ").replace("**", "");
            let (state, motion) = cell.split_once(" / ").expect("state / motion");
            let state = if state == "-" { status.state.name() } else { state };
            let motion = motion.split(',').next().expect("first word");
            let given = format!("{status:?} {inputs:?}");
            assert_eq!(after.state.name(), state, "{given}");
            assert_eq!(format!("{:?}", actions.motion).to_lowercase(), motion, "{given}");
            assert_eq!(actions.outputs, ["arming", "walking", "stopping", "trimming"].contains(&state), "{given}");
            checked += 1;
        }
        assert_eq!(checked, 8 * 33 * 67 * EVENTS.len() * 4);
    }

    #[test]
    fn two_states_are_of_a_trim_and_four_move() {
        let states = |of: fn(SupervisorState) -> bool| -> Vec<_> {
            SupervisorState::ALL.into_iter().filter(|state| of(*state)).map(SupervisorState::name).collect()
        };
        assert_eq!(states(SupervisorState::is_trim), ["trim_ready", "trimming"]);
        assert_eq!(states(SupervisorState::moving), ["arming", "walking", "stopping", "trimming"]);
    }

    #[test]
    fn motion_begins_only_by_a_hold_without_faults() {
        for (before, inputs, after, actions) in rows() {
            if !before.state.moving() && after.state.moving() {
                let motion = match (before.state, after.state) {
                    (SupervisorState::Disarmed, SupervisorState::Arming) => Motion::Rise,
                    (SupervisorState::TrimReady, SupervisorState::Trimming) => Motion::Trim,
                    other => panic!("{other:?}"),
                };
                assert_eq!((inputs.button, inputs.demand), (ButtonEvent::Hold, Demand::Go));
                assert_eq!(actions.motion, motion);
            }
            // Between trim and walking is a stop request.
            if before.state.is_trim() && !after.state.is_trim() && after.state != SupervisorState::Fault {
                assert_eq!((inputs.demand, after.state), (Demand::Stop(Cause::Request), SupervisorState::Disarmed));
            }
            assert_eq!(actions.motion == Motion::Trim, after.state == SupervisorState::Trimming);
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
    fn a_fault_is_latched_and_needs_two_holds_to_move_again() {
        for (before, inputs, after, actions) in rows() {
            if let (Demand::Fault(_), true) = (inputs.demand, before.state != SupervisorState::Boot) {
                assert_eq!(after.state, SupervisorState::Fault);
                assert!(!actions.outputs);
            }
            if before.state == SupervisorState::Fault {
                assert_eq!(after.cause, before.cause, "the first cause is kept");
                let leaves = inputs.button == ButtonEvent::Hold && !matches!(inputs.demand, Demand::Fault(_));
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
                (SupervisorState::Disarmed, Demand::Stop(why)) if !entered && inputs.button == ButtonEvent::Hold => {
                    assert_eq!(after.cause, why)
                }
                (SupervisorState::Arming, _) if entered => assert_eq!(after.cause, Cause::None),
                (SupervisorState::Trimming, _) if entered => assert_eq!(after.cause, Cause::None),
                (SupervisorState::TrimReady, Demand::Stop(why)) if before.state == SupervisorState::Trimming => {
                    assert_eq!(after.cause, why)
                }
                (SupervisorState::TrimReady, Demand::Go) if before.state == SupervisorState::Trimming => {
                    assert_eq!(after.cause, Cause::Button)
                }
                (SupervisorState::TrimReady, _) if entered => assert_eq!(after.cause, Cause::None),
                (SupervisorState::TrimReady, Demand::Stop(why)) if inputs.button == ButtonEvent::Hold => {
                    assert_eq!(after.cause, why)
                }
                (SupervisorState::Disarmed, Demand::Stop(why)) if before.state == SupervisorState::TrimReady => {
                    assert_eq!(after.cause, why)
                }
                // The release of a press that is no hold.
                (SupervisorState::Disarmed | SupervisorState::TrimReady, _) if !entered => {
                    let refused = match inputs.button {
                        ButtonEvent::TooShort => Cause::HoldShort,
                        ButtonEvent::TooLong => Cause::HoldLong,
                        ButtonEvent::TooMany => Cause::Presses,
                        ButtonEvent::Stopped => Cause::BreakInput,
                        _ => before.cause,
                    };
                    assert_eq!(after.cause, refused);
                }
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
