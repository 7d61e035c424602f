//! Directives that read other files.

use std::path::{Path, PathBuf};

use rtsl::{Diagnostic, diagnostic_codes as codes};

use super::{Executed, Interpreter, first_text};
use crate::reader::limits::{MAX_INCLUDE_DEPTH, included_path};
use crate::reader::parser::Command;

impl Interpreter<'_> {
    /// Reads the file that a command names. Returns its last command if it is still to be executed.
    pub fn include(&mut self, command: &Command) -> Result<Option<Command>, Box<Diagnostic>> {
        let name = first_text(command);
        self.note_backslashes(&name.text, name.span);
        let path = self.included_path(&name.text);
        let cycle = self.open_files.contains(&path);
        if cycle || self.open_files.len() >= MAX_INCLUDE_DEPTH {
            let message = if cycle {
                format!("`{}` includes itself", path.display())
            } else {
                format!("files include one another more than {MAX_INCLUDE_DEPTH} deep")
            };
            let chain: Vec<String> =
                self.open_files.iter().map(|path| path.display().to_string()).collect();
            return Err(Box::new(
                Diagnostic::new(codes::INCLUDE_CYCLE, message)
                    .at(name.span, "included again here")
                    .note(format!("open files: {}", chain.join(" -> "))),
            ));
        }
        self.description.included.entry(path.clone()).or_insert(name.span);
        Ok(self.read_file(path, Some(name.span)))
    }

    /// Reads a file whose changes to the graphics state end with it.
    pub fn import(&mut self, command: &Command) -> Executed {
        let (state, blocks) = (self.state.clone(), self.blocks.len());
        let last = self.include(command)?;
        if let Some(last) = last {
            self.run(last);
        }
        self.close_blocks(blocks);
        self.state = state;
        Ok(())
    }

    fn included_path(&self, name: &str) -> PathBuf {
        let exists =
            |path: &Path| self.known_files.contains_key(path) || self.files.size(path).is_ok();
        included_path(name, self.main_file, self.open_files.last(), exists)
    }
}
