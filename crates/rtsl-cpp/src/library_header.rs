//! The C header of a library.

use std::fmt::Write;

use rtsl_abi::description::{ClassDescription, Field, FieldKind, LibraryDescription};
use rtsl_abi::offsets::BUFFER_WORDS;
use rtsl_ir::Scalar;

use crate::comment::harmless;
use crate::identifier::Scope;
use crate::kernel_header;

/// Returns the C header of a library: the kernel interface, then for each class its block as a struct, and its symbols.
/// C99 and C++11.
pub fn library_header(library: &LibraryDescription) -> String {
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

/// Appends the block as a struct.
fn write_block(text: &mut String, symbol: &str, class: &ClassDescription) {
    if class.fields.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "/* The block of an instance of {}; its first {} words are what kernels read. */\ntypedef struct {symbol}_block {{",
        class.name, class.block_words
    );
    let mut scope = Scope::default();
    let mut end = 0;
    for field in &class.fields {
        write_padding(text, end, field.offset);
        let name = field_name(field, &mut scope);
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

/// Returns the name of a field as a C identifier.
fn field_name(field: &Field, scope: &mut Scope) -> String {
    match field.kind {
        FieldKind::Parameter => scope.name(&format!("parameter_{}", field.name)),
        FieldKind::Member | FieldKind::Buffer | FieldKind::Scratch => scope.name(&field.name),
    }
}

/// Returns text on one line that cannot end the comment.
fn comment(text: &str) -> String {
    harmless(&text.split_whitespace().collect::<Vec<_>>().join(" ")).replace("/*", "/ *")
}

#[cfg(test)]
mod tests {
    use rtsl_spec::Role;

    use super::*;

    fn field(name: &str, kind: FieldKind, offset: u32) -> Field {
        Field { name: name.to_owned(), kind, scalar: Scalar::F32, len: 1, offset }
    }

    #[test]
    fn names_and_comments_are_harmless() {
        let names = ["class", "unix", "NAN", "kd.scale", "kd_scale"];
        let fields = names.iter().zip(0..).map(|(name, at)| field(name, FieldKind::Member, at));
        let class = ClassDescription {
            name: "A".to_owned(),
            documentation: Some("One */ int x;\n/* two \\".to_owned()),
            roles: vec![Role::Texture],
            parameters: Vec::new(),
            element: None,
            fields: fields.chain([field("class", FieldKind::Parameter, 6)]).collect(),
            block_words: 6,
            construct_words: 8,
            initial: vec![0; 8],
            scratch: Vec::new(),
            scratch_arrays: 0,
            constructor: Some("x_A_construct".to_owned()),
            method_documentation: Default::default(),
            kernels: Vec::new(),
        };
        let library = LibraryDescription { prefix: "x".to_owned(), classes: vec![class] };
        let header = library_header(&library);
        let own = &header[header.find("/* All classes").expect("what is the library's own")..];
        expect_test::expect![[r#"
            /* All classes, for hosts that find them by name. */
            extern const RtslLibrary x_library;

            /* A. One * / int x; / * two \ . */
            extern const RtslClass x_A;
            /* The block of an instance of A; its first 6 words are what kernels read. */
            typedef struct x_A_block {
                float class_; /* computed */
                float unix_; /* computed */
                float NAN_; /* computed */
                float kd_scale; /* computed */
                float kd_scale2; /* computed */
                uint32_t padding_5[1];
                float parameter_class; /* computed */
                uint32_t padding_7[1];
            } x_A_block;
            uint32_t x_A_construct(void *block);

            #ifdef __cplusplus
            }
            #endif

            #endif /* X_LIBRARY_H */
        "#]]
        .assert_eq(own);
    }
}
