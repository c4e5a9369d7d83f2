//! Writes what a command produces: data to standard output, and files.
//!
//! One set of rules for all files: one that exists is replaced only with `--force`, an input is never replaced, and a device, a pipe or a
//! link is written through. A command checks its outputs before it does any work ([`check`]).

use gait_trace::format::whole_file;
use gait_trace::format::whole_file::Target;
use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
#[cfg(feature = "analysis")]
use std::path::PathBuf;

use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;

/// Writes text to standard output, [`messages::escaped`]. A reader that closes the pipe early is no failure.
///
/// # Errors
/// Standard output cannot be written.
pub fn print(text: &str) -> Result<(), Failure> {
    print_bytes(messages::escaped(text).as_bytes())
}

/// Writes bytes to standard output, as [`print()`].
///
/// # Errors
/// As [`print()`].
pub fn print_bytes(bytes: &[u8]) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::run(error)),
        _ => Ok(()),
    }
}

/// Refuses an output that may not be written: a file that exists, without `--force`; a folder; a file in a folder that does not exist.
///
/// # Errors
/// The output may not be written.
pub fn check(path: &Path, overwrite: Overwrite) -> Result<(), Failure> {
    let wrong = |why: &str| Err(Failure::input(format!("{}: {why}", path.display())));
    match Target::of(path) {
        Err(error) => wrong(&error.to_string()),
        Ok(Target::File(_)) if !overwrite.force => {
            wrong("exists already and is kept; name another file, or replace it with --force")
        }
        Ok(Target::New(_))
            if path.parent().is_some_and(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) =>
        {
            wrong("its folder does not exist; make it first")
        }
        Ok(_) => Ok(()),
    }
}

/// Refuses outputs that are an input, also by another link, or that are named twice.
///
/// # Errors
/// An output is one of these.
pub fn check_apart<'p>(
    outputs: impl IntoIterator<Item = &'p Path>,
    inputs: impl IntoIterator<Item = &'p Path>,
) -> Result<(), Failure> {
    let inputs: Vec<&Path> = inputs.into_iter().collect();
    let mut before: Vec<&Path> = Vec::new();
    for output in outputs {
        let wrong = |why: &str| Err(Failure::input(format!("{}: {why}", output.display())));
        if inputs.iter().any(|input| same_file(output, input)) {
            return wrong("is an input of this command; allowed is another file");
        }
        if before.iter().any(|other| same_file(output, other) || *other == output) {
            return wrong("is named twice; allowed are different files");
        }
        before.push(output);
    }
    Ok(())
}

/// Both exist and are the same regular file: by the same path, a symbolic link, or a hard link.
#[must_use]
pub fn same_file(a: &Path, b: &Path) -> bool {
    let (Ok(of_a), Ok(of_b)) = (a.metadata(), b.metadata()) else { return false };
    of_a.is_file() && of_b.is_file() && (same_node(&of_a, &of_b) || same_path(a, b))
}

