//! Files that are no scenes, and what shows them.

use std::path::Path;

use rtsl::library::declared_classes;
use rtsl::{Diagnostic, Role, diagnostic_codes as codes};
use rtsl_memory::InputBudget;

use crate::reader::{FileSource, Input};

/// The error of a file that is a shader, by its name, and not a scene.
pub fn shader_instead_of_scene(
    path: &Path,
    files: &dyn FileSource,
    budget: &InputBudget,
) -> Option<Diagnostic> {
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("rtsl")) {
        return None;
    }
    let input = Input::read(files, path, budget).ok()?;
    let text = String::from_utf8_lossy(&input.bytes);
    let message = format!("`{}` is a shader, not a scene", path.display());
    let diagnostic = Diagnostic::new(codes::SCENE_SYNTAX, message);
    let class = declared_classes(&text).next();
    Some(match class.and_then(|class| Some((class, role(&text, class)?))) {
        Some((class, Role::Integrator)) => diagnostic.help(format!(
            "name it for a scene beside it: `rtsl render SCENE --integrator {class}`"
        )),
        Some((class, role)) => diagnostic
            .help(format!("name `{class}` in a scene beside it, such as `{}`", scene(class, role)))
            .help("the extension for VS Code shows previews of classes"),
        None => diagnostic.help("scenes name the classes of shaders"),
    })
}

/// The role that the text of a class names first.
fn role(text: &str, class: &str) -> Option<Role> {
    let declaration = text.split_once(&format!("class {class}"))?.1;
    let header = declaration.split([';', '{']).next()?;
    let roles = Role::ALL.into_iter().filter_map(|role| Some((header.find(role.class())?, role)));
    roles.min_by_key(|(place, _)| *place).map(|(_, role)| role)
}

/// A scene that shows a class.
fn scene(class: &str, role: Role) -> String {
    let (camera, lamp) = ("Camera \"perspective\"", "LightSource \"infinite\"");
    let ball = "Translate 0 0 3 Shape \"sphere\"";
    match role {
        Role::Camera => format!("Camera \"{class}\" WorldBegin {lamp} {ball}"),
        Role::Primitive => format!("{camera} WorldBegin {lamp} Translate 0 0 3 Shape \"{class}\""),
        Role::Texture => format!(
            "{camera} WorldBegin {lamp} Texture \"t\" \"spectrum\" \"{class}\" \
             Material \"diffuse\" \"texture reflectance\" \"t\" {ball}"
        ),
        Role::Light => format!("{camera} WorldBegin LightSource \"{class}\" {ball}"),
        Role::Material | Role::Integrator => {
            format!("{camera} WorldBegin {lamp} Material \"{class}\" {ball}")
        }
    }
}
