"""Reader of pbrt-v4 scenes: tokens, parameters and directives, with the files that they include."""

import gzip
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Iterator

import numpy

# A quoted text, a list without quoted texts, a bracket of another list, a word.
TOKEN = re.compile(r'"([^"]*)"|\[([^\]"\[]*)\]|([\[\]])|([^\s"\[\]]+)')
COMMENT = re.compile(r'"[^"]*"|#[^\n]*')
# Directives by the number of numbers that follow them.
NUMBERS = {
    "Identity": 0,
    "Translate": 3,
    "Scale": 3,
    "Rotate": 4,
    "LookAt": 9,
    "Transform": 16,
    "ConcatTransform": 16,
    "TransformTimes": 2,
    "ReverseOrientation": 0,
    "AttributeBegin": 0,
    "AttributeEnd": 0,
    "TransformBegin": 0,
    "TransformEnd": 0,
    "ObjectEnd": 0,
    "WorldBegin": 0,
}
# Directives by the number of texts that follow them. `MediumInterface` has one or two.
TEXTS = {
    "CoordinateSystem": 1,
    "CoordSysTransform": 1,
    "ColorSpace": 1,
    "Include": 1,
    "Import": 1,
    "ObjectBegin": 1,
    "ObjectInstance": 1,
    "NamedMaterial": 1,
    "MediumInterface": 1,
}
# The same for directives with parameters after the texts.
WITH_PARAMETERS = {
    "Camera": 1,
    "Film": 1,
    "Sampler": 1,
    "PixelFilter": 1,
    "Integrator": 1,
    "Accelerator": 1,
    "Attribute": 1,
    "Option": 0,
    "Shape": 1,
    "Material": 1,
    "MakeNamedMaterial": 1,
    "MakeNamedMedium": 1,
    "Texture": 3,
    "LightSource": 1,
    "AreaLightSource": 1,
}
# Directives of earlier versions of the format.
FORMER = {"WorldEnd", "SurfaceIntegrator", "VolumeIntegrator", "Renderer", "SearchPath", "Volume"}
BOOLEANS = {"true": True, "false": False}


class SceneError(Exception):
    """An error of a scene: the message has the file and the remedy."""


@dataclass(frozen=True)
class Parameter:
    """A parameter with its type, such as `rgb`, and its values: numbers, texts or booleans."""

    type: str
    values: list


class Parameters(dict[str, Parameter]):
    """Parameters by their names."""

    def number(self, name: str, default: float) -> float:
        found = self.get(name)
        return float(found.values[0]) if found and self.is_numeric(name) else default

    def numbers(self, name: str) -> list[float] | None:
        return [float(it) for it in self[name].values] if self.is_numeric(name) else None

    def text(self, name: str, default: str = "") -> str:
        found = self.get(name)
        return found.values[0] if found and isinstance(found.values[0], str) else default

    def flag(self, name: str, default: bool) -> bool:
        found = self.get(name)
        return bool(found.values[0]) if found else default

    def is_numeric(self, name: str) -> bool:
        found = self.get(name)
        return bool(found) and not isinstance(found.values[0], str)


@dataclass(frozen=True)
class Directive:
    """A directive with its arguments, and its place in the text of its file."""

    name: str
    file: Path
    span: tuple[int, int]
    texts: list[str] = field(default_factory=list)
    numbers: list[float] = field(default_factory=list)
    parameters: Parameters = field(default_factory=Parameters)


