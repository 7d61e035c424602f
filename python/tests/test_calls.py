"""Methods on arrays."""

import array

import numpy as np
import pytest

import rtsl
from rtsl import library

RNG = np.random.default_rng(1)


def rays(count):
    origins = RNG.normal(size=(count, 3)).astype(np.float32) + np.float32([0, 0, -6])
    directions = RNG.normal(size=(count, 3)).astype(np.float32) * 0.2 + np.float32([0, 0, 1])
    return origins, directions


def sphere_by_numpy(origins, directions, radius):
    a = np.sum(directions * directions, -1)
    b = np.sum(origins * directions, -1)
    root = np.sqrt(np.maximum(b * b - a * (np.sum(origins * origins, -1) - radius**2), 0))
    hit = b * b - a * (np.sum(origins * origins, -1) - radius**2) >= 0
    return hit, (-b - root) / a


def test_intersections_are_those_of_geometry():
    origins, directions = rays(3000)
    hits = library.Sphere(radius=1.5).intersect(origins, directions)
    hit, distance = sphere_by_numpy(origins.astype(np.float64), directions.astype(np.float64), 1.5)
    assert np.mean(hits.hit == hit) > 0.999 and 0.1 < hit.mean() < 0.9
    both = hits.hit & hit
    np.testing.assert_allclose(hits.hit_distance[both], distance[both], rtol=1e-3)
    assert np.all(np.isinf(hits.hit_distance[~hits.hit]))
    radii = np.linalg.norm(hits.hit_point[hits.hit], axis=1)
    np.testing.assert_allclose(radii, 1.5, rtol=1e-4)


@pytest.mark.parametrize("count", [0, 1, 15, 16, 1023, 1024, 1025, 5000])
def test_results_do_not_depend_on_threads_widths_and_backends(count):
    origins, directions = rays(count)
    torus = library.Torus()
    expected = torus.intersect(origins, directions, threads=1)
    engines = [rtsl.Engine(width=4), *([rtsl.Engine(backend="interpreter")] if count < 100 else [])]
    others = [torus.intersect(origins, directions, threads=3)]
    others += [torus.intersect(origins, directions, engine=engine) for engine in engines]
    for other in others:
        assert other.hit_distance.tobytes() == expected.hit_distance.tobytes()
        assert np.array_equal(other.hit, expected.hit)
        assert other.shape == (count,)


def test_views_and_formats_are_read_in_place():
    origins, directions = rays(2000)
    box = library.Box()
    expected = box.intersect(origins, directions).hit_distance
    wide = np.zeros((2000, 7), np.float32)
    wide[:, 2:5] = origins
    packed = np.zeros(4000, dtype=[("tag", "u1"), ("v", "f4", 3)])
    packed["v"][::2] = origins
    for view in (
        wide[:, 2:5],
        np.asfortranarray(origins),
        packed["v"][::2],
        origins[::-1].copy()[::-1],
        origins.astype(np.float64),
        memoryview(origins),
    ):
        np.testing.assert_array_equal(box.intersect(view, directions).hit_distance, expected)
    single = box.intersect(array.array("f", [0, 0, -5]), [0, 0, 1])
    assert single.hit_distance == pytest.approx(4)
    frozen = origins.copy()
    frozen.flags.writeable = False
    np.testing.assert_array_equal(box.intersect(frozen, directions).hit_distance, expected)


class Capsule:
    """An array of another library, as DLPack shows it."""

    def __init__(self, values):
        self.values = values

    def __dlpack__(self, **options):
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.values.__dlpack_device__()


def test_tensors_of_other_libraries_are_read_in_place():
    origins, directions = rays(100)
    plane = library.Plane()
    expected = plane.intersect(origins, directions).hit_distance
    got = plane.intersect(Capsule(origins), Capsule(directions)).hit_distance
    np.testing.assert_array_equal(got, expected)


