"""Scenes: loaded from files, or made of instances."""

from __future__ import annotations

import os
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _rtsl, transforms
from ._arguments import aovs_of, checked, refuse, size_of, warn
from ._classes import PathLike
from ._copies import NotCopied
from ._engine import Engine, default_engine
from ._errors import SceneError
from ._host import Color, vector
from ._image import Image
from ._instance import Instance
from ._looking import Costs, Pixel, counting_engine, recording_lock, traced_engine
from ._names import meant, with_article
from ._progress import Progress

#: The samples of the passes between which a callback is called, which double up to this number.
_LARGEST_PASS = 64

Transform = Any

#: The keywords of `Scene.begin`, which are also the names of `Scene.settings`.
_SETTINGS = ("spp", "size", "seed", "aovs", "renderer", "max_depth", "noise", "width", "engine")

#: The path of a scene's file, definitions, folders, the camera, the integrator, and whether a studio is added.
_Source = Tuple[str, Sequence[str], Sequence[str], Optional[str], Optional[str], bool]


class Placed:
    """A shape, a light or a camera in a scene. Its attributes may be assigned."""

    def __init__(self, instance: Instance, role: str, **parts: Any) -> None:
        self.instance = instance
        self.role = role
        #: The name by which the scene finds it.
        self.name: Optional[str] = parts.get("name")
        #: From its space to the world's: a matrix of 4 by 4 numbers, or ``None``.
        self.transform: Transform = parts.get("transform")
        #: The material of a shape; ``None`` for an even grey.
        self.material: Optional[Instance] = parts.get("material")
        #: A material whose emission a shape gives off besides.
        self.emission: Optional[Instance] = parts.get("emission")
        #: The alpha texture of a shape.
        self.alpha: Optional[Instance] = parts.get("alpha")
        #: True if the normals of a shape are flipped.
        self.flipped: bool = bool(parts.get("flipped", False))

    def __repr__(self) -> str:
        name = f" {self.name!r}" if self.name else ""
        return f"<{self.role}{name}: {self.instance!r}>"


class Thing(NotCopied):
    """A part of a loaded scene. Its parameters are attributes, which may be assigned; nothing is compiled."""

    _INSTEAD = "they are parts of a scene, which `Scene.load` loads again"

    def __init__(self, text: _rtsl.SceneText, number: int, kind: str, title: str, class_name: str) -> None:
        object.__setattr__(self, "_text", text)
        object.__setattr__(self, "_number", number)
        object.__setattr__(self, "kind", kind)
        object.__setattr__(self, "title", title)
        object.__setattr__(self, "class_name", class_name)

    @property
    def controls(self) -> Dict[str, Dict[str, Any]]:
        """The parameters that can be set, by name: dictionaries with `label`, `doc`, `kind`, `min`, `values`, ..."""
        return {it["name"]: it for it in self._text.controls(self._number)}

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        controls = self.controls
        if name not in controls:
            raise AttributeError(f"{self.title} has no parameter `{name}` to set{meant(name, controls)}")
        return value_of(controls[name])

    def __setattr__(self, name: str, value: Any) -> None:
        controls = self.controls
        if name not in controls:
            raise AttributeError(f"{self.title} has no parameter `{name}` to set{meant(name, controls)}")
        self._text.set(self._number, name, numbers_of(controls[name], value))

    def __dir__(self) -> List[str]:
        return [*super().__dir__(), *self.controls]

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value_of(it)!r}" for name, it in self.controls.items())
        return f"<{self.kind} {self.title!r}: {self.class_name}({values})>"


def value_of(control: Mapping[str, Any]) -> Any:
    """Returns the value of a control: a number, the name of a choice, or a list."""
    values = control["values"]
    if control["choices"]:
        return next((name for name, number in control["choices"] if number == values[0]), values[0])
    convert = {"truth": bool, "whole": int}.get(control["kind"], float)
    shown = [convert(it) for it in values]
    return shown[0] if len(shown) == 1 else shown


def numbers_of(control: Mapping[str, Any], value: Any) -> List[float]:
    """Returns the numbers that a value has for a control."""
    if isinstance(value, str):
        for name, number in control["choices"]:
            if name == value:
                return [number]
        names = [name for name, _ in control["choices"]]
        raise ValueError(f"`{control['name']}` has no choice `{value}`{meant(value, names)}")
    numbers = [float(it) for it in np.ravel(value)]
    count = len(control["values"])
    if len(numbers) == 1 and control["kind"] == "color":
        numbers *= count
    if len(numbers) != count:
        raise ValueError(f"`{control['name']}` has {count} numbers, not {len(numbers)}")
    return numbers