fn same_path(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

#[cfg(unix)]
fn same_node(a: &std::fs::Metadata, b: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn same_node(_: &std::fs::Metadata, _: &std::fs::Metadata) -> bool {
    false
}

/// Writes a file: the whole of it, or nothing.
///
/// # Errors
/// As [`check`], or the file cannot be written, or `content` fails.
pub fn write(
    path: &Path,
    overwrite: Overwrite,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Failure> {
    check(path, overwrite)?;
    whole_file::write(path, content).map_err(|error| cannot_write(path, error))
}

/// Writes a text file: the whole of it, or nothing.
///
/// # Errors
/// As [`write()`].
pub fn write_text(path: &Path, text: &str, overwrite: Overwrite) -> Result<(), Failure> {
    write_bytes(path, text.as_bytes(), overwrite)
}

/// Writes a file: the whole of it, or nothing.
///
/// # Errors
/// As [`write()`].
pub fn write_bytes(path: &Path, bytes: &[u8], overwrite: Overwrite) -> Result<(), Failure> {
    write(path, overwrite, |out| out.write_all(bytes))
}

/// Writes files to a folder, which is made if it is not there, and returns their paths. If one of them may not be written, none is.
///
/// # Errors
/// As [`write()`], or the folder cannot be made.
#[cfg(feature = "analysis")]
pub fn write_all(
    folder: &Path,
    files: &[(impl AsRef<Path>, impl AsRef<[u8]>)],
    overwrite: Overwrite,
) -> Result<Vec<PathBuf>, Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::input(format!("{}: cannot be made: {error}", folder.display())))?;
    let paths: Vec<PathBuf> = files.iter().map(|(name, _)| folder.join(name)).collect();
    paths.iter().try_for_each(|path| check(path, overwrite))?;
    paths.iter().zip(files).try_for_each(|(path, (_, content))| write_bytes(path, content.as_ref(), overwrite))?;
    Ok(paths)
}

/// Begins a file that grows during a run; [`check`] comes first. An existing file is emptied.
///
/// # Errors
/// The file cannot be opened.
pub fn begin(path: &Path) -> io::Result<File> {
    Target::of(path)?.open()
}

/// The failure of a file that cannot be written.
#[must_use]
pub fn cannot_write(path: &Path, error: impl fmt::Display) -> Failure {
    Failure::run(format!("{}: cannot be written: {error}", path.display()))
}

/// Prints notes for the user to standard error, one a line.
pub fn notes(notes: impl IntoIterator<Item = impl fmt::Display>) {
    notes.into_iter().for_each(messages::note);
}

/// Prints defects of a recording to standard error, each with its level.
#[cfg(feature = "analysis")]
pub fn findings<'f>(findings: impl IntoIterator<Item = &'f gait_trace::Finding>) {
    findings.into_iter().for_each(|finding| levelled(finding.level(), finding));
}

/// Prints a message with the level of a finding to standard error.
#[cfg(feature = "analysis")]
pub fn levelled(level: gait_trace::Level, text: impl fmt::Display) {
    match level {
        gait_trace::Level::Note => messages::note(text),
        gait_trace::Level::Warning => messages::warning(text),
        gait_trace::Level::Error => messages::error(text),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn a_file_that_exists_is_replaced_only_by_force() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        write_text(&path, "one", Overwrite::default()).unwrap();
        let refused = write_text(&path, "two", Overwrite::default()).unwrap_err();
        assert!(refused.exit_code() == 2 && refused.to_string().contains("--force"), "{refused}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "one");
        write_text(&path, "two", Overwrite { force: true }).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "two");
        let nowhere = check(&folder.path().join("no/where.csv"), Overwrite::default()).unwrap_err().to_string();
        assert!(nowhere.contains("its folder does not exist"), "{nowhere}");
        assert!(check(folder.path(), Overwrite::OWN).unwrap_err().to_string().contains("a folder"));
        // What is written through is never replaced, so it needs no force.
        check(Path::new("/dev/null"), Overwrite::default()).unwrap();
    }

    #[test]
    fn an_input_is_known_by_every_link() {
        let folder = tempfile::tempdir().unwrap();
        let [file, soft, hard, other] = ["a.csv", "b.csv", "c.csv", "d.csv"].map(|name| folder.path().join(name));
        std::fs::write(&file, "x").unwrap();
        std::fs::write(&other, "x").unwrap();
        symlink(&file, &soft).unwrap();
        std::fs::hard_link(&file, &hard).unwrap();
        for output in [&file, &soft, &hard] {
            let refused = check_apart([output.as_path()], [file.as_path()]).unwrap_err().to_string();
            assert!(refused.contains("is an input of this command"), "{refused}");
        }
        check_apart([other.as_path()], [file.as_path()]).unwrap();
        let twice = folder.path().join("new.csv");
        assert!(check_apart([twice.as_path(), twice.as_path()], []).unwrap_err().to_string().contains("named twice"));
    }
}
