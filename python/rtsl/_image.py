"""Rendered pictures."""

from __future__ import annotations

import copy as copies
import os
from typing import Any, Dict, Mapping, Optional, Union

import numpy as np

from . import _rtsl
from ._arguments import checked
from ._copies import NotPickled


class Image(NotPickled):
    """A picture of linear colours, with images of other quantities (AOVs) by name.

    In a notebook it shows itself.
    """

    _INSTEAD = "`pixels` and `aovs` are arrays, and `save` writes a file"

    def __init__(self, picture: _rtsl.Picture, figures: Optional[Mapping[str, Any]] = None) -> None:
        self._picture = picture
        self._figures = dict(figures or {})
        self._pixels: Optional[np.ndarray] = None
        self._aovs: Optional[Dict[str, np.ndarray]] = None

    @property
    def pixels(self) -> np.ndarray:
        """The colours in linear sRGB as 32-bit floats: rows from the top, columns, channels."""
        if self._pixels is None:
            self._pixels = self._picture.pixels()
        return self._pixels

    @property
    def aovs(self) -> Dict[str, np.ndarray]:
        """The AOVs by name: rows, columns, and channels if there are several."""
        if self._aovs is None:
            self._aovs = self._picture.aovs()
        return self._aovs

    def __getitem__(self, name: str) -> np.ndarray:
        return self.aovs[name]

    @property
    def width(self) -> int:
        """Columns."""
        return int(self.pixels.shape[1])

    @property
    def height(self) -> int:
        """Rows."""
        return int(self.pixels.shape[0])

    @property
    def statistics(self) -> Dict[str, Any]:
        """Figures of the render: `seconds`, `samples` of a pixel, `rays`, `threads` and others."""
        return {**self._picture.statistics(), **self._figures}

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> np.ndarray:
        array = self.pixels if dtype is None else self.pixels.astype(dtype)
        return array.copy() if copy else array

    @checked
    def png(self, *, exposure: float = 0.0, view: str = "standard") -> bytes:
        """Returns the picture as a PNG file; `view` is `standard`, `filmic` or `raw`."""
        return self._picture.png(exposure, view)

    def _repr_png_(self) -> bytes:
        return self.png()

    @checked
    def save(
        self,
        path: Union[str, "os.PathLike[str]"],
        *,
        exposure: float = 0.0,
        view: str = "standard",
        half: bool = False,
        parts: bool = False,
    ) -> None:
        """Writes the picture and its AOVs: as displayed to a PNG and files beside it, or linear to one EXR.

        ``half`` writes colours of an EXR with 16 bits, and ``parts`` each image as a part of its own.
        """
        self._picture.save(os.fspath(path), exposure, view, half, parts)

    def __copy__(self) -> "Image":
        copied = Image(self._picture, self._figures)
        copied._pixels, copied._aovs = self.pixels, self.aovs
        return copied

    def __deepcopy__(self, memo: Dict[int, Any]) -> "Image":
        copied = Image(self._picture, self._figures)
        copied._pixels, copied._aovs = copies.deepcopy((self._pixels, self._aovs), memo)
        return copied

    def __repr__(self) -> str:
        names = f", AOVs {', '.join(self.aovs)}" if self.aovs else ""
        return f"<Image of {self.width} by {self.height} pixels{names}>"
