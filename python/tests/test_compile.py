"""Compiling texts, and what is known of their classes."""

import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import rtsl

TEXT = """
/// A ball.
class Ball : rt_Primitive;
enum Side { Inner = 0, Outer = 3 };
[[min 0, max 10, unit "m", label "Radius", doc "Half its width."]] public float radius = 1.5;
public Side side = Outer;
public color tint = color(0.1, 0.2, 0.3);
public int counts[];
public rt_Texture pattern;
scratch float depth;
void intersect() { depth = radius; hit(-rt_RayOrigin.z - radius); }
/// Points outward.
void computeNormal() { rt_GeometricNormal = rt_HitPoint; }
"""


def test_classes_are_described():
    unit = rtsl.compile(TEXT, name="ball.rtsl")
    (ball,) = unit.classes
    assert unit.Ball is unit["Ball"] is ball
    assert (ball.name, ball.role, ball.doc) == ("Ball", "primitive", "A ball.")
    radius = ball.parameters["radius"]
    assert (radius.type, radius.default, radius.min, radius.max) == ("float", 1.5, 0, 10)
    assert (radius.unit, radius.label, radius.doc) == ("m", "Radius", "Half its width.")
    assert ball.parameters["side"].choices == [("Inner", 0), ("Outer", 3)]
    assert ball.parameters["pattern"].takes == "texture"
    np.testing.assert_allclose(ball.parameters["tint"].default, [0.1, 0.2, 0.3])
    assert ball.scratch == [("depth", "float")]
    assert "radius (float = 1.5) [min 0, max 10]: Half its width." in ball.__doc__


def test_methods_tell_their_state():
    ball = rtsl.compile(TEXT).Ball
    intersect = ball.methods["intersect"]
    assert [it.alias for it in intersect.sets] == ["hit_distance"]
    assert "rt_RayOrigin" in [it.name for it in intersect.reads]
    normal = ball.methods["computeNormal"]
    assert (normal.alias, normal.doc, normal.positional) == ("compute_normal", "Points outward.", ("rt_HitPoint",))
    (point,) = [it for it in normal.reads if it.name == "rt_HitPoint"]
    assert (point.type, point.components, point.default) == ("vec3", 3, [0.0, 0.0, 0.0])
    assert "Points outward." in ball(counts=[]).compute_normal.__doc__


def test_errors_are_exceptions_with_diagnostics():
    with pytest.raises(rtsl.CompileError) as caught:
        rtsl.compile("class A : rt_Texture;\nvoid lookup() { rt_TextureColour = color(1.0); }", name="a.rtsl")
    assert isinstance(caught.value, rtsl.Error)
    assert str(caught.value).startswith("error[E0201]")
    assert "a.rtsl:2:17" in str(caught.value)
    first = caught.value.diagnostics[0]
    assert (first.code, first.severity, first.file, first.line, first.column) == ("E0201", "error", "a.rtsl", 2, 17)
    assert (first.end_line, first.end_column) == (2, 33)
    assert "rt_TextureColor" in str(first.suggestions) + str(first.help)


def test_files_find_what_is_beside_them(tmp_path: pathlib.Path):
    (tmp_path / "grey.rtsl").write_text("float grey() { return 0.25; }")
    path = tmp_path / "a.rtsl"
    path.write_text('#include "grey.rtsl"\nclass A : rt_Texture;\nvoid lookup() { rt_FloatTextureValue = grey(); }')
    unit = rtsl.compile_file(path)
    assert unit.A().lookup((0, 0)).float_texture_value == 0.25
    with pytest.raises(rtsl.CompileError, match="can't be read"):
        rtsl.compile_file(tmp_path / "missing.rtsl")


def test_unknown_classes_suggest_others():
    with pytest.raises(AttributeError, match="did you mean `Ball`"):
        rtsl.compile(TEXT).Bal
    with pytest.raises(AttributeError, match="did you mean `Torus`"):
        rtsl.library.Tours
    assert {"Sphere", "Ward", "Checker", "Pinhole", "PointLight", "Path"} <= set(dir(rtsl.library))
    assert rtsl.library.Sphere is rtsl.library.Sphere


def test_engines_refuse_what_they_do_not_have():
    with pytest.raises(rtsl.Error, match="no backend `fast`"):
        rtsl.Engine(backend="fast")
    assert rtsl.Engine(backend="interpreter").is_compiled is False


def test_info_tells_what_was_found():
    info = rtsl.info()
    assert info["rtsl"] == rtsl.__version__
    assert (info["llvm"] is None) == (info["remedy"] is not None)


def in_new_process(program, **variables):
    environment = {**os.environ, **variables}
    done = subprocess.run(
        [sys.executable, "-W", "always", "-c", program], capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    return done


def test_machines_without_llvm_are_told_so(tmp_path: pathlib.Path):
    program = """
import rtsl
engine = rtsl.Engine(backend="interpreter")
print(rtsl.library.Sphere().intersect((0, 0, -3), (0, 0, 1), engine=engine).hit_distance, rtsl.info()["llvm"])
"""
    done = in_new_process(program, RTSL_LLVM=str(tmp_path / "missing.so"))
    assert done.stdout.split() == ["2.0", "None"]
    assert done.stderr.count("InterpreterWarning") == 1 and "missing.so" in done.stderr
