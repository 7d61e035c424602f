//! Blocks, and the parts of a scene.

use rtsl::{Diagnostic, diagnostic_codes as codes};

use super::{Executed, Interpreter};
use crate::reader::current_transform::CurrentTransform;
use crate::reader::parser::Command;
use crate::reader::state::{Block, BlockKind};

impl Interpreter<'_> {
    pub fn world_begin(&mut self) {
        self.in_world = true;
        self.state.transform = CurrentTransform::IDENTITY;
        self.coordinate_systems.insert("world".to_owned(), CurrentTransform::IDENTITY);
    }

    pub fn begin(&mut self, kind: BlockKind, command: &Command) {
        let saved = self.state.clone();
        self.blocks.push(Block { kind, span: command.span, saved });
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
