//! Going somewhere: filters, searches, times, marks, partners; and the lines that are typed for it.

use super::prompt::{self, Ask, Prompt, Target, time_filter};
use super::replay::Order;
use super::traffic::Pane;
use super::{Action, App, Effect, View};
use crate::analyze::filter::{Filter, Vocabulary};
use crate::section::nearest;
use crate::time::SECOND;
use crate::tui::sieve::Sieve;
use crate::tui::store::{List, Row, RowSubject, Tone};

impl App {
    /// Begins a line.
    pub(super) fn ask(&mut self, ask: Ask) {
        let text = match ask {
            Ask::Filter => self.filter.as_ref().map(Filter::to_string).unwrap_or_default(),
            Ask::Break => {
                let filter = self.breaks_on.as_ref().or(self.filter.as_ref());
                filter.map(Filter::to_string).unwrap_or_default()
            }
            Ask::Search | Ask::Note | Ask::Time | Ask::Export => String::new(),
        };
        self.learn_words();
        self.prompt = Some(Prompt::new(ask, text, &self.vocabulary));
    }

    /// Takes the words of the traffic for completion.
    fn learn_words(&mut self) {
        let Vocabulary { fields, devices, serials, commands, buses, findings } = &mut self.vocabulary;
        let add = |words: &mut Vec<String>, word: &str| {
            if !words.iter().any(|known| known == word) {
                words.push(word.to_owned());
            }
        };
        for device in self.store.devices() {
            device.id.iter().for_each(|id| add(devices, id));
            device.serial.iter().for_each(|serial| add(serials, serial));
            device.quantities.iter().for_each(|quantity| add(fields, &quantity.name));
            device.settings.iter().for_each(|setting| add(fields, &setting.name));
            let titles = device.registers.iter().map(|register| &*register.title);
            titles.filter(|title| !title.contains([' ', '?'])).for_each(|title| add(commands, title));
        }
        self.store.buses().iter().for_each(|bus| add(buses, &bus.name));
        self.store.findings().list().iter().for_each(|found| add(findings, found.finding.rule.code));
    }

    /// Does what a line that was typed is for.
    pub(super) fn typed(&mut self, prompt: &Prompt) -> Option<Effect> {
        let text = prompt.text().trim().to_owned();
        prompt::remember(&mut self.history[usize::from(!prompt.ask.is_filter())], &text);
        match prompt.ask {
            Ask::Filter => {
                self.set_filter(Filter::parse(&text).ok().filter(|_| !text.is_empty()));
                self.warn_of_unknown_fields(self.filter.clone());
            }
            Ask::Break => {
                self.breaks_on = Filter::parse(&text).ok().filter(|_| !text.is_empty());
                self.break_from = self.newest().list(List::Exchanges).total();
                let said = match &self.breaks_on {
                    Some(filter) if self.is_live => format!("freezes when a row passes {filter}"),
                    Some(filter) if self.is_too_early(filter) => {
                        "findings are not known yet: no pause till then".to_owned()
                    }
                    Some(filter) => format!("pauses when a row passes {filter}"),
                    None if self.is_live => "freezes by itself no more".to_owned(),
                    None => "pauses by itself no more".to_owned(),
                };
                self.say(Tone::Info, said);
                self.warn_of_unknown_fields(self.breaks_on.clone());
                return self.replay().is_some().then(|| Effect::Replay(Order::Break(self.breaks_on.clone())));
            }
            Ask::Search if text.is_empty() => self.search = None,
            Ask::Search => {
                self.search = Some(text);
                return self.search_again(true);
            }
            Ask::Note if text.is_empty() => {}
            Ask::Note => {
                // A note is on the selected row, unless the newest one is followed.
                let row = self.traffic.row(&self.store).filter(|_| !self.traffic.is_following);
                let time = row.and_then(Row::time).filter(|_| self.view == View::Traffic);
                let time = time.or(self.newest().now());
                if self.replay().is_some() {
                    self.note_place(time, text);
                    return None;
                }
                return Some(Effect::Note(time.or(self.now), text));
            }
            Ask::Time => match self.order_of_time(&text) {
                Some(order) => return Some(self.effect(order)),
                None => self.go_to_time(&text),
            },
            Ask::Export if text.is_empty() => {}
            Ask::Export => {
                let filter = self.filter.as_ref().map(Filter::to_string);
                return Some(Effect::Export { filter, path: text, notes: self.remarks() });
            }
        }
        None
    }

