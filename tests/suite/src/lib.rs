//! Test programs whose tests are ignored, with the reason, where something that they need is missing.
//!
//! libtest decides at compile time which tests are ignored. A program that needs an image, the virtual board or recordings is built with
//! `harness = false` and calls [`run`], which accepts the arguments of libtest (filters, `--list`, `--include-ignored`, ...). For each
//! ignored test one line is written to standard error: `ignored: NAME: REASON`. `FOOTFALL_REQUIRE` names what must be there, with commas
//! between the names ([`Need::name`], or `all`): a test that lacks it fails instead. With `FOOTFALL_IMAGES_ALONE` only the tests that need an
//! image or the host tool are in the list: the step `host-tests` runs the others.
#![forbid(unsafe_code)]

pub mod terminal;

use std::fmt::Arguments as Text;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};

use libtest_mimic::{Arguments, Trial};

/// The variable that makes needs required.
const REQUIRE: &str = "FOOTFALL_REQUIRE";

/// The variable that leaves out tests of the host alone.
const IMAGES_ALONE: &str = "FOOTFALL_IMAGES_ALONE";

/// The flashed image, the image that drives nothing, that without a sensor and a debugger, that of the Black Pill, the program that runs them, and the host tool.
const ELF: &str = "FOOTFALL_ELF";
const SHADOW_ELF: &str = "FOOTFALL_SHADOW_ELF";
const NO_SENSOR_ELF: &str = "FOOTFALL_NO_SENSOR_ELF";
const BLACK_PILL_ELF: &str = "FOOTFALL_BLACK_PILL_ELF";
/// The image of the Raspberry Pi Pico, and the file that its boot loader takes.
const PICO_ELF: &str = "FOOTFALL_PICO_ELF";
const PICO_UF2: &str = "FOOTFALL_PICO_UF2";
/// The folder of the files that the commands of docs/pico.md have written.
const PICO_FIRST_WALK: &str = "FOOTFALL_PICO_FIRST_WALK";
const VIRTUAL_BOARD: &str = "FOOTFALL_VIRTUAL_BOARD";
const PROGRAM: &str = "FOOTFALL_BIN";

/// The folder that has probe-rs.
const PROBE_RS: &str = "FOOTFALL_PROBE_RS";

/// Python, with the packages of `tools/footfall/tests/python/requirements.txt`.
const PYTHON: &str = "FOOTFALL_PYTHON";

/// Names another folder of recordings.
const TRACES: &str = "FOOTFALL_TRACES";

/// Whether [`report`] prints.
static REPORTS: AtomicBool = AtomicBool::new(false);

/// Something from outside the repository that a test cannot do without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// The image that would be flashed, and the virtual board.
    Image,
    /// The image that drives no servo pin, and the virtual board.
    ShadowImage,
    /// The image of the features `no-sensor` and `no-debugger`, and the virtual board.
    NoSensorImage,
    /// The image of the Black Pill, and the virtual board.
    BlackPillImage,
    /// The images of the Discovery and of the Black Pill as files, which the test only reads.
    ImageFiles,
    /// Images of the Raspberry Pi Pico, Node.js, and the packages of `firmware-rp2040/emulator`.
    PicoImage,
    /// The host tool `footfall` as a program.
    Program,
    /// The folder of recordings beside the checkout.
    Traces,
    /// The program `probe-rs`.
    ProbeRs,
    /// The program `script` of util-linux, which runs another one at a terminal.
    Terminal,
    /// Python, with packages.
    Python,
    /// The program `gdb-multiarch`.
    Debugger,
    /// The folder of other programs' files beside that of the recordings.
    Wild,
}

