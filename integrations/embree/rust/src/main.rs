//! Draws RTSL primitives through Embree: the same picture as `picture.c`.

mod embree;
mod geometry;
mod picture;
mod rays;
mod scene;

use std::io::BufWriter;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use rtsl::{Backend, Class, Compiler, Diagnostic, Engine, EngineOptions, Instance, Value, library};

use embree::Embree;
use geometry::Geometry;
use picture::Picture;
use scene::Scene;

const USAGE: &str = "\
usage: rtsl-embree [--width 1|4|8|16] [--size N] [--check] PRIMITIVE [NAME=NUMBER[,NUMBER]...]... PICTURE.png
  PRIMITIVE  a class of the standard library, as Torus, or a file.rtsl, whose first class it is
  --width    rays in a packet; 16 if not given
  --size     pixels in a row, and rows, a multiple of 16; 256 if not given
  --check    compares every hit with that of a loop over all primitives without Embree";

/// The options of the command line.
struct Options {
    width: usize,
    size: usize,
    check: bool,
    output: String,
    primitives: Vec<Primitive>,
}

/// A primitive and its parameters.
struct Primitive {
    source: String,
    settings: Vec<(String, Vec<f32>)>,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(options) = read_arguments(&arguments) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match run(&options) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            // Those of RTSL say themselves that they are errors.
            let text = format!("{error:#}");
            let start = if text.starts_with("error") { "" } else { "error: " };
            eprintln!("{start}{text}");
            ExitCode::FAILURE
        }
    }
}

/// Draws the picture; gives how many hits differ from those without Embree.
fn run(options: &Options) -> Result<usize> {
    let embree = Embree::load()?;
    let engine = EngineOptions { backend: Backend::Jit, ..EngineOptions::default() };
    let (engine, _) = Engine::new(engine).map_err(|problem| told([&problem]))?;
    let version = embree.version;
    let groups = options.primitives.chunk_by(|a, b| a.source == b.source);
    let geometries = groups.map(|group| make_geometry(&engine, group, version));
    let scene = Scene::new(embree, geometries.collect::<Result<_>>()?)?;
    let picture = Picture::draw(&scene, options.size, options.width, options.check)?;
    write_png(&options.output, options.size, &picture.pixels)
        .with_context(|| format!("{} can't be written", options.output))?;
    if options.check {
        println!(
            "{} of {} hits differ from those without Embree",
            picture.differences,
            options.size * options.size
        );
    }
    Ok(picture.differences)
}

fn read_arguments(arguments: &[String]) -> Option<Options> {
    let mut options = Options {
        width: 16,
        size: 256,
        check: false,
        output: String::new(),
        primitives: Vec::new(),
    };
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        if argument == "--width" {
            options.width = arguments.next()?.parse().ok()?;
        } else if argument == "--size" {
            options.size = arguments.next()?.parse().ok()?;
        } else if argument == "--check" {
            options.check = true;
        } else if let Some((name, numbers)) = argument.split_once('=') {
            let numbers: Result<Vec<f32>, _> = numbers.split(',').map(str::parse).collect();
            options.primitives.last_mut()?.settings.push((name.to_owned(), numbers.ok()?));
        } else if argument.ends_with(".png") {
            options.output.clone_from(argument);
        } else {
            let source = argument.clone();
            options.primitives.push(Primitive { source, settings: Vec::new() });
        }
    }
    let is_size = options.size > 0 && options.size <= 4096 && options.size.is_multiple_of(16);
    let is_complete = !options.output.is_empty() && !options.primitives.is_empty();
    ([1, 4, 8, 16].contains(&options.width) && is_size && is_complete).then_some(options)
}

/// A geometry of primitives of one class.
fn make_geometry(engine: &Engine, primitives: &[Primitive], version: u32) -> Result<Geometry> {
    let class = load_class(&primitives[0].source)?;
    let instance = |primitive: &Primitive| {
        let settings = primitive.settings.iter();
        let settings = settings.map(|(name, numbers)| (name.as_str(), value_of(numbers)));
        Instance::new(&class, settings).map_err(|problems| told(problems.iter()))
    };
    let instances: Vec<Arc<Instance>> = primitives.iter().map(instance).collect::<Result<_>>()?;
    Geometry::new(engine, &instances, version)
}

/// Diagnostics with what they say besides.
pub(crate) fn told<'a>(problems: impl IntoIterator<Item = &'a Diagnostic>) -> anyhow::Error {
    let told = |problem: &Diagnostic| {
        let notes = problem.notes.iter().map(|note| format!("\n  note: {note}"));
        let help = problem.help.iter().map(|help| format!("\n  help: {help}"));
        format!("{problem}{}", notes.chain(help).collect::<String>())
    };
    anyhow!("{}", problems.into_iter().map(told).collect::<Vec<_>>().join("\n"))
}

fn load_class(source: &str) -> Result<Arc<Class>> {
    let compiler = Compiler::default();
    if !source.ends_with(".rtsl") {
        let unit = library::unit_of_class(&compiler, source);
        let unit = unit.map_err(|problem| told([&problem]))?;
        return Ok(unit.class(source).map_err(|problem| told([&problem]))?.clone());
    }
    let compilation = compiler.compile_file(Path::new(source));
    let Some(unit) = &compilation.unit else { bail!("{}", compilation.report(false).trim_end()) };
    unit.classes().first().cloned().with_context(|| format!("{source} has no class"))
}

fn value_of(numbers: &[f32]) -> Value {
    match numbers {
        [number] => (*number).into(),
        numbers => Value::List(numbers.iter().map(|number| (*number).into()).collect()),
    }
}

fn write_png(path: &str, size: usize, pixels: &[u8]) -> Result<()> {
    let file = BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, size as u32, size as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(())
}
