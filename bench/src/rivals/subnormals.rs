//! Subnormal numbers as zero: what hand-written kernels commonly ask for, since subnormal results
//! are slow.

use std::arch::asm;

/// Flush to zero, subnormals are zero.
const FLUSH: u32 = 0x8040;

/// Runs `work` with subnormal numbers taken for zero.
pub fn flushed(work: impl FnOnce()) {
    let before = control();
    set_control(before | FLUSH);
    work();
    set_control(before);
}

fn control() -> u32 {
    let mut control = 0u32;
    // Safety: stores the register.
    unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack)) };
    control
}

fn set_control(control: u32) {
    // Safety: of the register's bits only the two above change, and those only for a while in which nothing
    // runs that relies on subnormals.
    unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const control, options(nostack)) };
}
