//! Helpers: functions of integrators in text form, and their stages.

use rtsl_ir::{Function, Variable, VariableKind, verify};
use rtsl_stages::{Port, SplitError, Stages, split};

/// The variables that the functions of tests may use.
pub const VARIABLES: &str = "
    state rt_RayOrigin: f32[3] state rt_RayDirection: f32[3] state rt_HitDistance: f32[1]
    member m: f32[4] member n: i32[2] buffer t: f32[1] local r: f32[3]
    scratch kept: f32[2]";

/// Returns the function with these variables and this body. `RAY` stands for seven operands, `SURFACE` for the eleven
/// of a surface after object, instance and element, `VECTOR` for three.
pub fn function(body: &str) -> Function {
    let words = [("SURFACE", 11), ("VECTOR", 3), ("RAY", 7)];
    let body = words.iter().fold(body.to_owned(), |body, (word, count)| {
        body.replace(word, &vec!["%one"; *count].join(", "))
    });
    let text = format!("function Test.radiance {VARIABLES} {{ %one: f32 = constant 1.0 {body} }}");
    let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"));
    verify::verify(&function).unwrap_or_else(|error| panic!("{error}\n{text}"));
    function
}

/// Splits the function with this body.
pub fn stages(body: &str) -> Stages {
    let function = function(body);
    split(&function).unwrap_or_else(|error| panic!("{error}\n{function}"))
}

/// Returns the text of the stages without the declarations of requests and of the function's own variables.
pub fn text(body: &str) -> String {
    let text = stages(body).to_string();
    let is_declaration = |line: &&str| {
        let kinds = ["state ", "member ", "buffer ", "scratch kept", "scratch request"];
        kinds.iter().any(|kind| line.starts_with(kind))
    };
    text.lines().filter(|line| !is_declaration(line)).map(|line| format!("{line}\n")).collect()
}

/// Repeats a text with other names of values, in which `@` stands for a number.
fn repeated(text: &str, count: usize) -> String {
    (0..count).map(|index| text.replace('@', &format!("_{index}"))).collect()
}

#[test]
fn what_cannot_be_split_is_an_error() {
    let point = "%o@: bool = occluded %a, %a, %a, %a, %a, %a, %a ";
    let body =
        |body: &str| format!("{{ %a: f32 = constant 1.0 %c: bool = constant true {body} return }}");
    let table = [
        (
            format!("accepted hit: bool[1] {}", body(&repeated(point, 1))),
            "a function that accepts hits cannot be split",
        ),
        (
            format!("scratch frame.3: f32[1] {}", body(&repeated(point, 1))),
            "scratch `frame.3` has the name of a variable of stages",
        ),
        (
            format!("scratch #undefined.f32: f32[1] {}", body(&repeated(point, 1))),
            "scratch `#undefined.f32` has the name of a variable of stages",
        ),
        (
            body(&repeated(point, 1025)),
            "a function may wait for the renderer at no more than 1024 places, and this one does at 1025",
        ),
        (
            format!(
                "local big: f32[5000] {}",
                body(&format!(
                    "{} %i: i32 = convert %a %x: f32 = load local:big@%i",
                    repeated(point, 1)
                ))
            ),
            "a suspended path may keep no more than 4096 numbers, and this one keeps 5000",
        ),
    ];
    for (text, expected) in table {
        let function: Function = format!("function f {text}").parse().unwrap();
        assert_eq!(split(&function).unwrap_err().to_string(), expected, "{text}");
    }
}

/// Each `if` may suspend, so what follows is nested in one more region.
fn conditional_points(count: usize, rest: &str) -> Function {
    let text = "%f@: f32 = rand %c@: bool = convert %f@
        if %c@ { %o@: bool = occluded RAY yield } else { yield } ";
    function(&[&repeated(text, count), rest, "return"].concat())
}

#[test]
fn long_ways_through_points_are_split_or_rejected() {
    assert_eq!(split(&conditional_points(100, "")).unwrap().stages.len(), 101);
    assert_eq!(split(&conditional_points(260, "")).unwrap_err(), SplitError::Nesting);
}

#[test]
fn too_many_operations_are_rejected() {
    // What follows all points is in every stage.
    let function = conditional_points(200, &repeated("%x@: f32 = rand ", 6000));
    assert_eq!(split(&function).unwrap_err(), SplitError::Operations);
}

/// More slots than a run of promotion takes locals.
#[test]
fn no_local_is_left_of_many_slots() {
    let sums = repeated("%s@: f32 = add %x@, %dark ", 700);
    let text = format!(
        "%r: f32 = rand %c: bool = convert %r {} %dark: f32 = if %c {{
            %o: bool = occluded RAY %f: f32 = convert %o yield %f
        }} else {{ yield %r }} {sums} return state:rt_HitDistance@0 = %s_699, scratch:kept@0 = %s_1",
        repeated("%x@: f32 = rand ", 700)
    );
    let stages = stages(&text);
    assert_eq!(stages.slots.len(), 700);
    for stage in &stages.stages {
        let is_port = |it: &Variable| Port::of(it).is_some() || it.name == "rt_HitDistance";
        assert!(
            stage.function.variables.iter().all(|it| it.kind != VariableKind::Local),
            "{stage}"
        );
        assert!(stage.function.variables.iter().all(|it| is_port(it) || it.name == "kept"));
    }
}

/// Loops that start with the surface, each of which might be peeled.
#[test]
fn long_ways_through_loops_are_split() {
    let loops = |count| {
        let text = "%x@: i32 = loop (%p@: i32 = %o) {
            %r@: f32, %g@: f32, %b@: f32 = query emission %p@, %i, %e, SURFACE
            %c@: bool = convert %r@
            repeat %c@, %p@
        } ";
        let search = "%f: bool, %o: i32, %i: i32, %e: i32, %d: f32 = query nearest_hit RAY, %one ";
        split(&function(&[search, &repeated(text, count), "return"].concat()))
    };
    // The start, the search, and a query in each loop.
    assert_eq!(loops(40).unwrap().stages.len(), 42);
    assert_eq!(loops(1000).unwrap().stages.len(), 1002);
}

#[test]
fn nothing_to_wait_for_is_one_stage() {
    let stages = stages("%x: f32 = load member:m@0 return state:rt_HitDistance@0 = %x");
    assert_eq!((stages.stages.len(), stages.slots.len()), (1, 0));
}
