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
    /// The packages that contain it, with spaces between them: for apt, dnf, pacman, zypper, Homebrew, winget. Empty if there is no such package, or the
    /// tool is not needed on that system.
    pub(crate) packages: [&'static str; 6],
}

impl std::fmt::Debug for Tool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

const fn tool(
    name: &'static str,
    purpose: &'static str,
    packages: [&'static str; 6],
    is_present: fn() -> bool,
) -> Tool {
    Tool { name, purpose, is_present, packages }
}

/// Debian's compiler, cargo, library source and linker.
pub(crate) const DEBIAN_COMPILER: Tool = tool(
    "Debian's compiler for the board",
    "its rustc, cargo, library source (all of one version) and linker build the firmware",
    [toolchain::DEBIAN_PACKAGES, "", "", "", "", ""],
    toolchain::has_debian_packages,
);

/// Tools that build Unicorn, the processor emulator of the virtual board. Its build script runs QEMU's `configure`, which needs `pkg-config`, and then
/// cmake; the Rust binding is generated with libclang.
pub(crate) const UNICORN_TOOLS: [Tool; 5] = [
    tool(
        "C compiler",
        "compiles Unicorn, the processor emulator of the virtual board",
        ["gcc libc6-dev", "gcc", "gcc", "gcc", "gcc", "Microsoft.VisualStudio.2022.BuildTools"],
        || std::env::var_os("CC").is_some() || any_on_path(&["cc", "gcc", "clang", "cl"]) || cfg!(windows),
    ),
    tool(
        "cmake",
        "configures the build of Unicorn",
        ["cmake", "cmake", "cmake", "cmake", "cmake", "Kitware.CMake"],
        || std::env::var_os("CMAKE").is_some() || any_on_path(&["cmake"]),
    ),
    tool(
        "make or ninja",
        "runs the build of Unicorn",
        ["make", "make", "make", "make", "make", "Ninja-build.Ninja"],
        || any_on_path(&["make", "ninja"]) || cfg!(windows),
    ),
    tool(
        "pkg-config",
        "Unicorn's configure script stops without it",
        ["pkg-config", "pkgconf-pkg-config", "pkgconf", "pkgconf-pkg-config", "pkgconf", ""],
        || std::env::var_os("PKG_CONFIG").is_some() || any_on_path(&["pkg-config"]) || cfg!(windows),
    ),
    tool(
        "libclang with its headers",
        "generates the Rust binding to Unicorn",
        ["libclang-dev", "clang-devel", "clang", "clang-devel", "llvm", "LLVM.LLVM"],
        has_libclang,
    ),
];

/// A terminal for tests. Other systems have a `script` with other options.
pub(crate) const TERMINAL_TOOLS: [Tool; 1] = [tool(
    "script of util-linux",
    "makes a terminal for the tests of programs that ask for keys",
    ["bsdutils", "util-linux", "util-linux", "util-linux", "", ""],
    || shell::stdout_of(shell::command("script").arg("--version")).is_ok_and(|text| text.contains("util-linux")),
)];

/// JavaScript outside a browser.
pub(crate) const NODE_TOOLS: [Tool; 2] = [
    tool(
        "node",
        "runs JavaScript programs",
        ["nodejs", "nodejs", "nodejs", "nodejs", "node", "OpenJS.NodeJS.LTS"],
        || any_on_path(&["node"]),
    ),
    tool(
        "npm",
        "installs JavaScript packages",
        ["npm", "nodejs-npm", "npm", "npm", "node", "OpenJS.NodeJS.LTS"],
        || any_on_path(&["npm"]),
    ),
];

/// Python, with the modules for virtual environments.
pub(crate) const PYTHON_TOOLS: [Tool; 2] = [
    tool(
        "python3",
        "runs Python programs",
        ["python3", "python3", "python", "python3", "python", "Python.Python.3.13"],
        || any_on_path(&["python3"]),
    ),
    tool(
        "Python's venv and pip",
        "install Python packages into a folder of their own",
        ["python3-venv", "python3-pip", "python-pip", "python3-pip", "python", "Python.Python.3.13"],
        || shell::stdout_of(shell::command("python3").args(["-c", "import venv, ensurepip"])).is_ok(),
    ),
];

/// A debugger that knows the board's processor.
pub(crate) const DEBUGGER_TOOLS: [Tool; 1] = [tool(
    "gdb-multiarch",
    "debugs the flashed image through probe-rs",
    ["gdb-multiarch", "", "arm-none-eabi-gdb", "", "arm-none-eabi-gdb", "Arm.GnuArmEmbeddedToolchain"],
    || any_on_path(&["gdb-multiarch", "arm-none-eabi-gdb"]),
)];

/// A compiler of C++. One of C is there with Rust, which links with it.
pub(crate) const CPP_TOOLS: [Tool; 1] =
    [tool("c++", "compiles the example in C++", ["g++", "gcc-c++", "gcc", "gcc-c++", "gcc", ""], || {
        any_on_path(&["c++"])
    })];

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
