//! The `rtsl` command.

fn main() {}
