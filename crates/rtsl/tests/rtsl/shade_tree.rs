//! From text to results, through references: shade trees, arrays of references, unset ones,
//! constructors.

use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Compiler, CompilerOptions, Engine, EngineOptions, Instance,
    Instances, LoopOwners, Method, Unit, Value, lookup_state, new_state,
};

const TEXT: &str = "
float twofold(rt_Texture map, vec2 uv) { return 2.0 * map.lookupFloat(uv); }

class Ramp : rt_Texture;
public float scale = 1.0;
private float doubled;
constructor() { doubled = 2.0 * scale; }
void lookup() { rt_FloatTextureValue = rt_TextureUV.x * doubled; }

class Choice : rt_Texture;
public rt_Texture layers[3];
public rt_Texture extra;
void lookup() {
    int index = int(rt_TextureUV.y);
    float value = layers[index].lookupFloat();
    for (int i = 0; i < 3; i++)
        value += 100.0 * layers[i].lookupFloat(vec2(float(i), 0.0));
    if (isSet(extra)) value += 10000.0;
    rt_FloatTextureValue = value;
}

class Painted : rt_Material;
public rt_Texture paint;
void shade() { rt_SampleColor = color(paint.lookupFloat(), 1.0, 2.0); }

class Stack : rt_Texture;
public rt_Texture layers[];
public rt_Texture more[];
float either(rt_Texture map) { return isSet(map) ? twofold(map, rt_TextureUV) : -1.0; }
void lookup() {
    float sum = 1000.0 * float(more.length());
    for (int i = 0; i < layers.length(); ++i) sum += either(layers[i]);
    rt_FloatTextureValue = sum + 0.25 * layers[int(rt_TextureUV.y)].lookupFloat();
}

class Endless : rt_Texture;
public float limit = 0.0;
private float reached;
constructor() { while (reached >= limit) reached += 1.0; }
void lookup() { rt_FloatTextureValue = reached; }
";

fn unit() -> Unit {
    let options = CompilerOptions { loop_budget: Some(1000), ..CompilerOptions::default() };
    let compilation = Compiler::new(options).compile("test.rtsl", TEXT);
    assert_eq!(compilation.report(false), "");
    compilation.unit.unwrap()
}

fn new(unit: &Unit, class: &str, arguments: Vec<(&str, Value)>) -> Arc<Instance> {
    Instance::new(unit.class(class).unwrap(), arguments).unwrap()
}

fn shade(engine: &Engine, instance: &Instance, variables: &[[f32; 2]]) -> Vec<f32> {
    let program = engine.program(instance);
    let kernel = program.kernel(Method::Shade, CallMode::Packet).unwrap();
    let mut state = new_state(variables.len());
    let uv = lookup_state("rt_TextureUV").unwrap().first_component as usize;
    let [u, v] = state.vectors_mut::<2>(uv);
    for (lane, variable) in variables.iter().enumerate() {
        (u[lane], v[lane]) = (variable[0], variable[1]);
    }
    let _ = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(variables.len()),
        count: variables.len(),
        mask: None,
        accepted: None,
        instances: Instances::One(&program.block(instance)),
        host: &mut NoHost,
    });
    let color = lookup_state("rt_SampleColor").unwrap().first_component as usize;
    state.floats(color).to_vec()
}

fn engines() -> Vec<Engine> {
    let all = [(Backend::Interpreter, 1), (Backend::Jit, 1), (Backend::Jit, 8)];
    let engines = all.into_iter().filter_map(|(backend, width)| {
        let options = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
        Engine::new(options).ok().map(|(engine, _)| engine)
    });
    engines.collect()
}

#[test]
fn a_shade_tree_is_one_kernel() {
    let unit = unit();
    let ramp = |scale: f32| Value::from(new(&unit, "Ramp", vec![("scale", scale.into())]));
    let layers = Value::List(vec![ramp(0.5), ramp(1.0), ramp(2.0)]);
    let choice = new(&unit, "Choice", vec![("layers", layers)]);
    let painted = new(&unit, "Painted", vec![("paint", choice.into())]);
    for engine in engines() {
        // The layers give u, 2u and 4u; the loop adds 100 (0 + 2 * 1 + 4 * 2).
        let variables = [[3.0, 0.0], [3.0, 1.0], [3.0, 2.0], [3.0, 7.0], [3.0, -5.0]];
        let found = shade(&engine, &painted, &variables);
        assert_eq!(found, [1003.0, 1006.0, 1012.0, 1012.0, 1003.0]);
        let method = engine.program(&painted).method(Method::Shade).unwrap();
        assert!(method.warnings.is_empty());
    }
}

#[test]
fn arrays_of_references_have_the_elements_that_hosts_give() {
    let unit = unit();
    let ramp = |scale: f32| Value::from(new(&unit, "Ramp", vec![("scale", scale.into())]));
    let stack = |layers: Vec<Value>, more: Vec<Value>| {
        let stack =
            new(&unit, "Stack", vec![("layers", Value::List(layers)), ("more", Value::List(more))]);
        assert!(stack.unset_reference_warnings(None).is_empty());
        new(&unit, "Painted", vec![("paint", stack.into())])
    };
    for engine in engines() {
        // Each layer gives 4u times its scale, and the one at the index, clamped, a quarter of 2u times its scale.
        let variables = [[3.0, -1.0], [3.0, 1.0], [3.0, 9.0]];
        let three = stack(vec![ramp(1.0), ramp(2.0), ramp(4.0)], vec![]);
        assert_eq!(shade(&engine, &three, &variables), [85.5, 87.0, 90.0]);
        let one = stack(vec![ramp(1.0)], vec![]);
        assert_eq!(shade(&engine, &one, &variables), [13.5; 3]);
        let none = stack(vec![], vec![ramp(1.0)]);
        assert_eq!(shade(&engine, &none, &variables), [1000.0; 3]);
        // What is in one array is not in the other, though the trees have the same classes in the same order.
        assert!(!Arc::ptr_eq(&engine.program(&one), &engine.program(&none)));
    }
}

