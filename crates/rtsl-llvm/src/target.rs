//! Capabilities of the target machine.

/// The target of a module: LLVM's names for it, and the properties on which the text depends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TargetFeatures {
    /// LLVM's target triple.
    pub triple: String,
    /// LLVM's name of the processor, for the functions' attributes; may be empty.
    pub cpu: String,
    /// Features of the processor in addition to those of its name, in LLVM syntax: `+fma,-avx512f`; may be empty.
    pub features: String,
    /// True if fused multiply-add is an instruction.
    pub fma: bool,
    /// True if masks have separate registers, so that they are `<W x i1>`. On other targets they are lanes of 0 and -1
    /// in vector registers, for which LLVM generates poor code from `<W x i1>`.
    pub mask_registers: bool,
    /// True if an instruction blends a vector of 8 lanes with one in memory, by the signs of a third.
    pub blends: bool,
    /// The number of 32-bit lanes of a vector register.
    pub vector_lanes: u32,
    /// The most lanes that an instruction permutes by numbers in lanes: 8 or 16; 0 if there is none.
    pub permuted_lanes: u32,
    /// True if gathers are fast instructions: on AMD's processors loads lane by lane take less time.
    pub gathers: bool,
    /// Instructions that estimate reciprocals.
    pub estimates: Estimates,
    /// The number of lanes up to which the divider keeps up with the rest of the processor, so that estimates do not
    /// pay.
    pub divider_lanes: u32,
}

/// Instructions that estimate reciprocals and reciprocals of square roots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimates {
    /// None that one Newton step would make precise enough.
    None,
    /// 12 bits, 4 lanes.
    Sse,
    /// 12 bits, up to 8 lanes.
    Avx,
    /// 14 bits for 16 lanes, 12 for fewer.
    Avx512,
}

impl Estimates {
    /// Returns the greatest number of lanes of one instruction.
    pub const fn lanes(self) -> u32 {
        match self {
            Estimates::None => 0,
            Estimates::Sse => 4,
            Estimates::Avx => 8,
            Estimates::Avx512 => 16,
        }
    }
}

/// The number of lanes of the widest vectors.
const MAX_LANES: u32 = 16;

impl TargetFeatures {
    /// True if the divider keeps up with the rest of the processor for vectors of any width.
    pub fn has_fast_divider(&self) -> bool {
        self.divider_lanes >= MAX_LANES
    }

    /// Returns the features of a target from LLVM's names.
    pub fn new(triple: &str, cpu: &str, features: &str) -> TargetFeatures {
        let level = match cpu {
            "x86-64-v4" => 4,
            "x86-64-v3" => 3,
            _ => 0,
        };
        let has = |feature: &str| {
            let named = |sign: char| {
                features.split(',').any(|entry| entry.strip_prefix(sign) == Some(feature))
            };
            (named('+'), named('-'))
        };
        let has_or = |feature, by_level: bool| match has(feature) {
            (_, true) => false,
            (true, false) => true,
            (false, false) => by_level,
        };
        TargetFeatures {
            triple: triple.to_owned(),
            cpu: cpu.to_owned(),
            features: features.to_owned(),
            fma: triple.starts_with("aarch64") || has_or("fma", level >= 3),
            mask_registers: has_or("avx512vl", level >= 4),
            vector_lanes: match (has_or("avx512f", level >= 4), has_or("avx2", level >= 3)) {
                (true, _) => 16,
                (false, true) => 8,
                (false, false) => 4,
            },
            blends: triple.starts_with("x86_64") && has_or("avx2", level >= 3),
            permuted_lanes: match (has_or("avx512f", level >= 4), has_or("avx2", level >= 3)) {
                _ if !triple.starts_with("x86_64") => 0,
                (true, _) => 16,
                (false, true) => 8,
                (false, false) => 0,
            },
            gathers: has_or("avx2", level >= 3) && !cpu.starts_with("znver"),
            estimates: match triple.starts_with("x86_64") {
                false => Estimates::None,
                true if has_or("avx512f", level >= 4) => Estimates::Avx512,
                true if has_or("avx", level >= 3) || has_or("avx2", level >= 3) => Estimates::Avx,
                true => Estimates::Sse,
            },
            divider_lanes: if cpu == "znver5" { MAX_LANES } else { 8 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_are_those_of_the_widest_registers() {
        for (triple, cpu, features, estimates) in [
            ("x86_64-unknown-linux-gnu", "x86-64-v2", "", Estimates::Sse),
            ("x86_64-unknown-linux-gnu", "x86-64-v3", "", Estimates::Avx),
            ("x86_64-unknown-linux-gnu", "x86-64-v4", "", Estimates::Avx512),
            ("x86_64-unknown-linux-gnu", "znver3", "+avx,+avx2", Estimates::Avx),
            ("aarch64-unknown-linux-gnu", "generic", "", Estimates::None),
        ] {
            let target = TargetFeatures::new(triple, cpu, features);
            assert_eq!(target.estimates, estimates, "{target:?}");
        }
    }

    #[test]
    fn the_divider_of_zen_5_is_fast() {
        let target = |cpu| TargetFeatures::new("x86_64-unknown-linux-gnu", cpu, "+avx512f");
        assert!(target("znver5").has_fast_divider());
        assert!(!target("znver4").has_fast_divider() && !target("x86-64-v4").has_fast_divider());
    }

    #[test]
    fn features_come_from_levels_and_lists() {
        let x86 = "x86_64-unknown-linux-gnu";
        for (triple, cpu, features, (fma, mask_registers, gathers, permuted_lanes)) in [
            (x86, "x86-64-v2", "", (false, false, false, 0)),
            (x86, "x86-64-v3", "", (true, false, true, 8)),
            (x86, "x86-64-v4", "", (true, true, true, 16)),
            (x86, "znver3", "+avx2,+fma,-avx512vl", (true, false, false, 8)),
            (x86, "znver4", "+avx2,+fma,+avx512f,+avx512vl", (true, true, false, 16)),
            (x86, "skylake", "+avx2,+fma", (true, false, true, 8)),
            (x86, "x86-64-v3", "-fma", (false, false, true, 8)),
            ("aarch64-unknown-linux-gnu", "generic", "", (true, false, false, 0)),
        ] {
            let target = TargetFeatures::new(triple, cpu, features);
            let found = (target.fma, target.mask_registers, target.gathers, target.permuted_lanes);
            let expected = (fma, mask_registers, gathers, permuted_lanes);
            assert_eq!(found, expected, "{target:?}");
        }
    }
}
