"""Scenes and renders."""

import copy
import os
import pathlib
import pickle
import signal
import threading

import numpy as np
import pytest

import rtsl
from rtsl import library, transforms

SCENES = pathlib.Path(__file__).parents[2] / "scenes"


def ball_scene():
    scene = rtsl.Scene(library.Pinhole(fov=40), transforms.look_at((0, 2, -6), (0, 0, 0)))
    scene.add(library.Sphere(), material=library.Lambertian(kd=(0.8, 0.3, 0.2)), name="ball")
    scene.add(library.PointLight(position=(3, 5, -4), intensity=60), name="lamp")
    return scene


SMALL = dict(size=(24, 16), spp=4)


def test_scenes_are_made_of_instances():
    scene = ball_scene()
    image = scene.render(**SMALL, aovs=["distance", "object", "normal"])
    assert image.pixels.shape == (16, 24, 3) and image.pixels.dtype == np.float32
    middle = image.pixels[8, 12]
    assert middle[0] > middle[1] > middle[2] > 0 and np.all(image.pixels[0, 0] == 0)
    assert image["object"][8, 12] == 0 and image["object"][0, 0] == -1
    assert 5 < image["distance"][8, 12] < 6.5 and image.aovs["normal"].shape == (16, 24, 3)
    np.testing.assert_array_equal(np.asarray(image), image.pixels)
    assert image.png().startswith(b"\x89PNG") and image._repr_png_() == image.png()
    assert image.statistics["samples"] == 4 and image.statistics["rays"] > 4 * 16 * 24


def test_pictures_do_not_depend_on_threads_widths_and_parts():
    scene = ball_scene()
    expected = scene.render(**SMALL, seed=3).pixels
    for options in ({"threads": 1}, {"width": 4}, {"callback": lambda image: None}):
        assert np.array_equal(scene.render(**SMALL, seed=3, **options).pixels, expected), options
    assert not np.array_equal(scene.render(**SMALL, seed=4).pixels, expected)
    partial = scene.begin(**SMALL, seed=3)
    assert (partial.tiles, partial.samples) == (6, 4)
    for tiles, samples in [((4, 6), (0, 4)), ((0, 4), (0, 1)), ((0, 4), (1, 4))]:
        assert partial.render(samples, tiles)
    assert np.array_equal(partial.image().pixels, expected)


def test_sums_of_parts_are_added_in_order():
    scene = ball_scene()
    expected = scene.render(**SMALL, aovs=["distance"])
    first, later = scene.begin(**SMALL, aovs=["distance"]), None
    first.render((0, 2))
    worker = scene.begin(**SMALL, aovs=["distance"], first_sample=2)
    worker.render((2, 4))
    later = scene.begin(**SMALL, aovs=["distance"], first_sample=2)
    later.restore(worker.sums())
    with pytest.raises(rtsl.SceneError, match="first sample"):
        first.restore(worker.sums())
    first.add(later)
    # Sums of sums are rounded otherwise than sums of samples.
    np.testing.assert_allclose(first.image().pixels, expected.pixels, rtol=1e-6)
    np.testing.assert_allclose(first.image()["distance"], expected["distance"], rtol=1e-6)
    with pytest.raises(rtsl.SceneError, match="not all samples before sample 2"):
        first.add(later)
    tiles = scene.begin(**SMALL, aovs=["distance"])
    tiles.restore(first.sums())
    assert np.array_equal(tiles.image().pixels, first.image().pixels)


def test_changed_parameters_show_and_compile_nothing():
    scene = ball_scene()
    red = scene.render(**SMALL).pixels
    scene["ball"].material.kd = (0.1, 0.2, 0.9)
    blue = scene.render(**SMALL).pixels
    assert blue[8, 12, 2] > 4 * blue[8, 12, 0]
    scene["ball"].material.kd = (0.8, 0.3, 0.2)
    assert np.array_equal(scene.render(**SMALL).pixels, red)
    scene["ball"].transform = transforms.translate(-1.5, 0, 0)
    scene["lamp"].instance.intensity = 30
    moved = scene.render(**SMALL, aovs=["object"])
    assert moved["object"][8, 4] == 0 and moved["object"][8, 15] == -1
    scene.remove(scene["ball"])
    assert not scene.render(**SMALL).pixels.any()


def test_transforms_are_those_of_the_format():
    look = transforms.look_at((0, 2, -6), (0, 0, 0))
    np.testing.assert_allclose(look @ [0, 0, 0, 1], [0, 2, -6, 1])
    np.testing.assert_allclose((look @ [0, 0, np.sqrt(40), 1])[:3], [0, 0, 0], atol=1e-9)
    assert (look @ [1, 0, 0, 0])[0] == pytest.approx(1)
    turned = transforms.translate(1, 0, 0) @ transforms.rotate(90, (0, 0, 1)) @ transforms.scale(2)
    np.testing.assert_allclose(turned @ [1, 0, 0, 1], [1, 2, 0, 1], atol=1e-12)
    for wrong in (np.eye(3), np.zeros((4, 4)), np.full((4, 4), np.nan)):
        with pytest.raises(ValueError, match="a transform"):
            ball_scene().add(library.Sphere(), transform=wrong)


