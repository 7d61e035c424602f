//! How many floats the arithmetic of a kernel's machine code does at once.
//!
//! A kernel's width is how many rays a chunk has, not what LLVM makes of it: interleaved chunks and LLVM's own
//! vectoriser put several chunks of 4 or 8 lanes into one register of 16, and LLVM may split 16 lanes among two of 8.

/// How many floats of 32 bits a register of each kind of x86-64 holds.
const REGISTERS: [(&str, u32); 3] = [("zmm", 16), ("ymm", 8), ("xmm", 4)];
/// What names of x86-64's arithmetic on packed floats begin with, and end in `ps`. Moves and bitwise operations are left
/// out, since scalar code uses them too.
const ARITHMETIC: [&str; 13] = [
    "add", "sub", "mul", "div", "sqrt", "min", "max", "fmadd", "fmsub", "fnmadd", "fnmsub",
    "round", "rndscale",
];
/// The same of aarch64, where operands name the number of floats.
const AARCH64_LANES: [(&str, u32); 2] = [(".4s", 4), (".2s", 2)];

/// The most floats that an instruction of this assembly computes with at once: 1 for scalar arithmetic, `None` where
/// there is no arithmetic.
pub fn widest_arithmetic(assembly: &str) -> Option<u32> {
    assembly.lines().filter_map(floats_at_once).max()
}

/// How many floats a line computes with, if it is an instruction that does.
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
