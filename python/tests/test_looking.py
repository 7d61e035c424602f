"""Recordings of calls and pixels, and costs of lines."""

import numpy as np
import pytest

import rtsl
from rtsl import Scene, library, transforms

STRIPES = """\
class Stripes : rt_Texture;
public float sharpness = 1.0;
float wave(float x) { return sin(x) * sharpness; }
void lookup() {
    float brightness = sqrt(wave(rt_TextureUV.x * 40.0));
    print("u = {}, brightness {}", rt_TextureUV.x, brightness);
    rt_FloatTextureValue = brightness;
    rt_TextureColor = color(brightness);
}
"""

DEAR = """\
class Dear : rt_Texture;
void lookup() {
    float sum = 0.0;
    for (int i = 0; i < 400; i = i + 1) {
        sum = sum + sin(float(i) * rt_TextureUV.x);
    }
    rt_TextureColor = color(0.5 + 0.0001 * sum);
}
"""


@pytest.fixture(scope="module")
def stripes() -> rtsl.Instance:
    return rtsl.compile(STRIPES, name="stripes.rtsl").Stripes()


def ball(material: rtsl.Instance) -> Scene:
    scene = Scene(library.Pinhole(fov=40), transforms.look_at((0, 2, -6), (0, 0, 0)))
    scene.add(library.Sphere(), material=material)
    scene.add(library.SkyLight())
    scene.settings = {"size": (16, 16), "spp": 2}
    return scene


def test_a_call_is_recorded_with_its_result(stripes: rtsl.Instance) -> None:
    recording = stripes.lookup.trace(texture_uv=(0.25, 0.5), detail="lines")
    plain = stripes.lookup(texture_uv=(0.25, 0.5))
    assert recording.not_finite is not None and recording.not_finite.code == "W0631"
    assert recording.not_finite.line == 5
    assert np.isnan(plain.float_texture_value) and np.isnan(recording.result.float_texture_value)
    assert recording.prints == ["stripes.rtsl:6: Stripes.lookup: u = 0.25, brightness NaN"]
    assert any("brightness = NaN" in line for line in recording.lines)
    # As the command prints it.
    assert "not finite" in str(recording) and "stripes.rtsl:5:24" in str(recording)
    assert stripes.lookup.trace(texture_uv=(0.05, 0.5)).not_finite is None
    with pytest.raises(rtsl.Error, match="prints, calls, lines"):
        stripes.lookup.trace(texture_uv=(0, 0), detail="words")


def test_prints_change_nothing(stripes: rtsl.Instance) -> None:
    silent = rtsl.compile(STRIPES.replace("print(", "// print("), name="silent.rtsl").Stripes()
    places = np.linspace(0, 1, 1000, dtype=np.float32)
    uv = np.stack([places, places], axis=-1)
    loud = stripes.lookup(texture_uv=uv).float_texture_value
    assert loud.tobytes() == silent.lookup(texture_uv=uv).float_texture_value.tobytes()


def test_a_pixel_is_that_of_the_picture(stripes: rtsl.Instance) -> None:
    scene = ball(library.Lambertian(kd=stripes.copy(sharpness=0.3)))
    picture = scene.render()
    pixel = scene.inspect(8, 8)
    assert np.asarray(pixel.color, np.float32).tobytes() == picture.pixels[8, 8].tobytes()
    assert [it.index for it in pixel.samples] == [0, 1]
    assert any("Stripes.lookup" in line for line in pixel.prints)
    one = scene.inspect(8, 8, sample=1, detail="prints")
    assert [it.index for it in one.samples] == [1]
    # Bits, since the samples of some stripes are NaN.
    assert np.float32(one.samples[0].radiance).tobytes() == np.float32(pixel.samples[1].radiance).tobytes()
    assert str(pixel).endswith(f"pixel 8,8: {pixel.color}")
    with pytest.raises(rtsl.SceneError, match="no pixel 16,3"):
        scene.inspect(16, 3)


def test_costs_are_of_the_dear_lines() -> None:
    costs = ball(library.Lambertian(kd=rtsl.compile(DEAR, name="dear.rtsl").Dear())).costs()
    dear = costs["dear.rtsl"]
    assert dear is costs.texts[0] and dear.share > 0.5
    assert sum(text.share for text in costs) == pytest.approx(1.0)
    (name, line), *_ = costs.dearest(1)
    assert (name, line.line) == ("dear.rtsl", 5) and "sin" in line.text
    assert line.active is not None and 0.2 < line.active <= 1.0
    assert "dear.rtsl" in str(costs) and "rgba(" in costs._repr_html_()
    # The counts do not depend on threads.
    again = ball(library.Lambertian(kd=rtsl.compile(DEAR, name="dear.rtsl").Dear())).costs(threads=1)
    assert [(it.name, it.share) for it in again] == [(it.name, it.share) for it in costs]
