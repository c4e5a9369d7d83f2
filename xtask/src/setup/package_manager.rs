//! Package managers and their commands, which `cargo xtask` prints. Only apt is also run, as root (see [`super::apt`]).

use super::tool::Tool;
use crate::shell;

/// A package manager.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PackageManager {
    Apt,
    Homebrew,
    Dnf,
    Pacman,
    Zypper,
    Winget,
}

impl PackageManager {
    /// In the order in which they are looked for.
    const ALL: [PackageManager; 6] = [Self::Apt, Self::Dnf, Self::Pacman, Self::Zypper, Self::Homebrew, Self::Winget];

    /// The package manager of this system: the first one on PATH.
    pub(crate) fn find() -> Option<PackageManager> {
        Self::ALL.into_iter().find(|manager| shell::on_path(manager.program()).is_some())
    }

    fn program(self) -> &'static str {
        match self {
            Self::Apt => "apt-get",
            Self::Homebrew => "brew",
            Self::Dnf => "dnf",
            Self::Pacman => "pacman",
            Self::Zypper => "zypper",
            Self::Winget => "winget",
        }
    }

    /// The command that a user types, without the names of the packages.
    fn install_command(self) -> &'static str {
        match self {
            Self::Apt => "sudo apt-get install --no-install-recommends",
            Self::Homebrew => "brew install",
            Self::Dnf => "sudo dnf install",
            Self::Pacman => "sudo pacman -S --needed",
            Self::Zypper => "sudo zypper install",
            Self::Winget => "winget install",
        }
    }

    /// The packages that contain these tools, each once.
    pub(crate) fn packages(self, tools: &[Tool]) -> Vec<&'static str> {
        let mut packages: Vec<&'static str> = Vec::new();
        for tool in tools {
            let of_tool = match self {
                Self::Apt => tool.packages.apt,
                Self::Homebrew => tool.packages.homebrew,
                Self::Dnf => tool.packages.dnf,
                Self::Pacman => tool.packages.pacman,
                Self::Zypper => tool.packages.zypper,
                Self::Winget => tool.packages.winget,
            };
            for package in of_tool {
                if !packages.contains(package) {
                    packages.push(package);
                }
            }
        }
        packages
    }

    /// The command that installs these tools; `None` if the package manager has no package for any of them.
    pub(crate) fn command(self, tools: &[Tool]) -> Option<String> {
        let packages = self.packages(tools);
        (!packages.is_empty()).then(|| format!("{} {}", self.install_command(), packages.join(" ")))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tool::{CHROMIUM_TOOLS, DEBIAN_COMPILER, NODE_TOOLS, PYTHON_TOOLS, UNICORN_TOOLS};
    use super::*;

    #[test]
    fn every_system_has_its_own_command() {
        use PackageManager::{Apt, Dnf, Homebrew, Pacman, Winget, Zypper};
        let table: [(PackageManager, &[Tool], &str); 18] = [
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
            (Apt, &CHROMIUM_TOOLS, "sudo apt-get install --no-install-recommends chromium"),
            (Homebrew, &CHROMIUM_TOOLS, "brew install google-chrome"),
            (Winget, &CHROMIUM_TOOLS, "winget install Google.Chrome"),
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
    fn programs_differ() {
        let mut programs = PackageManager::ALL.map(PackageManager::program).to_vec();
        programs.sort_unstable();
        programs.dedup();
        assert_eq!(programs.len(), PackageManager::ALL.len());
    }
}
