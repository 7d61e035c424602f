"""Error over time, against the mean of long renders by both systems."""

import csv
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy

from systems import Task, read_exr

REPETITIONS = 3
# The seeds of long renders are others than those of the rest.
REFERENCE_SEED = 1000


@dataclass(frozen=True)
class Point:
    scene: str
    system: str
    samples: int
    seconds: float
    error: float


def reference(systems: list, task: Task, work: Path) -> numpy.ndarray:
    """Both have the same part in it, so that it favours neither."""
    pictures = []
    for system in systems:
        out = work / f"{task.scene}-{system.name}-reference.exr"
        system.render(task, out)
        pictures.append(read_exr(out))
    return numpy.mean(pictures, axis=0)


def measure(system, task: Task, truth: numpy.ndarray, work: Path) -> Point:
    """The median of some renders' times, and the root of their mean squared error."""
    out = work / f"{task.scene}-{system.name}-error.exr"
    seconds, squares = [], []
    for number in range(REPETITIONS):
        seeded = Task(task.scene, task.size, task.samples, task.seed + number, task.threads)
        seconds.append(system.render(seeded, out).seconds)
        squares.append(numpy.mean((read_exr(out) - truth) ** 2))
    error = float(numpy.sqrt(numpy.mean(squares)))
    return Point(task.scene, system.name, task.samples, median(seconds), error)


def compare_error(systems: list, task: Task, work: Path) -> list[Point]:
    """Prints the table of a scene. The task's samples are those of the reference."""
    longest = Task(task.scene, task.size, task.samples, REFERENCE_SEED, task.threads)
    truth = reference(systems, longest, work)
    print(f"\n{task.scene}, reference: {task.samples} samples of each, threads: {task.threads}")
    print(f"{'samples':>8}" + "".join(f"{it.name + ' s':>12}{'error':>10}" for it in systems))
    points = []
    samples = 1
    # The reference's own error must be small beside what is measured.
    while 8 * samples <= task.samples:
        shorter = Task(task.scene, task.size, samples, task.seed, task.threads)
        row = [measure(system, shorter, truth, work) for system in systems]
        print(f"{samples:>8}" + "".join(f"{it.seconds:12.3f}{it.error:10.4f}" for it in row))
        points += row
        samples *= 4
    print(f"time to the same error, {systems[1].name} to {systems[0].name}: {same_error(points):.2f}")
    return points


def same_error(points: list[Point]) -> float:
    """How many times as long the second system takes to the error of the first's longest render.

    Its own longest render tells: error falls with the root of time.
    """
    first, second = points[-2:]
    return second.seconds * (second.error / first.error) ** 2 / first.seconds


def write_table(points: list[Point], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["scene", "system", "samples", "seconds", "error"])
        for point in points:
            figures = f"{point.seconds:.4g}", f"{point.error:.4g}"
            table.writerow([point.scene, point.system, point.samples, *figures])
