//! Names that users give, and what to say of those that do not exist.

use rtsl::{Method, most_similar};

/// The method of this name, or what to say.
pub fn find_method(name: &str) -> Result<Method, String> {
    let names = Method::ALL.iter().map(|method| method.name());
    Method::from_name(name).ok_or_else(|| no_such("method", name, names))
}

/// "there is no method `shde`; did you mean `shade`?"
pub fn no_such<'a>(what: &str, name: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    let problem = format!("there is no {what} `{name}`");
    match most_similar(name, names) {
        Some(meant) => format!("{problem}; did you mean `{meant}`?"),
        None => problem,
    }
}
