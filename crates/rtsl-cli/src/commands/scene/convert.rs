//! `rtsl scene convert`: a scene of an earlier version of pbrt, or a glTF file, in the format of pbrt-v4.

use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use rtsl::{Diagnostic, diagnostic_codes as codes};
use rtsl_scene::export::{ExportError, ExportOptions, export_gltf};
use rtsl_scene::gltf::is_gltf;
use rtsl_scene::reader::{Conversion, ConversionOptions, DiskFiles, RecordedFiles, convert_scene};

use crate::arguments::InputArguments;
use crate::commands::render::report;
use crate::files::write_result;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// The command line of `rtsl scene convert`.
#[derive(Debug, Args)]
pub struct ConvertArguments {
    /// The scene, in the format of pbrt version 1, 2 or 3, or a glTF file.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// The converted scene. Files that the scene includes are converted to files beside it, whose names end with
    /// `-v4.pbrt`; meshes and pictures stay where they are. Those of a glTF file are written to a folder beside it,
    /// whose name ends with `_files`.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Write one file, with the contents of those that the scene includes.
    #[arg(long)]
    inline: bool,
    /// The camera of a glTF file, by its name or index; its first one if not given.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    #[command(flatten)]
    input: InputArguments,
}

/// Converts the scene and writes its files.
pub fn run(arguments: &ConvertArguments, reporter: &Reporter) -> CommandResult {
    let (scene, output) = (&arguments.scene, &arguments.output);
    check(output)?;
    if is_gltf(scene) {
        return export(arguments, reporter);
    }
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

/// Converts a glTF file and writes its files, the scene last.
fn export(arguments: &ConvertArguments, reporter: &Reporter) -> CommandResult {
    let (scene, output) = (&arguments.scene, &arguments.output);
    let folder = format!("{}_files", output.file_stem().unwrap_or_default().to_string_lossy());
    let beside = output.parent().unwrap_or(Path::new(""));
    let options = ExportOptions {
        camera: arguments.camera.as_deref(),
        input_memory: arguments.input.input_memory,
        folder: &folder,
    };
    let files = RecordedFiles::new(&DiskFiles);
    let check = |path: &Path| {
        let sources = files.digests(Path::new("")).into_iter().map(|(path, _)| path);
        check_replaced([path].into_iter(), sources.map(PathBuf::from))
    };
    let mut refused = None;
    let mut write = |name: &str, contents: &[u8]| {
        let path = beside.join(name);
        let stop = || io::Error::from(io::ErrorKind::Interrupted);
        std::fs::create_dir_all(beside.join(&folder))?;
        let written = check(&path).and_then(|()| write_result(Some(&path), contents));
        written.map_err(|failure| {
            refused = Some(failure);
            stop()
        })
    };
    let exported = export_gltf(scene, &files, &options, &mut write);
    if let Some(failure) = refused {
        return Err(failure);
    }
    let exported = match exported {
        Ok(exported) => exported,
        Err(ExportError::Input(messages)) => {
            report(&messages, reporter);
            return Ok(Outcome::InputAtFault);
        }
        Err(ExportError::Output(error)) => return Err(Failure::Output(error)),
    };
    report(&exported.warnings, reporter);
    check(output)?;
    write_result(Some(output), exported.text.as_bytes())?;
    Ok(Outcome::Done)
}

/// Checks the path of the result before anything is read.
fn check(output: &Path) -> Result<(), Failure> {
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
    let results = conversion.files.iter().map(|(path, _)| path.as_path());
    check_replaced(results, conversion.sources.iter().cloned())
}

fn check_replaced<'p>(
    results: impl Iterator<Item = &'p Path>,
    sources: impl Iterator<Item = PathBuf>,
) -> Result<(), Failure> {
    let file = |path: &Path| path.canonicalize().ok();
    let sources: Vec<PathBuf> = sources.filter_map(|path| file(&path)).collect();
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
