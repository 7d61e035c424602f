//! A session of requests that share compiled texts and programs.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl::{
    Backend, Compilation, Compiler, CompilerOptions, Engine, EngineOptions, FileLoader, Math,
    Method, OptLevel, Program, SourceMap, Trace, TraceDetail, Unit, diagnostic_codes as codes,
    render,
};

use super::function::FunctionCall;
use super::request::{Answer, Evaluation, Request};
use super::run::{self, Refusal};
use crate::arguments::SearchPath;
use crate::project_file::ProjectFile;
use crate::report::JsonDiagnostic;
use crate::trace::JsonRecording;

/// The name of texts that are in no file.
const TEXT_NAME: &str = "request.rtsl";
/// The number of compiled texts that are kept.
const KEPT_TEXTS: usize = 16;
/// The number of programs of one text that are kept.
const KEPT_PROGRAMS: usize = 64;

/// Answers requests. Texts and code are kept for requests with the same source.
#[derive(Default)]
pub struct Session {
    search_path: SearchPath,
    engines: Vec<(EngineOptions, Engine)>,
    /// The most recently used is last.
    texts: Vec<KeptText>,
}

/// A compiled text.
struct KeptText {
    source: String,
    budget: u32,
    compilation: Arc<Compilation>,
    /// Kept alive with their kernels.
    programs: Vec<Arc<Program>>,
}

/// A call of a function, on an engine.
struct Call<'a> {
    request: &'a Request,
    folders: &'a [PathBuf],
    engine: &'a Engine,
}

impl Session {
    /// Creates a session whose texts may include files from these folders.
    pub fn new(search_path: SearchPath) -> Session {
        Session { search_path, ..Session::default() }
    }

    /// Answers a line of JSON.
    pub fn answer_line(&mut self, line: &str) -> Answer {
        let json: serde_json::Value = match serde_json::from_str(line) {
            Ok(json) => json,
            Err(error) => return Answer::refusal(None, format!("not JSON: {error}")),
        };
        let id = json.get("id").cloned();
        match serde_json::from_value(json) {
            Ok(request) => self.answer(&request),
            Err(error) => Answer::refusal(id, format!("not a request: {error}")),
        }
    }

    /// Answers a request.
    pub fn answer(&mut self, request: &Request) -> Answer {
        let Evaluation { mut answer, compilation, further, recording } = self.evaluate(request);
        answer.trace = recording.as_ref().map(JsonRecording::new);
        let compiled = compilation.iter().flat_map(|compilation| {
            let diagnostics = compilation.diagnostics.iter();
            diagnostics.map(|diagnostic| JsonDiagnostic::new(&compilation.sources, diagnostic))
        });
        let nowhere = SourceMap::new();
        let others = further.iter().map(|diagnostic| JsonDiagnostic::new(&nowhere, diagnostic));
        answer.diagnostics = compiled.chain(others).collect();
        answer
    }

    /// Evaluates a request, without its diagnostics.
    pub fn evaluate(&mut self, request: &Request) -> Evaluation {
        let id = request.id.clone();
        let answer = Answer { id: id.clone(), ..Answer::default() };
        let mut evaluation = Evaluation::of_answer(answer);
        // A panic of the compiler affects only this answer, not the process.
        let completed =
            catch_unwind(AssertUnwindSafe(|| self.try_evaluate(request, &mut evaluation)));
        match completed {
            Ok(Ok(())) => {}
            Ok(Err(Refusal::Request(error))) => evaluation.answer = Answer::refusal(id, error),
            Ok(Err(Refusal::Diagnostics(errors))) => {
                evaluation.answer.ok = false;
                evaluation.further.extend(errors);
            }
            Err(_) => {
                let message = "internal error: the compiler failed on this request";
                evaluation.answer = Answer::refusal(id, message);
            }
        }
        evaluation
    }

