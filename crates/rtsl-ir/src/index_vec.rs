//! Vectors that are indexed by the ids of values and variables.

use std::marker::PhantomData;
use std::ops::{Index, IndexMut};

use crate::{Value, VariableId};

/// An id that counts the elements of a table from 0.
pub trait Id: Copy {
    /// Returns the position in the table.
    fn position(self) -> usize;
}

impl Id for Value {
    fn position(self) -> usize {
        self.0 as usize
    }
}

impl Id for VariableId {
    fn position(self) -> usize {
        self.0 as usize
    }
}

/// A vector with an element for each id of one type, such as the facts of a pass about each value of a function. An id
/// of another type is not an index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IndexVec<I, T> {
    elements: Vec<T>,
    ids: PhantomData<fn(I)>,
}

impl<I: Id, T> IndexVec<I, T> {
    /// Returns a vector of `count` copies of an element.
    pub fn filled(count: usize, element: T) -> IndexVec<I, T>
    where
        T: Clone,
    {
        IndexVec { elements: vec![element; count], ids: PhantomData }
    }

    /// Returns the number of elements.
    pub fn len(&self) -> usize {
        self.elements.len()
    }

    /// True if there are no elements.
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }

    /// Returns the element of an id; `None` past the end.
    pub fn get(&self, id: I) -> Option<&T> {
        self.elements.get(id.position())
    }

    /// Returns the element of an id; `None` past the end.
    pub fn get_mut(&mut self, id: I) -> Option<&mut T> {
        self.elements.get_mut(id.position())
    }

    /// Sets the element of an id. If it is past the end, the elements before it become `default`.
    pub fn insert(&mut self, id: I, element: T, default: T)
    where
        T: Clone,
    {
        if self.elements.len() <= id.position() {
            self.elements.resize(id.position() + 1, default);
        }
        self[id] = element;
    }

    /// Appends an element, that of the next id.
    pub fn push(&mut self, element: T) {
        self.elements.push(element);
    }

    /// Changes the number of elements; new ones are copies of `element`.
    pub fn resize(&mut self, count: usize, element: T)
    where
        T: Clone,
    {
        self.elements.resize(count, element);
    }

    /// Returns the elements in the order of the ids, to change them.
    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, T> {
        self.elements.iter_mut()
    }

    /// Returns the elements in the order of the ids.
    pub fn iter(&self) -> std::slice::Iter<'_, T> {
        self.elements.iter()
    }
}

impl<I, T> Default for IndexVec<I, T> {
    fn default() -> Self {
        IndexVec { elements: Vec::new(), ids: PhantomData }
    }
}

impl<I: Id, T> Index<I> for IndexVec<I, T> {
    type Output = T;

    fn index(&self, id: I) -> &T {
        &self.elements[id.position()]
    }
}

impl<I: Id, T> IndexMut<I> for IndexVec<I, T> {
    fn index_mut(&mut self, id: I) -> &mut T {
        &mut self.elements[id.position()]
    }
}

impl<I, T> FromIterator<T> for IndexVec<I, T> {
    fn from_iter<E: IntoIterator<Item = T>>(elements: E) -> Self {
        IndexVec { elements: elements.into_iter().collect(), ids: PhantomData }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_have_ids() {
        let mut counts = IndexVec::filled(2, 0);
        counts[Value(1)] += 3;
        counts.push(5);
        counts.insert(Value(4), 7, 1);
        assert_eq!(counts.iter().copied().collect::<Vec<_>>(), [0, 3, 5, 1, 7]);
        assert_eq!((counts.get(Value(2)), counts.get(Value(5)), counts.len()), (Some(&5), None, 5));
    }
}
