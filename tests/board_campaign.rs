//! A sample of the campaign of faults (`cargo xtask campaign`): every fault in one state at one phase at least, which is asserted, each with its
//! reaction in time, and no pulse beyond the limits of the robot.

use firmware_shared::post_mortem;
use footfall::board::image::Image;
use footfall_tests::boot_log::BootLog;
use footfall_tests::campaign::{self, Outcome, faults_file, head, registers_file};
use footfall_tests::limits::assert_in_time;
use joint_loop::tuning::{Action, Request};
use joint_loop::{Direction, RobotConfig};
use joint_units::{Joint, PulseMicros};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{ExitCode, Stdio};
use test_suite::{report, tests};

/// One case of so many of each fault, at least one, without `FOOTFALL_EVERY`.
const SAMPLE: &str = "61";
/// The variable with the number of bits of the loop's memory to change, at least [`FEW_BITS`].
const BITS: &str = "FOOTFALL_BITS";
/// Bits without the variable.
const FEW_BITS: usize = 1600;
/// The fault of a core that a debugger halts, with the watchdog running.
const HALTS: &str = "a debugger halts the core";
/// Parts of the names of faults, and the hazard whose times are those of the end of the pulses, where the outputs were on.
const TIMES: [(&str, &str); 10] = [
    ("the supply falls", "H27"),
    ("the supply falls", "H48"),
    ("s stand still", "H44"),
    ("a transfer is lost", "H44"),
    ("TIM1 ", "H54"),
    ("TIM2 ", "H54"),
    ("GPIO", "H54"),
    ("RCC ", "H54"),
    ("ADC1 ", "H54"),
    ("DMA2 ", "H54"),
];
/// The runs in which faults are injected.
const RUNS: [&str; 5] = ["walk", "trim", "untested", "crashes", "follower"];

fn main() -> ExitCode {
    test_suite::run(tests![
        the_limits_are_those_of_the_default_robot(),
        the_bytes_of_the_trim_are_those_of_a_host(),
        the_campaign_knows_every_end_of_a_run(),
        the_registers_have_the_limits_and_runs_of_the_campaign(),
        each_interrupt_without_a_use_is_in_the_file(Image),
        a_sample_of_the_faults_leads_to_the_declared_reactions(Image),
        every_hang_ends_in_time_at_any_watchdog_clock(Image),
        several_faults_at_once_leave_the_pulses_inside_the_limits(Image),
        a_changed_bit_of_the_loop_is_found_by_the_check_of_the_pulses(Image),
        a_changed_bit_at_rest_moves_nothing_that_a_hold_did_not_arm(Image),
        wrong_limits_and_wrong_reactions_are_noticed(Image),
        a_wrong_reaction_at_rest_is_noticed(Image),
        a_boot_that_says_another_end_is_noticed(Image),
        an_off_of_a_stop_is_not_its_own_end(),
        a_state_that_is_not_as_declared_ends_the_campaign(Image),
        pulses_that_no_hold_armed_are_noticed(Image),
        a_campaign_whose_results_nobody_reads_ends(Image),
    ])
}

/// All cases of the walk would take minutes.
fn a_campaign_whose_results_nobody_reads_ends() {
    let (mut command, _folder) = campaign::command(&faults_file(), "walk", &["--jobs", "2"]);
    let mut board = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut first = String::new();
    BufReader::new(board.stdout.take().expect("its output")).read_line(&mut first).expect("a line");
    assert!(first.contains("\"good\":true"), "{first}");
    // The reader is closed with the end of the line before.
    let output = board.wait_with_output().expect("its end");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("nobody reads the results of the campaign any more") && !output.status.success(), "{said}");
    // At that time few cases of thousands have been run: those that were under way cannot write theirs.
    assert!(said.lines().count() < 100, "{said}");
}

/// The project's file as a table.
fn table() -> toml::Table {
    std::fs::read_to_string(faults_file()).expect("the file").parse().expect("TOML")
}

