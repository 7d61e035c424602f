"""Materials and textures as plugins of Mitsuba."""

import os

import numpy as np
import pytest

import rtsl
from rtsl import library, transforms

# Dr.Jit takes the LLVM that RTSL has, if nothing names another. It looks when it is imported, and finds any version.
if rtsl.info()["path"]:
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", rtsl.info()["path"])

mi = pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
dr = pytest.importorskip("drjit")

SIZE = 32


@pytest.fixture(params=["llvm_ad_rgb", "scalar_rgb"])
def variant(request):
    try:
        mi.set_variant(request.param)
    except ImportError as error:
        pytest.skip(str(error))
    rtsl.mitsuba.register()
    return request.param


def picture_of_mitsuba(material, size, spp):
    camera = mi.ScalarTransform4f().look_at(origin=[0, 0, -5], target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb", "rfilter": {"type": "box"}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 6, "rr_depth": 100},
            "sensor": {"type": "perspective", "fov": 40, "to_world": camera, "film": film},
            "ball": {"type": "sphere", "bsdf": rtsl.mitsuba.bsdf(material)},
            "sky": {"type": "constant", "radiance": 0.4},
            "lamp": {"type": "point", "position": [3, 4, -5], "intensity": {"type": "rgb", "value": [40, 40, 40]}},
        }
    )
    # Its spaces are right-handed, so that pictures of the same world are mirrored.
    return np.array(mi.render(scene, spp=spp))[:, ::-1]


def picture_of_rtsl(material, size, spp):
    scene = rtsl.Scene(library.Pinhole(fov=40), transforms.look_at((0, 0, -5), (0, 0, 0)))
    scene.add(library.Sphere(), material=material)
    scene.add(library.PointLight(position=(3, 4, -5), intensity=40))
    scene.add(library.ConstantSky(radiance=0.4))
    return scene.render(spp, (size, size), max_depth=5, renderer="batch").pixels


def blocks(picture):
    size = len(picture) // 4
    return picture.reshape(4, size, 4, size, 3).mean((1, 3))


MATERIALS = {
    "ward": library.Ward(kd=(0.3, 0.2, 0.1), ks=0.4, alphaU=0.3, alphaV=0.15),
    "mirror": library.Mirror(kr=(0.9, 0.5, 0.2)),
    # It has the radiance of the sky behind it and around it.
    "glass": library.Dielectric(),
}


@pytest.mark.parametrize("name", MATERIALS)
def test_pictures_are_those_of_the_renderer(variant, name):
    is_scalar = variant.startswith("scalar")
    if is_scalar and name != "ward":
        pytest.skip("calls for single rays are slow, and one material shows that they work")
    size, spp, noise = (8, 16, 0.08) if is_scalar else (SIZE, 128, 0.015)
    material = MATERIALS[name]
    theirs, ours = picture_of_mitsuba(material, size, spp), picture_of_rtsl(material, SIZE, 256)
    np.testing.assert_allclose(blocks(theirs), blocks(ours), atol=noise)
    # What is compared is no grey.
    assert name == "glass" or np.ptp(blocks(ours)) > 3 * noise


def test_textures_are_those_of_calls(variant):
    checker = library.Checker(scale=4, even=(0.9, 0.5, 0.1), odd=0.2)
    texture = rtsl.mitsuba.texture(checker)
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.uv = [0.1, 0.3]
    value = np.ravel(texture.eval(si))
    np.testing.assert_allclose(value[:3], checker.lookup((0.1, 0.3)).texture_color, rtol=1e-6)


def test_scene_files_name_classes(variant):
    bsdf = mi.load_string(
        '<bsdf version="3.0.0" type="rtsl"><string name="class" value="Ward"/><float name="alphaU" value="0.4"/>'
        '<rgb name="kd" value="0.1 0.2 0.3"/></bsdf>'
    )
    assert "Ward(alphaU=0.4" in str(bsdf) and "0.1" in str(bsdf)
    with pytest.raises(TypeError, match="no material"):
        rtsl.mitsuba.bsdf(library.Sphere())


def test_other_colors_are_refused():
    mi.set_variant("scalar_spectral")
    with pytest.raises(RuntimeError, match="RGB"):
        rtsl.mitsuba.register()
