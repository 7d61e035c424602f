//! Blocks, and the parts of a scene.

use rtsl::{Diagnostic, Span, diagnostic_codes as codes};

use super::{Executed, Interpreter};
use crate::reader::current_transform::CurrentTransform;
use crate::reader::parser::Command;
use crate::reader::state::{Block, BlockKind};

impl Interpreter<'_> {
    pub fn world_begin(&mut self, span: Span) {
        self.description.world_begin = Some(span);
        self.state.transform = CurrentTransform::IDENTITY;
        self.coordinate_systems.insert("world".to_owned(), CurrentTransform::IDENTITY);
    }

    /// Reports the blocks that are open beyond the first `count`, and restores the state before them.
    pub fn close_blocks(&mut self, count: usize) {
        for block in self.blocks.split_off(count.min(self.blocks.len())) {
            self.diagnostics.push(
                Diagnostic::new(
                    codes::MISPLACED_DIRECTIVE,
                    format!("`{}` without its `{}`", block.kind.begin(), block.kind.end()),
                )
                .at(block.span, "this block is never closed"),
            );
        }
    }

    pub fn begin(&mut self, kind: BlockKind, span: Span) {
        let saved = self.state.clone();
        self.blocks.push(Block { kind, span, saved });
    }

    pub fn end(&mut self, kind: BlockKind, command: &Command) -> Executed {
        let misplaced = |message: String| {
            Box::new(Diagnostic::new(codes::MISPLACED_DIRECTIVE, message).at(command.span, ""))
        };
        match self.blocks.pop_if(|block| block.kind == kind) {
            Some(block) if kind == BlockKind::Transform => {
                self.state.transform = block.saved.transform;
                Ok(())
            }
            Some(block) => {
                self.state = block.saved;
                Ok(())
            }
            None => Err(match self.blocks.last() {
                None => misplaced(format!("`{}` without its `{}`", kind.end(), kind.begin())),
                Some(open) => {
                    let message = format!("found `{}`, expected `{}`", kind.end(), open.kind.end());
                    Box::new(misplaced(message).label(open.span, "this block is open"))
                }
            }),
        }
    }
}