fn the_limits_are_those_of_the_default_robot() {
    let file = table();
    let limit = |key: &str, joint: usize| file["limits"][key][joint].as_float().expect("a number");
    let RobotConfig { gate, servos, park, .. } = RobotConfig::default_biped();
    for (joint, servo) in servos.iter().enumerate() {
        let direction = if servo.direction == Direction::Forward { 1.0 } else { -1.0 };
        let micros = |angle: f32| {
            f64::from(servo.neutral.0)
                + direction * f64::from(servo.micros_per_radian) * f64::from(angle - servo.angle_at_neutral.0)
        };
        let ends = [gate.range[joint].least.0, gate.range[joint].most.0].map(micros);
        let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        assert!((limit("least_us", joint) - least).abs() < 0.1, "joint {joint}: {least}");
        assert!((limit("most_us", joint) - most).abs() < 0.1, "joint {joint}: {most}");
        let rate = f64::from(servo.micros_per_radian * gate.rate[joint].0);
        assert!((limit("us_per_s", joint) - rate).abs() < 0.2, "joint {joint}: {rate}");
        let park = micros(park[joint].0);
        assert!((limit("park_us", joint) - park).abs() < 0.1, "joint {joint}: {park}");
    }
}

fn the_bytes_of_the_trim_are_those_of_a_host() {
    let file = table();
    let runs = file["run"].as_array().expect("runs");
    let trim = runs.iter().find(|run| run["name"].as_str() == Some("trim")).expect("a run with a trim");
    let sent: Vec<&str> =
        trim["serial"].as_array().expect("bytes").iter().map(|one| one["bytes"].as_str().expect("text")).collect();
    let hex = |number: u16, action: Action| {
        let mut buffer = [0; wire::MAX_FRAME_BYTES];
        let bytes = wire::frame_request(&Request { number, action }, &mut buffer).expect("it fits");
        bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>()
    };
    let jog = Action::Jog { pulse: PulseMicros(1_560) };
    assert_eq!(sent, [hex(1, Action::Trim { joint: Joint::LeftHip }), hex(2, jog)]);
}

/// By the vector table: those whose handler is the default one, or that have none, and the numbers in the file.
fn each_interrupt_without_a_use_is_in_the_file() {
    let bytes = std::fs::read(std::env::var_os("FOOTFALL_ELF").expect("FOOTFALL_ELF")).expect("the image");
    let elf = object::File::parse(&*bytes).expect("an ELF");
    let symbol = elf.symbols().find(|symbol| symbol.name() == Ok("DefaultHandler")).expect("its default handler");
    let vectors = elf.section_by_name(".vector_table").expect("a vector table").data().expect("its words");
    let words: Vec<u64> =
        vectors.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().expect("four")).into()).collect();
    // Without the stack, reset, and what the core does not have.
    let unused: Vec<i64> = (0..)
        .zip(&words)
        .filter(|(number, word)| {
            ![0, 1, 7, 8, 9, 10, 13].contains(number) && (**word == 0 || **word | 1 == symbol.address() | 1)
        })
        .map(|(number, _)| number)
        .collect();
    let file = table();
    let numbers = |name: &str| -> Vec<i64> {
        let all = file["exceptions"].as_array().expect("exceptions").iter();
        let chosen = all.filter(|one| one["name"].as_str() == Some(name));
        chosen
            .flat_map(|one| one["numbers"].as_array().expect("numbers"))
            .map(|n| n.as_integer().expect("one"))
            .collect()
    };
    // NMI and HardFault have handlers of their own.
    assert_eq!((numbers("the non-maskable interrupt"), numbers("the hard fault")), (vec![2], vec![3]));
    let (of_the_core, lines): (Vec<i64>, Vec<i64>) = unused.iter().copied().partition(|number| *number < 16);
    assert_eq!(numbers("another exception of the core"), of_the_core);
    let (missing, present): (Vec<i64>, Vec<i64>) =
        lines.iter().copied().partition(|number| words[*number as usize] == 0);
    assert_eq!((numbers("an interrupt without a vector"), numbers("an interrupt without a use")), (missing, present));
    assert_eq!(numbers("an interrupt without a use that is not enabled"), lines);
    let used = [numbers("an interrupt in use, once too often"), numbers("the break interrupt")].concat();
    assert_eq!(used.len() + lines.len(), vectors.len() / 4 - 16, "the used ones: {used:?}");
}

