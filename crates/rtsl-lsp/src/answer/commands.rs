//! Commands: runs of the program that an editor orders.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use lsp_server::ErrorCode;
use lsp_types::{ExecuteCommandParams, Uri};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::Refusal;
use crate::look::LookKind;
use crate::place::path_of;
use crate::workspace::Workspace;

/// The commands of the server.
pub const COMMANDS: [&str; 3] = [LINE_COSTS, PIXEL, CLEAR];
/// The command for the costs of lines.
pub const LINE_COSTS: &str = "rtsl.lineCosts";
const PIXEL: &str = "rtsl.pixel";
const CLEAR: &str = "rtsl.clearLooks";

/// A command.
#[derive(Debug)]
pub enum Ordered {
    /// A run of the program.
    Run(Order),
    /// No look is shown any more.
    Clear,
}

/// A run of the program.
#[derive(Debug)]
pub struct Order {
    /// The kind of its look.
    pub kind: LookKind,
    /// The name of the run, for people.
    pub title: String,
    /// The arguments of the program.
    pub arguments: Vec<OsString>,
    /// The open texts, which are those on the disk.
    pub texts: BTreeMap<PathBuf, String>,
}

/// The argument of `rtsl.lineCosts`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CostsArgument {
    uri: Option<Uri>,
    scene: Option<String>,
    class: Option<String>,
    method: Option<String>,
}

/// The argument of `rtsl.pixel`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PixelArgument {
    scene: String,
    x: u32,
    y: u32,
    sample: Option<u32>,
}

/// The argument of `rtsl.clearLooks`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ClearArgument {}

/// Reads a command.
pub fn ordered(workspace: &Workspace, asked: ExecuteCommandParams) -> Result<Ordered, Refusal> {
    let argument = asked.arguments.into_iter().next().unwrap_or_else(|| json!({}));
    match asked.command.as_str() {
        LINE_COSTS => line_costs(workspace, read(argument)?).map(Ordered::Run),
        PIXEL => pixel(workspace, &read(argument)?).map(Ordered::Run),
        CLEAR => read::<ClearArgument>(argument).map(|_| Ordered::Clear),
        other => Err(invalid(format!("the server has no command `{other}`"))),
    }
}

fn line_costs(workspace: &Workspace, asked: CostsArgument) -> Result<Order, Refusal> {
    let shader = asked.uri.as_ref().map(|uri| path_of(uri).ok_or_else(|| unsaved(uri.as_str())));
    let shader = shader.transpose()?;
    let (path, words) = match (&asked.scene, shader) {
        (Some(scene), shader) => (scene_path(workspace, scene, shader.as_deref())?, Vec::new()),
        (None, Some(shader)) => {
            let method = asked.method.as_deref().map(identifier).transpose()?;
            let class = asked.class.as_deref().map(identifier).transpose()?;
            let mut words: Vec<String> = method.map(str::to_owned).into_iter().collect();
            words.extend(class.map(|class| format!("--class={class}")));
            (shader, words)
        }
        (None, None) => return Err(invalid("the command needs a `scene`, or a `uri`")),
    };
    let subject = match (&asked.scene, &asked.class, &asked.method) {
        (None, Some(class), Some(method)) => format!("{class}.{method}"),
        (None, Some(class), None) => class.clone(),
        _ => name_of(&path),
    };
    let words = words.into_iter().chain(["--lines".to_owned(), "--json".to_owned()]);
    order(workspace, LookKind::Costs, format!("Costs of lines: {subject}"), "bench", &path, words)
}

fn pixel(workspace: &Workspace, asked: &PixelArgument) -> Result<Order, Refusal> {
    let path = scene_path(workspace, &asked.scene, None)?;
    let PixelArgument { x, y, sample, .. } = asked;
    let words = [format!("--pixel={x},{y}"), "--trace=lines".to_owned(), "--json".to_owned()];
    let words = words.into_iter().chain(sample.map(|sample| format!("--sample={sample}")));
    let title = format!("Pixel {x},{y}: {}", name_of(&path));
    order(workspace, LookKind::Pixel, title, "render", &path, words)
}

/// The order of a run with these arguments for a file. The program reads files, so all texts must be saved.
fn order(
    workspace: &Workspace,
    kind: LookKind,
    title: String,
    command: &str,
    path: &Path,
    words: impl Iterator<Item = String>,
) -> Result<Order, Refusal> {
    let texts = workspace.saved_texts().map_err(|name| unsaved(&name))?;
    let mut arguments = vec![OsString::from(command), path.into()];
    arguments.extend(words.map(OsString::from));
    for folder in workspace.search_path(path) {
        arguments.extend([OsString::from("--include"), folder.into()]);
    }
    Ok(Order { kind, title, arguments, texts })
}

/// The path of a scene: absolute, a `file:` URI, or relative to a folder of the editor or to that of the shader.
fn scene_path(
    workspace: &Workspace,
    scene: &str,
    shader: Option<&Path>,
) -> Result<PathBuf, Refusal> {
    let of_uri = Uri::from_str(scene).ok().and_then(|uri| path_of(&uri));
    let named = of_uri.unwrap_or_else(|| PathBuf::from(scene));
    let beside = shader.and_then(Path::parent);
    let folders = workspace.folders.iter().map(PathBuf::as_path).chain(beside);
    // Joining an absolute path gives that.
    let mut candidates = folders.chain([Path::new("")]).map(|folder| folder.join(&named));
    let found = candidates.find(|path| path.is_absolute() && path.is_file());
    found.ok_or_else(|| invalid(format!("there is no scene `{scene}`")))
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A name of the language, which no option of the program is.
fn identifier(name: &str) -> Result<&str, Refusal> {
    let is_letter = |it: char| it == '_' || it.is_ascii_alphanumeric();
    let is_name = !name.is_empty() && name.chars().all(is_letter);
    is_name.then_some(name).ok_or_else(|| invalid(format!("`{name}` is no name")))
}

fn read<A: DeserializeOwned>(argument: Value) -> Result<A, Refusal> {
    let refusal = |error| invalid(format!("the command does not take its argument: {error}"));
    serde_json::from_value(argument).map_err(refusal)
}

fn invalid(message: impl Into<String>) -> Refusal {
    Refusal::new(ErrorCode::InvalidParams, message)
}

fn unsaved(name: &str) -> Refusal {
    let message = format!("save `{name}` first: the program reads the files on the disk");
    Refusal::new(ErrorCode::RequestFailed, message)
}
