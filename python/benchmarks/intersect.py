"""Ten million rays against a sphere: RTSL called from Python, the same by hand in numpy, and `rtsl bench`.

    python benchmarks/intersect.py [--rays N] [--rtsl PROGRAM]

Prints a table of nanoseconds for each ray, and the processor's name.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import platform
import shutil
import subprocess
import time
from typing import Callable, List, Optional, Tuple

import numpy as np

import rtsl


def rays(count: int) -> Tuple[np.ndarray, np.ndarray]:
    """Returns rays from around a camera into the cone of a sphere, half of which hit it."""
    random = np.random.default_rng(1)
    origins = np.zeros((count, 3), np.float32)
    origins[:, 2] = -5
    origins[:, :2] = random.random((count, 2), np.float32) * 0.2
    directions = np.ones((count, 3), np.float32)
    directions[:, :2] = (random.random((count, 2), np.float32) - 0.5) * 0.5
    return origins, directions


def by_numpy(origins: np.ndarray, directions: np.ndarray, radius: float) -> Tuple[np.ndarray, np.ndarray]:
    """The usual text-book intersection, in as few passes over the arrays as numpy has."""
    a = np.einsum("ij,ij->i", directions, directions)
    b = np.einsum("ij,ij->i", origins, directions)
    c = np.einsum("ij,ij->i", origins, origins) - np.float32(radius * radius)
    discriminant = b * b - a * c
    with np.errstate(invalid="ignore"):
        distance = (-b - np.sqrt(discriminant)) / a
    hit = (discriminant >= 0) & (distance > np.float32(1e-4))
    return hit, np.where(hit, distance, np.float32(np.inf))


def best_of(run: Callable[[], object], times: int = 5) -> float:
    """Returns the least time of several runs, in seconds, after one that does not count."""
    run()
    measured = []
    for _ in range(times):
        start = time.perf_counter()
        run()
        measured.append(time.perf_counter() - start)
    return min(measured)


def by_command_line(program: str) -> Optional[float]:
    """Returns the nanoseconds for a ray of one thread that `rtsl bench` measures for packets."""
    shader = pathlib.Path(__file__).parents[2] / "shaders" / "primitives" / "sphere.rtsl"
    command = [program, "bench", str(shader), "intersect", "--call-mode", "packet", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        print(done.stderr.strip())
        return None
    return min(float(json.loads(line)["nanosecondsPerLane"]) for line in done.stdout.splitlines())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--rays", type=int, default=10_000_000)
    parser.add_argument("--rtsl", default=shutil.which("rtsl"), help="the command line, for `rtsl bench`")
    options = parser.parse_args()
    origins, directions = rays(options.rays)
    sphere = rtsl.library.Sphere(radius=1)
    out = {"hit_distance": np.empty(options.rays, np.float32), "hit": np.empty(options.rays, bool)}
    columns = [np.asfortranarray(it) for it in (origins, directions)]
    processors = os.cpu_count() or 1
    copies = [np.empty_like(it) for it in (origins, directions)]
    runs: List[Tuple[str, Callable[[], object]]] = [
        ("numpy, a copy of the arrays", lambda: list(map(np.copyto, copies, (origins, directions)))),
        ("numpy, by hand", lambda: by_numpy(origins, directions, 1.0)),
        ("RTSL, 1 thread", lambda: sphere.intersect(origins, directions, threads=1)),
        ("RTSL, 1 thread, into given arrays", lambda: sphere.intersect(origins, directions, threads=1, out=out)),
        ("RTSL, 1 thread, the same from columns", lambda: sphere.intersect(*columns, threads=1, out=out)),
        (f"RTSL, {processors} threads, into given arrays", lambda: sphere.intersect(origins, directions, out=out)),
    ]
    rows = [(name, best_of(run)) for name, run in runs]
    hit, distance = by_numpy(origins, directions, 1.0)
    assert np.mean(hit == out["hit"]) > 0.9999
    both = hit & out["hit"]
    assert np.allclose(distance[both], out["hit_distance"][both], rtol=1e-2)
    print(f"{processor_name()}, {processors} processors, numpy {np.__version__}, LLVM {rtsl.info()['llvm']}")
    print(f"{options.rays:,} rays, {100 * hit.mean():.0f} % of which hit")
    for name, seconds in rows:
        print(f"{name:42} {seconds:7.3f} s {1e9 * seconds / options.rays:7.2f} ns a ray")
    measured = by_command_line(options.rtsl) if options.rtsl else None
    if measured is not None:
        print(f"{'rtsl bench: the kernel alone, 1 thread':42} {'':9} {measured:7.2f} ns a ray")


def processor_name() -> str:
    """Returns the name of the processor."""
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
