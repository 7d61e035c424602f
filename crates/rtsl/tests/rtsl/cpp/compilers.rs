//! The compilers of C++ that are installed.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::path::Path;
use std::process::Command;

use rtsl_testing::turns::is_long_run;

use crate::cpp::subjects::Subject;

/// A compiler with its flags.
#[derive(Debug)]
pub struct Setting {
    compiler: &'static str,
    flags: &'static [&'static str],
    /// The operations of the longest subjects.
    most_operations: usize,
}

/// The settings of ordinary runs: one compiler may contract and use all of the machine, the other optimises little. The
/// first takes minutes for the longest methods, and 17 s for the 56 between 800 and 2,000 operations.
const SETTINGS: [Setting; 2] = [
    Setting {
        compiler: "g++",
        flags: &["-std=gnu++17", "-O2", "-march=native", "-ffp-contract=fast"],
        most_operations: 800,
    },
    Setting {
        compiler: "clang++",
        flags: &["-std=c++17", "-O0", "-DKERNELS"],
        most_operations: usize::MAX,
    },
];

/// The settings of long runs.
const ALL_SETTINGS: [Setting; 4] = [
    Setting {
        compiler: "g++",
        flags: &["-std=c++17", "-O2", "-DKERNELS"],
        most_operations: usize::MAX,
    },
    Setting {
        compiler: "clang++",
        flags: &["-std=c++17", "-O2", "-DKERNELS"],
        most_operations: usize::MAX,
    },
    Setting {
        compiler: "g++",
        flags: &["-std=gnu++17", "-O3", "-march=native", "-ffp-contract=fast"],
        most_operations: usize::MAX,
    },
    Setting {
        compiler: "clang++",
        flags: &["-std=gnu++17", "-O3", "-march=native", "-ffp-contract=fast"],
        most_operations: usize::MAX,
    },
];

/// Those that can be tried here; says which can't.
///
/// # Panics
/// If one is missing and `RTSL_REQUIRE_CXX` is 1.
pub fn settings() -> Vec<Setting> {
    let is_required = std::env::var_os("RTSL_REQUIRE_CXX").is_some_and(|value| value == "1");
    let is_there = |setting: &Setting| {
        let version = Command::new(setting.compiler).arg("--version").output();
        let is_there = version.is_ok_and(|output| output.status.success());
        assert!(is_there || !is_required, "{} is not installed", setting.compiler);
        if !is_there {
            println!("{} is not installed: its C++ is not tested", setting.compiler);
        }
        is_there
    };
    let settings = if is_long_run() { Vec::from(ALL_SETTINGS) } else { Vec::from(SETTINGS) };
    settings.into_iter().filter(is_there).collect()
}

impl Setting {
    /// True if a subject is not too long for it.
    pub fn takes(&self, subject: &Subject) -> bool {
        subject.operations() <= self.most_operations
    }

    /// Builds the program and runs it on these words; what it writes.
    pub fn run(&self, text: &str, headers: &BTreeMap<String, String>, words: &[u32]) -> Vec<u32> {
        let name: String = self.to_string().replace([' ', '+', '='], "_");
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::create_dir_all(&folder).unwrap();
        for (name, text) in headers {
            std::fs::write(folder.join(name), text).unwrap();
        }
        std::fs::write(folder.join("main.cpp"), text).unwrap();
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        std::fs::write(folder.join("input"), bytes).unwrap();
        let mut compile = Command::new(self.compiler);
        compile.args(self.flags);
        compile.args(["main.cpp", "-o", "program"]).current_dir(&folder);
        run(&mut compile, self);
        let program = folder.join("program");
        run(Command::new(program).args(["input", "output"]).current_dir(&folder), self);
        let bytes = std::fs::read(folder.join("output")).unwrap();
        bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect()
    }
}

fn run(command: &mut Command, setting: &Setting) {
    let output = command.output().unwrap();
    let message: String = String::from_utf8_lossy(&output.stderr).chars().take(4000).collect();
    assert!(output.status.success(), "{setting}, {command:?}: {message}");
}

impl Display for Setting {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        write!(out, "{} {}", self.compiler, self.flags.join(" "))
    }
}