/// None is wrong.
fn assert_good(outcome: &Outcome) {
    assert_eq!((outcome.code, outcome.wrong().len()), (Some(0), 0), "{}\n{:#?}", outcome.said, outcome.wrong());
}

fn a_sample_of_the_faults_leads_to_the_declared_reactions() {
    let mut cases = Vec::new();
    let mut faults = 0;
    let every = std::env::var("FOOTFALL_EVERY").unwrap_or_else(|_| SAMPLE.to_owned());
    for run in RUNS {
        let outcome = campaign::run(&faults_file(), run, &["--every", &every, "--boot-log"]);
        assert_good(&outcome);
        let end = outcome.end.expect("an end");
        report!("{run}: {} cases in {} s, none wrong", outcome.cases.len(), end["seconds"]);
        faults = end["faults"].as_u64().expect("a number");
        cases.extend(outcome.cases);
    }
    let distinct = |key: &str| cases.iter().map(|case| case[key].to_string()).collect::<BTreeSet<_>>();
    let (names, states, phases) = (distinct("name"), distinct("state"), distinct("phase"));
    let words = |reaction: &str| cases.iter().filter(|case| case["reaction"] == reaction).count();
    let counts = ["off", "reset", "fault", "none"].map(|word| (word, words(word)));
    let alone = cases.iter().filter(|case| case["pulses_alone"] == true).count();
    report!("{} cases of {faults} faults: {counts:?}, {alone} judged by the pulses alone", cases.len());
    // Each fault at least once, all states, all phases; and each reaction is seen.
    assert!(faults >= 600);
    assert_eq!((names.len() as u64, states.len(), phases.len()), (faults, 10, 20), "{states:?} {phases:?}");
    assert!(counts.iter().all(|(_, count)| *count >= 50), "{counts:?}");
    let mut compared = BTreeSet::new();
    for case in &cases {
        let row = case["row"].as_str().expect("a row");
        let ended_us = [&case["off_us"], &case["reset_us"]].into_iter().filter_map(Value::as_f64).reduce(f64::min);
        let Some(ended_us) = ended_us.filter(|_| case["outputs"] == true && case["pulses_alone"] == false) else {
            continue;
        };
        for (part, id) in TIMES.iter().filter(|(part, _)| row.contains(part)) {
            compared.insert((*part, *id));
            assert_in_time(id, ended_us * 1e-3, &case["name"].to_string());
        }
    }
    assert_eq!(compared, TIMES.into());
    // Only bits of the memory have no declared reaction.
    assert!(cases.iter().all(|case| (case["pulses_alone"] == true) == (case["row"] == "static RAM")));
    let wrong = wrong_boots(&cases);
    assert_eq!(wrong, [""; 0], "{} boots", wrong.len());
}

/// Boots after resets that do not say in the log why: each needs a boot record with the cause that the virtual board gave to the reset, and an end of the
/// run that the file allows.
fn wrong_boots(cases: &[Value]) -> Vec<String> {
    let image = Image::read(std::env::var_os("FOOTFALL_ELF").expect("FOOTFALL_ELF").as_ref()).expect("the image");
    let mut ends: BTreeMap<(String, String), usize> = BTreeMap::new();
    let mut wrong = Vec::new();
    for case in cases.iter().filter(|case| !case["reset_us"].is_null()) {
        let log = BootLog::read(&case["log"], &image);
        let resets: Vec<&str> = case["resets"].as_array().expect("resets").iter().filter_map(Value::as_str).collect();
        let end = log.end().unwrap_or("nothing").to_owned();
        let is_the_last_reset = log.boots.first().is_none_or(|boot| Some(&boot.reset.name()) == resets.last());
        // Only the pulses judge a bit of the memory.
        let is_allowed = (case["pulses_alone"] == true && end != "nothing")
            || case["allowed"].as_array().expect("words").iter().any(|word| word.as_str() == Some(&end));
        if !(is_the_last_reset && is_allowed) {
            wrong.push(format!(
                "{}, {}, phase {}: resets {resets:?}, {log:?}",
                case["name"], case["state"], case["phase"]
            ));
        }
        let row = case["row"].as_str().expect("a row").to_owned();
        *ends.entry((row, log.crash.unwrap_or(end))).or_default() += 1;
    }
    for ((row, end), count) in &ends {
        report!("{row}: {end}: {count}");
    }
    report!("{} boots after a reset, {} of them do not say why", ends.values().sum::<usize>(), wrong.len());
    wrong
}

