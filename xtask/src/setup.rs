//! What this computer lacks for a command, why it is needed, and its installation where we may: as root on Debian.
//! Everywhere else the exact command is printed and nothing is changed.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::shell;
use crate::toolchain::{self, Toolchain, Way};

/// Something that a command cannot do without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Need {
    /// A compiler for the board.
    Thumb,
    /// What the virtual board's Unicorn is built with.
    VirtualBoard,
    /// The second opinion on the core self-test.
    Qemu,
}

impl Need {
    pub(crate) const ALL: [Need; 3] = [Need::Thumb, Need::VirtualBoard, Need::Qemu];
}

/// This computer lacks something; the message says what to do about it. The program then exits with code 2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Incomplete(pub(crate) String);

impl std::fmt::Display for Incomplete {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Incomplete {}

/// One thing that is missing.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Missing {
    what: &'static str,
    why: &'static str,
    /// Debian's names.
    packages: Vec<&'static str>,
}

/// Makes the computer ready for `needs`; returns the toolchain for the board if that is one of them.
pub(crate) fn set_up(needs: &[Need], target_dir: &Path) -> Result<Option<Toolchain>> {
    let way = if needs.contains(&Need::Thumb) {
        let decision = toolchain::decide(&toolchain::facts()?).map_err(|refusal| Incomplete(refusal.to_owned()))?;
        Some(decision)
    } else {
        None
    };
    let debian_toolchain = way.as_ref().is_some_and(|decision| decision.way == Way::Debian);

    let missing = find_missing(needs, debian_toolchain);
    if !missing.is_empty() {
        for item in &missing {
            eprintln!("set-up: {} missing: {}", item.what, item.why);
        }
        install(&packages(&missing))?;
        if let Some(item) = find_missing(needs, debian_toolchain).first() {
            return Err(Incomplete(format!("{} still missing after the installation: {}", item.what, item.why)).into());
        }
        eprintln!("set-up: installed");
    }

    let Some(decision) = way else { return Ok(None) };
    let toolchain = match decision.way {
        Way::Debian => Toolchain::debian(target_dir)?,
        Way::Plain | Way::RustupAdd => Toolchain::active(decision.way)?,
    };
    eprintln!("toolchain: {} ({})", toolchain.describe(), decision.why);
    Ok(Some(toolchain))
}

fn find_missing(needs: &[Need], debian_toolchain: bool) -> Vec<Missing> {
    let mut missing = Vec::new();
    if debian_toolchain {
        let packages = toolchain::missing_debian_packages();
        if !packages.is_empty() {
            missing.push(Missing {
                what: "a compiler for the board is",
                why: "Debian's rustc, cargo, library source (all of one version) and linker build the firmware",
                packages,
            });
        }
    }
    if needs.contains(&Need::VirtualBoard) {
        let tool = |names: &[&str]| names.iter().any(|name| shell::on_path(name).is_some());
        if std::env::var_os("CC").is_none() && !tool(&["cc", "gcc", "clang", "cl"]) {
            missing.push(Missing {
                what: "a C compiler is",
                why: "the virtual board's Unicorn is written in C",
                packages: vec!["gcc", "libc6-dev"],
            });
        }
        if std::env::var_os("CMAKE").is_none() && !tool(&["cmake"]) {
            missing.push(Missing {
                what: "cmake is",
                why: "the virtual board's Unicorn is built with it",
                packages: vec!["cmake"],
            });
        }
        if !tool(&["make", "ninja", "nmake"]) {
            missing.push(Missing { what: "make is", why: "cmake builds with it", packages: vec!["make"] });
        }
        if !has_libclang() {
            missing.push(Missing {
                what: "libclang is",
                why: "the virtual board's binding to Unicorn is generated with it",
                packages: vec!["libclang-dev"],
            });
        }
    }
    if needs.contains(&Need::Qemu) && shell::on_path("qemu-system-arm").is_none() {
        missing.push(Missing {
            what: "qemu-system-arm is",
            why: "the core self-test is compared with a second, independent emulator",
            packages: vec!["qemu-system-arm"],
        });
    }
    missing
}

fn packages(missing: &[Missing]) -> Vec<&'static str> {
    missing.iter().flat_map(|item| item.packages.iter().copied()).collect()
}

/// libclang together with its headers: the library alone does not know `stddef.h`.
fn has_libclang() -> bool {
    if std::env::var_os("LIBCLANG_PATH").is_some() {
        return true;
    }
    if shell::on_path("dpkg-query").is_some() {
        let listing = shell::stdout_of(shell::command("dpkg-query").args([
            "-W",
            "-f=${db:Status-Abbrev}${Package}\n",
            "libclang*-dev",
        ]));
        return lists_libclang_dev(&listing.unwrap_or_default());
    }
    let mut folders: Vec<PathBuf> = [
        "/usr/lib",
        "/usr/lib64",
        "/usr/local/lib",
        "/opt/homebrew/opt/llvm/lib",
        "/usr/local/opt/llvm/lib",
        "/Library/Developer/CommandLineTools/usr/lib",
    ]
    .map(PathBuf::from)
    .to_vec();
    if let Ok(told) = shell::stdout_of(shell::command("llvm-config").arg("--libdir")) {
        folders.push(told.trim().into());
    }
    folders.iter().any(|folder| {
        let names = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
        names.into_iter().any(|name| is_libclang(&name.to_string_lossy()))
    })
}

