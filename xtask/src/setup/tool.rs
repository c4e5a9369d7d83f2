//! Programs and libraries that the commands need from outside the repository, and the packages that contain them.

use std::path::PathBuf;

use crate::shell;
use crate::toolchain;

/// A program or library.
#[derive(Clone, Copy)]
pub(crate) struct Tool {
    /// Name of the program or library itself, not of a package.
    pub(crate) name: &'static str,
    /// Its use in this project.
    pub(crate) purpose: &'static str,
    /// Whether it is on this computer.
    pub(crate) is_present: fn() -> bool,
    /// The packages that contain it.
    pub(crate) packages: Packages,
}

impl std::fmt::Debug for Tool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// Names of the packages for each package manager; empty if there is no such package or the tool is not needed on that system.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Packages {
    pub(crate) apt: &'static [&'static str],
    pub(crate) homebrew: &'static [&'static str],
    pub(crate) dnf: &'static [&'static str],
    pub(crate) pacman: &'static [&'static str],
    pub(crate) zypper: &'static [&'static str],
    pub(crate) winget: &'static [&'static str],
}

/// Debian's compiler, cargo, library source and linker.
pub(crate) const DEBIAN_COMPILER: Tool = Tool {
    name: "Debian's compiler for the board",
    purpose: "its rustc, cargo, library source (all of one version) and linker build the firmware",
    is_present: || toolchain::missing_debian_packages().is_empty(),
    packages: Packages {
        apt: &toolchain::DEBIAN_PACKAGES,
        homebrew: &[],
        dnf: &[],
        pacman: &[],
        zypper: &[],
        winget: &[],
    },
};

/// Tools that build Unicorn, the processor emulator of the virtual board. Its build script runs QEMU's `configure`, which needs `pkg-config`, and then
/// cmake; the Rust binding is generated with libclang.
pub(crate) const UNICORN_TOOLS: [Tool; 5] = [
    Tool {
        name: "C compiler",
        purpose: "compiles Unicorn, the processor emulator of the virtual board",
        is_present: || std::env::var_os("CC").is_some() || any_on_path(&["cc", "gcc", "clang", "cl"]) || cfg!(windows),
        packages: Packages {
            apt: &["gcc", "libc6-dev"],
            homebrew: &["gcc"],
            dnf: &["gcc"],
            pacman: &["gcc"],
            zypper: &["gcc"],
            winget: &["Microsoft.VisualStudio.2022.BuildTools"],
        },
    },
    Tool {
        name: "cmake",
        purpose: "configures the build of Unicorn",
        is_present: || std::env::var_os("CMAKE").is_some() || any_on_path(&["cmake"]),
        packages: Packages {
            apt: &["cmake"],
            homebrew: &["cmake"],
            dnf: &["cmake"],
            pacman: &["cmake"],
            zypper: &["cmake"],
            winget: &["Kitware.CMake"],
        },
    },
    Tool {
        name: "make or ninja",
        purpose: "runs the build of Unicorn",
        is_present: || any_on_path(&["make", "ninja"]) || cfg!(windows),
        packages: Packages {
            apt: &["make"],
            homebrew: &["make"],
            dnf: &["make"],
            pacman: &["make"],
            zypper: &["make"],
            winget: &["Ninja-build.Ninja"],
        },
    },
    Tool {
        name: "pkg-config",
        purpose: "Unicorn's configure script stops without it",
        is_present: || std::env::var_os("PKG_CONFIG").is_some() || any_on_path(&["pkg-config"]) || cfg!(windows),
        packages: Packages {
            apt: &["pkg-config"],
            homebrew: &["pkgconf"],
            dnf: &["pkgconf-pkg-config"],
            pacman: &["pkgconf"],
            zypper: &["pkgconf-pkg-config"],
            winget: &[],
        },
    },
    Tool {
        name: "libclang with its headers",
        purpose: "generates the Rust binding to Unicorn",
        is_present: has_libclang,
        packages: Packages {
            apt: &["libclang-dev"],
            homebrew: &["llvm"],
            dnf: &["clang-devel"],
            pacman: &["clang"],
            zypper: &["clang-devel"],
            winget: &["LLVM.LLVM"],
        },
    },
];

/// A terminal for tests. Other systems have a `script` with other options.
pub(crate) const TERMINAL_TOOLS: [Tool; 1] = [Tool {
    name: "script of util-linux",
    purpose: "makes a terminal for the tests of programs that ask for keys",
    is_present: || {
        shell::stdout_of(shell::command("script").arg("--version")).is_ok_and(|text| text.contains("util-linux"))
    },
    packages: Packages {
        apt: &["bsdutils"],
        homebrew: &[],
        dnf: &["util-linux"],
        pacman: &["util-linux"],
        zypper: &["util-linux"],
        winget: &[],
    },
}];

