//! Compilation of a translated shader, and calls of it on the interpreter.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, CompilerOptions, Engine, EngineOptions,
    Instance, Instances, Method, Numbers, ParameterType, Scalar, Value, new_state,
};

/// The words of variables; those of structs by the names of their leaves, such as `light.color`.
pub type Words = BTreeMap<String, Vec<u32>>;

/// The loop iterations of a call: more than a case means.
const BUDGET: u32 = 1 << 20;

/// A compiler and the interpreter.
pub struct Runner {
    compiler: Compiler,
    engine: Engine,
}

/// An error of a text.
#[derive(Clone, Debug)]
pub struct Problem {
    pub code: &'static str,
    pub message: String,
}

/// The compiler's answer to a text.
pub struct Verdict {
    pub class: Option<Arc<Class>>,
    pub errors: Vec<Problem>,
}

impl Runner {
    /// The interpreter, for one ray.
    pub fn new() -> Runner {
        let options = CompilerOptions { loop_budget: Some(BUDGET), ..Default::default() };
        let engine = EngineOptions {
            backend: Backend::Interpreter,
            width: Some(1),
            loop_budget: Some(BUDGET),
            ..Default::default()
        };
        let (engine, _) = Engine::new(engine).expect("the interpreter needs nothing");
        Runner { compiler: Compiler::new(options), engine }
    }

    /// Compiles a translation.
    pub fn compile(&self, text: &str) -> Verdict {
        let compilation = self.compiler.compile("case.rtsl", text);
        let mut verdict = Verdict { class: None, errors: Vec::new() };
        for diagnostic in compilation.diagnostics.iter().filter(|it| it.is_error()) {
            let labels =
                diagnostic.primary.iter().chain(&diagnostic.labels).map(|it| it.message.as_str());
            let message = diagnostic.message.clone();
            let message =
                std::iter::once(message.as_str()).chain(labels).collect::<Vec<_>>().join(": ");
            verdict.errors.push(Problem { code: diagnostic.code.as_str(), message });
        }
        verdict.class = compilation.unit.and_then(|unit| unit.classes().last().cloned());
        verdict
    }

    /// Calls the method of a class with values for its parameters, and returns its results.
    ///
    /// # Errors
    /// If the class can't be made with the values, or doesn't end.
    pub fn call(&self, class: &Arc<Class>, given: &Words) -> Result<Words, String> {
        // Members with an initial value keep it unless the case gives another.
        let arguments = class.parameters.iter().filter_map(|it| {
            let value = value_of(&it.name, &it.ty, given)?;
            (it.required || is_given(&it.name, given)).then_some((it.name.as_str(), value))
        });
        let instance = Instance::new(class, arguments.collect::<Vec<_>>()).map_err(|problems| {
            problems.iter().map(|it| it.message.clone()).collect::<Vec<_>>().join("; ")
        })?;
        let program = self.engine.program(&instance);
        let kernel = program.kernel(Method::Lookup, CallMode::Packet);
        let kernel = kernel.map_err(|problem| problem.message.clone())?;
        let mut scratch = program.new_scratch(1);
        let status = kernel.call(CallArguments {
            state: &mut new_state(1),
            scratch: &mut scratch,
            count: 1,
            mask: None,
            accepted: None,
            instances: Instances::One(&program.block(&instance)),
            host: &mut NoHost,
        });
        if status.budget_exhausted {
            return Err("a loop does not end".to_owned());
        }
        let mut results = Words::new();
        let mut component = 0;
        for variable in &class.scratch {
            let word = |at: u32| {
                let word = scratch.words(component + at as usize)[0];
                if variable.scalar == Scalar::Bool { u32::from(word != 0) } else { word }
            };
            results.insert(variable.name.clone(), (0..variable.len).map(word).collect());
            component += variable.len as usize;
        }
        Ok(results)
    }
}

/// True if a case gives the variable, a field or an element of it.
fn is_given(name: &str, given: &Words) -> bool {
    given.keys().any(|it| {
        it.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    })
}

/// The value of a parameter; what a case doesn't give is 0. `None` if the type has none.
fn value_of(path: &str, ty: &ParameterType, given: &Words) -> Option<Value> {
    let numbers = |scalar: Scalar, count: usize| {
        let mut words = given.get(path).cloned().unwrap_or_default();
        words.resize(count, 0);
        Value::from(Numbers::from_words(scalar, words))
    };
    Some(match ty {
        ParameterType::Scalar(scalar) => numbers(*scalar, 1),
        ParameterType::Vector(scalar, count) => numbers(*scalar, usize::from(*count)),
        ParameterType::Matrix(columns, rows) => {
            numbers(Scalar::F32, usize::from(*columns) * usize::from(*rows))
        }
        ParameterType::Struct(_, fields) => {
            let field = |(name, ty): &(String, ParameterType)| {
                Some((name.clone(), value_of(&format!("{path}.{name}"), ty, given)?))
            };
            Value::Struct(fields.iter().map(field).collect::<Option<_>>()?)
        }
        ParameterType::Array(element, count) => {
            let count = *count as usize;
            // Stages pass arrays on as a whole; cases give single elements, the first without its index.
            let whole = given.get(path);
            let passed =
                whole.filter(|it| count > 0 && it.len() >= count && it.len() == scalars(ty));
            let value = |index: usize| {
                let path = format!("{path}[{index}]");
                let size = passed.map_or(0, |it| it.len() / count);
                let part = match (passed, whole) {
                    (Some(words), _) => Some(words[index * size..][..size].to_vec()),
                    (None, Some(words)) if index == 0 => Some(words.clone()),
                    _ => None,
                };
                match part {
                    Some(words) => value_of(&path, element, &[(path.clone(), words)].into()),
                    None => value_of(&path, element, given),
                }
            };
            Value::List((0..count).map(value).collect::<Option<_>>()?)
        }
        _ => return None,
    })
}

/// The number of scalars of a type.
fn scalars(ty: &ParameterType) -> usize {
    match ty {
        ParameterType::Scalar(_) => 1,
        ParameterType::Vector(_, count) => usize::from(*count),
        ParameterType::Matrix(columns, rows) => usize::from(*columns) * usize::from(*rows),
        ParameterType::Struct(_, fields) => fields.iter().map(|(_, ty)| scalars(ty)).sum(),
        ParameterType::Array(element, count) => scalars(element) * *count as usize,
        _ => 0,
    }
}
