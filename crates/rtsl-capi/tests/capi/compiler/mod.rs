//! A C compiler, where there is one.

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use rtsl_testing::turns::is_long_run;

/// True if programs can be compiled.
///
/// # Panics
/// If they can't, and `RTSL_REQUIRE_CXX` is set.
pub fn has_compiler() -> bool {
    let found =
        Command::new(compiler()).arg("--version").output().is_ok_and(|it| it.status.success());
    let required = std::env::var_os("RTSL_REQUIRE_CXX").is_some();
    assert!(found || !required, "there is no C compiler, and RTSL_REQUIRE_CXX is set");
    if !found {
        eprintln!("left out: there is no C compiler `{}`", compiler());
    }
    found
}

fn compiler() -> String {
    std::env::var("CC").unwrap_or_else(|_| "cc".to_owned())
}

/// A program and how it is compiled and run.
pub struct CProgram {
    name: String,
    folder: PathBuf,
    options: Vec<String>,
    inputs: Vec<PathBuf>,
    arguments: Vec<OsString>,
}

impl CProgram {
    /// A program of `tests/c`.
    pub fn new(name: &str) -> CProgram {
        CProgram::of(&tests().join("c").join(format!("{name}.c")))
    }

    /// A program of one file.
    pub fn of(source: &Path) -> CProgram {
        let name = source.file_stem().and_then(|name| name.to_str()).expect("a name").to_owned();
        let folder = folder(&name);
        let options =
            ["-std=c11", "-Wall", "-Wextra", "-Wno-missing-field-initializers", "-Werror", "-g"];
        let options = options.map(str::to_owned).to_vec();
        let (inputs, arguments) = (vec![source.to_owned()], Vec::new());
        CProgram { name, folder, options, inputs, arguments }
    }

    /// The same with another name, and a folder of that name, for one of several that are made of one file.
    pub fn called(mut self, name: &str) -> CProgram {
        self.name = name.to_owned();
        self.folder = folder(name);
        self
    }

    /// Its own folder, which is looked in for headers.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Finds accesses to memory that is not the program's.
    pub fn sanitized(mut self) -> CProgram {
        self.options.push("-fsanitize=address,undefined".to_owned());
        self.options.push("-fno-sanitize-recover=all".to_owned());
        self
    }

    /// With the C interface.
    pub fn with_library(mut self) -> CProgram {
        self.inputs.push(static_library());
        self
    }

    /// With another file: an object, a source.
    pub fn with(mut self, file: PathBuf) -> CProgram {
        self.inputs.push(file);
        self
    }

    /// With an argument.
    pub fn argument(mut self, argument: impl Into<OsString>) -> CProgram {
        self.arguments.push(argument.into());
        self
    }

    /// Compiles and runs it.
    pub fn run(self) {
        self.run_with(&[]);
    }

    /// Compiles it; gives where it is.
    pub fn build(&self) -> PathBuf {
        let program = self.folder.join(&self.name);
        let include = tests().parent().expect("the crate").join("include");
        let mut compile = Command::new(compiler());
        compile.args(&self.options).arg("-I").arg(include).arg("-I").arg(&self.folder);
        compile.args(&self.inputs).args(["-o".as_ref(), program.as_os_str()]);
        compile.args(["-lpthread", "-ldl", "-lm"]);
        let compiled = compile.output().expect("the compiler runs");
        assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
        program
    }

    /// Compiles it and runs it on an input; gives what it printed.
    pub fn run_with(self, input: &[u8]) -> Vec<u8> {
        let mut run = Command::new(self.build());
        run.args(&self.arguments);
        run.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut running = run.spawn().expect("the program runs");
        let mut to_program = running.stdin.take().expect("it reads");
        let input = input.to_vec();
        // Beside reading what it writes, which it may do before it has read all.
        let writer = std::thread::spawn(move || to_program.write_all(&input));
        let ran = running.wait_with_output().expect("the program ends");
        let _ = writer.join();
        assert!(
            ran.status.success(),
            "{}: {}\n{}",
            self.name,
            ran.status,
            String::from_utf8_lossy(&ran.stderr)
        );
        ran.stdout
    }
}

fn folder(program: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("c-{program}"));
    std::fs::create_dir_all(&folder).expect("a folder for the program");
    folder
}

/// Compiles the C++ text of a library, whose header is in the folder, to a shared library.
pub fn shared_library(folder: &Path, text: &str) -> PathBuf {
    let (source, library) = (folder.join("library.cpp"), folder.join("library.so"));
    std::fs::write(&source, text).expect("the text is written");
    let mut compile = Command::new(std::env::var("CXX").unwrap_or_else(|_| "c++".to_owned()));
    compile.args([
        "-std=c++17",
        "-Wall",
        "-Werror",
        // The bits of optimised C++ are compared by a test of `rtsl`.
        if is_long_run() { "-O1" } else { "-O0" },
        "-shared",
        "-fPIC",
        "-DRTSL_EXPORT=\"library.h\"",
    ]);
    compile.arg("-I").arg(folder).arg(&source).arg("-o").arg(&library);
    let compiled = compile.output().expect("the compiler of C++ runs");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    library
}

/// Compiles `rtsl.h` by itself.
pub fn check_header(language: &str, standard: &str) {
    let header = tests().join("../include/rtsl.h");
    let mut compile = Command::new(compiler());
    compile.args(["-Wall", "-Wextra", "-pedantic", "-Werror", "-fsyntax-only"]);
    compile.arg(format!("-std={standard}")).args(["-x", language]).arg(header);
    let compiled = compile.output().expect("the compiler runs");
    let problems = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success(), "{standard}: {problems}");
}

/// The root of the repository.
pub fn repository() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn tests() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests")
}

/// The newest static library beside this test: the one that was built with it.
pub fn static_library() -> PathBuf {
    let test = std::env::current_exe().expect("the test has a path");
    let entries =
        std::fs::read_dir(test.parent().expect("it is in a folder")).expect("it can be read");
    let libraries = entries.filter_map(|entry| {
        let path = entry.ok()?.path();
        let name = path.file_name()?.to_str()?;
        let is_library = name.starts_with("librtsl_capi") && name.ends_with(".a");
        let modified = path.metadata().ok()?.modified().ok()?;
        is_library.then_some((modified, path))
    });
    let newest = libraries.max_by_key(|(modified, _)| *modified);
    newest.expect("the static library was built with the test").1
}
