//! A call of any function of a text: a class that has it in a method, and its arguments in scratch members.

use std::collections::{BTreeMap, HashSet};

use rtsl::{
    ClassOutline, FunctionOutline, Method, Outline, ParameterOutline, Passing, Recording, Role,
    TraceEntry, TraceKind, Unit,
};
use serde_json::Value as JsonValue;

use super::request::{Answer, Request, Values};
use super::values::Lanes;
use crate::json::Json;
use crate::names::no_such;

/// The class around the call.
const CLASS: &str = "EvaluatedFunction";
/// Its scratch member for the result.
const RESULT: &str = "evaluatedResult";
/// The start of the names of those for arguments.
const ARGUMENT: &str = "evaluatedArgument";

/// A function with the arguments of a request.
pub struct FunctionCall {
    function: FunctionOutline,
    /// The roles and the class that the class around the call inherits, one of which is enough.
    bases: Vec<(String, Role)>,
    arguments: Values,
}

impl FunctionCall {
    /// Finds the function that a request names, by the names and the kinds of its arguments.
    ///
    /// # Errors
    /// If there is none, or several.
    pub fn find(request: &Request, outline: &Outline, unit: &Unit) -> Result<Self, String> {
        let outline = &with_instances(outline);
        let asked = Asked::parse(request.method.as_deref().unwrap_or_default());
        let classes: Vec<&ClassOutline> = match &request.class {
            Some(class) => outline.class(class).into_iter().collect(),
            None => outline.classes.iter().collect(),
        };
        let mut all: Vec<Candidate<'_>> = Vec::new();
        let mut known = HashSet::new();
        for class in &classes {
            // Without a choice, inherited functions are those of the classes that declare them.
            let generations = match classes.len() {
                1 => outline.generations(&class.name),
                _ => vec![*class],
            };
            let functions = generations.iter().flat_map(|of| &of.functions);
            let candidates = functions.map(|function| Candidate { class: Some(class), function });
            // A function is called in place of the same one of an earlier generation.
            all.extend(candidates.filter(|it| known.insert(it.identity())));
        }
        let of_file = outline.functions.iter();
        all.extend(of_file.map(|function| Candidate { class: None, function }));
        let named: Vec<Candidate<'_>> =
            all.iter().copied().filter(|it| asked.is_named(it.function)).collect();
        if named.is_empty() {
            let methods = Method::ALL.iter().map(|method| method.name());
            let names = methods.chain(all.iter().map(|it| it.function.name.as_str()));
            return Err(no_such("method or function", asked.name, names));
        }
        let chosen = choose(&asked, &named, &request.args)?;
        Ok(FunctionCall {
            function: chosen.function.clone(),
            bases: chosen.bases(unit),
            arguments: request.args.clone(),
        })
    }

    /// Returns texts that end with the call, each with the method that makes it. A function may call what only some
    /// methods may, and read what only some know.
    pub fn texts<'c>(&'c self, source: &'c str) -> impl Iterator<Item = (String, Method)> + 'c {
        let methods = self
            .bases
            .iter()
            .flat_map(|(base, role)| role.methods().map(move |method| (base.as_str(), method)));
        methods
            .map(move |(base, method)| (format!("{source}\n{}", self.class(base, method)), method))
    }

    /// The text of the class around the call.
    fn class(&self, base: &str, method: Method) -> String {
        let FunctionOutline { name, result, parameters } = &self.function;
        let mut members = String::new();
        let of_ray = member_of_ray(method);
        let mut declare = |qualifier: &str, ty: &str, name: &str| {
            // Sizes follow names as well as types.
            let (ty, sizes) = ty.split_at(ty.find('[').unwrap_or(ty.len()));
            members += &format!("{qualifier} {ty} {name}{sizes};\n");
        };
        let assigned = if result == "void" {
            String::new()
        } else {
            declare(of_ray, result, RESULT);
            format!("{RESULT} = ")
        };
        let mut places = Vec::new();
        let mut body = String::new();
        for (index, parameter) in parameters.iter().enumerate() {
            declare(of_ray, &parameter.ty, &place(index));
            if takes_members(method) && parameter.passing != Passing::Out {
                declare("public", &parameter.ty, &member(index));
                body += &format!("{} = {};\n", place(index), member(index));
            }
            places.push(place(index));
        }
        let (places, method) = (places.join(", "), method.name());
        format!(
            "class {CLASS} : {base} {{\n{members}void {method}() {{ {body}{assigned}{name}({places}); }}\n}};\n"
        )
    }

