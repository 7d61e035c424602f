//! The language server by its messages: what an editor sends, and what it gets.

mod client;
mod looks;
mod messages;
mod speed;
