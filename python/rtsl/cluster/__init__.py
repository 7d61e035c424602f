"""Renders on many machines, with Ray.

``rtsl.cluster.render("scene.pbrt", spp=4096)`` makes the picture of ``rtsl.Scene.load("scene.pbrt").render(spp=4096)``,
with the same bits. It needs Ray: ``pip install 'rtsl[ray]'``.
"""

from __future__ import annotations

import os
from typing import Any, Callable, Mapping, Optional, Sequence, Tuple, Union

from .._arguments import aovs_of, checked, size_of
from .._classes import PathLike
from .._image import Image
from .._scene import Scene
from ._engine import connect
from ._head import Head, warn

__all__ = ["render"]


@checked
def render(
    scene: Union[PathLike, Scene],
    spp: Optional[int] = None,
    size: Optional[Tuple[int, int]] = None,
    *,
    address: Optional[str] = None,
    seed: Optional[int] = None,
    aovs: Union[str, Sequence[str]] = (),
    renderer: Optional[str] = None,
    max_depth: Optional[int] = None,
    noise: Optional[float] = None,
    seconds: Optional[float] = None,
    threads: Optional[int] = None,
    defines: Optional[Mapping[str, Any]] = None,
    search_path: Sequence[PathLike] = (),
    camera: Optional[str] = None,
    integrator: Optional[str] = None,
    studio: bool = False,
    backend: str = "auto",
    width: Optional[int] = None,
    math: str = "contract",
    checkpoint: Optional[PathLike] = None,
    checkpoint_every: Optional[float] = 30.0,
    resume: bool = True,
    task_seconds: float = 4.0,
    progress: Optional[bool] = None,
    callback: Optional[Callable[[Image], Any]] = None,
) -> Image:
    """Renders a picture on a cluster of Ray. It has the bits of one that `Scene.render` makes.

    Samples and tiles are parted into tasks of some seconds, which Ray runs on the nodes, and again elsewhere if a
    process or a node dies. The scene and its files are sent to a node once, by the digests of their contents.

    Args:
        scene: the path of a scene, or a scene that `Scene.load` has made, whose parameters may have been set.
        spp, size, seed, aovs, renderer, max_depth, noise: as for `Scene.render`.
        address: the cluster: `auto` for one that runs here, `HOST:PORT`, `ray://HOST:PORT`, `local` for a new one on
            this machine. ``None`` for that of the environment variable `RAY_ADDRESS`, else one that runs here, else a
            new one. A process that is connected to a cluster stays so; `ray.shutdown()` ends the connection.
        seconds: the time after which the picture is returned as it is.
        threads: the processors of a task; those of the smallest node, at most 32, if ``None``.
        defines, search_path, camera, integrator, studio: as for `Scene.load`, for the path of a scene.
        backend, width, math: as for `Engine`, in each node. With `math="fast"` all nodes need the same processor.
        checkpoint: a file for the sums so far, which `rtsl render --resume` reads and writes, too.
        checkpoint_every: the seconds between two checkpoints; ``None`` for one at the end alone.
        resume: continues from the checkpoint, if there is one.
        task_seconds: the length of tasks.
        progress: true for a progress bar, ``None`` for one in notebooks and on terminals.
        callback: called about every two seconds with the picture so far; false ends the render.
    """
    ray = connect(address)
    loading = {
        "defines": defines, "search_path": search_path, "camera": camera, "integrator": integrator, "studio": studio,
    }
    if isinstance(scene, Scene):
        unused = [name for name, value in loading.items() if value]
        if unused:
            raise TypeError(f"a scene that is loaded takes no `{unused[0]}`")
    else:
        scene = Scene.load(scene, **loading)  # type: ignore[arg-type]
    given = {"spp": spp, "size": size_of(size), "seed": seed, "renderer": renderer, "max_depth": max_depth, "noise": noise}
    head = Head(
        ray, scene, {**given, "aovs": aovs_of(aovs)}, {"backend": backend, "width": width, "math": math}, threads=threads,
        task_seconds=task_seconds, checkpoint=None if checkpoint is None else os.fspath(checkpoint),
        checkpoint_every=checkpoint_every, resume=resume,
    )
    head.run(seconds=seconds, progress=progress, callback=callback)
    image = head.image()
    warn(image)
    return image
