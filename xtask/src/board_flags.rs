//! The compiler's flags for what is built for the board.
//!
//! Paths of this computer are kept out: two checkouts in different folders make the same bytes.
//! The compiler writes paths of source files into panics, log statements and debug information. Its option `--remap-path-prefix` replaces
//! the beginning of each: the workspace becomes `.`, the registry's packages `registry`, Rust's library `rust`. The options are in the
//! environment, which every other setting of flags yields to; flags of the user's environment stay in front of them.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Between two options in `CARGO_ENCODED_RUSTFLAGS`.
const BETWEEN: &str = "\u{1f}";

/// The variable with the flags, and its value, for a workspace and its target folder. `library` has the folders under which the compiler finds
/// the source of Rust's library.
pub(crate) fn variable(root: &Path, target_dir: &Path, library: &[PathBuf]) -> Result<(&'static str, String)> {
    let users = users_flags(std::env::var("CARGO_ENCODED_RUSTFLAGS").ok(), std::env::var("RUSTFLAGS").ok());
    let all = [users, prefixes(root, target_dir, &packages()?, library)].concat();
    Ok(("CARGO_ENCODED_RUSTFLAGS", all.join(BETWEEN)))
}

/// The flags that the user has set: cargo reads only the first of the two variables.
fn users_flags(encoded: Option<String>, plain: Option<String>) -> Vec<String> {
    match (encoded, plain) {
        (Some(encoded), _) => encoded.split(BETWEEN).filter(|flag| !flag.is_empty()).map(str::to_owned).collect(),
        (None, Some(plain)) => plain.split_whitespace().map(str::to_owned).collect(),
        (None, None) => Vec::new(),
    }
}

/// An option for each folder. Of two that fit, the compiler takes the later one, so folders inside of the workspace come after it.
fn prefixes(root: &Path, target_dir: &Path, packages: &[PathBuf], library: &[PathBuf]) -> Vec<String> {
    let option = |from: &Path, to: &str| format!("--remap-path-prefix={}={to}", from.display());
    // What build scripts write is in the target folder, which can be outside of the workspace.
    let mut options = vec![option(root, "."), option(target_dir, "./target")];
    options.extend(packages.iter().map(|folder| option(folder, "registry")));
    options.extend(library.iter().map(|folder| option(folder, "rust")));
    options
}

/// The folders in which cargo keeps the source of packages, one a registry. They are there: this program was built from such packages. Packages
/// in a folder of the user's own (`cargo vendor`) are in none of them.
fn packages() -> Result<Vec<PathBuf>> {
    let home = std::env::var_os("CARGO_HOME").filter(|home| !home.is_empty()).map(PathBuf::from);
    let Some(home) = home.or_else(|| Some(std::env::home_dir()?.join(".cargo"))) else { return Ok(Vec::new()) };
    let source = home.join("registry/src");
    if !source.is_dir() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(&source).with_context(|| format!("reading {}", source.display()))?;
    let mut folders: Vec<PathBuf> = entries.filter_map(Result::ok).map(|entry| entry.path()).collect();
    folders.retain(|folder| is_of_a_registry(folder));
    folders.sort();
    Ok(folders)
}

/// Whether the folder is a registry's, which has the host in its name. The name of one that `cargo package` makes for packages of a workspace begins with
/// `-`. Nothing is built for the board from there, and another option would make cargo compile everything again.
fn is_of_a_registry(folder: &Path) -> bool {
    folder.file_name().is_some_and(|name| !name.as_encoded_bytes().starts_with(b"-"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_users_flags_come_first() {
        assert_eq!(users_flags(None, Some("-Dwarnings  -Cdebuginfo=1".into())), ["-Dwarnings", "-Cdebuginfo=1"]);
        let encoded = Some(format!("-Clink-arg=a b{BETWEEN}-Dwarnings"));
        assert_eq!(users_flags(encoded, Some("-A".into())), ["-Clink-arg=a b", "-Dwarnings"]);
        assert!(users_flags(Some(String::new()), None).is_empty());
    }

    #[test]
    fn what_cargo_package_unpacks_changes_no_option() {
        for (name, wanted) in [("index.crates.io-1949cf8c6b5b557f", true), ("-3f6b5b557f194908", false)] {
            assert_eq!(is_of_a_registry(&Path::new("/home/me/.cargo/registry/src").join(name)), wanted, "{name}");
        }
    }

    #[test]
    fn a_folder_inside_of_another_comes_after_it() {
        let options =
            prefixes(Path::new("/w"), Path::new("/t"), &["/w/home/registry/src/a".into()], &["/usr/src/rust".into()]);
        assert_eq!(
            options,
            [
                "--remap-path-prefix=/w=.",
                "--remap-path-prefix=/t=./target",
                "--remap-path-prefix=/w/home/registry/src/a=registry",
                "--remap-path-prefix=/usr/src/rust=rust"
            ]
        );
    }
}
