//! Boots of the flashed image on the virtual board: every cause of a reset, crashes before it, damaged parameter sectors, buttons that are held. No edge at
//! a servo pin before a gesture that arms, and the log says why the board booted.

use firmware::board::{GENERATOR_SECTOR, ROBOT_SECTOR, SENSORS_SECTOR};
use firmware_shared::post_mortem::LOCKOUT_STREAK;
use footfall::board::image::Image;
use footfall_tests::board::Board;
use footfall_tests::boot_log::BootLog;
use footfall_tests::campaign::{self, head};
use footfall_tests::recordings::default_volts_file;
use joint_loop::store::robot_record;
use joint_loop::{RecordName, RobotConfig};
use serde_json::Value;
use std::fmt::Write as _;
use std::process::ExitCode;
use test_suite::{report, tests};
use wire::{Reset, Subject};

/// Boots without `FOOTFALL_BOOTS`.
const SAMPLE: usize = 1_000;
/// States of the run `crashes`: so many crashes in a row before.
const CRASHES: [&str; 5] = ["no crash", "one crash", "two crashes", "three crashes", "four crashes"];
/// Causes of a reset: in the file of a campaign, and as the board has to report them.
const CAUSES: [(&str, Reset); 7] = [
    ("power-on", Reset::PowerOn),
    ("pin", Reset::Pin),
    ("brown-out", Reset::BrownOut),
    ("watchdog", Reset::IndependentWatchdog),
    ("window-watchdog", Reset::WindowWatchdog),
    ("software", Reset::Software),
    ("low-power", Reset::LowPower),
];

fn main() -> ExitCode {
    test_suite::run(tests![
        no_boot_moves_a_pin_and_each_says_why(Image),
        a_hold_through_a_boot_arms_nothing(Image),
        a_boot_with_a_gesture_arms(Image),
        a_long_row_of_crashes_stays_locked_until_a_person_acts(Image),
        a_supply_that_drops_again_and_again_moves_no_pin_by_itself(Image),
        every_supply_of_a_discovery_starts_and_walks(Image),
        a_supply_of_a_discovery_is_enough_for_level_2_and_not_always_for_level_3(Image),
    ])
}

/// What is wrong with the parameter sectors: the half-words that change, and what the board then refuses.
struct Damage {
    name: String,
    halves: Vec<(u32, u16)>,
    refused: Option<Subject>,
}

/// A sector without a record is erased: then one bit of it makes it a damaged one. The robot's has a record.
fn damages() -> Vec<Damage> {
    const LAST: u32 = 0x3FFE;
    let record = robot_record::record_of(&RobotConfig::default_biped(), &RecordName::BUILT_IN);
    let half = |at: usize| u16::from_le_bytes([record.bytes()[at], record.bytes()[at + 1]]);
    let end = record.bytes().len();
    let mut all = vec![Damage { name: "no damage".into(), halves: vec![], refused: None }];
    for (of, sector, refused) in [
        ("generator's sector", GENERATOR_SECTOR, Subject::GeneratorRecord),
        ("sensors' sector", SENSORS_SECTOR, Subject::SensorRecord),
    ] {
        for (what, at, half) in
            [("a bit at the end", LAST, 0x7FFF), ("half a magic word", 0, 0x4646), ("zeros", 0x100, 0)]
        {
            let name = format!("{what} of the {of}");
            all.push(Damage { name, halves: vec![(sector + at, half)], refused: Some(refused) });
        }
    }
    for (name, changes) in [
        ("the robot's magic word", vec![(0, !half(0))]),
        ("a bit of the robot's words", vec![(40, half(40) ^ 1)]),
        ("the robot's record is not committed", vec![(end - 4, 0xFFFF), (end - 2, 0xFFFF)]),
        ("a bit behind the robot's record", vec![(LAST as usize, 0x7FFF)]),
    ] {
        let halves = changes.into_iter().map(|(at, half)| (ROBOT_SECTOR + at as u32, half)).collect();
        all.push(Damage { name: name.into(), halves, refused: Some(Subject::RobotRecord) });
    }
    all
}

/// One boot.
struct Case<'a> {
    crashes: usize,
    cause: (&'static str, Reset),
    damage: &'a Damage,
    is_button_held: bool,
    is_stop_open: bool,
    is_sensor_open: bool,
}

