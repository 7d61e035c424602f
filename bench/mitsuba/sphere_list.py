"""Spheres at random places, the same for every system and on every machine."""

from dataclasses import dataclass
from typing import Iterator

# For each scene the number of spheres.
COUNTS = {"spheres": 1_000, "spheres_10k": 10_000}
HALF_WIDTH = 10.0
# Of a thousand spheres; more are smaller, so that they fill as much space.
RADII = (0.2, 0.8)
GLASS_SHARE = 0.25
GLASS_INDEX = 1.5
COLORS = 16


@dataclass(frozen=True)
class Sphere:
    center: tuple[float, float, float]
    radius: float
    # The number of a colour; None is glass.
    color: int | None


def color(number: int) -> tuple[float, float, float]:
    """Strides that have no factor in common with the number of colours tell all of them apart."""
    red, green, blue = (0.2 + 0.6 * (number * stride % COLORS) / 15 for stride in (5, 7, 11))
    return red, green, blue


def uniform_numbers(state: int = 42) -> Iterator[float]:
    """Numbers below 1, by Knuth's linear congruential generator for MMIX: its upper 24 bits."""
    while True:
        state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
        yield (state >> 40) / 2.0**24


def spheres(count: int) -> Iterator[Sphere]:
    numbers = uniform_numbers()
    scale = (1_000 / count) ** (1 / 3)
    for _ in range(count):
        x, y, z = (HALF_WIDTH * (2.0 * next(numbers) - 1.0) for _ in range(3))
        radius = scale * (RADII[0] + (RADII[1] - RADII[0]) * next(numbers))
        glass = next(numbers) < GLASS_SHARE
        yield Sphere((x, y, z), radius, None if glass else int(next(numbers) * COLORS))


def pbrt_text(count: int) -> str:
    """The materials and spheres in the format of pbrt-v4."""
    lines = []
    for number in range(COLORS):
        red, green, blue = color(number)
        lines.append(
            f'MakeNamedMaterial "color {number}" "string type" "diffuse" '
            f'"rgb reflectance" [{red:.9g} {green:.9g} {blue:.9g}]'
        )
    lines.append(
        f'MakeNamedMaterial "glass" "string type" "dielectric" "float eta" {GLASS_INDEX}'
    )
    for sphere in spheres(count):
        material = "glass" if sphere.color is None else f"color {sphere.color}"
        x, y, z = sphere.center
        lines.append(
            f'AttributeBegin NamedMaterial "{material}" Translate {x:.9g} {y:.9g} {z:.9g} '
            f'Shape "sphere" "float radius" {sphere.radius:.9g} AttributeEnd'
        )
    return "\n".join(lines) + "\n"