impl Need {
    /// The name in `FOOTFALL_REQUIRE`, which are those of `cargo xtask`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Image
            | Self::ShadowImage
            | Self::NoSensorImage
            | Self::BlackPillImage
            | Self::ImageFiles
            | Self::Program => "virtual-board",
            Self::Traces | Self::Wild => "traces",
            Self::PicoImage => "node",
            Self::Terminal => "terminal",
            Self::Python => "python",
            Self::ProbeRs | Self::Debugger => "probe",
        }
    }

    /// Whether it is an image or the host tool, which the step `host-tests` has not.
    fn is_built_apart(self) -> bool {
        !matches!(self, Self::Traces | Self::Wild | Self::Terminal | Self::Python | Self::Debugger)
    }

    /// What is missing and what to do; `None` if it is there.
    #[must_use]
    pub fn missing(self) -> Option<String> {
        let variables: &[&str] = match self {
            Self::Image => &[ELF, VIRTUAL_BOARD],
            Self::ShadowImage => &[SHADOW_ELF, VIRTUAL_BOARD],
            Self::NoSensorImage => &[NO_SENSOR_ELF, VIRTUAL_BOARD],
            Self::BlackPillImage => &[BLACK_PILL_ELF, VIRTUAL_BOARD],
            Self::ImageFiles => &[ELF, BLACK_PILL_ELF],
            Self::PicoImage => &[PICO_ELF, PICO_UF2, PICO_FIRST_WALK],
            Self::Program => &[PROGRAM],
            Self::ProbeRs => &[PROBE_RS],
            Self::Python => &[PYTHON],
            Self::Traces | Self::Wild => {
                let folder = if self == Self::Wild { wild_folder() } else { traces_folder() };
                let which = if self == Self::Wild { "the folder beside `wild`" } else { "another folder" };
                let words = || format!("no recordings in {}; {TRACES} names {which}", folder.display());
                return (!folder.is_dir()).then(words);
            }
            Self::Debugger => {
                let version = Command::new("gdb-multiarch").arg("--version").stdin(Stdio::null()).output();
                let words = || "no program `gdb-multiarch`; the package of this name has it".to_owned();
                return version.is_err().then(words);
            }
            Self::Terminal => {
                // Other systems have a `script` with other options.
                let version = Command::new("script").arg("--version").stdin(Stdio::null()).output();
                let is_ours = |output: Output| String::from_utf8_lossy(&output.stdout).contains("util-linux");
                let words = || "no program `script` of util-linux, which makes a terminal".to_owned();
                return (!version.is_ok_and(is_ours)).then(words);
            }
        };
        let unset: Vec<&str> = variables.iter().copied().filter(|name| std::env::var_os(name).is_none()).collect();
        let verb = if unset.len() == 1 { "is" } else { "are" };
        (!unset.is_empty()).then(|| format!("{} {verb} not set; `cargo xtask test` sets them", unset.join(" and ")))
    }
}

/// The `probe-rs` of [`Need::ProbeRs`].
#[must_use]
pub fn probe_rs() -> PathBuf {
    std::env::var_os(PROBE_RS).map_or_else(|| "probe-rs".into(), |folder| Path::new(&folder).join("probe-rs"))
}

/// The Python of [`Need::Python`].
#[must_use]
pub fn python() -> PathBuf {
    std::env::var_os(PYTHON).map_or_else(|| "python3".into(), PathBuf::from)
}

/// The folder of recordings beside the checkout, which may be missing: `FOOTFALL_TRACES`, relative to the root of the workspace, or
/// `../shared/traces`.
#[must_use]
pub fn traces_folder() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap_or(Path::new("."));
    let beside = || root.parent().unwrap_or(root).join("shared/traces");
    std::env::var_os(TRACES).map_or_else(beside, |folder| root.join(folder))
}

/// The folder of other programs' files, which may be missing: `wild` beside [`traces_folder`].
#[must_use]
pub fn wild_folder() -> PathBuf {
    traces_folder().parent().unwrap_or(Path::new(".")).join("wild")
}

/// A test, as [`tests!`] makes it.
#[derive(Debug, Clone, Copy)]
pub struct Test {
    /// The name of the function.
    pub name: &'static str,
    /// What it needs.
    pub needs: &'static [Need],
    /// Panics if the test fails.
    pub function: fn(),
}

impl Test {
    fn needs_what_is_built_apart(&self) -> bool {
        self.needs.iter().any(|need| need.is_built_apart())
    }
}

/// A list of tests: functions, each with its needs.
///
/// ```
/// use test_suite::{Need, tests};
///
/// fn addition_is_commutative() {
///     assert_eq!(1 + 2, 2 + 1);
/// }
///
/// fn every_recording_is_read() {}
///
/// let list = tests![addition_is_commutative(), every_recording_is_read(Traces)];
/// assert_eq!((list[0].name, list[0].needs), ("addition_is_commutative", &[][..]));
/// assert_eq!((list[1].name, list[1].needs), ("every_recording_is_read", &[Need::Traces][..]));
/// ```
#[macro_export]
macro_rules! tests {
    ($($name:ident($($need:ident),*)),* $(,)?) => {
        [$($crate::Test { name: stringify!($name), needs: &[$($crate::Need::$need),*], function: $name }),*]
    };
}