impl Case<'_> {
    fn name(&self) -> String {
        format!(
            "{}, {}, {}, button {}, stop {}, sensor {}",
            CRASHES[self.crashes],
            self.cause.0,
            self.damage.name,
            self.is_button_held,
            self.is_stop_open,
            self.is_sensor_open
        )
    }

    /// As a sequence of a campaign: what is there before the reset, the reset, and the button's release 0.1 s after it.
    fn sequence(&self) -> String {
        let mut text = format!(
            "[[sequence]]\nname = \"{}\"\nstate = \"{}\"\nlasts_s = 0.16\nlog = true\n",
            self.name(),
            CRASHES[self.crashes]
        );
        if self.is_button_held {
            text += "press = [{ at_s = 0.001, hold_s = 0.104 }]\n";
        }
        let mut injects: Vec<String> = self
            .damage
            .halves
            .iter()
            .map(|(address, half)| format!("flash = {{ address = {address}, half = {half} }}"))
            .collect();
        injects.extend(self.is_stop_open.then(|| "level = { pin = \"PB12\", high = false }".into()));
        injects.extend(self.is_sensor_open.then(|| "volts = { pin = \"PA1\", volts = 0.0 }".into()));
        let injects: String = injects.iter().map(|what| format!("{{ at_s = 0.002, what = {{ {what} }} }}, ")).collect();
        let _ = writeln!(text, "inject = [{injects}{{ at_s = 0.005, what = {{ reset = \"{}\" }} }}]", self.cause.0);
        text
    }

    /// Crashes in a row that the board has to report: a person's hand ends the row, a watchdog adds to it.
    fn streak(&self) -> u32 {
        match self.cause.1 {
            Reset::PowerOn | Reset::Pin => 0,
            Reset::IndependentWatchdog | Reset::WindowWatchdog => self.crashes as u32 + 1,
            _ => self.crashes as u32,
        }
    }

    /// Compares what came with what has to come.
    fn check(&self, result: &Value, image: &Image) {
        let name = self.name();
        assert_eq!((&result["good"], &result["edges"]), (&Value::Bool(true), &Value::from(0)), "{name}: {result}");
        assert_eq!(result["drives_s"], serde_json::json!([]), "{name}");
        assert_eq!(result["resets"], serde_json::json!([self.cause.1.name()]), "{name}: one reset");
        let log = BootLog::read(&result["log"], image);
        let [boot] = &log.boots[..] else { panic!("{name}: {} boot records", log.boots.len()) };
        assert_eq!((boot.reset, boot.streak), (self.cause.1, self.streak()), "{name}");
        let mut wanted: Vec<Subject> =
            (self.streak() >= LOCKOUT_STREAK).then_some(Subject::Arming).into_iter().collect();
        wanted.extend(self.damage.refused);
        assert_eq!(log.refused, wanted, "{name}");
    }
}

fn cases(damages: &[Damage]) -> Vec<Case<'_>> {
    let mut all = Vec::new();
    for crashes in 0..CRASHES.len() {
        for cause in CAUSES {
            for damage in damages {
                for bits in 0..8 {
                    let [is_button_held, is_stop_open, is_sensor_open] = [1, 2, 4].map(|bit| bits & bit != 0);
                    all.push(Case { crashes, cause, damage, is_button_held, is_stop_open, is_sensor_open });
                }
            }
        }
    }
    all
}

fn no_boot_moves_a_pin_and_each_says_why() {
    let damages = damages();
    let all = cases(&damages);
    let count = std::env::var("FOOTFALL_BOOTS").map_or(SAMPLE, |count| count.parse().expect("a number of boots"));
    // The step has no divisor in common with the number of cases: each comes once, and a sample has some of all.
    const STEP: usize = 37;
    let chosen: Vec<&Case> = (0..count.min(all.len())).map(|n| &all[n * STEP % all.len()]).collect();
    let text = chosen.iter().fold(head(), |text, case| text + &case.sequence());
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), text).expect("written");
    let outcome = campaign::run(file.path(), "crashes", &[]);
    assert_eq!((outcome.code, outcome.cases.len()), (Some(0), chosen.len()), "{}", outcome.said);
    let image = Image::read(std::env::var_os("FOOTFALL_ELF").expect("FOOTFALL_ELF").as_ref()).expect("the image");
    for case in &chosen {
        let name = case.name();
        let mut of_it = outcome.cases.iter().filter(|result| result["name"] == name.as_str());
        case.check(of_it.next().expect("a result"), &image);
        assert!(of_it.next().is_none(), "{name}: once");
    }
    report!("{} of {} boots: no edge at a servo pin, each with its cause in the log", chosen.len(), all.len());
}