/// `libclang-dev` or `libclang-14-dev`, not `libclang-common-14-dev` or `libclang-cpp14-dev`.
fn lists_libclang_dev(listing: &str) -> bool {
    listing.lines().filter_map(|line| line.strip_prefix("ii ")).any(|package| {
        let Some(middle) = package.strip_prefix("libclang").and_then(|rest| rest.strip_suffix("-dev")) else {
            return false;
        };
        middle.strip_prefix('-').map_or(middle.is_empty(), |version| version.bytes().all(|byte| byte.is_ascii_digit()))
    })
}

/// `libclang.so`, `libclang-14.so.1`, `libclang.dylib`; not `libclang-cpp.so`.
fn is_libclang(file: &str) -> bool {
    let Some(rest) = file.strip_prefix("libclang") else { return false };
    let rest = rest.strip_prefix('-').unwrap_or(rest).trim_start_matches(|c: char| c.is_ascii_digit());
    rest.starts_with(".so") || rest.starts_with(".dylib")
}

/// The command that a person would type.
fn apt_command(packages: &[&str]) -> String {
    format!("apt-get install --no-install-recommends {}", packages.join(" "))
}

fn install(packages: &[&'static str]) -> Result<()> {
    if shell::on_path("apt-get").is_none() {
        return Err(Incomplete(format!(
            "install what is missing and try again; Debian's names for it: {}",
            packages.join(" ")
        ))
        .into());
    }
    if !is_root()? {
        return Err(Incomplete(format!("install what is missing and try again: sudo {}", apt_command(packages))).into());
    }
    if !has_package_lists(Path::new("/var/lib/apt/lists")) {
        update()?;
    }
    if let Err(first) = apt_install(packages) {
        // Lists that are older than the archive name files which are gone from it.
        eprintln!("set-up: {first:#}; once more with fresh package lists");
        update()?;
        apt_install(packages).map_err(|error| {
            Incomplete(format!("{error:#} (its message is above); by hand: {}", apt_command(packages)))
        })?;
    }
    Ok(())
}

fn is_root() -> Result<bool> {
    let id = shell::stdout_of(shell::command("id").arg("-u")).context("asking who runs this")?;
    Ok(id.trim() == "0")
}

/// `apt-get update` was run once: there is a list of packages, compressed or not.
fn has_package_lists(folder: &Path) -> bool {
    let names = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
    names.into_iter().any(|name| name.to_string_lossy().contains("_Packages"))
}

fn apt() -> std::process::Command {
    let mut apt = shell::command("apt-get");
    // Another installation may be at work: wait for it. Nothing asks, and nothing is removed to make room.
    apt.env("DEBIAN_FRONTEND", "noninteractive").args([
        "-q",
        "-y",
        "-o",
        "DPkg::Lock::Timeout=300",
        "-o",
        "Dpkg::Use-Pty=0",
    ]);
    apt
}

fn update() -> Result<()> {
    eprintln!("set-up: apt-get update");
    shell::must_succeed(apt().arg("update"), "apt-get update")
}

fn apt_install(packages: &[&str]) -> Result<()> {
    eprintln!("set-up: {}", apt_command(packages));
    let mut apt = apt();
    apt.args(["install", "--no-install-recommends", "--no-remove"]).args(packages);
    shell::must_succeed(&mut apt, "apt-get install")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_libclang_without_headers_does_not_count() {
        assert!(lists_libclang_dev("ii libclang-14-dev\n"));
        assert!(lists_libclang_dev("un libclang-13-dev\nii libclang-dev\n"));
        assert!(!lists_libclang_dev("ii libclang-common-14-dev\nii libclang-cpp14-dev\n"));
        assert!(!lists_libclang_dev("rc libclang-14-dev\n"));
        assert!(!lists_libclang_dev(""));
    }

    #[test]
    fn libclang_by_its_file_names() {
        for name in ["libclang.so", "libclang.so.14", "libclang-14.so.1", "libclang.dylib"] {
            assert!(is_libclang(name), "{name}");
        }
        for name in ["libclang-cpp.so.14", "libclangAST.a", "libc.so", "libclang_rt.asan.a"] {
            assert!(!is_libclang(name), "{name}");
        }
    }

    #[test]
    fn package_lists_are_seen_compressed_or_not() {
        let folder = std::env::temp_dir().join(format!("xtask-lists-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        assert!(!has_package_lists(&folder));
        std::fs::write(folder.join("archive_dists_main_binary-amd64_Packages.lz4"), "").unwrap();
        let seen = has_package_lists(&folder);
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(seen);
        assert!(!has_package_lists(&folder), "a folder that is not there has no lists");
    }

    #[test]
    fn the_printed_command_names_every_package_once() {
        let missing = [
            Missing { what: "cmake is", why: "", packages: vec!["cmake"] },
            Missing { what: "a C compiler is", why: "", packages: vec!["gcc", "libc6-dev"] },
        ];
        assert_eq!(apt_command(&packages(&missing)), "apt-get install --no-install-recommends cmake gcc libc6-dev");
    }

    #[test]
    fn a_command_without_needs_installs_nothing() {
        assert_eq!(find_missing(&[], false), Vec::new());
        assert!(set_up(&[], Path::new("unused")).unwrap().is_none());
    }
}