class Scene(NotCopied):
    """A scene of shapes, lights and a camera, which it renders.

    >>> from rtsl import Scene, library, transforms
    >>> scene = Scene(library.Pinhole(fov=40), transforms.look_at((0, 2, -6), (0, 0, 0)))
    >>> ball = scene.add(library.Sphere(), material=library.Lambertian(kd=(0.8, 0.3, 0.2)))
    >>> lamp = scene.add(library.PointLight(position=(3, 5, -4), intensity=60))
    >>> scene.render(size=(8, 6), spp=4)
    <Image of 8 by 6 pixels>

    What does not change from one render to the next is not prepared again: values of parameters compile nothing.
    """

    _INSTEAD = "load or make another one"

    def __init__(self, camera: Optional[Instance] = None, transform: Transform = None) -> None:
        self._text: Optional[_rtsl.SceneText] = None
        #: The arguments by which the text was loaded.
        self._source: Optional[_Source] = None
        self._composer = _rtsl.Composer()
        self._placed: List[Placed] = []
        self._engines: Dict[int, _rtsl.Engine] = {}
        #: The camera; ``None`` for that of the file.
        self.camera: Optional[Placed] = None
        #: The integrator; ``None`` for that of the file, or for the one that the renderer chooses.
        self.integrator: Optional[Instance] = None
        #: What is added to the ambient light.
        self.ambient: Color = 0.0
        #: The usual keywords of `render`, such as ``{"spp": 64}``.
        self.settings: Dict[str, Any] = {}
        if camera is not None:
            self.add(camera, transform=transform)

    @classmethod
    @checked
    def load(
        cls,
        path: PathLike,
        *,
        defines: Optional[Mapping[str, Any]] = None,
        search_path: Sequence[PathLike] = (),
        camera: Optional[str] = None,
        integrator: Optional[str] = None,
        studio: bool = False,
    ) -> "Scene":
        """Loads a scene: a file of the pbrt format, of glTF (`.gltf`, `.glb`), or a mesh (`.ply`, `.obj`, `.stl`).

        ``defines`` sets parameters by names such as `camera.fov`; ``camera`` is one of a glTF file; ``integrator`` is a
        class; ``studio`` adds a studio to the lights of the scene. Raises SceneError with the diagnostics of the scene
        and its shaders.
        """
        given = [f"{name}={_definition(value)}" for name, value in (defines or {}).items()]
        folders = [os.fspath(it) for it in search_path]
        scene = cls._of_source((os.fspath(path), given, folders, camera, integrator, studio))
        if scene._text is not None:
            warn(scene._text.warnings)
        return scene

    @classmethod
    def _of_source(cls, source: _Source, places: Optional[Dict[str, str]] = None) -> "Scene":
        """Loads a scene; `places` has the places of its files by their paths, if they do not lie there."""
        scene = cls()
        scene._source = source
        path, defines, folders, camera, integrator, studio = source
        scene._text = _rtsl.SceneText(path, list(defines), list(folders), camera, integrator, studio, places)
        return scene

    @property
    def things(self) -> List[Thing]:
        """The parts of the file that have parameters, in its order."""
        return [Thing(self._text, *it) for it in self._text.things()] if self._text is not None else []

    @property
    def placed(self) -> List[Placed]:
        """The shapes and lights that were added."""
        return list(self._placed)

    def __getitem__(self, name: str) -> Union[Placed, Thing]:
        """Returns what was added with this name, or the part of the file with this title."""
        for placed in self._placed:
            if placed.name == name:
                return placed
        for thing in self.things:
            if thing.title == name:
                return thing
        known = [it.name for it in self._placed if it.name] + [it.title for it in self.things]
        raise KeyError(f"the scene has no `{name}`{meant(name, known)}")

    def __iter__(self) -> Iterator[Placed]:
        return iter(self.placed)

    @checked
    def add(
        self,
        instance: Instance,
        *,
        transform: Transform = None,
        material: Optional[Instance] = None,
        emission: Optional[Instance] = None,
        alpha: Optional[Instance] = None,
        flipped: bool = False,
        name: Optional[str] = None,
    ) -> Placed:
        """Adds a shape or a light, or sets the camera or the integrator; returns it as placed."""
        roles = instance._class.roles
        role = next((it for it in ("primitive", "light", "camera", "integrator") if it in roles), None)
        if role is None:
            role_names = with_article("/".join(roles))
            raise SceneError(f"`{instance._class.name}` is {role_names}: shapes have it as their `material`")
        placed = Placed(
            instance, role, transform=transform, material=material, emission=emission, alpha=alpha,
            flipped=flipped, name=name,
        )
        transforms.as_matrix(transform)
        if role == "camera":
            self.camera = placed
        elif role == "integrator":
            self.integrator = instance
        else:
            self._placed.append(placed)
        return placed

    def remove(self, placed: Placed) -> None:
        """Removes what was added."""
        self._placed.remove(placed)

    @checked
    def render(
        self,
        spp: Optional[int] = None,
        size: Optional[Tuple[int, int]] = None,
        *,
        seed: Optional[int] = None,
        aovs: Union[str, Sequence[str]] = (),
        renderer: Optional[str] = None,
        max_depth: Optional[int] = None,
        noise: Optional[float] = None,
        seconds: Optional[float] = None,
        threads: Optional[int] = None,
        width: Optional[int] = None,
        engine: Optional[_rtsl.Engine] = None,
        progress: Optional[bool] = None,
        callback: Optional[Callable[[Image], Any]] = None,
    ) -> Image:
        """Renders a picture.

        Keywords that are not given are those of `settings`, then those of the file.

        Args:
            spp: samples of each pixel.
            size: columns and rows.
            seed: the seed of the sampler.
            aovs: the names of further images: `distance`, `object`, `samples`, `variance`, ..., and outputs of the
                integrator, such as `albedo` and `normal`.
            renderer: `batch` traces paths, `interactive` shows what `shade` of materials computes; if ``None``, paths
                are traced if all materials support it.
            max_depth: the greatest number of surfaces that a path meets. Integrators that are classes have parameters
                of their own instead, such as `maxDepth`.
            noise: the noise, relative to the brightness, at which parts of the picture take no more samples.
            seconds: the time after which the picture is returned as it is.
            threads: the number of threads, all processors if ``None``. The picture does not depend on it.
            width: rays at once in kernels, the best for the processor if ``None``. The picture does not depend on it.
            engine: the engine, in place of the default one.
            progress: true for a progress bar, ``None`` for one in notebooks and on terminals.
            callback: called between passes with the picture so far; false ends the render.
        """
        begun = self.begin(
            spp, size, seed=seed, aovs=aovs, renderer=renderer, max_depth=max_depth, noise=noise, width=width,
            engine=engine,
        )
        with Progress(progress) as bar:
            start = 0
            for end in _passes(begun.samples, callback is not None):
                share = (end - start) / begun.samples

                def tell(done: int, of: int, first: float = start / begun.samples, share: float = share) -> None:
                    bar.update(first + share * done / of)

                is_complete = begun.render((start, end), threads=threads, seconds=seconds, listener=tell)
                if seconds is not None:
                    seconds = max(0.0, seconds - (begun.seconds - begun.counted))
                    begun.counted = begun.seconds
                start = end
                if callback is not None and callback(begun.image()) is False:
                    break
                if not is_complete:
                    break
        return begun.image()

    def begin(
        self,
        spp: Optional[int] = None,
        size: Optional[Tuple[int, int]] = None,
        *,
        first_sample: int = 0,
        **keywords: Any,
    ) -> "PartialRender":
        """Prepares a render that the caller advances part by part; keywords are those of `render`.

        ``first_sample`` begins with a later sample of each pixel, for a part whose sums are added to others.
        """
        settings, given = self._settings({"spp": spp, "size": size, **keywords}, first_sample)
        engine, width = given.pop("engine", None), given.pop("width", None)
        if engine is None:
            engine = default_engine() if width is None else self._engine_of(width)
        _refuse_others(given)
        render, messages = self._composer.begin(engine, self._parts(), settings)
        warn(messages)
        return PartialRender(render)

    def inspect(
        self,
        x: int,
        y: int,
        sample: Optional[int] = None,
        *,
        detail: str = "calls",
        spp: Optional[int] = None,
        size: Optional[Tuple[int, int]] = None,
        **keywords: Any,
    ) -> Pixel:
        """Renders one pixel and records what its shaders do: prints, calls, values that are not finite.

        >>> from rtsl import Scene, library, transforms
        >>> scene = Scene(library.Pinhole(fov=40), transforms.look_at((0, 2, -6), (0, 0, 0)))
        >>> ball = scene.add(library.Sphere())
        >>> pixel = scene.inspect(4, 3, sample=0, size=(8, 6), spp=4)
        >>> any("Sphere.intersect" in line for line in pixel.samples[0].recording.lines)
        True

        Args:
            x, y: the column and the row, from the top left.
            sample: the index of one sample; all of the pixel if ``None``.
            detail: `prints`, `calls` with the state that methods read and set, or `lines` with the values of variables.
            spp, size, seed, renderer, max_depth: as for `render`.

        The interpreter runs the shaders; the pixel has the bits that a render gives it.
        """
        settings, given = self._settings({"spp": spp, "size": size, **keywords})
        # The engine is one that looks at what it does.
        _refuse_others({name: it for name, it in given.items() if name not in ("engine", "width")})
        samples = (0, None) if sample is None else (sample, 1)
        engine = traced_engine(detail)
        with recording_lock:
            color, made, messages = self._composer.inspect(engine, self._parts(), settings, (x, y), samples)
        warn(messages)
        return Pixel((x, y), color, made)

    def costs(
        self,
        *,
        width: int = 8,
        threads: Optional[int] = None,
        spp: Optional[int] = None,
        size: Optional[Tuple[int, int]] = None,
        **keywords: Any,
    ) -> Costs:
        """Measures the costs of the lines of all shaders, for a sample of the pixels of up to 48 tiles of the picture.

        The interpreter counts the operations of the kernels that a render would run for `width` rays at a time; other
        keywords are those of `render`. Notebooks show the result as texts with a colour for the cost of each line.
        """
        settings, given = self._settings({"spp": spp, "size": size, **keywords})
        # The engine is one that looks at what it does.
        _refuse_others({name: it for name, it in given.items() if name not in ("engine", "width")})
        engine = counting_engine(width)
        texts, paths, lanes, messages = self._composer.costs(engine, self._parts(), settings, threads)
        warn(messages)
        return Costs(texts, paths, lanes)

    def _settings(
        self, keywords: Mapping[str, Any], first_sample: int = 0
    ) -> Tuple[Dict[str, Any], Dict[str, Any]]:
        """Returns the settings that the extension module takes, and the keywords that are left."""
        given = {**self.settings, **{name: it for name, it in keywords.items() if it is not None}}
        settings = {name: given.pop(name, None) for name in ("size", "spp", "seed", "max_depth", "renderer")}
        settings["size"], settings["aovs"] = size_of(settings["size"]), aovs_of(given.pop("aovs", ()))
        settings["noise"], settings["first_sample"] = given.pop("noise", None), first_sample
        if settings["spp"] is not None and settings["spp"] < 1:
            raise ValueError("`spp` is at least 1")
        return settings, given

    def _engine_of(self, width: int) -> _rtsl.Engine:
        if width not in self._engines:
            self._engines[width] = Engine(width=width)
        return self._engines[width]

    def _parts(self) -> Dict[str, Any]:
        if self.camera is None and self._text is None:
            raise SceneError("the scene has no camera: `scene.add(rtsl.library.Pinhole())`")
        shapes = [
            (
                _native(it.instance), _native(it.material), _native(it.emission), _native(it.alpha),
                _rows(it.transform), it.flipped,
            )
            for it in self._placed
            if it.role == "primitive"
        ]
        lights = [(_native(it.instance), _rows(it.transform)) for it in self._placed if it.role == "light"]
        camera = self.camera
        return {
            "text": self._text,
            "camera": None if camera is None else (_native(camera.instance), _rows(camera.transform)),
            "integrator": _native(self.integrator),
            "shapes": shapes,
            "lights": lights,
            "ambient": vector(self.ambient),
        }

    def _repr_png_(self) -> bytes:
        """Shows a small picture in notebooks."""
        return self.render(spp=4, size=(320, 240), seconds=2, progress=False).png()

    def __repr__(self) -> str:
        shapes = sum(it.role == "primitive" for it in self._placed)
        loaded = f"{len(self.things)} parts of a file, " if self._text is not None else ""
        return f"<Scene: {loaded}{shapes} shapes, {len(self._placed) - shapes} lights>"


