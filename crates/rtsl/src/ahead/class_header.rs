//! The C header of a library.

use std::collections::BTreeSet;
use std::fmt::Write;

use rtsl_ir::Scalar;
use rtsl_packet::abi::BUFFER_WORDS;
use rtsl_packet::description::{ClassDescription, Field, FieldKind, LibraryDescription};

use super::kernel_header;

/// The header: the kernel interface, then for each class its block as a struct, and its symbols.
pub(super) fn header(library: &LibraryDescription) -> String {
    let guard = format!("{}_LIBRARY_H", library.prefix.to_uppercase());
    let mut text = format!(
        "/* Classes of RTSL compiled ahead of time, by rtsl {}. */\n#ifndef {guard}\n#define {guard}\n\n{}\n\
         #ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n\
         /* All classes, for hosts that find them by name. */\nextern const RtslLibrary {};\n",
        env!("CARGO_PKG_VERSION"),
        kernel_header(),
        library.symbol()
    );
    for class in &library.classes {
        write_class(&mut text, library, class);
    }
    let _ = write!(text, "\n#ifdef __cplusplus\n}}\n#endif\n\n#endif /* {guard} */\n");
    text
}

fn write_class(text: &mut String, library: &LibraryDescription, class: &ClassDescription) {
    let symbol = library.class_symbol(class);
    let documentation = class.documentation.as_deref().unwrap_or_default();
    let _ = writeln!(text, "\n/* {}. {} */", class.name, comment(documentation));
    let _ = writeln!(text, "extern const RtslClass {symbol};");
    write_block(text, &symbol, class);
    if let Some(constructor) = &class.constructor {
        let _ = writeln!(text, "uint32_t {constructor}(void *block);");
    }
    for kernel in &class.kernels {
        let _ = writeln!(text, "void {}(RtslCall *call);", kernel.symbol);
    }
}

/// The block as a struct.
fn write_block(text: &mut String, symbol: &str, class: &ClassDescription) {
    if class.fields.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "/* The block of an instance of {}; its first {} words are what kernels read. */\ntypedef struct {symbol}_block {{",
        class.name, class.block_words
    );
    let mut names = BTreeSet::new();
    let mut end = 0;
    for field in &class.fields {
        write_padding(text, end, field.offset);
        let name = unique(field_name(field), &mut names);
        let _ = write!(text, "    {};", declaration(field, &name));
        write_field_comment(text, class, field);
        end = field.offset + words(field);
    }
    write_padding(text, end, class.construct_words);
    let _ = writeln!(text, "}} {symbol}_block;");
}

fn write_padding(text: &mut String, from: u32, to: u32) {
    if to > from {
        let _ = writeln!(text, "    uint32_t padding_{from}[{}];", to - from);
    }
}

fn write_field_comment(text: &mut String, class: &ClassDescription, field: &Field) {
    let parameter = class.parameters.iter().find(|parameter| parameter.offset == field.offset);
    match parameter {
        None => text.push_str(" /* computed */\n"),
        Some(parameter) => {
            let documentation = parameter.documentation.as_deref().or(parameter.label.as_deref());
            let documentation = comment(documentation.unwrap_or_default());
            let separator = if documentation.is_empty() { "" } else { ": " };
            let _ = writeln!(
                text,
                " /* {}{separator}{documentation} */",
                comment(&parameter.type_name)
            );
        }
    }
}

fn words(field: &Field) -> u32 {
    if field.kind == FieldKind::Buffer { BUFFER_WORDS } else { field.len }
}

fn declaration(field: &Field, name: &str) -> String {
    if field.kind == FieldKind::Buffer {
        return format!("RtslBuffer {name}");
    }
    let scalar = match field.scalar {
        Scalar::F32 => "float",
        Scalar::I32 => "int32_t",
        Scalar::U32 | Scalar::Bool => "uint32_t",
    };
    match field.len {
        1 => format!("{scalar} {name}"),
        len => format!("{scalar} {name}[{len}]"),
    }
}

fn field_name(field: &Field) -> String {
    let name = field.name.replace(|it: char| !it.is_ascii_alphanumeric(), "_");
    if field.kind == FieldKind::Parameter {
        return format!("parameter_{name}");
    }
    // Words of C and C++ that RTSL leaves to its authors.
    const TAKEN: [&str; 60] = [
        "alignas",
        "alignof",
        "and",
        "and_eq",
        "auto",
        "bitand",
        "bitor",
        "catch",
        "char",
        "class",
        "compl",
        "concept",
        "consteval",
        "constexpr",
        "constinit",
        "const_cast",
        "co_await",
        "co_return",
        "co_yield",
        "decltype",
        "delete",
        "double",
        "dynamic_cast",
        "explicit",
        "export",
        "friend",
        "inline",
        "long",
        "mutable",
        "namespace",
        "new",
        "noexcept",
        "not",
        "not_eq",
        "nullptr",
        "operator",
        "or",
        "or_eq",
        "private",
        "protected",
        "public",
        "register",
        "reinterpret_cast",
        "requires",
        "short",
        "signed",
        "sizeof",
        "static",
        "static_assert",
        "static_cast",
        "template",
        "this",
        "thread_local",
        "throw",
        "try",
        "typeid",
        "typename",
        "unsigned",
        "virtual",
        "volatile",
    ];
    if TAKEN.contains(&name.as_str()) { format!("{name}_") } else { name }
}

fn unique(name: String, names: &mut BTreeSet<String>) -> String {
    let candidates = (2..).map(|number| format!("{name}_{number}"));
    let free = std::iter::once(name.clone()).chain(candidates).find(|it| !names.contains(it));
    let free = free.unwrap_or(name);
    names.insert(free.clone());
    free
}

/// Text in one line that stays within a comment.
fn comment(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let line: String = line.chars().filter(|it| !it.is_control()).collect();
    line.replace("*/", "* /").replace("/*", "/ *")
}
