//! Chooses the compiler that builds for the board, and prints the choice and its reason in one line. The first method that is possible is used:
//!
//! 1. Plain cargo, if the sysroot of the active toolchain has the target.
//! 2. Debian's compiler, cargo and library source, which compiles `core` and `alloc` with the firmware, if the system is Debian and rustup is
//!    absent or must not download (`RUSTUP_AUTO_INSTALL=0`).
//! 3. `rustup target add`, then plain cargo.
//!
//! `FOOTFALL_TOOLCHAIN=debian` forces the second method, `FOOTFALL_TOOLCHAIN=rustup` the first or third. With `RUSTUP_AUTO_INSTALL=0` rustup never
//! downloads anything. `docs/toolchains.md` describes the methods for users.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::missing_requirement::MissingRequirement;
use crate::shell;

/// Target of the firmware: Cortex-M4F with floating-point registers, no operating system.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

/// Target of the smallest chips for which the cores compile: Cortex-M0, without floating-point unit and atomic exchange. The image of the
/// Raspberry Pi Pico is built for it.
pub(crate) const SMALLEST_TARGET: &str = "thumbv6m-none-eabi";

/// The methods that `FOOTFALL_TOOLCHAIN` allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Force {
    /// Debian's packages.
    Debian,
    /// The active toolchain, with rustup adding the target where it may.
    Rustup,
}

/// Facts about this computer on which the choice depends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Facts {
    /// `FOOTFALL_TOOLCHAIN`.
    pub(crate) forced: Option<Force>,
    /// The active toolchain can build for [`TARGET`] as it is.
    pub(crate) target_in_sysroot: bool,
    /// `RUSTUP_AUTO_INSTALL` is 0: rustup must not download.
    pub(crate) auto_install_off: bool,
    /// `rustup` is on PATH.
    pub(crate) rustup: bool,
    /// The system is Debian.
    pub(crate) debian: bool,
}

/// Method of building for the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Method {
    /// The active toolchain, which has the target.
    Plain,
    /// Debian's compiler with its own library source.
    Debian,
    /// The active toolchain, after `rustup target add`.
    RustupAdd,
}

/// The chosen method, and the reason for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Decision {
    pub(crate) method: Method,
    pub(crate) reason: &'static str,
}

/// Parses the value of `FOOTFALL_TOOLCHAIN`; an empty one counts as not set.
pub(crate) fn parse_force(value: Option<&str>) -> Result<Option<Force>> {
    match value {
        None | Some("") => Ok(None),
        Some("debian") => Ok(Some(Force::Debian)),
        Some("rustup") => Ok(Some(Force::Rustup)),
        Some(other) => bail!("FOOTFALL_TOOLCHAIN is `{other}`; allowed: `debian`, `rustup`, or not set"),
    }
}

/// Chooses the method; an error says what the user can do.
pub(crate) fn decide(facts: &Facts) -> Result<Decision, &'static str> {
    let take = |method, reason| Ok(Decision { method, reason });
    match facts.forced {
        Some(Force::Debian) if !facts.debian => {
            Err("FOOTFALL_TOOLCHAIN=debian, but this system is not Debian: unset it and use rustup")
        }
        Some(Force::Debian) => take(Method::Debian, "FOOTFALL_TOOLCHAIN=debian"),
        Some(Force::Rustup) if facts.target_in_sysroot => take(Method::Plain, "FOOTFALL_TOOLCHAIN=rustup"),
        Some(Force::Rustup) if !facts.rustup => {
            Err("FOOTFALL_TOOLCHAIN=rustup, but there is no rustup and the active toolchain lacks the target")
        }
        Some(Force::Rustup) if facts.auto_install_off => Err(
            "FOOTFALL_TOOLCHAIN=rustup, but the active toolchain lacks the target and RUSTUP_AUTO_INSTALL=0 forbids to download it: \
             unset one of the two",
        ),
        Some(Force::Rustup) => take(Method::RustupAdd, "FOOTFALL_TOOLCHAIN=rustup"),
        None if facts.target_in_sysroot => take(Method::Plain, "the active toolchain has the target"),
        None if facts.auto_install_off && facts.debian => take(
            Method::Debian,
            "the active toolchain lacks the target and RUSTUP_AUTO_INSTALL=0 forbids to download it",
        ),
        None if facts.auto_install_off && facts.rustup => {
            Err("the active toolchain lacks the target and RUSTUP_AUTO_INSTALL=0 forbids to download it: \
             run `rustup target add thumbv7em-none-eabihf` yourself, or unset the variable")
        }
        None if !facts.rustup && facts.debian => {
            take(Method::Debian, "the active toolchain lacks the target and there is no rustup")
        }
        None if !facts.rustup => Err(
            "the active toolchain lacks the target and there is no rustup to add it: install rustup, or your system's package \
             of Rust's library for thumbv7em-none-eabihf",
        ),
        None => take(Method::RustupAdd, "the active toolchain lacks the target"),
    }
}

