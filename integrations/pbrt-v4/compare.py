#!/usr/bin/env python3
"""Renders scenes with pbrt's own classes, with RTSL classes in pbrt, and with rtsl itself, and compares the pictures.

    python3 compare.py --pbrt BUILD/pbrt --rtsl target/release/rtsl --out comparison

pbrt is one that was built from a checkout that patch.py patched; imgtool is taken from beside it. Each picture is rendered
several times with different seeds, which tells how much of a difference is noise. Needs numpy, and a C compiler to link the
library of shaders.
"""

import argparse
import itertools
import re
import resource
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy

import pictures

SCENES = Path(__file__).resolve().parent / "scenes"

# Classes that the scenes name, and what their references to textures are bound to.
CLASSES = [
    "Sphere", "Torus", "Lambertian", "Ward", "Dielectric", "SchlickDielectric", "Emissive", "Checker", "ThinLens",
    "SpotLight", "SkyLight",
]  # fmt: skip
BINDINGS = ["Lambertian.kd=Constant", "Ward.kd=Constant", "Ward.ks=Constant"]

# How scenes for pbrt name an RTSL class; scenes for rtsl have the name alone.
CLASS_IN_PBRT = re.compile(r'"rtsl"\s+"string library"\s+"[^"]*"\s+"string class"\s+("[^"]+")')

# Pixels along a block's side.
BLOCK = 8

# The three ways to render a scene, and how the table calls them.
OWN, RTSL_IN_PBRT, RTSL = "pbrt", "pbrt+rtsl", "rtsl"


class Failure(Exception):
    """A command that failed."""


