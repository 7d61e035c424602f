#!/usr/bin/env python3
"""Gives a checkout of pbrt-v4 entries for RTSL classes: one in each list of types that it dispatches over.

    python3 patch.py CHECKOUT

Everything is added, nothing is changed or removed. Running it again brings the adapter's sources up to date.
"""

import argparse
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent

# How kernels are called; it comes with the C interface.
KERNEL_HEADER = HERE.parents[1] / "crates" / "rtsl-capi" / "include" / "rtsl_kernel.h"

# Made and tested against this commit. Later ones will do as long as the places below are found.
COMMIT = "5f7a606806a4ac7b939131ded9d7a30ebd02416e"

# Lists of types: the header, the class that dispatches, the type that is added.
LISTS = [
    ("base/shape.h", "Shape", "RtslShape"),
    ("base/material.h", "Material", "RtslMaterial"),
    ("base/bxdf.h", "BxDF", "RtslBxDF"),
    ("base/texture.h", "FloatTexture", "RtslFloatTexture"),
    ("base/texture.h", "SpectrumTexture", "RtslSpectrumTexture"),
    ("base/light.h", "Light", "RtslLight"),
    ("base/camera.h", "Camera", "RtslCamera"),
]

# Definitions that dispatch need the types complete: the header, the first such definition, what is included before it.
INCLUDES = [
    ("shapes.h", "Shape::Bounds", "shape.h"),
    ("bxdfs.h", "BxDF::f", "bxdf.h"),
    ("textures.h", "FloatTexture::Evaluate", "texture.h"),
    ("materials.h", "Material::GetBSDF", "material.h"),
    ("lights.h", "Light::SampleLi", "light.h"),
    ("cameras.h", "Camera::GenerateRay", "camera.h"),
]

# Functions that make things by their names in the scene: the file, the function, what makes an RTSL one.
CREATORS = [
    (
        "shapes.cpp",
        "Shape::Create",
        "shapes = RtslShape::Create(renderFromObject, objectFromRender, reverseOrientation, parameters, loc, alloc);",
    ),
    (
        "materials.cpp",
        "Material::Create",
        "material = RtslMaterial::Create(parameters, normalMap, loc, alloc);",
    ),
    (
        "textures.cpp",
        "FloatTexture::Create",
        "tex = RtslFloatTexture::Create(renderFromTexture, parameters, loc, alloc);",
    ),
    (
        "textures.cpp",
        "SpectrumTexture::Create",
        "tex = RtslSpectrumTexture::Create(renderFromTexture, parameters, spectrumType, loc, alloc);",
    ),
    (
        "lights.cpp",
        "Light::Create",
        "light = RtslLight::Create(renderFromLight, outsideMedium, parameters, loc, alloc);",
    ),
    (
        "lights.cpp",
        "Light::CreateArea",
        "area = RtslLight::CreateArea(renderFromLight, mediumInterface, parameters, shape, alpha, loc, alloc);",
    ),
    (
        "cameras.cpp",
        "Camera::Create",
        "camera = RtslCamera::Create(parameters, cameraTransform, film, medium, loc, alloc);",
    ),
]


class Misfit(Exception):
    """A place that a checkout does not have."""


class Source:
    """A file of the checkout."""

    def __init__(self, path: Path):
        if not path.is_file():
            raise Misfit(f"{path} does not exist; give the folder of a checkout of pbrt-v4")
        self.path = path
        self.text = path.read_text()

    def insert(self, position: int, text: str) -> None:
        """Adds text, and writes the file."""
        self.text = self.text[:position] + text + self.text[position:]
        self.path.write_text(self.text)

    def find(self, pattern: str, what: str, start: int = 0) -> re.Match:
        """The first match from a position on."""
        match = re.compile(pattern, re.MULTILINE | re.DOTALL).search(self.text, start)
        if match is None:
            raise Misfit(f"{self.path} has no {what}; pbrt-v4 has changed since commit {COMMIT[:12]}")
        return match


def add_to_list(source: Source, dispatcher: str, added: str) -> None:
    """Adds a type to the end of a list, and declares it before."""
    if added in source.text:
        return
    pattern = rf"^class {dispatcher}\s*:\s*public TaggedPointer<[^{{]*?(\w)\s*>\s*{{"
    types = source.find(pattern, f"list of types of {dispatcher}")
    source.insert(types.end(1), f", {added}")
    source.insert(types.start(), f"class {added};\n\n")


def include_before(source: Source, definition: str, header: str) -> None:
    """Includes a header before a definition in the namespace."""
    line = f"#include <pbrt/rtsl/{header}>"
    if line in source.text:
        return
    pattern = rf"^(template <[^\n]*>\n)?[^\n]*\binline [^\n]*{re.escape(definition)}\("
    place = source.find(pattern, f"definition of {definition}").start()
    source.insert(place, f"}}  // namespace pbrt\n\n{line}\n\nnamespace pbrt {{\n\n")


def add_creator(source: Source, function: str, statement: str) -> None:
    """Makes a function know the name "rtsl"."""
    if statement in source.text:
        return
    head = source.find(rf"^\S+ {re.escape(function)}\(|^\S[^\n]*> {re.escape(function)}\(", f"function {function}")
    first = source.find(r"^    if \(name", f"names in {function}", head.end())
    source.insert(first.start(), f'    if (name == "rtsl")\n        {statement}\n    else\n')


def add_sky(source: Source) -> None:
    """Has the wavefront integrator find lights that rays meet which leave the scene: it knows them by their types."""
    statement = "if (l.Is<RtslLight>() && l.Type() == LightType::Infinite)"
    if statement in source.text:
        return
    place = source.find(r"^        if \(l\.Is<UniformInfiniteLight>\(\)", "list of infinite lights").start()
    source.insert(place, f"        {statement}\n            infiniteLights->push_back(l);\n")


def add_sources(source: Source, files: list[str]) -> None:
    """Adds the adapter to the library, and what opens shared libraries."""
    if "src/pbrt/rtsl/" in source.text:
        return
    names = "".join(f"\n  src/pbrt/rtsl/{file}" for file in files)
    library = source.find(r"^set \(PBRT_SOURCE$", "list of sources")
    source.insert(library.end(), names)
    linked = source.find(r"^set \(ALL_PBRT_LIBS\n", "list of libraries")
    source.insert(linked.end(), "  ${CMAKE_DL_LIBS}\n")


def copy_adapter(folder: Path) -> list[str]:
    """Copies the adapter's files that differ; the names of its sources."""
    folder.mkdir(exist_ok=True)
    files = [*sorted((HERE / "rtsl").iterdir()), KERNEL_HEADER]
    for file in files:
        copy = folder / file.name
        if not copy.is_file() or copy.read_bytes() != file.read_bytes():
            copy.write_bytes(file.read_bytes())
    return [file.name for file in files if file.suffix == ".cpp"]


def patch(checkout: Path) -> None:
    """Does all of it."""
    root = checkout / "src" / "pbrt"
    for file, dispatcher, added in LISTS:
        add_to_list(Source(root / file), dispatcher, added)
    for file, definition, header in INCLUDES:
        include_before(Source(root / file), definition, header)
    for file, function, statement in CREATORS:
        add_creator(Source(root / file), function, statement)
    add_sky(Source(root / "wavefront" / "integrator.cpp"))
    sources = copy_adapter(root / "rtsl")
    add_sources(Source(checkout / "CMakeLists.txt"), sources)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkout", type=Path, help="folder of a checkout of pbrt-v4")
    arguments = parser.parse_args()
    try:
        patch(arguments.checkout)
    except (Misfit, OSError) as error:
        print(f"patch.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