    /// Tells whether a filter asks for findings where nobody knows them yet.
    fn is_too_early(&self, filter: &Filter) -> bool {
        filter.asks_for_findings() && self.store.known_from().is_some()
    }

    /// Says which fields of a filter no profile has: such a filter passes nothing.
    fn warn_of_unknown_fields(&mut self, filter: Option<Filter>) {
        let fields = &self.vocabulary.fields;
        let names = filter.iter().flat_map(Filter::field_names);
        let unknown = names.filter(|name| !fields.is_empty() && !fields.iter().any(|field| field == name));
        let said = unknown.map(|name| {
            let near = nearest(
                name,
                Filter::known_names().map(|name| -> &str { name }).chain(fields.iter().map(String::as_str)),
            );
            let near = near.map_or_else(String::new, |near| format!("; did you mean '{near}'?"));
            format!("no profile has a field '{name}'{near}")
        });
        let said: Vec<String> = said.collect();
        said.into_iter().for_each(|text| self.say(Tone::Warn, text));
    }

    /// Shows only rows that pass a filter, or all again.
    pub fn set_filter(&mut self, filter: Option<Filter>) {
        self.filter = filter;
        self.traffic.reset(&self.store, self.filter.as_ref());
        if self.traffic.order.len(&self.store) == 0 && self.filter.is_some() {
            let (next, last) = (self.shown_key(Action::Down), self.shown_key(Action::Up));
            self.say(
                Tone::Info,
                match self.is_live {
                    true => "no row passes the filter yet".to_owned(),
                    false if self.filter.as_ref().is_some_and(|filter| self.is_too_early(filter)) => {
                        "findings are not known here yet".to_owned()
                    }
                    false => {
                        format!("none here: {next} goes to the next, {last} to the last")
                    }
                },
            );
        }
    }

    /// Shows only rows like what is selected.
    pub(super) fn filter_selected(&mut self) {
        let made = match self.view {
            View::Traffic if self.traffic.pane != Pane::List => {
                let detail = self.traffic.detail(&self.store);
                detail.nodes.get(self.traffic.node).and_then(|node| node.filter.clone())
            }
            View::Traffic => self.traffic.row(&self.store).and_then(row_filter),
            View::Devices => self.devices.filter(&self.store),
            View::Findings => {
                let found = self.store.findings().list().get(self.finding);
                found.map(|found| format!("finding == {}", found.finding.rule.code))
            }
            View::Health => None,
        };
        let Some(filter) = made.and_then(|text| Filter::parse(&text).ok()) else {
            return self.say(Tone::Info, "there is nothing here to filter by");
        };
        let narrowed = match self.filter.take().filter(|_| self.view == View::Traffic) {
            Some(before) if before != filter => before.and(filter),
            _ => filter,
        };
        self.view = View::Traffic;
        self.set_filter(Some(narrowed));
    }

    /// Selects the next row for which something holds.
    pub(super) fn go_to(&mut self, what: &str, is_forward: bool, holds: impl Fn(&App, u64, &Row) -> bool) {
        match self.traffic.find(&self.store, is_forward, |number, row| holds(self, number, row)) {
            Some((number, went_round)) => {
                if went_round {
                    let from = if is_forward { "first" } else { "last" };
                    self.say(Tone::Info, format!("went on from the {from} row"));
                }
                self.select(number);
            }
            None => self.say(Tone::Info, format!("there is no other {what} here")),
        }
    }

    fn select(&mut self, number: u64) {
        let height = self.regions().rows();
        self.traffic.select(&self.store, number, height);
    }

