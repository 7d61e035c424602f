//! The texts of classes: header, members and functions.

use crate::graph::Graph;
use crate::statements::Value;
use crate::surface::{self, Setting, Surface};
use crate::translation::ImageUse;

/// The start of a class.
pub struct Header<'a> {
    /// The name of the document in comments.
    pub title: &'a str,
    /// The name of the material in the document.
    pub name: &'a str,
    /// The name of the class.
    pub class: &'a str,
}

impl Header<'_> {
    /// The text, with the class that this one derives from, and lines that follow the first of its documentation.
    pub fn text(&self, base: &str, more: &str) -> String {
        format!(
            "/// `{}` of `{}`, translated from MaterialX.{more}\nclass {} : {base};\n\n",
            self.name.replace('`', "'"),
            self.title.replace('`', "'"),
            self.class
        )
    }
}

/// Returns the text of a class that derives from a material of the library.
pub fn of_surface(
    graph: &Graph<'_>,
    header: &Header<'_>,
    surface: &Surface,
    settings: &[Setting],
) -> String {
    let mut text = header.text(surface.class, "");
    write_members(graph, &mut text);
    write_settings(graph, settings, &mut text);
    if settings.iter().any(|setting| setting.name == surface::NORMAL) {
        text.push_str(WITH_NORMAL);
    }
    text
}

/// The renderer weighs light by the cosine with the surface's own normal.
const WITH_NORMAL: &str = "
float cosineRatio(mat3 frame) { return mxPlacement.cosineRatio(rt_LightDirection, rt_ShadingNormal, frame[2]); }
";

/// Returns the text of a texture with this value.
pub fn of_texture(graph: &Graph<'_>, class: &str, value: &Value) -> String {
    let mut text = format!("class {class} : rt_Texture;\n\n");
    write_members(graph, &mut text);
    text.push_str("void lookup() {\n");
    graph.statements.write(&value.text, &mut text);
    let result = &value.text;
    text.push_str(&match value.ty.count() {
        1 => format!("    rt_FloatTextureValue = float({result});\n"),
        2 => format!("    rt_TextureColor = color({result}.x, {result}.y, 0.0);\n"),
        3 => format!("    rt_TextureColor = color({result});\n"),
        _ => format!(
            "    rt_TextureColor = color({result}.xyz);\n    rt_FloatTextureValue = {result}.w;\n"
        ),
    });
    text.push_str("}\n");
    text
}

/// Writes initial values of parameters, and functions that compute them.
pub fn write_settings(graph: &Graph<'_>, settings: &[Setting], text: &mut String) {
    let (initial, computed): (Vec<_>, Vec<_>) = settings.iter().partition(|it| it.is_constant);
    for Setting { name, ty, value, .. } in initial {
        // Switches have no textures.
        let texture = if *ty == "bool" { "" } else { "texture " };
        text.push_str(&format!("public {texture}{ty} {name} = {value};\n"));
    }
    for Setting { name, ty, value, .. } in computed {
        write_function(graph, &format!("{ty} {name}()"), value, text);
    }
}

/// Writes a function that returns an expression.
pub fn write_function(graph: &Graph<'_>, header: &str, result: &str, text: &mut String) {
    if !text.ends_with("\n\n") {
        text.push('\n');
    }
    text.push_str(&format!("{header} {{\n"));
    graph.statements.write(result, text);
    text.push_str(&format!("    return {result};\n}}\n"));
}

/// Writes the method that says how much of the surface there is.
pub fn write_presence(graph: &Graph<'_>, opacity: &str, text: &mut String) {
    text.push_str("\nvoid presence() {\n");
    graph.statements.write(opacity, text);
    text.push_str(&format!("    rt_Presence = clamp({opacity}, 0.0, 1.0);\n}}\n"));
}

/// Writes the members that are not parameters of the base.
pub fn write_members(graph: &Graph<'_>, text: &mut String) {
    for image in &graph.images {
        write_image(image, text);
    }
    for declaration in graph.attributes.values() {
        text.push_str(declaration);
        text.push('\n');
    }
}

fn write_image(image: &ImageUse, text: &mut String) {
    let ImageUse { member, file, .. } = image;
    let file = file.replace(['"', '\\', '\n', '\r'], "'");
    let space = if image.is_srgb { "sRGB" } else { "linear" };
    let what = if image.tiles.is_some() { "images" } else { "image" };
    text.push_str(&format!(
        "[[doc \"The {what} `{file}`, {space}.\"]]\npublic rt_Texture {member};\n"
    ));
    if image.has_opacity {
        text.push_str(&format!(
            "[[doc \"Whether it has opacity.\"]]\npublic bool {member}HasOpacity = true;\n"
        ));
    }
}
