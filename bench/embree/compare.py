#!/usr/bin/env python3
"""Compares the speed of `rtsl bench` with Embree: rays of cameras and random rays, on one thread.

Both read the same scenes, which `make_scene` writes. The C compiler is that of the environment variable CC, or `cc`.
"""

import argparse
import csv
import datetime
import json
import os
import platform
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
ADAPTER = REPOSITORY / "integrations" / "embree"
# Names in tables, and the arguments of make_scene.
SCENES = {
    "10 thousand spheres": ("spheres", "10000", "0.4"),
    "terrain, 1 million triangles": ("terrain", "708"),
}
# Kinds of rays: the rival's name, and that of `rtsl bench`.
RAYS = {"camera": "primary", "random": "random"}
# RTSL's code may use any instructions of the machine, and so may the rival's.
FLAGS = ["-std=c11", "-O3", "-march=native", "-mprefer-vector-width=512", "-Wall", "-Wextra"]
# GCC makes vector code of the test of spheres with this option alone.
FLAGS_OF_SPHERES = ["-ffast-math"]
COLUMNS = "scene", "rays", "RTSL", "Embree", "packet of Embree", "ratio", "range of the ratio"


def positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise ValueError
    return number


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("--scenes", nargs="+", choices=[*SCENES], default=[*SCENES])
    parser.add_argument("--rounds", type=positive, default=5, help="turns of both programs")
    parser.add_argument(
        "--repetitions", type=positive, default=9, help="of each measurement in a turn"
    )
    parser.add_argument("--processor", type=int, help="the processor that both run on")
    parser.add_argument("--rtsl", type=Path, help="a built rtsl; without it, one is built")
    parser.add_argument(
        "--out", type=Path, default=REPOSITORY / "target" / "embree", help="folder for the table"
    )
    return parser.parse_args()


def run(command: list) -> str:
    """The output of a program, which must succeed."""
    words = [str(word) for word in command]
    done = subprocess.run(words, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"compare.py: `{' '.join(words)}` failed")
    return done.stdout


def build_rival(folder: Path) -> Path:
    compiler, rival = os.environ.get("CC", "cc"), folder / "rival"
    spheres, objects = folder / "hand_sphere.o", [HERE / "rival.c", HERE / "rays.c"]
    objects += [HERE / "scene_file.c", ADAPTER / "embree.c"]
    source = ADAPTER / "hand_sphere.c"
    run([compiler, *FLAGS, *FLAGS_OF_SPHERES, "-c", source, "-o", spheres])
    run([compiler, *FLAGS, *objects, spheres, "-o", rival, "-ldl", "-lm"])
    return rival


def build_rtsl(given: Path | None) -> Path:
    if given:
        return given.resolve() if given.is_file() else sys.exit(f"compare.py: no file `{given}`")
    run(["cargo", "build", "--release", "--package", "rtsl-cli"])
    target = os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target")
    return Path(target) / "release" / "rtsl"


def make_scene(words: tuple[str, ...], out: Path) -> None:
    command = ["cargo", "run", "--quiet", "--release", "--package", "rtsl-bench"]
    run([*command, "--example", "make_scene", "--", *words, out])


@dataclass
class Speeds:
    """Millions of rays per second of a kind of ray: an element for each turn."""

    rtsl: list[float] = field(default_factory=list)
    embree: list[float] = field(default_factory=list)
    packets: list[int] = field(default_factory=list)

    def row(self, scene: str, rays: str) -> list:
        """The fastest turn of each program, the ratio of the two, and the range of ratios within turns."""
        best = self.embree.index(max(self.embree))
        ratios = [one / other for one, other in zip(self.rtsl, self.embree)]
        ratio = max(self.rtsl) / self.embree[best]
        speeds = [f"{max(self.rtsl):.1f}", f"{self.embree[best]:.1f}", self.packets[best]]
        return [scene, rays, *speeds, f"{ratio:.2f}", f"{min(ratios):.2f} to {max(ratios):.2f}"]


class Turns:
    """Both programs on one scene."""

    def __init__(self, options: argparse.Namespace, rtsl: Path, rival: Path, scene: Path):
        on = [] if options.processor is None else ["taskset", "-c", options.processor]
        repetitions = options.repetitions
        self.rtsl = [*on, rtsl, "bench", scene, "--threads", 1, "--json"]
        self.rtsl += ["--repetitions", repetitions]
        self.rival = [*on, rival, scene, repetitions]
        self.version = ""

    def turn(self, speeds: dict[str, Speeds]) -> None:
        """Adds the speeds of the fastest repetitions, of the rival those of its fastest packets."""
        measured = json.loads(run(self.rtsl))["rays"]
        by_kind = {of["kind"]: of["millionRaysPerSecond"] for of in measured}
        lines = [line.split() for line in run(self.rival).splitlines()]
        self.version = lines[0][1]
        for rays, kind in RAYS.items():
            of_rival = [(float(speed), int(packet)) for it, packet, speed, _ in lines[1:] if it == rays]
            speed, packet = max(of_rival)
            speeds[rays].rtsl.append(by_kind[kind]["ninetiethPercentile"])
            speeds[rays].embree.append(speed)
            speeds[rays].packets.append(packet)


def processor_name() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":")[1].strip() for line in lines if "model name" in line), "unknown")


def main() -> int:
    options = arguments()
    options.out.mkdir(parents=True, exist_ok=True)
    rival, rtsl = build_rival(options.out), build_rtsl(options.rtsl)
    rows, version = [], ""
    for number, name in enumerate(options.scenes):
        scene = options.out / f"scene{number}.pbrt"
        make_scene(SCENES[name], scene)
        turns, speeds = Turns(options, rtsl, rival, scene), {rays: Speeds() for rays in RAYS}
        for _ in range(options.rounds):
            turns.turn(speeds)
        version = turns.version
        rows += [of.row(name, rays) for rays, of in speeds.items()]
        for row in rows[-len(RAYS) :]:
            print("  ".join(f"{column}: {value}" for column, value in zip(COLUMNS, row)), flush=True)
    write_table(options, rows, version)
    return 0


def write_table(options: argparse.Namespace, rows: list, version: str) -> None:
    path = options.out / "embree-tracing.csv"
    command = f"bench/embree/compare.py --rounds {options.rounds}"
    with path.open("w", newline="", encoding="utf-8") as file:
        print(f"# date: {datetime.date.today()}", file=file)
        print(f"# machine: one thread of a {processor_name()}", file=file)
        print(f"# software: Embree {version}", file=file)
        print(f"# command: {command} --repetitions {options.repetitions}", file=file)
        print("# unit: million rays per second; the fastest repetition of all turns", file=file)
        print("# ratios: of the two speeds, and the range of those of single turns", file=file)
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows(rows)
    print(f"written: {path}")


if __name__ == "__main__":
    raise SystemExit(main())
