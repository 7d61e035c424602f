//! The C++ around the classes: it reads calls, and writes what they leave.

use std::collections::BTreeMap;
use std::fmt::Write;

use rtsl_ir::Scalar;
use rtsl_packet::description::Field;

use crate::subjects::Subject;

/// The program's text.
pub struct Driver {
    text: String,
    /// By the names of their files.
    headers: BTreeMap<String, String>,
}

impl Driver {
    pub fn new(subjects: &[Subject]) -> Driver {
        let headers =
            subjects.iter().map(|it| (format!("{}.h", it.namespace), it.header.to_string()));
        let headers: BTreeMap<String, String> = headers.collect();
        let mut text = String::new();
        for name in headers.keys() {
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
        let _ = writeln!(
            text,
            "    write_block(object, {});\n    write(has_finished);\n}}",
            class.block_words
        );
        return;
    };
    let components: u32 = subject.state.iter().map(|variable| variable.ty.components()).sum();
    let _ = writeln!(text, "    State state;\n    set_words(&state, read({components}));");
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
    for field in &class.scratch {
        for index in 0..field.len {
            let _ = writeln!(text, "    write(scratch.{});", element(field, index));
        }
    }
    let accepted = if subject.accepts() { "accepted" } else { "false" };
    let _ = writeln!(text, "    write({accepted});\n    write(exceeded(state, 0));\n}}");
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

const START: &str = r#"
#include <cstdio>
#include <type_traits>
#include <vector>

static std::vector<uint32_t> input;
static std::vector<uint32_t> output;
static size_t position;

static std::vector<uint32_t> read(size_t count) {
    std::vector<uint32_t> words(input.begin() + position, input.begin() + position + count);
    position += count;
    words.push_back(0);
    return words;
}

static float as_float(uint32_t word) {
    float value;
    memcpy(&value, &word, sizeof value);
    return value;
}

static void write(uint32_t word) { output.push_back(word); }
static void write(int32_t word) { output.push_back(uint32_t(word)); }
static void write(bool word) { output.push_back(word); }

static void write(float value) {
    uint32_t word;
    memcpy(&word, &value, sizeof word);
    output.push_back(word);
}

static void set_words(void *to, const std::vector<uint32_t> &words) {
    memcpy(to, words.data(), (words.size() - 1) * 4);
}

static void write_words(const void *from, size_t count) {
    for (size_t i = 0; i < count; i++) {
        uint32_t word;
        memcpy(&word, static_cast<const char *>(from) + 4 * i, 4);
        output.push_back(word);
    }
}

template <typename T>
static void set(T &object, const std::vector<uint32_t> &words) {
    if (!std::is_empty<T>::value) memcpy(static_cast<void *>(&object), words.data(), sizeof object);
}

template <typename T>
static std::vector<uint32_t> read_buffer(T &object, size_t offset, size_t scalars) {
    const uint32_t count = input[position++];
    std::vector<uint32_t> words = read(count * scalars);
    const void *address = words.data();
    char *entry = reinterpret_cast<char *>(&object) + offset * 4;
    memcpy(entry, &address, 8);
    memcpy(entry + 8, &count, 4);
    return words;
}

/// The members, with zeros for what stands in entries of buffers.
template <typename T>
static void write_block(const T &object, size_t count) {
    write_words(&object, count);
}

template <typename F, typename std::enable_if<std::is_void<decltype(std::declval<F>()())>::value, int>::type = 0>
static bool finished(F construct) {
    construct();
    return true;
}

template <typename F, typename std::enable_if<!std::is_void<decltype(std::declval<F>()())>::value, int>::type = 0>
static bool finished(F construct) {
    return construct();
}

template <typename S>
static auto exceeded(const S &state, int) -> decltype(state.budget_exceeded) {
    return state.budget_exceeded;
}

template <typename S>
static bool exceeded(const S &, long) {
    return false;
}

static uint64_t mix(uint64_t state) {
    state = state * 0x9e3779b97f4a7c15 + 0x9e3779b97f4a7c15;
    state = (state ^ state >> 30) * 0xbf58476d1ce4e5b9;
    state = (state ^ state >> 27) * 0x94d049bb133111eb;
    return state ^ state >> 31;
}

static float unit(uint64_t hash, int component) {
    return float(mix(hash + component) >> 40) / float(1 << 24);
}

/// The test host of the representation, for ray 0.
template <typename Base, typename Light>
struct HashHost : Base {
    uint32_t requests = 0;
    uint64_t hash = 0;

    void begin() { hash = mix(0) ^ ++requests; }

    void add(float value) {
        uint32_t word;
        memcpy(&word, &value, sizeof word);
        hash = mix(hash ^ (value != value ? 0x7fc00000u : word));
    }

    void add(const float (&vector)[3]) {
        for (float value : vector) add(value);
    }

    void trace(const float (&origin)[3], const float (&direction)[3], float limit, float weight,
               float (&radiance)[3]) override {
        begin();
        add(origin);
        add(direction);
        add(limit);
        add(weight);
        for (int i = 0; i < 3; i++) radiance[i] = unit(hash, i);
    }

    bool occluded(const float (&origin)[3], const float (&direction)[3], float limit) override {
        begin();
        add(origin);
        add(direction);
        add(limit);
        return hash & 1;
    }

    int32_t light_count() override { return 3; }

    bool light_sample(int32_t index, const float (&point)[3], const float (&normal)[3], float cosine,
                      Light &light) override {
        begin();
        add(point);
        add(normal);
        add(cosine);
        add(float(uint32_t(index)));
        for (int i = 0; i < 3; i++) light.direction[i] = unit(hash, i);
        light.distance = unit(hash, 3);
        for (int i = 0; i < 3; i++) light.color[i] = unit(hash, 4 + i);
        light.pdf = unit(hash, 7);
        return (hash & 3) != 0;
    }

    void ambient(float (&color)[3]) override {
        for (int i = 0; i < 3; i++) color[i] = unit(7, i);
    }

    float rand() override {
        begin();
        return unit(hash, 0);
    }
};

"#;

const END: &str = r#"
int main(int, char **arguments) {
    FILE *file = fopen(arguments[1], "rb");
    for (uint32_t word; fread(&word, 4, 1, file) == 1;) input.push_back(word);
    fclose(file);
    while (position < input.size()) calls[input[position++]]();
    file = fopen(arguments[2], "wb");
    fwrite(output.data(), 4, output.size(), file);
    return fclose(file);
}
"#;