/// The button is held from before the reset on, for 0.3 to 1.5 s from the boot: its release is that of a hold which would arm. The board has not seen the
/// press; the emergency stop is not tested, tested before the boot, or tested during the hold.
fn a_hold_through_a_boot_arms_nothing() {
    const TESTS: [(&str, &str); 3] = [
        ("not tested", ""),
        ("tested before", "emergency_stop = [{ at_s = 0.002, hold_s = 0.025 }]\n"),
        ("tested in the hold", "emergency_stop = [{ at_s = 0.08, hold_s = 0.05 }]\n"),
    ];
    let mut text = head();
    let mut count = 0;
    for (cause, _) in CAUSES {
        for hold_s in [0.35, 0.7, 1.1, 1.45] {
            for (test, stop) in TESTS {
                let _ = write!(
                    text,
                    "[[sequence]]\nname = \"{cause}, {hold_s} s, {test}\"\nstate = \"no crash\"\nlasts_s = {}\n\
                     press = [{{ at_s = 0.001, hold_s = {} }}]\n{stop}\
                     inject = [{{ at_s = 0.04, what = {{ reset = \"{cause}\" }} }}]\n",
                    hold_s + 0.2,
                    hold_s + 0.04,
                );
                count += 1;
            }
        }
    }
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), text).expect("written");
    let outcome = campaign::run(file.path(), "crashes", &[]);
    assert_eq!((outcome.code, outcome.cases.len()), (Some(0), count), "{}", outcome.said);
    for result in &outcome.cases {
        assert_eq!((&result["good"], &result["edges"]), (&Value::Bool(true), &Value::from(0)), "{result}");
        assert_eq!(result["resets"].as_array().map(Vec::len), Some(1), "{result}");
    }
    report!("{count} boots with the button held through them: no edge at a servo pin");
}

/// What the test above looks for is there when it has to come.
fn a_boot_with_a_gesture_arms() {
    let text = head()
        + "[[sequence]]\nname = \"a\"\nstate = \"one crash\"\nlasts_s = 0.9\n\
           inject = [{ at_s = 0.005, what = { reset = \"pin\" } }]\n\
           emergency_stop = [{ at_s = 0.1, hold_s = 0.1 }]\npress = [{ at_s = 0.3, hold_s = 0.4 }]\n";
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), text).expect("written");
    let outcome = campaign::run(file.path(), "crashes", &[]);
    let result = &outcome.cases[0];
    assert!(result["edges"].as_u64() > Some(8), "{result}");
    let drives: Vec<f64> = result["drives_s"].as_array().expect("times").iter().filter_map(Value::as_f64).collect();
    assert!(drives.len() == 1 && (0.7..0.76).contains(&drives[0]), "{drives:?}");
}

/// From one event of a series to the next, s: time for the test of the stop, a hold that arms, and a piece of the ramp.
const APART_S: f64 = 0.8;

/// Options of a series: in the first `armed` boots the emergency stop is tested and the button held, and at the end of each this happens, as a script
/// has it.
fn series(events: usize, armed: usize, inject: &str, more: &str) -> (tempfile::NamedTempFile, Vec<String>) {
    let starts = (0..events).map(|n| APART_S * n as f64);
    let mut script = more.to_owned();
    for start in starts {
        let _ = writeln!(script, "[[event]]\nat_s = {}\n{inject}", start + APART_S);
    }
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), script).expect("written");
    let secs = APART_S * (events + 2) as f64;
    let mut options = vec!["--script".to_owned(), file.path().to_str().expect("text").to_owned()];
    options.extend(["--secs".into(), secs.to_string(), "--loop".into()]);
    options.extend(["--volts".into(), default_volts_file().to_str().expect("text").to_owned()]);
    for start in (0..armed).map(|n| APART_S * n as f64) {
        options.extend(["--emergency-stop".into(), format!("{:.3}:0.024", start + 0.06)]);
        options.extend(["--press".into(), format!("{:.3}:0.304", start + 0.1)]);
    }
    (file, options)
}

/// Twelve panics: the first three runs are armed by their holds, those after them are not; nor is the last one, which does not crash. Then the reset
/// button is pressed, and the next hold arms.
fn a_long_row_of_crashes_stays_locked_until_a_person_acts() {
    const CRASHES: usize = 12;
    let by_hand = APART_S * (CRASHES + 1) as f64;
    let reset = format!("[[event]]\nat_s = {}\ninject = \"reset-button\"\nfor_ms = 5\n", by_hand);
    let (_script, options) = series(CRASHES, CRASHES + 2, "inject = \"panic\"", &reset);
    let ran = Board::find().run(options);
    let boots: Vec<(Reset, u32)> = ran
        .boots
        .iter()
        .map(|boot| boot.boot.as_ref().map(|boot| (boot.reset, boot.streak)).expect("a boot record"))
        .collect();
    let mut expected = vec![(Reset::PowerOn, 0)];
    expected.extend((1..=CRASHES as u32).map(|streak| (Reset::Software, streak)));
    expected.push((Reset::Pin, 0));
    assert_eq!(boots, expected);
    let locked = APART_S * f64::from(LOCKOUT_STREAK);
    for n in 0..LOCKOUT_STREAK {
        let run = APART_S * f64::from(n)..APART_S * f64::from(n + 1);
        assert!(ran.pulses.iter().any(|(at, _)| run.contains(at)), "run {n} is armed by its hold");
    }
    let dark: Vec<f64> = ran.pulses.iter().map(|(at, _)| *at).filter(|at| (locked..by_hand).contains(at)).collect();
    assert_eq!(dark, [0.0; 0], "pulses after the lock-out");
    assert!(ran.pulses.iter().any(|(at, _)| *at > by_hand), "after the reset by hand a hold arms");
    report!(
        "{CRASHES} crashes in a row: armed {LOCKOUT_STREAK} times, then no pulse for {:.1} s, until the reset button",
        by_hand - locked
    );
}

