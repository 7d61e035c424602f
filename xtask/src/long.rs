//! `cargo xtask long`: the tests that take too long for every day.

use crate::shell::{Command, Failure, Result, cargo, is_installed, say};

const HELP: &str = "\
The tests that take too long for every day: for nights, and before a release.

    cargo xtask long [PART...] [OPTIONS]

  scenes      every scene of `scenes/` with every renderer, width, backend and number of threads
  contracts   every class of the library against its contract, with 200 seeds
  functions   every float for every mathematical function, against the manual's table of errors
  mutations   the fuzz targets for texts on 50 times as many mutations as in ordinary tests, those for files on 300
              of each format
  repetitions the comparisons of machine code, stages and C++ with the interpreter, at every width, in every call mode
              and with every setting of the C++ compilers, where ordinary tests take them in turn; a library for C that
              its script builds
  watertight  two hundred million rays towards edges and corners of meshes
  texts       the longest texts and the largest frames that are accepted; takes ten minutes
  gallery     the scenes of `tests/gallery` with 2,048 samples, compared with pbrt's pictures
  glsl        the shader cases of dEQP and piglit, from `--suites`; needs glslangValidator
  llvm        the tests that call LLVM, with every major version from 17 on, fetched by `.ci/every-llvm`
  fuzz        every fuzz target with cargo-fuzz, which needs a nightly toolchain

Without a part all of them run, one after another, but for `glsl` without its folder; the parts that fail are listed at
the end.

  --suites FOLDER  where `glsl` finds the suites, in any depth: `data` of VK-GL-CTS and `tests` of piglit, or parts
  --llvm FOLDER    where `llvm` keeps the libraries that it fetches; default: target/llvm
  --seconds N      how long `fuzz` runs each target; default: 600
";

const PARTS: [&str; 11] = [
    "scenes",
    "contracts",
    "functions",
    "mutations",
    "repetitions",
    "watertight",
    "texts",
    "gallery",
    "glsl",
    "llvm",
    "fuzz",
];

struct Options {
    suites: Option<String>,
    llvm: String,
    seconds: u32,
}

/// Runs the named parts, or all.
///
/// # Errors
///
/// If a part fails.
pub fn run(arguments: &[String]) -> Result<()> {
    let mut options = Options { suites: None, llvm: "target/llvm".to_owned(), seconds: 600 };
    let mut parts: Vec<&str> = Vec::new();
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "-h" | "--help" => {
                print!("{HELP}");
                return Ok(());
            }
            "--suites" => options.suites = Some(value(argument, rest.next())?),
            "--llvm" => options.llvm = value(argument, rest.next())?,
            "--seconds" => {
                let seconds = value(argument, rest.next())?;
                let number = seconds.parse();
                options.seconds =
                    number.map_err(|_| Failure(format!("--seconds: `{seconds}` is no number")))?;
            }
            part if PARTS.contains(&part) => parts.push(part),
            other => {
                return Err(Failure(format!(
                    "no part `{other}`; `cargo xtask long --help` lists the parts"
                )));
            }
        }
    }
    if parts.is_empty() {
        parts = PARTS.to_vec();
        parts.retain(|part| *part != "glsl" || options.suites.is_some());
    }
    let mut failed = Vec::new();
    for part in parts {
        say(part);
        if let Err(Failure(message)) = run_part(part, &options) {
            eprintln!("{part}: {message}");
            failed.push(part);
        }
    }
    if failed.is_empty() {
        return Ok(());
    }
    Err(Failure(format!("these parts failed: {}", failed.join(", "))))
}

fn value(option: &str, value: Option<&String>) -> Result<String> {
    value.cloned().ok_or_else(|| Failure(format!("{option} needs a value")))
}