/// A reset whose boot says something else than the file allows, and one after which nothing boots.
fn a_boot_that_says_another_end_is_noticed() {
    let file = tempfile::NamedTempFile::new().expect("a file");
    for (inject, boot, words) in [
        ("\"panic\"", "panic", None),
        ("\"panic\"", "stalled", Some("panic in")),
        ("{ hang = \"control_step\" }", "iwdg", None),
        ("{ hang = \"control_step\" }", "power_on", Some("IndependentWatchdog")),
        ("\"crystal\"", "nothing", Some("clock_failure")),
    ] {
        let expect = format!("{{ reaction = \"reset\", boot = \"{boot}\", within_ms = 38 }}");
        let fault = format!("[[fault]]\nname = \"a\"\ninject = {inject}\nstates = [\"walking\"]\nexpect = {expect}\n");
        std::fs::write(file.path(), head() + &fault).expect("written");
        let outcome = campaign::run(file.path(), "walk", &["--boot-log", "--every", "10"]);
        assert_good(&outcome);
        let wrong = wrong_boots(&outcome.cases);
        let noticed = words.is_some_and(|words| wrong.len() == 2 && wrong.iter().all(|wrong| wrong.contains(words)));
        assert!(noticed || (words.is_none() && wrong.is_empty()), "{inject}, {boot}: {wrong:?}");
    }
}

/// Tasks and interrupts, at both ends of the watchdog's oscillator: the reset is inside the bound, and a board without a fault is not reset.
fn every_hang_ends_in_time_at_any_watchdog_clock() {
    for hz in ["17000", "47000"] {
        let (mut hangs, mut halts, mut healthy) = (Vec::new(), Vec::new(), Vec::new());
        for run in RUNS {
            let sets = [(" hangs", "11", &mut hangs), (HALTS, "7", &mut halts), ("loses a result", "11", &mut healthy)];
            for (only, every, cases) in sets {
                let outcome = campaign::run(&faults_file(), run, &["--only", only, "--every", every, "--lsi-hz", hz]);
                assert_good(&outcome);
                cases.extend(outcome.cases);
            }
        }
        let latest = hangs.iter().map(|case| case["reset_us"].as_f64().expect("a reset")).fold(0.0, f64::max);
        report!("LSI {hz} Hz: {} hangs, the latest reset after {:.1} ms", hangs.len(), latest * 1e-3);
        // Of a task, and of an interrupt.
        for id in ["H24", "H30", "H31", "H32"] {
            assert_in_time(id, latest * 1e-3, "a hang");
        }
        let halts: Vec<&Value> = halts.iter().filter(|case| case["name"] == HALTS).collect();
        assert!(halts.len() >= 10, "{} halts", halts.len());
        for halt in halts {
            assert_in_time("H08", halt["reset_us"].as_f64().expect("a reset") * 1e-3, HALTS);
        }
        let names: BTreeSet<String> = hangs.iter().map(|case| case["name"].to_string()).collect();
        assert!(hangs.len() >= 100 && names.len() == 9, "{names:?}");
        assert!(healthy.len() >= 10 && healthy.iter().all(|case| case["reset_us"].is_null()));
    }
}

/// The virtual board names the ends of a run on its own, since it does not depend on the firmware.
fn the_campaign_knows_every_end_of_a_run() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tools/virtual-board/src/campaign/reports.rs");
    let text = std::fs::read_to_string(source).expect("the reader");
    let names = |list: &str| -> Vec<String> {
        let (_, rest) = text.split_once(&format!("const {list}: ")).expect("the list");
        let (_, rest) = rest.split_once('=').expect("its value");
        let (body, _) = rest.split_once("];").expect("its end");
        body.split('"').skip(1).step_by(2).map(str::to_owned).collect()
    };
    let crashes = post_mortem::Cause::ALL.map(post_mortem::Cause::name);
    assert_eq!(names("CRASHES"), crashes.into_iter().filter(|name| *name != "none").collect::<Vec<_>>());
}

