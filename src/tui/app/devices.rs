//! The state of the devices view: the list, and the page of one device.

use crate::tui::action::Action;
use crate::tui::store::{Device, Store, Tone};

use super::App;

/// Names what devices are sorted by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DeviceSort {
    /// Bus and address.
    #[default]
    Address,
    /// Most errors first.
    Errors,
    /// Slowest first.
    Latency,
    /// Most often asked first.
    Polls,
}

/// Is a line of a device's page that can be selected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PageItem {
    /// What it measures, by its place.
    Quantity(usize),
    /// What it is set to.
    Setting(usize),
    /// A stretch of registers.
    Register(usize),
}

/// Is the state of the devices view.
#[derive(Clone, Debug, Default)]
pub struct DevicesState {
    /// Bus and address of the selected device.
    pub selected: Option<(usize, u8)>,
    /// The selected line of its page, where that is open.
    pub page: Option<usize>,
    /// What the list is sorted by.
    pub sort: DeviceSort,
}

impl DevicesState {
    /// Returns the devices in their order.
    pub fn list<'a>(&self, store: &'a Store) -> Vec<&'a Device> {
        let mut devices: Vec<&Device> = store.devices().iter().map(|device| &**device).collect();
        let latency = |device: &Device| device.latency.map_or(0, |latency| latency.midpoint());
        let polls = |device: &Device| device.polls_per_second(store.now()).unwrap_or(0.0);
        match self.sort {
            DeviceSort::Address => {}
            DeviceSort::Errors => devices.sort_by_key(|device| std::cmp::Reverse(device.errors())),
            DeviceSort::Latency => devices.sort_by_key(|device| std::cmp::Reverse(latency(device))),
            DeviceSort::Polls => devices.sort_by(|a, b| polls(b).total_cmp(&polls(a))),
        }
        devices
    }

    /// Returns the selected device.
    pub fn device<'a>(&self, store: &'a Store) -> Option<&'a Device> {
        let (bus, address) = self.selected?;
        store.device(bus, address).map(|device| &**device)
    }

    /// Returns the lines of a device's page that can be selected.
    pub fn items(device: &Device) -> Vec<PageItem> {
        let quantities = (0..device.quantities.len()).map(PageItem::Quantity);
        let settings = (0..device.settings.len()).map(PageItem::Setting);
        let registers = (0..device.registers.len()).map(PageItem::Register);
        quantities.chain(settings).chain(registers).collect()
    }

    /// Selects a device that there is.
    pub(super) fn settle(&mut self, store: &Store) {
        if self.device(store).is_none() {
            self.selected = store.devices().first().map(|device| device.key());
            self.page = None;
        }
        if let (Some(at), Some(device)) = (self.page, self.device(store)) {
            self.page = Some(at.min(Self::items(device).len().saturating_sub(1)));
        }
    }

    fn step(&mut self, store: &Store, to: impl Fn(usize, usize) -> usize) {
        if let (Some(at), Some(device)) = (self.page, self.device(store)) {
            let count = Self::items(device).len();
            self.page = Some(to(at, count).min(count.saturating_sub(1)));
            return;
        }
        let devices = self.list(store);
        let at = devices.iter().position(|device| Some(device.key()) == self.selected).unwrap_or(0);
        let to = to(at, devices.len()).min(devices.len().saturating_sub(1));
        self.selected = devices.get(to).map(|device| device.key());
    }

    /// Returns a filter for the selected device, or for the value that is selected on its page.
    pub(super) fn filter(&self, store: &Store) -> Option<String> {
        let device = self.device(store)?;
        let address = format!("addr == {}", device.address);
        let item = self.page.and_then(|at| Self::items(device).get(at).copied());
        Some(match item {
            Some(PageItem::Register(at)) => {
                let register = device.registers.get(at)?;
                format!("{address} && fn == {} && reg == 0x{:04x}", register.function, register.start)
            }
            _ => address,
        })
    }

    /// Returns the selected device in a line.
    pub(super) fn text(&self, store: &Store) -> Option<String> {
        let device = self.device(store)?;
        let mut parts =
            vec![device.address.to_string(), device.id.as_deref().unwrap_or(&device.label).to_owned()];
        parts.extend(device.serial.as_deref().map(str::to_owned));
        parts.extend(device.quantities.iter().map(|quantity| format!("{} {}", quantity.name, quantity.text)));
        Some(parts.join("  "))
    }
}

impl App {
    pub(super) fn act_in_devices(&mut self, action: Action) {
        let store = &self.store;
        let devices = &mut self.devices;
        match action {
            Action::Up => devices.step(store, |at, _| at.saturating_sub(1)),
            Action::Down => devices.step(store, |at, _| at + 1),
            Action::PageUp => devices.step(store, |at, _| at.saturating_sub(10)),
            Action::PageDown => devices.step(store, |at, _| at + 10),
            Action::Top => devices.step(store, |_, _| 0),
            Action::Bottom => devices.step(store, |_, count| count),
            Action::Open if devices.page.is_none() && devices.selected.is_some() => devices.page = Some(0),
            Action::Open => self.filter_selected(),
            Action::Back => devices.page = None,
            Action::Zoom => self.turn_span(),
            Action::Left | Action::Right if devices.page.is_some() => {
                let page = devices.page.take();
                let is_right = action == Action::Right;
                devices.step(store, |at, _| if is_right { at + 1 } else { at.saturating_sub(1) });
                devices.page = page.map(|_| 0);
            }
            Action::Sort if devices.page.is_none() => {
                let (sort, name) = match devices.sort {
                    DeviceSort::Address => (DeviceSort::Errors, "most errors first"),
                    DeviceSort::Errors => (DeviceSort::Latency, "slowest first"),
                    DeviceSort::Latency => (DeviceSort::Polls, "most often asked first"),
                    DeviceSort::Polls => (DeviceSort::Address, "by address"),
                };
                devices.sort = sort;
                self.say(Tone::Info, name);
            }
            _ => {}
        }
    }
}
