"""Transforms of shapes, lights and cameras: matrices of 4 by 4 numbers for columns of coordinates.

``translate(0, 1, 0) @ rotate(90, (0, 1, 0))`` turns first and then moves. Spaces are left-handed, as in the pbrt
format: +x is right, +y up, +z forward.
"""

from __future__ import annotations

from typing import Any, Sequence

import numpy as np


def translate(x: float, y: float, z: float) -> np.ndarray:
    """Returns the transform that moves."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def scale(x: float, y: "float | None" = None, z: "float | None" = None) -> np.ndarray:
    """Returns the transform that scales along the axes; one number scales along all."""
    return np.diag([x, x if y is None else y, x if z is None else z, 1.0])


def rotate(degrees: float, axis: Sequence[float]) -> np.ndarray:
    """Returns the rotation about an axis through the origin."""
    direction = np.asarray(axis, float)
    x, y, z = direction / np.linalg.norm(direction)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)
    return matrix


def look_at(eye: Sequence[float], target: Sequence[float], up: Sequence[float] = (0, 1, 0)) -> np.ndarray:
    """Returns the transform from the space of a camera, at `eye` towards `target`, to the world."""
    position = np.asarray(eye, float)
    forward = np.asarray(target, float) - position
    right = np.cross(np.asarray(up, float), forward)
    if not np.linalg.norm(right) > 0:
        raise ValueError("the camera looks nowhere, or along the vector that is up")
    forward, right = forward / np.linalg.norm(forward), right / np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(forward, right), forward, position], axis=1)
    return matrix


def as_matrix(transform: Any) -> np.ndarray:
    """Returns a transform as 4 by 4 numbers.

    Raises ValueError if it is none, or has no inverse.
    """
    matrix = np.eye(4) if transform is None else np.array(transform, float)
    if matrix.shape == (3, 4):
        matrix = np.vstack([matrix, [0, 0, 0, 1]])
    if matrix.shape != (4, 4) or not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise ValueError("a transform is a matrix of 4 by 4 numbers with 0, 0, 0, 1 in the last row")
    if not np.isfinite(matrix).all() or np.linalg.det(matrix[:3, :3]) == 0:
        raise ValueError("a transform needs an inverse")
    return matrix