def read_text(path: Path) -> str:
    """Returns the text of a file; each byte becomes a character, so that places agree."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}: the scene's files must be complete") from error
    if content[:2] == b"\x1f\x8b":
        content = gzip.decompress(content)
    return content.decode("latin-1")


def blank_comments(text: str) -> str:
    """Replaces comments by blanks."""

    def blank(match: re.Match) -> str:
        found = match.group()
        return found if found[0] == '"' else " " * len(found)

    return COMMENT.sub(blank, text) if "#" in text else text


class Tokens:
    """The tokens of a file, with one to look ahead."""

    def __init__(self, path: Path):
        self.path = path
        self.text = blank_comments(read_text(path))
        self.matches = TOKEN.finditer(self.text)
        # The end of the last token that was taken.
        self.end = 0
        self.next: re.Match | None = next(self.matches, None)

    def take(self) -> re.Match:
        if self.next is None:
            raise self.error("the file ends within a directive")
        taken, self.next = self.next, next(self.matches, None)
        self.end = taken.end()
        return taken

    def is_quoted(self) -> bool:
        return self.next is not None and self.next.group(1) is not None

    def quoted(self) -> str:
        if not self.is_quoted():
            raise self.error("expected a quoted text")
        return self.take().group(1)

    def error(self, problem: str) -> SceneError:
        place = self.next.start() if self.next else len(self.text)
        line = self.text.count("\n", 0, place) + 1
        return SceneError(f"{self.path}:{line}: {problem}; `rtsl scene info` checks a scene")

    def numbers(self, count: int) -> list[float]:
        """So many numbers, in a list or not."""
        words: list[str] = []
        while len(words) < count:
            taken = self.take()
            words += (taken.group(2) or taken.group(4) or "").split()
        try:
            return [float(word) for word in words]
        except ValueError:
            raise self.error("expected numbers") from None

    def values(self) -> list:
        """The values of a parameter: a list or a single one."""
        taken = self.take()
        if taken.group(2) is not None:
            return plain_values(taken.group(2).replace(",", " "))
        if taken.group(3) is None:
            return [taken.group(1)] if taken.group(1) is not None else plain_values(taken.group(4))
        found = []
        while (taken := self.take()).group(3) is None:
            found.append(taken.group(1) if taken.group(1) is not None else taken.group())
        return found

    def parameters(self) -> Parameters:
        found = Parameters()
        while self.is_quoted():
            declaration = self.quoted().split()
            if len(declaration) != 2:
                raise self.error('expected a type and a name, such as "float radius"')
            kind, name = declaration
            values = self.values()
            if kind == "bool":
                values = [BOOLEANS.get(it, it) for it in values]
            if values:
                found[name] = Parameter(kind, values)
        return found


def plain_values(text: str) -> list:
    """Numbers or booleans without quotes."""
    words = text.split()
    if words and words[0] in BOOLEANS:
        return [BOOLEANS[word] for word in words]
    try:
        return numpy.array(words, dtype=numpy.float64).tolist()
    except ValueError:
        return words


def directives(path: Path, folder: Path | None = None) -> Iterator[Directive]:
    """Yields the directives of a scene. Names of files are relative to its main file's folder."""
    folder = folder or path.parent
    for directive in directives_of_file(path):
        if directive.name not in ("Include", "Import"):
            yield directive
            continue
        # An imported file leaves the current attributes as they are.
        block = directive.name == "Import"
        if block:
            yield Directive("AttributeBegin", path, directive.span)
        yield from directives(folder / directive.texts[0].replace("\\", "/"), folder)
        if block:
            yield Directive("AttributeEnd", path, directive.span)


def directives_of_file(path: Path) -> Iterator[Directive]:
    """Yields the directives of one file, among them those that include others."""
    tokens = Tokens(path)
    while tokens.next is not None:
        start = tokens.next.start()
        name = tokens.take().group(4)
        texts: list[str] = []
        numbers: list[float] = []
        parameters = Parameters()
        if name in NUMBERS:
            numbers = tokens.numbers(NUMBERS[name])
        elif name in TEXTS:
            texts = [tokens.quoted() for _ in range(TEXTS[name])]
            if name == "MediumInterface" and tokens.is_quoted():
                texts.append(tokens.quoted())
        elif name in WITH_PARAMETERS:
            texts = [tokens.quoted() for _ in range(WITH_PARAMETERS[name])]
            parameters = tokens.parameters()
        elif name == "ActiveTransform":
            texts = [tokens.take().group()]
        elif name in FORMER:
            remedy = "`rtsl scene convert` writes it in the format of pbrt-v4"
            raise SceneError(f"{path}: the scene is of an earlier version of pbrt: {remedy}")
        else:
            raise tokens.error(f"unknown directive before this: `{name}`")
        yield Directive(name, path, (start, tokens.end), texts, numbers, parameters)