def run(command: list) -> float:
    """Runs a command; the seconds of all processors that it took, which other load does not change much."""
    words = [str(word) for word in command]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(words, capture_output=True, text=True)
    except OSError as error:
        raise Failure(f"{words[0]}: {error}") from error
    if done.returncode != 0:
        raise Failure(f"{' '.join(words)}\n{done.stderr or done.stdout}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


@dataclass
class Tools:
    """The programs, and where what they write goes."""

    pbrt: Path
    imgtool: Path
    rtsl: str
    cc: str
    out: Path
    threads: int

    def build_library(self) -> None:
        """The shared library that the scenes name."""
        objects, library = self.out / "shaders.o", self.out / "shaders.so"
        bindings = itertools.chain.from_iterable(("--bind", binding) for binding in BINDINGS)
        run([self.rtsl, "build", *CLASSES, "--emit", "obj", *bindings, "-o", objects])
        run([self.cc, "-shared", "-o", library, objects, "-lm"])

    def render(self, way: str, scene: Path, spp: int, seed: int) -> tuple[numpy.ndarray, float]:
        """A picture, and the seconds that it took."""
        exr = self.out / f"{scene.stem}.exr"
        if way == RTSL:
            command = [self.rtsl, "render", scene, "--renderer", "batch", "--threads", self.threads]
            seconds = run([*command, "--spp", spp, "--seed", seed, "-o", exr])
        else:
            command = [self.pbrt, "--quiet", "--nthreads", self.threads, "--disable-texture-filtering"]
            seconds = run([*command, "--spp", spp, "--seed", seed, "--outfile", exr, scene])
        pfm = exr.with_suffix(".pfm")
        run([self.imgtool, "convert", "--outfile", pfm, exr])
        return pictures.read_pfm(pfm), seconds


@dataclass
class Rendered:
    """What one way to render a scene gave: a picture for each seed."""

    pictures: numpy.ndarray
    seconds: float

    def mean(self) -> numpy.ndarray:
        return self.pictures.mean(axis=0)

    def blocks(self) -> numpy.ndarray:
        """The mean colour of each block of pixels, for each seed."""
        count, height, width, channels = self.pictures.shape
        rows, columns = height // BLOCK, width // BLOCK
        whole = self.pictures[:, : rows * BLOCK, : columns * BLOCK]
        return whole.reshape(count, rows, BLOCK, columns, BLOCK, channels).mean(axis=(2, 4))


@dataclass
class Difference:
    """How two ways differ: the mean and its standard error, and the colours of blocks in standard errors."""

    relative: float
    relative_error: float
    root_mean_square: float
    greatest: float
    beyond_three: float

    @classmethod
    def between(cls, one: Rendered, other: Rendered) -> "Difference":
        a, b = one.blocks(), other.blocks()
        seeds = a.shape[0]
        variance = (a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / seeds
        difference = b.mean(axis=0) - a.mean(axis=0)
        # What is the same in all pictures, such as a sky of one colour, still has their rounding.
        error = numpy.sqrt(numpy.maximum(variance, (1e-4 * a.mean()) ** 2))
        scores = numpy.abs(difference / error)
        means = [blocks.mean(axis=(1, 2, 3)) for blocks in (a, b)]
        mean_error = numpy.sqrt(sum(mean.var(ddof=1) / seeds for mean in means))
        return cls(
            relative=difference.mean() / a.mean(),
            relative_error=mean_error / a.mean(),
            root_mean_square=numpy.sqrt((scores**2).mean()),
            greatest=scores.max(),
            beyond_three=(scores > 3).mean(),
        )

    def row(self) -> str:
        mean = f"{100 * self.relative:+9.3f} {100 * self.relative_error:7.3f}"
        return f"{mean} {self.root_mean_square:9.2f} {self.greatest:9.2f} {100 * self.beyond_three:9.2f}"


def scene_files(name: str, out: Path) -> dict[str, Path]:
    """The scene as each way to render it reads it."""
    files = {}
    own, rtsl = SCENES / f"{name}.own.pbrt", SCENES / f"{name}.rtsl.pbrt"
    if own.exists():
        files[OWN] = out / own.name
        files[OWN].write_text(own.read_text())
    files[RTSL_IN_PBRT] = out / rtsl.name
    files[RTSL_IN_PBRT].write_text(rtsl.read_text())
    files[RTSL] = out / f"{name}.batch.pbrt"
    files[RTSL].write_text(CLASS_IN_PBRT.sub(r"\1", rtsl.read_text()))
    return files


def compare_scene(name: str, tools: Tools, spp: int, seeds: int) -> dict[str, Rendered]:
    """Renders a scene in all ways, and prints how they differ."""
    rendered = {}
    for number, (way, scene) in enumerate(scene_files(name, tools.out).items()):
        # No two pictures share a seed: their noise is their own.
        first = 1 + number * seeds
        results = [tools.render(way, scene, spp, seed) for seed in range(first, first + seeds)]
        stack = numpy.stack([picture for picture, _ in results])
        rendered[way] = Rendered(stack, sum(seconds for _, seconds in results))
    reference = next(iter(rendered))
    for way, result in rendered.items():
        row = "" if way == reference else Difference.between(rendered[reference], result).row()
        print(f"{name:11} {way:10} {result.mean().mean():9.5f} {result.seconds:8.1f} {row}", flush=True)
    return rendered


def write_sheet(name: str, rendered: dict[str, Rendered], out: Path) -> None:
    """The pictures side by side, and their differences from the first, eight times, on grey."""
    means = [result.mean() for result in rendered.values()]
    exposure = 0.6 / numpy.percentile(means[0], 90)
    row = [pictures.to_bytes(exposure * mean) for mean in means]
    row += [pictures.difference_bytes(exposure * (mean - means[0]), gain=8) for mean in means[1:]]
    pictures.write_png(out / f"{name}.png", numpy.concatenate(row, axis=1))


def parse_arguments() -> argparse.Namespace:
    names = sorted({path.name.split(".")[0] for path in SCENES.glob("*.rtsl.pbrt")})
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pbrt", type=Path, required=True, help="the patched pbrt")
    parser.add_argument("--imgtool", type=Path, help="pbrt's imgtool; from beside pbrt if not given")
    parser.add_argument("--rtsl", default="rtsl", help="the rtsl binary")
    parser.add_argument("--cc", default="cc", help="the C compiler, which links")
    parser.add_argument("--out", type=Path, default=Path("comparison"), help="folder for what is rendered")
    parser.add_argument("--spp", type=int, default=64, help="samples of a pixel for each seed")
    parser.add_argument("--seeds", type=int, default=8, help="pictures of each scene in each way; at least 2")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"of {', '.join(names)}; all if not given")
    arguments = parser.parse_args()
    arguments.scenes = arguments.scenes or names
    unknown = sorted(set(arguments.scenes) - set(names))
    if unknown:
        parser.error(f"no scene {', '.join(unknown)}; there are {', '.join(names)}")
    if arguments.seeds < 2:
        parser.error("--seeds must be at least 2: their spread tells what is noise")
    return arguments


def main() -> int:
    arguments = parse_arguments()
    arguments.out.mkdir(parents=True, exist_ok=True)
    imgtool = arguments.imgtool or arguments.pbrt.with_name("imgtool")
    tools = Tools(arguments.pbrt, imgtool, arguments.rtsl, arguments.cc, arguments.out, arguments.threads)
    print(f"{'scene':11} {'by':10} {'mean':>9} {'cpu s':>8} {'mean %':>9} {'+- %':>7} {'rms':>9} {'greatest':>9} {'% over 3':>9}")
    try:
        tools.build_library()
        for name in arguments.scenes:
            write_sheet(name, compare_scene(name, tools, arguments.spp, arguments.seeds), arguments.out)
    except Failure as error:
        print(f"compare.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
