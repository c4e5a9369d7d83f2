//! Writes a file completely or not at all: to a temporary file in the same folder, flushed to disk, then renamed.
//!
//! Only a regular file is ever replaced. A symbolic link stays: the file that it leads to is replaced. A device, a pipe or a standard
//! stream (`/dev/null`, `/dev/stdout`) stays too: the content is written through it.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::hash::{Hash, Hasher};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// What is at the path of an output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// Nothing; a file can be made there.
    New(PathBuf),
    /// A regular file, with links resolved.
    File(PathBuf),
    /// A device, a pipe or a standard stream.
    Stream(PathBuf),
}

impl Target {
    /// Looks at the path.
    ///
    /// # Errors
    /// It is a folder, or a link that leads to no file.
    pub fn of(path: &Path) -> io::Result<Self> {
        let wrong = |kind, why: &str| Err(io::Error::new(kind, why));
        if path.file_name().is_none() {
            return wrong(io::ErrorKind::InvalidInput, "not the name of a file");
        }
        let named = match fs::symlink_metadata(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::New(path.into())),
            named => named?,
        };
        // Follows the links of open files in /dev/fd, of which some have no path.
        let meant = match fs::metadata(path) {
            Err(error) if named.is_symlink() && error.kind() == io::ErrorKind::NotFound => {
                return wrong(io::ErrorKind::NotFound, "a link to no file; name the file itself");
            }
            meant => meant?,
        };
        if meant.is_dir() {
            return wrong(io::ErrorKind::IsADirectory, "a folder; allowed is the name of a file");
        }
        if meant.is_file() && open_file(path).is_none() {
            return Ok(Self::File(if named.is_symlink() { path.canonicalize()? } else { path.into() }));
        }
        Ok(Self::Stream(path.into()))
    }

    /// Opens the target for bytes that are written one after the other. A regular file is emptied; a stream is written through.
    ///
    /// # Errors
    /// It cannot be opened, or it is a pipe from which no program reads.
    pub fn open(&self) -> io::Result<File> {
        match self {
            Self::New(path) | Self::File(path) => File::create(path),
            Self::Stream(path) => {
                if let Some(own) = own_stream(path) {
                    return own;
                }
                let reader = reader_of(path)?;
                let file = OpenOptions::new().append(true).open(path);
                drop(reader);
                file
            }
        }
    }
}

/// The number of an open file of this process, if the path is one: `/dev/stdout`, `/dev/fd/3`.
fn open_file(path: &Path) -> Option<u32> {
    let folder = path.parent()?.canonicalize().ok()?;
    match path.file_name()?.to_str()? {
        "stdout" if folder == Path::new("/dev") => Some(1),
        "stderr" if folder == Path::new("/dev") => Some(2),
        number if folder.starts_with("/proc") && folder.ends_with("fd") => number.parse().ok(),
        _ => None,
    }
}

/// Standard output or standard error itself. Opened by its path, a file behind it would have a place of its own for the next byte, and
/// what others write there would overwrite ours.
#[cfg(unix)]
fn own_stream(path: &Path) -> Option<io::Result<File>> {
    use std::os::fd::AsFd;
    let own = match open_file(path)? {
        1 => io::stdout().as_fd().try_clone_to_owned(),
        2 => io::stderr().as_fd().try_clone_to_owned(),
        _ => return None,
    };
    Some(own.map(File::from))
}

#[cfg(not(unix))]
fn own_stream(_: &Path) -> Option<io::Result<File>> {
    None
}

/// Opens a pipe without waiting, so that one without a reader is an error and not an endless wait; the other end stays open meanwhile.
#[cfg(unix)]
fn reader_of(path: &Path) -> io::Result<Option<File>> {
    use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
    if !fs::metadata(path)?.file_type().is_fifo() {
        return Ok(None);
    }
    match OpenOptions::new().write(true).custom_flags(libc::O_NONBLOCK).open(path) {
        Err(error) if error.raw_os_error() == Some(libc::ENXIO) => {
            Err(io::Error::other("a pipe from which no program reads; start the reader first"))
        }
        opened => opened.map(Some),
    }
}

#[cfg(not(unix))]
fn reader_of(_: &Path) -> io::Result<Option<File>> {
    Ok(None)
}

