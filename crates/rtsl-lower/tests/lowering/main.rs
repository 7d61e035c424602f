//! Text to the single-ray representation, run by the interpreter.

mod calls;
mod constants;
mod control;
mod deep_texts;
mod expressions;
mod harness;
mod lights;
mod limits;
mod metadata;
mod references;
mod state;
mod storage;