/// Determines the facts of this computer.
pub(crate) fn facts() -> Result<Facts> {
    Ok(Facts {
        forced: parse_force(std::env::var("FOOTFALL_TOOLCHAIN").ok().as_deref())?,
        target_in_sysroot: target_in_sysroot(TARGET)?,
        auto_install_off: std::env::var_os("RUSTUP_AUTO_INSTALL").is_some_and(|value| value == "0"),
        rustup: shell::on_path("rustup").is_some(),
        debian: is_debian(&std::fs::read_to_string("/etc/os-release").unwrap_or_default()),
    })
}

/// Whether the system is Debian itself: its derivatives do not have the packages [`DEBIAN_PACKAGES`].
fn is_debian(os_release: &str) -> bool {
    os_release.lines().any(|line| matches!(line.trim(), "ID=debian" | "ID=\"debian\""))
}

fn target_in_sysroot(target: &str) -> Result<bool> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let libraries = shell::stdout_of(shell::command(&rustc).args(["--print", "target-libdir", "--target", target]))
        .context("asking rustc where the libraries of the target are")?;
    Ok(Path::new(libraries.trim()).is_dir())
}

/// A toolchain that can build for the board.
#[derive(Debug)]
pub(crate) enum Toolchain {
    /// The cargo that runs `cargo xtask`.
    Active,
    /// Debian's, with a target folder of its own, and a folder for PATH with the link `rust-lld`.
    Debian {
        /// Its target folder: two compilers in one folder would remove each other's output.
        target_dir: PathBuf,
        /// The folder with the link, put in front of PATH.
        links: PathBuf,
    },
}

/// Debian's packages for the second method: one version of compiler, cargo and library source, and the linker.
pub(crate) const DEBIAN_PACKAGES: &str = "rustc-web cargo-web rust-web-src lld-22";
/// Its target folder, below that of the workspace.
const DEBIAN_TARGET_DIR: &str = "thumb-debian";
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_RUSTDOC: &str = "/usr/bin/rustdoc";
const DEBIAN_CARGO: &str = "/usr/bin/cargo";
const DEBIAN_LLD: &str = "/usr/lib/llvm-22/bin/lld";
/// Where rustc looks for the library source: a link to `rustc-1.96.0` or the like.
const DEBIAN_SOURCE: &str = "/usr/lib/rustlib/src/rust";

impl Toolchain {
    /// The active toolchain; with [`Method::RustupAdd`] rustup adds the target first.
    pub(crate) fn active(method: Method) -> Result<Toolchain> {
        if method == Method::RustupAdd {
            rustup_add(TARGET)?;
        }
        Ok(Toolchain::Active)
    }

    /// Prepares another target than [`TARGET`]: rustup adds it if it is missing and rustup may download.
    pub(crate) fn ready_for(&self, target: &str) -> Result<()> {
        // Debian's toolchain compiles the library for any target.
        let missing = matches!(self, Toolchain::Active) && !target_in_sysroot(target)?;
        if !missing {
            return Ok(());
        }
        let facts = facts()?;
        if facts.auto_install_off || !facts.rustup {
            return Err(MissingRequirement(format!(
                "the active toolchain lacks {target} and must not or cannot download it: run `rustup target add {target}` \
                 yourself; on Debian, FOOTFALL_TOOLCHAIN=debian needs only Debian's packages"
            ))
            .into());
        }
        rustup_add(target)
    }