    fn try_evaluate(
        &mut self,
        request: &Request,
        evaluation: &mut Evaluation,
    ) -> Result<(), Refusal> {
        let folders = self.folders(request.file.as_deref())?;
        let compilation = self.compile(request, &folders)?;
        evaluation.compilation = Some(compilation.clone());
        let Some(unit) = &compilation.unit else { return Ok(()) };
        evaluation.answer.ok = true;
        if request.method.is_none() {
            let names = unit.classes().iter().map(|class| class.name.clone());
            evaluation.answer.classes = Some(names.collect());
            return Ok(());
        }
        let engine = self.engine(engine_options(request)?, evaluation)?;
        if request.calls_function() {
            let call = Call { request, folders: &folders, engine: &engine };
            self.call_function(&call, unit, evaluation)?;
            return self.trace(request, &folders, &compilation, evaluation);
        }
        if let Some(name) = request.args.keys().next() {
            let message = format!("`{name}` is an argument of a function, and methods have none");
            return Err(Refusal::Request(message));
        }
        let scene_folders = self.folders(request.scene.as_deref())?;
        let program = run::run(request, unit, &engine, scene_folders, evaluation)?;
        if request.source.is_some() {
            self.keep_program(program);
        }
        self.trace(request, &folders, &compilation, evaluation)
    }

    /// Makes the call once more with a trace, if the request asks for one or the text may print.
    fn trace(
        &self,
        request: &Request,
        folders: &[PathBuf],
        compilation: &Compilation,
        evaluation: &mut Evaluation,
    ) -> Result<(), Refusal> {
        let trace = match (&request.recorder, request.trace) {
            (Some(recorder), _) => recorder.clone(),
            (None, Some(name)) => Trace::new(name.into()),
            (None, None) if compilation.has_prints() => Trace::new(TraceDetail::Prints),
            (None, None) => return Ok(()),
        };
        let options = EngineOptions { trace: Some(trace), ..engine_options(request)? };
        let (engine, _) = Engine::new(options)?;
        let traced = match (&request.source, &request.file) {
            (None, Some(file)) => compiler(request, folders, true).compile_file(file),
            (source, _) => {
                let source = source.as_deref().unwrap_or_default();
                compiler(request, folders, true).compile(TEXT_NAME, source)
            }
        };
        let Some(unit) = &traced.unit else {
            return Err(Refusal::Diagnostics(traced.diagnostics.iter().cloned().collect()));
        };
        let mut again = Evaluation::of_answer(Answer::default());
        if request.calls_function() {
            let call = Call { request, folders, engine: &engine };
            self.call_function(&call, unit, &mut again)?;
        } else {
            let scene_folders = self.folders(request.scene.as_deref())?;
            run::run(request, unit, &engine, scene_folders, &mut again)?;
        }
        evaluation.recording = again.recording;
        Ok(())
    }

    /// Calls a function that is no method. Its own text is compiled once more, with a method that calls it.
    fn call_function(
        &self,
        &Call { request, folders, engine }: &Call<'_>,
        unit: &Unit,
        evaluation: &mut Evaluation,
    ) -> Result<(), Refusal> {
        let compiler = compiler(request, folders, engine.options().trace.is_some());
        let (name, text) = match (&request.source, &request.file) {
            (None, Some(file)) => {
                let text = std::fs::read_to_string(file);
                let text = text.map_err(|error| Refusal::Request(error.to_string()))?;
                (file.display().to_string(), text)
            }
            (source, _) => (TEXT_NAME.to_owned(), source.clone().unwrap_or_default()),
        };
        let compile = |text: &str| {
            let mut loader = loader(request, folders);
            compiler.compile_with(&name, text, &mut loader)
        };
        let outline = compiler.outline(&name, &text, &mut loader(request, folders));
        let call = FunctionCall::find(request, &outline, unit).map_err(Refusal::Request)?;
        let own = evaluation.compilation.as_ref().map_or(0, |own| count_faults(own));
        let mut best: Option<(Compilation, Method)> = None;
        for (text, method) in call.texts(&text) {
            let compilation = compile(&text);
            let faults = |it: &Compilation| (it.unit.is_none(), count_faults(it));
            let is_clean = faults(&compilation) <= (false, own);
            if best.as_ref().is_none_or(|(known, _)| faults(&compilation) < faults(known)) {
                best = Some((compilation, method));
            }
            if is_clean {
                break;
            }
        }
        let Some((compilation, method)) = best else {
            let message = format!("`{}` is of a class without a role", call.signature());
            return Err(Refusal::Request(message));
        };
        let Some(unit) = &compilation.unit else {
            let mut errors = compilation.diagnostics.iter();
            let reason = errors.next().map_or("", |error| error.message.as_str());
            let message = format!("`{}` cannot be called alone: {reason}", call.signature());
            return Err(Refusal::Request(message));
        };
        let scene_folders = self.folders(request.scene.as_deref())?;
        let call_request = call.request(request, method).map_err(Refusal::Request)?;
        run::run(&call_request, unit, engine, scene_folders, evaluation)?;
        call.take_results(&mut evaluation.answer);
        evaluation.recording.iter_mut().for_each(|it| call.name_entries(it, text.len()));
        Ok(())
    }

