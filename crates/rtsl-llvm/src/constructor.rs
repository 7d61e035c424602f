//! Constructors of a library's classes: `uint32_t symbol(uint32_t *block)`.
//!
//! A constructor consists of kernels in the single mode, one for each class of the tree, which read members and
//! parameters from the block as any method reads members, and store their results in scratch arrays. The function
//! emitted here makes those arrays words of the block itself, which is safe because a kernel stores its outputs after
//! all loads.

use std::fmt::Write;

use rtsl_abi::offsets;
use rtsl_packet::Kernel;

/// A constructor.
#[derive(Debug)]
pub struct Constructor {
    /// The symbol.
    pub symbol: String,
    /// The kernels, in the order of execution.
    pub parts: Vec<ConstructorPart>,
}

/// The part of a constructor for one class of the tree.
#[derive(Debug)]
pub struct ConstructorPart {
    /// A kernel in the single mode. Its scratch array `i` is `outputs[i]`.
    pub kernel: Kernel,
    /// The words of the block that it stores.
    pub outputs: Vec<ConstructedWord>,
}

/// A word that a constructor stores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConstructedWord {
    /// The index of the word in the block.
    pub word: u32,
    /// True for a bool, which is 0 or -1 in lane arrays and 0 or 1 in blocks.
    pub is_bool: bool,
}

impl Constructor {
    /// Returns the kernels with their symbols.
    pub(crate) fn kernels(&self) -> impl Iterator<Item = (String, &Kernel)> {
        self.parts.iter().enumerate().map(|(index, part)| (self.part_symbol(index), &part.kernel))
    }

    fn part_symbol(&self, index: usize) -> String {
        format!("{}.{index}", self.symbol)
    }

    /// Returns the text of the function that calls them.
    pub(crate) fn function(&self) -> String {
        let (size, slots) = (offsets::CALL_SIZE, self.parts.iter().map(|part| part.outputs.len()));
        let slots = slots.max().unwrap_or(0).max(1);
        let mut text = format!(
            "define i32 @\"{}\"(ptr %block) #0 {{\nentry:\n  %call = alloca [{size} x i8], align 8\n  \
             %table = alloca [{slots} x ptr], align 8\n",
            self.symbol
        );
        let mut call = |field: u32, name: &str, store: &str| {
            let _ = writeln!(text, "  %{name}.at = getelementptr i8, ptr %call, i64 {field}");
            let _ = writeln!(text, "  store {store}, ptr %{name}.at, align 4");
        };
        call(offsets::CALL_INSTANCE, "instance", "ptr %block");
        call(offsets::CALL_SCRATCH, "scratch", "ptr %table");
        call(offsets::CALL_COUNT, "count", "i32 1");
        call(offsets::CALL_STATUS, "status", "i32 0");
        for (index, part) in self.parts.iter().enumerate() {
            part.call(index, &self.part_symbol(index), &mut text);
        }
        text.push_str("  %status = load i32, ptr %status.at, align 4\n  ret i32 %status\n}\n\n");
        text
    }
}

impl ConstructorPart {
    fn call(&self, part: usize, symbol: &str, text: &mut String) {
        for (index, output) in self.outputs.iter().enumerate() {
            let _ = writeln!(
                text,
                "  %word.{part}.{index} = getelementptr i32, ptr %block, i64 {}\n  \
                 %local.{part}.{index} = getelementptr ptr, ptr %table, i64 {index}\n  \
                 store ptr %word.{part}.{index}, ptr %local.{part}.{index}, align 8",
                output.word
            );
        }
        let _ = writeln!(text, "  call void @\"{symbol}\"(ptr %call)");
        let bools = self.outputs.iter().enumerate().filter(|(_, output)| output.is_bool);
        for (index, _) in bools {
            let _ = writeln!(
                text,
                "  %lane.{part}.{index} = load i32, ptr %word.{part}.{index}, align 4\n  \
                 %bool.{part}.{index} = and i32 %lane.{part}.{index}, 1\n  \
                 store i32 %bool.{part}.{index}, ptr %word.{part}.{index}, align 4"
            );
        }
    }
}
