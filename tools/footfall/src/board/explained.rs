//! Which ends of a run an injected fault explains. An end that no fault of the run explains makes the run unsound.
//!
//! The words are those of the virtual board's output: the options (`--hang`) and the `inject` of a script.

use joint_loop::Cause;
use serde_json::Value;

/// What a fault may lead to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Ends {
    /// Causes with which a motion may end, or an arming may be refused.
    causes: &'static [Cause],
    /// The chip may be reset.
    reset: bool,
    /// Frames may stop to come.
    silence: bool,
    /// The board may refuse to start.
    refusal: bool,
}

const NOTHING: Ends = Ends { causes: &[], reset: false, silence: false, refusal: false };

/// Ticks that come late or not at all.
const TIMING: &[Cause] = &[Cause::Gap, Cause::Late, Cause::Watchdog, Cause::AdcOverrun];

/// Wrong samples, of a sensor or of the supply; a follower also takes unchanged ones for a person who stands.
const SAMPLES: &[Cause] = &[
    Cause::SensorOpen,
    Cause::SensorShort,
    Cause::SensorSaturated,
    Cause::SensorStuck,
    Cause::SensorSpike,
    Cause::SensorRate,
    Cause::SensorOutOfTable,
    Cause::SensorSupplyLow,
    Cause::Supply,
    Cause::PersonStands,
];

/// Samples that are wrong, late or missing.
const CONVERTER: &[Cause] = &[
    Cause::AdcOverrun,
    Cause::Gap,
    Cause::Late,
    Cause::Watchdog,
    Cause::SensorOpen,
    Cause::SensorShort,
    Cause::SensorSaturated,
    Cause::SensorStuck,
    Cause::SensorSpike,
    Cause::SensorRate,
    Cause::SensorOutOfTable,
    Cause::SensorSupplyLow,
    Cause::Supply,
    Cause::PersonStands,
];

/// Everything that the frequency of a clock changes.
const CLOCKS: &[Cause] =
    &[Cause::Clock, Cause::WatchdogClock, Cause::Gap, Cause::Late, Cause::Watchdog, Cause::AdcOverrun];

/// The same, and the register that tells that the PLL has lost its lock.
const PLL: &[Cause] =
    &[Cause::Outputs, Cause::Clock, Cause::WatchdogClock, Cause::Gap, Cause::Late, Cause::Watchdog, Cause::AdcOverrun];

/// What the inputs of button and emergency stop lead to; edges that come too fast make ticks late.
const INPUTS: &[Cause] = &[
    Cause::BreakInput,
    Cause::Button,
    Cause::HoldShort,
    Cause::HoldLong,
    Cause::Presses,
    Cause::StopUntested,
    Cause::Gap,
    Cause::Late,
];

/// A debugger that halts the core.
const DEBUGGER: &[Cause] = &[Cause::Debugger, Cause::Gap, Cause::Late, Cause::Watchdog, Cause::AdcOverrun];

/// A wrong clock of the watchdog.
const WATCHDOG: &[Cause] = &[Cause::WatchdogClock, Cause::Watchdog];

/// A fault that has ended explains nothing later than this, s: what it has led to was found by then, at the latest by the watchdog.
const AFTER_END_S: f64 = 0.5;

/// What a kind of fault may lead to; nothing for a word that is not known.
fn ends(kind: &str) -> Ends {
    match kind {
        "hang" | "fault" | "undefined" | "panic" => Ends { causes: TIMING, reset: true, silence: true, ..NOTHING },
        "slow" => Ends { causes: TIMING, reset: true, ..NOTHING },
        "halt" => Ends { causes: DEBUGGER, reset: true, silence: true, ..NOTHING },
        "hse" | "crystal" | "crystal-hz" | "crystal-drift" => {
            Ends { causes: CLOCKS, reset: true, silence: true, refusal: true }
        }
        "pll" => Ends { causes: PLL, reset: true, silence: true, refusal: true },
        "lsi" | "lsi-drift" => Ends { causes: WATCHDOG, reset: true, ..NOTHING },
        "overrun" | "dma" | "transfer" | "transfer-stall" | "transfer-lost" | "conversion-stall" | "trigger" => {
            Ends { causes: CONVERTER, reset: true, silence: true, ..NOTHING }
        }
        "stuck-code" | "stuck-bits" | "volts" | "supply" => Ends { causes: SAMPLES, ..NOTHING },
        "vdd" | "power-cycle" => Ends { causes: SAMPLES, reset: true, silence: true, ..NOTHING },
        "reset" => Ends { reset: true, ..NOTHING },
        "reset-button" => Ends { reset: true, silence: true, ..NOTHING },
        "level" | "wave" => Ends { causes: INPUTS, ..NOTHING },
        "rtt" => Ends { silence: true, ..NOTHING },
        // They change the program, its memory or its registers: whatever the board then notices and does is explained.
        "register" | "flip" | "flip-word" | "write" | "core-flip" | "core-set" | "exception" | "flash"
        | "flash-erase" | "flash-program" => Ends { causes: &Cause::ALL, reset: true, silence: true, refusal: true },
        _ => NOTHING,
    }
}

