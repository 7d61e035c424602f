"""Renders with Mitsuba as another process asks: `mitsuba_worker.py VARIANT SCENE SIZE THREADS`.

A line of JSON on standard output says that the scene is loaded. Then each line of standard input is a render, with its
`samples`, its `seed`, its `integrator` and the file `out` for the picture, or null; each is answered by a line with the seconds that it took and
the most memory that the process held so far.
"""

import json
import sys
import time

import drjit
import mitsuba


def peak_memory_bytes() -> int:
    with open("/proc/self/status", encoding="ascii") as status:
        for line in status:
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    return 0


def answer(**fields) -> None:
    print(json.dumps(fields), flush=True)


def main() -> None:
    variant, scene_name, size, threads = sys.argv[1:]
    mitsuba.set_variant(variant)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    drjit.set_thread_count(int(threads))
    # Scenes can only be imported where a variant is set.
    from mitsuba_scenes import INTEGRATORS, SCENES

    scene = mitsuba.load_dict(SCENES[scene_name](int(size)))
    integrators = {name: mitsuba.load_dict(it) for name, it in INTEGRATORS.items()}
    answer(version=mitsuba.__version__)
    for line in sys.stdin:
        request = json.loads(line)
        start = time.perf_counter()
        integrator = integrators[request["integrator"]]
        image = mitsuba.render(
            scene, integrator=integrator, spp=request["samples"], seed=request["seed"]
        )
        drjit.eval(image)
        drjit.sync_thread()
        seconds = time.perf_counter() - start
        if request["out"]:
            # With one thread, Mitsuba waits forever for another that writes.
            drjit.set_thread_count(2)
            mitsuba.Bitmap(image).write(request["out"])
            drjit.set_thread_count(int(threads))
        answer(seconds=seconds, peak_memory_bytes=peak_memory_bytes())


main()
