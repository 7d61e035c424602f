//! The text of a class of closures.

use std::fmt::Write;

use super::{Closure, Closures};
use crate::class::{self, Header};
use crate::graph::Graph;

/// A lobe with what is around it.
struct Placed {
    lobe: usize,
    /// The factors of the closures around it.
    scale: Vec<String>,
    /// The layers above it.
    covers: Vec<usize>,
}

/// Returns the text of a class of closures.
pub fn class(graph: &Graph<'_>, header: &Header<'_>, closures: &Closures) -> String {
    let mut placed = Vec::new();
    let mut covers = Vec::new();
    place(&closures.root, &mut Vec::new(), &mut Vec::new(), &mut placed, &mut covers);
    let mut out = header.text("rt_Material", "");
    class::write_members(graph, &mut out);
    write_structure(closures, &placed, &mut out);
    write_gather(graph, closures, &placed, &mut out);
    for (index, cover) in covers.iter().enumerate() {
        line(
            &mut out,
            format_args!("\nvec3 passed{index}(Lobes it, vec3 d) {{ return {}; }}", passed(cover)),
        );
    }
    write_values(closures, &placed, &mut out);
    if let Some(opacity) = &closures.opacity {
        class::write_presence(graph, opacity, &mut out);
    }
    write_methods(&placed, &mut out);
    write_emission(graph, closures, &mut out);
    out
}

fn line(out: &mut String, text: std::fmt::Arguments<'_>) {
    writeln!(out, "{text}").expect("strings take all text");
}

/// Lists the lobes of a closure, with the factors and the layers around them.
fn place(
    closure: &Closure,
    scale: &mut Vec<String>,
    above: &mut Vec<usize>,
    placed: &mut Vec<Placed>,
    covers: &mut Vec<Closure>,
) {
    match closure {
        Closure::Nothing => {}
        Closure::Lobe(lobe) => {
            placed.push(Placed { lobe: *lobe, scale: scale.clone(), covers: above.clone() });
        }
        Closure::Layer(top, base) => {
            place(top, scale, above, placed, covers);
            covers.push((**top).clone());
            above.push(covers.len() - 1);
            place(base, scale, above, placed, covers);
            above.pop();
        }
        Closure::Mix(front, back, amount) => {
            for (part, factor) in [
                (front, format!("it.amount{amount}")),
                (back, format!("(1.0 - it.amount{amount})")),
            ] {
                scale.push(factor);
                place(part, scale, above, placed, covers);
                scale.pop();
            }
        }
        Closure::Sum(first, second) => {
            place(first, scale, above, placed, covers);
            place(second, scale, above, placed, covers);
        }
        Closure::Scaled(of, factor) => {
            scale.push(factor.clone());
            place(of, scale, above, placed, covers);
            scale.pop();
        }
    }
}

/// The part of light from the direction `d` that a closure lets through.
fn passed(closure: &Closure) -> String {
    match closure {
        Closure::Nothing => "vec3(1.0)".to_owned(),
        Closure::Lobe(lobe) => format!("mxClosures.passed(it.lobe{lobe}, d)"),
        Closure::Layer(top, base) => format!("({} * {})", passed(top), passed(base)),
        Closure::Mix(front, back, amount) => {
            format!("mix({}, {}, it.amount{amount})", passed(back), passed(front))
        }
        Closure::Sum(first, second) => {
            format!("max({} + {} - 1.0, vec3(0.0))", passed(first), passed(second))
        }
        Closure::Scaled(of, _) => passed(of),
    }
}

fn write_structure(closures: &Closures, placed: &[Placed], out: &mut String) {
    line(out, format_args!("struct Lobes {{"));
    for Placed { lobe, .. } in placed {
        line(out, format_args!("    mxClosures.Lobe lobe{lobe};"));
    }
    for index in 0..closures.amounts.len() {
        line(out, format_args!("    vec3 amount{index};"));
    }
    if placed.is_empty() && closures.amounts.is_empty() {
        line(out, format_args!("    vec3 none;"));
    }
    line(out, format_args!("}};"));
}

fn write_gather(graph: &Graph<'_>, closures: &Closures, placed: &[Placed], out: &mut String) {
    let factors = placed.iter().flat_map(|it| &it.scale).map(String::as_str);
    let lobes = placed.iter().map(|it| closures.lobes[it.lobe].expression.as_str());
    let amounts = closures.amounts.iter().map(String::as_str);
    let all: Vec<&str> = factors.chain(lobes).chain(amounts).collect();
    line(out, format_args!("\nLobes gather() {{"));
    graph.statements.write(&all.join(" "), out);
    line(out, format_args!("    Lobes it;"));
    for (index, amount) in closures.amounts.iter().enumerate() {
        line(out, format_args!("    it.amount{index} = {amount};"));
    }
    for Placed { lobe, scale, .. } in placed {
        let scale = if scale.is_empty() { "vec3(1.0)".to_owned() } else { scale.join(" * ") };
        let expression = &closures.lobes[*lobe].expression;
        line(
            out,
            format_args!(
                "    it.lobe{lobe} = mxClosures.scaled({expression},\n        {scale}, rt_Regularization);"
            ),
        );
    }
    line(out, format_args!("    return it;\n}}"));
}

