//! Finds the tools that a command needs and this computer does not have, and installs them with apt if it runs as root. Otherwise it prints the
//! command that installs them, and changes nothing.
//!
//! A required tool that is missing stops the command; an optional one costs only the steps that need it.

mod apt;
mod need;
mod package_manager;
mod tool;

use std::path::Path;

use anyhow::Result;

use crate::missing_requirement::MissingRequirement;
use crate::probe;
use crate::shell;
use crate::toolchain::{self, Method, Toolchain};
use apt::{Apt, Effort};
use package_manager::PackageManager;
use tool::{DEBIAN_COMPILER, Tool};

pub(crate) use need::{Need, REQUIRE, Required};

/// A need that this computer does not meet.
#[derive(Debug, Clone)]
struct Missing {
    need: Need,
    /// The absent tools; empty if the need is not about tools.
    tools: Vec<Tool>,
    /// Reason why the need is not met or the tools could not be installed; `None` if nothing was tried.
    cause: Option<String>,
}

impl Missing {
    /// The reason in one line, for a table.
    fn reason(&self, manager: Option<PackageManager>) -> String {
        let command = || match manager.and_then(|manager| manager.command(&self.tools)) {
            Some(command) => format!("install with `{command}`"),
            None => "install with the system's package manager".to_owned(),
        };
        let cause = self.cause.clone().unwrap_or_else(command);
        if self.tools.is_empty() { cause } else { format!("{} not found; {cause}", names(&self.tools)) }
    }
}

/// Result of the set-up, with which a command works.
#[derive(Debug, Default)]
pub(crate) struct Setup {
    /// The toolchain for the board, if [`Need::BoardCompiler`] was among the needs.
    pub(crate) toolchain: Option<Toolchain>,
    /// Optional needs that are not met, each with the reason in one line.
    pub(crate) missing: Vec<(Need, String)>,
}

/// Checks `needs`, and installs what is missing and can be installed.
///
/// # Errors
/// [`MissingRequirement`] if a need that `required` contains is not met.
pub(crate) fn set_up(needs: &[Need], required: &Required, target_dir: &Path) -> Result<Setup> {
    let mut missing = Vec::new();
    let mut decision = None;
    for &need in needs {
        let mut tools = missing_tools(need.tools());
        let mut cause = None;
        match need {
            // Apart from its tools, which the package manager installs.
            Need::Probe => missing.extend(missing_probe_rs(required)),
            Need::Traces => cause = need::missing_traces(&need::traces_folder()),
            Need::BoardCompiler => match toolchain::decide(&toolchain::facts()?) {
                Ok(decided) => {
                    if decided.method == Method::Debian {
                        tools = missing_tools(&[DEBIAN_COMPILER]);
                    }
                    decision = Some(decided);
                }
                Err(reason) => cause = Some(reason.to_owned()),
            },
            _ => {}
        }
        if cause.is_some() || !tools.is_empty() {
            missing.push(Missing { need, tools, cause });
        }
    }

    let manager = PackageManager::find();
    if let Some(apt) = Apt::usable() {
        // One installation for each need, so that one that fails does not prevent the others.
        missing.retain_mut(|missing| missing.tools.is_empty() || !install(missing, &apt, required));
    }
    let missing = optional(missing, required, manager)?;
    for missing in &missing {
        eprintln!("set-up: optional, {} is missing: {}", missing.need.name(), missing.reason(manager));
    }

    let missing = missing.iter().map(|missing| (missing.need, missing.reason(manager))).collect();
    let mut setup = Setup { toolchain: None, missing };
    if let Some(decision) = decision {
        let toolchain = match decision.method {
            Method::Debian => Toolchain::debian(target_dir)?,
            Method::Plain | Method::RustupAdd => Toolchain::active(decision.method)?,
        };
        eprintln!("toolchain: {} ({})", toolchain.describe(), decision.reason);
        setup.toolchain = Some(toolchain);
    }
    Ok(setup)
}

/// Why there is no probe-rs; `None` if there is one. Where it is required, cargo installs it, which takes minutes.
fn missing_probe_rs(required: &Required) -> Option<Missing> {
    let mut cause = probe::installed("probe-rs").err()?;
    if required.contains(Need::Probe) {
        match install_probe_rs() {
            Ok(()) => cause = probe::installed("probe-rs").err()?,
            Err(error) => cause += &format!("; {error:#}"),
        }
    }
    Some(Missing { need: Need::Probe, tools: Vec::new(), cause: Some(cause) })
}

/// Installs probe-rs below the target folder. Optimised as far as its user needs it: fully it takes three times as long.
fn install_probe_rs() -> Result<()> {
    eprintln!("set-up: probe-rs is missing: it writes and debugs boards; its build takes about 8 minutes on 2 cores");
    let mut cargo = shell::cargo();
    cargo.args(probe::INSTALL.split(' ').skip(1)).arg("--root").arg(probe::tools_folder());
    cargo.env("CARGO_PROFILE_RELEASE_LTO", "off").env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "1");
    cargo.env("CARGO_PROFILE_RELEASE_DEBUG", "0");
    shell::must_succeed(&mut cargo, probe::INSTALL)
}