    /// Returns the request that calls the method with the arguments.
    ///
    /// # Errors
    /// If an argument differs between paths.
    pub fn request(&self, request: &Request, method: Method) -> Result<Request, String> {
        let mut scratch = request.scratch.clone();
        let mut params = request.params.clone();
        for (index, parameter) in self.function.parameters.iter().enumerate() {
            let name = shown_name(parameter, index);
            let Some(value) = self.arguments.get(&name) else { continue };
            if !takes_members(method) {
                scratch.insert(place(index), value.clone());
            } else if Lanes::parse(value).count().is_some() {
                return Err(format!("`{name}` has one value for all paths of an integrator"));
            } else {
                params.insert(member(index), value.clone());
            }
        }
        Ok(Request {
            class: Some(CLASS.to_owned()),
            method: Some(method.name().to_owned()),
            scratch,
            args: Values::new(),
            params,
            only_changes: true,
            ..request.clone()
        })
    }

    /// Moves the result and the out parameters of an answer from the scratch members to places of their own.
    pub fn take_results(&self, answer: &mut Answer) {
        let Some(scratch) = &mut answer.scratch else { return };
        answer.result = scratch.remove(RESULT);
        let mut out = BTreeMap::new();
        for (index, parameter) in self.function.parameters.iter().enumerate() {
            let value: Option<Json> = scratch.remove(&place(index));
            if parameter.passing != Passing::In {
                out.extend(value.map(|value| (shown_name(parameter, index), value)));
            }
        }
        answer.out = Some(out);
    }

    /// Names the function in entries of the method that calls it, and drops what that method does besides. `length` is
    /// that of the text before the method.
    pub fn name_entries(&self, recording: &mut Recording, length: usize) {
        let is_of_caller = |entry: &TraceEntry| {
            entry.method.split_once('.').is_some_and(|(class, _)| class == CLASS)
        };
        let has_steps =
            recording.entries.iter().any(|entry| matches!(entry.kind, TraceKind::Enter(..)));
        recording.entries.retain(|entry| {
            let is_after_text =
                entry.place.as_ref().is_some_and(|place| place.start as usize >= length);
            let is_around = entry.place.is_none()
                && has_steps
                && matches!(
                    entry.kind,
                    TraceKind::Call(None, _) | TraceKind::Return(_) | TraceKind::Known(_)
                );
            let is_part = matches!(entry.kind, TraceKind::Enter(..) | TraceKind::Leave(_));
            !is_of_caller(entry) || is_part || !(is_after_text || is_around)
        });
        for entry in recording.entries.iter_mut().filter(|entry| is_of_caller(entry)) {
            entry.method = self.function.name.as_str().into();
        }
    }

    /// True for the scratch members of calls.
    pub fn has(name: &str) -> bool {
        name == RESULT || name.starts_with(ARGUMENT)
    }

    /// The function, for messages.
    pub fn signature(&self) -> String {
        self.function.to_string()
    }
}

/// True for methods that start with scratch members of 0, because a path starts with the call.
fn takes_members(method: Method) -> bool {
    method == Method::Radiance
}

/// The qualifier of members that keep what a method writes.
fn member_of_ray(method: Method) -> &'static str {
    if method.leaves_scratch() { "scratch" } else { "output" }
}

/// The member of the instance of a parameter.
fn member(index: usize) -> String {
    format!("evaluatedMember{index}")
}

/// The outline with an overload of generic functions for each size of their types.
fn with_instances(outline: &Outline) -> Outline {
    let all = |functions: &[FunctionOutline]| functions.iter().flat_map(instances).collect();
    let mut outline = outline.clone();
    outline.functions = all(&outline.functions);
    let classes = outline.classes.iter_mut().chain(&mut outline.inherited);
    classes.for_each(|class| class.functions = all(&class.functions));
    outline
}

fn instances(function: &FunctionOutline) -> Vec<FunctionOutline> {
    let types = function.parameters.iter().map(|parameter| parameter.ty.as_str());
    if !types.clone().any(|ty| sized(ty, 0).is_some()) {
        return vec![function.clone()];
    }
    let of_size = |ty: &String, size: usize| sized(ty, size).map_or(ty.clone(), str::to_owned);
    let instance = |size: usize| {
        let mut instance = function.clone();
        instance.result = of_size(&instance.result, size);
        for parameter in &mut instance.parameters {
            parameter.ty = of_size(&parameter.ty, size);
        }
        instance
    };
    (0..4).map(instance).collect()
}

/// A generic type with so many components, one less than counted.
fn sized(generic: &str, size: usize) -> Option<&'static str> {
    let types = match generic {
        "genType" | "genFType" => ["float", "vec2", "vec3", "vec4"],
        "genIType" => ["int", "ivec2", "ivec3", "ivec4"],
        "genUType" => ["uint", "uvec2", "uvec3", "uvec4"],
        "genBType" => ["bool", "bvec2", "bvec3", "bvec4"],
        _ => return None,
    };
    types.get(size).copied()
}

