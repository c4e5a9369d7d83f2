//! Campaigns of faults on the virtual board: the file of the project, or one that a test makes.

use crate::recordings::default_volts_file;
use firmware::board::{GENERATOR_SECTOR, ROBOT_SECTOR};
use generator_file::file::GeneratorFile;
use joint_loop::store::{generator_record, robot_record};
use joint_loop::{RecordName, RobotConfig};
use serde_json::Value;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The file of the project.
#[must_use]
pub fn faults_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("campaign/faults.toml")
}

/// The file of the general registers of the core, which are no part of the campaign.
#[must_use]
pub fn registers_file() -> PathBuf {
    faults_file().with_file_name("registers.toml")
}

/// What of it is before the faults: limits, runs, states.
///
/// # Panics
/// The file is not as it should be.
#[must_use]
pub fn head() -> String {
    let text = std::fs::read_to_string(faults_file()).expect("the file");
    text.split_once("# ---- The program").expect("a head").0.to_owned()
}

/// What came of a campaign: a line for each case, and the last one.
#[derive(Debug)]
pub struct Outcome {
    /// The cases.
    pub cases: Vec<Value>,
    /// The last line; `None` if the campaign could not be run.
    pub end: Option<Value>,
    /// The exit code.
    pub code: Option<i32>,
    /// What it said about errors.
    pub said: String,
}

impl Outcome {
    /// The cases that are not as declared.
    #[must_use]
    pub fn wrong(&self) -> Vec<&Value> {
        self.cases.iter().filter(|case| case["good"] != true).collect()
    }
}

/// The virtual board with a run of a campaign on the flashed image, the default robot and these options. The run `follower` has its generator. What is
/// flashed is in the folder, which must stay until the end.
///
/// # Panics
/// The environment does not name image and virtual board.
#[must_use]
pub fn command(file: &Path, run: &str, options: &[&str]) -> (Command, tempfile::TempDir) {
    let path = |name: &str| std::env::var_os(name).unwrap_or_else(|| panic!("{name}"));
    let folder = tempfile::tempdir().expect("a folder");
    let flash = |name: &str, sector: u32, bytes: &[u8]| {
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).expect("written");
        ["--flash".into(), OsString::from(format!("{sector:#010x}={}", file.display()))]
    };
    let robot = robot_record::record_of(&RobotConfig::default_biped(), &RecordName::BUILT_IN);
    let mut command = Command::new(path("FOOTFALL_VIRTUAL_BOARD"));
    command.arg(path("FOOTFALL_ELF")).args(["--loop", "--volts"]).arg(default_volts_file());
    command.args(flash("robot.bin", ROBOT_SECTOR, robot.bytes()));
    if run == "follower" {
        let file = GeneratorFile::read(&faults_file().with_file_name("follower.toml")).expect("the follower");
        let record = generator_record::record_of(&file.set.config(), &RecordName::BUILT_IN);
        command.args(flash("generator.bin", GENERATOR_SECTOR, record.bytes()));
    }
    command.arg("--campaign").arg(file).args(["--run", run]).args(options);
    (command, folder)
}

/// Runs a run of a campaign.
///
/// # Panics
/// As [`command`], or the virtual board writes what cannot be read.
#[must_use]
pub fn run(file: &Path, run: &str, options: &[&str]) -> Outcome {
    let (mut command, _folder) = command(file, run, options);
    let output = command.output().expect("it starts");
    let text = String::from_utf8(output.stdout).expect("text");
    let mut cases: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).expect("an object")).collect();
    let end = cases.pop_if(|line| line["type"] == "end");
    Outcome { cases, end, code: output.status.code(), said: String::from_utf8_lossy(&output.stderr).into_owned() }
}
