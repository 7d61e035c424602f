#!/usr/bin/env python3
"""Compares RTSL with Mitsuba 3, and pbrt-v4 if it is given, on scenes of the pbrt-v4 format.

The scenes are those of a folder of yours, which may have a folder for each; none are fetched. All systems render
the same copy of a scene: paths of the same depth, a box filter and independent samples, no Russian roulette (but
pbrt's), radiance without the settings of the film. Mitsuba takes a conversion; what it approximates or leaves out
is told below the table, and the ratio of mean luminances (the column `means`) tells whether the pictures agree.
Mitsuba is installed into a virtual environment below `target/`, and uses RTSL's LLVM.
"""

import argparse
import fnmatch
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(1, str(HERE.parent / "mitsuba"))

import environment  # noqa: E402

PARTS = "speed", "first", "profile", "error"
EXAMPLES = """examples:
  bench/public/compare.py ~/pbrt-v4-scenes
  bench/public/compare.py ~/pbrt-v4-scenes --scenes 'killeroos*' crown --rtsl target/release/rtsl
  bench/public/compare.py ~/pbrt-v4-scenes --scenes staircase veach-ajar crown --parts error
"""
# Exit codes.
FAILED, USAGE, INTERRUPTED = 1, 2, 130


def positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise ValueError
    return number


def size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if not match or "0" in match.groups():
        raise argparse.ArgumentTypeError(f"`{text}` is no size such as 384x216")
    return int(match.group(1)), int(match.group(2))


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    target = environment.REPOSITORY / "target"
    add = parser.add_argument
    add("folder", type=Path, metavar="FOLDER", help="a folder with scenes of the pbrt-v4 format")
    add("--rtsl", type=Path, metavar="PATH", help="a built rtsl; without it, one is built")
    add("--scenes", nargs="+", metavar="NAME", help="some of the scenes, by name or pattern; else all")
    add("--size", type=size, default=(384, 216), metavar="WxH", help="columns and rows (384x216)")
    add("--samples", type=positive, default=32, metavar="N", help="samples a pixel (32)")
    add("--depth", type=positive, default=8, metavar="N", help="edges of a path at most (8)")
    add("--threads", type=positive, default=1, metavar="N", help="threads and processors (1)")
    add("--rounds", type=positive, default=3, metavar="N", help="turns for speed (3)")
    add("--parts", nargs="+", choices=PARTS, default=("speed", "first"), metavar="PART",
        help="`speed`: paths a second, memory; `first`: time to a first tile; `profile`: what takes the "
        "time of RTSL, by perf; `error`: error over time (speed first)")  # fmt: skip
    add("--error-size", type=size, default=(192, 108), metavar="WxH", help="for error (192x108)")
    add("--reference", type=positive, default=512, metavar="N",
        help="samples a pixel of each long render, for error (512)")  # fmt: skip
    add("--pbrt", type=Path, metavar="PATH", help="a built pbrt-v4, as a second rival for speed")
    add("--out", type=Path, default=target / "public", help="folder for tables and pictures (target/public)")
    add("--environment", type=Path, default=target / "mitsuba" / "environment",
        help="folder of the virtual environment (target/mitsuba/environment)")  # fmt: skip
    options = parser.parse_args()
    if options.depth < 2:
        parser.error("--depth: a path with light from a surface has 2 edges at least")
    if not options.folder.is_dir():
        parser.error(f"there is no folder `{options.folder}`: name one with scenes of the pbrt-v4 format")
    if options.pbrt and not (options.pbrt.is_file() and os.access(options.pbrt, os.X_OK)):
        parser.error(f"--pbrt: `{options.pbrt}` is no program: build pbrt-v4, or leave the option out")
    if options.rtsl and not options.rtsl.is_file():
        parser.error(f"--rtsl: there is no `{options.rtsl}`: build it, or leave the option out")
    return options


def share_llvm(program: Path) -> None:
    """Lets Mitsuba's compiler use the LLVM that RTSL uses, unless another is chosen."""
    done = subprocess.run([program, "info"], capture_output=True, text=True)
    found = re.search(r"^\s*library\s+(/.*libLLVM.*)$", done.stdout, re.MULTILINE)
    if found:
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", found.group(1).strip())
    environment.find_llvm()


def choose(scenes: list, patterns: list[str] | None) -> list:
    """The scenes whose names match one of the patterns."""
    if not patterns:
        return scenes
    for pattern in patterns:
        if not fnmatch.filter([it.name for it in scenes], pattern):
            known = ", ".join(it.name for it in scenes)
            print(f"compare.py: no scene `{pattern}`; there are {known}", file=sys.stderr)
            raise SystemExit(USAGE)
    return [it for it in scenes if any(fnmatch.fnmatch(it.name, pattern) for pattern in patterns)]


def main() -> int:
    options = arguments()
    environment.enter(options.environment)
    # Only now, since this needs packages of the environment.
    from scene_files import find_scenes

    scenes = find_scenes(options.folder)
    if not scenes:
        message = f"no scenes in `{options.folder}`: files *.pbrt with `WorldBegin` and a `Camera`"
        print(f"compare.py: {message}", file=sys.stderr)
        return USAGE
    scenes = choose(scenes, options.scenes)
    program = environment.rtsl_program(options.rtsl)
    share_llvm(program)
    options.out.mkdir(parents=True, exist_ok=True)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with tempfile.TemporaryDirectory(prefix="rtsl-compare-") as folder:
            return compare(options, program, scenes, Path(folder))
    except KeyboardInterrupt:
        print("\ncompare.py: interrupted; temporary files are removed", file=sys.stderr)
        return INTERRUPTED


def compare(options: argparse.Namespace, program: Path, scenes: list, work: Path) -> int:
    import mitsuba

    # Pictures are read and written by a variant that needs no LLVM.
    mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    # These can only be imported where a variant is set.
    import comparison

    # The program may be replaced by another build meanwhile.
    own = work / "rtsl"
    shutil.copy2(program, own)
    done = comparison.Comparison(options, own, work)
    done.run(scenes)
    done.finish()
    return FAILED if done.failures else 0


if __name__ == "__main__":
    raise SystemExit(main())