def test_shapes_broadcast():
    sphere = library.Sphere()
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 4), [-3.0]), -1)[:, :, 0]
    hits = sphere.intersect(grid, (0, 0, 1))
    assert hits.shape == hits.hit.shape == (4, 5) and hits.hit_point.shape == (4, 5, 3)
    one = sphere.intersect((0, 0, -3), (0, 0, 1))
    assert one.shape == () and one.hit_distance == 2 and bool(one.hit)
    many = sphere.intersect((0, 0, -3), np.tile(np.float32([0, 0, 1]), (6, 1)))
    np.testing.assert_array_equal(many.hit_distance, [2] * 6)
    row = sphere.intersect(grid, np.tile([0, 0, 1], (5, 1)), hit_distance=np.full((4, 1), 2.5))
    assert row.shape == (4, 5)
    with pytest.raises(ValueError, match="not have the same rays"):
        sphere.intersect(np.zeros((3, 3)), np.zeros((4, 3)))
    with pytest.raises(ValueError, match="expected 3 numbers"):
        sphere.intersect(np.zeros((5, 2)), (0, 0, 1))
    with pytest.raises(TypeError, match="expected numbers"):
        sphere.intersect("abc", (0, 0, 1))


def test_names_are_those_of_both_languages():
    sphere = library.Sphere()
    first = sphere.intersect(rt_RayOrigin=(0, 0, -3), ray_direction=(0, 0, 1))
    assert first["rt_HitDistance"] == first["hit_distance"] == first.hit_distance == 2
    assert dict(first).keys() == {"hit", "hit_distance"} == set(first)
    with pytest.raises(TypeError, match="did you mean `ray_origin`"):
        sphere.intersect(ray_orign=(0, 0, 0))
    with pytest.raises(TypeError, match="two values"):
        sphere.intersect((0, 0, 0), ray_origin=(0, 0, 0))
    with pytest.raises(TypeError, match="takes 2 positional"):
        sphere.intersect((0, 0, 0), (0, 0, 1), 3)
    with pytest.raises(AttributeError, match="no result `hit_distence`; did you mean"):
        first.hit_distence


def test_a_limit_of_the_distance_holds():
    sphere = library.Sphere()
    near = sphere.intersect((0, 0, -3), (0, 0, 1), hit_distance=np.float32([1, 5]))
    np.testing.assert_array_equal(near.hit, [False, True])
    np.testing.assert_array_equal(near.hit_distance, [1, 2])


SCRATCH = """class Ball : rt_Primitive;
struct Met { int side; float depth; };
scratch Met met; scratch bool inside; scratch vec2 both;
void intersect() {
    float t = -rt_RayOrigin.z - 1.0;
    met.side = int(sign(rt_RayOrigin.x)); met.depth = t; inside = rt_RayOrigin.y > 0.0; both = rt_RayOrigin.xy;
    if (t > 0.0) hit(t);
}
void computeNormal() { rt_GeometricNormal = vec3(float(met.side), inside ? 1.0 : 0.0, met.depth); }
void computeTextureCoordinates() { rt_TextureUV = both; }"""


def test_scratch_passes_from_method_to_method():
    ball = rtsl.compile(SCRATCH).Ball()
    origins = np.float32([[-2, 1, -5], [3, -1, -6], [1, 0, 5]])
    hits = ball.intersect(origins, (0, 0, 1))
    np.testing.assert_array_equal(hits.hit, [True, True, False])
    # Only rays with a hit leave any.
    np.testing.assert_array_equal(hits.scratch["met.side"], [-1, 1, 0])
    np.testing.assert_array_equal(hits.scratch["inside"], [True, False, False])
    assert hits.scratch["inside"].dtype == bool and hits.scratch["met.side"].dtype == np.int32
    normals = ball.computeNormal(hits)
    np.testing.assert_array_equal(normals.geometric_normal, [[-1, 1, 4], [1, 0, 5], [0, 0, 1]])
    coordinates = ball.compute_texture_coordinates(hits, normals)
    np.testing.assert_array_equal(coordinates.texture_uv[:2], origins[:2, :2])
    # Another class does not take it.
    assert library.Sphere().compute_normal(hits).geometric_normal.shape == (3, 3)


