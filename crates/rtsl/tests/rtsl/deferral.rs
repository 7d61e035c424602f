//! Rays and lights of the library's materials, all of which a renderer may add up later.

use std::sync::Arc;

use rtsl::{
    Backend, Class, Compiler, CompilerOptions, Engine, EngineOptions, Instance, Method, OptLevel,
    ParameterType, Role, Trace, TraceDetail, Value, defer, library,
};
use rtsl_ir::{Function, OpKind, Query};

/// The class of the library with this name.
fn class(name: &str) -> Arc<Class> {
    let declares = |text: &str| library::declared_classes(text).any(|declared| declared == name);
    let file = library::files().iter().find(|file| declares(file.text)).expect("a class");
    let unit = Compiler::default().compile(file.path, file.text).unit.expect("it compiles");
    unit.class(name).expect("it is declared").clone()
}

/// An instance whose references are set: to materials that trace, and to textures.
fn instance(class: &Arc<Class>, [material, texture]: [&Arc<Instance>; 2]) -> Arc<Instance> {
    let arguments = class.parameters.iter().filter_map(|parameter| {
        let value = match parameter.ty {
            ParameterType::Reference(Role::Material) => Value::Instance(material.clone()),
            ParameterType::Reference(Role::Texture) | ParameterType::Textured(_) => {
                Value::Instance(texture.clone())
            }
            ParameterType::Buffer(_) => Value::List(vec![Value::Float(0.5); 8]),
            _ => return None,
        };
        Some((parameter.name.as_str(), value))
    });
    Instance::new(class, arguments)
        .unwrap_or_else(|problems| panic!("{}: {problems:?}", class.name))
}

/// The requests that the pass is about: rays, lights, calls of `shade`.
fn requests(function: &Function) -> [u32; 3] {
    let mut counts = [0; 3];
    function.body.for_each_op(&mut |op| match op.kind {
        OpKind::Trace { .. } => counts[0] += 1,
        OpKind::LightSample { .. } => counts[1] += 1,
        OpKind::Query(Query::Shade, _) => counts[2] += 1,
        _ => {}
    });
    counts
}

#[test]
fn all_rays_and_lights_of_the_library_are_deferred() {
    check_library(&Compiler::default(), None);
}

/// Pictures and recordings of their pixels have the same bits.
#[test]
fn those_of_traced_methods_are_deferred_too() {
    let compiler = Compiler::new(CompilerOptions { traced: true, ..CompilerOptions::default() });
    check_library(&compiler, Some(Trace::new(TraceDetail::Steps)));
}

fn check_library(compiler: &Compiler, trace: Option<Trace>) {
    let options = EngineOptions {
        backend: Backend::Interpreter,
        optimization: OptLevel::O0,
        trace,
        ..EngineOptions::default()
    };
    let (engine, _) = Engine::new(options).unwrap();
    let plain = Instance::new(&class("Checkerboard"), []).unwrap();
    let phong = Instance::new(&class("Phong"), []).unwrap();
    let mut all = [0; 3];
    for file in library::files() {
        let unit = compiler.compile(file.path, file.text).unit.expect("it compiles");
        for class in unit.classes() {
            for method in [Method::Shade, Method::Radiance] {
                if !class.methods.contains_key(&method) {
                    continue;
                }
                let instance = instance(class, [&phong, &plain]);
                let program = engine.program(&instance);
                let counts = requests(&program.method(method).unwrap().function);
                let deferring = program.deferring_method(method).unwrap();
                rtsl_ir::verify::verify(&deferring.function).unwrap();
                let kept = || defer::examine(&class.methods[&method]).kept;
                assert_eq!(requests(&deferring.function), [0; 3], "{}: {:?}", class.name, kept());
                all.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
            }
        }
    }
    assert!(all[0] > 40 && all[1] > 30 && all[2] > 0, "{all:?}");
}
