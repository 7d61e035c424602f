//! Expressions of recorded values, which the compiler and the interpreter evaluate as they do those of shaders.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, CompilerOptions, Constant, Engine,
    EngineOptions, Instance, Instances, Method, ParameterType, Trace, TraceDetail, TraceKind,
    TracedValue, Value, new_state, type_name,
};

use crate::path::{self, Found, is_of_name};
use crate::scopes::Scopes;

/// The greatest number of compiled expressions that are kept.
const KEPT: usize = 64;
/// The number of iterations after which an expression is given up: a function that it calls may have loops.
const LOOP_BUDGET: u32 = 1 << 20;
/// The class around an expression.
const CLASS: &str = "EvaluatedExpression";
/// The start of the names that stand for state variables, which a class can't declare.
const STATE: &str = "state_";
/// The start of the names that stand for parts of structs.
const PART: &str = "partOfStruct";

/// Evaluates expressions, and keeps their code.
#[derive(Default)]
pub(crate) struct Evaluator {
    engine: Option<(Engine, Trace)>,
    /// The classes, by their texts.
    classes: BTreeMap<String, Arc<Class>>,
}

impl Evaluator {
    /// Evaluates an expression of variables.
    ///
    /// # Errors
    /// If the compiler refuses it, or it has no value.
    pub fn evaluate(&mut self, text: &str, scopes: &Scopes) -> Result<TracedValue, String> {
        match path::find(scopes, text) {
            Found::Value(value) => return Ok(value),
            Found::NoPart(message) => return Err(message),
            Found::NoPath => {}
        }
        check_form(text)?;
        let (expression, variables) = split_names(text, scopes)?;
        let class = self.class(&class_text(&expression, &variables), text)?;
        let parameters = variables.iter().map(|(name, value)| (name.as_str(), value_of(value)));
        let refused = |errors: rtsl::Diagnostics| first_message(errors.iter());
        let instance = Instance::new(&class, parameters).map_err(refused)?;
        let value = self.call(&instance)?;
        Ok(path::renamed(&value, text.trim().to_owned()))
    }

    /// Evaluates a condition.
    ///
    /// # Errors
    /// As for [`Evaluator::evaluate`], and if the value is no bool.
    pub fn is_true(&mut self, text: &str, scopes: &Scopes) -> Result<bool, String> {
        let value = self.evaluate(text, scopes)?;
        match value.scalar() {
            Some(Constant::Bool(value)) => Ok(value),
            _ => Err(format!("`{text}` is {}, not a bool", type_name(value.ty()))),
        }
    }

    fn class(&mut self, class: &str, text: &str) -> Result<Arc<Class>, String> {
        if let Some(known) = self.classes.get(class) {
            return Ok(known.clone());
        }
        let compiler = Compiler::new(CompilerOptions {
            traced: true,
            loop_budget: Some(LOOP_BUDGET),
            ..CompilerOptions::default()
        });
        let compilation = compiler.compile("expression", class);
        let Some(unit) = &compilation.unit else {
            let message = first_message(compilation.diagnostics.iter());
            return Err(format!("`{}` can't be evaluated: {message}", text.trim()));
        };
        let compiled = unit.class(CLASS).map_err(|error| error.message)?.clone();
        if self.classes.len() == KEPT {
            self.classes.pop_first();
        }
        self.classes.insert(class.to_owned(), compiled.clone());
        Ok(compiled)
    }

    fn call(&mut self, instance: &Arc<Instance>) -> Result<TracedValue, String> {
        let (engine, trace) = self.engine()?;
        let program = engine.program(instance);
        let kernel = program.kernel(Method::Lookup, CallMode::Packet).map_err(|it| it.message)?;
        trace.start();
        let status = kernel.call(CallArguments {
            state: &mut new_state(1),
            scratch: &mut program.new_scratch(1),
            count: 1,
            mask: None,
            accepted: None,
            instances: Instances::One(&program.block(instance)),
            host: &mut NoHost,
        });
        let recording = trace.take();
        if status.budget_exhausted {
            return Err(format!(
                "the expression takes more than {LOOP_BUDGET} iterations of loops"
            ));
        }
        let printed = recording.entries.into_iter().find_map(|entry| match entry.kind {
            TraceKind::Print(_, values) => values.into_iter().next(),
            _ => None,
        });
        printed.ok_or_else(|| "the expression has no value".to_owned())
    }

    fn engine(&mut self) -> Result<(Engine, Trace), String> {
        if let Some(known) = &self.engine {
            return Ok(known.clone());
        }
        let limits = rtsl::TraceLimits { skip: 0, keep: usize::MAX };
        let trace = Trace::with_limits(TraceDetail::Prints, limits);
        let options = EngineOptions {
            backend: Backend::Interpreter,
            loop_budget: Some(LOOP_BUDGET),
            trace: Some(trace.clone()),
            ..EngineOptions::default()
        };
        let (engine, _) = Engine::new(options).map_err(|error| error.message)?;
        Ok(self.engine.insert((engine, trace)).clone())
    }
}