/// Prints a line on standard error if the program was called with `--nocapture`: measured numbers of a test that passes.
#[macro_export]
macro_rules! report {
    ($($text:tt)*) => { $crate::print_report(format_args!($($text)*)) };
}

#[doc(hidden)]
pub fn print_report(line: Text<'_>) {
    if REPORTS.load(Ordering::Relaxed) {
        eprintln!("{line}");
    }
}

/// Runs the tests that the command line selects. The exit code is 0 if none fails, otherwise 101.
#[must_use]
pub fn run(tests: impl IntoIterator<Item = Test>) -> ExitCode {
    let arguments = Arguments::from_args();
    REPORTS.store(arguments.nocapture || arguments.show_output, Ordering::Relaxed);
    let required = std::env::var(REQUIRE).unwrap_or_default();
    let images_alone = std::env::var_os(IMAGES_ALONE).is_some();
    let mut trials = Vec::new();
    for test in tests.into_iter().filter(|test| !images_alone || test.needs_what_is_built_apart()) {
        let missing = missing(test.needs, Need::missing, &required);
        let (reason, ignored) = match &missing {
            Some(missing) => (Some(missing.reason.clone()), !missing.required),
            None => (None, false),
        };
        let run = move || match reason {
            Some(reason) => Err(reason.into()),
            None => {
                (test.function)();
                Ok(())
            }
        };
        let trial = Trial::test(test.name, run).with_ignored_flag(ignored);
        let selected = !arguments.list && !arguments.is_filtered_out(&trial) && arguments.is_ignored(&trial);
        if let Some(missing) = missing.filter(|_| selected) {
            eprintln!("ignored: {}: {}", test.name, missing.reason);
        }
        trials.push(trial);
    }
    libtest_mimic::run(&arguments, trials).exit_code()
}

/// What a test lacks.
#[derive(Debug, PartialEq, Eq)]
struct Missing {
    reason: String,
    /// Whether `FOOTFALL_REQUIRE` names one of the missing needs.
    required: bool,
}

/// The needs that are missing. `required` is the value of `FOOTFALL_REQUIRE`; `cargo xtask` refuses names that it does not have.
fn missing(needs: &[Need], is_missing: impl Fn(Need) -> Option<String>, required: &str) -> Option<Missing> {
    let named = |need: Need| required.split(',').map(str::trim).any(|name| name == need.name() || name == "all");
    let mut reasons = Vec::new();
    let mut is_required = false;
    for &need in needs {
        if let Some(reason) = is_missing(need) {
            let wanted = if named(need) { format!("{REQUIRE} names `{}`: {reason}", need.name()) } else { reason };
            reasons.push(wanted);
            is_required |= named(need);
        }
    }
    (!reasons.is_empty()).then(|| Missing { reason: reasons.join("; "), required: is_required })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn without(gone: Need) -> impl Fn(Need) -> Option<String> {
        move |need| (need == gone).then(|| "not here".to_owned())
    }

    #[test]
    fn tests_of_the_host_alone_need_nothing_built_apart() {
        let test = |needs| Test { name: "a", needs, function: || () };
        assert!(
            test(&[Need::Traces, Need::Image]).needs_what_is_built_apart()
                && test(&[Need::Program]).needs_what_is_built_apart()
        );
        assert!(
            !test(&[]).needs_what_is_built_apart()
                && !test(&[Need::Traces, Need::Terminal]).needs_what_is_built_apart()
        );
    }

    #[test]
    fn nothing_is_missing_of_what_is_there() {
        assert_eq!(missing(&[], without(Need::Image), "all"), None);
        assert_eq!(missing(&[Need::Traces], without(Need::Image), "all"), None);
    }

    #[test]
    fn a_missing_need_has_a_reason() {
        let found = missing(&[Need::Image, Need::Traces], without(Need::Traces), "").unwrap();
        assert_eq!(found, Missing { reason: "not here".to_owned(), required: false });
    }

    #[test]
    fn a_missing_need_is_required_by_its_name() {
        for (list, required) in [("traces", true), ("node, traces", true), ("all", true), ("virtual-board", false)] {
            let found = missing(&[Need::Traces], without(Need::Traces), list).unwrap();
            assert_eq!(found.required, required, "{list}");
            assert_eq!(found.reason.starts_with("FOOTFALL_REQUIRE names `traces`: "), required, "{}", found.reason);
        }
    }
}
