//! The description of a library's classes as JSON.

use rtsl::description::{
    ClassDescription, Field, FieldKind, KernelDescription, LibraryDescription, ParameterDescription,
};
use rtsl::{scalar_name, state_variables};

use crate::json::Json;

/// The description as text.
pub fn layout_json(library: &LibraryDescription) -> String {
    let classes = library.classes.iter().map(|it| class(library, it)).collect();
    let json = object([
        ("abi", number(rtsl::KERNEL_ABI)),
        ("symbol", text(&library.symbol())),
        ("classes", Json::List(classes)),
    ]);
    // Cannot fail: the content is numbers and strings.
    serde_json::to_string_pretty(&json).unwrap_or_default() + "\n"
}

fn class(library: &LibraryDescription, class: &ClassDescription) -> Json {
    let mut fields = vec![
        ("name", text(&class.name)),
        ("symbol", text(&library.class_symbol(class))),
        ("roles", Json::List(class.roles.iter().map(|role| text(role.name())).collect())),
    ];
    if let Some(documentation) = &class.documentation {
        fields.push(("documentation", text(documentation)));
    }
    fields.extend([
        ("blockWords", number(class.block_words)),
        ("constructWords", number(class.construct_words)),
        ("scratchArrays", number(class.scratch_arrays)),
        ("initial", Json::List(class.initial.iter().map(|word| number(*word)).collect())),
        ("parameters", Json::List(class.parameters.iter().map(parameter).collect())),
        ("fields", Json::List(class.fields.iter().map(field).collect())),
        ("scratch", Json::List(class.scratch.iter().map(field).collect())),
    ]);
    if let Some(constructor) = &class.constructor {
        fields.push(("constructor", text(constructor)));
    }
    if let Some(element) = class.element {
        let element = object([
            ("parameter", number(element.parameter)),
            ("buffer", number(element.buffer)),
            ("stride", number(element.stride)),
        ]);
        fields.push(("element", element));
    }
    fields.push(("kernels", Json::List(class.kernels.iter().map(kernel).collect())));
    object(fields)
}

fn parameter(parameter: &ParameterDescription) -> Json {
    let mut fields = vec![
        ("name", text(&parameter.name)),
        ("type", text(&parameter.type_name)),
        ("scalar", text(scalar_name(parameter.scalar))),
        ("count", number(parameter.len)),
        ("offset", number(parameter.offset)),
        ("required", Json::Bool(parameter.is_required)),
        ("buffer", Json::Bool(parameter.is_buffer)),
        ("color", Json::Bool(parameter.is_color)),
    ];
    let bounds = [("minimum", parameter.minimum), ("maximum", parameter.maximum)];
    fields.extend(bounds.into_iter().filter_map(|(key, bound)| Some((key, Json::Float(bound?)))));
    let texts = [("label", &parameter.label), ("documentation", &parameter.documentation)];
    fields.extend(texts.into_iter().filter_map(|(key, it)| Some((key, text(it.as_ref()?)))));
    if !parameter.choices.is_empty() {
        let choices = parameter.choices.iter();
        let choices = choices.map(|(name, value)| (name.clone(), Json::Integer((*value).into())));
        fields.push(("choices", Json::Object(choices.collect())));
    }
    object(fields)
}

fn field(field: &Field) -> Json {
    let kind = match field.kind {
        FieldKind::Member => "member",
        FieldKind::Buffer => "buffer",
        FieldKind::Parameter => "parameter",
        FieldKind::Scratch => "scratch",
    };
    object([
        ("name", text(&field.name)),
        ("kind", text(kind)),
        ("scalar", text(scalar_name(field.scalar))),
        ("count", number(field.len)),
        ("offset", number(field.offset)),
    ])
}

fn kernel(kernel: &KernelDescription) -> Json {
    object([
        ("method", text(kernel.method.name())),
        ("shape", text(kernel.mode.name())),
        ("width", number(kernel.width)),
        ("symbol", text(&kernel.symbol)),
        ("reads", components(&kernel.reads)),
        ("writes", components(&kernel.writes)),
        ("readsScratch", Json::Bool(kernel.reads_scratch)),
        ("writesScratch", Json::Bool(kernel.writes_scratch)),
        ("leavesZeros", Json::Bool(kernel.leaves_zeros)),
    ])
}

/// State variables by name, with their first components.
fn components(components: &[u32]) -> Json {
    let variables = state_variables().iter();
    let variables = variables.filter(|it| components.contains(&it.first_component));
    let variables = variables.map(|variable| {
        object([
            ("name", text(variable.name)),
            ("type", text(variable.ty.name())),
            ("first", number(variable.first_component)),
        ])
    });
    Json::List(variables.collect())
}

fn object<'a>(fields: impl IntoIterator<Item = (&'a str, Json)>) -> Json {
    Json::Object(fields.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
}

fn number(value: u32) -> Json {
    Json::Integer(i64::from(value))
}

fn text(value: &str) -> Json {
    Json::Text(value.to_owned())
}
