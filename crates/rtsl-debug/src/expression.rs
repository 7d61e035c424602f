//! Expressions of recorded values, which the compiler and the interpreter evaluate as they do those of shaders.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Compiler, CompilerOptions, Constant, Engine, EngineOptions,
    Instance, Instances, Kernel, Method, ParameterType, Program, Scalar, Trace, TraceDetail,
    TraceKind, TracedValue, Value, new_state, type_name,
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
    /// The expressions, by the texts of the classes around them.
    compiled: BTreeMap<String, Compiled>,
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
        let compiled = self.compiled(&class_text(&expression, &variables), text)?;
        let value = compiled.call(&variables)?;
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

    fn compiled(&mut self, class: &str, text: &str) -> Result<&Compiled, String> {
        if !self.compiled.contains_key(class) {
            let (engine, trace) = self.engine()?;
            let compiled = Compiled::new(class, text, &engine, trace)?;
            if self.compiled.len() == KEPT {
                self.compiled.pop_first();
            }
            self.compiled.insert(class.to_owned(), compiled);
        }
        Ok(&self.compiled[class])
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

/// An expression with its code.
struct Compiled {
    trace: Trace,
    instance: Arc<Instance>,
    program: Arc<Program>,
    kernel: Arc<Kernel>,
}

impl Compiled {
    fn new(class: &str, text: &str, engine: &Engine, trace: Trace) -> Result<Compiled, String> {
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
        let class = unit.class(CLASS).map_err(|error| error.message)?;
        let instance = Instance::new(class, std::iter::empty::<(&str, Value)>());
        let instance = instance.map_err(|errors| first_message(errors.iter()))?;
        let program = engine.program(&instance);
        let kernel = program.kernel(Method::Lookup, CallMode::Packet).map_err(|it| it.message)?;
        Ok(Compiled { trace, instance, program, kernel })
    }

    fn call(&self, variables: &BTreeMap<String, TracedValue>) -> Result<TracedValue, String> {
        let mut scratch = self.program.new_scratch(1);
        for (name, value) in variables {
            let Some(first) = self.program.layout().scratch.get(name) else { continue };
            for (index, word) in value.words.iter().enumerate() {
                // Kernels represent true by all ones.
                let word = if holds_bools(value.ty()) && *word != 0 { u32::MAX } else { *word };
                scratch.words_mut(*first as usize + index)[0] = word;
            }
        }
        self.trace.start();
        let status = self.kernel.call(CallArguments {
            state: &mut new_state(1),
            scratch: &mut scratch,
            count: 1,
            mask: None,
            accepted: None,
            instances: Instances::One(&self.program.block(&self.instance)),
            host: &mut NoHost,
        });
        let recording = self.trace.take();
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
}

/// True for bools, and vectors and arrays of them.
fn holds_bools(ty: &ParameterType) -> bool {
    match ty {
        ParameterType::Scalar(scalar) | ParameterType::Vector(scalar, _) => *scalar == Scalar::Bool,
        ParameterType::Array(element, _) => holds_bools(element),
        _ => false,
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
        format!("scratch {ty} {name}{sizes};\n")
    };
    let members: String = variables.iter().map(declared).collect();
    format!(
        "class {CLASS} : rt_Texture;\n{members}void lookup() {{ print(\"{{}}\", ({expression})); }}\n"
    )
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
