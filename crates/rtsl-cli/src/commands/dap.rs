//! `rtsl dap`: the debugger for editors.

use std::io::{self, BufReader, BufWriter};
use std::net::{Ipv4Addr, TcpListener};

use clap::Args;

use crate::debug::serve;
use crate::outcome::{CommandResult, Failure, Outcome};

/// The command line of `rtsl dap`.
#[derive(Debug, Args)]
pub struct DapArguments {
    /// Wait for one client on this port of this machine, in place of standard input and output; 0 for any free port,
    /// which is printed.
    #[arg(long, value_name = "N")]
    port: Option<u16>,
}

/// Serves one client.
pub fn run(arguments: &DapArguments) -> CommandResult {
    let served = match arguments.port {
        Some(port) => serve_port(port),
        None => serve(BufReader::new(io::stdin()), BufWriter::new(io::stdout().lock())),
    };
    served.map_err(Failure::Output)?;
    Ok(Outcome::Done)
}

fn serve_port(port: u16) -> io::Result<()> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
    println!("listening on {}", listener.local_addr()?);
    let (stream, _) = listener.accept()?;
    serve(BufReader::new(stream.try_clone()?), BufWriter::new(stream))
}
