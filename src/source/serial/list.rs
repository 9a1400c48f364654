//! The serial ports of a Linux host, and who may open them.

use std::fs;
use std::path::Path;

use rustix::fs::{Access, access};

use super::super::ports::Port;
use super::failure;
use super::host::Host;
use super::sysfs;

/// Returns the ports that have hardware behind them, USB adapters first.
pub(in super::super) fn ports(host: &Host) -> Vec<Port> {
    sysfs::adapters(host)
        .into_iter()
        .map(|adapter| {
            let path = host.dev.join(&adapter.device);
            let mut port = Port {
                device: path.to_string_lossy().into_owned(),
                stable_name: stable_name(host, &path),
                adapter,
                group: None,
                mode: None,
                in_use_by: Some(host.holders(&path).join(", ")).filter(|holders| !holders.is_empty()),
                obstacle: None,
            };
            permissions(host, &path, &mut port);
            port
        })
        .collect()
}

fn permissions(host: &Host, path: &Path, port: &mut Port) {
    use std::os::unix::fs::MetadataExt;

    let Ok(metadata) = fs::metadata(path) else {
        let hint = "the kernel has it, but there is no such file: a container must be given the device";
        port.obstacle = Some(hint.to_owned());
        return;
    };
    port.group = host.group(metadata.gid()).map(|(name, _)| name);
    port.mode = Some(metadata.mode() & 0o777);
    let is_allowed = access(path, Access::READ_OK | Access::WRITE_OK).is_ok();
    port.obstacle = (!is_allowed).then(|| failure::permission(host, metadata.gid(), metadata.mode()));
}

/// Returns the name that stays when adapters are plugged in in another order.
fn stable_name(host: &Host, path: &Path) -> Option<String> {
    let device = fs::canonicalize(path).ok()?;
    let links = fs::read_dir(host.dev.join("serial/by-id")).ok()?.flatten();
    let mut names: Vec<_> = links
        .map(|link| link.path())
        .filter(|link| fs::canonicalize(link).is_ok_and(|to| to == device))
        .collect();
    names.sort();
    Some(names.first()?.to_string_lossy().into_owned())
}