/// What the page says about the general registers of the core is run with the same states.
fn the_registers_have_the_limits_and_runs_of_the_campaign() {
    let text = std::fs::read_to_string(registers_file()).expect("the file");
    let registers: toml::Table = text.parse().expect("TOML");
    let file = table();
    assert_eq!(registers["limits"], file["limits"]);
    for run in registers["run"].as_array().expect("runs") {
        assert!(file["run"].as_array().expect("runs").contains(run), "{run}");
    }
}

fn several_faults_at_once_leave_the_pulses_inside_the_limits() {
    let mut cases = 0;
    for run in RUNS {
        let outcome = campaign::run(&faults_file(), run, &["--several", "150", "--seed", "1"]);
        assert_good(&outcome);
        cases += outcome.cases.len();
    }
    assert_eq!(cases, 150, "each case is in one of the runs");
    // A case alone is the same case.
    let outcome = campaign::run(&faults_file(), "walk", &["--several", "150"]);
    let case = &outcome.cases[outcome.cases.len() / 2];
    let alone = campaign::run(&faults_file(), "walk", &["--several", "1", "--seed", &case["seed"].to_string()]);
    assert_eq!(&alone.cases[0], case);
}

/// The states at rest, each with its run.
const AT_REST: [(&str, &str); 5] = [
    ("walk", "disarmed"),
    ("walk", "fault"),
    ("trim", "trim ready"),
    ("untested", "stop untested"),
    ("crashes", "four crashes"),
];

/// Bits of the statics that hold the loop and the control task: at rest none of them moves a servo. After some of them the board is armed by holds: it
/// moves as it should or not at all.
fn a_changed_bit_at_rest_moves_nothing_that_a_hold_did_not_arm() {
    let bytes = std::fs::read(std::env::var_os("FOOTFALL_ELF").expect("FOOTFALL_ELF")).expect("the image");
    let elf = object::File::parse(&*bytes).expect("an ELF");
    let of = |end: &str| {
        let symbol = elf.symbols().find(|symbol| symbol.name().is_ok_and(|name| name.ends_with(end)));
        let symbol = symbol.unwrap_or_else(|| panic!("the static {end}"));
        symbol.address()..symbol.address() + symbol.size()
    };
    let bits: usize = std::env::var(BITS).map_or(FEW_BITS, |bits| bits.parse().expect("a number")) / 8;
    let mut drives = 0;
    for (run, state) in AT_REST {
        let mut text = head();
        for (part, static_) in ["firmware5start4LOOP", "firmware4boot7CONTROL"].into_iter().enumerate() {
            let addresses = of(static_);
            let all = (addresses.end - addresses.start) as usize * 8;
            // By the golden section: spread evenly, and other bits in each state.
            for n in 0..bits {
                let from = 0.618_034 * (n * AT_REST.len() + part) as f64 + 0.2 * state.len() as f64;
                let bit = (from.fract() * all as f64) as u64;
                let (address, mask) = (addresses.start + bit / 32 * 4, 1_u32 << (bit % 32));
                // The lock-out and an untested stop let no hold arm; a fault is acknowledged by a first hold.
                let holds = match state {
                    "disarmed" if n % 8 == 0 => "press = [{ at_s = 0.2, hold_s = 0.4 }]\nlasts_s = 1.5\n",
                    "trim ready" if n % 8 == 0 => "press = [{ at_s = 0.6, hold_s = 0.4 }]\nlasts_s = 1.5\n",
                    "fault" if n % 8 == 0 => {
                        "press = [{ at_s = 3.0, hold_s = 0.4 }, { at_s = 3.8, hold_s = 0.4 }]\nlasts_s = 5.0\n"
                    }
                    _ => "lasts_s = 0.1\n",
                };
                text += &format!(
                    "[[sequence]]\nname = \"{part} {n}\"\nstate = \"{state}\"\n{holds}\
                     inject = [{{ at_s = 0.001, what = {{ flip = {{ address = {address}, mask = {mask} }} }} }}]\n"
                );
            }
        }
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), text).expect("written");
        let outcome = campaign::run(file.path(), run, &[]);
        assert_good(&outcome);
        assert_eq!(outcome.cases.len(), 2 * bits);
        drives +=
            outcome.cases.iter().filter(|case| case["drives_s"].as_array().is_some_and(|at| !at.is_empty())).count();
    }
    report!("{} bits in each of {} states, {drives} cases with pulses after a hold", 2 * bits, AT_REST.len());
    assert!(drives >= bits / 8, "{drives}: the holds arm");
}

