//! Where a host keeps what it knows of devices, people and processes.

use std::fs;
use std::path::{Path, PathBuf};

/// Holds the folders that are read; an argument so that tests can make their own.
#[derive(Clone, Debug)]
pub(in super::super) struct Host {
    /// Where devices are: `/dev`.
    pub(in super::super) dev: PathBuf,
    /// What the kernel knows of them: `/sys`.
    pub(in super::super) sys: PathBuf,
    /// Who has them open: `/proc`.
    pub(in super::super) proc: PathBuf,
    /// Whose they are: `/etc`.
    pub(in super::super) etc: PathBuf,
}

impl Host {
    /// Returns the host whose folders are all below `root`; this one for `/`.
    pub(in super::super) fn below(root: &Path) -> Self {
        let folder = |name| root.join(name);
        Host { dev: folder("dev"), sys: folder("sys"), proc: folder("proc"), etc: folder("etc") }
    }

    /// Returns the group of this number, and who is in it besides those whose first group it is.
    pub(super) fn group(&self, number: u32) -> Option<(String, Vec<String>)> {
        let groups = text(&self.etc.join("group"))?;
        groups.lines().find_map(|line| {
            let mut fields = line.split(':');
            let name = fields.next()?.to_owned();
            let is_it = fields.nth(1)?.parse::<u32>().ok()? == number;
            let members = fields.next().unwrap_or_default().split(',').filter(|name| !name.is_empty());
            is_it.then(|| (name, members.map(str::to_owned).collect()))
        })
    }

    /// Returns who else has a device open, such as `minicom (process 1234)`, as far as we may know; the oldest first.
    pub(super) fn holders(&self, device: &Path) -> Vec<String> {
        let Ok(device) = fs::canonicalize(device) else { return Vec::new() };
        let own = std::process::id();
        let processes = fs::read_dir(&self.proc).into_iter().flatten().flatten();
        let others = processes.filter_map(|entry| {
            let number: u32 = entry.file_name().to_str()?.parse().ok()?;
            let files = fs::read_dir(entry.path().join("fd")).into_iter().flatten().flatten();
            let has_it = files.flat_map(|file| fs::read_link(file.path())).any(|target| target == device);
            (number != own && has_it).then(|| (number, entry.path()))
        });
        let mut holders: Vec<_> = others.collect();
        holders.sort();
        let name = |(number, path): &(u32, PathBuf)| match text(&path.join("comm")) {
            Some(program) => format!("{program} (process {number})"),
            None => format!("process {number}"),
        };
        holders.iter().map(name).collect()
    }
}

/// Returns what a small file says, without white space around it; `None` when it cannot be read or is empty.
pub(super) fn text(path: &Path) -> Option<String> {
    #[expect(clippy::disallowed_methods, reason = "the kernel tells what it knows in files")]
    let text = fs::read_to_string(path).ok()?;
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}
