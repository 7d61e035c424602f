"""Processes that are forked, and processes that are told to end."""

import multiprocessing
import os
import pathlib
import select
import signal
import threading
import time

import numpy as np
import pytest

import rtsl
from rtsl import library, transforms

SMALL = dict(size=(16, 16), spp=2)
#: The seconds after which a child is one that waits for ever.
LONGEST = 60

needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")


def scene_file(folder: pathlib.Path) -> str:
    """Writes a scene whose images and hierarchies take all processors."""
    xs, ys = np.meshgrid(np.linspace(0, 1, 16), np.linspace(0, 1, 16))
    picture = rtsl.Scene(library.Pinhole(fov=40))
    picture.add(library.PointLight(position=(0, 0, -1), intensity=1))
    picture.add(library.Sphere(), transform=transforms.translate(0, 0, 4))
    picture.render(size=(8, 8), spp=1).save(folder / "texture.exr")
    points = " ".join(f"{x} {y} {x * y}" for x, y in zip(xs.ravel(), ys.ravel()))
    corners = [(16 * row + column) for row in range(15) for column in range(15)]
    triangles = " ".join(f"{it} {it + 1} {it + 16} {it + 1} {it + 17} {it + 16}" for it in corners)
    text = f"""
        LookAt 0.5 0.5 -2  0.5 0.5 0  0 1 0
        Camera "perspective" "float fov" 40
        WorldBegin
        LightSource "point" "point3 from" [0 2 -3] "rgb I" [9 9 9]
        Texture "map" "spectrum" "imagemap" "string filename" "texture.exr"
        Material "diffuse" "texture reflectance" "map"
        Shape "trianglemesh" "point3 P" [{points}] "integer indices" [{triangles}]
    """
    (folder / "scene.pbrt").write_text(text)
    return str(folder / "scene.pbrt")


def pixels_of(path: str) -> np.ndarray:
    return rtsl.Scene.load(path).render(**SMALL).pixels


def in_child(work, seconds: float = LONGEST) -> str:
    """Returns what work in a forked child returns, or the first line of its error; fails if the child does not end."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            answer = str(work())
        except BaseException as error:
            answer = str(error).splitlines()[0]
        os.write(writing, answer.encode())
        os._exit(0)
    os.close(writing)
    try:
        ready = select.select([reading], [], [], seconds)[0]
        if not ready:
            os.kill(child, signal.SIGKILL)
        assert ready, "the child waits for ever"
        return os.read(reading, 4096).decode()
    finally:
        os.close(reading)
        os.waitpid(child, 0)


@pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
def test_processes_render_with_each_start_method(method, tmp_path):
    path = scene_file(tmp_path)
    expected = pixels_of(path)
    with multiprocessing.get_context(method).Pool(1) as pool:
        made = pool.map_async(pixels_of, [path]).get(LONGEST)
    assert all(np.array_equal(it, expected) for it in made)


@needs_fork
def test_a_child_goes_on_with_what_its_parent_made(tmp_path):
    scene = rtsl.Scene.load(scene_file(tmp_path))
    expected = scene.render(**SMALL)
    begun = scene.begin(**SMALL)
    begun.render((0, 1))
    ball = library.Sphere(radius=2.0)
    rays = dict(rt_RayOrigin=np.array([[0.0, 0.0, -5.0]]), rt_RayDirection=np.array([[0.0, 0.0, 1.0]]))
    hit = ball.intersect(**rays)

    def work():
        begun.render((1, 2))
        again = scene.render(**SMALL)
        changed = scene.render(size=(8, 8), spp=1, width=4)
        same = np.array_equal(again.pixels, expected.pixels) and np.array_equal(begun.image().pixels, expected.pixels)
        own = ball.intersect(**rays)
        return same and changed.pixels.shape == (8, 8, 3) and str(own) == str(hit) and in_child(begun.image) != ""

    assert in_child(work) == "True"


@needs_fork
def test_a_child_is_refused_if_its_parent_was_at_work():
    scene = rtsl.Scene(library.Pinhole(fov=40), transforms.look_at((0, 2, -6), (0, 0, 0)))
    scene.add(library.Sphere())
    scene.render(**SMALL)
    begun = scene.begin(size=(64, 64), spp=60_000)
    thread = threading.Thread(target=begun.render, kwargs=dict(seconds=1.5))
    thread.start()
    time.sleep(0.3)
    for work in (lambda: scene.render(**SMALL), lambda: begun.seconds, begun.image, lambda: rtsl.compile("class A;")):
        assert "E0705" in in_child(work)
    thread.join()
    # Kernels may still be optimised in the background.
    end = time.monotonic() + LONGEST
    while "E0705" in (answer := in_child(lambda: scene.render(**SMALL))) and time.monotonic() < end:
        time.sleep(0.1)
    assert answer == "<Image of 16 by 16 pixels>"


@needs_fork
def test_children_of_a_long_render_end_while_its_kernels_are_optimised(tmp_path):
    scene, answers = rtsl.Scene.load(scene_file(tmp_path)), []

    def look(image):
        answers.append(in_child(lambda: scene.render(**SMALL)))
        return len(answers) < 3

    scene.render(size=(32, 32), spp=60_000, callback=look)
    assert all(it == "<Image of 16 by 16 pixels>" or "E0705" in it for it in answers), answers


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="the system has no such signals")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_signals_interrupt_the_program_of_clusters_once(name):
    from rtsl.cluster import __main__ as program

    number = getattr(signal, name)
    before = {it: signal.getsignal(it) for it in (signal.SIGTERM, signal.SIGHUP)}
    try:
        signal.signal(number, signal.SIG_DFL)
        program._hear_signals()
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), number)
            time.sleep(1)
        # `timeout` sends it twice.
        os.kill(os.getpid(), number)
        signal.signal(number, signal.SIG_IGN)
        program._hear_signals()
        assert signal.getsignal(number) is signal.SIG_IGN
    finally:
        for it, handler in before.items():
            signal.signal(it, handler)
