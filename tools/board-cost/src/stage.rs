//! Stages of the tick and of the tasks below it, and the functions that they begin with.
//!
//! An instruction belongs to the stage of the innermost of its inlined functions that a rule names; where there is none, to the stage of
//! the code that called its function. So a division in the library counts where it is used.

use anyhow::{Result, ensure};

/// A stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The interrupt at the end of a block of samples.
    Sample,
    /// The interrupt of the tick around the control task.
    Interrupt,
    /// The control period itself, what no other stage names.
    Tick,
    /// Registers of outputs and clocks are compared with what was written.
    CheckBoard,
    /// Codes to angles.
    Measure,
    /// Button, monitor and supervisor.
    Supervise,
    /// The generator: observation, step, check and angles.
    Generate,
    /// Blend and target.
    Blend,
    /// Range, envelope, rate and acceleration.
    Gate,
    /// Angles to pulses, their check, and the compare registers.
    Servo,
    /// The frame, its hash, and the queues to telemetry.
    Record,
    /// Lamps and synchronisation output.
    Signals,
    /// Thread: records are encoded.
    Wire,
    /// Thread: the log.
    Log,
    /// Thread: the rest of the telemetry task.
    Telemetry,
    /// Thread: the watchdog task.
    Watchdog,
    /// Thread: the executor and the clock of the tasks.
    Thread,
}

impl Stage {
    /// All, in the order of the table.
    pub const ALL: [Self; 17] = [
        Self::Sample,
        Self::Interrupt,
        Self::Tick,
        Self::CheckBoard,
        Self::Measure,
        Self::Supervise,
        Self::Generate,
        Self::Blend,
        Self::Gate,
        Self::Servo,
        Self::Record,
        Self::Signals,
        Self::Wire,
        Self::Log,
        Self::Telemetry,
        Self::Watchdog,
        Self::Thread,
    ];

    /// Name in the table.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sample => "tick: DMA interrupt",
            Self::Interrupt => "tick: its interrupt",
            Self::Tick => "tick: control step, the rest",
            Self::CheckBoard => "tick: check of registers",
            Self::Measure => "tick: measure",
            Self::Supervise => "tick: supervise",
            Self::Generate => "tick: generate",
            Self::Blend => "tick: blend",
            Self::Gate => "tick: gate",
            Self::Servo => "tick: servo",
            Self::Record => "tick: record",
            Self::Signals => "tick: lamps, synchronisation",
            Self::Wire => "thread: wire",
            Self::Log => "thread: log",
            Self::Telemetry => "thread: telemetry, the rest",
            Self::Watchdog => "thread: watchdog",
            Self::Thread => "thread: executor",
        }
    }

    /// Whether it is a part of the tick.
    #[must_use]
    pub const fn is_in_tick(self) -> bool {
        (self as u8) < (Self::Wire as u8)
    }
}

/// Functions whose names begin and end so belong to a stage, with what they call.
struct Rule(Stage, &'static str, &'static str);

/// Whatever the name ends with.
const EVERYTHING: &str = "*";
/// The loop's own functions.
const LOOP: &str = "<joint_loop::control::tick::JointLoop<";

