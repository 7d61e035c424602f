//! Tests of the lowering: texts are lowered to the single-ray IR and run by the interpreter.

mod calls;
mod constants;
mod control;
mod deep_texts;
mod expressions;
mod harness;
mod integrators;
mod lights;
mod limits;
mod metadata;
mod references;
mod state;
mod storage;