def test_surfaces_are_ready_for_materials():
    sphere = library.Sphere(radius=2)
    surface = sphere.surface(sphere.intersect(np.float32([[0, 0, -5], [1, 0, -5], [9, 0, -5]]), (0, 0, 1)))
    np.testing.assert_allclose(np.linalg.norm(surface.shading_normal[:2], axis=1), 1, rtol=1e-6)
    assert {"texture_uv", "dpdu", "hit_point"} <= set(dir(surface))
    value = library.Lambertian(kd=0.5).bsdf((0, 0, -1), surface).bsdf_value
    np.testing.assert_allclose(value, [[0.5 / np.pi] * 3, [0.5 / np.pi] * 3, [0] * 3], rtol=1e-5)


def test_masks_leave_rays_out():
    sphere = library.Sphere()
    mask = np.array([True, False, True])
    hits = sphere.intersect(np.tile(np.float32([0, 0, -3]), (3, 1)), (0, 0, 1), mask=mask)
    np.testing.assert_array_equal(hits.hit, mask)
    np.testing.assert_array_equal(hits.hit_distance, [2, np.inf, 2])
    with pytest.raises(TypeError, match="bools"):
        sphere.intersect((0, 0, -3), (0, 0, 1), mask=[1, 0])


def test_results_may_have_given_memory():
    origins, directions = rays(500)
    distance, hit = np.full(500, -7, np.float32), np.zeros(500, bool)
    result = library.Sphere().intersect(origins, directions, out={"hit_distance": distance, "hit": hit})
    assert result.hit_distance is distance and hit.any()
    normals = np.zeros((500, 6), np.float32)
    library.Sphere().compute_normal(result, out={"geometric_normal": normals[:, 3:]})
    assert np.all(normals[:, :3] == 0) and normals[:, 3:].any()
    with pytest.raises(ValueError, match="expected a writable array of float32"):
        library.Sphere().intersect(origins, directions, out={"hit_distance": np.zeros(500)})
    with pytest.raises(TypeError, match="sets no `nothing`"):
        library.Sphere().intersect(origins, directions, out={"nothing": distance})
    shared = np.lib.stride_tricks.as_strided(np.zeros(1, np.float32), (500,), (0,))
    with pytest.raises((rtsl.Error, ValueError)):
        library.Sphere().intersect(origins, directions, out={"hit_distance": shared})


def test_every_role_is_called():
    camera = library.Pinhole(fov=90)
    ray = camera.generate_ray(np.float32([[0.5, 0.5], [0, 0.5]]))
    np.testing.assert_allclose(ray.ray_direction, [[0, 0, 1], np.float32([-1, 0, 1]) / np.sqrt(2)], atol=1e-6)
    pixels = camera.rays(4, 2)
    assert pixels.shape == (2, 4)
    direction = pixels.ray_direction / pixels.ray_direction[..., 2:]
    np.testing.assert_allclose(direction[0, :, 0], [-1.5, -0.5, 0.5, 1.5], rtol=1e-6)
    np.testing.assert_allclose(direction[:, 0, 1], [0.5, -0.5], rtol=1e-6)
    texture = library.Checker(scale=1, even=1, odd=0)
    np.testing.assert_array_equal(texture.lookup(np.float32([[0.5, 0.5], [1.5, 0.5]])).float_texture_value, [1, 0])
    light = library.PointLight(position=(0, 2, 0), intensity=8)
    lit = light.illumination(np.zeros((4, 3), np.float32))
    np.testing.assert_allclose(lit.light_color, 2, rtol=1e-5)
    np.testing.assert_allclose(lit.light_distance, 2, rtol=1e-6)
    ward = library.Ward(kd=0.2, ks=0.6)
    seeds = RNG.random((2000, 3)).astype(np.float32)
    view = dict(ray_direction=(0.3, -1, 0.1), shading_normal=(0, 1, 0), geometric_normal=(0, 1, 0))
    sampled = ward.sample_bsdf(seeds, **view)
    density = ward.evaluate_pdf(sampled.light_direction, **view).pdf
    above = sampled.pdf > 0
    assert above.mean() > 0.9
    np.testing.assert_allclose(density[above], sampled.pdf[above], rtol=1e-3)


