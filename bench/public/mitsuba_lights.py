"""Lights of the pbrt format as those of Mitsuba."""

import math
from pathlib import Path

import numpy

import pictures
import spectra
import transform
from mitsuba_textures import rgb
from pbrt_file import Parameters
from pbrt_scene import Entity, PbrtScene, Shape

# From Mitsuba's latitude-longitude maps, whose axis is y, to light space, whose axis is z.
Y_TO_Z = numpy.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


class Lights:
    """Converts lights. Skies are written to files of a folder."""

    def __init__(self, scene: PbrtScene, work: Path, exposure: float, remarks: set[str]):
        self.folder = scene.path.parent
        self.work = work
        self.exposure = exposure
        self.remarks = remarks
        self.count = 0

    def color(self, given: Parameters, name: str) -> numpy.ndarray:
        """The colour of a light with its scale."""
        parameter = given.get(name)
        found = spectra.color(parameter, self.folder, emits=True) if parameter else [1.0]
        components = numpy.array(found * 3 if len(found) == 1 else found)
        return self.exposure * given.number("scale", 1.0) * components

    def of(self, light: Entity) -> dict | None:
        """A light; `None` if there is none of its kind."""
        method = getattr(self, f"make_{light.kind}", None)
        if method is None:
            self.remarks.add(f"light {light.kind} left out")
            return None
        return method(light)

    def make_distant(self, light: Entity) -> dict:
        given = light.parameters
        start = given.numbers("from") or [0, 0, 0]
        end = given.numbers("to") or [0, 0, 1]
        direction = transform.vector(light.to_world, numpy.subtract(end, start))
        irradiance = self.color(given, "L") * given.number("illuminance", 1.0)
        return {
            "type": "directional",
            "direction": direction.tolist(),
            "irradiance": rgb(irradiance),
        }

    def make_point(self, light: Entity) -> dict:
        given = light.parameters
        place = transform.point(light.to_world, given.numbers("from") or [0, 0, 0])
        intensity = self.color(given, "I") * given.number("power", 4 * math.pi) / (4 * math.pi)
        return {"type": "point", "position": place.tolist(), "intensity": rgb(intensity)}

    def make_spot(self, light: Entity) -> dict:
        """A spot light. The edges of its beam differ: pbrt's falloff is smooth in the cosine."""
        given = light.parameters
        edge = given.number("coneangle", 30.0)
        full = edge - given.number("conedeltaangle", 5.0)
        cosines = [math.cos(math.radians(angle)) for angle in (edge, full)]
        unscaled = 2 * math.pi * (1 - 0.5 * sum(cosines))
        intensity = self.color(given, "I") * given.number("power", unscaled) / unscaled
        eye = transform.point(light.to_world, given.numbers("from") or [0, 0, 0])
        target = transform.point(light.to_world, given.numbers("to") or [0, 0, 1])
        up = numpy.eye(3)[numpy.argmin(numpy.abs(target - eye))]
        to_world = numpy.linalg.inv(transform.look_at(eye, target, up))
        return {
            "type": "spot",
            "to_world": to_world,
            "intensity": rgb(intensity),
            "cutoff_angle": edge,
            "beam_width": full,
        }

    def make_infinite(self, light: Entity) -> dict:
        given = light.parameters
        if "portal" in given:
            self.remarks.add("portal of a sky left out")
        if "filename" not in given:
            radiance = self.color(given, "L") * given.number("illuminance", math.pi) / math.pi
            return {"type": "constant", "radiance": rgb(radiance)}
        if "illuminance" in given:
            self.remarks.add("illuminance of a sky with an image left out")
        image = pictures.read(self.folder / given.text("filename").replace("\\", "/"))[..., :3]
        is_square = image.shape[0] == image.shape[1]
        image = pictures.resample_sky(image) if is_square else pictures.turn_sky(image)
        self.count += 1
        path = self.work / f"sky-{self.count}.exr"
        pictures.write_exr(numpy.maximum(image, 0.0), path)
        scale = self.exposure * given.number("scale", 1.0)
        to_world = transform.without_scale(light.to_world) @ Y_TO_Z
        return {"type": "envmap", "filename": str(path), "scale": scale, "to_world": to_world}

    def area(self, light: Entity, shape: Shape, face_area: float | None) -> dict:
        """The emission of a shape."""
        given = light.parameters
        radiance = self.color(given, "L")
        if "filename" in given:
            name = given.text("filename").replace("\\", "/")
            mean = pictures.read(self.folder / name)[..., :3].mean(axis=(0, 1))
            radiance = mean * self.exposure * given.number("scale", 1.0)
            self.remarks.add("area light with an image: its mean")
        sides = 2 if given.flag("twosided", False) else 1
        power = given.number("power", 0.0)
        if power > 0 and face_area:
            radiance = radiance * power / (math.pi * face_area * sides)
        elif power > 0:
            self.remarks.add(f"power of a light on {shape.kind} left out")
        if sides == 2:
            self.remarks.add("two-sided area light: one side")
        return {"type": "area", "radiance": rgb(radiance)}
