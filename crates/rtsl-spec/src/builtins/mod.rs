//! The registry of built-in functions.