fn run_part(part: &str, options: &Options) -> Result<()> {
    let test = |package: &str, target: &str| {
        cargo(["test", "--release", "-p", package, "--test", target]).toolchain_llvm()
    };
    match part {
        "scenes" => test("rtsl-render", "render").args(["--", "--ignored", "scenes::"]).run(),
        "contracts" => {
            let contracts = cargo(["test", "--release", "-p", "rtsl-contract", "--no-fail-fast"]);
            contracts.toolchain_llvm().env("RTSL_SEEDS", "200").run()
        }
        "functions" => {
            let functions = test("rtsl", "rtsl");
            functions.args(["--", "--ignored", "--nocapture", "prelude::exhaustive"]).run()
        }
        "mutations" => {
            test("rtsl", "rtsl").args(["fuzz::"]).env("RTSL_FUZZ", "50").run()?;
            let formats = ["--", "fuzz::", "checkpoint_mutations::"];
            test("rtsl-render", "render").args(formats).env("RTSL_FUZZ", "50").run()
        }
        "repetitions" => {
            let compiled = ["--", "operations::", "agreement::", "library::", "cpp::"];
            test("rtsl", "rtsl").args(compiled).env("RTSL_LONG", "1").run()?;
            test("rtsl-jit", "jit").args(["--", "oracle::"]).env("RTSL_LONG", "1").run()?;
            test("rtsl-render", "render")
                .args(["--", "integrators::", "scale::"])
                .env("RTSL_LONG", "1")
                .run()?;
            test("rtsl-capi", "capi").args(["--", "install::", "aot::"]).env("RTSL_LONG", "1").run()
        }
        "watertight" => {
            for (package, target) in [("rtsl", "rtsl"), ("rtsl-render", "render")] {
                test(package, target).args(["--", "watertight::"]).env("RTSL_LONG", "1").run()?;
            }
            Ok(())
        }
        "texts" => {
            let texts =
                ["--", "--ignored", "values_or_refuse", "deep_texts::the_longest_texts_end"];
            test("rtsl", "rtsl").args(texts).run()
        }
        "gallery" => {
            test("rtsl-render", "render").args(["--", "gallery::"]).env("RTSL_LONG", "1").run()
        }
        "glsl" => {
            let folder = options.suites.as_ref();
            let folder = folder.ok_or_else(|| Failure("--suites names no folder".to_owned()))?;
            let folder = std::path::absolute(folder)
                .map_err(|error| Failure(format!("--suites: {folder}: {error}")))?;
            let suites = ["--", "--ignored", "--nocapture", "the_suites_agree"];
            test("rtsl", "glsl").args(suites).env("RTSL_GLSL", folder).run()
        }
        "llvm" => Command::new(".ci/every-llvm").args(["--fetch", &options.llvm]).run(),
        "fuzz" => fuzz(options.seconds),
        other => unreachable!("{other} is no part"),
    }
}

/// Runs every fuzz target for the same time, and names those that fail at the end.
fn fuzz(seconds: u32) -> Result<()> {
    if !is_installed("cargo-fuzz") {
        return Err(Failure(
            "cargo-fuzz is missing: `cargo install --locked cargo-fuzz`".to_owned(),
        ));
    }
    let targets = std::fs::read_dir("fuzz/fuzz_targets");
    let targets = targets.map_err(|error| Failure(format!("fuzz/fuzz_targets: {error}")))?;
    let mut targets: Vec<String> = targets
        .flatten()
        .filter_map(|entry| entry.path().file_stem()?.to_str().map(str::to_owned))
        .collect();
    targets.sort();
    let mut failed = Vec::new();
    for target in targets {
        let limit = format!("-max_total_time={seconds}");
        // The command of rustup, since Cargo's own does not know toolchains.
        let fuzz = Command::new("cargo").args(["+nightly", "fuzz", "run", &target, "--", &limit]);
        if let Err(Failure(message)) = fuzz.run() {
            eprintln!("{message}");
            failed.push(target);
        }
    }
    if failed.is_empty() {
        return Ok(());
    }
    Err(Failure(format!("these targets failed: {}", failed.join(", "))))
}