/// Bits of the static that holds the control loop: its limits, servo maps and positions. Some of them would make wrong pulses, which the check of the
/// pulses after the loop refuses; without it, the rules at the pins find them.
fn a_changed_bit_of_the_loop_is_found_by_the_check_of_the_pulses() {
    let bytes = std::fs::read(std::env::var_os("FOOTFALL_ELF").expect("FOOTFALL_ELF")).expect("the image");
    let elf = object::File::parse(&*bytes).expect("an ELF");
    let name = |symbol: &object::Symbol<'_, '_>| symbol.name().expect("UTF-8").to_owned();
    let first = elf.symbols().find(|symbol| name(symbol).ends_with("firmware5start4LOOP")).expect("the loop");
    let end = first.address() + first.size();
    let after = elf.symbols().filter(|symbol| symbol.address() >= end && symbol.kind() == object::SymbolKind::Data);
    let after = after.min_by_key(object::ObjectSymbol::address).expect("a static after it");
    let (first, after) = (name(&first), name(&after));
    let file = tempfile::NamedTempFile::new().expect("a file");
    let bits = std::env::var(BITS).map_or(FEW_BITS, |bits| bits.parse().expect("a number"));
    assert!(bits >= FEW_BITS, "{BITS} is {bits}; of fewer than {FEW_BITS} bits the check may find none");
    let group = format!(
        "[[memory]]\nname = \"loop\"\nsymbols = [\"{first}\", \"{after}\"]\ncount = {bits}\nstates = [\"walking\"]\n"
    );
    std::fs::write(file.path(), format!("{}{group}", head())).expect("written");
    let outcome = campaign::run(file.path(), "walk", &["--every", "20"]);
    assert_good(&outcome);
    let refused = outcome.cases.iter().filter(|case| case["says"] == "fault (outputs)").count();
    report!("{} bits, {refused} of them found by the check, none makes a wrong pulse", outcome.cases.len());
    assert_eq!(outcome.cases.len(), bits);
    assert!(refused >= 3, "{refused}");
}

