"""Textures of the pbrt format as those of Mitsuba."""

from pathlib import Path
from typing import Callable

import numpy

import pictures
import spectra
from pbrt_file import Parameter, Parameters
from pbrt_scene import Entity, PbrtScene

GREY = 0.5
WRAPS = {"repeat": "repeat", "clamp": "clamp"}
# A texture is a number, or a dictionary of Mitsuba's with a bitmap, a checkerboard or a colour.
Texture = dict | float


def rgb(values) -> dict:
    """A colour of one or three components."""
    components = [float(value) for value in values]
    return {"type": "rgb", "value": components * 3 if len(components) == 1 else components}


def mean_number(texture: Texture) -> float:
    """A number for a texture where Mitsuba takes no other."""
    return reduced(texture, numpy.mean)


def greatest_number(texture: Texture) -> float:
    """The greatest component of a texture."""
    return reduced(texture, numpy.max)


def reduced(texture: Texture, reduce: Callable) -> float:
    """One number for all components of a texture."""
    if isinstance(texture, float):
        return texture
    if texture["type"] == "rgb":
        return float(reduce(texture["value"]))
    if texture["type"] == "checkerboard":
        return float(reduce([reduced(texture[name], reduce) for name in ("color0", "color1")]))
    return float(reduce(texels(texture)))


def texels(texture: dict) -> numpy.ndarray:
    """The linear colours of the image of a texture."""
    return pictures.read(Path(texture["filename"]), texture["raw"])[..., :3]


