"""Instances and their parameters."""

import copy
import pickle

import numpy as np
import pytest

import rtsl
from rtsl import library


def test_parameters_are_attributes():
    torus = library.Torus(majorRadius=2, minorRadius=0.25)
    assert (torus.majorRadius, torus["minorRadius"]) == (2.0, 0.25)
    torus.minorRadius = np.float64(0.5)
    assert torus.parameters["minorRadius"] == 0.5
    assert repr(torus) == "Torus(majorRadius=2, minorRadius=0.5)"
    assert torus.set(majorRadius=3, minorRadius=1).majorRadius == 3


def test_wrong_values_change_nothing():
    sphere = library.Sphere(radius=2)
    with pytest.raises(rtsl.ParameterError, match="NaN is not at least 0") as caught:
        sphere.radius = float("nan")
    assert caught.value.diagnostics[0].code == "E0504"
    assert isinstance(caught.value, ValueError)
    assert sphere.radius == 2
    with pytest.raises(AttributeError, match="did you mean `radius`"):
        sphere.radios = 1
    with pytest.raises(rtsl.ParameterError, match="no parameter `radios`"):
        library.Sphere(radios=1)
    with pytest.raises(rtsl.ParameterError, match="is a float, found the text"):
        library.Sphere(radius="wide")
    with pytest.raises(rtsl.ParameterError, match="`radius`"):
        library.Sphere(radius=object())


def test_values_outside_of_ranges_are_taken_with_a_warning():
    sphere = library.Sphere()
    with pytest.warns(rtsl.ParameterWarning, match="`radius` of `Sphere` is outside of its range: -1 is not at least 0"):
        sphere.radius = -1
    assert sphere.radius == -1


def test_vectors_colors_and_choices():
    text = """class A : rt_Texture;
    enum Way { Left = -1, Right = 1 };
    public vec2 v; public mat2 m; public uint bits; public bool on; public Way way; public float row[3]; public color c;
    void lookup() { rt_FloatTextureValue = v.x + m[1][0] + row[2] + float(bits) + float(way) + (on ? 0.5 : 0.0); }"""
    a_class = rtsl.compile(text).A
    a = a_class(v=(1, 2), m=np.array([[1, 2], [3, 4.0]]), bits=4_000_000_000, on=True, way="Left", row=[0] * 3, c=0)
    np.testing.assert_array_equal(a.v, [1, 2])
    np.testing.assert_array_equal(a.m, [[1, 2], [3, 4]])
    assert (a.bits, a.on, a.way) == (4_000_000_000, True, "Left")
    a.set(bits=2, row=[0, 0, 0.25], c=0.5, way="Right")
    np.testing.assert_array_equal(a.c, [0.5] * 3)
    assert a.lookup((0, 0)).float_texture_value == 1 + 3 + 0.25 + 2 + 1 + 0.5
    with pytest.raises(rtsl.ParameterError, match="did you mean `Right`"):
        a.way = "Rigth"


def test_references_follow_what_they_refer_to():
    checker = library.Checker(scale=1, even=0.25, odd=0.75)
    ward = library.Ward(kd=checker)
    assert ward.kd is checker
    uv = np.array([[0.5, 0.5], [1.5, 0.5]], np.float32)
    state = dict(light_direction=(0, 1, 0), ray_direction=(0, -1, 0), shading_normal=(0, 1, 0), texture_uv=uv)
    before = ward.bsdf(**state).bsdf_value
    checker.even = 0.5
    after = ward.bsdf(**state).bsdf_value
    assert not np.array_equal(before, after)
    ward.kd = (0.1, 0.2, 0.3)
    np.testing.assert_allclose(ward.kd, [0.1, 0.2, 0.3], rtol=1e-6)
    with pytest.raises(rtsl.ParameterError, match="Sphere"):
        ward.kd = library.Sphere()


def test_buffers_come_from_arrays():
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    mesh = library.TriangleMesh(positions=positions, indices=np.array([[0, 1, 2]]), normals=[], uvs=[])
    np.testing.assert_array_equal(np.asarray(mesh.positions).reshape(-1, 3), positions)
    with pytest.raises(ValueError, match="32 bits"):
        mesh.indices = np.array([2**40])


def test_copies_are_their_own():
    one = library.Sphere(radius=2)
    other = one.copy(radius=5)
    assert (one.radius, other.radius) == (2, 5)


def test_python_copies_instances():
    checker = library.Checker(even=0.25)
    ward = library.Ward(kd=checker)
    shallow, deep = copy.copy(ward), copy.deepcopy(ward)
    assert shallow.kd is checker and deep.kd is not checker
    checker.even = 0.5
    np.testing.assert_allclose(deep.kd.even, [0.25] * 3)
    assert copy.deepcopy(library.Sphere) is library.Sphere is copy.copy(library.Sphere)
    hits = library.Sphere().intersect((0, 0, -5), (0, 0, 1))
    assert copy.copy(hits).hit_distance == copy.deepcopy(hits).hit_distance == 4


def test_pickles_say_what_to_do_instead():
    sphere = library.Sphere()
    unit = rtsl.compile("class A : rt_Texture; void lookup() { rt_FloatTextureValue = 1.0; }")
    hits = sphere.intersect((0, 0, -5), (0, 0, 1))
    for subject, advice in [
        (sphere, "compile the text again"),
        (library.Sphere, "compile the text again"),
        (unit, "compile the text again"),
        (hits, "dict"),
    ]:
        with pytest.raises(TypeError, match=f"type {type(subject).__name__} cannot be pickled: .*{advice}"):
            pickle.dumps(subject)
    with pytest.raises(TypeError, match="no keyword `nmae`; did you mean `name`"):
        rtsl.compile("", nmae="a.rtsl")
