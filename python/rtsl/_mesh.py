"""Meshes of arrays."""

from __future__ import annotations

from typing import Any, Optional

import numpy as np

from ._arrays import as_array
from ._instance import Instance


def mesh(
    positions: Any,
    triangles: Any,
    *,
    normals: Optional[Any] = None,
    uvs: Optional[Any] = None,
) -> Instance:
    """Returns a mesh of triangles: an instance of `TriangleMesh`.

    ``positions`` has a row of three numbers for each vertex, as have ``normals``; ``uvs`` have two. ``triangles`` has
    the indices of three vertices in each row.

    >>> mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    TriangleMesh(positions=(3, 3) numbers, normals=(0, 3) numbers, uvs=(0, 2) numbers, indices=[[0, 1, 2]])
    """
    from . import library

    vertices = _rows(positions, 3, "`positions`")
    indices = np.asarray(triangles)
    if indices.ndim != 2 or indices.shape[1] != 3 or indices.dtype.kind not in "iu":
        raise ValueError(f"`triangles`: expected rows of 3 whole numbers, found {indices.dtype} of {indices.shape}")
    if indices.size > 0 and (indices.min() < 0 or indices.max() >= len(vertices)):
        raise ValueError(f"`triangles`: there are {len(vertices)} vertices, counted from 0")
    given = {"`normals`": (normals, 3), "`uvs`": (uvs, 2)}
    arrays = []
    for what, (values, count) in given.items():
        array = np.zeros((0, count), np.float32) if values is None else _rows(values, count, what)
        if values is not None and len(array) != len(vertices):
            raise ValueError(f"{what}: there are {len(vertices)} vertices, and {len(array)} rows")
        arrays.append(array)
    return library.find("TriangleMesh")(positions=vertices, normals=arrays[0], uvs=arrays[1], indices=indices)


def _rows(values: Any, count: int, what: str) -> np.ndarray:
    array = as_array(values, what)
    if array.ndim != 2 or array.shape[1] != count:
        raise ValueError(f"{what}: expected rows of {count} numbers, found an array of shape {array.shape}")
    return array
