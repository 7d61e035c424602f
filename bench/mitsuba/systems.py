"""The two systems, which render the same scenes by the same calls."""

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import mitsuba
import numpy

HERE = Path(__file__).parent
VARIANT = "llvm_ad_rgb"


class Failure(Exception):
    """What a user can do something about."""


@dataclass(frozen=True)
class Task:
    """One picture. Runs of a system with the same scene, size and threads may share what is compiled.

    The integrator is `path`, `direct` or `depth`, which traces camera rays alone.
    """

    scene: str
    size: int
    samples: int
    seed: int
    threads: int
    integrator: str = "path"

    @property
    def paths(self) -> int:
        return self.size * self.size * self.samples


@dataclass(frozen=True)
class Run:
    """What a render took; seconds without loading and compiling ahead."""

    seconds: float
    peak_memory_bytes: int


def read_exr(path: Path) -> numpy.ndarray:
    return numpy.array(mitsuba.Bitmap(str(path)), dtype=numpy.float64)[..., :3]


class Processors:
    """Those that this process may use, for children that shall have only some of them."""

    def __init__(self):
        self.numbers = sorted(os.sched_getaffinity(0))

    def limit(self, threads: int):
        return lambda: os.sched_setaffinity(0, self.numbers[:threads])


class Rtsl:
    """A process for each picture."""

    name = "RTSL"

    def __init__(
        self, program: Path, scenes: Path, work: Path, path: list[str], options: list[str]
    ):
        self.program = program
        self.scenes = scenes
        self.work = work
        self.options = options
        self.integrators = {
            "path": path,
            "direct": ["--integrator", "Direct"],
            "depth": ["--integrator", "Depth"],
        }
        self.processors = Processors()

    def render(self, task: Task, out: Path | None = None) -> Run:
        # Mitsuba's kernels are optimised too, by its first render.
        return self.run(task, out, ["--optimise", "first"])

    def run(self, task: Task, out: Path | None, options: list[str]) -> Run:
        statistics = self.work / "rtsl.json"
        picture = out or self.work / "rtsl.exr"
        command = [self.program, "--no-cache", "render", self.scenes / f"{task.scene}.pbrt"]
        command += ["-o", picture]
        command += ["--stats", statistics, "--seed", task.seed]
        command += ["--spp", task.samples, "--size", f"{task.size}x{task.size}"]
        command += ["--threads", task.threads, *self.integrators[task.integrator]]
        command += [*self.options, *options]
        done = subprocess.run(
            [str(word) for word in command],
            capture_output=True,
            text=True,
            preexec_fn=self.processors.limit(task.threads),
        )
        if done.returncode != 0:
            raise Failure(f"`{' '.join(map(str, command))}` failed:\n{done.stderr}")
        figures = json.loads(statistics.read_text())
        if figures["dropped_samples"]:
            raise Failure(f"{task.scene}: {figures['dropped_samples']} samples are not finite")
        return Run(figures["render_seconds"], figures["peak_memory_bytes"])

    def first_render(self, task: Task) -> tuple[float, Run]:
        start = time.perf_counter()
        run = self.run(task, None, [])
        return time.perf_counter() - start, run

    def close(self) -> None:
        pass


class Mitsuba:
    """A process for each scene, size and number of threads, which keeps what it has compiled."""

    name = "Mitsuba"

    def __init__(self, work: Path):
        self.work = work
        self.processors = Processors()
        self.workers: dict[tuple, subprocess.Popen] = {}

    def render(self, task: Task, out: Path | None = None) -> Run:
        worker = self.worker(task)
        picture = str(out) if out else None
        request = {"samples": task.samples, "seed": task.seed, "integrator": task.integrator}
        request |= {"out": picture}
        worker.stdin.write(json.dumps(request) + "\n")
        worker.stdin.flush()
        return Run(**self.answer(worker))

    def first_render(self, task: Task) -> tuple[float, Run]:
        """The time from the start of a process whose home has no kernels yet."""
        self.close()
        start = time.perf_counter()
        run = self.render(task)
        return time.perf_counter() - start, run

    def worker(self, task: Task) -> subprocess.Popen:
        key = task.scene, task.size, task.threads
        if key not in self.workers:
            self.close()
            self.start(*key)
        return self.workers[key]

    def command(self, scene: str, size, threads: int) -> list:
        """The program of a worker and its arguments."""
        return [HERE / "mitsuba_worker.py", VARIANT, scene, size, threads]

    def start(self, scene: str, size, threads: int) -> None:
        # Dr.Jit keeps kernels below the home folder.
        home = self.work / f"home-{time.monotonic_ns()}"
        home.mkdir()
        worker = subprocess.Popen(
            [sys.executable, *map(str, self.command(scene, size, threads))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=(self.work / "mitsuba.log").open("a"),
            text=True,
            env=os.environ | {"HOME": str(home)},
            preexec_fn=self.processors.limit(threads),
        )
        self.workers[scene, size, threads] = worker
        self.answer(worker)

    def answer(self, worker: subprocess.Popen) -> dict:
        line = worker.stdout.readline()
        if not line:
            raise Failure(f"Mitsuba ended; {self.work / 'mitsuba.log'} says why")
        return json.loads(line)

    def close(self) -> None:
        """Ends all workers, also those that do not answer: a waiting one holds memory, and its threads may still
        turn."""
        for worker in self.workers.values():
            worker.stdin.close()
            try:
                worker.wait(timeout=10)
            except subprocess.TimeoutExpired:
                worker.kill()
                worker.wait()
        self.workers.clear()