fn write_values(closures: &Closures, placed: &[Placed], out: &mut String) {
    let mut terms = Vec::new();
    for Placed { lobe, covers, .. } in placed {
        let mut term = format!("mxClosures.value(it.lobe{lobe}, light)");
        for cover in covers {
            term.push_str(&format!(" * min(passed{cover}(it, view), passed{cover}(it, light))"));
        }
        if closures.lobes[*lobe].is_turned {
            term.push_str(&format!(
                " * mxClosures.cosineRatio(it.lobe{lobe}, light, rt_ShadingNormal)"
            ));
        }
        terms.push(term);
    }
    let sum = if terms.is_empty() { "vec3(0.0)".to_owned() } else { terms.join("\n        + ") };
    let has_covers = placed.iter().any(|it| !it.covers.is_empty());
    let view = if has_covers { "    vec3 view = -normalize(rt_RayDirection);\n" } else { "" };
    line(out, format_args!("\nvec3 valueOf(Lobes it, vec3 light) {{\n{view}    return {sum};\n}}"));
    for Placed { lobe, covers, .. } in placed {
        let mut share = format!("mxClosures.share(it.lobe{lobe})");
        for cover in covers {
            share.push_str(&format!(
                " * dot(passed{cover}(it, -normalize(rt_RayDirection)), vec3(1.0 / 3.0))"
            ));
        }
        line(out, format_args!("\nfloat share{lobe}(Lobes it) {{ return {share}; }}"));
    }
    let shares: Vec<String> = placed.iter().map(|it| format!("share{}(it)", it.lobe)).collect();
    let densities: Vec<String> = placed
        .iter()
        .map(|it| format!("share{}(it) * mxClosures.density(it.lobe{}, light)", it.lobe, it.lobe))
        .collect();
    if !placed.is_empty() {
        line(
            out,
            format_args!(
                "\nfloat densityOf(Lobes it, vec3 light) {{\n    float sum = {};\n    return sum > 0.0 ? ({}) / sum : 0.0;\n}}",
                shares.join(" + "),
                densities.join("\n        + ")
            ),
        );
    }
}

fn write_methods(placed: &[Placed], out: &mut String) {
    out.push_str("\nvoid BSDF() { rt_BSDFValue = color(valueOf(gather(), rt_LightDirection)); }\n");
    let density = if placed.is_empty() { "0.0" } else { "densityOf(gather(), rt_LightDirection)" };
    line(out, format_args!("\nvoid evaluatePDF() {{ rt_PDF = {density}; }}"));
    line(out, format_args!("\nvoid sampleBSDF() {{"));
    line(out, format_args!("    float choice = rt_BSDFSeed.z;"));
    line(out, format_args!("    Lobes it = gather();"));
    let shares: Vec<String> = placed.iter().map(|it| format!("share{}(it)", it.lobe)).collect();
    let sum = if shares.is_empty() { "0.0".to_owned() } else { shares.join(" + ") };
    line(out, format_args!("    choice *= {};", parenthesized(&sum)));
    line(out, format_args!("    vec3 light = vec3(0.0);\n    float beyond = 1.0;"));
    let mut end = String::new();
    for (index, Placed { lobe, .. }) in placed.iter().enumerate() {
        let before = if index == 0 { "    " } else { " else " };
        end = if end.is_empty() {
            format!("share{lobe}(it)")
        } else {
            format!("{end} + share{lobe}(it)")
        };
        let condition = if index + 1 == placed.len() && index > 0 {
            String::new()
        } else {
            format!("if (choice < {end}) ")
        };
        out.push_str(&format!(
            "{before}{condition}{{\n        light = mxClosures.sampled(it.lobe{lobe}, rt_BSDFSeed.xy);\n        \
             beyond = mxClosures.indexBeyond(it.lobe{lobe});\n    }}"
        ));
    }
    out.push_str("\n    if (light == vec3(0.0)) return;\n    rt_LightDirection = light;\n");
    out.push_str("    if (beyond != 1.0) rt_RelativeIndex = beyond;\n");
    line(out, format_args!("    rt_BSDFValue = color(valueOf(it, light));"));
    let density = if placed.is_empty() { "0.0" } else { "densityOf(it, light)" };
    line(out, format_args!("    rt_PDF = {density};\n}}"));
}

fn parenthesized(sum: &str) -> String {
    if sum.contains('+') { format!("({sum})") } else { sum.to_owned() }
}

fn write_emission(graph: &Graph<'_>, closures: &Closures, out: &mut String) {
    let Some(emission) = &closures.emission else { return };
    line(out, format_args!("\nvoid emission() {{"));
    if !closures.is_sheet {
        line(out, format_args!("    if (dot(rt_RayDirection, rt_ShadingNormal) > 0.0) return;"));
    }
    graph.statements.write(emission, out);
    line(out, format_args!("    rt_EmissionColor = color({emission});\n}}"));
}