    /// The search path of a file, or of texts that are in none.
    fn folders(&self, file: Option<&Path>) -> Result<Vec<PathBuf>, Refusal> {
        let Some(file) = file else { return Ok(self.search_path.folders()) };
        let project = ProjectFile::beside(file, &self.search_path.folders());
        if project.diagnostics.has_errors() {
            let faults = project.diagnostics.iter();
            return Err(Refusal::Request(render::all_to_text(&project.sources, faults, false)));
        }
        Ok(self.search_path.with(project).folders())
    }

    fn compile(
        &mut self,
        request: &Request,
        folders: &[PathBuf],
    ) -> Result<Arc<Compilation>, Refusal> {
        let compiler = compiler(request, folders, false);
        let source = match (&request.source, &request.file) {
            (Some(source), None) => source,
            // The file, or one that it includes, may have changed.
            (None, Some(file)) => return Ok(Arc::new(compiler.compile_file(file))),
            _ => {
                let message = "a request has either `source` or `file`";
                return Err(Refusal::Request(message.to_owned()));
            }
        };
        let is_kept = |kept: &KeptText| kept.budget == request.budget() && kept.source == *source;
        if let Some(index) = self.texts.iter().position(is_kept) {
            let kept = self.texts.remove(index);
            let compilation = kept.compilation.clone();
            self.texts.push(kept);
            return Ok(compilation);
        }
        let compilation = Arc::new(compiler.compile(TEXT_NAME, source));
        if self.texts.len() == KEPT_TEXTS {
            self.texts.remove(0);
        }
        self.texts.push(KeptText {
            source: source.clone(),
            budget: request.budget(),
            compilation: compilation.clone(),
            programs: Vec::new(),
        });
        Ok(compilation)
    }

    /// Keeps a program of the text compiled last.
    fn keep_program(&mut self, program: Arc<Program>) {
        let Some(kept) = self.texts.last_mut() else { return };
        let is_known = kept.programs.iter().any(|known| Arc::ptr_eq(known, &program));
        if !is_known && kept.programs.len() < KEPT_PROGRAMS {
            kept.programs.push(program);
        }
    }

    fn engine(
        &mut self,
        options: EngineOptions,
        evaluation: &mut Evaluation,
    ) -> Result<Engine, Refusal> {
        if let Some((_, engine)) = self.engines.iter().find(|(known, _)| *known == options) {
            return Ok(engine.clone());
        }
        let (engine, warnings) = Engine::new(options.clone())?;
        evaluation.further.extend(warnings.iter().cloned());
        self.engines.push((options, engine.clone()));
        Ok(engine)
    }
}

fn compiler(request: &Request, folders: &[PathBuf], traced: bool) -> Compiler {
    Compiler::new(CompilerOptions {
        loop_budget: Some(request.budget()),
        search_path: folders.to_owned(),
        traced,
    })
}

fn loader(request: &Request, folders: &[PathBuf]) -> FileLoader {
    match &request.file {
        Some(file) => FileLoader::beside(file, folders),
        None => FileLoader::new(folders),
    }
}

fn engine_options(request: &Request) -> Result<EngineOptions, Refusal> {
    let backend = match request.backend.as_deref() {
        None | Some("auto") => Backend::Auto,
        Some("jit") => Backend::Jit,
        Some("interp") => Backend::Interpreter,
        Some(other) => {
            let message = format!("there is no backend `{other}`: auto, jit, interp");
            return Err(Refusal::Request(message));
        }
    };
    let math = match request.math.as_deref() {
        None => Math::default(),
        Some(name) => Math::from_name(name).ok_or_else(|| {
            Refusal::Request(format!("there is no math `{name}`: contract, strict, fast"))
        })?,
    };
    Ok(EngineOptions {
        backend,
        width: request.width,
        interleave: None,
        math,
        loop_budget: Some(request.budget()),
        // Most code here runs once; the results are the same.
        optimization: OptLevel::O1,
        trace: None,
        costs: None,
    })
}

/// The number of diagnostics of a text that tell of the call. A class that is there for a call alone does nothing else.
fn count_faults(compilation: &Compilation) -> usize {
    let idle = [codes::IDLE_CLASS, codes::OUTPUT_ELSEWHERE, codes::UNREAD_MEMBER];
    compilation.diagnostics.iter().filter(|it| !idle.contains(&it.code)).count()
}