/// Limits within which no walk fits, and reactions that do not come.
fn wrong_limits_and_wrong_reactions_are_noticed() {
    let head = head();
    let fault = |inject: &str, expect: &str| {
        format!("{head}[[fault]]\nname = \"a\"\ninject = {inject}\nstates = [\"walking\"]\nexpect = {{ {expect} }}\n")
    };
    let file = tempfile::NamedTempFile::new().expect("a file");
    let none = "reaction = \"none\", within_ms = 100";
    for (text, words) in [
        (fault("\"overrun\"", none).replace("least_us = [1166.6,", "least_us = [2100.0,"), "is outside 2100"),
        (fault("\"overrun\"", none).replace("us_per_s = [5555.7,", "us_per_s = [50.0,"), "us in 20.0 ms"),
        (fault("\"overrun\"", "reaction = \"off\", within_ms = 100"), "outputs off never"),
        (fault("\"panic\"", none), "allowed: none in 100 ms"),
        (
            fault("{ hang = \"telemetry_step\" }", "reaction = \"reset\", boot = \"iwdg\", within_ms = 2"),
            "allowed: reset in 2 ms",
        ),
        (
            fault(
                "\"panic\"",
                "reaction = [\"reset\", \"off\"], boot = \"panic\", within_ms = 100, reset_within_ms = 0.001",
            ),
            "allowed are 0.001 ms",
        ),
        // A stop by a ramp is not nothing, though the outputs are still on at the end.
        (fault("{ volts = { pin = \"PA1\", volts = 0.0 } }", none), "the board says stopping (sensor_open)"),
        // A supply that is too low is none of these causes.
        (
            fault("{ supply = 2.0 }", "reaction = \"off\", within_ms = 60, cause = [\"outputs\", \"late\"]"),
            "says fault (supply); allowed causes: outputs, late",
        ),
        // Nothing happened, and nothing shows that there was a fault.
        (fault("{ rtt = \"byte\" }", "reaction = \"none\", within_ms = 100, counts = \"overruns\""), "did not count"),
        // The board goes on as before, but nobody hears of it: the transmitter is off.
        (fault("{ flip = { address = 0x4000_440C, mask = 8 } }", none), "the board reports nothing any more"),
        // The model has no such bits.
        (fault("{ flip = { address = 0x4001_0030, mask = 0x10000 } }", none), "are as before"),
        (
            fault(
                "{ hang = \"control_step\" }",
                "reaction = \"reset\", boot = \"iwdg\", within_ms = 38, decided_within_us = 10",
            ),
            "supply or main output off after",
        ),
        (
            fault("\"panic\"", "reaction = \"reset\", boot = \"panic\", within_ms = 4, low_within_ms = 0.001"),
            "pulses end after",
        ),
    ] {
        std::fs::write(file.path(), text).expect("written");
        let outcome = campaign::run(file.path(), "walk", &[]);
        assert_eq!(outcome.code, Some(1), "{words}");
        let whys: Vec<&str> = outcome.cases.iter().filter_map(|case| case["why"].as_str()).collect();
        assert!(whys.iter().any(|why| why.contains(words)), "{words}: {whys:?}");
    }
}

/// At rest the outputs are off whatever happens: the state that the board reports is what can be wrong.
fn a_wrong_reaction_at_rest_is_noticed() {
    let fault = |inject: &str, state: &str, expect: &str| {
        format!(
            "{}[[fault]]\nname = \"a\"\ninject = {inject}\nstates = [\"{state}\"]\nexpect = {{ {expect} }}\n",
            head()
        )
    };
    let bit = "{ flip = { address = 0x4001_002C, mask = 4 } }";
    let file = tempfile::NamedTempFile::new().expect("a file");
    for (text, words) in [
        (fault(bit, "disarmed", "reaction = \"none\", within_ms = 20"), Some("says fault (outputs)")),
        (
            fault(bit, "disarmed", "reaction = \"fault\", within_ms = 20, cause = \"supply\""),
            Some("allowed causes: supply"),
        ),
        (fault(bit, "disarmed", "reaction = \"fault\", within_ms = 20, cause = \"outputs\""), None),
        (fault(bit, "fault", "reaction = \"fault\", within_ms = 20, cause = \"outputs\""), None),
        (
            fault("\"overrun\"", "disarmed", "reaction = \"fault\", within_ms = 20, cause = \"outputs\""),
            Some("allowed: fault"),
        ),
        // It is in the state `fault` already: only a record shows another fault.
        (
            fault("\"overrun\"", "fault", "reaction = \"fault\", within_ms = 20, cause = \"outputs\""),
            Some("allowed: fault"),
        ),
    ] {
        std::fs::write(file.path(), text).expect("written");
        let outcome = campaign::run(file.path(), "walk", &[]);
        assert_eq!(
            (outcome.code, outcome.cases.len()),
            (Some(i32::from(words.is_some())), 20),
            "{words:?}: {:?}",
            outcome.cases
        );
        for why in words.iter().flat_map(|_| &outcome.cases).map(|case| case["why"].as_str().unwrap_or_default()) {
            assert!(words.is_some_and(|words| why.contains(words)), "{words:?}: {why}");
        }
    }
}

