"""Profiles of RTSL's renders by `perf`: the parts of compiled code, the traversal and others.

Samples are sorted by the function that they lie in. A release build has the names of functions.
With `RUSTFLAGS="-Csymbol-mangling-version=v0" cargo build --release --package rtsl-cli` they have
type arguments too, which tell the traversal's loops over vectors from those of other crates;
without, all count as traversal.
"""

import re
import shutil
import subprocess
import tempfile
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

from renderers import FIRST_THREADS, Picture, Rtsl

CLASSES = "compiled", "traversal", "glue", "libc", "compiler", "system"
TITLES = {
    "compiled": "compiled code",
    "traversal": "traversal",
    "glue": "rest of RTSL",
    "libc": "C library",
    "compiler": "compiler",
    "system": "kernel",
}
TRAVERSAL = {"rtsl_bvh"}
COMPILER = {
    "rtsl_source", "rtsl_spec", "rtsl_syntax", "rtsl_ir", "rtsl_sema", "rtsl_lower", "rtsl_opt",
    "rtsl_stages", "rtsl_link", "rtsl_integrate", "rtsl_packet", "rtsl_llvm", "rtsl_cpp",
    "rtsl_jit",
}  # fmt: skip
CRATE = re.compile(r"rtsl_[a-z]+")
# Modules of `rtsl_render` that are parts of the search, in demangled and mangled names.
SEARCH = re.compile(
    r"(?:::|\d)(?:search|searcher|searched_objects|kernel_search|placed_objects|intersection|"
    r"pair_blocks|fours|mask_bits)(?:::|\d|\b)"
)
VECTORS = "fearless_simd"
LIBC = re.compile(r"/(?:libc|libm|libpthread|ld-linux[^/]*)[.-][^/]*$")
SAMPLE = re.compile(r"^\s*(\d+\.\d+):\s+[0-9a-f]+ (.*) \(([^()]*(?:\([^()]*\))?)\)$")
FREQUENCY = 1999
# Seconds after the first tile that are not counted: the compilation may overlap with them.
SETTLING = 0.15
# Seconds that the render should take.
LENGTH = 3.0
GREATEST_FACTOR = 1024


class NoProfile(Exception):
    """The reason why there is no profile."""


@dataclass(frozen=True)
class Profile:
    """The parts of each class in the render with optimised kernels, and the part of the compiler in
    a whole run at the usual settings."""

    scene: str
    samples: int
    parts: dict[str, float]
    compiler_of_run: float


def program_name(program: Path) -> str:
    return program.resolve().name


def class_of(symbol: str, library: str, program: str) -> str:
    """The class of a sample by its function and the file that this is in."""
    if "kernel" in library or library.startswith("["):
        # Memory without a file is that of compiled code, kernel modules are in brackets as well.
        return "compiled" if library in ("[unknown]", "[JIT]", "[anon]") else "system"
    if "libLLVM" in library or "librustc" in library:
        return "compiler"
    if library.startswith("//anon") or "/perf-" in library or "memfd" in library:
        return "compiled"
    if LIBC.search(library):
        return "libc"
    if not library.endswith(program):
        return "system"
    return class_of_own(symbol)


def class_of_own(symbol: str) -> str:
    """The class of a function of the program itself."""
    crates = CRATE.findall(symbol)
    if TRAVERSAL & set(crates):
        return "traversal"
    if "rtsl_render" in crates and SEARCH.search(symbol):
        return "traversal"
    if crates:
        return "compiler" if crates[0] in COMPILER else "glue"
    return "traversal" if VECTORS in symbol else "glue"


def check() -> None:
    """Raises `NoProfile` where `perf` is missing or may not be used."""
    if not shutil.which("perf"):
        raise NoProfile("no profile: `perf` is not installed (linux-perf or linux-tools)")
    words = ["perf", "record", "-q", "-e", "cpu-clock", "-o", "/dev/null", "true"]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        remedy = "allow it by `sysctl kernel.perf_event_paranoid=2`"
        raise NoProfile(f"no profile: `perf` is not allowed here; {remedy}")


class Recorder:
    """Records renders of one scene."""

    def __init__(self, rtsl: Rtsl, work: Path):
        self.rtsl = rtsl
        self.work = work
        self.program = program_name(rtsl.program)

    def record(self, task: Picture, options: list[str]) -> tuple[list[tuple[float, str]], dict]:
        """The time since the start and the class of each sample, and the render's statistics."""
        data = self.work / "perf.data"
        prefix = [
            "perf",
            "record",
            "-q",
            "-e",
            "cpu-clock",
            "-F",
            str(FREQUENCY),
            "-o",
            str(data),
            "--",
        ]
        recording = Recording(self.rtsl, prefix)
        with tempfile.TemporaryDirectory(dir=self.work) as cache:
            statistics = recording.statistics(task, None, options, Path(cache))
        words = ["perf", "script", "-i", data, "-F", "time,ip,sym,dso"]
        done = subprocess.run([str(it) for it in words], capture_output=True, text=True)
        found = [
            match.groups() for line in done.stdout.splitlines() if (match := SAMPLE.match(line))
        ]
        if not found:
            raise NoProfile("no profile: `perf script` printed no samples")
        start = float(found[0][0])
        return [
            (float(time) - start, class_of(symbol, library, self.program))
            for time, symbol, library in found
        ], statistics

    def profile(self, task: Picture) -> Profile:
        # A short render tells how many samples the recorded one needs.
        trial = self.rtsl.render(task)
        factor = max(1, min(GREATEST_FACTOR, round(LENGTH / max(trial.seconds, 1e-3))))
        longer = replace(task, samples=factor * task.samples)
        samples, statistics = self.record(longer, ["--optimise", "first"])
        begin = statistics["cold_start_seconds"] + SETTLING
        end = statistics["cold_start_seconds"] + statistics["render_seconds"]
        counts = Counter(kind for time, kind in samples if begin <= time <= end)
        total = max(counts.total(), 1)
        usual = replace(longer, threads=FIRST_THREADS)
        whole = Counter(kind for _, kind in self.record(usual, [])[0])
        return Profile(
            task.scene,
            counts.total(),
            {name: counts[name] / total for name in CLASSES},
            whole["compiler"] / max(whole.total(), 1),
        )


class Recording(Rtsl):
    """RTSL below another command."""

    def __init__(self, rtsl: Rtsl, prefix: list[str]):
        super().__init__(rtsl.program, rtsl.scene, rtsl.work)
        self.prefix = prefix

    def command(self, task: Picture, out: Path | None, options: list[str]) -> list[str]:
        return [*self.prefix, *super().command(task, out, options)]


def header(width: int) -> str:
    titles = "".join(f"{TITLES[name]:>15}" for name in CLASSES)
    return f"{'scene':{width}}{'samples':>9}{titles}{'compiler, whole run':>21}"


def row(profile: Profile, width: int) -> str:
    parts = "".join(f"{100 * profile.parts[name]:>13.0f} %" for name in CLASSES)
    compiler = f"{100 * profile.compiler_of_run:.0f} %"
    return f"{profile.scene:{width}}{profile.samples:>9}{parts}{compiler:>21}"
