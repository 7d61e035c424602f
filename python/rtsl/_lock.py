"""Locks of one process."""

from __future__ import annotations

import contextlib
import os
import threading
from typing import Any


class ProcessLock:
    """A lock that its thread may take again. A forked child has another one, which nobody holds."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._renew)

    def _renew(self) -> None:
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *_: Any) -> None:
        # A child whose thread forked while it held the parent's lock does not hold its own.
        with contextlib.suppress(RuntimeError):
            self._lock.release()
