"""The reader of the text, and the directives carried out."""

import gzip

import numpy as np
import pytest

import transform
from pbrt_file import SceneError, directives
from pbrt_scene import PbrtScene
from scene_files import Settings, find_scenes, with_settings


def write(folder, text, name="scene.pbrt"):
    path = folder / name
    path.write_text(text)
    return path


def test_parameters_have_types_and_values(tmp_path):
    text = (
        '# a comment "with quotes" [\n'
        'Shape "sphere" "float radius" 2 "point3 P" [1 2,3\n -4e1 5 6]  # after\n'
        '"bool a" true "bool b" ["false"] "string names" ["x" "y # z"] "rgb c" [ .5 .25 1. ]'
    )
    (shape,) = directives(write(tmp_path, text))
    given = shape.parameters
    assert shape.texts == ["sphere"] and given["radius"].type == "float"
    assert given.number("radius", 1) == 2 and given.number("height", 7) == 7
    assert given.numbers("P") == [1, 2, 3, -40, 5, 6]
    assert given.flag("a", False) and not given.flag("b", True)
    assert given["names"].values == ["x", "y # z"]
    assert given.numbers("c") == [0.5, 0.25, 1] and given.numbers("missing") is None


def test_files_are_included(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "b.pbrt.gz").write_bytes(gzip.compress(b"Translate 0 1 0"))
    write(tmp_path / "parts", 'Include "parts/b.pbrt.gz"', "a.pbrt")
    path = write(tmp_path, 'Include "parts/a.pbrt" Import "parts/a.pbrt" Scale 1 1 1')
    names = [directive.name for directive in directives(path)]
    assert names == ["Translate", "AttributeBegin", "Translate", "AttributeEnd", "Scale"]


@pytest.mark.parametrize(
    "text, message",
    [
        ("WorldBegin\nTranslate 1 2", "ends within a directive"),
        ("Sphere", "unknown directive"),
        ('Shape "sphere" "radius" 2', "a type and a name"),
        ("WorldBegin WorldEnd", "earlier version"),
        ('Include "missing.pbrt"', "missing.pbrt"),
    ],
)
def test_errors_name_the_file(tmp_path, text, message):
    with pytest.raises(SceneError, match=message) as raised:
        list(directives(write(tmp_path, text)))
    assert str(tmp_path) in str(raised.value)


def test_transforms_are_concatenated(tmp_path):
    text = (
        'Camera "perspective" WorldBegin Translate 1 2 3 AttributeBegin Rotate 90 0 0 1 '
        'Scale 2 2 2 Shape "sphere" AttributeEnd CoordinateSystem "here" Identity '
        'CoordSysTransform "here" Shape "disk" ConcatTransform [0 1 0 0 1 0 0 0 0 0 1 0 5 0 0 1] '
        'Shape "disk"'
    )
    first, second, third = PbrtScene(write(tmp_path, text)).shapes
    np.testing.assert_allclose(transform.point(first.to_world, [1, 0, 0]), [1, 4, 3], atol=1e-12)
    np.testing.assert_allclose(transform.point(second.to_world, [0, 0, 0]), [1, 2, 3])
    np.testing.assert_allclose(transform.point(third.to_world, [1, 0, 0]), [6, 3, 3])
    assert transform.is_mirrored(third.to_world) and not transform.is_mirrored(first.to_world)


def test_cameras_look_along_z():
    to_world = np.linalg.inv(transform.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]))
    np.testing.assert_allclose(transform.point(to_world, [0, 0, 5]), [0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(transform.vector(to_world, [0, 1, 0]), [0, 1, 0], atol=1e-12)


def test_blocks_save_attributes(tmp_path):
    text = (
        'WorldBegin Material "diffuse" AttributeBegin Attribute "shape" "float radius" 3 '
        'NamedMaterial "gold" AreaLightSource "diffuse" ReverseOrientation Shape "sphere" '
        'AttributeEnd Shape "sphere" ObjectBegin "a" Shape "disk" ObjectEnd ObjectInstance "a"'
    )
    scene = PbrtScene(write(tmp_path, text))
    inside, outside = scene.shapes
    assert inside.material == "gold" and inside.area_light and inside.is_reversed
    assert inside.parameters.number("radius", 1) == 3
    assert outside.material.kind == "diffuse" and outside.area_light is None
    assert not outside.is_reversed and outside.parameters.number("radius", 1) == 1
    assert [it.kind for it in scene.objects["a"]] == ["disk"] and scene.instances[0].name == "a"


def test_copies_have_other_settings(tmp_path):
    text = 'Film "rgb" "float iso" 400\nCamera "perspective" # Film\nSampler "sobol"\nWorldBegin\n'
    path = write(tmp_path, text)
    copied = with_settings(path, Settings(64, 48, 8))
    assert "iso" not in copied and "sobol" not in copied and copied.endswith("WorldBegin\n")
    found = {it.name: it for it in directives(write(tmp_path, copied, "copy.pbrt"))}
    assert found["Film"].parameters.number("xresolution", 0) == 64
    assert found["Integrator"].parameters.number("maxdepth", 0) == 7
    assert found["PixelFilter"].texts == ["box"] and "Camera" in found


def test_scenes_are_named_by_folder_and_stem(tmp_path):
    main = 'Camera "perspective"\nWorldBegin\n'
    for folder, names in (("one", ["a", "part"]), ("two", ["b", "c"])):
        (tmp_path / folder).mkdir()
        for name in names:
            text = "# Camera\n" if name == "part" else main
            write(tmp_path / folder, text, f"{name}.pbrt")
    write(tmp_path / "one", main, ".rtsl-compare-1-a.pbrt")
    assert [scene.name for scene in find_scenes(tmp_path)] == ["one", "two-b", "two-c"]
