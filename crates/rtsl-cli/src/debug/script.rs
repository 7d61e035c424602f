//! The commands of `rtsl debug`: from a terminal, or from a file or a pipe.

use std::io::{self, BufRead, IsTerminal, Write};

/// The greatest length of a command, in bytes.
const MAX_COMMAND: u64 = 1 << 16;

/// Reads commands line by line.
pub struct Commands {
    input: Box<dyn BufRead>,
    is_interactive: bool,
}

impl Commands {
    /// Creates the commands of standard input.
    pub fn of_stdin() -> Commands {
        let is_interactive = io::stdin().is_terminal();
        Commands { input: Box::new(io::stdin().lock()), is_interactive }
    }

    /// Creates the commands of a text.
    pub fn of_text(text: String) -> Commands {
        Commands { input: Box::new(io::Cursor::new(text)), is_interactive: false }
    }

    /// Returns true if a user types them.
    pub fn is_interactive(&self) -> bool {
        self.is_interactive
    }

    /// Returns the next command; none at the end of the input. Commands that nobody types are shown as if they were
    /// typed, so that the output reads as a session.
    pub fn next(&mut self, output: &mut impl Write) -> io::Result<Option<String>> {
        write!(output, "(rtsl) ")?;
        output.flush()?;
        let mut line = String::new();
        let read = io::Read::take(&mut self.input, MAX_COMMAND).read_line(&mut line)?;
        let command = line.trim().to_owned();
        if read == 0 {
            writeln!(output)?;
            return Ok(None);
        }
        if !self.is_interactive {
            writeln!(output, "{command}")?;
        }
        Ok(Some(command))
    }
}