class PartialRender(NotCopied):
    """A render that advances part by part: ranges of samples of ranges of tiles.

    Tiles are of 8 by 8 pixels, in rows from the top left. When all parts are done, in any order of tiles and with the
    samples of each tile in order, the picture has the bits of one that was rendered at once.
    """

    _INSTEAD = "`sums` are bytes, with which `restore` continues"

    def __init__(self, render: _rtsl.PartialRender) -> None:
        self._render = render
        self.counted = 0.0

    @property
    def tiles(self) -> int:
        """The number of tiles."""
        return self._render.tiles

    @property
    def samples(self) -> int:
        """The samples of each pixel of the whole picture."""
        return self._render.samples

    @property
    def seconds(self) -> float:
        """The time that its parts took."""
        return self._render.seconds

    def render(
        self,
        samples: Optional[Tuple[int, int]] = None,
        tiles: Optional[Tuple[int, int]] = None,
        *,
        threads: Optional[int] = None,
        seconds: Optional[float] = None,
        listener: Optional[Callable[[int, int], Any]] = None,
    ) -> bool:
        """Renders the samples `start` to `end` of the tiles `start` to `end`, all if not given.

        Returns false if `seconds` were over before. ``listener`` is called with the pieces of work done and of all.
        """
        samples = samples or (0, self.samples)
        tiles = tiles or (0, self.tiles)
        return self._render.render(tiles, samples, threads=threads, seconds=seconds, listener=listener)

    def add(self, other: "PartialRender", tiles: Optional[Tuple[int, int]] = None) -> None:
        """Adds the sums of another render of the same scene, whose samples follow those of this one, of these tiles.

        The sums depend on how the samples were parted, and not on who rendered them.
        """
        self._render.add(other._render, tiles or (0, self.tiles))

    def sums(self, tiles: Optional[Tuple[int, int]] = None) -> bytes:
        """Returns the sums of the samples so far, of these tiles or all, for `restore` in another process."""
        return self._render.sums(tiles or (0, self.tiles))

    def restore(self, sums: bytes, tiles: Optional[Tuple[int, int]] = None) -> None:
        """Continues with the sums of these tiles, or all, of a render of the same scene and settings.

        Raises SceneError for sums that are damaged, or of other tiles, another scene, other settings, or another
        version of the package. Nothing changes then.
        """
        self._render.restore(sums, tiles or (0, self.tiles))

    def clear(self, tiles: Optional[Tuple[int, int]] = None) -> None:
        """Forgets the samples of these tiles, or of all."""
        self._render.clear(tiles or (0, self.tiles))

    def taken(self, tiles: Optional[Tuple[int, int]] = None) -> Optional[int]:
        """Returns the least number of samples of those of these tiles that need more; ``None`` if none does."""
        return self._render.taken(tiles or (0, self.tiles))

    def write_checkpoint(self, path: PathLike) -> None:
        """Writes the sums to a file, from which `resume` or `rtsl render --resume` continues.

        It replaces an earlier checkpoint of the same render at once, or not at all; other files are left alone.
        """
        self._render.write_checkpoint(os.fspath(path))

    def resume(self, path: PathLike) -> bool:
        """Continues from a checkpoint of the same render; returns false if there is no such file."""
        return self._render.resume(os.fspath(path))

    def image(self) -> Image:
        """Returns the picture of the samples so far."""
        return Image(self._render.picture())


def _refuse_others(given: Mapping[str, Any]) -> None:
    """Raises an error for keywords that nobody takes."""
    refuse(given, _SETTINGS, "the settings of a picture have")


def _passes(samples: int, is_watched: bool) -> Iterator[int]:
    """Returns the ends of passes: one, or several between which somebody sees the picture."""
    end, step = 0, 1
    while end < samples:
        end = min(samples, end + step if is_watched else samples)
        step = min(_LARGEST_PASS, end)
        yield end


def _native(instance: Optional[Instance]) -> Optional[_rtsl.Instance]:
    return None if instance is None else instance._native()


def _rows(transform: Transform) -> List[List[float]]:
    return [[float(it) for it in row] for row in transforms.as_matrix(transform)]


def _definition(value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    return ",".join(repr(float(it)) for it in np.ravel(value))
