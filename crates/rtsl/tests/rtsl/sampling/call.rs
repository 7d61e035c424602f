//! Calls methods of an instance for many rays.

use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use glam::Vec3;
use rtsl::{
    CallArguments, CallMode, Compilation, Compiler, CompilerOptions, Engine, EngineOptions,
    Instance, InstanceBlock, Instances, LaneBlock, LaneMask, Method, Program, Value, library,
    lookup_state, new_state,
};

use crate::sampling::host::RandomHost;

/// An instance, ready for calls.
pub struct Shader {
    instance: Arc<Instance>,
    program: Arc<Program>,
    block: InstanceBlock,
}

impl Shader {
    /// An instance of a class of the standard library.
    pub fn library(class: &str, arguments: Vec<(&str, Value)>) -> Shader {
        let header = format!("class {class} :");
        let file = library::files().iter().find(|file| file.text.contains(&header));
        let file = file.unwrap_or_else(|| panic!("no class {class}"));
        Shader::of(&Compiler::default().compile(file.path, file.text), class, arguments)
    }

    /// An instance of a class of this file, whose includes are searched in this folder, too.
    pub fn file(path: &Path, folder: &Path, class: &str, arguments: Vec<(&str, Value)>) -> Shader {
        let options =
            CompilerOptions { search_path: vec![folder.to_owned()], ..CompilerOptions::default() };
        let compilation = Compiler::new(options).compile_file(path);
        Shader::of(&compilation, class, arguments)
    }

    /// An instance of a class of this text.
    pub fn text(text: &str, class: &str, arguments: Vec<(&str, Value)>) -> Shader {
        Shader::of(&Compiler::default().compile("test.rtsl", text), class, arguments)
    }

    fn of(compilation: &Compilation, class: &str, arguments: Vec<(&str, Value)>) -> Shader {
        let unit = compilation.unit.as_ref();
        let unit = unit.unwrap_or_else(|| panic!("{}", compilation.report(false)));
        let class = unit.class(class).expect("the class is there");
        let instance = Instance::new(class, arguments)
            .unwrap_or_else(|problems| panic!("{:?}", problems.into_vec()));
        let program = engine().program(&instance);
        let block = program.block(&instance);
        Shader { instance, program, block }
    }

    /// For a parameter that refers to a shader.
    pub fn reference(&self) -> Value {
        self.instance.clone().into()
    }

    /// Rays with a state of zeros. Their numbers decide what `rand()` gives.
    pub fn rays(&self, numbers: Range<usize>) -> Rays {
        let count = numbers.len();
        Rays {
            state: new_state(count),
            scratch: self.program.new_scratch(count),
            host: RandomHost::new(numbers.start as u64, count),
            count,
        }
    }

    /// Calls a method for all rays.
    pub fn call(&self, method: Method, rays: &mut Rays) {
        let kernel = self
            .program
            .kernel(method, CallMode::Packet)
            .unwrap_or_else(|error| panic!("{}: {}", method.name(), error.message));
        let mut accepted = LaneMask::new(rays.count);
        let status = kernel.call(CallArguments {
            state: &mut rays.state,
            scratch: &mut rays.scratch,
            count: rays.count,
            mask: None,
            accepted: (method == Method::Intersect).then_some(&mut accepted),
            instances: Instances::One(&self.block),
            host: &mut rays.host,
        });
        assert!(!status.budget_exhausted);
    }
}

/// A texture of one colour.
pub fn constant(value: f32) -> Value {
    Shader::library("Constant", vec![("value", value.into())]).reference()
}

/// State of some rays.
pub struct Rays {
    state: LaneBlock,
    scratch: LaneBlock,
    host: RandomHost,
    count: usize,
}

impl Rays {
    /// Sets a variable, for each ray its own value.
    pub fn set_vectors(&mut self, variable: &str, values: &[Vec3]) {
        let components = self.state.vectors_mut::<3>(component_of(variable));
        for (component, array) in components.into_iter().enumerate() {
            array.iter_mut().zip(values).for_each(|(lane, value)| *lane = value[component]);
        }
    }

    /// Sets a variable for all rays.
    pub fn fill_vector(&mut self, variable: &str, value: Vec3) {
        self.set_vectors(variable, &vec![value; self.count]);
    }

    /// A variable of each ray.
    pub fn floats(&self, variable: &str) -> &[f32] {
        self.state.floats(component_of(variable))
    }

    /// A variable of each ray; for a colour, its three components.
    pub fn vectors(&self, variable: &str) -> Vec<Vec3> {
        let first = component_of(variable);
        let [x, y, z] = [0, 1, 2].map(|component| self.state.floats(first + component));
        (0..self.count).map(|ray| Vec3::new(x[ray], y[ray], z[ray])).collect()
    }
}

/// The factor by which there are fewer samples if the interpreter evaluates them.
pub fn thinning() -> usize {
    if engine().llvm().is_some() { 1 } else { 16 }
}

/// The numbers below `count`, in runs that fit into a processor's cache with their state.
pub fn batches(count: usize) -> impl Iterator<Item = Range<usize>> {
    const BATCH: usize = 2048;
    (0..count).step_by(BATCH).map(move |start| start..count.min(start + BATCH))
}

fn engine() -> &'static Engine {
    static ENGINE: OnceLock<Engine> = OnceLock::new();
    ENGINE.get_or_init(|| match Engine::new(EngineOptions::default()) {
        Ok((engine, _)) => engine,
        Err(diagnostic) => panic!("{}", diagnostic.message),
    })
}

fn component_of(variable: &str) -> usize {
    lookup_state(variable).expect("a state variable").first_component as usize
}
