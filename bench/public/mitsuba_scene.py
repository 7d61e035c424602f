"""Conversion of a pbrt-v4 scene to a dictionary of Mitsuba's, which is stored as JSON.

Transforms are lists of rows under `to_world` and `to_uv`. Remarks tell what is approximated or left
out.
"""

import json
from pathlib import Path

import numpy

import transform
from mitsuba_lights import Lights
from mitsuba_materials import Materials
from mitsuba_shapes import Shapes
from mitsuba_textures import Textures
from pbrt_file import SceneError
from pbrt_scene import PbrtScene, Shape
from scene_files import Settings

# The cameras of pbrt look along z with x to the right, those of Mitsuba with x to the left.
MIRROR = transform.scale([-1, 1, 1])
NEAR, FAR = 1e-3, 1e7


class Conversion:
    """The conversion of one scene."""

    def __init__(self, scene: PbrtScene, settings: Settings, work: Path):
        self.scene = scene
        self.settings = settings
        self.remarks = scene.remarks
        exposure = self.exposure()
        textures = Textures(scene, work, self.remarks)
        self.textures = textures
        self.materials = Materials(scene, textures, self.remarks)
        self.shapes = Shapes(scene, work, self.remarks)
        self.lights = Lights(scene, work, exposure, self.remarks)
        self.bsdfs: dict[str, tuple[str, dict]] = {}
        # Groups by the names of objects: Mitsuba's names have no dots.
        self.groups: dict[str, tuple[str, dict]] = {}

    def exposure(self) -> float:
        """The time that the shutter is open, by which pbrt multiplies radiance."""
        given = self.scene.camera.parameters if self.scene.camera else {}
        if not given:
            return 1.0
        return given.number("shutterclose", 1.0) - given.number("shutteropen", 0.0)

    def dictionary(self) -> dict:
        settings = self.settings
        placed = self.placed_shapes()
        lights = [it for light in self.scene.lights if (it := self.lights.of(light))]
        if not placed:
            raise SceneError(f"{self.scene.path}: none of its shapes is converted")
        found = {"type": "scene", "sensor": self.sensor()}
        found["integrator"] = {"type": "path", "max_depth": settings.depth, "rr_depth": 1000000}
        found |= {f"material-{name}": bsdf for name, bsdf in self.bsdfs.values()}
        # Empty groups are left out, as their instances are.
        found |= {name: group for name, group in self.groups.values() if len(group) > 1}
        found |= {f"light-{number}": light for number, light in enumerate(lights)}
        return found | {f"shape-{number}": shape for number, shape in enumerate(placed)}

    def sensor(self) -> dict:
        camera = self.scene.camera
        if camera is None or camera.kind != "perspective":
            kind = camera.kind if camera else "none"
            raise SceneError(
                f"{self.scene.path}: camera `{kind}` is not converted, only `perspective`"
            )
        given = camera.parameters
        for name in ("screenwindow", "frameaspectratio"):
            if name in given:
                self.remarks.add(f"{name} of the camera left out")
        width, height = self.settings.width, self.settings.height
        film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
        film |= {"pixel_format": "rgb", "component_format": "float32"}
        sensor = {
            "type": "perspective",
            "fov": given.number("fov", 90.0),
            "fov_axis": "smaller",
            "near_clip": NEAR,
            "far_clip": FAR,
            "to_world": transform.without_scale(camera.to_world) @ MIRROR,
            "film": film,
            "sampler": {"type": "independent"},
        }
        radius = given.number("lensradius", 0.0)
        if radius > 0:
            size = float(transform.scales(camera.to_world).mean())
            distance = min(given.number("focaldistance", 1e6), 1e6)
            sensor |= {"type": "thinlens", "aperture_radius": size * radius}
            sensor["focus_distance"] = size * distance
        return sensor

    def placed_shapes(self) -> list[dict]:
        placed = [made for shape in self.scene.shapes if (made := self.shape(shape))]
        for instance in self.scene.instances:
            placed += self.instance(instance.name, instance.to_world)
        return placed

    def instance(self, name: str, to_world: transform.Matrix) -> list[dict]:
        """An instance of a group, or copies of its shapes where they emit."""
        shapes = self.scene.objects.get(name, [])
        if any(shape.area_light for shape in shapes):
            self.remarks.add("instances that emit: copies")
            copies = [self.moved(shape, to_world) for shape in shapes]
            return [made for shape in copies if (made := self.shape(shape))]
        if name not in self.groups:
            group = f"group-{len(self.groups)}"
            made = [it for shape in shapes if (it := self.shape(shape))]
            parts = {f"{group}-{number}": it for number, it in enumerate(made)}
            self.groups[name] = group, {"type": "shapegroup"} | parts
        group, content = self.groups[name]
        if len(content) == 1:
            return []
        reference = {"type": "ref", "id": group}
        return [{"type": "instance", "group": reference, "to_world": to_world}]

    def moved(self, shape: Shape, to_world: transform.Matrix) -> Shape:
        return Shape(
            shape.kind,
            shape.parameters,
            to_world @ shape.to_world,
            shape.material,
            shape.area_light,
            shape.is_reversed,
        )

    def shape(self, shape: Shape) -> dict | None:
        """A shape with its material and emission; `None` if it is left out."""
        bsdf = self.materials.of(shape.material)
        if bsdf is None and shape.area_light is None:
            return None
        made = self.shapes.of(shape)
        if made is None:
            return None
        own = made.pop("own_transform", numpy.eye(4))
        made["to_world"] = shape.to_world @ own
        bsdf = self.masked(bsdf or {"type": "null"}, shape)
        if bsdf is None:
            return None
        made["bsdf"] = self.shared(bsdf)
        light = shape.area_light
        if light is not None:
            has_power = light.parameters.number("power", 0.0) > 0
            area = self.shapes.face_area(shape) if has_power else None
            made["emitter"] = self.lights.area(light, shape, area)
        return made

    def masked(self, bsdf: dict, shape: Shape) -> dict | None:
        """The material with the holes of a shape by its alpha; `None` if nothing is left."""
        alpha = self.textures.number(shape.parameters, "alpha", 1.0)
        if isinstance(alpha, float) and alpha >= 1.0:
            return bsdf
        if isinstance(alpha, float) and alpha <= 0.0:
            if shape.area_light is None:
                return None
            self.remarks.add("invisible area light: seen by the camera")
            return {"type": "null"}
        self.remarks.add(
            "alpha: holes let no light of samples through in Mitsuba's path integrator"
        )
        return {"type": "mask", "opacity": alpha, "bsdf": bsdf}

    def shared(self, bsdf: dict) -> dict:
        """A reference to a material. Equal ones are one."""
        key = json.dumps(bsdf, sort_keys=True, default=plain)
        name, _ = self.bsdfs.setdefault(key, (str(len(self.bsdfs)), bsdf))
        return {"type": "ref", "id": f"material-{name}"}


def plain(value):
    """Converts what JSON has no form for."""
    return value.tolist() if isinstance(value, (numpy.ndarray, numpy.generic)) else str(value)


def convert(path: Path, settings: Settings, work: Path, out: Path) -> list[str]:
    """Converts the scene of a file to a JSON file; returns its remarks. Meshes and images that are
    made for it lie in a folder."""
    conversion = Conversion(PbrtScene(path), settings, work)
    dictionary = conversion.dictionary()
    out.write_text(json.dumps(dictionary, default=plain), encoding="utf-8")
    return sorted(conversion.remarks)
