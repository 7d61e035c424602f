#!/usr/bin/env python3
"""Renders a large scene with pbrt-v4 and with rtsl, and prints their peaks of memory and their times.

    python3 large.py --pbrt BUILD/pbrt --rtsl target/release/rtsl --out large --images 64

The scene has a hundred meshes of a hundred thousand triangles, and as many images of 4096 by 4096 texels as asked for.
Both programs take one sample per pixel, so that most of their time is for loading. Needs numpy.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy

import pictures

MESHES = 100
# Vertices along a side of a mesh.
SIDE = 225
# Texels along a side of an image.
TEXELS = 4096

HEAD = """LookAt 5 -6 9  5 5 0  0 0 1
Camera "perspective" "float fov" 60
Film "rgb" "integer xresolution" 640 "integer yresolution" 480 "string filename" "large.exr"
Sampler "independent" "integer pixelsamples" 1
Integrator "path" "integer maxdepth" 4
WorldBegin
LightSource "infinite" "rgb L" [0.6 0.7 0.9]
LightSource "distant" "point3 from" [3 -2 5] "rgb L" [2 2 2]
"""


def write_images(folder: Path, count: int) -> None:
    """Writes images that differ by their place in one pattern."""
    place = numpy.arange(TEXELS) / TEXELS
    x, y = place[None, :], place[:, None]
    waves = [numpy.sin(a * x + b * y + a * b * x * y) for a, b in [(7, 31), (19, 11), (37, 3)]]
    noise = numpy.random.default_rng(1).integers(0, 8, (TEXELS, TEXELS, 1))
    pattern = (127 + 100 * numpy.stack(waves, -1) + noise).astype(numpy.uint8)
    for index in range(count):
        path = folder / f"image{index}.png"
        if not path.exists():
            shifted = numpy.roll(pattern, (61 * index, 37 * index), (0, 1))
            pictures.write_png(path, shifted, effort=1)


def write_mesh(path: Path, index: int, random: numpy.random.Generator) -> None:
    """Writes a field of heights over a unit square."""
    u, v = numpy.meshgrid(*[numpy.linspace(0, 1, SIDE)] * 2)
    a, b, c, d = random.uniform(5, 30, 4)
    heights = 0.1 * numpy.sin(a * u + b * v) * numpy.sin(c * u - d * v)
    vertices = numpy.stack([u + index % 10, v + index // 10, heights, u, v], -1).astype("<f4")
    number = numpy.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    corners = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
    triangles = numpy.stack([corners[at] for at in (0, 1, 2, 0, 2, 3)], -1).reshape(-1, 3)
    faces = numpy.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {SIDE * SIDE}"]
    head += [f"property float {name}" for name in "xyzuv"]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header", ""]
    path.write_bytes("\n".join(head).encode() + vertices.tobytes() + faces.tobytes())


def write_scene(folder: Path, images: int) -> Path:
    random = numpy.random.default_rng(2)
    lines = [HEAD]
    for index in range(images):
        lines.append(f'Texture "t{index}" "spectrum" "imagemap" "string filename" "image{index}.png"')
        lines.append(f'MakeNamedMaterial "m{index}" "string type" "diffuse" "texture reflectance" "t{index}"')
    for index in range(MESHES):
        write_mesh(folder / f"mesh{index}.ply", index, random)
        if images:
            lines.append(f'NamedMaterial "m{index % images}"')
        lines.append(f'Shape "plymesh" "string filename" "mesh{index}.ply"')
    scene = folder / "large.pbrt"
    scene.write_text("\n".join(lines) + "\n")
    return scene


def measure(name: str, command: list) -> None:
    """Runs a command and prints its peak of memory, and its seconds: of all processors, and by the clock."""
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"{' '.join(command)} failed")
    seconds = used.ru_utime + used.ru_stime
    print(f"{name}: {used.ru_maxrss / 2**20:.2f} GiB, {seconds:.0f} s, {time.monotonic() - start:.0f} s by the clock")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pbrt", required=True, help="the program of pbrt-v4")
    parser.add_argument("--rtsl", required=True, help="the program rtsl")
    parser.add_argument("--out", type=Path, required=True, help="a folder for the scene and the pictures")
    parser.add_argument("--images", type=int, default=64, help="the number of images")
    arguments = parser.parse_args()
    folder = arguments.out
    folder.mkdir(parents=True, exist_ok=True)
    write_images(folder, arguments.images)
    scene = str(write_scene(folder, arguments.images))
    measure("pbrt", [arguments.pbrt, "--quiet", "--outfile", str(folder / "pbrt.exr"), scene])
    render = [arguments.rtsl, "render", scene, "-o"]
    measure("rtsl", [*render, str(folder / "rtsl.exr")])
    measure("rtsl, texels in files", [*render, str(folder / "paged.exr"), "--texture-memory", "1KiB"])
    if (folder / "rtsl.exr").read_bytes() != (folder / "paged.exr").read_bytes():
        sys.exit("the pictures of rtsl differ")


if __name__ == "__main__":
    main()
