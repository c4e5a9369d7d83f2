//! Needs of commands and test steps from outside the repository, and which of them `FOOTFALL_REQUIRE` makes required.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

use super::tool::{CPP_TOOLS, DEBUGGER_TOOLS, NODE_TOOLS, PYTHON_TOOLS, TERMINAL_TOOLS, Tool, UNICORN_TOOLS};

/// The variable that makes needs required: their names with commas between them, or `all`.
pub(crate) const REQUIRE: &str = "FOOTFALL_REQUIRE";

/// The variable that names another folder of recordings.
const TRACES: &str = "FOOTFALL_TRACES";

/// Something from outside the repository that a command or a test step needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Need {
    /// A compiler for the board.
    BoardCompiler,
    /// The virtual board: the tools that build its emulator. The tests that run an image on it read this name too.
    VirtualBoard,
    /// The folder of recordings beside the checkout.
    Traces,
    /// A terminal for tests of a program that asks for keys. They read this name too.
    Terminal,
    /// JavaScript outside a browser.
    Node,
    /// Python with virtual environments.
    Python,
    /// A compiler of C++.
    Cpp,
    /// probe-rs, which cargo installs, and a debugger for the board.
    Probe,
}

impl Need {
    /// Every need.
    pub(crate) const ALL: [Need; 8] = [
        Need::BoardCompiler,
        Need::VirtualBoard,
        Need::Traces,
        Need::Terminal,
        Need::Node,
        Need::Python,
        Need::Cpp,
        Need::Probe,
    ];

    /// The groups of optional tools that `cargo xtask setup --with GROUP` installs.
    pub(crate) const GROUPS: [Need; 4] = [Need::Node, Need::Python, Need::Cpp, Need::Probe];

    /// The name in `FOOTFALL_REQUIRE` and `--with`.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Need::BoardCompiler => "board-compiler",
            Need::VirtualBoard => "virtual-board",
            Need::Traces => "traces",
            Need::Terminal => "terminal",
            Need::Node => "node",
            Need::Python => "python",
            Need::Cpp => "c++",
            Need::Probe => "probe",
        }
    }

    /// The need of this name.
    pub(crate) fn named(name: &str) -> Option<Need> {
        Need::ALL.into_iter().find(|need| need.name() == name)
    }

    /// Whether it is always required, without `FOOTFALL_REQUIRE`: the firmware cannot be built or run without these two.
    pub(crate) fn is_always_required(self) -> bool {
        matches!(self, Need::BoardCompiler | Need::VirtualBoard)
    }

    /// The tools behind it; those of the board's compiler depend on how the firmware is built (see `toolchain.rs`).
    pub(crate) fn tools(self) -> &'static [Tool] {
        match self {
            Need::BoardCompiler | Need::Traces => &[],
            Need::VirtualBoard => &UNICORN_TOOLS,
            Need::Terminal => &TERMINAL_TOOLS,
            Need::Node => &NODE_TOOLS,
            Need::Python => &PYTHON_TOOLS,
            Need::Cpp => &CPP_TOOLS,
            Need::Probe => &DEBUGGER_TOOLS,
        }
    }
}

/// The needs that `FOOTFALL_REQUIRE` names.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Required(Vec<Need>);

impl Required {
    /// Reads the environment.
    pub(crate) fn from_environment() -> Result<Required> {
        Required::parse(&std::env::var(REQUIRE).unwrap_or_default())
    }

    pub(super) fn parse(text: &str) -> Result<Required> {
        let mut needs = Vec::new();
        for name in text.split(',').map(str::trim).filter(|name| !name.is_empty()) {
            match Need::named(name) {
                Some(need) => needs.push(need),
                None if name == "all" => needs.extend(Need::ALL),
                None => bail!(
                    "{REQUIRE} names `{name}`; allowed: {}, all, with commas between them",
                    Need::ALL.map(Need::name).join(", ")
                ),
            }
        }
        Ok(Required(needs))
    }

    /// These needs in addition.
    pub(crate) fn and(mut self, needs: &[Need]) -> Required {
        self.0.extend(needs);
        self
    }

    /// Whether a command must stop where this is missing.
    pub(crate) fn contains(&self, need: Need) -> bool {
        need.is_always_required() || self.0.contains(&need)
    }

    /// The value of `FOOTFALL_REQUIRE` for tests. Only tests that are given an image may be required to run it.
    pub(crate) fn for_tests(&self, with_image: bool) -> String {
        let named = |need: &Need| match need {
            Need::VirtualBoard => with_image,
            // The steps that need them require them themselves.
            Need::Python | Need::Cpp | Need::Probe => false,
            need => self.0.contains(need),
        };
        Need::ALL.into_iter().filter(named).map(Need::name).collect::<Vec<_>>().join(",")
    }
}

/// The folder of recordings: `FOOTFALL_TRACES`, otherwise `../shared/traces` beside the checkout, which is the working directory.
pub(crate) fn traces_folder() -> PathBuf {
    std::env::var_os(TRACES).map_or_else(|| Path::new("../shared/traces").to_owned(), PathBuf::from)
}

/// Why there are no recordings; `None` if there are.
pub(crate) fn missing_traces(folder: &Path) -> Option<String> {
    (!folder.is_dir()).then(|| format!("no recordings in {}; {TRACES} names another folder", folder.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_names_is_read() {
        assert_eq!(Required::parse("").unwrap(), Required::default());
        assert_eq!(Required::parse("node, traces,").unwrap(), Required(vec![Need::Node, Need::Traces]));
        assert!(Need::ALL.iter().all(|&need| Required::parse("all").unwrap().contains(need)));
        assert!(Need::ALL.iter().all(|&need| Required::parse(need.name()).unwrap().contains(need)));
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_list() {
        let message = Required::parse("node,ndoe").unwrap_err().to_string();
        assert!(message.contains("`ndoe`"), "{message}");
        assert!(
            message.contains("allowed: board-compiler, virtual-board, traces, terminal, node, python, c++, probe, all")
        );
    }

    #[test]
    fn optional_needs_are_required_only_by_name() {
        let none = Required::default();
        assert!(none.contains(Need::BoardCompiler) && none.contains(Need::VirtualBoard));
        assert!(Need::GROUPS.iter().all(|&need| !none.contains(need)) && !none.contains(Need::Traces));
        assert!(Required::parse("node").unwrap().contains(Need::Node));
    }

    #[test]
    fn only_tests_with_an_image_must_run_it() {
        let required = Required::parse("all").unwrap();
        assert!(required.for_tests(true).contains("virtual-board"));
        assert_eq!(required.for_tests(false), "board-compiler,traces,terminal,node");
        assert_eq!(Required::default().for_tests(true), "virtual-board");
        assert_eq!(Required::default().for_tests(false), "");
    }

    #[test]
    fn every_group_has_tools() {
        assert!(Need::GROUPS.iter().all(|need| !need.tools().is_empty()));
    }

    #[test]
    fn a_missing_folder_of_recordings_is_named() {
        assert_eq!(missing_traces(&std::env::temp_dir()), None);
        assert!(missing_traces(Path::new("no/such")).unwrap().contains("no/such; FOOTFALL_TRACES"));
    }
}