def test_own_classes_and_meshes_are_rendered():
    text = """class Glow : rt_Material; public color tint;
    void emission() { rt_EmissionColor = tint; }"""
    scene = rtsl.Scene(library.Orthographic(scale=2), transforms.look_at((0, 0, -5), (0, 0, 0)))
    glow = rtsl.compile(text).Glow(tint=(1, 2, 3))
    square = np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    scene.add(rtsl.mesh(square, [[0, 1, 2], [0, 2, 3]]), material=glow)
    image = scene.render(**SMALL)
    np.testing.assert_allclose(image.pixels[8, 12], [1, 2, 3])
    with pytest.raises(ValueError, match="4 vertices"):
        rtsl.mesh(square, [[0, 1, 4]])


def test_files_are_loaded_and_changed():
    scene = rtsl.Scene.load(SCENES / "three-spheres.pbrt", defines={"camera.fov": 30})
    assert scene["camera"].fov == 30
    assert {it.kind for it in scene.things} >= {"camera", "light", "texture", "material", "shape"}
    before = scene.render(spp=1, size=(32, 24)).pixels
    scene["tiles"].even = (0.9, 0.1, 0.1)
    np.testing.assert_allclose(scene["tiles"].even, [0.9, 0.1, 0.1])
    after = scene.render(spp=1, size=(32, 24)).pixels
    assert not np.array_equal(before, after)
    with pytest.raises(rtsl.SceneError, match="fov"):
        scene["camera"].fov = float("nan")
    assert scene["camera"].fov == 30
    with pytest.raises(AttributeError, match="did you mean `fov`"):
        scene["camera"].fof = 1
    with pytest.raises(KeyError, match="did you mean `tiles`"):
        scene["tile"]
    scene.add(library.Sphere(radius=0.3), transform=transforms.translate(0, 2.2, -2), name="extra")
    assert not np.array_equal(scene.render(spp=1, size=(32, 24)).pixels, after)


def test_pictures_are_those_of_the_command_line(tmp_path: pathlib.Path):
    scene = rtsl.Scene.load(SCENES / "textures.pbrt")
    image = scene.render(spp=1, size=(32, 16))
    assert image.pixels.mean() > 0.05
    image.save(tmp_path / "a.png")
    image.save(tmp_path / "a.exr")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(rtsl.Error, match="does not end in .png or .exr"):
        image.save(tmp_path / "a.jpg")
    with pytest.raises(rtsl.Error, match="no view `bright`"):
        image.png(view="bright")


def test_wrong_scenes_say_why(tmp_path: pathlib.Path):
    path = tmp_path / "wrong.pbrt"
    path.write_text('Camera "Pinhole"\nWorldBegin\nShape "Spere"\n')
    with pytest.raises(rtsl.SceneError, match="Spere") as caught:
        rtsl.Scene.load(path)
    assert caught.value.diagnostics[0].line == 3
    with pytest.raises(rtsl.SceneError, match="no camera"):
        rtsl.Scene().render()
    scene = ball_scene()
    with pytest.raises(rtsl.SceneError, match="their `material`"):
        scene.add(library.Lambertian())
    with pytest.raises(rtsl.SceneError, match="`Sphere` is no material"):
        scene["ball"].material = library.Sphere()
        scene.render(**SMALL)
    with pytest.raises(TypeError, match="`spp_`"):
        ball_scene().begin(spp_=1)
    with pytest.raises(rtsl.SceneError, match="no output `nothing`"):
        ball_scene().render(**SMALL, aovs=["nothing"])
    with pytest.raises(rtsl.SceneError, match="pixels"):
        ball_scene().render(size=(1 << 20, 1 << 20))


def test_callbacks_see_passes_and_end_renders():
    seen = []

    def look(image):
        seen.append(image.statistics["samples"])
        return len(seen) < 3

    image = ball_scene().render(size=(24, 16), spp=64, callback=look)
    assert seen == [1, 2, 4] and image.statistics["samples"] == 4


def test_renders_end_with_their_time():
    image = ball_scene().render(size=(64, 64), spp=60_000, seconds=0.2)
    assert 0 < image.statistics["samples"] < 60_000


def test_interrupts_end_renders():
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        ball_scene().render(size=(256, 256), spp=60_000)


