"""Shapes of the pbrt format as those of Mitsuba."""

import math
from pathlib import Path

import mitsuba
import numpy

import meshes
import subdivision
import transform
from meshes import Mesh
from pbrt_file import Parameters
from pbrt_scene import PbrtScene, Shape


class Shapes:
    """Converts the geometry of shapes. Meshes in the text are written to files of a folder."""

    def __init__(self, scene: PbrtScene, work: Path, remarks: set[str]):
        self.folder = scene.path.parent
        self.work = work
        self.remarks = remarks
        self.count = 0

    def of(self, shape: Shape) -> dict | None:
        """A shape without its material; `None` if there is none of its kind."""
        if abs(numpy.linalg.det(shape.to_world[:3, :3])) < 1e-30:
            self.remarks.add("a shape that is flattened left out")
            return None
        method = getattr(self, f"make_{shape.kind}", None)
        if method is None:
            self.remarks.add(f"shape {shape.kind} left out")
            return None
        return method(shape)

    def face_area(self, shape: Shape) -> float | None:
        """The area of a shape, of a mesh the mean of its faces: what has an area light's power."""
        given = shape.parameters
        square = float(numpy.prod(transform.scales(shape.to_world)[:2]))
        radius = given.number("radius", 1.0)
        match shape.kind:
            case "sphere":
                return 4 * math.pi * radius**2 * square
            case "disk":
                return math.pi * (radius**2 - given.number("innerradius", 0.0) ** 2) * square
            case "trianglemesh":
                return self.triangles(given).mean_area(shape.to_world)
            case "bilinearmesh":
                # A patch has two triangles.
                return 2 * self.patches(given).mean_area(shape.to_world)
            case "plymesh":
                made = mitsuba.load_dict(self.make_plymesh(shape) | {"to_world": placed(shape)})
                return made.surface_area()[0] / made.face_count()
        return None

    def written(self, mesh: Mesh, shape: Shape) -> dict:
        self.count += 1
        path = self.work / f"mesh-{self.count}.ply"
        mesh.write(path)
        return self.from_file(path, shape)

    def from_file(self, path: Path, shape: Shape) -> dict:
        """A mesh. Its normals tell its sides; without them the order of corners does, which a
        mirror reverses."""
        flips = shape.is_reversed
        if not meshes.has_normals(path):
            flips ^= transform.is_mirrored(shape.to_world)
        return {"type": "ply", "filename": str(path), "flip_normals": flips}

    def make_plymesh(self, shape: Shape) -> dict:
        name = shape.parameters.text("filename").replace("\\", "/")
        return self.from_file(meshes.expanded(self.folder / name, self.work), shape)

    def triangles(self, given: Parameters) -> Mesh:
        points = given.numbers("P")
        indices = given.numbers("indices") or [0, 1, 2]
        places = given.numbers("uv") or given.numbers("st")
        return meshes.from_numbers(points, indices, given.numbers("N"), places)

    def make_trianglemesh(self, shape: Shape) -> dict:
        return self.written(self.triangles(shape.parameters), shape)

    def patches(self, given: Parameters) -> Mesh:
        points = given.numbers("P")
        indices = meshes.patches_as_triangles(given.numbers("indices") or [0, 1, 2, 3])
        places = given.numbers("uv")
        if places is None and len(points) == 12:
            places = [0, 0, 1, 0, 0, 1, 1, 1]
        return meshes.from_numbers(points, indices, given.numbers("N"), places)

    def make_bilinearmesh(self, shape: Shape) -> dict:
        return self.written(self.patches(shape.parameters), shape)

    def make_loopsubdiv(self, shape: Shape) -> dict:
        given = shape.parameters
        levels = int(given.number("levels", 3))
        return self.written(subdivision.subdivided(self.triangles(given), levels), shape)

    def make_sphere(self, shape: Shape) -> dict:
        given = shape.parameters
        radius, sweep = given.number("radius", 1.0), given.number("phimax", 360.0)
        low, high = given.number("zmin", -radius), given.number("zmax", radius)
        is_whole = low <= -radius and high >= radius and sweep >= 360
        if is_whole and transform.is_similarity(shape.to_world):
            # Mitsuba's sphere has its normals inside under a mirror.
            flips = shape.is_reversed ^ transform.is_mirrored(shape.to_world)
            return {"type": "sphere", "radius": radius, "flip_normals": flips}
        self.remarks.add("stretched or partial sphere: a mesh")
        return self.written(
            meshes.sphere(radius, max(low, -radius), min(high, radius), sweep), shape
        )

    def make_disk(self, shape: Shape) -> dict:
        given = shape.parameters
        radius, inner = given.number("radius", 1.0), given.number("innerradius", 0.0)
        height, sweep = given.number("height", 0.0), given.number("phimax", 360.0)
        if inner > 0 or sweep < 360:
            return self.written(meshes.disk(radius, inner, height, sweep), shape)
        place = transform.translate([0, 0, height]) @ transform.scale([radius, radius, 1])
        return {"type": "disk", "flip_normals": shape.is_reversed, "own_transform": place}

    def make_cylinder(self, shape: Shape) -> dict:
        given = shape.parameters
        radius, sweep = given.number("radius", 1.0), given.number("phimax", 360.0)
        low, high = given.number("zmin", -1.0), given.number("zmax", 1.0)
        if sweep < 360 or not transform.is_similarity(shape.to_world):
            return self.written(meshes.cylinder(radius, low, high, sweep), shape)
        ends = {"p0": [0.0, 0.0, low], "p1": [0.0, 0.0, high]}
        return {"type": "cylinder", "radius": radius, "flip_normals": shape.is_reversed} | ends


def placed(shape: Shape) -> "mitsuba.ScalarTransform4f":
    return mitsuba.ScalarTransform4f(shape.to_world)
