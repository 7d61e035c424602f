"""The progress of renders: in notebooks, on terminals, or nowhere."""

from __future__ import annotations

import sys
import time
from typing import Any, Optional

#: Seconds between two reports, and before the first.
_EVERY = 0.1


class Progress:
    """A bar that grows. `enabled` is ``None`` for one where somebody looks: in a notebook or on a terminal."""

    def __init__(self, enabled: Optional[bool]) -> None:
        self._start = self._told = time.monotonic()
        self._handle: Optional[Any] = None
        self._is_line = False
        self._in_notebook = enabled is not False and _is_notebook()
        self._on_terminal = not self._in_notebook and (
            bool(enabled) or (enabled is None and sys.stderr is not None and sys.stderr.isatty())
        )

    def update(self, part: float) -> None:
        """Shows that this part of the work is done."""
        now = time.monotonic()
        if now - self._told < _EVERY or not (self._in_notebook or self._on_terminal):
            return
        self._told = now
        left = (now - self._start) * (1 - part) / part if part > 0 else 0.0
        text = f"{100 * part:3.0f} %, {left:.0f} s left"
        if self._on_terminal:
            filled = int(30 * part)
            sys.stderr.write(f"\r[{'=' * filled}{' ' * (30 - filled)}] {text} ")
            sys.stderr.flush()
            self._is_line = True
            return
        from IPython.display import HTML, display

        bar = HTML(f'<progress value="{part:.3f}" max="1" style="width: 20em"></progress> {text}')
        if self._handle is None:
            self._handle = display(bar, display_id=True)
        else:
            self._handle.update(bar)

    def close(self) -> None:
        """Removes the bar."""
        if self._is_line:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()
        if self._handle is not None:
            from IPython.display import HTML

            self._handle.update(HTML(""))

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()


def _is_notebook() -> bool:
    """True in a kernel of Jupyter; IPython is not imported for that."""
    ipython = sys.modules.get("IPython")
    if ipython is None:
        return False
    shell = ipython.get_ipython()
    return shell is not None and hasattr(shell, "kernel")
