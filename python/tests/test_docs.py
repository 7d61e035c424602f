"""The pages of the manual about Python."""

import pathlib
import re

import numpy as np
import pytest

import rtsl
from rtsl._names import POSITIONAL, snake_case

PAGES = pathlib.Path(__file__).parents[2] / "docs" / "src"


def test_the_table_of_positional_arguments_is_complete():
    page = (PAGES / "reference" / "python.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\w+) \| `(\w+)` \| (.*) \|$", page, re.MULTILINE)
    expected = [
        (role, snake_case(method), ", ".join(f"`{snake_case(it)}`" for it in names) or "none")
        for (role, method), names in POSITIONAL.items()
    ]
    assert rows == expected


def test_every_method_has_positional_arguments():
    found = {(it.role, it.name) for it in rtsl.library.Sphere.methods.values()}
    found |= {(it.role, it.name) for it in rtsl.library.Ward.methods.values()}
    assert found <= set(POSITIONAL)


def test_all_that_is_exported_is_in_the_reference():
    page = (PAGES / "reference" / "python.md").read_text(encoding="utf-8")
    missing = [name for name in rtsl.__all__ if not re.search(rf"`{name}\b", page)]
    assert missing in ([], ["BoundMethod"])


def test_the_programs_of_the_guide_run(monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path):
    page = (PAGES / "how-to" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    programs = [it for it in blocks if not it.startswith((">>>", "import mitsuba"))]
    assert len(programs) == 4
    monkeypatch.chdir(tmp_path)
    names = {"positions": np.eye(3, dtype=np.float32), "triangles": [[0, 1, 2]]}
    for program in programs:
        small = program.replace("spp=64, size=(640, 480)", "spp=1, size=(16, 12)")
        exec(small.replace("scene.inspect(320, 240", "scene.inspect(320, 240, spp=1"), names)
    np.testing.assert_array_equal(names["hits"].hit, [True, False])
    assert names["recording"].not_finite.code == "W0631" and len(names["costs"].dearest(5)) == 5
    assert (tmp_path / "ball.exr").is_file() and names["value"].shape == (2, 3)
