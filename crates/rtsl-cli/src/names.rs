//! Lookup of names from the command line, with messages for those that do not exist.

use rtsl::{Method, StateVariable, lookup_state, most_similar, state_variables};

/// Returns the method of this name, or an error message.
pub fn find_method(name: &str) -> Result<Method, String> {
    let names = Method::ALL.iter().map(|method| method.name());
    Method::from_name(name).ok_or_else(|| no_such("method", name, names))
}

/// Returns the state variable of this name, or an error message.
pub fn find_state(name: &str) -> Result<&'static StateVariable, String> {
    let names = state_variables().iter().filter(|it| !it.is_hidden()).map(|it| it.name);
    lookup_state(name).ok_or_else(|| no_such("state variable", name, names))
}

/// "there is no method `shde`; did you mean `shade`?"
pub fn no_such<'a>(what: &str, name: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    let problem = format!("there is no {what} `{name}`");
    match most_similar(name, names) {
        Some(meant) => format!("{problem}; did you mean `{meant}`?"),
        None => problem,
    }
}
