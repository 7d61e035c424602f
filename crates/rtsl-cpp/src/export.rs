//! Kernels and tables of a library as text, equivalent to those in object files, for hosts that find classes by name.

use rtsl_abi::CallMode;
use rtsl_abi::description::{
    ClassDescription, Field, FieldKind, KernelDescription, LibraryDescription, ParameterDescription,
};
use rtsl_ir::{Constant, Scalar};
use rtsl_spec::{COLOR_COMPONENTS, Role, state_variables};

use crate::class_names::ClassNames;
use crate::identifier::identifier;
use crate::literal::literal;
use crate::method::{Needs, indexed};

/// The kernels of a class in the single mode, with the requirements of their methods.
pub(crate) struct Exported<'a> {
    pub name: String,
    pub description: &'a ClassDescription,
    pub names: ClassNames,
    /// The methods, with flags for accepted hits and a budget that can run out.
    pub methods: Vec<ExportedMethod>,
    /// True if it has a constructor that reports an exhausted budget.
    pub constructor_may_fail: bool,
}

pub(crate) struct ExportedMethod {
    pub method: rtsl_spec::Method,
    pub needs: Needs,
    pub accepts: bool,
}

/// Appends the code under `#ifdef RTSL_EXPORT`.
pub(crate) fn write_export(
    library: &LibraryDescription,
    classes: &[Exported<'_>],
    has_budget: bool,
    text: &mut String,
) {
    let namespace = identifier(&library.prefix);
    let asks_host = classes.iter().flat_map(|class| &class.methods).any(|method| method.needs.host);
    text.push_str(START);
    if asks_host {
        let host = HOST.replace("COLORS", &COLOR_COMPONENTS.to_string());
        text.push_str(&format!("\nnamespace {namespace} {{\n{host}}} // namespace {namespace}\n"));
    }
    for class in classes {
        let mut writer =
            ExportWriter { library, class, namespace: &namespace, has_budget, text: &mut *text };
        writer.class();
    }
    let names: Vec<String> =
        library.classes.iter().map(|class| format!("&{}", library.class_symbol(class))).collect();
    let symbol = library.symbol();
    text.push_str(&format!(
        "\nstatic const RtslClass *const {symbol}_classes[] = {{{}}};\n\
         extern \"C\" const RtslLibrary {symbol} = {{RTSL_ABI, {}, {symbol}_classes, {}, \"C++\"}};\n\n#endif\n",
        if names.is_empty() { "nullptr".to_owned() } else { names.join(", ") },
        names.len(),
        string(env!("CARGO_PKG_VERSION")),
    ));
}

const START: &str = r#"
// Kernels and tables of a library that serves hosts as an object file does. RTSL_EXPORT is its header, which
// `rtsl build --emit header` writes for the same classes: -DRTSL_EXPORT='"shaders.h"'.
#ifdef RTSL_EXPORT

#include RTSL_EXPORT
"#;

const HOST: &str = r#"
/// The host of a call, asked for one ray.
struct CallHost : Host {
    const RtslCall *call;

    explicit CallHost(const RtslCall *its_call) : call(its_call) {}

    static void set(RtslRayLanes &rays, const float (&origin)[3], const float (&direction)[3], float limit) {
        for (int axis = 0; axis < 3; axis++) {
            rays.origin[axis][0] = origin[axis];
            rays.direction[axis][0] = direction[axis];
        }
        rays.limit[0] = limit;
    }

    void trace(const float (&origin)[3], const float (&direction)[3], float limit, float weight,
               float (&radiance)[COLORS]) override {
        alignas(64) RtslRayLanes rays = {};
        alignas(64) float answer[COLORS][RTSL_LANES] = {};
        set(rays, origin, direction, limit);
        rays.weight[0] = weight;
        call->host->trace(call->user, 0, 1, &rays, answer);
        for (int i = 0; i < COLORS; i++) radiance[i] = answer[i][0];
    }

    bool occluded(const float (&origin)[3], const float (&direction)[3], float limit) override {
        alignas(64) RtslRayLanes rays = {};
        set(rays, origin, direction, limit);
        return call->host->occluded(call->user, 0, 1, &rays) & 1;
    }

    int32_t light_count() override { return int32_t(call->host->light_count(call->user)); }

    bool light_sample(int32_t index, const float (&point)[3], const float (&normal)[3], float cosine,
                      LightSample &light) override {
        alignas(64) RtslLightQueryLanes query = {};
        alignas(64) RtslLightLanes answer = {};
        for (int axis = 0; axis < 3; axis++) {
            query.point[axis][0] = point[axis];
            query.normal[axis][0] = normal[axis];
        }
        query.cosine[0] = cosine;
        const uint32_t reached =
            call->host->light_sample(call->user, 0, 1, uint32_t(index), &query, &answer);
        for (int axis = 0; axis < 3; axis++) light.direction[axis] = answer.direction[axis][0];
        light.distance = answer.distance[0];
        for (int i = 0; i < COLORS; i++) light.color[i] = answer.color[i][0];
        light.pdf = answer.pdf[0];
        return reached & 1;
    }

    void ambient(float (&color)[COLORS]) override { call->host->ambient(call->user, color); }

    float rand() override {
        alignas(64) float values[RTSL_LANES] = {};
        call->host->rand(call->user, 0, 1, values);
        return values[0];
    }
};
"#;

struct ExportWriter<'a> {
    library: &'a LibraryDescription,
    class: &'a Exported<'a>,
    namespace: &'a str,
    has_budget: bool,
    text: &'a mut String,
}