    /// Debian's toolchain; [`DEBIAN_PACKAGES`] must be installed. `target_dir` is the workspace's target folder.
    pub(crate) fn debian(target_dir: &Path) -> Result<Toolchain> {
        let release = debian_release()?;
        let source = std::fs::canonicalize(DEBIAN_SOURCE).with_context(|| format!("reading {DEBIAN_SOURCE}"))?;
        check_debian(&release, &source.to_string_lossy(), env!("CARGO_PKG_RUST_VERSION"))
            .map_err(MissingRequirement)?;
        let links = target_dir.join("tool-links");
        link_lld(&links)?;
        Ok(Toolchain::Debian { target_dir: target_dir.join(DEBIAN_TARGET_DIR), links })
    }

    /// Where it builds, below a workspace's target folder.
    pub(crate) fn target_dir(&self, of_workspace: &Path) -> PathBuf {
        match self {
            Toolchain::Active => of_workspace.to_owned(),
            Toolchain::Debian { .. } => of_workspace.join(DEBIAN_TARGET_DIR),
        }
    }

    /// The toolchain in words, for the line that reports the choice.
    pub(crate) fn describe(&self) -> String {
        match self {
            Toolchain::Active => format!("the active toolchain, target {TARGET}"),
            Toolchain::Debian { .. } => {
                let release = debian_release().unwrap_or_default();
                format!("Debian's rustc {release} with its own library source, target {TARGET}")
            }
        }
    }

    /// A `cargo` command that builds for the board; the caller adds subcommand, package and target.
    pub(crate) fn cargo(&self) -> Command {
        match self {
            Toolchain::Active => shell::cargo(),
            Toolchain::Debian { target_dir, links } => {
                let mut cargo = shell::command(DEBIAN_CARGO);
                // rustup's proxy and `cargo run` set these for their child processes; with them Debian's cargo would use the other compiler.
                cargo.env_remove("RUSTUP_TOOLCHAIN").env_remove("LD_LIBRARY_PATH").env_remove("CARGO");
                cargo.env("RUSTC", DEBIAN_RUSTC).env("RUSTDOC", DEBIAN_RUSTDOC);
                // Compiling the library is an unstable option of cargo; RUSTC_BOOTSTRAP allows it with a stable compiler.
                cargo.env("RUSTC_BOOTSTRAP", "1").env("CARGO_UNSTABLE_BUILD_STD", "core,alloc");
                cargo.env("CARGO_TARGET_DIR", target_dir).env("PATH", shell::path_with(links));
                cargo
            }
        }
    }

    /// The folders with the source of Rust's library, as the compiler may name them.
    pub(crate) fn library(&self) -> Vec<PathBuf> {
        match self {
            // Compiled by others, with a name that is on no computer (`/rustc/`).
            Toolchain::Active => Vec::new(),
            Toolchain::Debian { .. } => {
                let link = PathBuf::from(DEBIAN_SOURCE);
                let folder = std::fs::canonicalize(&link).ok();
                std::iter::once(link).chain(folder).collect()
            }
        }
    }

    /// Makes warnings in this workspace's code fail the build, if the toolchain has an option for it that needs no complete rebuild
    /// (`RUSTFLAGS=-Dwarnings` needs one).
    pub(crate) fn deny_warnings(&self, cargo: &mut Command) {
        if let Toolchain::Debian { .. } = self {
            cargo.env("CARGO_UNSTABLE_WARNINGS", "true").env("CARGO_BUILD_WARNINGS", "deny");
        }
    }
}

fn rustup_add(target: &str) -> Result<()> {
    eprintln!("set-up: rustup target add {target}");
    let done = shell::command("rustup").args(["target", "add", target]).status().context("starting rustup")?;
    if !done.success() {
        return Err(MissingRequirement(format!(
            "rustup could not add {target} (its message is above). With a network that reaches rustup's server, run \
             `rustup target add {target}`; on Debian, FOOTFALL_TOOLCHAIN=debian needs only Debian's packages"
        ))
        .into());
    }
    Ok(())
}

