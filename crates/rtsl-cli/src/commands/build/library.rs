//! Libraries of `rtsl build`: object files, their C headers and descriptions.

use std::path::Path;
use std::sync::Arc;

use rtsl::aot::{AotLibrary, AotOptions, Bindings};
use rtsl::{CallMode, Class, Compiler, CompilerOptions, Engine, Outputs, library, unknown_class};

use super::arguments::{Binding, BuildArguments, standard_class};
use crate::commands::shader::{is_file_name, unit_of};
use crate::layout_json::layout_json;
use crate::outcome::Failure;
use crate::report::Reporter;

/// A form of a library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LibraryForm {
    /// An object file.
    Object,
    /// Its C header.
    Header,
    /// Its description as JSON.
    Layout,
    /// The same classes as C++.
    Cpp,
}

/// Returns the form; `None` if a source has errors, which are reported.
pub fn emit(
    arguments: &BuildArguments,
    form: LibraryForm,
    reporter: &Reporter,
) -> Result<Option<Vec<u8>>, Failure> {
    let Some(library) = make_library(arguments, reporter)? else { return Ok(None) };
    library.warnings().iter().for_each(|warning| reporter.diagnostic(warning));
    Ok(Some(match form {
        LibraryForm::Object => library.object(arguments.target()?.as_ref())?,
        LibraryForm::Header => library.header().into_bytes(),
        LibraryForm::Layout => layout_json(library.description()).into_bytes(),
        LibraryForm::Cpp => library.cpp().into_bytes(),
    }))
}

fn make_library(
    arguments: &BuildArguments,
    reporter: &Reporter,
) -> Result<Option<AotLibrary>, Failure> {
    if arguments.variant.specialise {
        let message =
            "a library serves instances of any members: `--specialise` is for one method's forms";
        return Err(Failure::Usage(message.to_owned()));
    }
    // The library's hosts run the constructors, not this command.
    let mut search_path = arguments.search_path.clone();
    for source in arguments.sources.iter().filter(|source| is_file_name(source)) {
        search_path = search_path.beside(source, reporter)?;
    }
    let search_path = search_path.folders();
    let compiler = Compiler::new(CompilerOptions { search_path, ..CompilerOptions::default() });
    let Some(sources) = Sources::compile(arguments, &compiler, reporter)? else { return Ok(None) };
    let engine = arguments.engine(reporter)?;
    let options = AotOptions {
        modes: modes(arguments, &engine),
        outputs: arguments
            .variant
            .reads
            .as_ref()
            .map_or(Outputs::ALL, |variables| Outputs::state(variables.iter().copied())),
        methods: arguments.methods()?,
        bindings: sources.bindings(&arguments.library.bind)?,
        prefix: arguments.library.prefix.clone().unwrap_or_else(|| "rtsl".to_owned()),
    };
    Ok(Some(engine.aot_library(&sources.chosen, &options)?))
}

/// Combines each of the call modes with each of the widths.
fn modes(arguments: &BuildArguments, engine: &Engine) -> Vec<(CallMode, u32)> {
    let modes = if arguments.mode.is_empty() { &[CallMode::Single] } else { &*arguments.mode };
    let widths =
        if arguments.width.is_empty() { vec![engine.width()] } else { arguments.width.clone() };
    modes.iter().flat_map(|mode| widths.iter().map(|width| (*mode, *width))).collect()
}

/// The classes of a command line.
struct Sources<'a> {
    compiler: &'a Compiler,
    /// All classes of the sources.
    all: Vec<Arc<Class>>,
    /// The classes of the library.
    chosen: Vec<Arc<Class>>,
}

impl<'a> Sources<'a> {
    /// Compiles the sources; `None` if one has errors, which are reported.
    fn compile(
        arguments: &BuildArguments,
        compiler: &'a Compiler,
        reporter: &Reporter,
    ) -> Result<Option<Sources<'a>>, Failure> {
        let mut sources = Sources { compiler, all: Vec::new(), chosen: Vec::new() };
        for source in &arguments.sources {
            if !sources.add(source, reporter)? {
                return Ok(None);
            }
        }
        if !arguments.class.is_empty() {
            let chosen = arguments.class.iter().map(|name| sources.own_class(name));
            sources.chosen = chosen.collect::<Result<_, _>>()?;
        }
        Ok(Some(sources))
    }

    fn add(&mut self, source: &Path, reporter: &Reporter) -> Result<bool, Failure> {
        let Some(unit) = unit_of(self.compiler, source, reporter)? else { return Ok(false) };
        match standard_class(source) {
            Some(name) => self.chosen.push(unit.class(name)?.clone()),
            None => self.chosen.extend(unit.classes().iter().cloned()),
        }
        self.all.extend(unit.classes().iter().cloned());
        Ok(true)
    }

    fn own_class(&self, name: &str) -> Result<Arc<Class>, Failure> {
        let found = self.all.iter().find(|class| class.name == name).cloned();
        let names = self.all.iter().map(|class| class.name.as_str());
        found.ok_or_else(|| unknown_class(name, names).into())
    }

    /// Returns a class of the sources, or else of the standard library.
    fn any_class(&self, name: &str) -> Result<Arc<Class>, Failure> {
        match self.all.iter().find(|class| class.name == name) {
            Some(class) => Ok(class.clone()),
            None => Ok(library::unit_of_class(self.compiler, name)?.class(name)?.clone()),
        }
    }

    fn bindings(&self, given: &[Binding]) -> Result<Bindings, Failure> {
        let mut bindings = Bindings::default();
        for Binding { class, reference, to } in given {
            let class = self.any_class(class)?;
            bindings.bind(&class, reference, &self.any_class(to)?)?;
        }
        Ok(bindings)
    }
}
