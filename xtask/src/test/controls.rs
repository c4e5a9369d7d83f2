//! Controls of the protections: images that lack one each, which the tests and the campaign must notice.
//!
//! One image is built with the feature `controls` (`firmware-shared/program/removed.rs`). The number of a protection is written into it, and it is sealed
//! again. With number 0 nothing is gone: the same tests and faults pass then, so a failure is that of the protection.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};

use super::state::State;
use crate::{campaign, seal, shell};

/// The first value of the word, as `removed.rs` has it.
const ALL_THERE: [u8; 4] = 0x00C0_FFEE_u32.to_le_bytes();
/// A test ends in this time, also one that waits for what never comes.
const DEADLINE: Duration = Duration::from_secs(300);

/// A protection, and what shows it.
struct Control {
    /// Its number in `removed.rs`, and what it is.
    number: u32,
    name: &'static str,
    /// Program and function of its tests.
    tests: &'static [(&'static str, &'static str)],
    /// Part of the names of the faults that need it; empty: its tests alone.
    faults: &'static str,
}

const CONTROLS: [Control; 13] = [
    Control {
        number: 1,
        name: "the break switches the supply off",
        tests: &[("board_pulses", "the_emergency_stop_takes_the_supply_with_the_pulse")],
        faults: "the emergency stop is pressed",
    },
    Control {
        number: 2,
        name: "a handler switches the supply off first",
        tests: &[("virtual_board", "a_panic_or_a_fault_switches_the_supply_off_first")],
        faults: "a panic",
    },
    Control {
        number: 3,
        name: "a handler waits for the end of a pulse",
        tests: &[("board_pulses", "a_fault_handler_waits_for_the_end_of_a_pulse")],
        faults: "a panic",
    },
    Control {
        number: 4,
        name: "liveness",
        tests: &[("virtual_board", "a_task_that_hangs_is_reset_and_boots_disarmed")],
        faults: "the trigger stops",
    },
    Control {
        number: 5,
        name: "the bits that stop the watchdog are taken back",
        tests: &[("board_watchdog", "a_debugger_that_stops_the_watchdog_is_overruled")],
        faults: "8 ms before it halts the core",
    },
    Control {
        number: 6,
        name: "the lock-out after crashes",
        tests: &[("board_boots", "a_long_row_of_crashes_stays_locked_until_a_person_acts")],
        faults: "the lock-out",
    },
    Control {
        number: 7,
        name: "each tick reads back",
        tests: &[("board_conditions", "a_changed_register_is_a_fault")],
        faults: "TIM1 CCER, enable",
    },
    Control {
        number: 8,
        name: "the check of the pulses",
        tests: &[("board_campaign", "a_changed_bit_of_the_loop_is_found_by_the_check_of_the_pulses")],
        faults: "",
    },
    Control {
        number: 9,
        name: "the check sum of the program",
        tests: &[("board_program", "a_bit_that_changes_in_a_walk_stops_it_by_the_ramp")],
        faults: "a bit of the program in flash changes",
    },
    Control {
        number: 10,
        name: "the clock of the watchdog is measured",
        tests: &[("board_watchdog", "outside_of_the_range_arming_is_refused_in_words")],
        faults: "",
    },
    Control {
        number: 11,
        name: "a robot may demand a brown-out reset",
        tests: &[("board_conditions", "a_robot_that_demands_a_brown_out_reset_does_not_arm_without_one")],
        faults: "",
    },
    Control {
        number: 12,
        name: "the clock security system",
        tests: &[("board_restart", "pulses_that_a_clock_failure_cuts_are_counted_at_the_next_boot")],
        faults: "the crystal stops",
    },
    Control { number: 13, name: "the licence to move", tests: &[], faults: "licence of a" },
];

/// Runs what shows each protection on the image that lacks it.
pub(super) fn controls(state: &State) -> Result<String> {
    let built = state.workspace.firmware_controls()?;
    let elf = std::fs::read(&built.elf).with_context(|| format!("reading {}", built.elf.display()))?;
    let mut failures = Vec::new();
    let whole = written(&built.elf, &elf, 0)?;
    for Control { number, name, tests, faults } in CONTROLS {
        let lacking = written(&built.elf, &elf, number)?;
        for &(program, test) in tests {
            // A test that fails with everything there shows nothing by failing.
            for (image, passes) in [(&whole, true), (&lacking, false)] {
                if test_passes(state, image, program, test)? != passes {
                    failures.push(format!("{name}: {program}::{test} {}", verdict(passes)));
                }
            }
        }
        if !faults.is_empty() {
            let (cases, wrong) = campaign::of_image(&state.workspace, &whole, faults)?;
            if cases == 0 || wrong > 0 {
                failures.push(format!("{name}: of {cases} cases `{faults}` {wrong} are wrong with everything there"));
            }
            let (cases, wrong) = campaign::of_image(&state.workspace, &lacking, faults)?;
            eprintln!("without: {name}: {wrong} of {cases} cases are wrong, as they should");
            if wrong == 0 {
                failures.push(format!("{name}: no case of `{faults}` notices that it is gone"));
            }
        }
    }
    ensure!(failures.is_empty(), "{}", failures.join("\n"));
    Ok(format!("{} protections, each noticed when it is gone", CONTROLS.len()))
}

const fn verdict(should_pass: bool) -> &'static str {
    if should_pass { "fails with everything there" } else { "passes without it" }
}

/// The image without a protection, sealed, in a file of its own.
fn written(elf: &Path, image: &[u8], number: u32) -> Result<PathBuf> {
    let mut places = image.windows(4).enumerate().filter(|(_, bytes)| *bytes == ALL_THERE).map(|(at, _)| at);
    let (Some(at), None) = (places.next(), places.next()) else {
        bail!("the word of the removed protection is not in the image once: see firmware-shared/program/removed.rs")
    };
    let mut image = image.to_vec();
    if number != 0 {
        image[at..at + 4].copy_from_slice(&number.to_le_bytes());
    }
    seal::seal(&mut image)?;
    let path = elf.with_file_name(format!("control-{number}.elf"));
    std::fs::write(&path, image).with_context(|| format!("writing {}", path.display()))?;
    Ok(path)
}

/// Runs one test of a program with an image.
fn test_passes(state: &State, image: &Path, program: &str, test: &str) -> Result<bool> {
    let mut cargo = shell::cargo();
    cargo.args(["test", "--test", program, "--", test, "--exact"]);
    cargo.env("FOOTFALL_ELF", image).env("FOOTFALL_SHADOW_ELF", state.shadow()?);
    cargo.env("FOOTFALL_NO_SENSOR_ELF", state.without_sensor()?).env("FOOTFALL_BLACK_PILL_ELF", state.black_pill()?);
    cargo.env("FOOTFALL_VIRTUAL_BOARD", state.virtual_board()?).env("FOOTFALL_BIN", state.workspace.footfall()?);
    cargo.env("FOOTFALL_IMAGES_ALONE", "1");
    // What it violates is what it is for: it does not count among the runs of the tests.
    cargo.env_remove(super::judged::FILE);
    let finished = shell::with_deadline(&mut cargo, DEADLINE, &state.log("control"))?;
    let said = |word: &str| finished.output.lines().any(|line| line.contains(test) && line.ends_with(word));
    ensure!(said("ok") || said("FAILED"), "{program}::{test} did not run:\n{}", finished.tail(20));
    Ok(finished.success())
}
