"""Renders with Mitsuba as another process asks.

A line of JSON on standard output says that the scene is loaded. Then each line of standard input is a render, with its
`samples`, its `seed` and the file `out` for the picture, or null; each is answered by a line with the seconds that it
took and the most memory that the process held so far.
"""

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import drjit
import mitsuba


def peak_memory_bytes() -> int:
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    found = [line.split()[1] for line in lines if line.startswith("VmHWM:")]
    return int(found[0]) * 1024 if found else 0


def answer(**fields) -> None:
    print(json.dumps(fields), flush=True)


def serve(render: Callable, threads: int) -> None:
    """Answers requests by pictures that `render` returns for them."""
    drjit.set_thread_count(threads)
    answer(version=mitsuba.__version__)
    for line in sys.stdin:
        request = json.loads(line)
        start = time.perf_counter()
        image = render(request)
        drjit.eval(image)
        drjit.sync_thread()
        seconds = time.perf_counter() - start
        if request["out"]:
            # With one thread, Mitsuba waits forever for another that writes.
            drjit.set_thread_count(2)
            mitsuba.Bitmap(image).write(request["out"])
            drjit.set_thread_count(threads)
        answer(seconds=seconds, peak_memory_bytes=peak_memory_bytes())
