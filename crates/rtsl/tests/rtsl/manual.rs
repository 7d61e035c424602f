//! Some reference pages of the book are printed from the tables that drive the compiler.
//!
//! `UPDATE_EXPECT=1 cargo test -p rtsl --test rtsl manual::` renews them; without it the test fails where a page
//! on disk differs.

use std::fmt::Write as _;
use std::path::Path;

use rtsl_spec::builtins::{self, AccuracyDomain, Chapter, SpecStruct};
use rtsl_spec::{Default, Method, Origin, RayType, Role, Row};

const NOTICE: &str = "<!-- Printed from the compiler's tables by `UPDATE_EXPECT=1 cargo test -p rtsl \
                      --test rtsl manual::`. Do not edit. -->\n";

#[test]
fn roles_are_current() {
    check("roles.md", &roles());
}

#[test]
fn builtins_are_current() {
    check("builtins.md", &builtin_functions());
}

#[test]
fn diagnostics_are_current() {
    check("diagnostics.md", &diagnostics());
}

fn check(page: &str, expected: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/reference").join(page);
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, expected).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == expected,
        "docs/src/reference/{page} is stale; run this test with UPDATE_EXPECT=1"
    );
}

fn roles() -> String {
    let mut page = format!("# Roles, methods and state variables\n\n{NOTICE}\n");
    page.push_str(
        "A method may use the state variables of the roles of its class. The column \"passes\" gives the direction:\n\
         \n\
         - `in`: the renderer sets the variable before the call.\n\
         - `out`: the method sets the variable, which holds its default until then.\n\
         - `inout`: both.\n\
         \n\
         If methods are named, the variable is a local variable with its default in all others. \u{2020} marks extensions of\n\
         the language of the paper of 2007.\n\n## Every role\n\n",
    );
    state_table(&mut page, rtsl_spec::rows().iter().filter(|row| row.role.is_none()));
    ray_types(&mut page);
    for role in Role::ALL {
        let _ = write!(page, "\n## `{}`\n\n| method | |\n|---|---|\n", role.class());
        page.push_str("| `constructor` | computes the private members of a new instance |\n");
        for method in role.methods() {
            let _ = writeln!(page, "| `{}` | {} |", method.name(), method.doc());
        }
        page.push('\n');
        state_table(&mut page, rtsl_spec::rows().iter().filter(|row| row.role == Some(role)));
    }
    page
}

fn ray_types(page: &mut String) {
    page.push_str("\n## Types of rays\n\nThe values of `rt_RayType`:\n\n");
    page.push_str("| constant | value | ray |\n|---|---|---|\n");
    for each in RayType::ALL {
        let _ = writeln!(page, "| `{}` | {} | {} |", each.name(), each.value(), each.doc());
    }
}

fn state_table<'a>(page: &mut String, rows: impl Iterator<Item = &'a Row>) {
    page.push_str(
        "| state variable | type | passes | default | meaning |\n|---|---|---|---|---|\n",
    );
    for row in rows.filter(|row| !row.name.contains("__")) {
        let mark = if row.origin == Origin::Extension { " \u{2020}" } else { "" };
        let _ = writeln!(
            page,
            "| `{}`{mark} | {} | {} | {} | {} |",
            row.name,
            row.ty.name(),
            passes(row),
            default(row.default),
            row.doc
        );
    }
}

fn passes(row: &Row) -> String {
    let methods = |methods: &[Method]| {
        let names: Vec<String> = methods.iter().map(|each| format!("`{}`", each.name())).collect();
        names.join(" ")
    };
    let mut ways: Vec<String> = row
        .access
        .iter()
        .map(|access| match access.methods {
            [] => access.direction.name().to_string(),
            named => format!("{} {}", access.direction.name(), methods(named)),
        })
        .collect();
    if row.illuminance {
        ways.push("in, inside `illuminance`".to_string());
    }
    ways.join("; ")
}

fn default(default: Default) -> String {
    let number = |value: f32| match value {
        value if value == f32::INFINITY => "+infinity".to_string(),
        value if value == f32::NEG_INFINITY => "-infinity".to_string(),
        value => format!("{value}"),
    };
    match default {
        Default::Constant(value) => number(value),
        Default::Components(values) => {
            format!(
                "({})",
                values.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", ")
            )
        }
        Default::Variable(name) => format!("`{name}`"),
        Default::Grey(name) => format!("`color({name})`"),
        Default::Luminance(name) => format!("`luminance({name})`"),
        Default::Tangent(_) => "a unit tangent of the normal".to_string(),
    }
}

