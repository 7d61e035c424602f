//! Every built-in function and every operator, with operands that vary from ray to ray, that are the
//! same for all rays, and that are constant, at every width against the oracle.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::common::Agreement;
use rtsl::OptLevel;
use rtsl_spec::Direction;
use rtsl_spec::builtins::{self, Chapter, Overload, Scalar, SpecType, Usable};

/// The source of an operand.
#[derive(Clone, Copy, PartialEq)]
enum Operand {
    Varying,
    Uniform,
    Constant,
}

const OPERANDS: [Operand; 3] = [Operand::Varying, Operand::Uniform, Operand::Constant];

/// The text of a class that tries an expression with all kinds of operands.
struct Text {
    members: String,
    body: String,
    results: usize,
}

impl Text {
    fn new(types: &[SpecType]) -> Text {
        let mut members = String::new();
        for (index, ty) in types.iter().enumerate() {
            let _ = writeln!(members, "public {ty} u{index};\nscratch {ty} v{index};");
        }
        Text { members, body: String::new(), results: 0 }
    }

    /// A new result of this type.
    fn result(&mut self, ty: SpecType) -> String {
        let name = format!("r{}", self.results);
        self.results += 1;
        let _ = writeln!(self.members, "scratch {ty} {name};");
        name
    }

    fn class(&self) -> String {
        format!("class T : rt_Texture;\n{}void lookup() {{\n{}}}\n", self.members, self.body)
    }
}

/// Ways to choose the kinds of `count` operands, about as many as `most`; all varying, all uniform and all
/// constant among them.
fn choices(count: usize, most: usize) -> Vec<Vec<Operand>> {
    let total = 3usize.pow(count as u32);
    let mut chosen: BTreeSet<usize> = (0..total).step_by(total.div_ceil(most)).collect();
    chosen.extend([0, (total - 1) / 2, total - 1]);
    let kinds = |choice: usize| {
        let digit = |variable: u32| OPERANDS[choice / 3usize.pow(variable) % 3];
        (0..count as u32).map(digit).collect()
    };
    chosen.into_iter().map(kinds).collect()
}

fn operand(kind: Operand, ty: SpecType, index: usize, salt: usize) -> String {
    match kind {
        Operand::Varying => format!("v{index}"),
        Operand::Uniform => format!("u{index}"),
        Operand::Constant => constant(ty, index + salt),
    }
}

/// Constants of a type, some of them extreme.
fn constant(ty: SpecType, salt: usize) -> String {
    let scalar = |scalar: Scalar, salt: usize| {
        let choices: [&str; 7] = match scalar {
            Scalar::Bool => ["true", "false", "true", "false", "true", "true", "false"],
            Scalar::Int => ["3", "-1", "0", "31", "-2147483647 - 1", "7", "65537"],
            Scalar::Uint => ["3u", "1u", "0u", "31u", "4294967295u", "7u", "65537u"],
            Scalar::Float => ["0.75", "-2.5", "0.0", "1e-40", "3.4e38", "-0.0", "1.0"],
        };
        choices[salt % choices.len()]
    };
    let list = |count: u8, of: Scalar| {
        let values: Vec<&str> = (0..count as usize).map(|each| scalar(of, salt + each)).collect();
        values.join(", ")
    };
    match ty {
        SpecType::Bool => scalar(Scalar::Bool, salt).to_string(),
        SpecType::Int => format!("({})", scalar(Scalar::Int, salt)),
        SpecType::Uint => scalar(Scalar::Uint, salt).to_string(),
        SpecType::Float => format!("({})", scalar(Scalar::Float, salt)),
        SpecType::Vec(of, count) => format!("{ty}({})", list(count, of)),
        SpecType::Mat(columns, rows) => format!("{ty}({})", list(columns * rows, Scalar::Float)),
        SpecType::Color => format!("color({})", list(3, Scalar::Float)),
        SpecType::Void | SpecType::Struct(_) | SpecType::Reference => {
            unreachable!("no operand has type {ty}")
        }
    }
}

/// The number of combinations of operands to test: sizes of vectors behave alike, and noise takes long.
fn most_choices(overload: &Overload) -> usize {
    let long = matches!(overload.builtin.chapter, Chapter::Noise | Chapter::Sampling);
    let alike = overload
        .parameters
        .iter()
        .any(|parameter| matches!(parameter.ty, SpecType::Vec(_, 2 | 4) | SpecType::Mat(..)));
    if long || alike { 3 } else { 9 }
}

