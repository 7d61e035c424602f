"""The conversion for Mitsuba."""

import json

import numpy as np
import pytest

mitsuba = pytest.importorskip("mitsuba")
drjit = pytest.importorskip("drjit")
mitsuba.set_variant("scalar_rgb")
# With one thread, Mitsuba waits forever for another that writes.
drjit.set_thread_count(2)

import meshes  # noqa: E402
import perf  # noqa: E402
import pictures  # noqa: E402
import spectra  # noqa: E402
import subdivision  # noqa: E402
from mitsuba_scene import convert  # noqa: E402
from scene_files import Settings  # noqa: E402

CAMERA = 'Translate 0 0 5 Camera "perspective" "float fov" 40\nWorldBegin\n'


def converted(folder, world, camera=CAMERA):
    """The dictionary of a scene, and its remarks."""
    path = folder / "scene.pbrt"
    path.write_text(camera + world)
    out = folder / "scene.json"
    remarks = convert(path, Settings(48, 32, 8), folder, out)
    return json.loads(out.read_text()), remarks


def bsdf_of(scene, shape="shape-0"):
    return scene[scene[shape]["bsdf"]["id"]]


def test_settings_are_those_of_the_comparison(tmp_path):
    scene, remarks = converted(tmp_path, 'LightSource "infinite" "rgb L" [1 2 3] Shape "sphere"')
    assert scene["integrator"]["max_depth"] == 8 and remarks == []
    sensor = scene["sensor"]
    assert sensor["fov"] == 40 and sensor["film"]["width"] == 48
    # It looks along z, with x to the left.
    np.testing.assert_allclose(np.array(sensor["to_world"])[:3], [[-1, 0, 0, 0], [0, 1, 0, 0],
                                                                  [0, 0, 1, -5]])  # fmt: skip
    assert scene["light-0"] == {"type": "constant", "radiance": {"type": "rgb", "value": [1, 2, 3]}}


def test_equal_materials_are_one(tmp_path):
    world = (
        'MakeNamedMaterial "gold" "string type" "conductor" "spectrum eta" "metal-Au-eta" '
        '"spectrum k" "metal-Au-k" "float roughness" 0.04 '
        'NamedMaterial "gold" Shape "sphere" Shape "sphere" Material "interface" Shape "sphere"'
    )
    scene, _ = converted(tmp_path, world)
    names = [name for name in scene if name.startswith(("shape", "material"))]
    assert names == ["material-0", "shape-0", "shape-1"]
    metal = bsdf_of(scene)["bsdf"]
    assert metal["type"] == "roughconductor" and metal["alpha_u"] == pytest.approx(0.2)
    assert metal["eta"]["value"] == spectra.named_spectra()["metal-Au-eta"]


@pytest.mark.parametrize(
    "material, kind",
    [
        ('"dielectric" "float eta" 1.3', "dielectric"),
        ('"dielectric" "float roughness" 0.1', "roughdielectric"),
        ('"thindielectric"', "thindielectric"),
        ('"diffusetransmission"', "blendbsdf"),
    ],
)
def test_materials_of_two_sides_are_not_wrapped(tmp_path, material, kind):
    scene, _ = converted(tmp_path, f'Material {material} Shape "sphere"')
    assert bsdf_of(scene)["type"] == kind


def test_approximations_are_told(tmp_path):
    world = 'Material "coateddiffuse" Shape "sphere" Material "hair" Shape "curve" Shape "disk"'
    scene, remarks = converted(tmp_path, world)
    assert bsdf_of(scene)["bsdf"]["type"] == "plastic"
    assert remarks == [
        "coateddiffuse: plastic",
        "material hair: matte grey",
        "shape curve left out",
    ]


def test_images_stand_upright(tmp_path):
    pictures.write_exr(np.array([[[1, 0, 0]], [[0, 1, 0]]]), tmp_path / "image.exr")
    world = (
        'Texture "t" "spectrum" "imagemap" "string filename" "image.exr" "float vscale" 0.5 '
        'Material "diffuse" "texture reflectance" "t" Shape "sphere" "float alpha" 0.5'
    )
    scene, _ = converted(tmp_path, world)
    mask = bsdf_of(scene)
    texture = mask["bsdf"]["bsdf"]["reflectance"]
    assert mask["type"] == "mask" and mask["opacity"] == 0.5
    # The second coordinate 0 is at the bottom.
    np.testing.assert_allclose(texture["to_uv"], [[1, 0, 0], [0, -0.5, 1], [0, 0, 1]])


def test_mirrors_turn_meshes_without_normals(tmp_path):
    mesh = 'Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0]'
    normals = mesh + ' "normal N" [0 0 1 0 0 1 0 0 1]'
    world = f"{mesh} Scale -1 1 1 {mesh} {normals} ReverseOrientation {mesh} {normals}"
    scene, _ = converted(tmp_path, world)
    flips = [scene[f"shape-{number}"]["flip_normals"] for number in range(5)]
    assert flips == [False, True, False, False, True]