class Textures:
    """The textures of a scene. What is computed from images is written to a folder."""

    def __init__(self, scene: PbrtScene, work: Path, remarks: set[str]):
        self.scene = scene
        self.folder = scene.path.parent
        self.work = work
        self.remarks = remarks
        self.made: dict[str, Texture] = {}
        self.count = 0

    def color(self, parameters: Parameters, name: str, default: float) -> dict:
        """A parameter that is a colour or a texture."""
        return self.value(parameters.get(name), default)

    def value(self, parameter: Parameter | None, default: float) -> dict:
        if parameter is None:
            return rgb([default])
        if parameter.type == "texture":
            found = self.named(parameter.values[0])
            return rgb([found]) if isinstance(found, float) else found
        return rgb(spectra.color(parameter, self.folder))

    def number(self, parameters: Parameters, name: str, default: float) -> Texture:
        """A parameter that is a number or a texture."""
        parameter = parameters.get(name)
        if parameter is not None and parameter.type == "texture":
            return self.named(parameter.values[0])
        return parameters.number(name, default)

    def named(self, name: str) -> Texture:
        """The texture of a name; each is converted once."""
        if name not in self.made:
            entity = self.scene.textures.get(name)
            if entity is None:
                self.remarks.add(f"texture {name} is not defined: grey")
            self.made[name] = self.convert(entity) if entity else GREY
        return self.made[name]

    def convert(self, entity: Entity) -> Texture:
        given = entity.parameters
        match entity.kind:
            case "constant":
                return self.value(given.get("value"), 1.0)
            case "imagemap":
                return self.image(entity)
            case "scale":
                return self.scaled(given)
            case "mix":
                return self.mixed(given)
            case "checkerboard":
                return self.checkerboard(entity)
        self.remarks.add(f"texture {entity.kind}: grey")
        return GREY

    def mapping(self, entity: Entity) -> numpy.ndarray:
        """The transform of texture coordinates."""
        given = entity.parameters
        if given.text("mapping", "uv") != "uv":
            self.remarks.add(f"mapping {given.text('mapping')} of a texture taken as uv")
        matrix = numpy.diag([given.number("uscale", 1), given.number("vscale", 1), 1.0])
        matrix[:2, 2] = given.number("udelta", 0), given.number("vdelta", 0)
        return matrix

    def image(self, entity: Entity) -> dict:
        given = entity.parameters
        # The rows of pbrt's images go up with the second coordinate, those of Mitsuba down.
        to_uv = numpy.array([[1.0, 0, 0], [0, -1, 1], [0, 0, 1]]) @ self.mapping(entity)
        wrap = given.text("wrap", "repeat")
        if wrap not in WRAPS:
            self.remarks.add(f"wrap {wrap} of an image taken as repeat")
        path = self.folder / given.text("filename").replace("\\", "/")
        texture = {
            "type": "bitmap",
            "filename": str(path),
            "raw": given.text("encoding", "sRGB") == "linear",
            "to_uv": to_uv.tolist(),
            "wrap_mode": WRAPS.get(wrap, "repeat"),
            "filter_type": "nearest" if given.text("filter") == "point" else "bilinear",
        }
        encoding = given.text("encoding", "sRGB").split()
        scale, invert = given.number("scale", 1.0), given.flag("invert", False)
        if encoding[0] == "gamma":
            self.remarks.add("encoding gamma of an image taken as sRGB")
        if scale != 1.0 or invert:
            return self.mapped(texture, lambda it: 1 - scale * it if invert else scale * it)
        if pictures.is_tga(path):
            return self.mapped(texture, lambda it: it)
        if not path.is_file():
            # The error that names the file.
            pictures.read(path)
        return texture

    def mapped(self, texture: Texture, function: Callable) -> Texture:
        """Applies a function to each component."""
        if isinstance(texture, float):
            return float(function(texture))
        if texture["type"] == "rgb":
            return rgb([function(it) for it in texture["value"]])
        if texture["type"] == "checkerboard":
            colors = {it: self.mapped(texture[it], function) for it in ("color0", "color1")}
            return texture | colors
        return self.written(texture, function(texels(texture)))

    def written(self, texture: dict, pixels: numpy.ndarray) -> dict:
        """The texture with other texels, which are linear."""
        self.count += 1
        path = self.work / f"texture-{self.count}.exr"
        pictures.write_exr(pixels, path)
        return texture | {"filename": str(path), "raw": True}

    def scaled(self, given: Parameters) -> Texture:
        texture = self.operand(given, "tex", 1.0)
        factor = self.operand(given, "scale", 1.0)
        if isinstance(factor, dict) and factor["type"] == "rgb":
            factor = mean_number(factor)
        if isinstance(texture, dict) and texture["type"] == "rgb" and isinstance(factor, dict):
            tint = numpy.array(texture["value"])
            return self.mapped(factor, lambda it: it * (tint if numpy.ndim(it) else tint.mean()))
        if isinstance(factor, dict):
            self.remarks.add("product of two textures: one of them by its mean")
            factor = mean_number(factor)
        return texture if factor == 1.0 else self.mapped(texture, lambda it: factor * it)

    def operand(self, given: Parameters, name: str, default: float) -> Texture:
        parameter = given.get(name)
        if parameter is not None and parameter.type in ("rgb", "spectrum"):
            return self.value(parameter, default)
        return self.number(given, name, default)

    def mixed(self, given: Parameters) -> Texture:
        first, second = (self.operand(given, *it) for it in (("tex1", 0.0), ("tex2", 1.0)))
        amount = self.operand(given, "amount", 0.5)
        plain = [it for it in (first, second) if isinstance(it, float) or it["type"] == "rgb"]
        if len(plain) == 2:
            colors = [numpy.array(rgb([it])["value"] if isinstance(it, float) else it["value"])
                      for it in (first, second)]  # fmt: skip
            change = colors[1] - colors[0]
            if isinstance(amount, dict) and amount["type"] == "bitmap":
                return self.written(amount, colors[0] + texels(amount) * change)
            return rgb(colors[0] + mean_number(amount) * change)
        self.remarks.add("mix of textures: that with the greater part")
        return second if mean_number(amount) > 0.5 else first

    def checkerboard(self, entity: Entity) -> dict:
        given = entity.parameters
        if given.number("dimension", 2) != 2:
            self.remarks.add("checkerboard of cubes: grey")
            return rgb([GREY])
        first, second = (self.operand(given, *it) for it in (("tex1", 1.0), ("tex2", 0.0)))
        colors = [rgb([it]) if isinstance(it, float) else it for it in (first, second)]
        # Mitsuba's has two squares in a unit.
        to_uv = numpy.diag([0.5, 0.5, 1.0]) @ self.mapping(entity)
        return {
            "type": "checkerboard",
            "color0": colors[0],
            "color1": colors[1],
            "to_uv": to_uv.tolist(),
        }
