"""A process that renders a scene of ours: `mitsuba_worker.py VARIANT SCENE SIZE THREADS`; requests, which name an
`integrator` too, are those of `render_loop.py`."""

import sys

import mitsuba


def main() -> None:
    variant, scene_name, size, threads = sys.argv[1:]
    mitsuba.set_variant(variant)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    # These can only be imported where a variant is set.
    from mitsuba_scenes import INTEGRATORS, SCENES
    from render_loop import serve

    scene = mitsuba.load_dict(SCENES[scene_name](int(size)))
    integrators = {name: mitsuba.load_dict(it) for name, it in INTEGRATORS.items()}

    def render(request: dict):
        integrator = integrators[request["integrator"]]
        samples, seed = request["samples"], request["seed"]
        return mitsuba.render(scene, integrator=integrator, spp=samples, seed=seed)

    serve(render, int(threads))


main()
