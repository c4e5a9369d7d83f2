//! `cargo xtask dist`: packs a release: an image of each board, the program, its completions and manual pages, the documentation as pages and
//! as a book, and the samples, with check sums.
//!
//! The virtual board is not in it: it is GPL-2.0, and is built from the source.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Args;
use sha2::{Digest, Sha256};

use crate::board::{Board, Variant};
use crate::book;
use crate::folder::empty_folder;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// The folder for the release, new or empty [default: dist below cargo's target folder, which is emptied]
    #[arg(short, long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

/// The file with the check sums of all others, as `sha256sum --check` reads it.
const CHECK_SUMS: &str = "SHA256SUMS";

/// Files and folders of the repository that a release has.
const COPIED: [&str; 7] =
    ["README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE-APACHE", "LICENSE-MIT", "docs", "samples"];

/// Shells, with the name under which each looks for the completions of a program.
const COMPLETIONS: [(&str, &str); 5] = [
    ("bash", "footfall.bash"),
    ("elvish", "footfall.elv"),
    ("fish", "footfall.fish"),
    ("powershell", "_footfall.ps1"),
    ("zsh", "_footfall"),
];

/// Builds and packs the release.
pub(crate) fn dist(options: &Options) -> Result<ExitCode> {
    let mut workspace = Workspace::open()?;
    let out = match &options.out {
        Some(folder) => empty_folder(workspace.started_in.join(folder))?,
        None => emptied(workspace.target_dir.join("dist"))?,
    };
    workspace.set_up(&[Need::BoardCompiler])?;
    let name = format!("footfall-{}-{}-{}", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH, std::env::consts::OS);
    let release = out.join(&name);

    let program = workspace.footfall()?;
    let installed = release.join("bin").join(program.file_name().context("the program has no name")?);
    copy(&program, &installed)?;
    for board in Board::ALL {
        for variant in [Variant::SHADOW, Variant::USUAL] {
            let image = workspace.firmware(board, variant)?;
            copy(&image.elf, &release.join("images").join(image.elf.file_name().context("the image has no name")?))?;
        }
    }
    for (shell, file) in COMPLETIONS {
        let text = shell::stdout_of(shell::command(&program).args(["completions", shell]))?;
        write(&release.join("completions").join(file), text.as_bytes())?;
    }
    let pages = release.join("man");
    shell::stdout_of(shell::command(&program).args(["man", "-o"]).arg(&pages))?;
    book::build(&release.join("book"))?;
    for copied in COPIED {
        copy(Path::new(copied), &release.join(copied))?;
    }

    let sums = check_sums(&release)?;
    let files = sums.lines().count();
    write(&release.join(CHECK_SUMS), sums.as_bytes())?;
    let archive = out.join(format!("{name}.tar.gz"));
    shell::must_succeed(shell::command("tar").current_dir(&out).arg("-czf").arg(&archive).arg(&name), "tar")?;
    let sum = format!("{}  {name}.tar.gz\n", sha256(&archive)?);
    write(&out.join(format!("{name}.tar.gz.sha256")), sum.as_bytes())?;
    eprintln!("packed: {files} files and their check sums in {}", release.display());
    println!("{}", archive.display());
    Ok(ExitCode::SUCCESS)
}

/// A folder of our own: what an earlier run left in it goes.
fn emptied(folder: PathBuf) -> Result<PathBuf> {
    if folder.is_dir() {
        std::fs::remove_dir_all(&folder).with_context(|| format!("removing {}", folder.display()))?;
    }
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    Ok(folder)
}

/// Copies a file, or a folder with all that is in it.
fn copy(from: &Path, to: &Path) -> Result<()> {
    if !from.is_dir() {
        make_folder_of(to)?;
        return std::fs::copy(from, to)
            .map(drop)
            .with_context(|| format!("copying {} to {}", from.display(), to.display()));
    }
    for file in std::fs::read_dir(from).with_context(|| format!("reading {}", from.display()))? {
        let file = file.with_context(|| format!("reading {}", from.display()))?;
        copy(&file.path(), &to.join(file.file_name()))?;
    }
    Ok(())
}

fn write(file: &Path, bytes: &[u8]) -> Result<()> {
    make_folder_of(file)?;
    std::fs::write(file, bytes).with_context(|| format!("writing {}", file.display()))
}

fn make_folder_of(file: &Path) -> Result<()> {
    let Some(folder) = file.parent() else { return Ok(()) };
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))
}

/// A line for each file below a folder, in the order of the names.
fn check_sums(folder: &Path) -> Result<String> {
    let mut files = vec![];
    list(folder, "", &mut files)?;
    files.sort();
    files.iter().map(|name| Ok(format!("{}  {name}\n", sha256(&folder.join(name))?))).collect()
}

/// Adds the names of the files below `folder`, each relative to the first folder, with `/` between folders on every system.
fn list(folder: &Path, before: &str, files: &mut Vec<String>) -> Result<()> {
    for file in std::fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))? {
        let file = file.with_context(|| format!("reading {}", folder.display()))?;
        let name = file.file_name().into_string().ok().context("a file's name is not text")?;
        if file.path().is_dir() {
            list(&file.path(), &format!("{before}{name}/"), files)?;
        } else {
            files.push(format!("{before}{name}"));
        }
    }
    Ok(())
}

fn sha256(file: &Path) -> Result<String> {
    let bytes = std::fs::read(file).with_context(|| format!("reading {}", file.display()))?;
    Ok(Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        emptied(std::env::temp_dir().join(format!("footfall-dist-{name}-{}", std::process::id()))).unwrap()
    }

    /// FIPS 180-4 and its examples: the digests of the empty message and of `abc`.
    #[test]
    fn check_sums_have_every_file_once_in_order() {
        let release = folder("sums");
        write(&release.join("man/b.1"), b"abc").unwrap();
        write(&release.join("a"), b"").unwrap();
        let (empty, abc) = (
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
        );
        assert_eq!(check_sums(&release).unwrap(), format!("{empty}  a\n{abc}  man/b.1\n"));
        std::fs::remove_dir_all(release).unwrap();
    }

    #[test]
    fn a_folder_is_copied_with_what_is_in_it() {
        let (from, to) = (folder("from"), folder("to"));
        write(&from.join("one/two/file"), b"abc").unwrap();
        write(&from.join("other"), b"").unwrap();
        copy(&from, &to.join("copy")).unwrap();
        assert_eq!(check_sums(&to.join("copy")).unwrap(), check_sums(&from).unwrap());
        assert!(to.join("copy/one/two/file").is_file());
        std::fs::remove_dir_all(from).unwrap();
        std::fs::remove_dir_all(to).unwrap();
    }

    #[test]
    fn a_folder_with_files_is_not_written_to() {
        let out = folder("kept");
        write(&out.join("mine"), b"abc").unwrap();
        assert!(empty_folder(out.clone()).unwrap_err().to_string().contains("is not empty"));
        assert_eq!(std::fs::read(out.join("mine")).unwrap(), b"abc");
        std::fs::remove_dir_all(out).unwrap();
    }

    /// Every file that a release copies is in the repository.
    #[test]
    fn what_is_copied_exists() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        for copied in COPIED {
            assert!(root.join(copied).exists(), "{copied}");
        }
    }
}
