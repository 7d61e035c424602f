"""The scenes of a folder, and copies of their files with the settings of a comparison."""

import os
import re
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Iterator

from pbrt_file import Directive, SceneError, blank_comments, directives_of_file, read_text

# Copies are named so, and not taken for scenes.
PREFIX = ".rtsl-compare-"
# Directives of a scene that a copy replaces.
REPLACED = {"Film", "Sampler", "PixelFilter", "Integrator"}
MAIN = re.compile(r"(?<!\S)WorldBegin(?!\S)")
SETTING = re.compile(r'(?<!\S)(Film|Camera)\s+"')


@dataclass(frozen=True)
class SceneFile:
    """A scene by the name that tables have for it."""

    name: str
    path: Path


def find_scenes(folder: Path) -> list[SceneFile]:
    """Returns the scenes of a folder and of those in it, by name."""
    paths = [path for path in sorted(folder.rglob("*.pbrt")) if is_scene(path)]
    folders = [path.parent for path in paths]
    return [SceneFile(scene_name(path, folder, folders.count(path.parent)), path) for path in paths]


def is_scene(path: Path) -> bool:
    """True for a main file; false for one that others include."""
    if path.name.startswith(".") or not path.is_file():
        return False
    text = blank_comments(read_text(path))
    return bool(MAIN.search(text)) and bool(SETTING.search(text))


def scene_name(path: Path, folder: Path, count: int) -> str:
    """The folder of a scene, with the file's stem where the folder has several scenes."""
    parts = list(path.parent.relative_to(folder).parts)
    if count > 1 or not parts:
        parts.append(path.stem)
    # It is a part of names of files.
    return "-".join(parts)


@dataclass(frozen=True)
class Settings:
    """The settings that all renderers take from the copy."""

    width: int
    height: int
    # Edges of a path, with that from the camera.
    depth: int

    def text(self) -> str:
        """The directives. Paths of pbrt have bounces, one less than edges."""
        return (
            f'Film "rgb" "integer xresolution" {self.width} "integer yresolution" {self.height} '
            '"string filename" "rtsl-compare.exr"\n'
            'PixelFilter "box"\n'
            'Sampler "independent" "integer pixelsamples" 1\n'
            f'Integrator "path" "integer maxdepth" {self.depth - 1}\n'
        )


def with_settings(path: Path, settings: Settings) -> str:
    """Returns the text of a scene's main file with other settings."""
    text = read_text(path)
    parts, copied = [], 0
    for directive in preamble(path):
        start, end = directive.span
        if directive.name in REPLACED:
            parts.append(text[copied:start])
            copied = end
        if directive.name == "WorldBegin":
            return "".join([*parts, text[copied:start], settings.text(), text[start:]])
    raise SceneError(f"{path}: no `WorldBegin`: it is not the main file of a scene")


def preamble(path: Path) -> Iterator[Directive]:
    """Yields the directives of a file up to `WorldBegin`."""
    for directive in directives_of_file(path):
        yield directive
        if directive.name == "WorldBegin":
            return


@contextmanager
def copy_beside(scene: SceneFile, settings: Settings) -> Iterator[Path]:
    """A copy of a scene's main file with other settings, in the same folder, so that names of files
    hold; removed at the end."""
    copy = scene.path.with_name(f"{PREFIX}{os.getpid()}-{scene.path.name}")
    text = with_settings(scene.path, settings)
    try:
        try:
            copy.write_bytes(text.encode("latin-1"))
        except OSError as error:
            remedy = "copy the scenes to a folder that can be written"
            raise SceneError(f"{copy.parent}: {error.strerror}: {remedy}") from error
        yield copy
    finally:
        copy.unlink(missing_ok=True)