/// Ten dips of the supply that reset the board, without a gesture after the first boot: each boot is disarmed and stays so, and none counts as a crash.
fn a_supply_that_drops_again_and_again_moves_no_pin_by_itself() {
    const DIPS: usize = 10;
    let (_script, options) = series(DIPS, 1, "inject = { vdd = 2.4 }\nfor_ms = 20", "");
    let ran = Board::find().run(options);
    let boots: Vec<(Reset, u32)> = ran
        .boots
        .iter()
        .map(|boot| boot.boot.as_ref().map(|boot| (boot.reset, boot.streak)).expect("a boot record"))
        .collect();
    let mut expected = vec![(Reset::PowerOn, 0)];
    expected.extend([(Reset::BrownOut, 0); DIPS]);
    assert_eq!(boots, expected);
    assert!(ran.pulses.iter().any(|(at, _)| *at < APART_S), "the first run is armed by its hold");
    let later: Vec<f64> = ran.pulses.iter().map(|(at, _)| *at).filter(|at| *at > APART_S).collect();
    assert_eq!(later, [0.0; 0], "pulses after the first dip");
    assert!(ran.boots[1..].iter().all(|boot| boot.ticks.iter().all(|tick| !tick.state.moving())));
}

/// Supplies that people measured at a Discovery, V: each starts at the board's level after the supply was away, arms by the next hold, and walks.
fn every_supply_of_a_discovery_starts_and_walks() {
    for volts in ["2.89", "2.93", "2.95", "3.00", "3.07"] {
        let (_script, mut options) = series(1, 2, "inject = { vdd = 1.0 }\nfor_ms = 20", "");
        options.extend(["--vdda", volts].map(str::to_owned));
        let ran = Board::find().run(options);
        let armed = |from_s: f64| ran.pulses.iter().any(|(at, _)| (from_s..from_s + APART_S).contains(at));
        assert!(armed(0.0) && armed(APART_S), "{volts} V: each run is armed by its hold");
        assert_eq!(ran.boots.iter().filter(|boot| boot.boot.is_some()).count(), 2, "{volts} V");
        let environment: Vec<_> = ran.boots.iter().flat_map(|boot| &boot.environment).collect();
        let seen = environment.iter().filter_map(|chip| chip.supply_v).next().expect("a supply");
        assert!((seen - volts.parse::<f32>().expect("a number")).abs() < 0.02, "{volts} V: {seen} V");
        assert!(environment.iter().all(|chip| chip.warnings == wire::Warnings::NONE), "{volts} V");
    }
}

/// The regulator of a Discovery behind its diode gives 2.89 to 3.07 V, and the thresholds of the brown-out reset have a spread (data sheet STM32F405/407,
/// VBOR2 and VBOR3): the rising one of level 3 is 2.85 to 2.97 V.
fn a_supply_of_a_discovery_is_enough_for_level_2_and_not_always_for_level_3() {
    let board = Board::find();
    let ticks = |level: &str, volts: &str, threshold: &str| {
        let options = ["--secs", "0.3", "--vdd", volts, "--brown-out-level", level, "--brown-out-threshold", threshold];
        let ran = board.run(options);
        assert_eq!((ran.end.resets.len(), ran.end.lints.len()), (0, 0), "{options:?}: {:?}", ran.end);
        ran.boots[0].ticks.len()
    };
    for volts in ["2.89", "2.95", "3.07"] {
        for threshold in ["min", "typical", "max"] {
            assert!(ticks("2", volts, threshold) > 10, "{volts} V, {threshold}");
        }
    }
    for (volts, threshold, starts) in [
        ("2.89", "min", true),
        ("2.89", "typical", false),
        ("2.95", "typical", true),
        ("2.95", "max", false),
        ("3.07", "max", true),
    ] {
        assert_eq!(ticks("3", volts, threshold) > 0, starts, "level 3 at {volts} V, {threshold}");
    }
}
