"""Error over time as an SVG: a field for each scene, a line for each system, both scales logarithmic."""

from math import log10
from pathlib import Path
from typing import Iterator

from error import Point

WIDTH, HEIGHT = 980, 360
# Left, right, top and bottom of the first field, and from one field to the next.
FIELD = 60, 300, 48, 300
STEP = 315
# Told apart in grey and with any eyes.
COLORS = "#0072b2", "#d55e00"


class Scale:
    """Logarithmic, with a little room on both sides."""

    def __init__(self, values: list[float], ends: tuple[float, float]):
        self.least = log10(min(values) / 1.4)
        self.greatest = log10(max(values) * 1.4)
        self.ends = ends

    def place(self, value: float) -> float:
        part = (log10(value) - self.least) / (self.greatest - self.least)
        return self.ends[0] + (self.ends[1] - self.ends[0]) * part

    def marks(self) -> Iterator[float]:
        """1, 2 and 5 of each power of ten."""
        for power in range(-6, 6):
            for value in (10.0**power, 2 * 10.0**power, 5 * 10.0**power):
                if self.least <= log10(value) <= self.greatest:
                    yield value


def text(x: float, y: float, anchor: str, words: str, color: str = "black") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{color}">{words}</text>'


def line(x1: float, y1: float, x2: float, y2: float) -> str:
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="#ddd"/>'


def series(points: list[Point], across: Scale, up: Scale, color: str) -> Iterator[str]:
    places = [(across.place(point.seconds), up.place(point.error)) for point in points]
    path = " L".join(f"{x:.1f},{y:.1f}" for x, y in places)
    yield f'<path d="M{path}" fill="none" stroke="{color}" stroke-width="2"/>'
    for x, y in places:
        yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{color}"/>'


def field(scene: str, points: list[Point], shift: float) -> Iterator[str]:
    left, right, top, bottom = FIELD[0] + shift, FIELD[1] + shift, *FIELD[2:]
    across = Scale([point.seconds for point in points], (left, right))
    up = Scale([point.error for point in points], (bottom, top))
    yield text((left + right) / 2, top - 12, "middle", scene.replace("_", " "))
    for value in across.marks():
        x = across.place(value)
        yield line(x, top, x, bottom)
        yield text(x, bottom + 18, "middle", f"{value:g}")
    for value in up.marks():
        y = up.place(value)
        yield line(left, y, right, y)
        yield text(left - 6, y + 4, "end", f"{value:g}")
    yield text((left + right) / 2, bottom + 38, "middle", "seconds")
    for system, color in zip(names(point.system for point in points), COLORS):
        yield from series([it for it in points if it.system == system], across, up, color)


def names(values) -> list[str]:
    """Each once, in the order of their first places."""
    return list(dict.fromkeys(values))


def write_plot(points: list[Point], path: Path) -> None:
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'font-family="sans-serif" font-size="13">',
        '<rect width="100%" height="100%" fill="white"/>',
        text(8, 16, "start", "root of the mean squared error"),
    ]
    for number, system in enumerate(names(point.system for point in points)):
        parts.append(text(WIDTH - 20 - 80 * number, 16, "end", system, COLORS[number]))
    for number, scene in enumerate(names(point.scene for point in points)):
        parts += field(scene, [it for it in points if it.scene == scene], STEP * number)
    path.write_text("\n".join([*parts, "</svg>"]) + "\n", encoding="utf-8")
