use std::sync::Arc;

use expect_test::{Expect, expect};
use rtsl_ir::Function;
use rtsl_ir::class::{Class, Reference, ReferenceCount};
use rtsl_ir::verify::verify;
use rtsl_source::{Diagnostic, diagnostic_codes as codes};
use rtsl_spec::{Method, Role};

use crate::{AttributeTable, ClassTree, Linked, link_function};

fn link(tree: &ClassTree, method: Method) -> Option<Result<Linked, Diagnostic>> {
    tree.class.methods.get(&method).map(|function| link_function(tree, function))
}

/// A class with one method, and with the references that are named `name[count]`.
fn class(name: &str, role: Role, method: Method, references: &[&str], text: &str) -> Class {
    let reference = |text: &&str| {
        let (name, count) = match text.split_once('[') {
            Some((name, count)) => {
                let count = count.trim_end_matches(']').parse();
                (name, count.map_or(ReferenceCount::Open, ReferenceCount::Array))
            }
            None => (*text, ReferenceCount::Single),
        };
        Reference { name: name.to_owned(), role: Role::Texture, count, tested: false }
    };
    Class {
        name: name.to_owned(),
        roles: vec![role],
        documentation: None,
        parameters: Vec::new(),
        members: Vec::new(),
        buffers: Vec::new(),
        scratch: Vec::new(),
        scratch_types: Vec::new(),
        outputs: Vec::new(),
        method_documentation: Default::default(),
        is_traced: false,
        differentiable: Default::default(),
        attributes: Vec::new(),
        references: references.iter().map(reference).collect(),
        initializer: Function::new(format!("{name}.initializer")),
        constructor: None,
        methods: [(method, text.parse().unwrap())].into(),
    }
}

fn texture(name: &str, references: &[&str], text: &str) -> Arc<Class> {
    Arc::new(class(name, Role::Texture, Method::Lookup, references, text))
}

fn tree(class: &Arc<Class>, references: Vec<Vec<Option<ClassTree>>>) -> ClassTree {
    ClassTree { class: class.clone(), references, attributes: AttributeTable::default() }
}

fn check(tree: &ClassTree, method: Method, expected: Expect) {
    let linked = link(tree, method).unwrap().unwrap();
    let mut function = linked.function;
    verify(&function).unwrap();
    function.renumber();
    let mut text = function.to_string();
    for warning in linked.warnings {
        text += &format!("{}: {}\n", warning.code, warning.message);
    }
    expected.assert_eq(&text);
}

const SCALED: &str = "
function Scaled.lookup
state rt_TextureUV: f32[2]
state rt_FloatTextureValue: f32[1]
member scale: f32[1]
{
  %u: f32 = load state:rt_TextureUV@0
  %s: f32 = load member:scale@0
  %r: f32 = multiply %u, %s
  return state:rt_FloatTextureValue@0 = %r
}";

const SHADE: &str = "
function Painted.shade
state rt_TextureUV: f32[2]
state rt_SampleColor: f32[3]
{
  %u: f32 = load state:rt_TextureUV@0
  %v: f32 = add %u, %u
  %a: f32 = call texture.lookup of paint () gives (rt_FloatTextureValue@0)
  %b: f32 = call texture.lookup of paint (rt_TextureUV@0 = %v) gives (rt_FloatTextureValue@0)
  %set: bool = is_set paint
  return state:rt_SampleColor@0 = %a, state:rt_SampleColor@1 = %b
}";

fn painted() -> Arc<Class> {
    Arc::new(class("Painted", Role::Material, Method::Shade, &["paint"], SHADE))
}

