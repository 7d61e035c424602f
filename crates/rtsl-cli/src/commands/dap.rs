//! `rtsl dap`: the debugger for editors.

use std::hash::{BuildHasher, RandomState};
use std::io::{self, BufReader, BufWriter};
use std::net::{Ipv4Addr, TcpListener};

use clap::Args;
use clap::builder::NonEmptyStringValueParser;

use crate::debug::{Gate, serve};
use crate::outcome::{CommandResult, Failure, Outcome};

/// The command line of `rtsl dap`.
#[derive(Debug, Args)]
pub struct DapArguments {
    /// Wait for one client on this port of this machine, in place of standard input and output; 0 for any free port,
    /// which is printed.
    #[arg(long, value_name = "N")]
    port: Option<u16>,
    /// The token that the client gives as the argument `token` of `launch`; one that is printed, if not given. Other
    /// users of the machine see command lines.
    #[arg(long, value_name = "TEXT", requires = "port", value_parser = NonEmptyStringValueParser::new())]
    token: Option<String>,
}

/// Serves one client.
pub fn run(arguments: &DapArguments) -> CommandResult {
    let served = match arguments.port {
        Some(port) => serve_port(port, arguments.token.clone()),
        None => {
            let (input, output) = (BufReader::new(io::stdin()), io::stdout().lock());
            serve(input, BufWriter::new(output), &mut Gate::open())
        }
    };
    served.map_err(Failure::Output)?;
    Ok(Outcome::Done)
}

/// Serves the first client that has the token: all users of the machine, and all pages in a browser, reach the port.
fn serve_port(port: u16, token: Option<String>) -> io::Result<()> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
    println!("listening on {}", listener.local_addr()?);
    let token = token.unwrap_or_else(|| {
        let token = new_token();
        println!("token {token}");
        token
    });
    loop {
        let (stream, _) = listener.accept()?;
        let mut gate = Gate::with_token(token.clone());
        let input = BufReader::new(stream.try_clone()?);
        let served = serve(input, BufWriter::new(stream), &mut gate);
        if gate.is_open() {
            return served;
        }
    }
}

/// Returns a token that nobody can guess: the hashes of two hashers, whose keys of 128 bits the system draws.
fn new_token() -> String {
    let part = || format!("{:016x}", RandomState::new().hash_one("token"));
    part() + &part()
}
