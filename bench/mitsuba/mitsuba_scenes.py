"""The scenes of `scenes/` as Mitsuba takes them. A variant must be set before one is made."""

import mitsuba

from functools import partial

from sphere_list import COLORS, COUNTS, GLASS_INDEX, color, spheres

# Mitsuba counts a path's edges, RTSL its bounces between camera and light.
INTEGRATOR = {"type": "path", "max_depth": 8, "rr_depth": 1000}
INTEGRATORS = {"path": INTEGRATOR, "direct": {"type": "direct"}, "depth": {"type": "depth"}}


def rgb(*value: float) -> dict:
    return {"type": "rgb", "value": list(value)}


def film(size: int) -> dict:
    return {
        "type": "hdrfilm",
        "width": size,
        "height": size,
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }


def sensor(origin: list, target: list, fov: float, size: int) -> dict:
    return {
        "type": "perspective",
        "fov": fov,
        "fov_axis": "x",
        "to_world": mitsuba.ScalarTransform4f().look_at(origin, target, [0, 1, 0]),
        "film": film(size),
        "sampler": {"type": "independent"},
    }


def brushed_sphere(x: float, alpha: tuple[float, float], reflectance: dict) -> dict:
    return {
        "type": "sphere",
        "center": [x, 1, 0],
        "radius": 1,
        "bsdf": {
            "type": "roughconductor",
            "distribution": "ggx",
            "material": "none",
            "alpha_u": alpha[0],
            "alpha_v": alpha[1],
            "specular_reflectance": reflectance,
        },
    }


def metals(size: int) -> dict:
    transform = mitsuba.ScalarTransform4f()
    return {
        "type": "scene",
        "integrator": INTEGRATOR,
        "sensor": sensor([0, 2.2, 8], [0, 0.9, 0], 45, size),
        "sky": {"type": "constant", "radiance": rgb(0.4, 0.5, 0.7)},
        "lamp": {"type": "point", "position": [4, 6, 4], "intensity": rgb(60, 60, 60)},
        "floor": {
            "type": "rectangle",
            "to_world": transform.rotate([1, 0, 0], -90).scale([20, 20, 1]),
            "bsdf": {"type": "diffuse", "reflectance": rgb(0.5, 0.5, 0.5)},
        },
        "copper": brushed_sphere(-2.2, (0.1, 0.3), rgb(0.95, 0.64, 0.54)),
        "silver": brushed_sphere(0, (0.05, 0.2), rgb(0.91, 0.92, 0.92)),
        "gold": brushed_sphere(2.2, (0.3, 0.1), rgb(1.0, 0.78, 0.34)),
    }


def metals_area(size: int) -> dict:
    transform = mitsuba.ScalarTransform4f()
    scene = metals(size)
    scene["lamp"] = {
        "type": "rectangle",
        "to_world": transform.translate([4, 6, 4]).rotate([1, 0, 0], 90).scale([0.5, 0.5, 1]),
        "emitter": {"type": "area", "radiance": rgb(60, 60, 60)},
    }
    return scene


def cornell_box(size: int) -> dict:
    scene = mitsuba.cornell_box()
    scene["integrator"] = INTEGRATOR
    scene["sensor"]["film"] = film(size)
    return scene


def many_spheres(count: int, size: int) -> dict:
    scene = {
        "type": "scene",
        "integrator": INTEGRATOR,
        "sensor": sensor([0, 0, 32], [0, 0, 0], 40, size),
        "sky": {"type": "constant", "radiance": rgb(1, 1, 1)},
        "glass": {"type": "dielectric", "int_ior": GLASS_INDEX, "ext_ior": 1.0},
    }
    for number in range(COLORS):
        scene[f"color-{number}"] = {"type": "diffuse", "reflectance": rgb(*color(number))}
    for number, sphere in enumerate(spheres(count)):
        material = "glass" if sphere.color is None else f"color-{sphere.color}"
        scene[f"sphere-{number}"] = {
            "type": "sphere",
            "center": list(sphere.center),
            "radius": sphere.radius,
            "bsdf": {"type": "ref", "id": material},
        }
    return scene


SCENES = {"metals": metals, "metals_area": metals_area, "cornell_box": cornell_box}
SCENES |= {name: partial(many_spheres, count) for name, count in COUNTS.items()}
