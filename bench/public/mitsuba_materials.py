"""Materials of the pbrt format as those of Mitsuba."""

import math
from typing import Callable

import numpy

import spectra
from mitsuba_textures import Texture, Textures, greatest_number, mean_number, rgb
from pbrt_file import Parameters
from pbrt_scene import Entity, PbrtScene

# Narrower highlights are those of a polished surface.
LEAST_ALPHA = 1e-3
# The widest highlight of Mitsuba's rough plastic.
GREATEST_PLASTIC_ALPHA = 0.99
INVISIBLE = ("interface", "none", "")
# Materials that scatter into both sides; others are one-sided in Mitsuba, two-sided in pbrt.
TRANSMITTING = {"dielectric", "roughdielectric", "thindielectric", "principledthin", "null"}


def amplifier(factor: float) -> Callable:
    """A function that multiplies reflectances, up to 1."""
    return lambda value: numpy.minimum(factor * value, 1.0)


class Materials:
    """Converts materials. Equal ones become one, which shapes refer to."""

    def __init__(self, scene: PbrtScene, textures: Textures, remarks: set[str]):
        self.scene = scene
        self.folder = scene.path.parent
        self.textures = textures
        self.remarks = remarks
        self.named: dict[str, dict] = {}

    def of(self, material: Entity | str | None) -> dict | None:
        """The material of a shape; `None` if the shape is invisible."""
        if isinstance(material, str):
            if material not in self.named:
                self.named[material] = self.convert(self.scene.materials.get(material))
            converted = self.named[material]
        else:
            converted = self.convert(material)
        return None if converted["type"] == "null" else converted

    def convert(self, entity: Entity | None) -> dict:
        if entity is None:
            return self.with_sides({"type": "diffuse", "reflectance": rgb([0.5])})
        if entity.kind in INVISIBLE:
            return {"type": "null"}
        method = getattr(self, f"make_{entity.kind}", None)
        if method is None:
            self.remarks.add(f"material {entity.kind}: matte grey")
            return self.convert(None)
        return self.with_relief(method(entity.parameters), entity.parameters)

    def with_sides(self, bsdf: dict) -> dict:
        return bsdf if bsdf["type"] in TRANSMITTING else {"type": "twosided", "bsdf": bsdf}

    def with_relief(self, bsdf: dict, given: Parameters) -> dict:
        """Adds bumps or a normal map."""
        if "displacement" in given:
            heights = self.textures.number(given, "displacement", 0.0)
            if isinstance(heights, dict) and heights["type"] == "bitmap":
                return {"type": "bumpmap", "arbitrary": heights, "bsdf": bsdf}
            self.remarks.add("bumps of a texture without an image left out")
        elif "normalmap" in given:
            entity = Entity("imagemap", Parameters(filename=given["normalmap"]))
            normals = self.textures.image(entity) | {"raw": True}
            return {"type": "normalmap", "normalmap": normals, "bsdf": bsdf}
        return bsdf

    def alpha(self, given: Parameters, prefix: str = "") -> tuple[Texture, Texture]:
        """The widths of highlights along both directions."""
        both = self.textures.number(given, f"{prefix}roughness", 0.0)
        names = f"{prefix}uroughness", f"{prefix}vroughness"
        found = [self.textures.number(given, it, 0.0) if it in given else both for it in names]
        if given.flag("remaproughness", True):
            found = [
                math.sqrt(max(it, 0.0)) if isinstance(it, float)
                else self.textures.mapped(it, lambda x: numpy.sqrt(numpy.maximum(x, 0.0)))
                for it in found
            ]  # fmt: skip
        return found[0], found[1]

    def is_polished(self, alpha: tuple[Texture, Texture]) -> bool:
        return all(isinstance(it, float) and it < LEAST_ALPHA for it in alpha)

    def rough(self, bsdf: dict, alpha: tuple[Texture, Texture]) -> dict:
        """The rough variant of a conductor or dielectric, if it is not polished."""
        if self.is_polished(alpha):
            return bsdf
        widths = [max(it, LEAST_ALPHA) if isinstance(it, float) else it for it in alpha]
        rough = {"type": f"rough{bsdf['type']}", "distribution": "ggx"}
        return bsdf | rough | {"alpha_u": widths[0], "alpha_v": widths[1]}

    def index(self, given: Parameters, name: str = "eta") -> float:
        """The index of refraction of a dielectric."""
        parameter = given.get(name)
        if parameter is None:
            return 1.5
        found = spectra.color(parameter, self.folder)
        return float(numpy.mean(found))

    def make_diffuse(self, given: Parameters) -> dict:
        reflectance = self.textures.color(given, "reflectance", 0.5)
        return self.with_sides({"type": "diffuse", "reflectance": reflectance})

    def make_conductor(self, given: Parameters, prefix: str = "") -> dict:
        bsdf = {"type": "conductor"} | self.fresnel(given, prefix)
        return self.with_sides(self.rough(bsdf, self.alpha(given, prefix)))

    def fresnel(self, given: Parameters, prefix: str) -> dict:
        """The reflection of a metal: indices, or a reflectance at normal incidence."""
        if "reflectance" in given:
            reflectance = self.textures.color(given, "reflectance", 1.0)
            if reflectance["type"] != "rgb":
                self.remarks.add("metal with a texture: reflects the same in all directions")
                return {"material": "none", "specular_reflectance": reflectance}
            straight = numpy.clip(reflectance["value"], 0.0, 0.9999)
            extinction = 2 * numpy.sqrt(straight) / numpy.sqrt(1 - straight)
            return {"eta": rgb([1.0]), "k": rgb(extinction)}
        found = {}
        for name in ("eta", "k"):
            parameter = given.get(prefix + name)
            copper = spectra.named_spectra()[f"metal-Cu-{name}"]
            found[name] = self.textures.value(parameter, 0.0) if parameter else rgb(copper)
        return found

    def make_dielectric(self, given: Parameters) -> dict:
        bsdf = {"type": "dielectric", "int_ior": self.index(given), "ext_ior": 1.0}
        return self.rough(bsdf, self.alpha(given))

    def make_thindielectric(self, given: Parameters) -> dict:
        return {"type": "thindielectric", "int_ior": self.index(given), "ext_ior": 1.0}

    def make_coateddiffuse(self, given: Parameters) -> dict:
        self.remarks.add("coateddiffuse: plastic")
        bsdf = {
            "type": "plastic",
            "int_ior": self.index(given),
            "ext_ior": 1.0,
            "diffuse_reflectance": self.textures.color(given, "reflectance", 0.5),
            "nonlinear": True,
        }
        alpha = self.alpha(given)
        if not self.is_polished(alpha):
            width = math.sqrt(mean_number(alpha[0]) * mean_number(alpha[1]))
            width = min(max(width, LEAST_ALPHA), GREATEST_PLASTIC_ALPHA)
            bsdf |= {"type": "roughplastic", "distribution": "ggx", "alpha": width}
            if any(isinstance(it, dict) for it in alpha):
                self.remarks.add("roughness of a coat by a texture: its mean")
        return self.with_sides(bsdf)

    def make_coatedconductor(self, given: Parameters) -> dict:
        self.remarks.add("coatedconductor: the metal without its coat")
        return self.make_conductor(given, "conductor.")

    def make_diffusetransmission(self, given: Parameters) -> dict:
        """A blend of two materials that scatter evenly into one side each."""
        self.remarks.add("diffusetransmission: a blend of two principledthin")
        scale = given.number("scale", 1.0)
        colors = [self.textures.color(given, it, 0.25) for it in ("reflectance", "transmittance")]
        back, through = (scale * greatest_number(color) for color in colors)
        weight = through / max(back + through, 1e-6)
        shares = 1 - weight, weight
        sides = [
            {
                "type": "principledthin",
                "base_color": self.textures.mapped(color, amplifier(scale / max(share, 1e-6))),
                "diff_trans": transmission,
            }
            for color, share, transmission in zip(colors, shares, (0.0, 2.0))
        ]
        return {"type": "blendbsdf", "weight": weight, "first": sides[0], "second": sides[1]}

    def make_subsurface(self, given: Parameters) -> dict:
        self.remarks.add("subsurface: plastic")
        reflectance = self.textures.color(given, "reflectance", 0.5)
        index = given.number("eta", 1.33)
        bsdf = {"type": "plastic", "int_ior": index, "ext_ior": 1.0}
        return self.with_sides(bsdf | {"diffuse_reflectance": reflectance, "nonlinear": True})

    def make_mix(self, given: Parameters) -> dict:
        names = given["materials"].values
        first, second = (self.of(name) or {"type": "null"} for name in names)
        amount = self.textures.number(given, "amount", 0.5)
        return {"type": "blendbsdf", "weight": amount, "first": first, "second": second}
