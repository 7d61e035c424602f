"""A process that renders a converted scene: `scene_worker.py VARIANT SCENE.json THREADS`; requests are
those of `render_loop.py`."""

import json
import sys
from pathlib import Path

import drjit
import mitsuba

sys.path.insert(1, str(Path(__file__).resolve().parents[1] / "mitsuba"))


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
    from render_loop import serve

    # With one thread, Mitsuba waits forever for another that reads an image.
    drjit.set_thread_count(max(2, int(threads)))
    dictionary = json.loads(Path(scene_file).read_text(encoding="utf-8"))
    scene = mitsuba.load_dict(with_transforms(dictionary))

    def render(request: dict):
        return mitsuba.render(scene, spp=request["samples"], seed=request["seed"])

    serve(render, int(threads))


main()
