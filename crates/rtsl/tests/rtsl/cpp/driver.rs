//! The C++ around the classes: it reads calls, and writes what they leave.

use std::collections::BTreeMap;
use std::fmt::Write;

use rtsl_abi::description::Field;
use rtsl_ir::Scalar;

use crate::cpp::subjects::Subject;

/// The program's text.
pub struct Driver {
    text: String,
    /// By the names of their files.
    headers: BTreeMap<String, String>,
}

impl Driver {
    pub fn new(subjects: &[&Subject]) -> Driver {
        let mut headers = BTreeMap::new();
        let mut text = String::new();
        for subject in subjects {
            let name = format!("{}.h", subject.namespace);
            if headers.insert(name.clone(), subject.header.to_string()).is_some() {
                continue;
            }
            text.push_str("#undef RTSL_EXPORT\n");
            if let Some(header) = &subject.c_header {
                let library = format!("{}_library.h", subject.namespace);
                let _ = writeln!(text, "#ifdef KERNELS\n#define RTSL_EXPORT \"{library}\"\n#endif");
                headers.insert(library, header.to_string());
            }
            let _ = writeln!(text, "#include \"{name}\"");
        }
        text.push_str(START);
        for (number, subject) in subjects.iter().enumerate() {
            write_call(number, subject, &mut text);
        }
        let calls = (0..subjects.len()).map(|number| format!("call{number}"));
        let calls: Vec<String> = calls.collect();
        let _ = writeln!(text, "static void (*const calls[])() = {{{}}};", calls.join(", "));
        text.push_str(END);
        Driver { text, headers }
    }

    pub fn text(&self) -> &str {
        &self.text
    }

    pub fn headers(&self) -> &BTreeMap<String, String> {
        &self.headers
    }
}

fn write_call(number: usize, subject: &Subject, text: &mut String) {
    let (namespace, class) = (&subject.namespace, &subject.class);
    let (name, words) = (&class.name, class.construct_words);
    let _ = writeln!(
        text,
        "// {}\nstatic void call{number}() {{\n    using namespace {namespace};",
        subject.name
    );
    let _ = writeln!(text, "    {name} object;\n    std::vector<uint32_t> block = read({words});");
    let _ = writeln!(text, "    set(object, block);");
    for buffer in subject.buffers() {
        let (offset, len) = (buffer.offset, buffer.len);
        let _ = writeln!(
            text,
            "    const std::vector<uint32_t> words{offset} = read_buffer(object, {offset}, {len});"
        );
    }
    let Some(method) = subject.method else {
        // With the addresses of buffers, for the kernel.
        let words = class.block_words;
        let _ =
            writeln!(text, "    memcpy(block.data(), static_cast<void *>(&object), {words} * 4);");
        let takes = subject.parameters().any(|field| field.len > 0);
        if takes {
            let _ = writeln!(text, "    typename {name}::Parameters parameters;");
            for field in subject.parameters() {
                copy_field("parameters", field, &format!("block.data() + {}", field.offset), text);
            }
        }
        let arguments = if takes { "parameters" } else { "" };
        let _ = writeln!(
            text,
            "    const bool has_finished = finished([&] {{ return object.construct({arguments}); }});"
        );
        let _ = writeln!(text, "    write_block(object, {words});\n    write(has_finished);");
        let symbol = class.constructor.as_ref().expect("it has a constructor");
        let _ = writeln!(
            text,
            "#ifdef KERNELS\n    check_constructor({symbol}, object, {words}, block);\n#endif\n}}"
        );
        return;
    };
    let components: u32 = subject.state.iter().map(|variable| variable.ty.components()).sum();
    let _ = writeln!(
        text,
        "    State state;\n    const std::vector<uint32_t> before = read({components});\n    set_words(&state, before);"
    );
    let mut arguments = vec!["state"];
    if !class.scratch.is_empty() {
        let _ = writeln!(text, "    typename {name}::Scratch scratch;");
        let _ = writeln!(
            text,
            "    const std::vector<uint32_t> kept = read({});",
            class.scratch_arrays
        );
        for field in &class.scratch {
            copy_field("scratch", field, &format!("kept.data() + {}", field.offset), text);
        }
        arguments.push("scratch");
    }
    if subject.asks_host() {
        let _ = writeln!(text, "    HashHost<Host, LightSample> host;");
        arguments.push("host");
    }
    let accepted = if subject.accepts() { "const bool accepted = " } else { "" };
    let (method, arguments) = (method.name(), arguments.join(", "));
    let _ = writeln!(text, "    {accepted}object.{method}({arguments});");
    let _ = writeln!(text, "    write_words(&state, {components});");
    text.push_str("    const size_t first = output.size();\n");
    for field in &class.scratch {
        for index in 0..field.len {
            let _ = writeln!(text, "    write(scratch.{});", element(field, index));
        }
    }
    let accepted = if subject.accepts() { "accepted" } else { "false" };
    let _ = writeln!(text, "    write({accepted});\n    write(exceeded(state, 0));");
    if subject.c_header.is_some() {
        text.push_str("#ifdef KERNELS\n");
        write_kernel_check(subject, text);
        text.push_str("#endif\n");
    }
    text.push_str("    (void)first;\n}\n");
}

/// The same call by the class's kernel.
fn write_kernel_check(subject: &Subject, text: &mut String) {
    let (namespace, class) = (&subject.namespace, &subject.class);
    let components = subject.state.iter().flat_map(|variable| {
        variable.first_component..variable.first_component + variable.ty.components()
    });
    let components: Vec<String> = components.map(|component| component.to_string()).collect();
    let kind = |field: &Field| if field.scalar == Scalar::Bool { "b" } else { "w" };
    let kinds: String =
        class.scratch.iter().map(|field| kind(field).repeat(field.len as usize)).collect();
    let kept = if class.scratch.is_empty() { "std::vector<uint32_t>()" } else { "kept" };
    let accepted = if subject.accepts() { "accepted" } else { "false" };
    let _ = writeln!(
        text,
        "    static const uint32_t components[] = {{{}}};\n    \
         check_kernel({namespace}_library, \"{}\", \"{}\", &object, {{components, before, &state}}, \
         {{\"{kinds}\", {kept}, first}}, {accepted});",
        components.join(", "),
        class.name,
        subject.method.expect("it is a method").name(),
    );
}

fn copy_field(to: &str, field: &Field, from: &str, text: &mut String) {
    for index in 0..field.len {
        let from = format!(
            "{}(({from})[{index}])",
            if field.scalar == Scalar::F32 { "as_float" } else { "" }
        );
        let _ = writeln!(text, "    {to}.{} = {from};", element(field, index));
    }
}

fn element(field: &Field, index: u32) -> String {
    // The names in the library are identifiers but for paths.
    let name: String = field.name.replace(['.', '['], "_").replace(']', "");
    if field.len == 1 { name } else { format!("{name}[{index}]") }
}

/// Declarations that calls need.
const START: &str = include_str!("calls.h");
const END: &str = include_str!("main.h");
