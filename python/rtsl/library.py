"""The standard library of shaders: ``rtsl.library.Sphere(radius=2)``.

Every class of the library is an attribute of this module; ``dir(rtsl.library)`` and ``names()`` list them.
"""

from __future__ import annotations

import functools
from typing import Dict, List

from . import _rtsl
from ._classes import Class, Unit
from ._lock import ProcessLock
from ._names import meant

_classes: Dict[str, Class] = {}
_lock = ProcessLock()


@functools.lru_cache(maxsize=None)
def _files() -> Dict[str, str]:
    return dict(_rtsl.library_classes())


def names() -> List[str]:
    """Returns the names of all classes of the library."""
    return sorted(_files())


def find(name: str) -> Class:
    """Returns the class of this name.

    Raises AttributeError if there is none.
    """
    with _lock:
        if name not in _classes:
            if name not in _files():
                raise AttributeError(f"the library has no class `{name}`{meant(name, names())}")
            for found in Unit(_rtsl.library_unit(name)):
                _classes.setdefault(found.name, found)
        return _classes[name]


def __getattr__(name: str) -> Class:
    if name.startswith("_"):
        raise AttributeError(name)
    return find(name)


def __dir__() -> List[str]:
    return ["find", "names", *names()]