def test_power_is_spread_over_the_area(tmp_path):
    light = 'AreaLightSource "diffuse" "float power" 8 '
    patch = 'Shape "bilinearmesh" "point3 P" [0 0 0 2 0 0 0 1 0 2 1 0] '
    scene, _ = converted(tmp_path, f'{light} {patch} Shape "sphere" "float radius" 2')
    radiance = [scene[f"shape-{number}"]["emitter"]["radiance"]["value"][0] for number in (0, 1)]
    np.testing.assert_allclose(radiance, [8 / (np.pi * 2), 8 / (np.pi * 16 * np.pi)])


def test_objects_become_groups(tmp_path):
    world = (
        'ObjectBegin "bolt.1" Shape "sphere" Shape "disk" ObjectEnd '
        'ObjectInstance "bolt.1" Translate 3 0 0 ObjectInstance "bolt.1" '
        'ObjectBegin "lamp" AreaLightSource "diffuse" Shape "sphere" ObjectEnd '
        'ObjectInstance "lamp"'
    )
    scene, remarks = converted(tmp_path, world)
    kinds = [scene[f"shape-{number}"]["type"] for number in range(3)]
    assert kinds == ["instance", "instance", "sphere"] and "instances that emit: copies" in remarks
    assert len(scene["group-0"]) == 3


def test_skies_keep_their_directions():
    directions = pictures.sphere_directions(8)
    x, y, z = np.moveaxis(directions, -1, 0)
    # A map with light from above (z) in one half.
    size = 64
    place = (np.stack(np.meshgrid(*2 * [np.arange(size)])) + 0.5) / size * 2 - 1
    image = np.repeat((np.abs(place).sum(axis=0) < 1)[..., None], 3, axis=2).astype(float)
    sky = pictures.resample_sky(image)
    assert sky.shape == (64, 128, 3)
    np.testing.assert_allclose(sky[:31], 1, atol=0.01)
    np.testing.assert_allclose(sky[33:], 0, atol=0.01)
    places = pictures.octahedral_places(np.stack([x, -z, y], axis=-1))
    assert places.min() >= 0 and places.max() <= 1


def test_maps_of_latitudes_go_around_z():
    columns = 16
    x, _, z = np.moveaxis(pictures.sphere_directions(columns // 2), -1, 0)
    # Mitsuba's -z is the y of the light's space.
    around = np.arctan2(-z, x) / (2 * np.pi) % 1
    image = np.broadcast_to((np.arange(columns) + 0.5) / columns, around.shape)
    np.testing.assert_allclose(pictures.turn_sky(image), around, atol=1e-12)


def test_colours_of_spectra():
    red, green, blue = spectra.blackbody(6500)
    assert all(abs(component - 1) < 0.08 for component in (red, green, blue))
    assert spectra.blackbody(2700)[0] > 1.5
    np.testing.assert_allclose(spectra.surface_color(spectra.table([300, 0.25, 900, 0.25])), 0.25)
    assert spectra.named_spectra()["glass-BK7"] == [1.5168]


def test_subdivision_of_an_octahedron_is_round():
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    mesh = subdivision.subdivided(meshes.Mesh(points, np.array(faces)), 3)
    assert len(mesh.triangles) == 8 * 4**3 and len(mesh.points) == 258
    radii = np.linalg.norm(mesh.points, axis=1)
    # Each neighbour of a corner has the weight 1/8 in the limit, and all together have the mean 0.
    np.testing.assert_allclose(radii[:6], 0.5)
    assert 0.4 < radii.min() and radii.max() < 0.51
    outward = (mesh.normals * mesh.points).sum(axis=1) / radii
    assert outward.min() > 0.95


def test_samples_are_sorted():
    sort = perf.class_of
    assert sort("[unknown]", "/tmp/perf-12.map", "rtsl") == "compiled"
    assert sort("llvm::Value", "/usr/lib/libLLVM.so.19.1", "rtsl") == "compiler"
    assert sort("__memmove_avx", "/usr/lib/libc.so.6", "rtsl") == "libc"
    assert sort("clear_page", "[kernel.kallsyms]", "rtsl") == "system"
    assert sort("<rtsl_render::A as rtsl_bvh::B>::c", "/bin/rtsl", "rtsl") == "traversal"
    assert sort("_RNvNtCs1_8rtsl_bvh6bounds3new", "/bin/rtsl", "rtsl") == "traversal"
    assert sort("rtsl_render::integrate::staged::search::f", "/bin/rtsl", "rtsl") == "traversal"
    assert sort("rtsl_render::film::add", "/bin/rtsl", "rtsl") == "glue"
    assert sort("rtsl_opt::dce::run", "/bin/rtsl", "rtsl") == "compiler"
    assert sort("core::slice::sort", "/bin/rtsl", "rtsl") == "glue"