fn builtin_functions() -> String {
    let mut page = format!("# Built-in functions\n\n{NOTICE}\n");
    page.push_str(
        "Signatures use the generic types of GLSL. `genF` is `float`, `vec2`, `vec3` or `vec4`, the same in the whole\n\
         signature. `genI`, `genU` and `genB` are the corresponding types of `int`, `uint` and `bool`. `vec`, `ivec`, `uvec`\n\
         and `bvec` exclude the scalar, and `mat` is any matrix. Parameters and variables may shadow every name.\n",
    );
    let mut chapter: Option<Chapter> = None;
    for builtin in builtins::all().filter(|each| each.chapter != Chapter::Intrinsic) {
        if chapter != Some(builtin.chapter) {
            chapter = Some(builtin.chapter);
            let _ = write!(page, "\n## {}\n", builtin.chapter.title());
        }
        let _ = write!(page, "\n### `{}`\n\n```text\n", builtin.name);
        for signature in builtin.signatures {
            let _ = writeln!(page, "{signature}");
        }
        let _ = write!(page, "```\n\n{}\n", wrapped(builtin.doc));
    }
    structs(&mut page);
    errors(&mut page);
    page
}

fn structs(page: &mut String) {
    page.push_str("\n## Structs\n");
    for each in SpecStruct::ALL {
        let _ = write!(page, "\n### `{}`\n\n{}\n\n", each.name(), each.doc());
        page.push_str("| field | type | meaning |\n|---|---|---|\n");
        for field in each.fields() {
            let _ = writeln!(page, "| `{}` | {} | {} |", field.name, field.ty, field.doc);
        }
        for method in builtins::methods_of(each) {
            let _ = write!(page, "\n#### `{}`\n\n```text\n", method.name);
            for signature in method.signatures {
                let _ = writeln!(page, "{}", with_receiver(signature));
            }
            let _ = write!(page, "```\n\n{}\n", wrapped(method.doc));
        }
    }
}

/// The signature of a method as it is called: `color BSDF(rt_Surface surface, vec3 direction)` becomes
/// `color surface.BSDF(vec3 direction)`.
fn with_receiver(signature: &str) -> String {
    let (head, parameters) = signature.split_once('(').expect("a signature has parameters");
    let (result, name) = head.split_once(' ').expect("a signature has a result");
    let end = parameters.find([',', ')']).expect("the first parameter is the struct");
    let receiver = parameters[..end].rsplit(' ').next().unwrap_or_default();
    let rest = parameters[end..].trim_start_matches([',', ' ']);
    format!("{result} {receiver}.{name}({rest}")
}

/// A paragraph in lines of at most 120 columns.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().expect("there is a line");
        if line.is_empty() {
            line.push_str(word);
        } else if line.len() + 1 + word.len() <= 120 {
            line.push(' ');
            line.push_str(word);
        } else {
            lines.push(word.to_owned());
        }
    }
    lines.join("\n")
}

fn errors(page: &mut String) {
    page.push_str(
        "\n## Errors\n\nErrors are in units in the last place of the exact result. The measured errors are the greatest\n\
         over all floats of the domain.\n\n\
         | function | error at most | domain | greatest measured error | at |\n|---|---|---|---|---|\n",
    );
    for accuracy in builtins::ACCURACY {
        let domain = match accuracy.domain {
            AccuracyDomain::Everywhere => "all arguments".to_string(),
            AccuracyDomain::UpTo(largest) => format!("\\|x\\| <= {largest}"),
            AccuracyDomain::Positive => "x > 0".to_string(),
        };
        let (ulp, at) = match accuracy.greatest {
            Some(greatest) => (format!("{:.2}", greatest.ulp), format!("{:?}", greatest.at)),
            None => (String::new(), String::new()),
        };
        let arguments = if accuracy.arguments == 1 { "x" } else { "y, x" };
        let arguments = if accuracy.name == "pow" { "x, y" } else { arguments };
        let (name, bound) = (accuracy.name, accuracy.bound);
        let _ = writeln!(page, "| `{name}({arguments})` | {bound} | {domain} | {ulp} | {at} |");
    }
}

fn diagnostics() -> String {
    let mut page = format!("# Diagnostics\n\n{NOTICE}\n");
    page.push_str(
        "`E` codes are errors, `W` codes are warnings. A code keeps its meaning in all versions. `rtsl explain CODE` prints\n\
         the same text.\n",
    );
    for info in rtsl_source::codes() {
        let _ = write!(page, "\n## {}: {}\n\n{}\n", info.code, info.title, info.explanation.trim());
    }
    page
}
