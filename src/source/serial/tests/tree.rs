//! Folders that stand for a host, shaped as Linux 6.12 shapes them.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::PathBuf;

use super::super::host::Host;

/// Holds the folders of a host, gone when dropped.
pub(super) struct Tree {
    root: tempfile::TempDir,
}

#[expect(clippy::disallowed_methods, reason = "it stands for a host")]
impl Tree {
    pub(super) fn new() -> Self {
        let tree = Tree { root: tempfile::tempdir().expect("room") };
        for folder in ["dev/serial/by-id", "sys/class/tty", "proc", "etc"] {
            fs::create_dir_all(tree.path(folder)).expect("room");
        }
        let groups = "root:x:0:\ndialout:x:20:ada,grace\nuucp:x:986:\n";
        fs::write(tree.path("etc/group"), groups).expect("room");
        tree
    }

    pub(super) fn host(&self) -> Host {
        Host::below(self.root.path())
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        // As the system knows it, so that paths compare.
        self.root.path().canonicalize().expect("a folder").join(name)
    }

    fn write(&self, name: &str, text: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("room");
        fs::write(path, format!("{text}\n")).expect("room");
    }

    fn link(&self, name: &str, target: PathBuf) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("room");
        symlink(target, path).expect("room");
    }

    /// Plugs in an adapter: vendor, product and, if it has one, serial number.
    pub(super) fn usb(&self, device: &str, socket: &str, identity: &[&str], driver: &str) {
        let usb = format!("sys/devices/usb1/{socket}");
        let attributes = ["idVendor", "idProduct", "serial"];
        for (name, value) in attributes.iter().zip(identity) {
            self.write(&format!("{usb}/{name}"), value);
        }
        if identity.first() == Some(&"0403") {
            self.write(&format!("{usb}/manufacturer"), "FTDI");
            self.write(&format!("{usb}/product"), "FT232R");
        }
        self.link(&format!("{usb}/driver"), self.path("sys/bus/usb/drivers/usb"));
        self.write(&format!("{usb}/{socket}:1.0/bInterfaceNumber"), "00");
        // cdc-acm has no device between the interface and the tty.
        let port = match driver {
            "cdc_acm" => format!("{usb}/{socket}:1.0"),
            _ => format!("{usb}/{socket}:1.0/{device}"),
        };
        self.link(&format!("{port}/driver"), self.path(&format!("sys/bus/usb-serial/drivers/{driver}")));
        self.link(&format!("sys/class/tty/{device}/device"), self.path(&port));
    }

    pub(super) fn latency_timer(&self, device: &str, ms: &str) {
        self.write(&format!("sys/class/tty/{device}/device/latency_timer"), ms);
    }

    /// Adds a UART on the board, between whose driver and tty Linux 6.6 put two devices more.
    pub(super) fn uart(&self, device: &str, kind: &str) {
        let folder = "sys/devices/pnp0/00:03";
        let port = format!("{folder}/00:03:0/00:03:0.{device}");
        self.link(&format!("{port}/driver"), self.path("sys/bus/serial-base/drivers/port"));
        self.link(&format!("{port}/subsystem"), self.path("sys/bus/serial-base"));
        if !self.path(&format!("{folder}/driver")).is_symlink() {
            self.link(&format!("{folder}/driver"), self.path("sys/bus/pnp/drivers/serial"));
            self.link(&format!("{folder}/subsystem"), self.path("sys/bus/pnp"));
        }
        self.link(&format!("sys/class/tty/{device}/device"), self.path(&port));
        self.write(&format!("sys/class/tty/{device}/type"), kind);
    }

    /// Lets the device file lead to a pty or file.
    pub(super) fn device(&self, device: &str, target: &str) {
        self.link(&format!("dev/{device}"), PathBuf::from(target));
    }

    pub(super) fn stable_name(&self, name: &str, device: &str) {
        self.link(&format!("dev/serial/by-id/{name}"), self.path(&format!("dev/{device}")));
    }

    /// Lets a process have a device open.
    pub(super) fn process(&self, number: &str, program: &str, device: &str) {
        let device = fs::canonicalize(device).expect("a device");
        self.write(&format!("proc/{number}/comm"), program);
        self.link(&format!("proc/{number}/fd/3"), device);
    }

    pub(super) fn unplug(&self, device: &str) {
        let folder = self.path(&format!("sys/class/tty/{device}"));
        let usb = fs::canonicalize(folder.join("device/../..")).expect("an adapter");
        fs::remove_dir_all(usb).expect("an adapter");
        fs::remove_dir_all(folder).expect("a tty");
        fs::remove_file(self.path(&format!("dev/{device}"))).expect("a device");
    }
}
