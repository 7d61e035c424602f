//! Mixtures of surfaces that are materials of the library: a class that refers to them.
//!
//! A mixture of two derives from the library's `Mix`. Mixtures of mixtures become one class, so that the methods of
//! each surface are called once.

use std::fmt::Write;

use crate::class::{self, Header};
use crate::document::Fault;
use crate::graph::Graph;
use crate::shader::{Kind, Shader};
use crate::special::At;
use crate::statements::Value;
use crate::surface::Setting;
use crate::translation::Part;
use crate::types::Type;

/// The class of the library.
pub const CLASS: &str = "Mix";

/// The surfaces of a mixture, with the members that refer to them.
pub fn parts(shader: &Shader) -> Vec<(String, &Shader)> {
    if let Some((front, back)) = pair(shader) {
        let back = back.map(|part| ("first".to_owned(), part));
        return back.into_iter().chain(front.map(|part| ("second".to_owned(), part))).collect();
    }
    let mut leaves = Vec::new();
    add_leaves(shader, &mut leaves);
    (1..).zip(leaves).map(|(index, leaf)| (member(index), leaf)).collect()
}

fn member(index: usize) -> String {
    format!("part{index}")
}

/// The surfaces of a mixture without mixtures in it: where the amount is 1, and where it is 0.
fn pair(shader: &Shader) -> Option<(Option<&Shader>, Option<&Shader>)> {
    let Kind::Mix(front, back) = &shader.kind else { return None };
    let is_simple =
        |part: &Option<Box<Shader>>| part.as_ref().is_none_or(|it| !is_mixture(it.as_ref()));
    (is_simple(front) && is_simple(back)).then_some((front.as_deref(), back.as_deref()))
}

fn is_mixture(shader: &Shader) -> bool {
    matches!(shader.kind, Kind::Mix(_, _))
}

fn add_leaves<'s>(shader: &'s Shader, leaves: &mut Vec<&'s Shader>) {
    match &shader.kind {
        Kind::Mix(front, back) => {
            [back, front].into_iter().flatten().for_each(|part| add_leaves(part, leaves));
        }
        _ => leaves.push(shader),
    }
}

/// Returns the text of the class of a mixture.
///
/// # Errors
/// If an amount cannot be computed.
pub fn class(
    graph: &mut Graph<'_>,
    header: &Header<'_>,
    shader: &Shader,
    parts: &[Part],
) -> Result<String, Fault> {
    let classes = parts.iter().map(|it| format!("`{}` is a `{}`", it.member, it.material.class));
    let classes: Vec<String> = classes.collect();
    let more = format!("\n///\n/// In it, {}.", classes.join(", "));
    match pair(shader) {
        Some(_) => {
            let amount = amount(graph, shader)?;
            let mut text = header.text(CLASS, &more);
            class::write_members(graph, &mut text);
            class::write_settings(graph, &[Setting::of_float("amount", &amount)], &mut text);
            Ok(text)
        }
        None => of_several(graph, header.text("rt_Material", &more), shader, parts),
    }
}

fn amount(graph: &mut Graph<'_>, shader: &Shader) -> Result<Value, Fault> {
    if let Kind::Mix(front, back) = &shader.kind {
        for (name, part) in [("fg", front), ("bg", back)] {
            if part.is_none() {
                let message = format!("the input `{name}` of a mixture is not connected: black");
                graph.warn(message, shader.node);
            }
        }
    }
    At { graph, scope: shader.scope, node: shader.node }.input("mix", Type::Float, 0.0)
}

/// A part, by the factors of its weight.
type Weight = Vec<String>;

/// The weights of parts, and the parameters that they are made of.
#[derive(Default)]
struct Weights {
    amounts: Vec<Setting>,
    parts: Vec<Weight>,
}

impl Weights {
    fn add(
        &mut self,
        graph: &mut Graph<'_>,
        shader: &Shader,
        factors: &Weight,
    ) -> Result<(), Fault> {
        let Kind::Mix(front, back) = &shader.kind else {
            self.parts.push(factors.clone());
            return Ok(());
        };
        let value = amount(graph, shader)?;
        let name = format!("amount{}", self.amounts.len() + 1);
        self.amounts.push(Setting::of_float(&name, &value));
        let call = if value.constant.is_some() { "" } else { "()" };
        let share = format!("clamp({name}{call}, 0.0, 1.0)");
        for (part, share) in [(back, format!("(1.0 - {share})")), (front, share)] {
            if let Some(part) = part {
                let factors: Weight = factors.iter().cloned().chain([share]).collect();
                self.add(graph, part, &factors)?;
            }
        }
        Ok(())
    }
}