/// JavaScript outside a browser.
pub(crate) const NODE_TOOLS: [Tool; 2] = [
    Tool {
        name: "node",
        purpose: "runs JavaScript programs",
        is_present: || any_on_path(&["node"]),
        packages: Packages {
            apt: &["nodejs"],
            homebrew: &["node"],
            dnf: &["nodejs"],
            pacman: &["nodejs"],
            zypper: &["nodejs"],
            winget: &["OpenJS.NodeJS.LTS"],
        },
    },
    Tool {
        name: "npm",
        purpose: "installs JavaScript packages",
        is_present: || any_on_path(&["npm"]),
        packages: Packages {
            apt: &["npm"],
            homebrew: &["node"],
            dnf: &["nodejs-npm"],
            pacman: &["npm"],
            zypper: &["npm"],
            winget: &["OpenJS.NodeJS.LTS"],
        },
    },
];

/// A browser that runs without a screen.
pub(crate) const CHROMIUM_TOOLS: [Tool; 1] = [Tool {
    name: "Chromium or Chrome",
    purpose: "shows web pages without a screen",
    is_present: || any_on_path(&["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"]),
    packages: Packages {
        apt: &["chromium"],
        homebrew: &["google-chrome"],
        dnf: &["chromium"],
        pacman: &["chromium"],
        zypper: &["chromium"],
        winget: &["Google.Chrome"],
    },
}];

/// Python, with the modules for virtual environments.
pub(crate) const PYTHON_TOOLS: [Tool; 2] = [
    Tool {
        name: "python3",
        purpose: "runs Python programs",
        is_present: || any_on_path(&["python3"]),
        packages: Packages {
            apt: &["python3"],
            homebrew: &["python"],
            dnf: &["python3"],
            pacman: &["python"],
            zypper: &["python3"],
            winget: &["Python.Python.3.13"],
        },
    },
    Tool {
        name: "Python's venv and pip",
        purpose: "install Python packages into a folder of their own",
        is_present: || shell::stdout_of(shell::command("python3").args(["-c", "import venv, ensurepip"])).is_ok(),
        packages: Packages {
            apt: &["python3-venv"],
            homebrew: &["python"],
            dnf: &["python3-pip"],
            pacman: &["python-pip"],
            zypper: &["python3-pip"],
            winget: &["Python.Python.3.13"],
        },
    },
];

/// A debugger that knows the board's processor.
pub(crate) const DEBUGGER_TOOLS: [Tool; 1] = [Tool {
    name: "gdb-multiarch",
    purpose: "debugs the flashed image through probe-rs",
    is_present: || any_on_path(&["gdb-multiarch", "arm-none-eabi-gdb"]),
    packages: Packages {
        apt: &["gdb-multiarch"],
        homebrew: &["arm-none-eabi-gdb"],
        dnf: &[],
        pacman: &["arm-none-eabi-gdb"],
        zypper: &[],
        winget: &["Arm.GnuArmEmbeddedToolchain"],
    },
}];

/// A compiler of C++. One of C is there with Rust, which links with it.
pub(crate) const CPP_TOOLS: [Tool; 1] = [Tool {
    name: "c++",
    purpose: "compiles the example in C++",
    is_present: || any_on_path(&["c++"]),
    packages: Packages {
        apt: &["g++"],
        homebrew: &["gcc"],
        dnf: &["gcc-c++"],
        pacman: &["gcc"],
        zypper: &["gcc-c++"],
        winget: &[],
    },
}];

fn any_on_path(names: &[&str]) -> bool {
    names.iter().any(|name| shell::on_path(name).is_some())
}

/// libclang together with its headers: the library alone does not find `stddef.h`.
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
        "C:\\Program Files\\LLVM\\bin",
    ]
    .map(PathBuf::from)
    .to_vec();
    if let Ok(folder) = shell::stdout_of(shell::command("llvm-config").arg("--libdir")) {
        folders.push(folder.trim().into());
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

/// `libclang.so`, `libclang-14.so.1`, `libclang.dylib`, `libclang.dll`; not `libclang-cpp.so`.
fn is_libclang(file: &str) -> bool {
    let Some(rest) = file.strip_prefix("libclang") else { return false };
    let rest = rest.strip_prefix('-').unwrap_or(rest).trim_start_matches(|c: char| c.is_ascii_digit());
    [".so", ".dylib", ".dll"].iter().any(|ending| rest.starts_with(ending))
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
    fn libclang_is_recognised_by_its_file_name() {
        for name in ["libclang.so", "libclang.so.14", "libclang-14.so.1", "libclang.dylib", "libclang.dll"] {
            assert!(is_libclang(name), "{name}");
        }
        for name in ["libclang-cpp.so.14", "libclangAST.a", "libc.so", "libclang_rt.asan.a"] {
            assert!(!is_libclang(name), "{name}");
        }
    }
}