#[test]
fn parameters_are_data_and_trees_are_code() {
    let unit = unit();
    let engine = &engines()[0];
    let painted = |scale: f32| {
        let ramp = new(&unit, "Ramp", vec![("scale", scale.into())]);
        new(&unit, "Painted", vec![("paint", ramp.into())])
    };
    let (a, b) = (painted(1.0), painted(2.0));
    let bare = new(&unit, "Painted", vec![]);
    let programs = [engine.program(&a), engine.program(&b), engine.program(&bare)];
    assert!(Arc::ptr_eq(&programs[0], &programs[1]));
    assert!(!Arc::ptr_eq(&programs[0], &programs[2]));
    assert_eq!(shade(engine, &a, &[[3.0, 0.0]]), [6.0]);
    assert_eq!(shade(engine, &b, &[[3.0, 0.0]]), [12.0]);
}

#[test]
fn an_unset_reference_is_black_and_warned_about() {
    let unit = unit();
    let bare = new(&unit, "Painted", vec![]);
    for engine in engines() {
        assert_eq!(shade(&engine, &bare, &[[3.0, 0.0]; 2]), [0.0; 2]);
        let method = engine.program(&bare).method(Method::Shade).unwrap();
        let codes: Vec<_> = method.warnings.iter().map(|warning| warning.code.as_str()).collect();
        assert_eq!(codes, ["W0501"]);
    }
}

/// The warning for hosts that make instances, with the paths of elements.
#[test]
fn instances_know_their_unset_references() {
    let unit = unit();
    let ramp = new(&unit, "Ramp", vec![]);
    let said = |instance: &Instance| -> Vec<String> {
        let warnings = instance.unset_reference_warnings(None);
        warnings.iter().map(|warning| warning.message.clone()).collect()
    };
    assert_eq!(
        said(&new(&unit, "Painted", vec![])),
        ["the reference `paint` of `Painted` is used but not set"]
    );
    assert!(said(&new(&unit, "Painted", vec![("paint", ramp.clone().into())])).is_empty());
    // `extra` is tested.
    let layers = Value::from([ramp.clone(), ramp.clone(), ramp]);
    assert!(said(&new(&unit, "Choice", vec![("layers", layers)])).is_empty());
    assert_eq!(said(&new(&unit, "Choice", vec![])).len(), 3);
}

#[test]
fn loops_belong_to_the_classes_that_have_them() {
    let text = "
class Rising : rt_Texture;
void lookup() { float x = rt_TextureUV.x; while (x < 1.0) x *= 1.5; rt_FloatTextureValue = x; }
class Plain : rt_Material;
public rt_Texture kd;
void BSDF() { rt_BSDFValue = isSet(kd) ? kd.lookup() : color(0.5); }
class Own : rt_Material;
public rt_Texture kd;
void BSDF() {
    float x = rt_TextureUV.x;
    while (x < 1.0) x *= 1.5;
    rt_BSDFValue = isSet(kd) ? x * kd.lookup() : color(x);
}
";
    let options = CompilerOptions { loop_budget: Some(1000), ..CompilerOptions::default() };
    let unit = Compiler::new(options).compile("test.rtsl", text).unit.unwrap();
    let engine = &engines()[0];
    let rising = new(&unit, "Rising", vec![]);
    let owners = |instance: &Instance, method| {
        let program = engine.program(instance);
        let owners = LoopOwners::of(&instance.class().name, method, [&*program]);
        (owners.subject(), owners.note().unwrap_or_default())
    };
    let of_material = |class, arguments| owners(&new(&unit, class, arguments), Method::Bsdf);
    let with_rising = || vec![("kd", Value::from(rising.clone()))];
    let one = |subject: &str| (subject.to_owned(), String::new());
    assert_eq!(owners(&rising, Method::Lookup), one("`lookup` of `Rising`"));
    assert_eq!(
        of_material("Plain", with_rising()),
        one("`lookup` of `Rising`, which `BSDF` of `Plain` calls,")
    );
    assert_eq!(of_material("Plain", vec![]), one("`BSDF` of `Plain`"));
    assert_eq!(of_material("Own", vec![]), one("`BSDF` of `Own`"));
    let (subject, note) = of_material("Own", with_rising());
    assert_eq!(subject, "`BSDF` of `Own`");
    assert_eq!(note, "loops are in `BSDF` of `Own`, `lookup` of `Rising`");
}

#[test]
fn a_constructor_without_end_is_an_error() {
    let problems = Instance::new(unit().class("Endless").unwrap(), []).unwrap_err();
    let codes: Vec<_> = problems.iter().map(|problem| problem.code.as_str()).collect();
    assert_eq!(codes, ["E0619"]);
}

#[test]
fn an_unknown_class_is_an_error_with_a_hint() {
    let error = unit().class("Painter").unwrap_err();
    assert_eq!(error.code.as_str(), "E0507");
    assert_eq!(error.help, ["did you mean `Painted`?"]);
}
