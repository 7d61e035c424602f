"""The options of the command line."""

import argparse
import os
import re
from pathlib import Path

import environment

PARTS = "speed", "first", "profile", "error"
EXAMPLES = """examples:
  bench/public/compare.py ~/pbrt-v4-scenes
  bench/public/compare.py ~/pbrt-v4-scenes --scenes 'killeroos*' crown --rtsl target/release/rtsl
  bench/public/compare.py ~/pbrt-v4-scenes --scenes staircase veach-ajar crown --parts error
"""
PART_HELP = (
    "`speed`: paths a second and memory; `first`: time to a first tile; `profile`: the parts of "
    "RTSL's time, by perf; `error`: error over time, of three scenes unless some are named "
    "(speed first)"
)


def positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise ValueError
    return number


def size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"([1-9]\d*)x([1-9]\d*)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"`{text}` is no size such as 384x216")
    return int(match.group(1)), int(match.group(2))


def add_options(parser: argparse.ArgumentParser) -> None:
    target = environment.REPOSITORY / "target"
    add = parser.add_argument
    add("folder", type=Path, metavar="FOLDER", help="a folder with scenes of the pbrt-v4 format")
    add("--rtsl", type=Path, metavar="PATH", help="a built rtsl; without it, one is built")
    names = "some of the scenes, by name or pattern; else all"
    add("--scenes", nargs="+", metavar="NAME", help=names)
    add("--size", type=size, default=(384, 216), metavar="WxH", help="columns and rows (384x216)")
    add("--samples", type=positive, default=32, metavar="N", help="samples a pixel (32)")
    add("--depth", type=positive, default=8, metavar="N", help="edges of a path at most (8)")
    add("--threads", type=positive, default=1, metavar="N", help="threads and processors (1)")
    add("--rounds", type=positive, default=3, metavar="N", help="turns for speed (3)")
    parts = ["speed", "first"]
    add("--parts", nargs="+", choices=PARTS, default=parts, metavar="PART", help=PART_HELP)
    add("--error-size", type=size, default=(192, 108), metavar="WxH", help="for error (192x108)")
    reference = "samples a pixel of each long render, for error (512)"
    add("--reference", type=positive, default=512, metavar="N", help=reference)
    add("--pbrt", type=Path, metavar="PATH", help="a built pbrt-v4, as a second rival for speed")
    out = "folder for tables and pictures (target/public)"
    add("--out", type=Path, default=target / "public", metavar="FOLDER", help=out)
    virtual = target / "mitsuba" / "environment"
    text = "folder of the virtual environment (target/mitsuba/environment)"
    add("--environment", type=Path, default=virtual, metavar="FOLDER", help=text)


def check(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Ends the program where an option can't be followed."""
    if options.depth < 2:
        parser.error("--depth: a path with light from a surface has 2 edges at least")
    if not options.folder.is_dir():
        parser.error(f"there is no folder `{options.folder}`: name one with pbrt-v4 scenes")
    if options.pbrt and not (options.pbrt.is_file() and os.access(options.pbrt, os.X_OK)):
        parser.error(f"--pbrt: `{options.pbrt}` is no program: build pbrt-v4")
    if options.rtsl and not options.rtsl.is_file():
        parser.error(f"--rtsl: there is no `{options.rtsl}`: build it, or leave the option out")


def parse(description: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=description,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_options(parser)
    options = parser.parse_args()
    check(parser, options)
    return options