/// The injected faults of a run, as the virtual board reports them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Injected<'a>(pub(super) &'a [Value]);

impl Injected<'_> {
    /// One of them that was injected until then, and had not ended long before, explains it by its kind.
    fn any(self, seconds: f64, explains: impl Fn(Ends) -> bool) -> bool {
        self.0.iter().any(|one| {
            let injected = one["injected_s"].as_f64().is_some_and(|at| at <= seconds);
            let is_over = one["ended_s"].as_f64().is_some_and(|at| at + AFTER_END_S < seconds);
            injected && !is_over && one["kind"].as_str().is_some_and(|kind| explains(ends(kind)))
        })
    }

    /// Whether a motion may have ended with this cause, which the log gave at this time, s.
    pub(super) fn explain_cause(self, cause: &str, seconds: f64) -> bool {
        self.any(seconds, |ends| ends.causes.iter().any(|one| one.name() == cause))
    }

    /// Whether the chip may have been reset at this time, s.
    pub(super) fn explain_reset(self, seconds: f64) -> bool {
        self.any(seconds, |ends| ends.reset)
    }

    /// Whether no frame may have come until this time, s.
    pub(super) fn explain_silence(self, seconds: f64) -> bool {
        self.any(seconds, |ends| ends.silence)
    }

    /// Whether the board may have refused to start in the boot at this time, s.
    pub(super) fn explain_refusal(self, seconds: f64) -> bool {
        self.any(seconds, |ends| ends.refusal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_fault_explains_its_own_ends_and_no_others() {
        let short = [json!({ "kind": "volts", "injected_s": 2.0 })];
        let short = Injected(&short);
        assert!(short.explain_cause("sensor_short", 2.1) && short.explain_cause("supply", 2.0));
        assert!(!short.explain_cause("sensor_short", 1.9), "it came later");
        assert!(!short.explain_cause("outputs", 2.1) && !short.explain_cause("clock", 2.1));
        assert!(!short.explain_reset(3.0) && !short.explain_silence(3.0) && !short.explain_refusal(3.0));
        let hang = [json!({ "kind": "hang", "injected_s": 1.0 })];
        assert!(Injected(&hang).explain_reset(1.2) && !Injected(&hang).explain_refusal(1.2));
        assert!(!Injected(&hang).explain_cause("sensor_short", 1.2));
        let over = [json!({ "kind": "volts", "injected_s": 2.0, "ended_s": 2.1 })];
        assert!(Injected(&over).explain_cause("sensor_short", 2.4), "found a little later");
        assert!(!Injected(&over).explain_cause("sensor_short", 2.7), "long over");
        let waits = [json!({ "kind": "hang", "injected_s": null }), json!({ "kind": "none", "injected_s": 0.0 })];
        assert!(!Injected(&waits).explain_reset(9.0), "it never came, and a word that is not known explains nothing");
    }

    /// The words of the page and of the options are known here.
    #[test]
    fn each_word_of_the_page_explains_something() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/virtual-board.md");
        let page = std::fs::read_to_string(page).expect("the page");
        let (_, table) = page.split_once("| `inject` |").expect("the table");
        let (table, _) = table.split_once("\n\n").expect("its end");
        let mut words = vec!["hang", "fault", "hse", "dma", "lsi", "halt", "register", "trigger", "overrun", "panic"];
        for row in table.lines().skip(2) {
            let first = row.split('|').nth(1).expect("a first column");
            let quoted = first.split('`').skip(1).step_by(2);
            words.extend(quoted.map(|code| {
                let word = code.trim_start_matches(['{', ' ', '"']);
                word.split([' ', '"', '=']).next().expect("a word")
            }));
        }
        assert!(words.len() > 40, "{words:?}");
        for word in words {
            assert_ne!(ends(word), NOTHING, "{word}");
        }
    }
}