fn of_several(
    graph: &mut Graph<'_>,
    header: String,
    shader: &Shader,
    parts: &[Part],
) -> Result<String, Fault> {
    let mut weights = Weights::default();
    weights.add(graph, shader, &Weight::new())?;
    let members: Vec<&str> = parts.iter().map(|part| part.member.as_str()).collect();
    let mut text = header;
    for member in &members {
        line(&mut text, format_args!("public rt_Material {member};"));
    }
    class::write_members(graph, &mut text);
    class::write_settings(graph, &weights.amounts, &mut text);
    for (member, factors) in members.iter().zip(&weights.parts) {
        let product = factors.join(" * ");
        line(&mut text, format_args!("\nfloat {member}Weight() {{ return {product}; }}"));
    }
    // Without a part that is not connected, the weights sum to 1.
    let is_whole = members.len() == weights.amounts.len() + 1;
    // Methods of parts that are there everywhere are not called for that: mixtures are near the limits on linked code.
    let has_holes = parts.iter().any(|part| part.material.has_holes);
    if has_holes {
        write_presence(&members, &mut text);
    }
    let share = if has_holes { "Share" } else { "Weight" };
    write_methods(&members, share, is_whole, &mut text);
    Ok(text)
}

/// Writes what part of the mixture there is, and how much each part counts at hits.
fn write_presence(members: &[&str], text: &mut String) {
    let present: Vec<String> = members.iter().map(|it| format!("{it}.presence() == 1.0")).collect();
    let missing: Vec<String> =
        members.iter().map(|it| format!("{it}Weight() * (1.0 - {it}.presence())")).collect();
    line(text, format_args!("\nfloat whole() {{\n    if ({}) return 1.0;", present.join(" && ")));
    line(text, format_args!("    return 1.0 - {};\n}}", missing.join("\n        - ")));
    text.push_str("\nvoid presence() { rt_Presence = clamp(whole(), 0.0, 1.0); }\n");
    for member in members {
        line(
            text,
            format_args!(
                "\nfloat {member}Share() {{\n    float all = whole();\n    return all > 0.0 ? {member}Weight() * {member}.presence() / all : {member}Weight();\n}}"
            ),
        );
    }
}

fn write_methods(members: &[&str], share: &str, is_whole: bool, text: &mut String) {
    for (method, result) in
        [("BSDF", "rt_BSDFValue"), ("emission", "rt_EmissionColor"), ("evaluatePDF", "rt_PDF")]
    {
        let terms = members.iter().map(|it| format!("{it}.{method}() * {it}{share}()"));
        let sum = terms.collect::<Vec<_>>().join("\n        + ");
        line(text, format_args!("\nvoid {method}() {{\n    {result} = {sum};\n}}"));
    }
    text.push_str(
        "\n// One part chooses the direction. A delta's weight then stands as it is.\n\
         void sampleBSDF() {\n    float choice = rand();\n    color value;\n",
    );
    let mut end = String::new();
    for (index, member) in members.iter().enumerate() {
        end.push_str(&format!("{}{member}{share}()", if index == 0 { "" } else { " + " }));
        let before = if index == 0 { "    " } else { " else " };
        let is_rest = is_whole && index + 1 == members.len();
        let condition = if is_rest { String::new() } else { format!("if (choice < {end}) ") };
        text.push_str(&format!(
            "{before}{condition}{{\n        value = {member}.sampleBSDF();\n    }}"
        ));
    }
    text.push_str(
        "\n    if (rt_PDF > 0.0) {\n        BSDF();\n        evaluatePDF();\n    } else {\n        \
         rt_BSDFValue = value;\n    }\n}\n",
    );
}

fn line(out: &mut String, text: std::fmt::Arguments<'_>) {
    writeln!(out, "{text}").expect("strings take all text");
}