fn builtin_text(overload: &Overload) -> String {
    let types: Vec<SpecType> = overload.parameters.iter().map(|parameter| parameter.ty).collect();
    let inputs = overload.parameters.iter().filter(|each| each.direction == Direction::In).count();
    let mut text = Text::new(&types);
    for (salt, choice) in choices(inputs, most_choices(overload)).into_iter().enumerate() {
        let mut kinds = choice.into_iter();
        let mut arguments = Vec::new();
        for (index, parameter) in overload.parameters.iter().enumerate() {
            arguments.push(match parameter.direction {
                Direction::In => {
                    operand(kinds.next().expect("one an input"), parameter.ty, index, salt)
                }
                Direction::Out => text.result(parameter.ty),
                Direction::InOut => format!("v{index}"),
            });
        }
        let call = format!("{}({})", overload.builtin.name, arguments.join(", "));
        if overload.result == SpecType::Void {
            let _ = writeln!(text.body, "    {call};");
        } else {
            let result = text.result(overload.result);
            let _ = writeln!(text.body, "    {result} = {call};");
        }
    }
    text.class()
}

/// All functions of these chapters.
fn check_chapters(chapters: &[Chapter]) {
    let agreement = Agreement::new(OptLevel::O1);
    let mut checked = 0;
    for builtin in builtins::all() {
        let callable = matches!(builtin.usable, Usable::Anywhere)
            || matches!(builtin.usable, Usable::Methods(methods) if methods.contains(&rtsl::Method::Lookup));
        if !callable || !chapters.contains(&builtin.chapter) {
            continue;
        }
        for (index, overload) in builtins::overloads(builtin.name).iter().enumerate() {
            if overload.parameters.iter().any(|each| each.ty == SpecType::Reference) {
                continue;
            }
            let name = format!("{} #{index}", builtin.name);
            agreement.check(&name, &builtin_text(overload), index as u64 + 1);
            checked += 1;
        }
    }
    assert!(checked > 0, "no function in {chapters:?}");
}

#[test]
fn trigonometry() {
    check_chapters(&[Chapter::Trigonometry]);
}

#[test]
fn exponentials() {
    check_chapters(&[Chapter::Exponential]);
}

#[test]
fn common_functions() {
    check_chapters(&[Chapter::Common, Chapter::Packing]);
}

#[test]
fn geometry_and_matrices() {
    check_chapters(&[Chapter::Geometric, Chapter::Matrix]);
}

#[test]
fn comparisons_and_integers() {
    check_chapters(&[Chapter::Relational, Chapter::Integer]);
}

#[test]
fn colors_rays_noise_and_sampling() {
    check_chapters(&[
        Chapter::Color,
        Chapter::RayTracing,
        Chapter::Noise,
        Chapter::Sampling,
        Chapter::Scattering,
    ]);
}

/// Tries `left operator right` with all kinds of operands.
fn binary(
    agreement: &Agreement,
    operator: &str,
    left: SpecType,
    right: SpecType,
    result: SpecType,
) {
    let mut text = Text::new(&[left, right]);
    for (salt, kinds) in choices(2, 9).into_iter().enumerate() {
        let a = operand(kinds[0], left, 0, salt);
        let b = operand(kinds[1], right, 1, salt + 2);
        let name = text.result(result);
        let _ = writeln!(text.body, "    {name} = {a} {operator} {b};");
        if left == result
            && !matches!(operator, "<" | "<=" | ">" | ">=" | "==" | "!=" | "&&" | "||" | "^^")
        {
            let name = text.result(result);
            let _ = writeln!(text.body, "    {name} = {a}; {name} {operator}= {b};");
        }
    }
    agreement.check(&format!("{left} {operator} {right}"), &text.class(), 11);
}

const NUMBERS: [Scalar; 3] = [Scalar::Int, Scalar::Uint, Scalar::Float];

#[test]
fn arithmetic() {
    let agreement = Agreement::new(OptLevel::O1);
    for scalar in NUMBERS {
        for size in [1, 3] {
            let vector = SpecType::scalar_or_vector(scalar, size);
            let one = scalar.as_type();
            let operators: &[&str] = match scalar {
                Scalar::Float => &["+", "-", "*", "/"],
                _ => &["+", "-", "*", "/", "%", "&", "|", "^", "<<", ">>"],
            };
            for operator in operators {
                binary(&agreement, operator, vector, vector, vector);
                if size > 1 {
                    binary(&agreement, operator, vector, one, vector);
                    if !matches!(*operator, "<<" | ">>") {
                        binary(&agreement, operator, one, vector, vector);
                    }
                }
            }
        }
    }
    for operator in ["+", "-", "*", "/"] {
        binary(&agreement, operator, SpecType::Color, SpecType::Color, SpecType::Color);
        binary(&agreement, operator, SpecType::Color, SpecType::Float, SpecType::Color);
        binary(&agreement, operator, SpecType::Float, SpecType::Color, SpecType::Color);
    }
}

