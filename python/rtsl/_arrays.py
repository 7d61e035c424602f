"""Arrays of any library as those of numpy, without a copy where their numbers are 32-bit floats."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

Shape = Tuple[int, ...]


def as_array(value: Any, what: str) -> np.ndarray:
    """Returns an array of 32-bit floats: the memory of `value` itself, if it has such numbers.

    Arrays of numpy, everything with ``__dlpack__`` on the processor (such as tensors of PyTorch), everything with the
    buffer protocol, and sequences of numbers.
    """
    if isinstance(value, np.ndarray):
        array = value
    elif hasattr(value, "__dlpack__"):
        try:
            array = np.from_dlpack(value)
        except (RuntimeError, BufferError, TypeError, ValueError) as error:
            raise TypeError(
                f"{what}: the {type(value).__name__} cannot be read: {error}; "
                "it must be on the processor and record no gradients (`.detach().cpu()`)"
            ) from error
    else:
        array = np.asarray(value)
    if array.dtype == np.float32 and array.dtype.isnative:
        return array
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{what}: expected numbers, found {array.dtype}")
    return array.astype(np.float32)


class Lanes:
    """The shape that the rays of a call have together, by the rules of broadcasting."""

    def __init__(self) -> None:
        self._arrays: Dict[str, Tuple[np.ndarray, int]] = {}
        self._shapes: List[Shape] = []

    def add(self, name: str, value: Any, components: int, what: str) -> None:
        """Adds the values of a variable: a number or vector for all rays, or an array with one for each."""
        array = as_array(value, what)
        if components == 1:
            leading = array.shape
        elif array.ndim == 0:
            # A number for a colour or a vector.
            array, leading = np.broadcast_to(array, (components,)), ()
        elif array.shape[-1] == components:
            leading = array.shape[:-1]
        else:
            raise ValueError(f"{what}: expected {components} numbers a ray, found an array of shape {array.shape}")
        self._arrays[name] = (array, components)
        self._shapes.append(leading)

    def add_shape(self, shape: Shape) -> None:
        """Adds a shape that the rays have."""
        self._shapes.append(tuple(shape))

    def shape(self) -> Shape:
        """Returns the shape of the rays.

        Raises ValueError if the arrays do not fit each other.
        """
        try:
            return np.broadcast_shapes(*self._shapes) if self._shapes else ()
        except ValueError:
            shapes = ", ".join(f"{name} {array.shape}" for name, (array, _) in self._arrays.items())
            raise ValueError(f"the arrays do not have the same rays: {shapes}") from None

    def rows(self, shape: Shape) -> List[Tuple[str, np.ndarray]]:
        """Returns the arrays with a row for each ray. Those that are the same for all rays repeat without memory."""
        return [(name, rows_of(array, shape, components)) for name, (array, components) in self._arrays.items()]


def rows_of(array: np.ndarray, shape: Shape, components: int) -> np.ndarray:
    """Returns the array with a row for each ray of a shape."""
    count = math.prod(shape)
    leading = array.shape if components == 1 else array.shape[:-1]
    if leading == ():
        return np.broadcast_to(array.reshape(1, components), (count, components))
    inner = () if components == 1 else (components,)
    if leading != shape:
        array = np.broadcast_to(array, shape + inner)
    return array.reshape(count, components)


def mask_rows(mask: Any, shape: Shape) -> Optional[np.ndarray]:
    """Returns a mask as bytes, one for each ray."""
    if mask is None:
        return None
    array = np.asarray(mask)
    if array.dtype != np.bool_:
        raise TypeError(f"a mask is an array of bools, not of {array.dtype}")
    count = math.prod(shape)
    return np.broadcast_to(array, shape).reshape(count, 1).view(np.uint8)


def output_array(given: Any, shape: Shape, components: int, name: str) -> np.ndarray:
    """Returns the array for results of a variable: the given one, if it fits, or a new one."""
    expected = shape if components == 1 else shape + (components,)
    if given is None:
        return np.empty(expected, np.float32)
    array = given if isinstance(given, np.ndarray) else np.from_dlpack(given)
    if array.shape != expected or array.dtype != np.float32 or not array.flags.writeable:
        raise ValueError(
            f"out[{name!r}]: expected a writable array of float32 of shape {expected}, "
            f"found one of {array.dtype} of shape {array.shape}"
        )
    return array


def output_rows(array: np.ndarray, shape: Shape, components: int) -> np.ndarray:
    """Returns a view of an array for results with a row for each ray."""
    count = math.prod(shape)
    rows = array.reshape(count, components)
    if count > 0 and not np.may_share_memory(rows, array):
        raise ValueError(f"an array for results of strides {array.strides} has no row for each ray")
    return rows


def scalar_or_array(array: np.ndarray) -> Any:
    """Returns a number for an array without dimensions."""
    return array[()] if array.ndim == 0 else array

