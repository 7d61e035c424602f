"""Tests of the reader and the converter: `python -m pytest bench/public/tests`, with pytest and the
packages of the environment of `compare.py`."""

import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(FOLDER), str(FOLDER.parent / "mitsuba")]
