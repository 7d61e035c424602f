"""Colours of spectra, as linear sRGB: named ones, tables, and black bodies."""

import re
from functools import cache
from pathlib import Path

import numpy

from pbrt_file import Parameter, SceneError, read_text

REPOSITORY = Path(__file__).resolve().parents[2]
# RTSL's colours of named spectra: with the same colours, only the renderers differ.
NAMED = REPOSITORY / "crates" / "rtsl-scene" / "src" / "spectrum" / "named.rs"
ROW = re.compile(r'\("([\w-]+)", &\[([^\]]+)\]\)')
WAVELENGTHS = numpy.arange(360.0, 831.0)
TO_SRGB = numpy.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.969266, 1.8760108, 0.041556],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)
LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])
# The lobes of Wyman, Sloan and Shirley ("Simple Analytic Approximations to the CIE XYZ Color
# Matching Functions", JCGT 2013): weight, place, and the inverse widths below and above it.
LOBES = (
    ((1.056, 599.8, 1 / 37.9, 1 / 31.0), (0.362, 442.0, 1 / 16.0, 1 / 26.7),
     (-0.065, 501.1, 1 / 20.4, 1 / 26.2)),
    ((0.821, 568.8, 1 / 46.9, 1 / 40.5), (0.286, 530.9, 1 / 16.3, 1 / 31.1)),
    ((1.217, 437.0, 1 / 11.8, 1 / 36.0), (0.681, 459.0, 1 / 26.0, 1 / 13.8)),
)  # fmt: skip


@cache
def named_spectra() -> dict[str, list[float]]:
    rows = ROW.findall(NAMED.read_text(encoding="utf-8"))
    return {name: [float(word) for word in words.split(",")] for name, words in rows}


@cache
def observer() -> numpy.ndarray:
    """The matching functions of the CIE 1931 observer, a row each."""

    def lobe(weight: float, place: float, below: float, above: float) -> numpy.ndarray:
        offset = WAVELENGTHS - place
        return weight * numpy.exp(-0.5 * (offset * numpy.where(offset < 0, below, above)) ** 2)

    return numpy.array([sum(lobe(*it) for it in lobes) for lobes in LOBES])


def seen(values: numpy.ndarray) -> numpy.ndarray:
    return TO_SRGB @ (observer() @ values) / observer()[1].sum()


def light_color(values: numpy.ndarray) -> list[float]:
    """The colour of a light with luminance 1."""
    color = numpy.maximum(seen(values), 0)
    return (color / max(LUMINANCE @ color, 1e-30)).tolist()


def surface_color(values: numpy.ndarray) -> list[float]:
    """The colour of a reflectance or an index in white light; a constant is grey."""
    white = seen(numpy.ones_like(WAVELENGTHS))
    return numpy.maximum(seen(values) / white, 0).tolist()


def blackbody(kelvin: float) -> list[float]:
    metres = WAVELENGTHS * 1e-9
    exponent = 1.438776877e-2 / (metres * kelvin)
    return light_color(1 / (WAVELENGTHS**5 * numpy.expm1(numpy.minimum(exponent, 700.0))))


def table(numbers: list[float]) -> numpy.ndarray:
    """The values at all wavelengths of alternating wavelengths and values, 0 outside."""
    return numpy.interp(WAVELENGTHS, numbers[::2], numbers[1::2], left=0.0, right=0.0)


def file_numbers(path: Path) -> list[float]:
    lines = read_text(path).splitlines()
    return [float(word) for line in lines for word in line.split("#")[0].split()]


def color(parameter: Parameter, folder: Path, emits: bool = False) -> list[float]:
    """The three components of a parameter that is no texture, or one number for a grey."""
    values = parameter.values
    if parameter.type == "blackbody":
        return blackbody(float(values[0]))
    if isinstance(values[0], str):
        if values[0] in named_spectra():
            return named_spectra()[values[0]]
        path = folder / values[0]
        if not path.is_file():
            raise SceneError(f"`{values[0]}` is neither a known spectrum nor a file in {folder}")
        values = file_numbers(path)
    if parameter.type == "spectrum" and len(values) not in (1, 3):
        return (light_color if emits else surface_color)(table(values))
    return [float(value) for value in values]