/// The scratch member of a parameter.
fn place(index: usize) -> String {
    format!("{ARGUMENT}{index}")
}

/// The name of a parameter, or its number from 1.
fn shown_name(parameter: &ParameterOutline, index: usize) -> String {
    if parameter.name.is_empty() { (index + 1).to_string() } else { parameter.name.clone() }
}

/// A name as asked for: `f`, or `f(float, vec3)`.
struct Asked<'a> {
    name: &'a str,
    types: Option<Vec<String>>,
}

impl<'a> Asked<'a> {
    fn parse(text: &'a str) -> Self {
        let Some((name, types)) = text.split_once('(') else {
            return Asked { name: text.trim(), types: None };
        };
        let types = types.trim_end().trim_end_matches(')');
        let types = types.split(',').map(without_space).filter(|ty| !ty.is_empty());
        Asked { name: name.trim(), types: Some(types.collect()) }
    }

    fn is_named(&self, function: &FunctionOutline) -> bool {
        function.name == self.name
    }

    fn has_types(&self, function: &FunctionOutline) -> bool {
        let own = function.parameters.iter().map(|parameter| without_space(&parameter.ty));
        self.types.as_ref().is_none_or(|types| own.eq(types.iter().cloned()))
    }
}

fn without_space(text: &str) -> String {
    text.split_whitespace().collect()
}

/// A function, and the class in whose instances it is called.
#[derive(Clone, Copy)]
struct Candidate<'a> {
    class: Option<&'a ClassOutline>,
    function: &'a FunctionOutline,
}

impl<'a> Candidate<'a> {
    /// The names of the class and of the function, and the types of the parameters.
    fn identity(&self) -> (Option<&'a str>, &'a str, Vec<String>) {
        let parameters = self.function.parameters.iter();
        let types = parameters.map(|parameter| without_space(&parameter.ty)).collect();
        (self.class.map(|class| class.name.as_str()), &self.function.name, types)
    }

    /// The bases that the class around the call can have.
    fn bases(&self, unit: &Unit) -> Vec<(String, Role)> {
        let of_class = self.class.and_then(|class| unit.class(&class.name).ok());
        match of_class {
            Some(class) => class.roles.iter().map(|role| (class.name.clone(), *role)).collect(),
            None => Role::ALL.into_iter().map(|role| (role.class().to_owned(), role)).collect(),
        }
    }

    fn shown(&self) -> String {
        match self.class {
            Some(class) => format!("`{}` of class `{}`", self.function, class.name),
            None => format!("`{}`", self.function),
        }
    }

    /// The reason for which it does not take the arguments of these names.
    fn misfit(&self, arguments: &Values) -> Option<String> {
        let names: Vec<(String, Passing)> = self
            .function
            .parameters
            .iter()
            .enumerate()
            .map(|(index, parameter)| (shown_name(parameter, index), parameter.passing))
            .collect();
        let is_given = |name: &str| arguments.contains_key(name);
        let missing = names.iter().find(|(name, how)| *how != Passing::Out && !is_given(name));
        if let Some((name, _)) = missing {
            return Some(format!("give `--arg {name}=VALUE`"));
        }
        let takes =
            |name: &&String| names.iter().any(|(own, how)| own == *name && *how != Passing::Out);
        let unknown = arguments.keys().find(|name| !takes(name))?;
        if names.iter().any(|(own, _)| own == unknown) {
            return Some(format!("`{unknown}` is an out parameter, which takes no value"));
        }
        Some(no_such("parameter", unknown, names.iter().map(|(name, _)| name.as_str())))
    }

    /// The fit of the arguments: 0 if they have the types of the parameters, 1 if some are converted; `None` if not.
    fn fit(&self, arguments: &Values) -> Option<u32> {
        let mut worst = 0;
        for (index, parameter) in self.function.parameters.iter().enumerate() {
            if let Some(value) = arguments.get(&shown_name(parameter, index)) {
                worst = worst.max(fit(&parameter.ty, Lanes::parse(value).get(0).unwrap_or(value))?);
            }
        }
        Some(worst)
    }
}

