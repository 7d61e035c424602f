//! Limits that bound the memory and the time that a document takes.

/// Bytes of a document and of those that it includes.
pub const TEXT: usize = 64 << 20;

/// Elements, attributes and texts of one document.
pub const XML_NODES: u32 = 2_000_000;

/// Elements inside one another.
pub const DEPTH: usize = 64;

/// Documents that include one another, and documents in all.
pub const INCLUDE_DEPTH: usize = 16;
/// The documents that one document includes, directly or indirectly.
pub const INCLUDES: usize = 256;

/// Nodes on the way from an output to an input, through graphs inside one another.
pub const GRAPH_DEPTH: usize = 512;

/// Statements of one material.
pub const STATEMENTS: usize = 20_000;

/// Visits of nodes for one material, whether or not they make statements.
pub const VISITS: usize = 200_000;

/// Bytes of the text of one document's classes.
pub const OUTPUT: usize = 16 << 20;

/// Materials and outputs of one document.
pub const MATERIALS: usize = 4096;