/// Whether all packages of the second method are here, the first three of one version. Installing all of them brings them to that of the archive.
pub(crate) fn has_debian_packages() -> bool {
    let versions: Vec<Option<String>> = DEBIAN_PACKAGES.split(' ').map(shell::debian_version).collect();
    versions.iter().all(Option::is_some) && one_version(&versions[..3])
}

fn one_version(versions: &[Option<String>]) -> bool {
    versions.windows(2).all(|pair| pair[0] == pair[1])
}

fn debian_release() -> Result<String> {
    let version = shell::stdout_of(shell::command(DEBIAN_RUSTC).arg("-vV").env_remove("LD_LIBRARY_PATH"))?;
    let release =
        version.lines().find_map(|line| line.strip_prefix("release: ")).context("rustc -vV names no release")?;
    Ok(release.to_owned())
}

/// Checks that compiler and library source have one version, not older than the workspace's `rust-version`.
fn check_debian(release: &str, source: &str, minimum: &str) -> Result<(), String> {
    if !source.ends_with(&format!("rustc-{release}")) {
        return Err(format!(
            "Debian's compiler is {release} but its library source is in {source}: bring them to one version with \
             `apt-get install {DEBIAN_PACKAGES}`"
        ));
    }
    let number = |version: &str| {
        let mut parts = version.split(['.', '-']).map(|part| part.parse::<u32>().unwrap_or(0));
        (parts.next().unwrap_or(0), parts.next().unwrap_or(0))
    };
    if number(release) < number(minimum) {
        return Err(format!(
            "Debian's rustc-web is {release}, Footfall needs {minimum} or newer: enable Debian's security archive, then \
             `apt-get update` and `apt-get install {DEBIAN_PACKAGES}`"
        ));
    }
    Ok(())
}

