#!/usr/bin/env python3
"""Compares RTSL's batch renderer with Mitsuba 3: pictures, paths per second, memory, error over time.

Mitsuba is installed into a virtual environment; it needs an LLVM besides, as RTSL does.
"""

import argparse
import json
import shutil
import sys
import tempfile
from pathlib import Path

import environment

HERE = Path(__file__).resolve().parent
SCENES = "metals", "metals_area", "cornell_box", "spheres", "spheres_10k"
PARTS = "means", "speed", "frames", "error"
# Of pictures of which many are made in a second: scene, integrator, pixels along a side and samples a pixel.
FRAMES = (
    ("metals", "direct", 512, 1),
    ("metals", "depth", 1024, 4),
    ("spheres", "depth", 1024, 4),
    ("spheres_10k", "depth", 1024, 4),
)


def positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise ValueError
    return number


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    target = environment.REPOSITORY / "target" / "mitsuba"
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=SCENES)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, help="what to compare")
    parser.add_argument("--size", type=positive, default=512, help="pixels along a side")
    parser.add_argument("--samples", type=positive, default=64, help="samples a pixel")
    parser.add_argument("--renders", type=positive, default=4, help="renders for means, 2 at least")
    parser.add_argument("--rounds", type=positive, default=5, help="turns for speed")
    parser.add_argument("--threads", nargs="+", type=positive, default=[1, 2], help="for speed")
    parser.add_argument(
        "--error-size", type=positive, default=256, help="pixels along a side, for error"
    )
    parser.add_argument(
        "--reference", type=positive, default=2048, help="samples a pixel of each long render"
    )
    parser.add_argument(
        "--integrator", help="RTSL's integrator for paths, a class; else that of the scene"
    )
    parser.add_argument("--quick", action="store_true", help="small and few; figures mean little")
    parser.add_argument("--rtsl", type=Path, help="a built rtsl; without it, one is built")
    parser.add_argument(
        "--rtsl-option", action="append", default=[], help="for `rtsl render`, once for each word"
    )
    parser.add_argument("--out", type=Path, default=target, help="folder for tables and pictures")
    parser.add_argument("--environment", type=Path, default=target / "environment")
    options = parser.parse_args()
    if options.quick:
        options.size, options.samples, options.rounds = 64, 16, 2
        options.error_size, options.reference = 32, 128
    if options.renders < 2:
        parser.error("--renders: the noise of one render can't be told")
    return options


def main() -> int:
    options = arguments()
    environment.enter(options.environment)
    environment.find_llvm()
    program = environment.rtsl_program(options.rtsl)
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        return compare(options, program, Path(folder))


def compare(options: argparse.Namespace, program: Path, work: Path) -> int:
    import mitsuba

    # Pictures are read and written by a variant that needs no LLVM.
    mitsuba.set_variant("scalar_rgb")
    # These can only be imported in the environment, where a variant is set.
    from systems import Failure, Mitsuba, Rtsl

    print(f"Mitsuba {mitsuba.__version__}, {program}")
    integrator = options.integrator
    chosen = ["--integrator", integrator] if integrator else ["--renderer", "batch"]
    rtsl = Rtsl(program, lay_out_scenes(work), work, chosen, options.rtsl_option)
    systems = [rtsl, Mitsuba(work)]
    try:
        same = run_parts(options, systems, work)
    except Failure as failure:
        environment.stop(str(failure))
    finally:
        for system in systems:
            system.close()
    if not same:
        print("\nthe means differ", file=sys.stderr)
    return 0 if same else 1


def lay_out_scenes(work: Path) -> Path:
    from sphere_list import COUNTS, pbrt_text

    scenes = work / "scenes"
    shutil.copytree(HERE / "scenes", scenes)
    for name, count in COUNTS.items():
        (scenes / f"{name}_list.pbrt").write_text(pbrt_text(count), encoding="utf-8")
    return scenes


def run_parts(options: argparse.Namespace, systems: list, work: Path) -> bool:
    """Whether all means agree, as far as they were compared."""
    from error import compare_error, write_table
    from means import compare_means
    from plot import write_plot
    from speed import compare_speed
    from systems import Task

    most_threads = max(options.threads)
    same = True
    if "means" in options.parts:
        for scene in options.scenes:
            task = Task(scene, options.size, options.samples, 0, most_threads)
            same &= compare_means(systems, task, options.renders, work, options.out)
    if "speed" in options.parts:
        figures = []
        for scene in options.scenes:
            for threads in options.threads:
                task = Task(scene, options.size, options.samples, 0, threads)
                figures.append(compare_speed(systems, task, options.rounds))
        (options.out / "speed.json").write_text(json.dumps(figures, indent=2) + "\n")
    if "frames" in options.parts:
        figures = []
        for scene, integrator, size, samples in FRAMES:
            size = min(size, options.size) if options.quick else size
            task = Task(scene, size, samples, 0, min(options.threads), integrator)
            figures.append(compare_speed(systems, task, options.rounds))
        (options.out / "frames.json").write_text(json.dumps(figures, indent=2) + "\n")
    if "error" in options.parts:
        points = []
        for scene in options.scenes:
            task = Task(scene, options.error_size, options.reference, 0, most_threads)
            points += compare_error(systems, task, work)
        write_table(points, options.out / "error.csv")
        write_plot(points, options.out / "error.svg")
    return same


if __name__ == "__main__":
    raise SystemExit(main())
