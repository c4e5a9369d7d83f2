//! Finds the recordings under the paths of the command line, and gives each a name.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::job::name_of;
use crate::board::image::sha256;
use crate::failure::Failure;
use crate::messages;

/// File extensions of recordings.
const EXTENSIONS: &[&str] = &["csv", "mot", "sto", "c3d", "mcap", "mvnx", "trc", "tsv", "txt", "gcd"];

/// Longest name, bytes: file systems allow 255, and the files of results have an ending of 13 behind it and one of a copy in the making.
const MOST_NAME: usize = 220;
/// What is left of a longer one, before the sum.
const SHORT_NAME: usize = 180;

/// A recording and the name that its files get.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Recording {
    /// The path within the named folder, with `__` between the parts.
    pub(super) name: String,
    pub(super) path: PathBuf,
    /// Found in a folder; otherwise named on the command line.
    pub(super) found: bool,
}

/// What is under the paths.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// The recordings, sorted by name, each file once.
    pub(super) all: Vec<Recording>,
    /// Number of files with other extensions, by extension.
    pub(super) others: BTreeMap<String, usize>,
}

/// Finds every recording under the paths. The folder `out` is not searched, and a link that leads out of a named folder is not followed.
pub(super) fn recordings(paths: &[PathBuf], out: &Path) -> Result<Found, Failure> {
    let mut found = Found::default();
    for path in paths {
        let all = &mut found.all;
        if path.is_dir() {
            let wrong = |error| Failure::input(format!("{}: cannot be read: {error}", path.display()));
            search(path, &Top { path, real: path.canonicalize().map_err(wrong)? }, out, &mut found)?;
        } else if path.exists() {
            all.push(Recording { name: name_of(path), path: path.clone(), found: false });
        } else {
            return Err(Failure::input(format!("{}: no such file or folder", path.display())));
        }
    }
    let all = &mut found.all;
    all.sort();
    all.dedup();
    if all.is_empty() {
        let paths: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        let extensions = EXTENSIONS.join(", .");
        return Err(Failure::input(format!("{}: has no recording; allowed are files .{extensions}", paths.join(", "))));
    }
    shorten_names(all);
    make_names_unique(all);
    Ok(found)
}

/// Renames recordings whose names are too long for files with an ending behind them, with a note: the beginning, and a sum of the name.
fn shorten_names(all: &mut [Recording]) {
    for recording in all.iter_mut().filter(|recording| recording.name.len() > MOST_NAME) {
        let (stem, extension) = recording.name.rsplit_once('.').unwrap_or((&recording.name, ""));
        let (stem, extension) =
            (&stem[..stem.floor_char_boundary(SHORT_NAME)], &extension[..extension.floor_char_boundary(8)]);
        let name = format!("{stem}~{}.{extension}", &sha256(recording.name.as_bytes())[..8]);
        messages::note(format_args!(
            "{} is called {name}: its name is too long for a file of results",
            recording.path.display()
        ));
        recording.name = name;
    }
}

/// Renames recordings of equal names, in the order of their paths, with a note; one file by two paths is one recording.
fn make_names_unique(all: &mut Vec<Recording>) {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    all.dedup_by(|later, first| later.name == first.name && real(&later.path) == real(&first.path));
    let mut taken: BTreeSet<String> = all.iter().map(|recording| recording.name.clone()).collect();
    for n in 1..all.len() {
        if all[..n].iter().any(|before| before.name == all[n].name) {
            let (stem, extension) = all[n].name.rsplit_once('.').unwrap_or((&all[n].name, ""));
            let free = (2..).map(|k| format!("{stem}~{k}.{extension}")).find(|name| !taken.contains(name));
            let name = free.unwrap_or_default();
            messages::note(format_args!(
                "{} is called {name}: another recording has the same name",
                all[n].path.display()
            ));
            taken.insert(name.clone());
            all[n].name = name;
        }
    }
}

/// A folder of the command line.
struct Top<'p> {
    path: &'p Path,
    /// Where it is, without links.
    real: PathBuf,
}

fn search(folder: &Path, top: &Top<'_>, out: &Path, found: &mut Found) -> Result<(), Failure> {
    let wrong = |error: std::io::Error| Failure::input(format!("{}: cannot be read: {error}", folder.display()));
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let entry = entry.map_err(wrong)?;
        let path = entry.path();
        // A link to a folder may lead back to a folder above it; a link to a file of the same folder is a recording by another name.
        if entry.file_type().map_err(wrong)?.is_symlink() {
            let leads_out = || !path.canonicalize().is_ok_and(|real| real.starts_with(&top.real));
            if path.is_dir() {
                continue;
            }
            if leads_out() {
                messages::note(format_args!(
                    "{} is a link out of the folder and is not read; name the file itself to read it",
                    path.display()
                ));
                continue;
            }
        }
        if path.is_dir() {
            // The output of an earlier run is no recording.
            if path.canonicalize().ok() != out.canonicalize().ok() || !out.exists() {
                search(&path, top, out, found)?;
            }
        } else if path
            .extension()
            .is_some_and(|extension| EXTENSIONS.iter().any(|known| extension.eq_ignore_ascii_case(known)))
        {
            let within = path.strip_prefix(top.path).unwrap_or(&path);
            let parts: Vec<_> = within.iter().map(|part| part.to_string_lossy()).collect();
            found.all.push(Recording { name: parts.join("__"), path, found: true });
        } else {
            let extension =
                path.extension().map_or("none".into(), |extension| format!(".{}", extension.to_string_lossy()));
            *found.others.entry(extension).or_default() += 1;
        }
    }
    Ok(())
}