impl ExportWriter<'_> {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn class(&mut self) {
        let class = self.class;
        let kernels: Vec<&KernelDescription> =
            class.description.kernels.iter().filter(|it| it.mode == CallMode::Single).collect();
        for kernel in &kernels {
            let method = class.methods.iter().find(|it| it.method == kernel.method);
            if let Some(method) = method {
                self.kernel(kernel, method);
            }
        }
        self.constructor();
        self.tables(&kernels);
    }

    fn kernel(&mut self, kernel: &KernelDescription, method: &ExportedMethod) {
        let (namespace, class) = (self.namespace, self.class);
        let scratch = &class.description.scratch;
        self.line(&format!("\nextern \"C\" void {}(RtslCall *call) {{", kernel.symbol));
        self.line(&format!("    {namespace}::State state;"));
        // A method may set some components of a variable, and leave the others as they are.
        let set_alone = kernel.writes.iter().filter(|it| !kernel.reads.contains(it));
        for component in kernel.reads.iter().chain(set_alone) {
            let target = state_text(*component);
            self.line(&format!("    {target} = call->state[{component}][0];"));
        }
        let mut arguments = vec!["state"];
        if !scratch.is_empty() {
            self.line(&format!("    {namespace}::{}::Scratch scratch;", class.name));
            arguments.push("scratch");
            if kernel.reads_scratch || kernel.writes_scratch {
                scratch.iter().for_each(|field| self.load_scratch(field));
            }
        }
        if method.needs.host {
            self.line(&format!("    {namespace}::CallHost host(call);"));
            arguments.push("host");
        }
        let object = format!("static_cast<const {namespace}::{} *>(call->instance)", class.name);
        let result = if method.accepts { "const bool accepted = " } else { "" };
        let call = format!("{object}->{}({});", kernel.method.name(), arguments.join(", "));
        self.line(&format!("    {result}{call}"));
        if self.has_budget {
            self.line("    if (state.budget_exceeded) call->status |= RTSL_BUDGET_EXHAUSTED;");
        }
        if method.accepts {
            self.line("    call->accepted[0] = accepted ? -1 : 0;\n    if (!accepted) return;");
        }
        for component in &kernel.writes {
            let source = state_text(*component);
            self.line(&format!("    call->state[{component}][0] = {source};"));
        }
        if kernel.writes_scratch {
            scratch.iter().for_each(|field| self.store_scratch(field));
        }
        self.line("}");
    }

    fn load_scratch(&mut self, field: &Field) {
        let name = self.class.names.of(field).to_owned();
        for index in 0..field.len {
            let target = format!("scratch.{}", indexed(&name, index, field.len));
            let source = format!("call->scratch[{}]", field.offset + index);
            self.line(&match field.scalar {
                Scalar::F32 => format!("    {target} = {source}[0];"),
                Scalar::I32 | Scalar::U32 => format!("    memcpy(&{target}, {source}, 4);"),
                Scalar::Bool => {
                    format!(
                        "    {{ int32_t word; memcpy(&word, {source}, 4); {target} = word != 0; }}"
                    )
                }
            });
        }
    }

    fn store_scratch(&mut self, field: &Field) {
        let name = self.class.names.of(field).to_owned();
        for index in 0..field.len {
            let source = format!("scratch.{}", indexed(&name, index, field.len));
            let target = format!("call->scratch[{}]", field.offset + index);
            self.line(&match field.scalar {
                Scalar::F32 => format!("    {target}[0] = {source};"),
                Scalar::I32 | Scalar::U32 => format!("    memcpy({target}, &{source}, 4);"),
                Scalar::Bool => {
                    format!("    {{ const int32_t word = {source} ? -1 : 0; memcpy({target}, &word, 4); }}")
                }
            });
        }
    }

    /// The block is copied, since the host accesses it as words.
    fn constructor(&mut self) {
        let (namespace, class) = (self.namespace, self.class);
        let Some(symbol) = &class.description.constructor else { return };
        let fields = class.description.fields.iter();
        let parameters: Vec<&Field> =
            fields.filter(|it| it.kind == FieldKind::Parameter && it.len > 0).collect();
        self.line(&format!("\nextern \"C\" uint32_t {symbol}(void *block) {{"));
        self.line(&format!(
            "    {namespace}::{} object;\n    memcpy(&object, block, sizeof object);",
            class.name
        ));
        if !parameters.is_empty() {
            self.line("    uint32_t *const words = static_cast<uint32_t *>(block);");
            self.line(&format!("    {namespace}::{}::Parameters parameters;", class.name));
        }
        for field in &parameters {
            let name = class.names.of(field);
            for index in 0..field.len {
                let target = format!("parameters.{}", indexed(name, index, field.len));
                let word = field.offset + index;
                self.line(&match field.scalar {
                    Scalar::Bool => format!("    {target} = words[{word}] != 0;"),
                    Scalar::F32 | Scalar::I32 | Scalar::U32 => {
                        format!("    memcpy(&{target}, words + {word}, 4);")
                    }
                });
            }
        }
        let argument = if parameters.is_empty() { "" } else { "parameters" };
        let call = format!("object.construct({argument})");
        match class.constructor_may_fail {
            true => self.line(&format!("    const bool finished = {call};")),
            false => self.line(&format!("    {call};")),
        }
        self.line("    memcpy(block, &object, sizeof object);");
        match class.constructor_may_fail {
            true => self.line("    return finished ? 0u : uint32_t(RTSL_BUDGET_EXHAUSTED);"),
            false => self.line("    return 0u;"),
        }
        self.line("}");
    }

    fn tables(&mut self, kernels: &[&KernelDescription]) {
        let class = self.class.description;
        let symbol = self.library.class_symbol(class);
        self.line("");
        let parameters: Vec<String> = class.parameters.iter().map(parameter).collect();
        self.array("RtslParameter", &format!("{symbol}_parameters"), &parameters);
        let mut methods = Vec::new();
        for kernel in kernels {
            let words = |all: &[u32]| all.iter().map(u32::to_string).collect::<Vec<_>>();
            let (reads, writes) =
                (format!("{}_reads", kernel.symbol), format!("{}_writes", kernel.symbol));
            self.array("uint32_t", &reads, &words(&kernel.reads));
            self.array("uint32_t", &writes, &words(&kernel.writes));
            methods.push(format!(
                "{{{}, {}, {reads}, {writes}, {}, {}, RTSL_SINGLE, 1, {}, 0}}",
                string(kernel.method.name()),
                kernel.symbol,
                kernel.reads.len(),
                kernel.writes.len(),
                kernel.flags(),
            ));
        }
        self.array("RtslMethod", &format!("{symbol}_methods"), &methods);
        let initial: Vec<String> = class.initial.iter().map(|word| format!("{word:#x}u")).collect();
        self.array("uint32_t", &format!("{symbol}_initial"), &initial);
        let (element, buffer, stride) = class.element_numbers();
        let optional = |text: &Option<String>| text.as_deref().map_or("nullptr".to_owned(), string);
        let fields = [
            string(&class.name),
            optional(&class.documentation),
            format!("{symbol}_parameters"),
            format!("{symbol}_methods"),
            format!("{symbol}_initial"),
            class.constructor.clone().unwrap_or_else(|| "nullptr".to_owned()),
            Role::bits(&class.roles).to_string(),
            class.parameters.len().to_string(),
            kernels.len().to_string(),
            class.block_words.to_string(),
            class.construct_words.to_string(),
            class.scratch_arrays.to_string(),
            format!("{element}u"),
            format!("{buffer}u"),
            stride.to_string(),
            "0".to_owned(),
        ];
        self.line(&format!(
            "extern \"C\" const RtslClass {symbol} = {{\n    {}}};",
            fields.join(",\n    ")
        ));
    }

    /// C++ has no arrays without elements.
    fn array(&mut self, type_name: &str, name: &str, elements: &[String]) {
        let elements = match elements {
            [] => "{}".to_owned(),
            elements => elements.join(", "),
        };
        self.line(&format!("static const {type_name} {name}[] = {{{elements}}};"));
    }
}

