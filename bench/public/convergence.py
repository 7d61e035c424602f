"""Error over time on public scenes, against the mean of long renders by both systems."""

from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

import numpy

from error import REFERENCE_SEED, REPETITIONS, Point, reference, same_error
from renderers import Picture
from systems import read_exr

# Of the mean of the picture, added to pixels that errors are divided by.
DARK_PART = 0.1
# The greatest squared relative error of a pixel: single bright samples would hide all others.
CLIP = 4.0
# The reference has so many times the samples of what is measured, at least.
REFERENCE_FACTOR = 8


@dataclass(frozen=True)
class RelativePoint(Point):
    """A point with the root of the mean clipped relative squared error besides."""

    relative: float

    def as_relative(self) -> Point:
        return Point(self.scene, self.system, self.samples, self.seconds, self.relative)


def relative_square(picture: numpy.ndarray, truth: numpy.ndarray) -> float:
    """The mean clipped square of errors relative to the true values."""
    base = truth + DARK_PART * truth.mean()
    return float(numpy.minimum(((picture - truth) / base) ** 2, CLIP).mean())


def measure(system, task: Picture, truth: numpy.ndarray, work: Path) -> RelativePoint:
    """The median of some renders' times, and the roots of their mean squared errors."""
    out = work / f"{system.name}-error.exr"
    seconds, squares, relative = [], [], []
    for number in range(REPETITIONS):
        seconds.append(system.render(replace(task, seed=task.seed + number), out).seconds)
        picture = read_exr(out)
        squares.append(numpy.mean((picture - truth) ** 2))
        relative.append(relative_square(picture, truth))
    errors = [float(numpy.sqrt(numpy.mean(it))) for it in (squares, relative)]
    scene = task.scene
    return RelativePoint(scene, system.name, task.samples, median(seconds), errors[0], errors[1])


def disagreement(systems: list, task: Picture, work: Path) -> float:
    """The root mean square of half the difference of the long renders: errors do not fall below it
    where the pictures differ by more than noise."""
    files = [work / f"{task.scene}-{it.name}-reference.exr" for it in systems]
    one, other = (read_exr(path) for path in files)
    return float(numpy.sqrt(numpy.mean((0.5 * (one - other)) ** 2)))


def compare_convergence(systems: list, task: Picture, work: Path) -> list[RelativePoint]:
    """Prints the table of a scene. The task's samples are those of each system's long render."""
    for system in systems:
        # What it compiles is no part of a render's time.
        system.first_render(replace(task, samples=1))
    truth = reference(systems, replace(task, seed=REFERENCE_SEED), work)
    print(
        f"\n{task.scene}, error over time; reference: {task.samples} samples of each, which differ "
        f"from it by {disagreement(systems, task, work):.4f}; threads: {task.threads}"
    )
    columns = "".join(f"{it.name + ' s':>12}{'RMSE':>10}{'relative':>10}" for it in systems)
    print(f"{'samples':>8}{columns}{'to the same RMSE':>18}{'relative':>10}")
    points: list[RelativePoint] = []
    samples = 1
    while REFERENCE_FACTOR * samples <= task.samples:
        row = [measure(it, replace(task, samples=samples), truth, work) for it in systems]
        points += row
        cells = "".join(f"{it.seconds:12.3f}{it.error:10.4f}{it.relative:10.4f}" for it in row)
        ratio, relative = same_error(row), same_error([it.as_relative() for it in row])
        print(f"{samples:>8}{cells}{ratio:>18.2f}{relative:>10.2f}", flush=True)
        samples *= 4
    print(f"to the same error: time of {systems[1].name}, over that of {systems[0].name}")
    return points
