"""Meshes as PLY files, which is how Mitsuba takes them."""

import gzip
from dataclasses import dataclass
from pathlib import Path

import numpy

from pbrt_file import SceneError

# Steps around an axis of shapes that become meshes.
AROUND = 128
# Steps from the first to the last point of such a profile that is curved.
ALONG = 64


@dataclass
class Mesh:
    """Triangles; normals and texture coordinates may be left out."""

    points: numpy.ndarray
    triangles: numpy.ndarray
    normals: numpy.ndarray | None = None
    places: numpy.ndarray | None = None

    def mean_area(self, matrix: numpy.ndarray) -> float:
        """The mean area of triangles under a transform."""
        corners = (self.points @ matrix[:3, :3].T)[self.triangles]
        edges = corners[:, 1:] - corners[:, :1]
        return float(numpy.linalg.norm(numpy.cross(edges[:, 0], edges[:, 1]), axis=1).mean()) / 2

    def write(self, path: Path) -> None:
        columns = [self.points, self.normals, self.places]
        names = ["x y z".split(), "nx ny nz".split(), "u v".split()]
        given = [(it, of) for it, of in zip(columns, names) if it is not None]
        properties = [f"property float {name}" for _, of in given for name in of]
        header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(self.points)}"]
        header += properties + [f"element face {len(self.triangles)}"]
        header += ["property list uchar int vertex_indices", "end_header", ""]
        faces = numpy.zeros(len(self.triangles), [("count", "u1"), ("corners", "<i4", 3)])
        faces["count"], faces["corners"] = 3, self.triangles
        vertices = numpy.concatenate([it for it, _ in given], axis=1).astype("<f4")
        path.write_bytes("\n".join(header).encode() + vertices.tobytes() + faces.tobytes())


def from_numbers(points, indices, normals, places) -> Mesh:
    """A mesh of flat lists of numbers."""

    def rows(numbers, width: int) -> numpy.ndarray | None:
        return None if numbers is None else numpy.array(numbers, float).reshape(-1, width)

    triangles = numpy.array(indices, int).reshape(-1, 3)
    return Mesh(rows(points, 3), triangles, rows(normals, 3), rows(places, 2))


def patches_as_triangles(indices: list) -> numpy.ndarray:
    """Two triangles for each bilinear patch, whose corners have the order 00, 10, 01, 11."""
    corners = numpy.array(indices, int).reshape(-1, 4)
    return numpy.concatenate([corners[:, [0, 1, 3]], corners[:, [0, 3, 2]]])


def revolved(radii, heights, slopes, sweep: float) -> Mesh:
    """The surface of a profile that turns about the axis z by an angle in degrees. A slope is the
    normal of the profile, by its components away from the axis and along it."""
    turns = numpy.radians(sweep) * numpy.linspace(0, 1, AROUND + 1)
    cosine, sine = numpy.cos(turns), numpy.sin(turns)
    rows = len(radii)

    def around(away, up) -> numpy.ndarray:
        away, up = numpy.asarray(away, float), numpy.asarray(up, float)
        flat = numpy.ones_like(turns)
        parts = numpy.outer(away, cosine), numpy.outer(away, sine), numpy.outer(up, flat)
        return numpy.stack(parts, axis=-1).reshape(-1, 3)

    across, along = numpy.meshgrid(numpy.linspace(0, 1, AROUND + 1), numpy.linspace(0, 1, rows))
    first = numpy.arange(rows - 1)[:, None] * (AROUND + 1) + numpy.arange(AROUND)
    corners = [first, first + 1, first + AROUND + 2, first + AROUND + 1]
    a, b, c, d = (it.ravel() for it in corners)
    triangles = numpy.concatenate([numpy.stack([a, b, c], 1), numpy.stack([a, c, d], 1)])
    places = numpy.stack([across, along], axis=-1).reshape(-1, 2)
    normals = around(*numpy.transpose(slopes))
    return Mesh(around(radii, heights), triangles, normals, places)


def sphere(radius: float, low: float, high: float, sweep: float) -> Mesh:
    """A sphere or a part of it between two heights."""
    ends = numpy.arcsin(numpy.clip([low / radius, high / radius], -1, 1))
    angles = numpy.linspace(*ends, ALONG + 1)
    slopes = numpy.stack([numpy.cos(angles), numpy.sin(angles)], axis=1)
    return revolved(radius * slopes[:, 0], radius * slopes[:, 1], slopes, sweep)


def cylinder(radius: float, low: float, high: float, sweep: float) -> Mesh:
    return revolved([radius, radius], [low, high], [(1, 0), (1, 0)], sweep)


def disk(radius: float, inner: float, height: float, sweep: float) -> Mesh:
    return revolved([radius, inner], [height, height], [(0, 1), (0, 1)], sweep)


def expanded(path: Path, work: Path) -> Path:
    """The path of a PLY file without compression by gzip."""
    if not path.is_file():
        raise SceneError(f"there is no `{path}`: complete the scene's files")
    if path.suffix != ".gz":
        return path
    plain = work / f"{abs(hash(path))}.ply"
    if not plain.exists():
        plain.write_bytes(gzip.decompress(path.read_bytes()))
    return plain


def header_of(path: Path) -> str:
    """The header of a PLY file."""
    with path.open("rb") as file:
        start = file.read(1 << 14)
    end = start.find(b"end_header")
    if not start.startswith(b"ply") or end < 0:
        raise SceneError(f"{path}: not a PLY file: complete the scene's files")
    return start[:end].decode("latin-1")


def has_normals(path: Path) -> bool:
    return " nx" in header_of(path)