const RULES: &[Rule] = &[
    Rule(Stage::Tick, "firmware::tasks::control::control_step", ""),
    Rule(Stage::Tick, LOOP, ">::tick"),
    Rule(Stage::CheckBoard, "<firmware::servo_pwm::Outputs>::", "as_written"),
    Rule(Stage::CheckBoard, "firmware::clocks::is_as_started", ""),
    Rule(Stage::CheckBoard, "firmware::sampling::is_as_started", ""),
    Rule(Stage::Measure, "firmware::tasks::sensor::sensor_step", ""),
    Rule(Stage::Measure, LOOP, ">::measure"),
    Rule(Stage::Supervise, LOOP, ">::count"),
    Rule(Stage::Supervise, LOOP, ">::seen"),
    Rule(Stage::Supervise, LOOP, ">::asked"),
    Rule(Stage::Supervise, LOOP, ">::settled"),
    Rule(Stage::Supervise, "<joint_loop::control::monitor::Monitor>::", "judge"),
    Rule(Stage::Supervise, "<joint_loop::control::button::Button>::", "sample"),
    Rule(Stage::Supervise, "joint_loop::control::supervisor::next", ""),
    Rule(Stage::Generate, LOOP, ">::generate"),
    Rule(Stage::Blend, LOOP, ">::target"),
    Rule(Stage::Blend, "<joint_loop::motion::blend::Blend>::", "advance_from"),
    Rule(Stage::Gate, "<joint_loop::motion::gate::Gate>::", "limit"),
    Rule(Stage::Servo, "<joint_loop::motion::servo::ServoMap>::", "pulses"),
    Rule(Stage::Servo, "<firmware_shared::pulse_check::PulseCheck>::", "allows"),
    Rule(Stage::Servo, "<firmware::servo_pwm::Outputs>::", "drive"),
    Rule(Stage::Record, LOOP, ">::record"),
    Rule(Stage::Record, "<firmware::tasks::control::Control>::", "report"),
    Rule(Stage::Record, "<firmware::tasks::control::Control>::", "report_edges"),
    Rule(Stage::Signals, "firmware::lamps::show", ""),
    Rule(Stage::Signals, "joint_loop::io::time_code::level", ""),
    Rule(Stage::Wire, "wire::codec::", EVERYTHING),
    Rule(Stage::Wire, "<firmware::serial::Port>::", "send"),
    Rule(Stage::Log, "firmware::log::", EVERYTHING),
    Rule(Stage::Telemetry, TELEMETRY_STEP, ""),
    Rule(Stage::Watchdog, "firmware::tasks::watchdog::watchdog_step", ""),
];

/// The function that begins a round of the telemetry task.
pub const TELEMETRY_STEP: &str = "firmware::tasks::telemetry::telemetry_step";

/// The rules, and which of them named a function of code that ran.
pub struct Stages {
    used: Vec<bool>,
}

impl Default for Stages {
    fn default() -> Self {
        Self { used: vec![false; RULES.len()] }
    }
}

impl Stages {
    /// The stage that an instruction begins, by its functions, the innermost first; `None`: that of the caller.
    pub fn of(&mut self, functions: &[String]) -> Option<Stage> {
        let names = |Rule(_, begin, end): &Rule, name: &str| {
            name.strip_prefix(begin).is_some_and(|rest| match *end {
                EVERYTHING => true,
                // Between the two may be type parameters.
                end => rest.ends_with(end) && (begin.ends_with('<') || rest == end),
            })
        };
        let matches = |name: &String| RULES.iter().position(|rule| names(rule, name));
        let rule = functions.iter().find_map(matches)?;
        self.used[rule] = true;
        Some(RULES[rule].0)
    }

    /// Shows that each rule named code that ran.
    ///
    /// # Errors
    ///
    /// With the rules that did not: the function has another name now, or it did not run.
    pub fn check(&self) -> Result<()> {
        let unused = RULES.iter().zip(&self.used).filter(|(_, used)| !**used);
        let names: Vec<String> = unused.map(|(Rule(_, begin, end), _)| format!("{begin}{end}")).collect();
        ensure!(
            names.is_empty(),
            "no code ran of the functions {}; mend the rules in tools/board-cost/src/stage.rs",
            names.join(", ")
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_innermost_function_that_a_rule_names_decides() {
        let mut stages = Stages::default();
        let mut of = |names: &[&str]| stages.of(&names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>());
        let tick = "<joint_loop::control::tick::JointLoop<joint_loop::generator::BoardGenerator, 4>>::tick";
        let step = "firmware::tasks::control::control_step";
        let gate = "<joint_loop::motion::gate::Gate>::limit";
        assert_eq!(of(&["core::num::isqrt", gate, tick, step]), Some(Stage::Gate));
        assert_eq!(of(&["<joint_loop::motion::gate::Gate>::limit::{closure#0}", tick, step]), Some(Stage::Tick));
        assert_eq!(of(&["wire::codec::encode"]), Some(Stage::Wire));
        assert_eq!(of(&["compiler_builtins::mem::memcpy"]), None);
        assert_eq!(of(&["joint_loop::control::supervisor::next_to"]), None);
    }

    #[test]
    fn a_rule_that_names_no_code_is_an_error() {
        let error = Stages::default().check().unwrap_err().to_string();
        assert!(error.contains(TELEMETRY_STEP) && error.contains("stage.rs"), "{error}");
    }
}
