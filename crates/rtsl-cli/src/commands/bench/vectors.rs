//! The number of floats that a kernel's machine code computes at once.
//!
//! The width of a kernel is the number of rays in one of its vectors, which LLVM need not preserve: interleaved vectors
//! and LLVM's vectoriser may combine several of 4 or 8 lanes in one register of 16, and LLVM may split 16 lanes into
//! two registers of 8.

/// The number of 32-bit floats in a register of each kind of x86-64.
const REGISTERS: [(&str, u32); 3] = [("zmm", 16), ("ymm", 8), ("xmm", 4)];
/// The prefixes of x86-64's arithmetic instructions on packed floats, which end in `ps`. Moves and bitwise operations
/// are excluded, because scalar code uses them too.
const ARITHMETIC: [&str; 13] = [
    "add", "sub", "mul", "div", "sqrt", "min", "max", "fmadd", "fmsub", "fnmadd", "fnmsub",
    "round", "rndscale",
];
/// The same for aarch64, whose operands include the number of floats.
const AARCH64_LANES: [(&str, u32); 2] = [(".4s", 4), (".2s", 2)];

/// Returns the greatest number of floats that an instruction of this assembly computes at once: 1 for scalar
/// arithmetic, `None` without arithmetic.
pub fn widest_arithmetic(assembly: &str) -> Option<u32> {
    assembly.lines().filter_map(floats_at_once).max()
}

/// The number of floats that a line computes, if it is an arithmetic instruction.
fn floats_at_once(line: &str) -> Option<u32> {
    let (name, operands) = line.trim().split_once(char::is_whitespace)?;
    let x86 = name.strip_prefix('v').unwrap_or(name);
    if ARITHMETIC.iter().any(|it| x86.starts_with(it)) {
        if x86.ends_with("ss") {
            return Some(1);
        }
        if x86.ends_with("ps") {
            let used = REGISTERS.iter().find(|(register, _)| operands.contains(register));
            return used.map(|(_, floats)| *floats);
        }
    }
    let aarch64 = name.strip_prefix('f')?;
    if !["add", "sub", "mul", "div", "sqrt", "min", "max", "ml"]
        .iter()
        .any(|it| aarch64.starts_with(it))
    {
        return None;
    }
    let packed = AARCH64_LANES.iter().find(|(suffix, _)| operands.contains(suffix));
    Some(packed.map_or(1, |(_, floats)| *floats))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_widest_arithmetic_counts() {
        let scalar = "f:\n\tvmovups %xmm1, (%rdi)\n\tvxorps %xmm0, %xmm0, %xmm0\n\tvaddss %xmm0, %xmm1, %xmm2\n";
        assert_eq!(widest_arithmetic(scalar), Some(1));
        let four = format!("{scalar}\tvfmadd213ps %xmm0, %xmm1, %xmm2\n");
        assert_eq!(widest_arithmetic(&four), Some(4));
        let sixteen = format!("{four}\tvdivps 64(%rsp){{1to16}}, %zmm1, %zmm2 {{%k1}}\n");
        assert_eq!(widest_arithmetic(&sixteen), Some(16));
        assert_eq!(widest_arithmetic("\tfmla v0.4s, v1.4s, v2.4s\n"), Some(4));
        assert_eq!(widest_arithmetic("\tfsqrt s0, s1\n"), Some(1));
    }

    #[test]
    fn copies_and_integers_do_not_count() {
        let copy =
            "\tvmovups (%rsi), %zmm0\n\tvmovups %zmm0, (%rdi)\n\taddq $64, %rdi\n\tsubl $1, %eax\n";
        assert_eq!(widest_arithmetic(copy), None);
    }
}