def test_hosts_answer_what_shaders_ask():
    toon = rtsl.compile(
        """class M : rt_Material;
        void shade() {
            color sum = ambient() + trace(rt_HitPoint, rt_ShadingNormal);
            illuminance(rt_HitPoint, rt_ShadingNormal, 1.5) { sum += rt_LightColor; }
            rt_SampleColor = sum;
        }"""
    ).M()
    lights = [rtsl.LightSample((0, 1, 0), color=(1, 2, 3)), rtsl.LightSample((0, -1, 0), color=100)]
    host = rtsl.Host(ambient=0.25, trace=(0.5, 0, 0), lights=lights)
    shaded = toon.shade((0, -1, 0), np.tile(np.float32([0, 1, 0]), (40, 1)), host=host)
    np.testing.assert_array_equal(shaded.sample_color, np.tile(np.float32([1.75, 2.25, 3.25]), (40, 1)))
    np.testing.assert_array_equal(toon.shade((0, -1, 0), (0, 1, 0)).sample_color, [0, 0, 0])


def test_random_numbers_depend_on_seed_and_ray_alone():
    noise = rtsl.compile("class N : rt_Texture; void lookup() { rt_FloatTextureValue = rand() + 10.0 * rand(); }").N()
    uv = np.zeros((5000, 2), np.float32)
    draw = lambda seed, threads: noise.lookup(uv, host=rtsl.Host(seed=seed), threads=threads).float_texture_value
    one = draw(1, 1)
    np.testing.assert_array_equal(one, draw(1, 3))
    assert abs(one.mean() - 5.5) < 0.15 and len(np.unique(one)) > 4900
    assert not np.array_equal(one, draw(2, 1))


def test_endless_loops_end():
    endless = rtsl.compile("class E : rt_Texture; void lookup() { while (true) { rt_FloatTextureValue += 1.0; } }").E()
    engine = rtsl.Engine(loop_budget=1000)
    with pytest.raises(rtsl.Error, match="used up its budget of 1000 loop iterations"):
        endless.lookup((0, 0), engine=engine)


def test_what_asks_a_scene_is_refused():
    with pytest.raises(rtsl.Error, match="scene"):
        library.Path().radiance((0, 0, 0), (0, 0, 1))
    with pytest.raises(AttributeError, match="neither parameter nor method `lookup`"):
        library.Sphere().lookup


def test_state_that_follows_from_other_state_is_derived():
    text = """class Box : rt_Primitive;
    void intersect() {
        vec3 a = (vec3(-1.0) - rt_RayOrigin) * rt_InverseRayDirection;
        vec3 b = (vec3(1.0) - rt_RayOrigin) * rt_InverseRayDirection;
        vec3 near = min(a, b);
        hit(max(near.x, max(near.y, near.z)));
    }
    void computeTextureCoordinates() { rt_TextureUV = rt_ShadingNormal.xy; }"""
    box = rtsl.compile(text).Box()
    # The direction is the default.
    assert box.intersect((0, 0, -5)).hit_distance == 4
    uv = box.compute_texture_coordinates(geometric_normal=(0.5, 0.25, 1)).texture_uv
    np.testing.assert_array_equal(uv, [0.5, 0.25])
