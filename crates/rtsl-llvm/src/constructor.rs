//! Constructors of a library's classes: `uint32_t symbol(uint32_t *block)`.
//!
//! A constructor's work is done by kernels of the single shape, one for each class of the tree, which find members and
//! parameters in the block as any method finds members, and leave what they give in scratch arrays. The function here
//! says that those arrays are words of the block itself: a kernel stores its outputs after all that it reads.

use std::fmt::Write;

use rtsl_abi::offsets;
use rtsl_packet::Kernel;

/// A constructor.
#[derive(Debug)]
pub struct Constructor {
    /// Its symbol.
    pub symbol: String,
    /// The kernels, in the order of their work.
    pub parts: Vec<ConstructorPart>,
}

/// What one class of the tree does when an instance is made.
#[derive(Debug)]
pub struct ConstructorPart {
    /// A kernel of the single shape. Its scratch array `i` is `outputs[i]`.
    pub kernel: Kernel,
    /// The words of the block that it gives.
    pub outputs: Vec<ConstructedWord>,
}

/// A word that a constructor gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConstructedWord {
    /// Which word of the block.
    pub word: u32,
    /// Bools are 0 and -1 in lane arrays, 0 and 1 in blocks.
    pub is_bool: bool,
}

impl Constructor {
    /// The kernels with their symbols.
    pub(crate) fn kernels(&self) -> impl Iterator<Item = (String, &Kernel)> {
        self.parts.iter().enumerate().map(|(index, part)| (self.part_symbol(index), &part.kernel))
    }

    fn part_symbol(&self, index: usize) -> String {
        format!("{}.{index}", self.symbol)
    }

    /// The function that calls them.
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
