//! The variables that a client can ask for while the debugger is at a statement.

use rtsl::{TracedValue, type_name};
use rtsl_debug::{Replay, Scopes};
use serde_json::{Value as Json, json};

/// A list of variables, each with its name and the expression that gives it.
type Variables = Vec<(String, Option<String>, TracedValue)>;

/// The lists of variables that clients know by numbers, from 1. Movements forget them.
#[derive(Default)]
pub struct Handles {
    lists: Vec<Variables>,
    /// The lists of plain texts, which follow.
    texts: Vec<Vec<(String, String)>>,
}

/// The distance of the numbers of lists of texts from those of variables.
const TEXTS: usize = 1 << 30;

impl Handles {
    /// Forgets all lists.
    pub fn clear(&mut self) {
        *self = Handles::default();
    }

    /// Returns the scopes of a call as the protocol has them.
    pub fn scopes(&mut self, replay: &Replay, scopes: Scopes, facts: &[(String, String)]) -> Json {
        let Scopes { locals, members, state_read, state_set, result, results } = scopes;
        let named = |values: Vec<TracedValue>| -> Variables {
            let named = |value: TracedValue| {
                (value.name().to_owned(), Some(value.name().to_owned()), value)
            };
            values.into_iter().map(named).collect()
        };
        let results = results.into_iter().map(|(function, value)| {
            let name = match value.name() {
                "" => format!("{function}()"),
                name => format!("{function}(): {name}"),
            };
            (name, None, value)
        });
        let result = result.map(|value| ("result".to_owned(), None, value));
        let results = result.into_iter().chain(results);
        let lists = [
            ("Locals", Some("locals"), named(locals)),
            ("Results", Some("returnValue"), results.collect()),
            ("Members", None, named(members)),
            ("State read", None, named(state_read)),
            ("State set", None, named(state_set)),
        ];
        let mut all = Vec::new();
        for (name, hint, variables) in lists {
            if variables.is_empty() && hint != Some("locals") {
                continue;
            }
            let count = variables.len();
            let mut scope = json!({
                "name": name,
                "variablesReference": self.add(variables),
                "namedVariables": count,
                "expensive": false,
            });
            if let Some(hint) = hint {
                scope["presentationHint"] = json!(hint);
            }
            all.push(scope);
        }
        let mut facts = facts.to_vec();
        facts.push(("statement".to_owned(), format!("{} of {}", replay.position(), replay.len())));
        facts.extend(replay.notes().last().map(|note| ("renderer".to_owned(), note.to_owned())));
        self.texts.push(facts);
        let reference = TEXTS + self.texts.len();
        all.push(json!({ "name": "Path", "variablesReference": reference, "expensive": false }));
        json!({ "scopes": all })
    }

    /// Returns a list of variables.
    pub fn variables(&mut self, reference: i64) -> Result<Json, String> {
        let reference = usize::try_from(reference).unwrap_or_default();
        if let Some(texts) = reference.checked_sub(TEXTS + 1).and_then(|it| self.texts.get(it)) {
            let texts = texts.iter().map(
                |(name, value)| json!({ "name": name, "value": value, "variablesReference": 0 }),
            );
            return Ok(json!({ "variables": texts.collect::<Vec<_>>() }));
        }
        let list = reference.checked_sub(1).and_then(|index| self.lists.get(index)).cloned();
        let list = list.ok_or("these variables are of an earlier statement")?;
        let variables = list.iter().map(|(name, expression, value)| {
            let mut variable = self.value(expression.as_deref(), value, "value");
            variable["name"] = json!(name);
            if let Some(expression) = expression {
                variable["evaluateName"] = json!(expression);
            }
            variable
        });
        Ok(json!({ "variables": variables.collect::<Vec<_>>() }))
    }

    /// Returns a value, whose parts the client can ask for. `key` is the name of its text in the message.
    pub fn value(&mut self, expression: Option<&str>, value: &TracedValue, key: &str) -> Json {
        let parts = value.parts();
        let named = parts.into_iter().map(|part| {
            let name = part.name().to_owned();
            let expression = expression.map(|whole| match name.starts_with('[') {
                true => format!("{whole}{name}"),
                false => format!("{whole}.{name}"),
            });
            (name, expression, part)
        });
        let parts: Variables = named.collect();
        let reference = if parts.is_empty() { 0 } else { self.add(parts) };
        json!({
            key: value.to_string(),
            "type": type_name(value.ty()),
            "variablesReference": reference,
        })
    }

    fn add(&mut self, variables: Variables) -> usize {
        self.lists.push(variables);
        self.lists.len()
    }
}