/// Chooses a function by its arguments.
fn choose<'a>(
    asked: &Asked<'_>,
    named: &[Candidate<'a>],
    arguments: &Values,
) -> Result<Candidate<'a>, String> {
    let name = asked.name;
    let typed: Vec<Candidate<'a>> =
        named.iter().copied().filter(|it| asked.has_types(it.function)).collect();
    if typed.is_empty() {
        let message = format!("no `{name}` has parameters of these types");
        return Err(with_candidates(&message, named));
    }
    let taking: Vec<Candidate<'a>> =
        typed.iter().copied().filter(|it| it.misfit(arguments).is_none()).collect();
    match (taking.as_slice(), typed.as_slice()) {
        ([], [only]) => {
            let reason = only.misfit(arguments).unwrap_or_default();
            Err(format!("{} is not called with these arguments: {reason}", only.shown()))
        }
        ([], _) => {
            let message = format!("no `{name}` has parameters of these names");
            Err(with_candidates(&message, &typed))
        }
        // Values that do not fit are reported with their types.
        ([only], _) => Ok(*only),
        _ => {
            let fits = taking.iter().filter_map(|it| it.fit(arguments));
            let Some(best) = fits.min() else {
                let message = format!("no `{name}` takes values like these");
                return Err(with_candidates(&message, &taking));
            };
            let best: Vec<Candidate<'a>> =
                taking.into_iter().filter(|it| it.fit(arguments) == Some(best)).collect();
            match best.as_slice() {
                [only] => Ok(*only),
                _ => Err(ambiguous(name, &best)),
            }
        }
    }
}

fn with_candidates(message: &str, candidates: &[Candidate<'_>]) -> String {
    let shown: Vec<String> = candidates.iter().map(Candidate::shown).collect();
    format!("{message}; there are {}", shown.join(", "))
}

fn ambiguous(name: &str, best: &[Candidate<'_>]) -> String {
    let message =
        with_candidates(&format!("several functions `{name}` take these arguments"), best);
    let classes: Vec<&str> =
        best.iter().filter_map(|it| it.class).map(|class| class.name.as_str()).collect();
    if classes.len() == best.len() && classes.windows(2).any(|pair| pair[0] != pair[1]) {
        return format!("{message}; choose a class with `--class`");
    }
    let types = best[0].function.parameters.iter().map(|parameter| parameter.ty.as_str());
    let types: Vec<&str> = types.collect();
    format!("{message}; name its types, as in `'{name}({})'`", types.join(", "))
}

/// The fit of a value to a type as written: 0 if it is of the type, 1 if it is converted to it.
fn fit(ty: &str, value: &JsonValue) -> Option<u32> {
    let ty = without_space(ty);
    if let Some(element) = element_of_array(&ty) {
        let values = value.as_array()?;
        return values
            .iter()
            .map(|value| fit(&element, value))
            .try_fold(0, |worst, it| Some(worst.max(it?)));
    }
    match value {
        JsonValue::Bool(_) => (ty == "bool").then_some(0),
        JsonValue::Number(number) => match ty.as_str() {
            "int" if number.is_i64() => Some(0),
            "uint" if number.is_u64() => Some(1),
            "float" => Some(u32::from(!number.is_f64())),
            // The choices of enumerations are numbers.
            _ => (!is_plain(&ty)).then_some(1),
        },
        // `NaN` and infinities.
        JsonValue::String(_) => (ty == "float").then_some(0),
        JsonValue::Array(values) => fit_list(&ty, values),
        JsonValue::Object(_) => (!is_plain(&ty)).then_some(0),
        JsonValue::Null => None,
    }
}

/// The type of the elements of an array type.
fn element_of_array(ty: &str) -> Option<String> {
    let open = ty.find('[')?;
    let close = open + ty[open..].find(']')?;
    Some(format!("{}{}", &ty[..open], &ty[close + 1..]))
}

fn fit_list(ty: &str, values: &[JsonValue]) -> Option<u32> {
    let (scalar, size) = if ty == "color" {
        ("float", 3)
    } else if let Some(size) = ty.strip_prefix("mat") {
        let columns: usize = size.get(..1)?.parse().ok()?;
        return (values.len() == columns && values.iter().all(JsonValue::is_array)).then_some(0);
    } else {
        let (prefix, size) = ty.split_once("vec")?;
        let scalar = match prefix {
            "" => "float",
            "i" => "int",
            "u" => "uint",
            "b" => "bool",
            _ => return None,
        };
        (scalar, size.parse().ok()?)
    };
    if values.len() != size {
        return None;
    }
    values.iter().map(|value| fit(scalar, value)).try_fold(0, |worst, it| Some(worst.max(it?)))
}

/// True for types that are no structs.
fn is_plain(ty: &str) -> bool {
    let starts = ["vec", "ivec", "uvec", "bvec", "mat"];
    ["float", "int", "uint", "bool", "color"].contains(&ty)
        || starts.iter().any(|start| ty.strip_prefix(start).is_some_and(|rest| rest.len() < 4))
}
