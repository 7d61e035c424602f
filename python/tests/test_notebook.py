"""Sliders in notebooks."""

import pytest

import rtsl
from rtsl import library, transforms
from rtsl.notebook import controls_of, sliders

pytest.importorskip("ipywidgets")


def panel_of(widgets, title):
    accordion = widgets.children[0]
    return accordion.children[list(accordion.titles).index(title)].children


def test_sliders_change_parameters_and_the_picture():
    scene = rtsl.Scene(library.Pinhole(), transforms.look_at((0, 0, -4), (0, 0, 0)))
    ball = scene.add(library.Sphere(), material=library.Ward(), name="ball")
    scene.add(library.PointLight(position=(2, 3, -3), intensity=20))
    widgets = sliders(scene, size=(24, 16), spp=1)
    picture, status = widgets.children[1:]
    before = bytes(picture.value)
    assert before[:4] == b"\x89PNG"
    radius = next(it for it in panel_of(widgets, "ball: Sphere") if getattr(it, "description", "") == "radius")
    radius.value = 0.5
    assert ball.instance.radius == 0.5 and bytes(picture.value) != before and status.value.endswith(" s")
    color = next(it for it in panel_of(widgets, "ball: Ward") if getattr(it, "description", "") == "Diffuse reflectance")
    color.value = "#ff0000"
    assert list(ball.material.kd) == [1, 0, 0]


def test_controls_have_the_annotations():
    controls = {it["name"]: it for it in controls_of(library.Ward(alphaU=0.2))}
    assert controls["alphaU"]["max"] == 1 and controls["alphaU"]["values"] == [0.2]
    assert controls["alphaU"]["doc"] == "Roughness along u." and controls["kd"]["kind"] == "color"
    # What is a texture is no number.
    assert "kd" not in {it["name"] for it in controls_of(library.Ward(kd=library.Checker()))}


def test_values_that_are_not_valid_are_said():
    changed = []
    torus = library.Torus()
    widgets = sliders(torus, on_change=lambda: changed.append(torus.minorRadius))
    panel, status = widgets.children
    minor = next(it for it in panel.children if getattr(it, "description", "") == "minorRadius")
    minor.value = 0.75
    assert changed == [0.75]
    minor.min = -1
    minor.value = -1
    assert torus.minorRadius == 0.75 and "-1 is not at least 0" in status.value