    /// Goes to the next hit of the search; in a recording beyond the rows in memory, too.
    pub(super) fn search_again(&mut self, is_forward: bool) -> Option<Effect> {
        let Some(text) = self.search.clone() else {
            self.ask(Ask::Search);
            return None;
        };
        let sieve = Sieve::words(&text);
        if self.replay().is_some() {
            let passes = |app: &App, row: &Row| sieve.passes(&app.store, row);
            if !self.is_near(is_forward, passes) {
                let list = self.traffic.list;
                let before = (!is_forward).then(|| (list, self.store.list(list).first_kept()));
                return Some(self.effect(Order::Words { sieve, is_forward, before }));
            }
        }
        self.go_to(&format!("row with '{text}'"), is_forward, |app, _, row| sieve.passes(&app.store, row));
        None
    }

    /// Tells whether such a row is in memory without going round.
    pub(super) fn is_near(&self, is_forward: bool, holds: impl Fn(&App, &Row) -> bool) -> bool {
        let found = self.traffic.find(&self.store, is_forward, |_, row| holds(self, row));
        found.is_some_and(|(_, went_round)| !went_round)
    }

    /// Jumps from a request to its response, and back.
    pub(super) fn go_to_partner(&mut self) {
        let detail = self.traffic.detail(&self.store);
        match self.traffic.row(&self.store) {
            Some(Row::Exchange(_)) if detail.sides.len() == 2 => {
                let side = detail.nodes.get(self.traffic.node).map_or(0, |node| node.side);
                let other = detail.nodes.iter().position(|node| node.depth == 0 && node.side != side);
                self.traffic.node = other.unwrap_or(0);
                if self.traffic.pane == Pane::Hex {
                    let place = detail.bytes().position(|(at, _)| at != side).unwrap_or(0);
                    self.traffic.byte = place;
                }
                self.traffic.match_panes(&detail);
            }
            Some(Row::Run(run)) => {
                let exchange = run.exchange.and_then(|number| self.store.list(List::Exchanges).get(number));
                let partner = match exchange {
                    Some(Row::Exchange(exchange)) => {
                        exchange.sides.into_iter().flatten().find(|side| Some(*side) != self.traffic.selected)
                    }
                    _ => None,
                };
                match partner {
                    Some(number) => self.select(number),
                    None => self.say(Tone::Info, "this frame has no partner"),
                }
            }
            _ => self.say(Tone::Info, "this row has no partner"),
        }
    }

    fn go_to_time(&mut self, text: &str) {
        let rows = self.store.list(self.traffic.list);
        let target = time_filter(text);
        let is_reached = |row: &Row| match &target {
            Ok(Target::Filter(filter)) => filter.matches(&RowSubject::new(&self.store, row)),
            Ok(Target::Seconds(seconds)) => {
                let from = self.store.begun().zip(row.time());
                from.is_some_and(|(begun, time)| (time - begun) as f64 >= seconds * SECOND as f64)
            }
            Err(_) => false,
        };
        let found = rows.kept().find(|number| rows.get(*number).is_some_and(is_reached));
        match found {
            Some(number) => self.select(number),
            None => self.say(Tone::Info, "no row that is kept is as late as that"),
        }
    }
}

/// Returns a filter for rows like this.
fn row_filter(row: &Row) -> Option<String> {
    Some(match row {
        Row::Exchange(row) => match &row.command {
            Some(command) => format!("addr == {} && cmd == {command}", row.address),
            None => {
                let register = row.register.map(|register| format!(" && reg == 0x{register:04x}"));
                format!("addr == {} && fn == {}{}", row.address, row.function.0, register.unwrap_or_default())
            }
        },
        Row::Run(row) => match (row.reason(), row.address) {
            (Some(reason), _) => format!("reason == {}", reason.name()),
            (None, Some(address)) => format!("addr == {address} && role == {}", row.role.name()),
            (None, None) => return None,
        },
        Row::Remark(row) => format!("addr == {}", row.address?),
    })
}
