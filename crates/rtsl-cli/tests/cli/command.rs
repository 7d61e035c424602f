//! A run of the command in a folder of its own, and what it printed.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use expect_test::Expect;
use tempfile::TempDir;

pub const DONE: i32 = 0;
pub const INPUT_AT_FAULT: i32 = 1;
pub const WRONG_USAGE: i32 = 2;

/// The command, without a cache of machine code: tests leave nothing in the user's folders.
pub fn rtsl() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rtsl"));
    command.env("RTSL_CACHE", "");
    command
}

/// A folder of a test's own, gone when the test ends.
pub struct Folder(pub TempDir);

impl Folder {
    pub fn new(name: &str) -> Folder {
        Folder(tempfile::Builder::new().prefix(name).tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Runs `rtsl` in this folder.
    pub fn run(&self, arguments: &[&str]) -> Ran {
        self.run_with(arguments, "")
    }

    pub fn run_with(&self, arguments: &[&str], input: &str) -> Ran {
        self.run_at(self.0.path(), arguments, input)
    }

    /// Runs `rtsl` in a folder inside of this one.
    pub fn run_in(&self, place: &Path, arguments: &[&str]) -> Ran {
        self.run_at(&self.0.path().join(place), arguments, "")
    }

    fn run_at(&self, place: &Path, arguments: &[&str], input: &str) -> Ran {
        self.run_command(rtsl().args(arguments), place, input)
    }

    /// Runs it with a cache of machine code in a folder inside of this one.
    pub fn run_with_cache(&self, cache: &str, arguments: &[&str]) -> Ran {
        let mut command = rtsl();
        command.args(arguments).env("RTSL_CACHE", self.path(cache));
        self.run_command(&mut command, self.0.path(), "")
    }

    fn run_command(&self, command: &mut Command, place: &Path, input: &str) -> Ran {
        let mut child = command
            .current_dir(place)
            .env_remove("NO_COLOR")
            // Whatever is installed.
            .env("RTSL_OIDN", "no-such-library")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stdin = child.stdin.take().unwrap();
        let input = input.to_owned();
        let writer = std::thread::spawn(move || {
            let _ = stdin.write_all(input.as_bytes());
        });
        let output = child.wait_with_output().unwrap();
        writer.join().unwrap();
        Ran(output)
    }
}

/// The result of a run.
pub struct Ran(Output);

impl Ran {
    pub fn code(&self) -> i32 {
        self.0.status.code().expect("the command was not killed")
    }

    pub fn output(&self) -> String {
        String::from_utf8(self.0.stdout.clone()).unwrap()
    }

    pub fn errors(&self) -> String {
        String::from_utf8(self.0.stderr.clone()).unwrap()
    }

    pub fn exits(self, code: i32) -> Ran {
        assert_eq!(self.code(), code, "{}{}", self.output(), self.errors());
        self
    }

    /// Exits with 1 and one error with this code.
    pub fn fails_with(self, code: &str) {
        let ran = self.exits(INPUT_AT_FAULT);
        let errors = ran.errors();
        assert!(errors.contains(&format!("error[{code}]")), "{errors}");
        assert_eq!(errors.matches("error[").count(), 1, "{errors}");
    }

    pub fn prints(self, expected: Expect) {
        expected.assert_eq(&self.output());
    }
}

/// The text of a scene with a ball under an even sky: its columns and rows, and the samples of each pixel.
pub fn ball_scene([columns, rows]: [u32; 2], samples: u32) -> String {
    format!(
        "Film \"rgb\" \"integer xresolution\" {columns} \"integer yresolution\" {rows}
Sampler \"sobol\" \"integer pixelsamples\" {samples}
Integrator \"path\" \"integer maxdepth\" 2
LookAt 0 1 -5  0 0 0  0 1 0
Camera \"Pinhole\"
WorldBegin
LightSource \"infinite\" \"rgb L\" [0.5 0.6 0.7]
Shape \"Sphere\"
"
    )
}

pub const SPHERE: &str = "class Ball : rt_Primitive;
public float radius = 1.0;
scratch vec3 where;
void intersect()
{
    float b = dot(rt_RayOrigin, rt_RayDirection);
    float c = dot(rt_RayOrigin, rt_RayOrigin) - radius * radius;
    float t = -b - sqrt(b * b - c);
    if (hit(t)) where = rt_RayOrigin + t * rt_RayDirection;
}
";