#[test]
fn comparisons() {
    let agreement = Agreement::new(OptLevel::O1);
    for ty in NUMBERS.map(Scalar::as_type) {
        for operator in ["<", "<=", ">", ">=", "==", "!="] {
            binary(&agreement, operator, ty, ty, SpecType::Bool);
        }
    }
    let vectors = [Scalar::Bool, Scalar::Int, Scalar::Float].map(|each| SpecType::Vec(each, 3));
    for ty in vectors.into_iter().chain([SpecType::Bool, SpecType::Color, SpecType::Mat(2, 3)]) {
        binary(&agreement, "==", ty, ty, SpecType::Bool);
        binary(&agreement, "!=", ty, ty, SpecType::Bool);
    }
    for operator in ["&&", "||", "^^"] {
        binary(&agreement, operator, SpecType::Bool, SpecType::Bool, SpecType::Bool);
    }
}

/// The numbers of columns and rows of all matrices.
fn matrix_sizes() -> impl Iterator<Item = (u8, u8)> {
    (2..=4).flat_map(|columns| (2..=4).map(move |rows| (columns, rows)))
}

#[test]
fn matrices_element_by_element() {
    let agreement = Agreement::new(OptLevel::O1);
    for (columns, rows) in matrix_sizes() {
        let matrix = SpecType::Mat(columns, rows);
        for operator in ["+", "-", "/"] {
            binary(&agreement, operator, matrix, matrix, matrix);
            binary(&agreement, operator, matrix, SpecType::Float, matrix);
            binary(&agreement, operator, SpecType::Float, matrix, matrix);
        }
    }
}

#[test]
fn products_of_matrices() {
    let agreement = Agreement::new(OptLevel::O1);
    for (columns, rows) in matrix_sizes() {
        let matrix = SpecType::Mat(columns, rows);
        let across = SpecType::Vec(Scalar::Float, columns);
        let down = SpecType::Vec(Scalar::Float, rows);
        binary(&agreement, "*", matrix, across, down);
        binary(&agreement, "*", down, matrix, across);
        for other in 2..=4 {
            let right = SpecType::Mat(other, columns);
            binary(&agreement, "*", matrix, right, SpecType::Mat(other, rows));
        }
    }
}

#[test]
fn conversions_and_unary_operators() {
    let agreement = Agreement::new(OptLevel::O1);
    let scalars = [Scalar::Bool, Scalar::Int, Scalar::Uint, Scalar::Float];
    for from in scalars {
        for size in [1u8, 3] {
            let source = SpecType::scalar_or_vector(from, size);
            let mut text = Text::new(&[source]);
            for (salt, kind) in OPERANDS.into_iter().enumerate() {
                let value = operand(kind, source, 0, salt);
                for to in scalars {
                    let target = SpecType::scalar_or_vector(to, size);
                    let name = text.result(target);
                    let _ = writeln!(text.body, "    {name} = {target}({value});");
                }
                let operators: &[&str] = match from {
                    Scalar::Bool if size == 1 => &["!"],
                    Scalar::Bool => &[],
                    Scalar::Float => &["-", "+"],
                    Scalar::Int | Scalar::Uint => &["-", "+", "~"],
                };
                for operator in operators {
                    let name = text.result(source);
                    let _ = writeln!(text.body, "    {name} = {operator}{value};");
                }
                if from != Scalar::Bool {
                    for step in ["++", "--"] {
                        let (before, after) = (text.result(source), text.result(source));
                        let _ = writeln!(text.body, "    {after} = {value};");
                        let _ =
                            writeln!(text.body, "    {before} = {step}{after} + {after}{step};");
                    }
                }
            }
            agreement.check(&format!("conversions of {source}"), &text.class(), 5);
        }
    }
}

/// Elements of vectors, matrices and arrays at indices of every kind, some out of range.
#[test]
fn indices() {
    let agreement = Agreement::new(OptLevel::O1);
    let mut text = Text::new(&[
        SpecType::Int,
        SpecType::Uint,
        SpecType::Vec(Scalar::Float, 4),
        SpecType::Mat(3, 3),
    ]);
    text.members
        .push_str("public float table[7];\npublic vec2 grid[3][2];\nscratch float own[5];\n");
    for index in ["v0", "u0", "v1", "u1", "1", "v0 % 3", "int(v1 & 7u)"] {
        for (value, ty) in [
            (format!("v2[{index}]"), SpecType::Float),
            (format!("u2[{index}]"), SpecType::Float),
            (format!("v3[{index}]"), SpecType::Vec(Scalar::Float, 3)),
            (format!("u3[{index}][v0]"), SpecType::Float),
            (format!("table[{index}]"), SpecType::Float),
            (format!("grid[{index}][v1].y"), SpecType::Float),
            (format!("own[{index}]"), SpecType::Float),
        ] {
            let name = text.result(ty);
            let _ = writeln!(text.body, "    {name} = {value};");
        }
        let _ = writeln!(
            text.body,
            "    own[{index}] = v2[1]; v2[{index}] += 1.0; v3[{index}].zx = v2.xy;"
        );
    }
    for seed in 0..8 {
        agreement.check("indices", &text.class(), seed);
    }
}
