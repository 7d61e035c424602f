//! Libraries of classes: kernels and constructors with given symbols, and a description of all as data.
//!
//! The data has the form of the structs of the C header, and the types here are named after those.

use std::fmt::Write;

use rtsl_abi::description::{
    ClassDescription, KernelDescription, LibraryDescription, ParameterDescription,
};
use rtsl_abi::offsets;
use rtsl_spec::Role;

use crate::constructor::Constructor;
use crate::{Kernel, TargetFeatures, emit_module};

/// The parts of a library listed in its description.
#[derive(Debug)]
pub struct Library<'a> {
    /// The description.
    pub description: &'a LibraryDescription,
    /// The kernels with their symbols.
    pub kernels: &'a [(String, Kernel)],
    /// The constructors.
    pub constructors: &'a [Constructor],
    /// The processor that the code is for, as reported to hosts.
    pub target: &'a str,
    /// The version of the compiler, as reported to hosts.
    pub version: &'a str,
}

/// Returns the text of a module that holds a library.
pub fn emit_library(library: &Library<'_>, target: &TargetFeatures) -> String {
    let Library { description, kernels, constructors, target: processor, version } = library;
    let parts = constructors.iter().flat_map(Constructor::kernels);
    let own = kernels.iter().map(|(symbol, kernel)| (symbol.clone(), kernel));
    let mut module = emit_module(own.chain(parts), target);
    constructors.iter().for_each(|it| module.add_function(&it.function()));
    let mut data = Data::default();
    data.text.push_str(TYPES);
    for class in &description.classes {
        data.class(&description.class_symbol(class), class);
    }
    let classes = description.classes.iter();
    let classes = classes.map(|class| format!("ptr @\"{}\"", description.class_symbol(class)));
    let classes = data.array("ptr", classes);
    let (version, processor) = (data.string(version), data.string(processor));
    let _ = writeln!(
        data.text,
        "@\"{}\" = constant %Library {{ i32 {}, i32 {}, ptr {classes}, ptr {version}, ptr {processor} }}",
        description.symbol(),
        offsets::VERSION,
        description.classes.len()
    );
    module.add_data(&data.text);
    module.finish()
}

const TYPES: &str = "\
%Parameter = type { ptr, ptr, ptr, ptr, i32, i32, i32, i32, float, float }
%Method = type { ptr, ptr, ptr, ptr, i32, i32, i32, i32, i32, i32 }
%Class = type { ptr, ptr, ptr, ptr, ptr, ptr, i32, i32, i32, i32, i32, i32, i32, i32, i32, i32 }
%Library = type { i32, i32, ptr, ptr, ptr }
";

/// Constants being written.
#[derive(Default)]
struct Data {
    text: String,
    count: u32,
}

impl Data {
    fn class(&mut self, symbol: &str, class: &ClassDescription) {
        let name = self.string(&class.name);
        let documentation = self.optional(class.documentation.as_deref());
        let parameters: Vec<String> =
            class.parameters.iter().map(|it| self.parameter(it)).collect();
        let parameters = self.array("%Parameter", parameters);
        let methods: Vec<String> = class.kernels.iter().map(|it| self.method(it)).collect();
        let methods = self.array("%Method", methods);
        let initial = self.words(&class.initial);
        let construct = class.constructor.as_ref();
        let construct = construct.map_or_else(|| "null".to_owned(), |it| format!("@\"{it}\""));
        let (element, buffer, stride) = class.element_numbers();
        let _ = writeln!(
            self.text,
            "@\"{symbol}\" = constant %Class {{ ptr {name}, ptr {documentation}, ptr {parameters}, ptr {methods}, \
             ptr {initial}, ptr {construct}, i32 {}, i32 {}, i32 {}, i32 {}, i32 {}, i32 {}, i32 {}, i32 {}, i32 {}, i32 0 }}",
            Role::bits(&class.roles),
            class.parameters.len(),
            class.kernels.len(),
            class.block_words,
            class.construct_words,
            class.scratch_arrays,
            element as i32,
            buffer as i32,
            stride,
        );
    }

    fn parameter(&mut self, parameter: &ParameterDescription) -> String {
        let strings = [
            self.string(&parameter.name),
            self.string(&parameter.type_name),
            self.optional(parameter.label.as_deref()),
            self.optional(parameter.documentation.as_deref()),
        ];
        let [name, type_name, label, documentation] = strings;
        format!(
            "%Parameter {{ ptr {name}, ptr {type_name}, ptr {label}, ptr {documentation}, i32 {}, i32 {}, i32 {}, i32 {}, \
             float {}, float {} }}",
            offsets::scalar_number(parameter.scalar),
            parameter.len,
            parameter.offset,
            parameter.flags(),
            float(parameter.minimum.unwrap_or(f32::NEG_INFINITY)),
            float(parameter.maximum.unwrap_or(f32::INFINITY)),
        )
    }

    fn method(&mut self, kernel: &KernelDescription) -> String {
        let name = self.string(kernel.method.name());
        let (reads, writes) = (self.words(&kernel.reads), self.words(&kernel.writes));
        format!(
            "%Method {{ ptr {name}, ptr @\"{}\", ptr {reads}, ptr {writes}, i32 {}, i32 {}, i32 {}, i32 {}, i32 {}, i32 0 }}",
            kernel.symbol,
            kernel.reads.len(),
            kernel.writes.len(),
            offsets::call_mode_number(kernel.mode),
            kernel.width,
            kernel.flags(),
        )
    }

    fn words(&mut self, words: &[u32]) -> String {
        self.array("i32", words.iter().map(|word| format!("i32 {}", *word as i32)))
    }

    fn optional(&mut self, text: Option<&str>) -> String {
        text.map_or_else(|| "null".to_owned(), |text| self.string(text))
    }

    /// Adds a zero-terminated string and returns its name; zero bytes in it are omitted.
    fn string(&mut self, text: &str) -> String {
        let bytes: Vec<u8> = text.bytes().filter(|byte| *byte != 0).chain([0]).collect();
        let name = self.new_name();
        let _ =
            write!(self.text, "{name} = private unnamed_addr constant [{} x i8] c\"", bytes.len());
        for byte in bytes {
            let _ = write!(self.text, "\\{byte:02X}");
        }
        self.text.push_str("\"\n");
        name
    }

    /// Adds an array of elements given with their types and returns its name; null if there are none.
    fn array(&mut self, ty: &str, elements: impl IntoIterator<Item = String>) -> String {
        let elements: Vec<String> = elements.into_iter().collect();
        if elements.is_empty() {
            return "null".to_owned();
        }
        let name = self.new_name();
        let (count, elements) = (elements.len(), elements.join(", "));
        let _ = writeln!(
            self.text,
            "{name} = private unnamed_addr constant [{count} x {ty}] [{elements}], align 8"
        );
        name
    }

    fn new_name(&mut self) -> String {
        self.count += 1;
        format!("@rtsl.data.{}", self.count)
    }
}

/// Returns a float in LLVM syntax: the bits of the double of the same value.
fn float(value: f32) -> String {
    format!("0x{:016X}", f64::from(value).to_bits())
}