def test_other_threads_run_while_a_scene_renders():
    scene, counted = ball_scene(), [0]
    end = threading.Event()

    def count():
        while not end.is_set():
            counted[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    scene.render(size=(64, 64), spp=48, threads=1)
    end.set()
    thread.join()
    assert counted[0] > 1000


def test_progress_is_told(capsys, monkeypatch):
    monkeypatch.setattr("rtsl._progress._EVERY", 0.0)
    ball_scene().render(size=(64, 64), spp=40, progress=True)
    assert "%" in capsys.readouterr().err
    ball_scene().render(**SMALL)
    assert capsys.readouterr().err == ""


def test_sizes_and_names_of_aovs_are_as_people_give_them():
    scene = ball_scene()
    expected = scene.render(spp=1, size=(20, 10)).pixels
    for size in ([20, 10], np.array([20, 10]), (np.int64(20), np.uint8(10))):
        assert np.array_equal(scene.render(spp=1, size=size).pixels, expected)
    for size, said in [
        ("20x10", r"such as \(1024, 768\), not '20x10'"),
        (100, r"such as \(100, 100\), not 100"),
        ((20, 10, 3), "two whole numbers"),
        ((20.5, 10), "two whole numbers"),
        (np.float32([20, 10]), "two whole numbers"),
    ]:
        with pytest.raises(TypeError, match=said):
            scene.render(spp=1, size=size)
    for size in ((0, 10), (20, -1)):
        with pytest.raises(ValueError, match="at least one column and one row"):
            scene.render(spp=1, size=size)
    assert list(scene.render(spp=1, size=(8, 6), aovs="normal").aovs) == ["normal"]


def test_unknown_keywords_name_the_ones_that_were_meant():
    scene = ball_scene()
    for call, meant in [
        (lambda: scene.render(ssp=1), r"render\(\) has no keyword `ssp`; did you mean `spp`"),
        (lambda: scene.begin(sizes=(8, 6)), "the settings of a picture have no keyword `sizes`; did you mean `size`"),
        (lambda: scene.inspect(0, 0, aov=["normal"]), "did you mean `aovs`"),
        (lambda: scene.costs(maxdepth=1), "did you mean `max_depth`"),
        (lambda: scene.add(library.Sphere(), materials=None), "did you mean `material`"),
        (lambda: rtsl.Scene.load("a.pbrt", define={}), "did you mean `defines`"),
        (lambda: scene.render(**SMALL).save("a.png", exposures=1), "did you mean `exposure`"),
        (lambda: rtsl.cluster.render("a.pbrt", max_dept=1), "did you mean `max_depth`"),
        (lambda: rtsl.Engine(widths=4), r"Engine\(\) has no keyword `widths`; did you mean `width`"),
        (lambda: rtsl.Host(light=[]), r"Host\(\) has no keyword `light`; did you mean `lights`"),
        (lambda: rtsl.LightSample((0, 1, 0), colour=3), r"LightSample\(\) has no keyword `colour`; did you mean `color`"),
    ]:
        with pytest.raises(TypeError, match=meant):
            call()
    scene.settings = {"sed": 1}
    with pytest.raises(TypeError, match="did you mean `seed`"):
        scene.render(**SMALL)


def test_the_depth_of_integrators_that_are_classes_is_their_parameter(tmp_path: pathlib.Path):
    (tmp_path / "paths.pbrt").write_text('Integrator "Path"\nCamera "perspective"\nWorldBegin\nShape "sphere"\n')
    loaded, composed = rtsl.Scene.load(tmp_path / "paths.pbrt"), ball_scene()
    composed.add(library.Path(maxDepth=2))
    for scene in (loaded, composed):
        for call in (scene.render, scene.begin, scene.costs):
            with pytest.raises(rtsl.SceneError, match="on the integrator `Path`: set the integrator's parameter `maxDepth`"):
                call(max_depth=1, **SMALL)
        scene.settings = {"max_depth": 1}
        with pytest.raises(rtsl.SceneError, match="`max_depth` has no effect"):
            scene.inspect(0, 0, **SMALL)
    # The renderer takes the place of the scene's integrator.
    loaded.render(renderer="batch", **SMALL)
    composed.integrator = rtsl.compile("class Flat : rt_Integrator; void radiance() { rt_SampleColor = color(1.0); }").Flat()
    with pytest.raises(rtsl.SceneError, match="`Flat`: it has no parameter of this meaning"):
        composed.render(**SMALL)


def test_copies_and_pickles_of_scenes_work_or_say_why_not():
    scene = ball_scene()
    image = scene.render(**SMALL)
    deep = copy.deepcopy(image)
    deep.pixels[0, 0] = 7
    assert copy.copy(image).pixels is image.pixels and not np.any(image.pixels == 7)
    placed = copy.copy(scene["ball"])
    assert placed.instance is scene["ball"].instance and copy.deepcopy(placed).instance is not placed.instance
    thing = rtsl.Scene.load(SCENES / "three-spheres.pbrt").things[0]
    for subject in (scene, thing, scene.begin(**SMALL)):
        for function in (copy.copy, copy.deepcopy):
            with pytest.raises(TypeError, match=f"type {type(subject).__name__} cannot be copied: "):
                function(subject)
    for subject in (scene, thing, image, scene.begin(**SMALL)):
        with pytest.raises(TypeError, match=f"type {type(subject).__name__} cannot be pickled: "):
            pickle.dumps(subject)


def test_warnings_are_those_of_the_line_that_calls(tmp_path: pathlib.Path):
    (tmp_path / "a.pbrt").write_text('WorldBegin\nShape "sphere"\n')
    with pytest.warns(rtsl.SceneWarning, match="no camera") as caught:
        rtsl.Scene.load(tmp_path / "a.pbrt")
    assert caught[0].filename == __file__
