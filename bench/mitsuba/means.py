"""Whether both systems render the same picture, and one sheet a scene to see it."""

from dataclasses import dataclass
from pathlib import Path

import mitsuba
import numpy

from systems import Task, read_exr

CHANNELS = ("red", "green", "blue")
# Means may be this many standard errors of their difference apart,
TOLERANCE = 4.0
# and Mitsuba's besides lower by this part of it: along the rims of rough metal spheres it is darker, by a hundredth there and 4 parts in
# 10,000 over the picture. The same model integrated in double precision sides with RTSL (docs/src/explanation/performance/mitsuba.md).
RIM_ALLOWANCE = {"metals": 1e-3, "metals_area": 1e-3}
# Differences are shown this much larger, around grey.
DIFFERENCE_GAIN = 8.0
# Pixels along the side of the blocks whose means are compared.
BLOCK = 16


class Estimate:
    """A picture as the mean of independent renders."""

    def __init__(self, renders: list[numpy.ndarray]):
        stack = numpy.stack(renders)
        self.mean = stack.mean(axis=0)
        # Of the mean, pixel by pixel.
        self.variance = stack.var(axis=0, ddof=1) / len(renders)

    @classmethod
    def of(cls, system, task: Task, renders: int, work: Path) -> "Estimate":
        pictures = []
        for number in range(renders):
            out = work / f"{task.scene}-{system.name}-{number}.exr"
            seeded = Task(task.scene, task.size, task.samples, task.seed + number, task.threads)
            system.render(seeded, out)
            pictures.append(read_exr(out))
        return cls(pictures)


@dataclass(frozen=True)
class Channel:
    name: str
    means: tuple[float, float]
    standard_errors: tuple[float, float]

    @property
    def difference(self) -> float:
        return self.means[0] - self.means[1]

    @property
    def standard_error(self) -> float:
        """That of the difference."""
        return float(numpy.hypot(*self.standard_errors))

    @property
    def deviation(self) -> float:
        """The difference in standard errors."""
        return self.difference / self.standard_error

    def agrees(self, scene: str) -> bool:
        """Whether the difference, RTSL's mean less Mitsuba's, is explained."""
        noise = TOLERANCE * self.standard_error
        allowance = RIM_ALLOWANCE.get(scene, 0.0) * self.means[1]
        return -noise <= self.difference <= noise + allowance


@dataclass(frozen=True)
class Agreement:
    """What is 1 where differences are noise: mean squares in units of the variance that is expected."""

    pixels: float
    blocks: float


def channels(one: Estimate, other: Estimate) -> list[Channel]:
    pixels = one.mean.shape[0] * one.mean.shape[1]

    def errors(index: int) -> tuple[float, float]:
        both = (estimate.variance[..., index].sum() for estimate in (one, other))
        return tuple(float(numpy.sqrt(variance) / pixels) for variance in both)

    return [
        Channel(
            name,
            (float(one.mean[..., index].mean()), float(other.mean[..., index].mean())),
            errors(index),
        )
        for index, name in enumerate(CHANNELS)
    ]


def agreement(one: Estimate, other: Estimate) -> Agreement:
    difference = one.mean - other.mean
    variance = one.variance + other.variance

    def mean_square(side: int) -> float:
        sums, expected = (block_sums(image, side) for image in (difference, variance))
        # Where nothing scatters light both systems give the same number, without noise.
        noisy = expected > 1e-12 * side * side
        return float((sums[noisy] ** 2).sum() / expected[noisy].sum())

    return Agreement(mean_square(1), mean_square(BLOCK))


def block_sums(image: numpy.ndarray, side: int) -> numpy.ndarray:
    rows, columns = (length // side for length in image.shape[:2])
    whole = image[: rows * side, : columns * side]
    return whole.reshape(rows, side, columns, side, -1).sum(axis=(1, 3))


def write_sheet(one: Estimate, other: Estimate, path: Path) -> None:
    """Both pictures and their difference, side by side."""
    difference = 0.5 + DIFFERENCE_GAIN * (one.mean - other.mean)
    srgb = [bitmap_bytes(estimate.mean) for estimate in (one, other)]
    grey = numpy.clip(255.0 * difference + 0.5, 0, 255).astype(numpy.uint8)
    mitsuba.Bitmap(numpy.concatenate([*srgb, grey], axis=1)).write(str(path))


def bitmap_bytes(image: numpy.ndarray) -> numpy.ndarray:
    bitmap = mitsuba.Bitmap(image.astype(numpy.float32))
    return numpy.array(
        bitmap.convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.UInt8, True)
    )


def compare_means(systems: list, task: Task, renders: int, work: Path, out: Path) -> bool:
    """Prints the table of a scene; whether all its channels agree."""
    one, other = (Estimate.of(system, task, renders, work) for system in systems)
    sheet = out / f"{task.scene}.png"
    write_sheet(one, other, sheet)
    rows = channels(one, other)
    agrees = agreement(one, other)
    print(f"\n{task.scene}: {renders} renders of {task.samples} samples, {sheet}")
    print(f"{'':8}{systems[0].name:>20}{systems[1].name:>20}   difference")
    for row in rows:
        values = "".join(
            f"{mean:12.5f} ±{error:.5f}" for mean, error in zip(row.means, row.standard_errors)
        )
        part = row.difference / row.means[1]
        print(f"{row.name:8}{values}   {row.deviation:+.2f} standard errors, {part:+.2e} of the mean")
    print(
        f"differences squared over their variance: pixels {agrees.pixels:.2f}, "
        f"blocks of {BLOCK} by {BLOCK} {agrees.blocks:.2f}"
    )
    if task.scene in RIM_ALLOWANCE:
        print(f"{systems[1].name} may be darker by {RIM_ALLOWANCE[task.scene]:g} of the mean besides, at rims")
    return all(row.agrees(task.scene) for row in rows)