fn parameter(parameter: &ParameterDescription) -> String {
    let optional = |text: &Option<String>| text.as_deref().map_or("nullptr".to_owned(), string);
    let scalar = match parameter.scalar {
        Scalar::F32 => "RTSL_FLOAT",
        Scalar::I32 => "RTSL_INT",
        Scalar::U32 => "RTSL_UINT",
        Scalar::Bool => "RTSL_BOOL",
    };
    let float = |value: f32| literal(Constant::F32(value));
    format!(
        "\n    {{{}, {}, {}, {}, {scalar}, {}, {}, {}, {}, {}}}",
        string(&parameter.name),
        string(&parameter.type_name),
        optional(&parameter.label),
        optional(&parameter.documentation),
        parameter.len,
        parameter.offset,
        parameter.flags(),
        float(parameter.minimum.unwrap_or(f32::NEG_INFINITY)),
        float(parameter.maximum.unwrap_or(f32::INFINITY)),
    )
}

/// Returns a component of the state in the struct.
fn state_text(component: u32) -> String {
    let variable = state_variables().iter().rev().find(|it| it.first_component <= component);
    let variable = variable.expect("the first begins with component 0");
    let index = component - variable.first_component;
    format!("state.{}", indexed(&identifier(variable.name), index, variable.ty.components()))
}

/// Returns a string literal with any content.
fn string(text: &str) -> String {
    let mut result = "\"".to_owned();
    for byte in text.bytes() {
        match byte {
            b'"' | b'\\' => result.extend(['\\', char::from(byte)]),
            // Two question marks begin a trigraph.
            b'?' => result.push_str("\\?"),
            b' '..=b'~' => result.push(char::from(byte)),
            // Always three digits, so that a following digit is not part of the escape.
            other => result.push_str(&format!("\\{other:03o}")),
        }
    }
    result.push('"');
    result
}
