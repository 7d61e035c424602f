"""``python -m rtsl.cluster ADDRESS SCENE -o OUT``: what ``rtsl render --cluster ADDRESS SCENE -o OUT`` starts.

Options are those of ``rtsl render``.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import warnings
from typing import Any, List, Optional, Tuple

from .. import _rtsl
from .._errors import Error
from .._scene import Scene
from ._engine import connect
from ._head import Head, warn

#: Exit codes of the command.
_DONE, _AT_FAULT, _WRONG_USAGE = 0, 1, 2


def parser() -> argparse.ArgumentParser:
    """Returns the parser of the arguments."""
    made = argparse.ArgumentParser(prog="python -m rtsl.cluster", description="Renders a scene on a cluster of Ray.")
    add = made.add_argument
    add("address", help="the cluster: auto, HOST:PORT, ray://HOST:PORT, or local for a new one on this machine")
    add("scene", help="the scene's file")
    add("-o", "--output", required=True, help="the picture: OUT.png or OUT.exr")
    add("--version-of-command", help="the version that the package must have")
    add("--spp", type=int, help="samples per pixel")
    add("--size", type=_size, metavar="WxH", help="columns and rows")
    add("--seed", type=int, help="the seed of the sampler")
    add("--aov", type=_names, default=[], metavar="NAMES", help="further images, with commas between")
    add("--renderer", choices=["batch", "interactive"])
    add("--integrator", help="the class of an integrator in place of the scene's")
    add("--camera", help="the camera of a glTF file")
    add("--studio", action="store_true", help="light the scene by a studio, besides its own lights")
    add("-D", "--define", action="append", default=[], metavar="NAME.PARAMETER=VALUE")
    add("-I", "--include", action="append", default=[], metavar="FOLDER")
    add("--noise", type=float, help="the noise at which tiles take no more samples")
    add("--time", type=float, metavar="SECONDS", help="stop after this time")
    add("--threads", type=int, help="processors of a task; those of the smallest node if not given")
    add("--checkpoint", metavar="FILE")
    add("--checkpoint-every", type=float, default=30.0, metavar="SECONDS")
    add("--resume", action="store_true", help="continue from the checkpoint")
    add("--stats", metavar="FILE", help="write statistics as JSON")
    add("--exposure", type=float, default=0.0)
    add("--view", default="standard")
    add("--exr", choices=["half", "float"], default="float")
    add("--exr-parts", action="store_true")
    add("--backend", default="auto")
    add("--width", type=int)
    add("--math", default="contract")
    return made


def main(arguments: Optional[List[str]] = None) -> int:
    """Renders a scene and writes the picture; returns the exit code."""
    given = parser().parse_args(arguments)
    wanted = given.version_of_command
    if wanted not in (None, _rtsl.__version__):
        return _refused(f"the package `rtsl` has version {_rtsl.__version__}, and the command version {wanted}")
    warnings.showwarning = _show  # type: ignore[assignment]
    try:
        return _render(given)
    except Error as error:
        return _refused(str(error))
    except KeyboardInterrupt:
        return _AT_FAULT


def _render(given: argparse.Namespace) -> int:
    ray = connect(given.address)
    scene = Scene._of_source((given.scene, given.define, given.include, given.camera, given.integrator, given.studio))
    if scene._text is not None and scene._text.warnings:
        sys.stderr.write(scene._text.warnings)
    names = ("spp", "size", "seed", "renderer", "noise")
    settings = {**{name: getattr(given, name) for name in names}, "aovs": given.aov}
    engine = {name: getattr(given, name) for name in ("backend", "width", "math")}
    place = given.checkpoint or f"{given.output}.checkpoint"
    is_kept = given.checkpoint is not None or (given.resume and os.path.exists(place))
    every = given.checkpoint_every if given.checkpoint is not None else None
    head = Head(
        ray, scene, settings, engine, threads=given.threads, checkpoint=place if is_kept else None,
        checkpoint_every=every, resume=given.resume,
    )
    is_complete, code = False, _DONE
    try:
        _hear_signals()
        is_complete = head.run(seconds=given.time)
    except KeyboardInterrupt:
        code = _AT_FAULT
        # A second one ends the program at once.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    return max(code, _finish(given, head, place, is_complete))


def _hear_signals() -> None:
    """Has the signals of batch systems, containers and closed terminals end the render as Ctrl-C does."""

    def end(number: int, _: Any) -> None:
        # `timeout` and batch systems send theirs twice.
        signal.signal(number, signal.SIG_IGN)
        raise KeyboardInterrupt

    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        # `nohup` has a program ignore one.
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, end)


def _finish(given: argparse.Namespace, head: Head, place: str, is_complete: bool) -> int:
    """Writes the picture, and how to go on if it is not complete."""
    image = head.image()
    warn(image)
    image.save(
        given.output, exposure=given.exposure, view=given.view, half=given.exr == "half", parts=given.exr_parts
    )
    figures = image.statistics
    if given.stats is not None:
        text = image._picture.statistics_json(figures["seconds"], figures["threads"], not is_complete)
        with open(given.stats, "w", encoding="utf-8") as file:
            file.write(text + "\n")
    if not is_complete:
        if head.checkpoint is None:
            head.render.write_checkpoint(place)
        samples = f"{figures['samples']:.1f} samples a pixel of {head.render.samples}"
        sys.stderr.write(f"note: `{given.output}` has {samples}\n")
        sys.stderr.write(f" = help: the same command with `--resume` continues from `{place}`\n")
    return _DONE


def _refused(text: str) -> int:
    sys.stderr.write((text if text.startswith("error") else f"error: {text}").rstrip() + "\n")
    return _AT_FAULT


def _show(message: Any, category: Any, *_: Any) -> None:
    """Shows a warning as the command does."""
    text = str(message)
    sys.stderr.write((text if text.startswith("warning") else f"warning: {text}").rstrip() + "\n")


def _size(text: str) -> Tuple[int, int]:
    width, _, height = text.lower().partition("x")
    return int(width), int(height)


def _names(text: str) -> List[str]:
    return [it for it in text.split(",") if it]


if __name__ == "__main__":
    sys.exit(main())