/// Makes a link `rust-lld`, the name by which rustc calls the linker, to Debian's `lld`. A `linker` setting would make each change of the method
/// rebuild everything.
fn link_lld(links: &Path) -> Result<()> {
    std::fs::create_dir_all(links).with_context(|| format!("making {}", links.display()))?;
    let link = links.join("rust-lld");
    if std::fs::read_link(&link).is_ok_and(|to| to == Path::new(DEBIAN_LLD)) {
        return Ok(());
    }
    // The link is absent, or leads to another version of Debian's LLVM.
    let _ = std::fs::remove_file(&link);
    #[cfg(unix)]
    std::os::unix::fs::symlink(DEBIAN_LLD, &link).with_context(|| format!("linking {}", link.display()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn any() -> Vec<Facts> {
        let bools = [false, true];
        let mut all = Vec::new();
        for forced in [None, Some(Force::Debian), Some(Force::Rustup)] {
            for target_in_sysroot in bools {
                for auto_install_off in bools {
                    for rustup in bools {
                        for debian in bools {
                            all.push(Facts { forced, target_in_sysroot, auto_install_off, rustup, debian });
                        }
                    }
                }
            }
        }
        all
    }

    fn method(facts: Facts) -> Option<Method> {
        decide(&facts).ok().map(|decision| decision.method)
    }

    const BARE: Facts =
        Facts { forced: None, target_in_sysroot: false, auto_install_off: false, rustup: true, debian: false };

    #[test]
    fn rustup_never_downloads_where_it_must_not() {
        for facts in any().into_iter().filter(|facts| facts.auto_install_off || !facts.rustup) {
            assert_ne!(method(facts), Some(Method::RustupAdd), "{facts:?}");
        }
    }

    #[test]
    fn debian_packages_are_for_debian_only() {
        for facts in any().into_iter().filter(|facts| !facts.debian) {
            assert_ne!(method(facts), Some(Method::Debian), "{facts:?}");
        }
    }

    #[test]
    fn a_present_target_needs_nothing_else() {
        for facts in any().into_iter().filter(|facts| facts.target_in_sysroot && facts.forced != Some(Force::Debian)) {
            assert_eq!(method(facts), Some(Method::Plain), "{facts:?}");
        }
        for facts in any().into_iter().filter(|facts| !facts.target_in_sysroot) {
            assert_ne!(method(facts), Some(Method::Plain), "{facts:?}");
        }
    }

    #[test]
    fn a_forced_method_is_taken_or_refused() {
        for facts in any() {
            let refused = matches!(
                (facts.forced, method(facts)),
                (Some(Force::Debian), Some(Method::Plain | Method::RustupAdd))
                    | (Some(Force::Rustup), Some(Method::Debian))
            );
            assert!(!refused, "{facts:?} took {:?}", method(facts));
        }
    }

    #[test]
    fn the_three_methods_in_their_order() {
        assert_eq!(method(BARE), Some(Method::RustupAdd));
        assert_eq!(method(Facts { debian: true, ..BARE }), Some(Method::RustupAdd));
        assert_eq!(method(Facts { debian: true, auto_install_off: true, ..BARE }), Some(Method::Debian));
        assert_eq!(method(Facts { debian: true, rustup: false, ..BARE }), Some(Method::Debian));
        assert_eq!(method(Facts { auto_install_off: true, ..BARE }), None);
        assert_eq!(method(Facts { rustup: false, ..BARE }), None);
    }

    #[test]
    fn force_is_one_of_two_words() {
        assert_eq!(parse_force(None).unwrap(), None);
        assert_eq!(parse_force(Some("")).unwrap(), None);
        assert_eq!(parse_force(Some("debian")).unwrap(), Some(Force::Debian));
        assert_eq!(parse_force(Some("rustup")).unwrap(), Some(Force::Rustup));
        let message = parse_force(Some("Debian")).unwrap_err().to_string();
        assert!(message.contains("`Debian`") && message.contains("allowed: `debian`, `rustup`"), "{message}");
    }

    #[test]
    fn derivatives_are_not_debian() {
        assert!(is_debian("NAME=\"Debian GNU/Linux\"\nID=debian\n"));
        assert!(!is_debian("NAME=\"Ubuntu\"\nID=ubuntu\nID_LIKE=debian\n"));
        assert!(!is_debian(""));
    }

    #[test]
    fn compiler_and_library_source_are_one_version() {
        assert_eq!(check_debian("1.96.0", "/usr/src/rustc-1.96.0", "1.95"), Ok(()));
        assert!(check_debian("1.96.0", "/usr/src/rustc-1.95.0", "1.95").unwrap_err().contains("one version"));
        assert!(check_debian("1.85.0", "/usr/src/rustc-1.85.0", "1.95").unwrap_err().contains("1.95 or newer"));
        assert_eq!(check_debian("1.100.0", "/usr/src/rustc-1.100.0", "1.95"), Ok(()));
        assert!(one_version(&[Some("1".into()), Some("1".into())]));
        assert!(!one_version(&[Some("1".into()), Some("2".into())]));
    }

    /// Debian's compiler compiles its library itself, so no target has to be added.
    #[test]
    fn debian_is_ready_for_every_target() {
        let toolchain = Toolchain::Debian { target_dir: "t/thumb-debian".into(), links: "t/tool-links".into() };
        assert!(toolchain.ready_for(SMALLEST_TARGET).is_ok());
    }

    #[test]
    fn debian_builds_are_kept_from_the_other_toolchain() {
        let toolchain = Toolchain::Debian { target_dir: "t/thumb-debian".into(), links: "t/tool-links".into() };
        let cargo = toolchain.cargo();
        let env: Vec<_> = cargo.get_envs().collect();
        let value = |name: &str| env.iter().find(|(key, _)| *key == name).map(|(_, value)| value.map(|v| v.to_owned()));
        assert_eq!(value("RUSTC"), Some(Some("/usr/bin/rustc".into())));
        assert_eq!(value("CARGO_TARGET_DIR"), Some(Some("t/thumb-debian".into())));
        assert_eq!(value("RUSTUP_TOOLCHAIN"), Some(None));
        assert_eq!(value("LD_LIBRARY_PATH"), Some(None));
        assert_eq!(value("CARGO_HOME"), None, "the registry cache is shared");
        assert!(value("PATH").unwrap().unwrap().to_string_lossy().starts_with("t/tool-links"));
    }
}
