//! Stack frames of compiled functions.
//!
//! Values that do not fit into registers are spilled to the stack, a vector each, so a shader determines the stack size
//! of its kernels. LLVM reports the frame of every function that has [`REPORT_ATTRIBUTE`], and a module with a frame
//! beyond [`MAX_FRAME_BYTES`] is refused. Frames of more than a page touch every page (`"probe-stack"`), so one that
//! does not fit after all hits the stack's guard page.

use std::collections::BTreeMap;

use rtsl_packet::Kernel;

use crate::error::JitError;
use crate::limits::MAX_FRAME_BYTES;

/// The attribute that makes LLVM report the frame of a function that is larger than the value: a warning to the
/// diagnostic handler.
pub const REPORT_ATTRIBUTE: (&str, &str) = ("warn-stack-size", "0");

/// An allowance for every function: saved registers, alignment for vectors, the return address, and helpers that
/// emulate an instruction.
const BEYOND_FRAME: usize = 4 << 10;

/// The stack sizes of the functions of a module.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Frames {
    /// The size of each function, in bytes.
    bytes: BTreeMap<String, usize>,
}

impl Frames {
    /// Records a warning of LLVM: `stack frame size (1544) exceeds limit (0) in function 'kernel0'`. Returns false for
    /// a warning of another kind.
    ///
    /// # Errors
    /// If a warning about a stack cannot be parsed: the frame must not be assumed to be empty.
    pub fn add_report(&mut self, warning: &str) -> Result<bool, String> {
        if !warning.contains("stack") {
            return Ok(false);
        }
        let unknown = || format!("it reports a stack frame in an unknown format: {warning}");
        let size = between(warning, "size (", ')').and_then(|size| size.parse().ok());
        let function = between(warning, "function '", '\'');
        let (size, function) = size.zip(function).ok_or_else(unknown)?;
        self.add(function, size);
        Ok(true)
    }

    /// Records the frame of a function.
    pub fn add(&mut self, function: &str, bytes: usize) {
        self.bytes.insert(function.to_owned(), bytes);
    }

    /// Returns the functions, each with its frame.
    pub fn iter(&self) -> impl Iterator<Item = (&str, usize)> {
        self.bytes.iter().map(|(function, bytes)| (function.as_str(), *bytes))
    }

    /// Returns the stack size of a call of the function: its frame, and the largest of its parts, `function.rest` and
    /// the like, which it calls one at a time.
    pub fn of(&self, function: &str) -> usize {
        let own = self.bytes.get(function).copied().unwrap_or(0);
        let parts = self.bytes.range(format!("{function}.")..);
        let parts = parts.take_while(|(name, _)| is_part(name, function));
        let largest = parts.map(|(_, bytes)| *bytes).max().unwrap_or(0);
        own.saturating_add(largest).saturating_add(BEYOND_FRAME)
    }

    /// Refuses a module with a function that needs too much stack.
    ///
    /// # Errors
    /// [`JitError::Frame`].
    pub fn check(&self) -> Result<(), JitError> {
        for name in self.bytes.keys() {
            let function = name.split('.').next().unwrap_or(name);
            let bytes = self.of(function);
            if bytes > MAX_FRAME_BYTES {
                return Err(JitError::Frame { function: function.to_owned(), bytes });
            }
        }
        Ok(())
    }
}

fn is_part(name: &str, function: &str) -> bool {
    name.strip_prefix(function).is_some_and(|rest| rest.starts_with('.'))
}

/// Returns the text between `start` and `end`.
fn between<'a>(text: &'a str, start: &str, end: char) -> Option<&'a str> {
    let (_, rest) = text.split_once(start)?;
    rest.split_once(end).map(|(inside, _)| inside)
}

/// Returns the bytes of the stack that a kernel needs at least.
///
/// # Errors
/// [`JitError::Frame`], if no code of the kernel can have a frame that is small enough: LLVM would take its time to
/// find that.
pub(crate) fn check_least(symbol: &str, kernel: &Kernel) -> Result<usize, JitError> {
    let bytes = kernel.least_frame_bytes();
    if bytes > MAX_FRAME_BYTES {
        return Err(JitError::Frame { function: symbol.to_owned(), bytes });
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_are_understood() {
        let mut frames = Frames::default();
        let reports = [
            "stack frame size (1000) exceeds limit (0) in function 'kernel1'",
            "<unknown>:0:0: stack frame size (3000) exceeds limit (0) in function 'kernel1.rest'",
            "<unknown>:0:0: stack frame size (2000) exceeds limit (0) in function 'kernel1.test'",
            "stack frame size (50000) exceeds limit (0) in function 'kernel10.rest'",
        ];
        for report in reports {
            assert_eq!(frames.add_report(report), Ok(true));
        }
        assert_eq!(frames.add_report("loop not unrolled"), Ok(false));
        assert!(frames.add_report("the stack of 'f' is too large by 7").is_err());
        assert_eq!(frames.of("kernel1"), 4000 + BEYOND_FRAME);
        assert_eq!(frames.of("kernel10"), 50_000 + BEYOND_FRAME);
        assert_eq!(frames.of("kernel2"), BEYOND_FRAME);
        assert_eq!(frames.check(), Ok(()));
        let report = "stack frame size (300000) exceeds limit (0) in function 'kernel3.rest'";
        assert_eq!(frames.add_report(report), Ok(true));
        let bytes = 300_000 + BEYOND_FRAME;
        assert_eq!(frames.check(), Err(JitError::Frame { function: "kernel3".to_owned(), bytes }));
    }
}
