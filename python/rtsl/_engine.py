"""The engine that compiles methods."""

from __future__ import annotations

from typing import Optional

from . import _rtsl
from ._lock import ProcessLock

#: Makes kernels of methods, and keeps them. ``Engine(backend="auto", width=None, math="contract", loop_budget=None)``:
#: the backend is ``auto``, ``jit`` or ``interpreter``; the width is 1, 4, 8 or 16 rays at once, the best for this
#: machine if ``None``. Results are the same bits for every backend and width unless the math is ``fast``.
Engine = _rtsl.Engine

_lock = ProcessLock()
_default: Optional[_rtsl.Engine] = None


def default_engine() -> _rtsl.Engine:
    """Returns the engine of calls that name none."""
    global _default
    with _lock:
        if _default is None:
            _default = _rtsl.Engine()
        return _default


def set_default_engine(engine: Optional[_rtsl.Engine]) -> None:
    """Sets the engine of calls that name none; ``None`` for a new one with the usual options."""
    global _default
    with _lock:
        _default = engine
