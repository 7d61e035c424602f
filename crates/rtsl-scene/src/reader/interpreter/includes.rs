//! Directives that read other files.

use rtsl::{Diagnostic, diagnostic_codes as codes};

use super::{Executed, Interpreter, MAX_INCLUDE_DEPTH, first_text};
use crate::reader::files::resolve;
use crate::reader::parser::Command;

impl Interpreter<'_> {
    pub fn include(&mut self, command: &Command) -> Executed {
        let name = first_text(command);
        let from = self.open_files.last().cloned().unwrap_or_default();
        let path = resolve(&from, &name.text);
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
        self.read_file(path, Some(name.span));
        Ok(())
    }
}