#[test]
fn a_call_becomes_the_body_and_sees_the_callers_state() {
    let scaled = texture("Scaled", &[], SCALED);
    let tree = tree(&painted(), vec![vec![Some(tree(&scaled, Vec::new()))]]);
    check(
        &tree,
        Method::Shade,
        expect![[r#"
        function Painted.shade
        state rt_TextureUV: f32[2]
        member paint.scale: f32[1]
        state rt_SampleColor: f32[3]
        {
          %0: f32 = load state:rt_TextureUV@0
          %1: f32 = add %0, %0
          %2: f32 = load state:rt_TextureUV@0
          %3: f32 = load member:paint.scale@0
          %4: f32 = multiply %2, %3
          %5: f32 = load member:paint.scale@0
          %6: f32 = multiply %1, %5
          %7: bool = constant true
          return state:rt_SampleColor@0 = %4, state:rt_SampleColor@1 = %6
        }
    "#]],
    );
}

#[test]
fn an_unset_reference_gives_defaults_and_a_warning() {
    let tree = tree(&painted(), vec![vec![None]]);
    check(
        &tree,
        Method::Shade,
        expect![[r#"
        function Painted.shade
        state rt_TextureUV: f32[2]
        state rt_SampleColor: f32[3]
        {
          %0: f32 = load state:rt_TextureUV@0
          %1: f32 = add %0, %0
          %2: f32 = constant 0.0
          %3: f32 = constant 0.0
          %4: bool = constant false
          return state:rt_SampleColor@0 = %2, state:rt_SampleColor@1 = %3
        }
        W0501: the reference `paint` of `Painted` is used but not set
    "#]],
    );
}

#[test]
fn an_index_chooses_by_comparisons_and_slots_in_loops_start_at_zero() {
    let layered = texture(
        "Layered",
        &["layers[3]"],
        "
function Layered.lookup
state rt_FloatTextureValue: f32[1]
{
  %zero: i32 = constant 0
  %i: i32 = loop (%n: i32 = %zero) {
    %l: f32 = call texture.lookup of layers@%n () gives (rt_FloatTextureValue@0)
    %set: bool = is_set layers@%n
    repeat %set, %n
  }
  %r: f32 = call texture.lookup of layers@%i () gives (rt_FloatTextureValue@0)
  return state:rt_FloatTextureValue@0 = %r
}",
    );
    let slotted = texture(
        "Slotted",
        &[],
        "
function Slotted.lookup
state rt_FloatTextureValue: f32[1]
local stack: f32[2]
{
  %i: i32 = constant 1
  %x: f32 = load local:stack@%i
  store local:stack@%i, %x
  return state:rt_FloatTextureValue@0 = %x
}",
    );
    let scaled = texture("Scaled", &[], SCALED);
    let elements = vec![Some(tree(&scaled, Vec::new())), None, Some(tree(&slotted, Vec::new()))];
    check(
        &tree(&layered, vec![elements]),
        Method::Lookup,
        expect![[r#"
        function Layered.lookup
        state rt_TextureUV: f32[2]
        member layers[0].scale: f32[1]
        local layers[2].stack.1: f32[2]
        local layers[2].stack.2: f32[2]
        state rt_FloatTextureValue: f32[1]
        {
          %0: i32 = constant 0
          %1: i32 = loop (%2: i32 = %0) {
            %3: i32 = constant 1
            %4: bool = less %2, %3
            %5: f32 = if %4 {
              %6: f32 = load state:rt_TextureUV@0
              %7: f32 = load member:layers[0].scale@0
              %8: f32 = multiply %6, %7
              yield %8
            } else {
              %9: i32 = constant 2
              %10: bool = less %2, %9
              %11: f32 = if %10 {
                %12: f32 = constant 0.0
                yield %12
              } else {
                %13: f32 = constant 0.0
                store local:layers[2].stack.1@0, %13
                store local:layers[2].stack.1@1, %13
                %14: i32 = constant 1
                %15: f32 = load local:layers[2].stack.1@%14
                store local:layers[2].stack.1@%14, %15
                yield %15
              }
              yield %11
            }
            %16: i32 = constant 1
            %17: bool = less %2, %16
            %18: bool = if %17 {
              %19: bool = constant true
              yield %19
            } else {
              %20: i32 = constant 2
              %21: bool = less %2, %20
              %22: bool = if %21 {
                %23: bool = constant false
                yield %23
              } else {
                %24: bool = constant true
                yield %24
              }
              yield %22
            }
            repeat %18, %2
          }
          %25: i32 = constant 1
          %26: bool = less %1, %25
          %27: f32 = if %26 {
            %28: f32 = load state:rt_TextureUV@0
            %29: f32 = load member:layers[0].scale@0
            %30: f32 = multiply %28, %29
            yield %30
          } else {
            %31: i32 = constant 2
            %32: bool = less %1, %31
            %33: f32 = if %32 {
              %34: f32 = constant 0.0
              yield %34
            } else {
              %35: i32 = constant 1
              %36: f32 = load local:layers[2].stack.2@%35
              store local:layers[2].stack.2@%35, %36
              yield %36
            }
            yield %33
          }
          return state:rt_FloatTextureValue@0 = %27
        }
        W0501: the reference `layers[1]` of `Layered` is used but not set
    "#]],
    );
}

#[test]
fn a_state_index_is_resolved_where_the_caller_overrides_a_component() {
    let indexed = texture(
        "Indexed",
        &[],
        "
function Indexed.lookup
state rt_TextureUV: f32[2]
state rt_FloatTextureValue: f32[1]
{
  %i: i32 = constant 1
  %x: f32 = load state:rt_TextureUV@%i
  return state:rt_FloatTextureValue@0 = %x
}",
    );
    let tree = tree(&painted(), vec![vec![Some(tree(&indexed, Vec::new()))]]);
    check(
        &tree,
        Method::Shade,
        expect![[r#"
        function Painted.shade
        state rt_TextureUV: f32[2]
        state rt_SampleColor: f32[3]
        {
          %0: f32 = load state:rt_TextureUV@0
          %1: f32 = add %0, %0
          %2: i32 = constant 1
          %3: f32 = load state:rt_TextureUV@%2
          %4: i32 = constant 1
          %5: f32 = load state:rt_TextureUV@1
          %6: i32 = constant 0
          %7: bool = less_equal %4, %6
          %8: f32 = select %7, %1, %5
          %9: bool = constant true
          return state:rt_SampleColor@0 = %3, state:rt_SampleColor@1 = %8
        }
    "#]],
    );
}

#[test]
fn large_trees_are_an_error() {
    let twice = texture(
        "Twice",
        &["of"],
        "
function Twice.lookup
state rt_FloatTextureValue: f32[1]
{
  %a: f32 = call texture.lookup of of () gives (rt_FloatTextureValue@0)
  %b: f32 = call texture.lookup of of () gives (rt_FloatTextureValue@0)
  %r: f32 = add %a, %b
  return state:rt_FloatTextureValue@0 = %r
}",
    );
    let mut chain = tree(&twice, vec![vec![None]]);
    for _ in 0..40 {
        chain = tree(&twice, vec![vec![Some(chain)]]);
    }
    let error = link(&chain, Method::Lookup).unwrap().unwrap_err();
    assert_eq!(error.code, codes::LINK_LIMIT);
    assert!(link(&chain, Method::Shade).is_none());
}