/// An `off` of the state `stopping` comes before the outputs go off without a fault: 0.7 s after the state's time.
fn an_off_of_a_stop_is_not_its_own_end() {
    const MOST_MS: f64 = 600.0;
    let number = |value: &toml::Value| value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64));
    let has = |value: Option<&toml::Value>, word: &str| match value {
        Some(toml::Value::Array(all)) => all.iter().any(|one| one.as_str() == Some(word)),
        Some(one) => one.as_str() == Some(word),
        None => false,
    };
    let mut looked_at = 0;
    for (kind, list) in table() {
        for one in list.as_array().into_iter().flatten() {
            let Some(expect) = one.get("expect").filter(|expect| has(expect.get("reaction"), "off")) else { continue };
            if has(one.get("states"), "stopping") {
                let most = expect.get("within_ms").and_then(number);
                assert!(most.is_some_and(|ms| ms <= MOST_MS), "{kind} {:?}: {most:?} ms", one.get("name"));
                looked_at += 1;
            }
        }
    }
    assert!(looked_at > 20, "{looked_at}");
}

/// A board that never arms would pass every case, and in another state the cases are those of that state.
fn a_state_that_is_not_as_declared_ends_the_campaign() {
    let text = std::fs::read_to_string(faults_file()).expect("the file");
    let file = tempfile::NamedTempFile::new().expect("a file");
    // Without its press the board walks in `stopping`; with a late emergency stop `fault` is the rest after that press; a damaged request begins no
    // trim.
    for (run, with, without, says) in [
        ("walk", ", { at_s = 4.8, hold_s = 0.1 }", "", "state `stopping` at 5.1 s: the board says `walking (none)`"),
        (
            "walk",
            "{ at_s = 7.0, hold_s",
            "{ at_s = 20.0, hold_s",
            "state `fault` at 7.5 s: the board says `disarmed (button)`",
        ),
        ("trim", "040901fe05", "040901fe06", "state `trim ready` at 0.3 s: the board says `disarmed (none)`"),
    ] {
        let changed = text.replace(with, without);
        assert_ne!(changed, text);
        std::fs::write(file.path(), changed).expect("written");
        let outcome = campaign::run(file.path(), run, &["--every", "1000"]);
        assert_eq!(outcome.code, Some(2));
        assert!(outcome.said.contains(says), "{}", outcome.said);
    }
    // The board is not armed in it.
    let unarmed = text.replace("hold_s = 0.35", "hold_s = 0.1");
    assert_ne!(unarmed, text);
    std::fs::write(file.path(), unarmed).expect("written");
    let outcome = campaign::run(file.path(), "walk", &["--every", "1000"]);
    assert_eq!(outcome.code, Some(2));
    assert!(
        outcome.said.contains("state `arming` at 1.5 s: the outputs are off, the file says on"),
        "{}",
        outcome.said
    );
    // Nor has a run without its name, or one that the file does not have.
    let unknown = campaign::run(&faults_file(), "flying", &[]);
    assert!(
        unknown.said.contains("there is no run `flying`; the file has walk, trim, untested, follower, crashes"),
        "{}",
        unknown.said
    );
}

/// A control task that hangs while something else switches outputs and supply on: no hold of the button armed these pulses.
fn pulses_that_no_hold_armed_are_noticed() {
    let at = |at_s: f64, what: &str| format!("{{ at_s = {at_s}, what = {{ {what} }} }}");
    let injects = [
        // Nothing resets the board meanwhile.
        at(0.001, "lsi = 0"),
        at(0.001, "hang = \"control_step\""),
        // The width of the left hip, the main output enable, the supply of the servos.
        at(0.003, "write = { address = 0x4001_0034, value = 1500 }"),
        at(0.003, "flip = { address = 0x4001_0044, mask = 0x8000 }"),
        at(0.003, "write = { address = 0x4002_0818, value = 0x100 }"),
    ];
    let text = format!(
        "{}[[sequence]]\nname = \"a\"\nstate = \"disarmed\"\nlasts_s = 0.1\ninject = [{}]\n",
        head(),
        injects.join(", ")
    );
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), text).expect("written");
    let outcome = campaign::run(file.path(), "walk", &[]);
    assert_eq!((outcome.code, outcome.cases.len()), (Some(1), 1), "{}\n{:?}", outcome.said, outcome.cases);
    let why = outcome.cases[0]["why"].as_str().expect("a reason");
    assert!(why.contains("no hold of the button armed it"), "{why}");
    let drives = outcome.cases[0]["drives_s"].as_array().expect("times").len();
    assert_eq!(drives, 1, "{:?}", outcome.cases);
}
