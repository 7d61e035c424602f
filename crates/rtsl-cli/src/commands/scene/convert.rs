//! `rtsl scene convert`: a scene of an earlier version of pbrt in the format of pbrt-v4.

use std::path::{Path, PathBuf};

use clap::Args;
use rtsl::{Diagnostic, diagnostic_codes as codes};
use rtsl_scene::reader::{Conversion, ConversionOptions, DiskFiles, convert_scene};

use crate::arguments::InputArguments;
use crate::commands::render::report;
use crate::files::write_result;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// The command line of `rtsl scene convert`.
#[derive(Debug, Args)]
pub struct ConvertArguments {
    /// The scene, in the format of pbrt version 1, 2 or 3.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// The converted scene. Files that the scene includes are converted to files beside it, whose names end with
    /// `-v4.pbrt`; meshes and pictures stay where they are.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Write one file, with the contents of those that the scene includes.
    #[arg(long)]
    inline: bool,
    #[command(flatten)]
    input: InputArguments,
}

/// Converts the scene and writes its files.
pub fn run(arguments: &ConvertArguments, reporter: &Reporter) -> CommandResult {
    let (scene, output) = (&arguments.scene, &arguments.output);
    check(scene, output)?;
    let options =
        ConversionOptions { inline: arguments.inline, input_memory: arguments.input.input_memory };
    let conversion = match convert_scene(scene, output, &DiskFiles, &options) {
        Ok(conversion) => conversion,
        Err(messages) => {
            report(&messages, reporter);
            return Ok(Outcome::InputAtFault);
        }
    };
    report(&conversion.warnings, reporter);
    check_sources(&conversion)?;
    if !conversion.was_old {
        let message = format!("`{}` is in the format of pbrt-v4 already", scene.display());
        reporter.message("note", &message);
    }
    for (path, text) in &conversion.files {
        if let Some(folder) = path.parent().filter(|_| path != output) {
            std::fs::create_dir_all(folder).map_err(Failure::Output)?;
        }
        write_result(Some(path), text.as_bytes())?;
    }
    Ok(Outcome::Done)
}

/// Checks the paths before anything is read.
fn check(scene: &Path, output: &Path) -> Result<(), Failure> {
    let ending = scene.extension().map(|it| it.to_ascii_lowercase());
    if ending.is_some_and(|it| it == "gltf" || it == "glb") {
        let message = format!("`{}` is a glTF file, which is not converted", scene.display());
        let diagnostic = Diagnostic::new(codes::NOT_CONVERTIBLE, message);
        return Err(diagnostic.help("give a scene in a format of pbrt").into());
    }
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folder {
        Some(folder) if !folder.is_dir() => {
            Err(Failure::Usage(format!("there is no folder `{}`", folder.display())))
        }
        Some(_) | None if output.is_dir() => {
            Err(Failure::Usage(format!("`{}` is a folder", output.display())))
        }
        Some(_) | None => Ok(()),
    }
}

/// Checks that no result would take the place of a file from which it is made.
fn check_sources(conversion: &Conversion) -> Result<(), Failure> {
    let file = |path: &PathBuf| path.canonicalize().ok();
    let sources: Vec<PathBuf> = conversion.sources.iter().filter_map(file).collect();
    let results = conversion.files.iter().map(|(path, _)| path);
    let replaced = results.filter(|path| file(path).is_some_and(|it| sources.contains(&it)));
    match replaced.min() {
        None => Ok(()),
        Some(path) => {
            let message = format!(
                "`{}` is a file of the scene, which its conversion would replace",
                path.display()
            );
            let diagnostic = Diagnostic::new(codes::NOT_CONVERTIBLE, message);
            Err(diagnostic.help("give another path with `-o`").into())
        }
    }
}
