#!/usr/bin/env python3
"""Compares RTSL with Mitsuba 3, and pbrt-v4 if it is given, on scenes of the pbrt-v4 format.

The scenes are those of a folder of yours, which may have a folder for each; none are fetched. RTSL
and pbrt render the same copy of a scene, Mitsuba a conversion of it: paths of the same depth
without Russian roulette (except pbrt's), a box filter, independent samples, and radiance without
the settings of the film. What the conversion approximates or leaves out is told below the table.
The ratio of mean luminances (the column `means`) tells whether the pictures agree, and a sheet for
each scene shows both. Mitsuba is installed into a virtual environment below `target/`, and uses
RTSL's LLVM.
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

import arguments  # noqa: E402
import environment  # noqa: E402

# Exit codes.
FAILED, USAGE, INTERRUPTED = 1, 2, 130


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
    options = arguments.parse(__doc__)
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
    import drjit
    import mitsuba

    # Pictures are read and written by a variant that needs no LLVM.
    mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    # With one thread, Mitsuba waits forever for another that writes.
    drjit.set_thread_count(2)
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