fn missing_tools(tools: &[Tool]) -> Vec<Tool> {
    tools.iter().filter(|tool| !(tool.is_present)()).copied().collect()
}

/// Installs the missing tools. Returns whether all are present then; otherwise `missing.cause` has the reason.
fn install(missing: &mut Missing, apt: &Apt, required: &Required) -> bool {
    for tool in &missing.tools {
        eprintln!("set-up: {} is missing: {}", tool.name, tool.purpose);
    }
    let effort = if required.contains(missing.need) { Effort::Required } else { Effort::Optional };
    let result = apt.install(&PackageManager::Apt.packages(&missing.tools), effort);
    missing.tools = missing_tools(&missing.tools);
    missing.cause = Some(match result {
        Ok(()) => "its package is installed, but does not contain it".to_owned(),
        Err(reason) => format!("apt-get cannot install it: {reason}"),
    });
    missing.tools.is_empty()
}

fn names(tools: &[Tool]) -> String {
    tools.iter().map(|tool| tool.name).collect::<Vec<_>>().join(", ")
}

/// The missing needs that are optional.
///
/// # Errors
/// A required need is missing: the error lists every tool with its purpose, and one command that installs all of them.
fn optional(
    missing: Vec<Missing>,
    required: &Required,
    manager: Option<PackageManager>,
) -> Result<Vec<Missing>, MissingRequirement> {
    let (fatal, optional): (Vec<Missing>, Vec<Missing>) =
        missing.into_iter().partition(|missing| required.contains(missing.need));
    if fatal.is_empty() {
        return Ok(optional);
    }
    let mut text = "something that this command requires is missing".to_owned();
    for missing in &fatal {
        let named = if missing.need.is_always_required() { "" } else { ", which FOOTFALL_REQUIRE names" };
        text += &format!("\n{}{named}:", missing.need.name());
        for tool in &missing.tools {
            text += &format!("\n  {}: {}", tool.name, tool.purpose);
        }
        if let Some(cause) = &missing.cause {
            text += &format!("\n  {cause}");
        }
    }
    let tools: Vec<Tool> = fatal.iter().flat_map(|missing| missing.tools.iter().copied()).collect();
    match manager.and_then(|manager| manager.command(&tools)) {
        Some(command) => text += &format!("\ninstall it, then run the command again:\n  {command}"),
        None if tools.is_empty() => {}
        None => text += "\ninstall it with the system's package manager, then run the command again",
    }
    Err(MissingRequirement(text))
}

#[cfg(test)]
mod tests {
    use super::tool::{NODE_TOOLS, UNICORN_TOOLS};
    use super::*;

    fn missing(need: Need, tools: &[Tool], cause: Option<&str>) -> Missing {
        Missing { need, tools: tools.to_vec(), cause: cause.map(str::to_owned) }
    }

    #[test]
    fn what_is_optional_does_not_stop_a_command() {
        let node = missing(Need::Node, &NODE_TOOLS[..1], Some("apt-get cannot install it: conflict"));
        let kept = optional(vec![node], &Required::default(), None).unwrap();
        assert_eq!(kept.len(), 1);
        assert_eq!(kept[0].reason(None), "node not found; apt-get cannot install it: conflict");
    }

    #[test]
    fn what_is_required_stops_it_with_one_command() {
        let all = vec![
            missing(Need::VirtualBoard, &UNICORN_TOOLS[1..2], None),
            missing(Need::Node, &NODE_TOOLS[..1], None),
            missing(Need::Traces, &[], Some("no recordings in x")),
        ];
        let required = Required::parse("node,traces").unwrap();
        let message = optional(all, &required, Some(PackageManager::Homebrew)).unwrap_err().to_string();
        let expected = "something that this command requires is missing\n\
            virtual-board:\n  cmake: configures the build of Unicorn\n\
            node, which FOOTFALL_REQUIRE names:\n  node: runs JavaScript programs\n\
            traces, which FOOTFALL_REQUIRE names:\n  no recordings in x\n\
            install it, then run the command again:\n  brew install cmake node";
        assert_eq!(message, expected);
    }

    #[test]
    fn an_unknown_system_gets_the_tools_own_names() {
        let all = vec![missing(Need::VirtualBoard, &UNICORN_TOOLS, None)];
        let message = optional(all, &Required::default(), None).unwrap_err().to_string();
        assert!(UNICORN_TOOLS.iter().all(|tool| message.contains(tool.name)), "{message}");
        assert!(message.contains("the system's package manager"), "{message}");
    }

    #[test]
    fn a_command_without_needs_installs_nothing() {
        let setup = set_up(&[], &Required::default(), Path::new("unused")).unwrap();
        assert!(setup.toolchain.is_none() && setup.missing.is_empty());
    }
}