/// Calls `content` with a writer, and puts the result at `path` if it succeeds.
///
/// # Errors
/// The file cannot be written. No temporary file remains, and an existing file at `path` is unchanged.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("walk.csv");
/// gait_trace::format::whole_file::write(&path, |out| out.write_all(b"whole"))?;
/// let failed = gait_trace::format::whole_file::write(&path, |out| {
///     out.write_all(b"half")?;
///     Err(std::io::Error::other("power cut"))
/// });
/// assert!(failed.is_err());
/// assert_eq!(std::fs::read_to_string(&path)?, "whole");
/// assert_eq!(std::fs::read_dir(folder.path())?.count(), 1);
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn write(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let target = Target::of(path)?;
    let path = match &target {
        Target::New(path) | Target::File(path) => path,
        // A stream cannot be replaced: what was written stays written.
        Target::Stream(_) => return fill(target.open()?, content).map(drop),
    };
    let (part, file) = part_beside(path)?;
    let written = fill(file, content).and_then(|file| file.sync_all()).and_then(|()| fs::rename(&part, path));
    if written.is_err() {
        // The error of the write is reported; one of the removal adds nothing.
        let _ = fs::remove_file(&part);
    }
    written
}

fn fill(file: File, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<File> {
    let mut out = BufWriter::new(file);
    content(&mut out)?;
    out.into_inner().map_err(io::IntoInnerError::into_error)
}

/// Bytes of a name that the file in the making has too, before its ending.
const MOST_NAME: usize = 200;

/// A new file in the same folder, so that the rename stays on one file system.
fn part_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not the name of a file"))?;
    let mut part_name = OsString::from(".");
    match name.len() {
        ..=MOST_NAME => part_name.push(name),
        // With an ending it would be longer than a name may be; two long names may begin alike.
        _ => {
            let mut hasher = std::hash::DefaultHasher::new();
            name.hash(&mut hasher);
            part_name.push(format!("{:016x}", hasher.finish()));
        }
    }
    part_name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(part_name);
    let file = OpenOptions::new().write(true).create(true).truncate(true).open(&part)?;
    Ok((part, file))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::io::Read;
    use std::os::unix::fs::{FileTypeExt, symlink};
    use std::process::Command;

    fn node(path: &Path, kind: &[&str]) -> bool {
        Command::new("mknod").arg(path).args(kind).status().is_ok_and(|status| status.success())
    }

    #[test]
    fn a_link_stays_and_its_file_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file.csv"), folder.path().join("link.csv"));
        fs::write(&file, "old").unwrap();
        symlink(&file, &link).unwrap();
        write(&link, |out| out.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        fs::remove_file(&file).unwrap();
        let error = write(&link, |out| out.write_all(b"new")).unwrap_err().to_string();
        assert!(error.contains("a link to no file") && !file.exists(), "{error}");
    }

    /// File systems allow names of 255 bytes.
    #[test]
    fn the_longest_name_is_written() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["n".repeat(255), "é".repeat(127)] {
            let path = folder.path().join(&name);
            write(&path, |out| out.write_all(b"whole")).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), "whole");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_pipe_is_written_through_if_it_has_a_reader() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe.csv");
        assert!(node(&pipe, &["p"]));
        let error = write(&pipe, |out| out.write_all(b"x")).unwrap_err().to_string();
        assert!(error.contains("no program reads"), "{error}");
        let (from, long) = (pipe.clone(), vec![b'7'; 300_000]);
        let reader = std::thread::spawn(move || {
            let mut bytes = Vec::new();
            File::open(from).unwrap().read_to_end(&mut bytes).unwrap();
            bytes
        });
        // The reader may not have opened it yet.
        let began = std::time::Instant::now();
        while write(&pipe, |out| out.write_all(&long)).is_err() {
            assert!(began.elapsed().as_secs() < 20, "no reader came");
        }
        assert!(reader.join().unwrap() == long);
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// Devices made here, not the machine's own: a node like /dev/full refuses every byte, one like /dev/null takes all. Who may not make
    /// a node may not replace the machine's own either; then a link to it is used.
    #[test]
    fn a_device_stays_a_device() {
        let folder = tempfile::tempdir().unwrap();
        for (name, minor, takes) in [("null", "3", true), ("full", "7", false)] {
            let device = folder.path().join(name);
            if !node(&device, &["c", "1", minor]) || OpenOptions::new().append(true).open(&device).is_err() {
                let _ = fs::remove_file(&device);
                symlink(Path::new("/dev").join(name), &device).unwrap();
            }
            assert_eq!(write(&device, |out| out.write_all(b"x")).is_ok(), takes, "{name}");
            assert!(fs::metadata(&device).unwrap().file_type().is_char_device(), "{name} was replaced");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
