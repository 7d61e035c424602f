//! `rtsl explain`: explanations of diagnostic codes.

use clap::Args;
use rtsl::{code_info, codes};

use crate::files::write_result;
use crate::names::no_such;
use crate::outcome::{CommandResult, Failure, Outcome};

/// The command line of `rtsl explain`.
#[derive(Debug, Args)]
pub struct ExplainArguments {
    /// The code, such as E0201; all codes are listed if none is given.
    code: Option<String>,
}

/// Prints the page of a code, or the list of all.
pub fn run(arguments: &ExplainArguments) -> CommandResult {
    let text = match &arguments.code {
        None => {
            let lines = codes().iter().map(|info| format!("{}  {}\n", info.code, info.title));
            lines.collect()
        }
        Some(code) => match code_info(code) {
            Some(info) => format!("# {}: {}\n\n{}", info.code, info.title, info.explanation),
            None => return Err(Failure::Usage(unknown_code(code))),
        },
    };
    write_result(None, text.as_bytes())?;
    Ok(Outcome::Done)
}

fn unknown_code(code: &str) -> String {
    let code = code.to_ascii_uppercase();
    no_such("code", &code, codes().iter().map(|info| info.code.as_str()))
}
