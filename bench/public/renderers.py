"""RTSL, Mitsuba and pbrt, which render the same copy of a scene with the same settings."""

import json
import os
import re
import subprocess
import time
from dataclasses import dataclass, replace
from pathlib import Path

import systems
from systems import VARIANT, Failure, Processors, Run, Task

HERE = Path(__file__).resolve().parent
# The usual settings of a first picture.
FIRST_THREADS = 2
# The last seconds in the progress of pbrt, once the render has ended.
PBRT_SECONDS = re.compile(r"\((\d+(?:\.\d+)?)s\)")
# Shorter times of pbrt's own report are too coarse.
LEAST_REPORTED = 5.0


@dataclass(frozen=True)
class Picture(Task):
    """A task whose pictures have a width and a height."""

    @property
    def paths(self) -> int:
        return self.size[0] * self.size[1] * self.samples


@dataclass(frozen=True)
class FirstTile:
    """The seconds of RTSL's process until its first tile, and their parts."""

    seconds: float
    load: float
    compile: float
    build: float


@dataclass(frozen=True)
class PreparedScene:
    """The copy of a scene's file, and its conversion for Mitsuba."""

    name: str
    origin: Path
    file: Path
    converted: Path
    depth: int


def last_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].strip() if lines else "no message"


def first_error(text: str) -> str:
    """The first line of a diagnostic that is an error, else the last line."""
    errors = [line for line in text.splitlines() if line.startswith("error")]
    return errors[0] if errors else last_line(text)


class Rtsl:
    """RTSL: a process for each picture."""

    name = "RTSL"

    def __init__(self, program: Path, scene: PreparedScene, work: Path):
        self.program = program
        self.scene = scene
        self.work = work
        self.processors = Processors()

    def command(self, task: Task, out: Path | None, options: list[str]) -> list[str]:
        width, height = task.size
        words = [self.program, "render", self.scene.file, "-o", out or self.work / "rtsl.exr"]
        words += ["--stats", self.work / "rtsl.json", "--seed", task.seed, "--spp", task.samples]
        words += ["--size", f"{width}x{height}", "--threads", task.threads, "--color", "never"]
        words += ["--integrator", "Path", "-D", f"integrator.maxDepth={self.scene.depth - 1}"]
        words += ["-D", "integrator.rouletteThreshold=0", *options]
        return [str(word) for word in words]

    def statistics(self, task: Task, out: Path | None, options: list[str], cache: Path) -> dict:
        """Renders, and returns the content of the file of statistics."""
        command = self.command(task, out, options)
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            env=os.environ | {"RTSL_CACHE": str(cache)},
            preexec_fn=self.processors.limit(task.threads),
        )
        if done.returncode != 0:
            remedy = f"`rtsl scene info {self.scene.origin}` tells what is missing"
            raise Failure(f"RTSL: {first_error(done.stderr)}; {remedy}")
        return json.loads((self.work / "rtsl.json").read_text(encoding="utf-8"))

    def run(self, task: Task, out: Path | None, options: list[str]) -> Run:
        figures = self.statistics(task, out, options, self.work / "cache")
        return Run(figures["render_seconds"], figures["peak_memory_bytes"])

    def render(self, task: Task, out: Path | None = None) -> Run:
        """Renders with optimised kernels: Mitsuba's are optimised too, by its first render."""
        return self.run(task, out, ["--optimise", "first"])

    def first_render(self, task: Task) -> tuple[float, Run]:
        start = time.perf_counter()
        run = self.run(task, None, [])
        return time.perf_counter() - start, run

    def first_tile(self, task: Task, cache: Path) -> FirstTile:
        """The first tile at the usual settings, with a folder for the cache of kernels."""
        figures = self.statistics(replace(task, threads=FIRST_THREADS), None, [], cache)
        names = "cold_start_seconds", "load_seconds", "compile_seconds", "build_seconds"
        return FirstTile(*(figures[name] for name in names))

    def close(self) -> None:
        pass


class Mitsuba(systems.Mitsuba):
    """Mitsuba: a process for each scene and number of threads, which keeps what it has compiled."""

    def __init__(self, scene: PreparedScene, work: Path):
        super().__init__(work)
        self.scene = scene

    def command(self, scene: str, size: tuple[int, int], threads: int) -> list:
        return [HERE / "scene_worker.py", VARIANT, self.scene.converted, threads]

    def answer(self, worker: subprocess.Popen) -> dict:
        line = worker.stdout.readline()
        if not line:
            log = (self.work / "mitsuba.log").read_text(encoding="utf-8", errors="replace")
            raise Failure(
                f"Mitsuba: {last_line(log)}; a converted scene is limited by its features"
            )
        return json.loads(line)


class Pbrt:
    """pbrt-v4: a process for each picture. It always ends paths by Russian roulette."""

    name = "pbrt"

    def __init__(self, program: Path, scene: PreparedScene, work: Path):
        self.program = program
        self.scene = scene
        self.work = work
        self.processors = Processors()
        # Seconds of a render with one sample, by threads.
        self.least: dict[int, float] = {}

    def process(self, task: Task, out: Path) -> tuple[float, str, int]:
        """Renders; the seconds of the process, what it writes, and its peak memory."""
        words = [self.program, "--nthreads", task.threads, "--spp", task.samples]
        words += ["--seed", task.seed, "--outfile", out, self.scene.file]
        start = time.perf_counter()
        with (self.work / "pbrt.log").open("w+", encoding="utf-8", errors="replace") as log:
            process = subprocess.Popen(
                [str(word) for word in words],
                stdout=log,
                stderr=subprocess.STDOUT,
                preexec_fn=self.processors.limit(task.threads),
            )
            try:
                _, status, usage = os.wait4(process.pid, 0)
            except KeyboardInterrupt:
                process.kill()
                raise
            process.returncode = os.waitstatus_to_exitcode(status)
            seconds = time.perf_counter() - start
            log.seek(0)
            text = log.read()
        if process.returncode != 0:
            raise Failure(f"pbrt: {last_line(text)}; render the scene with pbrt alone to see more")
        return seconds, text, usage.ru_maxrss * 1024

    def render(self, task: Task, out: Path | None = None) -> Run:
        """Takes the time of pbrt's report, or for short renders that of the process less that of a
        render with one sample."""
        seconds, text, memory = self.process(task, out or self.work / "pbrt.exr")
        reported = PBRT_SECONDS.findall(text)
        if reported and float(reported[-1]) >= LEAST_REPORTED:
            return Run(float(reported[-1]), memory)
        if task.samples == 1:
            return Run(seconds, memory)
        if task.threads not in self.least:
            single = self.process(replace(task, samples=1), self.work / "pbrt.exr")
            self.least[task.threads] = single[0]
        rest = max(seconds - self.least[task.threads], 1e-3)
        return Run(rest * task.samples / (task.samples - 1), memory)

    def first_render(self, task: Task) -> tuple[float, Run]:
        start = time.perf_counter()
        run = self.render(task)
        return time.perf_counter() - start, run

    def close(self) -> None:
        pass
