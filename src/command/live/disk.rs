//! Room on the disk: how much there is, and what may go to make more.

use std::io;
use std::path::{Path, PathBuf};

/// Is what a recording needs to know of a disk; an argument so that tests can fill it.
pub(super) trait Disk: Send {
    /// Returns how many bytes are free for this program where a file lies.
    fn free(&self, file: &Path) -> io::Result<u64>;

    /// Returns the finished recordings that may be removed, the oldest first.
    fn oldest(&self) -> Vec<PathBuf>;

    /// Returns how many bytes a recording takes.
    fn size(&self, path: &Path) -> u64 {
        std::fs::metadata(path).map_or(0, |metadata| metadata.len())
    }

    /// Removes a recording.
    fn remove(&self, path: &Path) -> io::Result<()>;
}

/// Decides what to do when the disk gets full.
pub(super) struct Floor {
    /// How many bytes are to stay free.
    pub(super) min_free: u64,
    /// Whether old recordings are removed for that.
    pub(super) drop_oldest: bool,
}

/// Says what to do.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Room {
    /// There is enough, maybe since these were removed.
    Enough(Vec<PathBuf>),
    /// There is not.
    Short {
        /// Bytes that are free.
        free: u64,
        /// What was removed all the same, for it seemed to be enough.
        removed: Vec<PathBuf>,
    },
}

impl Floor {
    /// Looks whether there is room, and makes some if it may; what would not make enough stays.
    pub(super) fn check(&self, disk: &dyn Disk, file: &Path) -> Room {
        let mut removed = Vec::new();
        // What cannot be asked says at the latest when it is written to.
        let Ok(mut free) = disk.free(file) else { return Room::Enough(removed) };
        if free >= self.min_free {
            return Room::Enough(removed);
        }
        let oldest = if self.drop_oldest { disk.oldest() } else { Vec::new() };
        let sizes = oldest.iter().map(|path| disk.size(path));
        if sizes.fold(free, u64::saturating_add) < self.min_free {
            return Room::Short { free, removed };
        }
        for path in oldest {
            if disk.remove(&path).is_ok() {
                removed.push(path);
            }
            free = disk.free(file).unwrap_or(free);
            if free >= self.min_free {
                return Room::Enough(removed);
            }
        }
        Room::Short { free, removed }
    }
}

/// Returns how many bytes the disk holds on which a file is to lie; `None` where the system does not say.
pub(super) fn capacity(file: &Path) -> Option<u64> {
    #[cfg(unix)]
    return rustix::fs::statvfs(super::target::directory(file))
        .ok()
        .map(|disk| disk.f_blocks.saturating_mul(disk.f_frsize));
    #[cfg(not(unix))]
    return {
        let _ = file;
        None
    };
}

/// Is the disk of this host, with the recordings beside one.
pub(super) struct SystemDisk {
    /// The files that belong to this recording, or to others in its directory.
    pub(super) target: super::target::Target,
}

impl Disk for SystemDisk {
    #[cfg(unix)]
    fn free(&self, file: &Path) -> io::Result<u64> {
        let directory = super::target::directory(file);
        let room = rustix::fs::statvfs(directory)?;
        Ok(room.f_bavail.saturating_mul(room.f_frsize))
    }

    #[cfg(not(unix))]
    fn free(&self, _file: &Path) -> io::Result<u64> {
        Err(io::ErrorKind::Unsupported.into())
    }

    fn oldest(&self) -> Vec<PathBuf> {
        self.target.finished()
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        std::fs::remove_file(path)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    /// A disk on which every recording takes ten bytes.
    struct Small {
        free: Mutex<u64>,
        files: Mutex<Vec<PathBuf>>,
    }

    impl Disk for Small {
        fn free(&self, _file: &Path) -> io::Result<u64> {
            Ok(*self.free.lock().expect("one thread"))
        }

        fn oldest(&self) -> Vec<PathBuf> {
            self.files.lock().expect("one thread").clone()
        }

        fn size(&self, _path: &Path) -> u64 {
            10
        }

        fn remove(&self, path: &Path) -> io::Result<()> {
            self.files.lock().expect("one thread").retain(|file| file != path);
            *self.free.lock().expect("one thread") += 10;
            Ok(())
        }
    }

    fn small() -> Small {
        Small { free: Mutex::new(5), files: Mutex::new(["a", "b", "c"].map(PathBuf::from).into()) }
    }

    #[test]
    fn the_oldest_go_until_there_is_room_and_no_longer() {
        let (disk, file) = (small(), Path::new("d.mcap.part"));
        let floor = Floor { min_free: 20, drop_oldest: true };
        assert_eq!(floor.check(&disk, file), Room::Enough(vec!["a".into(), "b".into()]));
        assert_eq!(floor.check(&disk, file), Room::Enough(vec![]));
    }

    #[test]
    fn without_leave_the_disk_is_short() {
        let (disk, file) = (small(), Path::new("d.mcap.part"));
        let keep = Floor { min_free: 20, drop_oldest: false };
        assert_eq!(keep.check(&disk, file), Room::Short { free: 5, removed: vec![] });
    }

    #[test]
    fn nothing_is_removed_that_would_not_make_enough_room() {
        let (disk, file) = (small(), Path::new("d.mcap.part"));
        let drop = Floor { min_free: 100, drop_oldest: true };
        assert_eq!(drop.check(&disk, file), Room::Short { free: 5, removed: vec![] });
        assert_eq!(disk.oldest().len(), 3);
    }
}
