"""Renders a scene as another process asks: `scene_worker.py VARIANT SCENE.json THREADS`.

A line of JSON on standard output says that the scene is loaded. Then each line of standard input is
a render, with its `samples`, its `seed` and the file `out` for the picture, or null; each is
answered by a line with the seconds that it took and the most memory that the process held so far.
"""

import json
import sys
import time
from pathlib import Path

import drjit
import mitsuba


def peak_memory_bytes() -> int:
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    found = [line.split()[1] for line in lines if line.startswith("VmHWM:")]
    return int(found[0]) * 1024 if found else 0


def answer(**fields) -> None:
    print(json.dumps(fields), flush=True)


def with_transforms(value):
    """Replaces the rows of transforms by objects of Mitsuba's."""
    if not isinstance(value, dict):
        return value
    made = {name: with_transforms(it) for name, it in value.items()}
    if "to_world" in made:
        made["to_world"] = mitsuba.ScalarTransform4f(made["to_world"])
    if "to_uv" in made:
        made["to_uv"] = mitsuba.ScalarTransform3f(made["to_uv"])
    return made


def main() -> None:
    variant, scene_file, threads = sys.argv[1:]
    mitsuba.set_variant(variant)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    # With one thread, Mitsuba waits forever for another that reads or writes an image.
    drjit.set_thread_count(max(2, int(threads)))
    dictionary = json.loads(Path(scene_file).read_text(encoding="utf-8"))
    scene = mitsuba.load_dict(with_transforms(dictionary))
    drjit.set_thread_count(int(threads))
    answer(version=mitsuba.__version__)
    for line in sys.stdin:
        request = json.loads(line)
        start = time.perf_counter()
        image = mitsuba.render(scene, spp=request["samples"], seed=request["seed"])
        drjit.eval(image)
        drjit.sync_thread()
        seconds = time.perf_counter() - start
        if request["out"]:
            drjit.set_thread_count(2)
            mitsuba.Bitmap(image).write(request["out"])
            drjit.set_thread_count(int(threads))
        answer(seconds=seconds, peak_memory_bytes=peak_memory_bytes())


main()
