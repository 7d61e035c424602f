//! The admission of clients of the adapter.

use super::protocol::Request;

/// The answer to a client without the token.
pub const REFUSED: &str = "the argument `token` of `launch` is not the one that `rtsl dap --port` printed, or was \
                           given by `--token`";

/// Lets a client do more than introduce itself once it has launched with the token.
#[derive(Debug)]
pub struct Gate {
    /// `None` if the client is known.
    token: Option<String>,
}

impl Gate {
    /// A gate for a client that is known, because it has started the adapter.
    pub fn open() -> Gate {
        Gate { token: None }
    }

    /// A gate that this token opens.
    pub fn with_token(token: String) -> Gate {
        Gate { token: Some(token) }
    }

    /// True if the client is known.
    pub fn is_open(&self) -> bool {
        self.token.is_none()
    }

    /// True if the request may be answered. It may open the gate.
    pub fn admits(&mut self, request: &Request) -> bool {
        let given = request.arguments.get("token").and_then(|token| token.as_str());
        if request.command == "launch" && given.is_some() && given == self.token.as_deref() {
            self.token = None;
        }
        self.is_open() || request.command == "initialize"
    }
}
