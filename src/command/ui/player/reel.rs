//! The inputs of a replay as one stream of items, and places to come back to.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::capture::mcap::{Facts, Place as FilePlace};
use crate::capture::{Input, InputError, InputFormat, Item};
use crate::line::LineSettings;
use crate::time::Timestamp;

/// Says what is replayed; shared by all who read it.
pub(super) struct Tracks {
    /// The parts of the session in order; more come while it is being written.
    paths: Mutex<Vec<PathBuf>>,
    format: Option<InputFormat>,
    line: Option<LineSettings>,
    follows: bool,
}

impl Tracks {
    /// Takes the parts of a session in order; `line` overrides what they say.
    pub(super) fn new(
        paths: Vec<PathBuf>,
        format: Option<InputFormat>,
        line: Option<LineSettings>,
        follows: bool,
    ) -> Self {
        Tracks { paths: Mutex::new(paths), format, line, follows }
    }

    /// Adds a part that came later.
    pub(super) fn add(&self, path: PathBuf) {
        self.paths.lock().unwrap_or_else(PoisonError::into_inner).push(path);
    }

    /// Returns the path of a part.
    pub(super) fn path(&self, part: usize) -> Option<PathBuf> {
        self.paths.lock().unwrap_or_else(PoisonError::into_inner).get(part).cloned()
    }

    fn count(&self) -> usize {
        self.paths.lock().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// Tells whether the recording may still grow.
    pub(super) fn follows(&self) -> bool {
        self.follows
    }

    fn open(&self, path: &Path) -> Result<Input, InputError> {
        let opened = Input::open(path, self.format).or_else(|error| {
            // What was being written has its name by now.
            let finished =
                path.extension().filter(|extension| *extension == "part").map(|_| path.with_extension(""));
            finished.map_or(Err(error), |path| Input::open(&path, self.format))
        });
        let mut input = opened?;
        if self.follows {
            input.follow();
        }
        input.use_line(self.line.or(input.line()).unwrap_or_default());
        Ok(input)
    }
}

/// Says what became of going on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Advance {
    /// There is another item.
    Item,
    /// Nothing is there yet.
    Wait,
    /// All was read.
    End,
}

/// Is a place in a stream of items.
#[derive(Clone)]
pub(super) struct Place {
    part: usize,
    /// How many items of the part lie before it.
    items: u64,
    /// The place in the file; without it items are counted.
    file: Option<FilePlace>,
}

/// Reads the inputs one after the other.
pub(super) struct Reel<'a> {
    tracks: &'a Tracks,
    part: usize,
    input: Input,
    items: u64,
}

impl<'a> Reel<'a> {
    /// Opens the first input.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(super) fn open(tracks: &'a Tracks) -> Result<Self, InputError> {
        let path = tracks.path(0).unwrap_or_default();
        let input = tracks.open(&path)?;
        Ok(Reel { tracks, part: 0, input, items: 0 })
    }

    /// Opens the inputs where at least `bytes` of messages lead up to a time; `None` where no index says where that is.
    ///
    /// # Errors
    /// When an input cannot be read.
    pub(super) fn near(tracks: &'a Tracks, time: Timestamp, bytes: u64) -> Result<Option<Self>, InputError> {
        let (mut part, mut input) = (0, tracks.open(&tracks.path(0).unwrap_or_default())?);
        // The last part that begins before it.
        let mut later = tracks.count();
        while part + 1 < later {
            let middle = part + (later - part) / 2;
            let other = tracks.open(&tracks.path(middle).unwrap_or_default())?;
            match other.times() {
                Some((begin, _)) if begin <= time => (part, input) = (middle, other),
                Some(_) => later = middle,
                None => return Ok(None),
            }
        }
        Ok(input.start_near(time, bytes).then_some(Reel { tracks, part, input, items: 0 }))
    }

    /// Returns what is replayed.
    pub(super) fn tracks(&self) -> &'a Tracks {
        self.tracks
    }

    /// Returns about how many bytes all parts have, where the size of this one is known.
    pub(super) fn size(&self) -> Option<u64> {
        Some(self.input.size()?.saturating_mul(self.tracks.count() as u64))
    }

    /// Goes on to the next item.
    ///
    /// # Errors
    /// When an input cannot be read on.
    pub(super) fn advance(&mut self) -> Result<Advance, InputError> {
        loop {
            if self.input.advance()? {
                self.items += 1;
                return Ok(Advance::Item);
            }
            if !self.input.is_finished() {
                return Ok(Advance::Wait);
            }
            let Some(path) = self.tracks.path(self.part + 1) else { return Ok(Advance::End) };
            let mut next = self.tracks.open(&path)?;
            next.continue_after(&self.input);
            (self.input, self.part, self.items) = (next, self.part + 1, 0);
        }
    }

    /// Returns the item gone on to.
    pub(super) fn item(&self) -> Item<'_> {
        self.input.item()
    }

    /// Returns where to go on after the items so far; `None` where that is no place for it.
    pub(super) fn place(&self) -> Option<Place> {
        let is_counted = self.input.facts().is_none();
        let file = if is_counted { None } else { Some(self.input.place()?) };
        Some(Place { part: self.part, items: self.items, file })
    }

    /// Goes on from a place.
    ///
    /// # Errors
    /// When the input cannot be opened again, or not be read up to there.
    pub(super) fn go(&mut self, place: &Place) -> Result<(), InputError> {
        let is_behind = place.file.is_none() && self.items > place.items;
        if self.part != place.part || is_behind {
            let path = self.tracks.path(place.part).unwrap_or_default();
            (self.input, self.part, self.items) = (self.tracks.open(&path)?, place.part, 0);
        }
        if let Some(file) = &place.file {
            self.input.go(file)?;
            self.items = place.items;
        }
        while self.items < place.items && self.input.advance()? {
            self.items += 1;
        }
        Ok(())
    }

    /// Returns the path of the part that is read, and what it says of itself.
    pub(super) fn part(&self) -> (PathBuf, Option<&Facts>) {
        (self.tracks.path(self.part).unwrap_or_default(), self.input.facts())
    }

    /// Returns the first and the last time of the whole session, where indexes say them.
    pub(super) fn times(&self) -> Option<(Timestamp, Timestamp)> {
        let (first, mut last) = self.input.times()?;
        let mut part = self.part + 1;
        while let Some(path) = self.tracks.path(part) {
            last = self.tracks.open(&path).ok()?.times()?.1;
            part += 1;
        }
        Some((first, last))
    }

    /// Returns the input that is read.
    pub(super) fn input(&self) -> &Input {
        &self.input
    }

    /// Returns how much of all parts was read, from 0 to 1, where sizes are known; each part counts alike.
    pub(super) fn share(&self) -> f64 {
        let size = self.input.size().unwrap_or(0).max(1);
        let of_part = (self.input.position() as f64 / size as f64).clamp(0.0, 1.0);
        (self.part as f64 + of_part) / self.tracks.count().max(1) as f64
    }
}
