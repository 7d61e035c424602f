"""Copies and pickles of objects that hold what cannot be written: code, renderers, open scenes."""

from __future__ import annotations

from typing import Any


class NotPickled:
    """Objects that another process has to make itself."""

    #: What to do instead.
    _INSTEAD = ""

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError(f"objects of type {type(self).__name__} cannot be pickled: {self._INSTEAD}")


class NotCopied(NotPickled):
    """Objects that, besides, have no copies."""

    def __copy__(self) -> Any:
        raise TypeError(f"objects of type {type(self).__name__} cannot be copied: {self._INSTEAD}")

    def __deepcopy__(self, memo: Any) -> Any:
        return self.__copy__()


class Immutable(NotPickled):
    """Objects that do not change, and are their own copies."""

    def __copy__(self) -> Any:
        return self

    def __deepcopy__(self, memo: Any) -> Any:
        return self
