"""What methods ask of the renderer that calls them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, List, Sequence, Tuple, Union

from ._arguments import checked_class

Color = Union[float, Sequence[float]]


@checked_class
@dataclass
class LightSample:
    """A light that `illuminance` meets, the same at every point."""

    #: The unit vector towards it.
    direction: Sequence[float]
    #: Its radiance, or the whole contribution if the density is 0.
    color: Color = 1.0
    distance: float = math.inf
    #: The density per solid angle; 0 for a delta.
    pdf: float = 0.0


@checked_class
@dataclass
class Host:
    """The answers to what methods ask: the same for every ray, except random numbers.

    >>> Host(ambient=0.1, lights=[LightSample((0, 1, 0), color=(3, 3, 2))]).lights[0].distance
    inf
    """

    #: The radiance along every ray that a method traces.
    trace: Color = 0.0
    #: True if every ray is occluded.
    occluded: bool = False
    #: The ambient light.
    ambient: Color = 0.0
    lights: List[LightSample] = field(default_factory=list)
    #: The seed of `rand()`, whose numbers depend on it, on the ray and on the draw.
    seed: int = 0

    def _answers(self) -> Tuple[Any, ...]:
        lights = [
            (vector(it.direction), float(it.distance), vector(it.color), float(it.pdf)) for it in self.lights
        ]
        return vector(self.trace), bool(self.occluded), vector(self.ambient), lights, self.seed & (2**64 - 1)


def vector(value: Color) -> List[float]:
    """Returns three numbers: those of a sequence, or one number three times."""
    numbers = [float(value)] * 3 if not hasattr(value, "__len__") else [float(it) for it in value]  # type: ignore
    if len(numbers) != 3:
        raise ValueError(f"expected a number or three, not {len(numbers)}")
    return numbers
