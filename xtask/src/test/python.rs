//! Environments of Python, the wheel of the package `footfall`, and its tests.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use super::counts::Counts;
use crate::shell::{self, Stream};

/// An environment of Python with packages of its own.
pub(super) struct Environment {
    python: PathBuf,
}

impl Environment {
    /// Makes the environment in a folder, or finds it there.
    pub(super) fn open(folder: &Path) -> Result<Environment> {
        shell::must_succeed(shell::command("python3").args(["-m", "venv"]).arg(folder), "python3 -m venv")?;
        Ok(Environment { python: folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" }) })
    }

    /// Makes the environment in a folder, without what an earlier one had.
    fn fresh(folder: &Path) -> Result<Environment> {
        if folder.is_dir() {
            std::fs::remove_dir_all(folder).with_context(|| format!("removing {}", folder.display()))?;
        }
        Environment::open(folder)
    }

    /// Its Python.
    pub(super) fn python(&self) -> &Path {
        &self.python
    }

    /// Installs packages, from the network where they are not yet installed; `what` are the arguments of `pip install`.
    pub(super) fn install<S: AsRef<OsStr>>(&self, what: &[S]) -> Result<()> {
        let mut install = shell::command(&self.python);
        // Python compiles the modules that are imported, which are a small part of all.
        install.args(["-m", "pip", "install", "--quiet", "--no-compile"]).args(what);
        shell::must_succeed(&mut install, "pip install")
    }

    /// Builds the wheel of the package into an empty folder, and installs it here. Its crates are those of the host tests.
    pub(super) fn install_wheel(&self, wheels: &Path) -> Result<PathBuf> {
        if wheels.is_dir() {
            std::fs::remove_dir_all(wheels).with_context(|| format!("removing {}", wheels.display()))?;
        }
        let mut build = shell::command(&self.python);
        build.args(["-m", "maturin", "build", "--locked", "--manifest-path", "python/Cargo.toml", "--profile", "dev"]);
        build.args(["--interpreter"]).arg(&self.python).arg("--out").arg(wheels);
        shell::must_succeed(&mut build, "maturin build")?;
        let mut found = std::fs::read_dir(wheels).with_context(|| format!("reading {}", wheels.display()))?;
        let wheel = found.next().context("maturin wrote no wheel")??.path();
        self.install(&["--force-reinstall".as_ref(), "--no-deps".as_ref(), wheel.as_os_str()])?;
        Ok(wheel)
    }

    /// Runs tests of the package.
    pub(super) fn test(&self, arguments: &[&str], variables: &[(&str, &OsStr)]) -> Result<Counts> {
        let mut pytest = shell::command(&self.python);
        pytest.args(["-m", "pytest", "-p", "no:cacheprovider", "--rootdir", "python"]).args(arguments);
        pytest.envs(variables.iter().copied());
        let mut counts = Counts::default();
        let status = shell::each_line(&mut pytest, |stream, line| {
            eprintln!("{line}");
            if stream == Stream::Output {
                counts = counts_in(line).unwrap_or(std::mem::take(&mut counts));
            }
        })?;
        ensure!(status.success(), "the tests of the Python package failed ({status})");
        Ok(counts)
    }
}

/// Installs the wheel into a fresh environment with what it asks for, and steps a generator there.
pub(super) fn works_alone(wheel: &Path, folder: &Path) -> Result<()> {
    let environment = Environment::fresh(folder)?;
    environment.install(&[wheel])?;
    let program = "import footfall; assert footfall.Generator.default().run(1.0).angles_rad.shape == (1000, 4)";
    shell::must_succeed(
        shell::command(environment.python()).args(["-c", program]),
        "the package in a fresh environment",
    )
}

/// The counts in the last line of pytest: `== 267 passed, 10 skipped, 1 warning in 90.1s ==`; `None` for another line.
fn counts_in(line: &str) -> Option<Counts> {
    let words: Vec<&str> = line.trim_matches(['=', ' ']).split([' ', ',']).filter(|word| !word.is_empty()).collect();
    let count = |what: &str| {
        let place = words.iter().position(|word| *word == what)?;
        words.get(place.checked_sub(1)?)?.parse().ok()
    };
    if !words.contains(&"in") {
        return None;
    }
    let (passed, ignored) = (count("passed"), count("skipped"));
    (passed.is_some() || ignored.is_some()).then(|| Counts {
        passed: passed.unwrap_or_default(),
        ignored: ignored.unwrap_or_default(),
        ..Counts::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_line_of_pytest_is_counted() {
        let counts = |line| counts_in(line).map(|counts| (counts.passed, counts.ignored));
        assert_eq!(counts("===== 267 passed, 10 skipped, 1 warning in 90.10s (0:01:30) ====="), Some((267, 10)));
        assert_eq!(counts("10 passed in 24.82s"), Some((10, 0)));
        assert_eq!(counts("== 3 skipped in 0.1s =="), Some((0, 3)));
        assert_eq!(counts("tests/test_loop.py ......                 [100%]"), None);
        assert_eq!(counts("the study passed in time"), None);
    }
}