/// Refuses texts that are no expression but would compile in the place of one.
fn check_form(text: &str) -> Result<(), String> {
    let mut open = 0i32;
    for letter in text.chars() {
        match letter {
            '(' | '[' => open += 1,
            ')' | ']' => open -= 1,
            ';' | '{' | '}' | '"' | '#' | '\n' => {
                return Err(format!("an expression can't have `{}`", letter.escape_default()));
            }
            _ => {}
        }
        if open < 0 {
            break;
        }
    }
    if assigns(text) {
        return Err("an expression can't set a variable: what has run stays as it is".to_owned());
    }
    match text.trim() {
        "" => Err("the expression is empty".to_owned()),
        _ if open != 0 => Err("the brackets of the expression don't match".to_owned()),
        _ => Ok(()),
    }
}

/// True if a text has an operator that sets a variable.
fn assigns(text: &str) -> bool {
    if text.contains("++") || text.contains("--") {
        return true;
    }
    // Comparisons have `=`, too; shifts that assign begin as they do.
    let others = text.replace("<<=", " =").replace(">>=", " =");
    let others =
        ["==", "<=", ">=", "!="].iter().fold(others, |text, known| text.replace(known, ""));
    others.contains('=')
}

/// Returns the expression with other names for state variables and parts of structs, and the values that it names.
fn split_names(
    text: &str,
    scopes: &Scopes,
) -> Result<(String, BTreeMap<String, TracedValue>), String> {
    let mut expression = String::new();
    let mut variables = BTreeMap::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_name = first.is_ascii_alphabetic() || first == '_';
        let end = match is_of_name(first) {
            true => rest.find(|letter: char| !is_of_name(letter)).unwrap_or(rest.len()),
            false => first.len_utf8(),
        };
        let (word, after) = rest.split_at(end);
        rest = after;
        let is_part = expression.trim_end().ends_with('.');
        let Some(value) = scopes.find(word).filter(|_| is_name && !is_part) else {
            expression += word;
            continue;
        };
        let (value, name) = match holds_structs(value) {
            true => {
                let (part, after) = path::part_without_structs(scopes, value, rest)?;
                rest = after;
                (part, format!("{PART}{}", variables.len()))
            }
            false if word.starts_with("rt_") => (value.clone(), format!("{STATE}{word}")),
            false => (value.clone(), word.to_owned()),
        };
        expression += &name;
        variables.insert(name, value);
    }
    Ok((expression, variables))
}

/// True for structs and arrays of them, which a class around an expression does not declare.
pub(crate) fn holds_structs(value: &TracedValue) -> bool {
    let mut ty = value.ty();
    while let ParameterType::Array(element, _) = ty {
        ty = element;
    }
    matches!(ty, ParameterType::Struct(..))
}

/// The text of a class whose method prints the value of an expression.
fn class_text(expression: &str, variables: &BTreeMap<String, TracedValue>) -> String {
    let declared = |(name, value): (&String, &TracedValue)| {
        let ty = match value.ty() {
            // Traces know state variables as vectors.
            ParameterType::Vector(scalar, 1) => rtsl::scalar_name(*scalar).to_owned(),
            ty => type_name(ty),
        };
        let (ty, sizes) = ty.split_at(ty.find('[').unwrap_or(ty.len()));
        format!("public {ty} {name}{sizes};\n")
    };
    let members: String = variables.iter().map(declared).collect();
    format!(
        "class {CLASS} : rt_Texture;\n{members}void lookup() {{ print(\"{{}}\", ({expression})); }}\n"
    )
}

/// Converts a value to that of a parameter.
fn value_of(value: &TracedValue) -> Value {
    match value.scalar() {
        Some(Constant::F32(value)) => Value::Float(value),
        Some(Constant::I32(value)) => Value::Int(value),
        Some(Constant::U32(value)) => Value::Uint(value),
        Some(Constant::Bool(value)) => Value::Bool(value),
        None => Value::List(value.parts().iter().map(value_of).collect()),
    }
}

fn first_message<'a>(mut messages: impl Iterator<Item = &'a rtsl::Diagnostic>) -> String {
    messages.next().map_or_else(String::new, |diagnostic| {
        let label = diagnostic.labels.first().map(|label| label.message.as_str());
        match label.filter(|label| !label.is_empty()) {
            Some(label) => format!("{}: {label}", diagnostic.message),
            None => diagnostic.message.clone(),
        }
    })
}
