//! Places in source texts from which values come.

use std::sync::Arc;

use crate::Value;

/// A source text with its name, as diagnostics show it.
#[derive(Debug, PartialEq, Eq)]
pub struct Source {
    /// The name.
    pub name: String,
    /// The text.
    pub text: String,
    /// The offsets of line breaks.
    breaks: Vec<u32>,
}

impl Source {
    /// Creates a source.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Source {
        let (name, text) = (name.into(), text.into());
        let breaks = text.bytes().zip(0..).filter(|(byte, _)| *byte == b'\n');
        let breaks = breaks.map(|(_, offset)| offset).collect();
        Source { name, text, breaks }
    }
}

/// A range of bytes of a source text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The text.
    pub source: Arc<Source>,
    /// The offset of the first byte.
    pub start: u32,
    /// The offset just past the last byte.
    pub end: u32,
}

impl Place {
    /// Returns the line, from 1.
    pub fn line(&self) -> u32 {
        self.source.breaks.partition_point(|offset| *offset < self.start) as u32 + 1
    }
}

/// The places of values, as far as they are known. They do not affect semantics: any two compare equal.
#[derive(Clone, Debug, Default)]
pub struct Places {
    sources: Vec<Arc<Source>>,
    /// For each value, the index of its source, start and end.
    of: Vec<Option<(u32, u32, u32)>>,
}

impl Places {
    /// The texts.
    pub fn sources(&self) -> &[Arc<Source>] {
        &self.sources
    }

    /// True if no value has a place.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Sets the place of a value, unless it has one.
    pub fn set(&mut self, value: Value, place: &Place) {
        let index = value.0 as usize;
        if self.of.len() <= index {
            self.of.resize(index + 1, None);
        }
        if self.of[index].is_none() {
            self.of[index] = Some((self.source(&place.source), place.start, place.end));
        }
    }

    /// Returns the place of a value.
    pub fn get(&self, value: Value) -> Option<Place> {
        let (source, start, end) = self.of.get(value.0 as usize).copied().flatten()?;
        Some(Place { source: self.sources[source as usize].clone(), start, end })
    }

    /// The index of a source, which is added if it is new. A function has few.
    fn source(&mut self, source: &Arc<Source>) -> u32 {
        let known = self.sources.iter().rposition(|known| Arc::ptr_eq(known, source));
        let index = known.unwrap_or_else(|| {
            self.sources.push(source.clone());
            self.sources.len() - 1
        });
        index as u32
    }
}

impl PartialEq for Places {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_have_lines() {
        let source = Arc::new(Source::new("a.rtsl", "one\ntwo\n\nfour"));
        let line = |start| Place { source: source.clone(), start, end: start + 1 }.line();
        assert_eq!([0, 2, 3, 4, 7, 8, 9, 12].map(line), [1, 1, 1, 2, 2, 3, 4, 4]);
    }

    #[test]
    fn the_first_place_of_a_value_counts() {
        let [one, two] = ["one", "two"].map(|name| Arc::new(Source::new(name, "text")));
        let mut places = Places::default();
        let place = |source: &Arc<Source>, start| Place { source: source.clone(), start, end: 4 };
        assert!(places.is_empty());
        places.set(Value(3), &place(&one, 0));
        places.set(Value(1), &place(&two, 1));
        places.set(Value(3), &place(&two, 2));
        assert_eq!(places.get(Value(3)), Some(place(&one, 0)));
        assert_eq!(places.get(Value(1)), Some(place(&two, 1)));
        assert_eq!([0, 2, 4].map(|value| places.get(Value(value))), [None, None, None]);
        assert_eq!(places.sources().len(), 2);
    }
}
