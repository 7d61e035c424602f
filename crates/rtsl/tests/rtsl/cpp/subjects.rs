//! The subjects of the comparison: methods and constructors, as functions and as C++.

use std::sync::Arc;

use rtsl::aot::{AotLibrary, AotOptions, Bindings};
use rtsl::{Backend, Class, Compiler, Engine, EngineOptions, Role, library};
use rtsl_abi::description::{ClassDescription, Field, FieldKind, LibraryDescription};
use rtsl_abi::offsets::BUFFER_WORDS;
use rtsl_cpp::ClassCode;
use rtsl_ir::evaluate::CANONICAL_NAN;
use rtsl_ir::{Function, OpKind, Scalar, VariableKind};
use rtsl_spec::{Method, StateVariable, lookup_state, state_component_count};
use rtsl_testing::functions::seeded_function;

use crate::cpp::memory::Memory;
use crate::cpp::noise::Noise;

/// So that no loop takes long, whatever the members are.
const LOOP_BUDGET: u32 = 300;
/// Generated functions.
const GENERATED: u64 = 16;

/// Classes whose references are bound.
const BOUND: usize = 6;

/// The name of words in which nothing stands that a call leaves.
const PADDING: &str = "padding";

/// A method, or the constructors of a class.
pub struct Subject {
    /// The namespace, the class and the method.
    pub name: String,
    pub namespace: String,
    pub class: ClassDescription,
    /// `None` for constructors.
    pub method: Option<Method>,
    pub functions: Vec<Function>,
    /// The state variables of its library, in the order of the one table.
    pub state: Arc<[&'static StateVariable]>,
    /// The text of its library.
    pub header: Arc<str>,
    /// The C header of its library, where that has kernels.
    pub c_header: Option<Arc<str>>,
}

impl Subject {
    /// The operations of its functions.
    pub fn operations(&self) -> usize {
        let mut count = 0;
        for function in &self.functions {
            function.body.for_each_op(&mut |_| count += 1);
        }
        count
    }
}

/// All there are.
pub fn all() -> Vec<Subject> {
    let classes = standard_classes();
    let mut subjects = of_library(&standard(&classes, "shaders", Bindings::default()));
    subjects.extend(of_library(&standard(&with_references(&classes), "bound", bindings(&classes))));
    let lvalues = compiled("lvalues.rtsl", include_str!("../common/lvalues.rtsl"));
    subjects.extend(of_library(&standard(&lvalues, "lvalues", Bindings::default())));
    subjects.extend(generated());
    subjects
}

fn compiled(name: &str, text: &str) -> Vec<Arc<Class>> {
    Compiler::default().compile(name, text).unit.unwrap().classes().to_vec()
}

/// All classes of the standard library but integrators, which are not written as C++.
fn standard_classes() -> Vec<Arc<Class>> {
    let classes = library::files().iter().flat_map(|it| compiled(it.path, it.text));
    classes.filter(|class| !class.roles.contains(&Role::Integrator)).collect()
}

fn with_references(classes: &[Arc<Class>]) -> Vec<Arc<Class>> {
    let classes = classes.iter().filter(|class| !class.references.is_empty());
    classes.take(BOUND).cloned().collect()
}

/// Each texture that a class refers to is a checker.
fn bindings(classes: &[Arc<Class>]) -> Bindings {
    let checker = classes.iter().find(|class| class.name == "Checker").unwrap();
    let mut bindings = Bindings::default();
    for class in classes {
        for reference in &class.references {
            let _ = bindings.bind(class, &reference.name, checker);
        }
    }
    bindings
}

fn standard(classes: &[Arc<Class>], prefix: &str, bindings: Bindings) -> AotLibrary {
    let options = EngineOptions {
        backend: Backend::Interpreter,
        loop_budget: Some(LOOP_BUDGET),
        ..EngineOptions::default()
    };
    let (engine, _) = Engine::new(options).unwrap();
    let options = AotOptions { prefix: prefix.to_owned(), bindings, ..AotOptions::default() };
    engine.aot_library(classes, &options).unwrap()
}

fn of_library(library: &AotLibrary) -> Vec<Subject> {
    let c_header = Some(library.header().into());
    subjects(library.description(), &library.code(), library.cpp(), c_header)
}

/// Functions of every operation, each the only method of a class.
fn generated() -> Vec<Subject> {
    let functions: Vec<Function> = (0..GENERATED).map(|seed| seeded_function(seed, 500)).collect();
    let optimised = functions.iter().map(|function| {
        let mut function = function.clone();
        rtsl_opt::optimize(&mut function, &rtsl_opt::Options::default());
        function
    });
    let functions: Vec<Function> = functions.iter().cloned().chain(optimised).collect();
    let classes = (0..functions.len()).map(|number| describe(number, &functions[0]));
    let library = LibraryDescription { prefix: "generated".to_owned(), classes: classes.collect() };
    let code: Vec<ClassCode<'_>> = functions
        .iter()
        .map(|function| ClassCode {
            constructors: Vec::new(),
            methods: vec![(Method::Shade, function)],
        })
        .collect();
    let text = rtsl_cpp::emit(&library, &code);
    subjects(&library, &code, text, None)
}

/// A class with the places of a generated function.
fn describe(number: usize, function: &Function) -> ClassDescription {
    let (mut fields, mut scratch) = (Vec::new(), Vec::new());
    let (mut words, mut arrays) = (0, 0);
    let mut variables = function.variables.clone();
    variables.sort_by_key(|variable| variable.kind != VariableKind::Buffer);
    for variable in &variables {
        let field = |kind, offset| {
            let (name, scalar, len) = (variable.name.clone(), variable.scalar, variable.len);
            Field { name, kind, scalar, len, offset }
        };
        match variable.kind {
            VariableKind::Buffer => {
                fields.push(field(FieldKind::Buffer, words));
                words += BUFFER_WORDS;
            }
            VariableKind::Member => {
                fields.push(field(FieldKind::Member, words));
                words += variable.len;
            }
            VariableKind::Scratch => {
                scratch.push(field(FieldKind::Scratch, arrays));
                arrays += variable.len;
            }
            VariableKind::State
            | VariableKind::Parameter
            | VariableKind::Local
            | VariableKind::Accepted => {}
        }
    }
    words = words.next_multiple_of(2);
    ClassDescription {
        name: format!("Generated{number}"),
        documentation: None,
        roles: Vec::new(),
        parameters: Vec::new(),
        element: None,
        fields,
        block_words: words,
        construct_words: words,
        initial: vec![0; words as usize],
        scratch,
        scratch_arrays: arrays,
        constructor: None,
        method_documentation: Default::default(),
        kernels: Vec::new(),
    }
}

fn subjects(
    library: &LibraryDescription,
    code: &[ClassCode<'_>],
    header: String,
    c_header: Option<Arc<str>>,
) -> Vec<Subject> {
    let functions = code.iter().flat_map(|code| {
        let methods = code.methods.iter().map(|(_, function)| *function);
        methods.chain(code.constructors.iter().copied())
    });
    let variables = functions.flat_map(|function| &function.variables);
    let states = variables.filter(|variable| variable.kind == VariableKind::State);
    let mut state: Vec<_> = states.filter_map(|variable| lookup_state(&variable.name)).collect();
    state.sort_by_key(|variable| variable.index);
    state.dedup_by_key(|variable| variable.index);
    let (state, header): (Arc<[_]>, Arc<str>) = (state.into(), header.into());
    let mut subjects = Vec::new();
    for (class, code) in library.classes.iter().zip(code) {
        let mut add = |method: Option<Method>, functions: Vec<Function>| {
            let method_name = method.map_or("construct", Method::name);
            subjects.push(Subject {
                name: format!("{}.{}.{method_name}", library.prefix, class.name),
                namespace: library.prefix.clone(),
                class: class.clone(),
                method,
                functions,
                state: state.clone(),
                header: header.clone(),
                c_header: c_header.clone(),
            });
        };
        if !code.constructors.is_empty() {
            add(None, code.constructors.iter().map(|function| (*function).clone()).collect());
        }
        for (method, function) in &code.methods {
            let mut functions: Vec<Function> =
                code.constructors.iter().map(|function| (*function).clone()).collect();
            functions.push((*function).clone());
            add(Some(*method), functions);
        }
    }
    subjects
}

impl Subject {
    /// True if the function calls its host.
    pub fn asks_host(&self) -> bool {
        let mut asks = false;
        let function = self.functions.last().unwrap();
        function.body.for_each_op(&mut |op| {
            asks |= matches!(
                op.kind,
                OpKind::Trace { .. }
                    | OpKind::Occluded { .. }
                    | OpKind::LightCount
                    | OpKind::LightSample { .. }
                    | OpKind::Ambient
                    | OpKind::Rand
            );
        });
        asks
    }

    /// True if the function reports accepted hits.
    pub fn accepts(&self) -> bool {
        let function = self.functions.last().unwrap();
        function.variables.iter().any(|variable| variable.kind == VariableKind::Accepted)
    }

    /// The buffers of its class.
    pub fn buffers(&self) -> impl Iterator<Item = &Field> {
        self.class.fields.iter().filter(|field| field.kind == FieldKind::Buffer)
    }

    /// The parameters of the class's constructors.
    pub fn parameters(&self) -> impl Iterator<Item = &Field> {
        self.class.fields.iter().filter(|field| field.kind == FieldKind::Parameter)
    }

    /// Appends what the driver reads of a call, and returns what it should write.
    pub fn call(&self, seed: u64, words: &mut Vec<u32>) -> Vec<u32> {
        let mut memory = self.memory(&mut Noise::new(seed ^ (self.name.len() as u64) << 32));
        let Some((method, constructors)) = self.functions.split_last() else { return Vec::new() };
        if self.method.is_some() {
            for constructor in constructors {
                memory.run(&self.class, constructor);
            }
        }
        self.write_block(&memory, words);
        if self.method.is_none() {
            let mut budget = false;
            for constructor in &self.functions {
                budget |= memory.run(&self.class, constructor).1;
            }
            let mut result = memory.block[..self.class.block_words as usize].to_vec();
            result.push(u32::from(!budget));
            return self.canonical(&result);
        }
        let state = self.state.iter().flat_map(|variable| {
            variable.first_component..variable.first_component + variable.ty.components()
        });
        let state: Vec<usize> = state.map(|component| component as usize).collect();
        words.extend(state.iter().map(|component| memory.state[*component]));
        words.extend(&memory.scratch);
        let (accepted, budget) = memory.run(&self.class, method);
        let mut result: Vec<u32> = state.iter().map(|it| memory.state[*it]).collect();
        result.extend(&memory.scratch);
        result.extend([u32::from(accepted), u32::from(budget)]);
        self.canonical(&result)
    }

    fn write_block(&self, memory: &Memory, words: &mut Vec<u32>) {
        words.extend(&memory.block);
        for (count, elements) in memory.buffers.values() {
            words.push(*count);
            words.extend(elements);
        }
    }

    fn memory(&self, noise: &mut Noise) -> Memory {
        let mut memory = Memory { block: self.class.initial.clone(), ..Memory::default() };
        let edges = 4 + 16 * noise.below(2);
        if self.class.parameters.is_empty() {
            // Generated: any members.
            for field in self.class.fields.iter().filter(|it| it.kind == FieldKind::Member) {
                for word in 0..field.len {
                    memory.block[(field.offset + word) as usize] =
                        noise.scalar(field.scalar, edges);
                }
            }
        }
        for parameter in self.class.parameters.iter().filter(|it| !it.is_buffer) {
            if noise.below(3) == 0 {
                continue;
            }
            for word in 0..parameter.len {
                let bits = match parameter.scalar == Scalar::F32 && noise.below(edges) == 0 {
                    true => noise.scalar(Scalar::F32, 1),
                    false => noise.between(parameter.scalar, parameter.minimum, parameter.maximum),
                };
                memory.block[(parameter.offset + word) as usize] = bits;
            }
        }
        let count = noise.below(8);
        for field in self.buffers() {
            let mut scalar = || noise.scalar(field.scalar, edges);
            let words = (0..count * field.len).map(|_| scalar()).collect();
            memory.buffers.insert(field.offset, (count, words));
        }
        let state = (0..state_component_count()).map(|_| noise.scalar(Scalar::F32, edges));
        memory.state = state.collect();
        for field in &self.class.scratch {
            memory.scratch.extend((0..field.len).map(|_| noise.scalar(field.scalar, edges)));
        }
        memory
    }

    /// Words that the driver writes, with one NaN for all.
    pub fn canonical(&self, words: &[u32]) -> Vec<u32> {
        let canonical = |(word, (name, scalar)): (&u32, (String, Scalar))| match scalar {
            // Addresses of buffers, too.
            _ if name == PADDING => 0,
            Scalar::F32 if f32::from_bits(*word).is_nan() => CANONICAL_NAN,
            _ => *word,
        };
        words.iter().zip(self.outputs()).map(canonical).collect()
    }

    /// The name of a word that the driver writes.
    pub fn output_name(&self, at: usize) -> String {
        self.outputs().nth(at).map_or_else(String::new, |(name, _)| name)
    }

    fn outputs(&self) -> Box<dyn Iterator<Item = (String, Scalar)> + '_> {
        let each = |name: &str, scalar: Scalar, len: u32| {
            let name = name.to_owned();
            (0..len).map(move |index| (format!("{name}[{index}]"), scalar))
        };
        let flag = |name: &str| std::iter::once((name.to_owned(), Scalar::Bool));
        if self.method.is_none() {
            let mut words =
                vec![(PADDING.to_owned(), Scalar::U32); self.class.block_words as usize];
            for field in self.class.fields.iter().filter(|field| field.kind == FieldKind::Member) {
                for (word, name) in
                    (field.offset as usize..).zip(each(&field.name, field.scalar, field.len))
                {
                    words[word] = name;
                }
            }
            return Box::new(words.into_iter().chain(flag("finished")));
        }
        let state =
            self.state.iter().flat_map(move |it| each(it.name, Scalar::F32, it.ty.components()));
        let scratch =
            self.class.scratch.iter().flat_map(move |it| each(&it.name, it.scalar, it.len));
        Box::new(state.chain(scratch).chain(flag("accepted")).chain(flag("budget exceeded")))
    }
}
