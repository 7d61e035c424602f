//! Linking: a method and the methods that it calls through references become one function.

pub(crate) mod class_tree;
pub(crate) mod hit;
pub(crate) mod linker;
#[cfg(test)]
mod tests;
