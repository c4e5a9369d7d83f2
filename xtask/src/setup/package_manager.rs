//! Package managers and their commands, which `cargo xtask` prints. Only apt is also run, as root (see [`super::apt`]).

use super::tool::Tool;
use crate::shell;

/// A package manager.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PackageManager {
    Apt,
    Dnf,
    Pacman,
    Zypper,
    Homebrew,
    Winget,
}

impl PackageManager {
    /// In the order in which they are looked for, and in which a tool has its packages: each with its program, and the command that a user types,
    /// without the names of the packages.
    const ALL: [(PackageManager, &'static str, &'static str); 6] = [
        (Self::Apt, "apt-get", "sudo apt-get install --no-install-recommends"),
        (Self::Dnf, "dnf", "sudo dnf install"),
        (Self::Pacman, "pacman", "sudo pacman -S --needed"),
        (Self::Zypper, "zypper", "sudo zypper install"),
        (Self::Homebrew, "brew", "brew install"),
        (Self::Winget, "winget", "winget install"),
    ];

    /// The package manager of this system: the first one on PATH.
    pub(crate) fn find() -> Option<PackageManager> {
        Self::ALL.into_iter().find(|(_, program, _)| shell::on_path(program).is_some()).map(|(manager, ..)| manager)
    }

    /// The packages that contain these tools, each once.
    pub(crate) fn packages(self, tools: &[Tool]) -> Vec<&'static str> {
        let mut packages: Vec<&'static str> = Vec::new();
        for package in tools.iter().flat_map(|tool| tool.packages[self as usize].split_whitespace()) {
            if !packages.contains(&package) {
                packages.push(package);
            }
        }
        packages
    }

    /// The command that installs these tools; `None` if the package manager has no package for any of them.
    pub(crate) fn command(self, tools: &[Tool]) -> Option<String> {
        let packages = self.packages(tools);
        (!packages.is_empty()).then(|| format!("{} {}", Self::ALL[self as usize].2, packages.join(" ")))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tool::{DEBIAN_COMPILER, NODE_TOOLS, PYTHON_TOOLS, UNICORN_TOOLS};
    use super::*;

    #[test]
    fn every_system_has_its_own_command() {
        use PackageManager::{Apt, Dnf, Homebrew, Pacman, Winget, Zypper};
        let table: [(PackageManager, &[Tool], &str); 15] = [
            (
                Apt,
                &UNICORN_TOOLS,
                "sudo apt-get install --no-install-recommends gcc libc6-dev cmake make pkg-config libclang-dev",
            ),
            (Homebrew, &UNICORN_TOOLS, "brew install gcc cmake make pkgconf llvm"),
            (Dnf, &UNICORN_TOOLS, "sudo dnf install gcc cmake make pkgconf-pkg-config clang-devel"),
            (Pacman, &UNICORN_TOOLS, "sudo pacman -S --needed gcc cmake make pkgconf clang"),
            (Zypper, &UNICORN_TOOLS, "sudo zypper install gcc cmake make pkgconf-pkg-config clang-devel"),
            (
                Winget,
                &UNICORN_TOOLS,
                "winget install Microsoft.VisualStudio.2022.BuildTools Kitware.CMake Ninja-build.Ninja LLVM.LLVM",
            ),
            (Apt, &NODE_TOOLS, "sudo apt-get install --no-install-recommends nodejs npm"),
            (Homebrew, &NODE_TOOLS, "brew install node"),
            (Dnf, &NODE_TOOLS, "sudo dnf install nodejs nodejs-npm"),
            (Pacman, &NODE_TOOLS, "sudo pacman -S --needed nodejs npm"),
            (Winget, &NODE_TOOLS, "winget install OpenJS.NodeJS.LTS"),
            (Apt, &PYTHON_TOOLS, "sudo apt-get install --no-install-recommends python3 python3-venv"),
            (Homebrew, &PYTHON_TOOLS, "brew install python"),
            (Pacman, &PYTHON_TOOLS, "sudo pacman -S --needed python python-pip"),
            (
                Apt,
                &[DEBIAN_COMPILER],
                "sudo apt-get install --no-install-recommends rustc-web cargo-web rust-web-src lld-22",
            ),
        ];
        for (manager, tools, expected) in table {
            assert_eq!(manager.command(tools).as_deref(), Some(expected), "{manager:?} {tools:?}");
        }
    }

    #[test]
    fn a_tool_without_a_package_has_no_command() {
        assert_eq!(PackageManager::Dnf.command(&[DEBIAN_COMPILER]), None);
        assert_eq!(PackageManager::Apt.command(&[]), None);
    }

    #[test]
    fn each_manager_stands_in_its_place() {
        for (place, (manager, ..)) in PackageManager::ALL.into_iter().enumerate() {
            assert_eq!(manager as usize, place, "{manager:?}");
        }
    }
}
