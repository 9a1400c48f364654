//! Where a recording goes: a file, or a directory with files named by the time.

use std::fs;
use std::path::{Path, PathBuf};

use chrono::DateTime;

use super::super::being_written::is_being_written;
use super::super::failure::Failure;
use super::super::output::check_mcap;
use crate::time::Timestamp;

/// What the files in a directory begin with.
const PREFIX: &str = "rtutap-";

/// Names the files of a recording.
#[derive(Clone, Debug)]
pub(super) struct Target {
    /// The first file.
    pub(super) path: PathBuf,
    /// Whether the name was made up, in a directory of recordings.
    is_named_by_time: bool,
}

impl Target {
    /// Chooses the first file for a recording that begins `now`.
    ///
    /// # Errors
    /// When there is a recording of that name, or no directory for it.
    pub(super) fn new(given: &Path, now: Timestamp) -> Result<Self, Failure> {
        let is_directory = given.is_dir() || given.as_os_str().to_string_lossy().ends_with(['/', '\\']);
        let target = if is_directory {
            let time = DateTime::from_timestamp_nanos(now.as_ns()).format("%Y%m%dT%H%M%SZ");
            let free = (1..).map(|try_| match try_ {
                1 => given.join(format!("{PREFIX}{time}.mcap")),
                _ => given.join(format!("{PREFIX}{time}-{try_}.mcap")),
            });
            let path = free.into_iter().find(|path| !path.exists() && !unfinished(path).exists());
            Target { path: path.unwrap_or_else(|| given.into()), is_named_by_time: true }
        } else {
            check_mcap(given, "a recorder")?;
            Target { path: given.into(), is_named_by_time: false }
        };
        let name = target.path.display();
        if !directory(&target.path).is_dir() {
            let hint = "create the directory first";
            return Err(Failure::hinted(format!("cannot write '{name}': there is no such directory"), hint));
        }
        if target.path.exists() {
            let hint = "choose another name, or a directory, in which each recording gets a name of its own";
            return Err(Failure::hinted(format!("'{name}' exists already"), hint));
        }
        Ok(target)
    }

    /// Returns the finished files of this recording, in a directory those of others too, the oldest first.
    pub(super) fn finished(&self) -> Vec<PathBuf> {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let is_part = |name: &str| {
            let rest = name.strip_prefix(&stem);
            let number = rest.and_then(|rest| rest.strip_prefix('-'));
            rest == Some("") || number.is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_digit()))
        };
        let is_ours = |path: &Path| {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let is_recording = path.extension() == self.path.extension();
            is_recording && if self.is_named_by_time { name.starts_with(PREFIX) } else { is_part(&name) }
        };
        let mut files: Vec<_> =
            files(directory(&self.path)).into_iter().filter(|path| is_ours(path)).collect();
        files
            .sort_by_cached_key(|path| (path.metadata().and_then(|file| file.modified()).ok(), path.clone()));
        files
    }

    /// Returns the unfinished recordings beside this one that nobody is writing.
    pub(super) fn left_over(&self) -> Vec<PathBuf> {
        let mut files = files(directory(&self.path));
        files.retain(|path| path.to_string_lossy().ends_with(".mcap.part") && !is_being_written(path));
        files.sort();
        files
    }
}

/// Returns the directory of a file.
pub(super) fn directory(file: &Path) -> &Path {
    file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn unfinished(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

fn files(directory: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(directory) else { return Vec::new() };
    entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_file()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[expect(clippy::disallowed_methods, reason = "files of this test")]
    fn touch(path: &Path) {
        fs::write(path, b"x").expect("a disk that works");
    }

    fn names(files: &[PathBuf]) -> Vec<String> {
        files.iter().map(|path| path.file_name().expect("a file").to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_file_in_a_directory_is_named_by_the_time_and_never_twice() {
        let directory = tempfile::tempdir().expect("a directory");
        let now = Timestamp::from_ns(1_767_225_600_000_000_000);
        let path = |names: &[&str]| {
            names.iter().for_each(|name| touch(&directory.path().join(name)));
            Target::new(directory.path(), now).expect("a name").path
        };
        assert_eq!(path(&[]), directory.path().join("rtutap-20260101T000000Z.mcap"));
        let next = path(&["rtutap-20260101T000000Z.mcap.part", "rtutap-20260101T000000Z-2.mcap"]);
        assert_eq!(next, directory.path().join("rtutap-20260101T000000Z-3.mcap"));
    }

    #[test]
    fn what_is_there_is_never_written_over() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("a.mcap");
        touch(&path);
        assert!(Target::new(&path, Timestamp::default()).is_err());
        assert!(Target::new(&directory.path().join("b/c.mcap"), Timestamp::default()).is_err());
    }

    #[test]
    fn only_finished_recordings_of_the_same_name_may_be_dropped() {
        let directory = tempfile::tempdir().expect("a directory");
        let target = Target::new(&directory.path().join("a.mcap"), Timestamp::default()).expect("a name");
        for name in ["a.mcap", "a-0002.mcap", "a-0003.mcap.part", "a-b.mcap", "ab.mcap", "a.txt"] {
            touch(&directory.path().join(name));
        }
        let mut finished = names(&target.finished());
        finished.sort();
        assert_eq!(finished, ["a-0002.mcap", "a.mcap"]);
        assert_eq!(names(&target.left_over()), ["a-0003.mcap.part"]);
    }
}
