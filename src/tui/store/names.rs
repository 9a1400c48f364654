//! Texts that come again and again, kept once.

use std::collections::HashSet;
use std::sync::Arc;

/// How many texts are kept; beyond, each is one of its own.
const MOST: usize = 4096;

/// Keeps texts; copies share them until one learns a new one.
#[derive(Clone, Debug, Default)]
pub(super) struct Names(Arc<HashSet<Arc<str>>>);

impl Names {
    /// Returns a text, the same for the same characters.
    pub(super) fn get(&mut self, text: &str) -> Arc<str> {
        if let Some(known) = self.0.get(text) {
            return Arc::clone(known);
        }
        let new: Arc<str> = text.into();
        if self.0.len() < MOST {
            Arc::make_mut(&mut self.0).insert(Arc::clone(&new));
        }
        new
    }
}
