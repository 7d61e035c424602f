"""RTSL materials and textures in Mitsuba 3; ``pip install 'rtsl[mitsuba]'`` brings Mitsuba.

>>> import mitsuba as mi                                            # doctest: +SKIP
>>> mi.set_variant("llvm_ad_rgb")                                   # doctest: +SKIP
>>> rtsl.mitsuba.register()                                         # doctest: +SKIP
>>> ward = rtsl.library.Ward(alphaU=0.3)                            # doctest: +SKIP
>>> mi.load_dict({"type": "sphere", "bsdf": rtsl.mitsuba.bsdf(ward)})  # doctest: +SKIP

Scene files name classes of the library: ``<bsdf type="rtsl"><string name="class" value="Ward"/>...</bsdf>``.

Mitsuba calls the plugins with all rays of a wavefront. Its own code for surfaces is compiled for whole programs, which
RTSL's methods cannot be part of: `register` therefore turns symbolic loops and calls of Dr.Jit off. Derivatives do not
pass through the plugins.
"""

from __future__ import annotations

import itertools
from typing import Any, Dict, Tuple

import numpy as np

from . import library
from ._instance import Instance

#: Instances by the numbers by which dictionaries of Mitsuba refer to them.
_given: Dict[int, Instance] = {}
_numbers = itertools.count(1)
_OWN_PROPERTIES = ("class", "instance")


def register(name: str = "rtsl") -> None:
    """Registers a BSDF of this name, and a texture of the name with `_texture`, for the variant in use, which has RGB
    colours.

    Raises RuntimeError if the variant has other colours, or none is set.
    """
    import mitsuba as mi

    variant = mi.variant()
    if variant is None or not variant.endswith("_rgb"):
        raise RuntimeError(f"RTSL's colours are RGB: set a variant such as `llvm_ad_rgb`, not `{variant}`")
    if not variant.startswith("scalar"):
        import drjit as dr

        dr.set_flag(dr.JitFlag.SymbolicLoops, False)
        dr.set_flag(dr.JitFlag.SymbolicCalls, False)
        dr.set_flag(dr.JitFlag.OptimizeCalls, False)
    bsdf_class, texture_class = _plugins(mi)
    mi.register_bsdf(name, bsdf_class)
    mi.register_texture(f"{name}_texture", texture_class)


def bsdf(material: Instance, name: str = "rtsl") -> Any:
    """Returns a material as a BSDF of Mitsuba. Assigned parameters of the material show in the next render."""
    return _object(material, "material", name)


def texture(texture: Instance, name: str = "rtsl") -> Any:
    """Returns a texture as one of Mitsuba."""
    return _object(texture, "texture", f"{name}_texture")


def _object(instance: Instance, role: str, plugin: str) -> Any:
    import mitsuba as mi

    if role not in instance._class.roles:
        raise TypeError(f"`{instance._class.name}` is no {role}")
    number = next(_numbers)
    _given[number] = instance
    try:
        return mi.load_dict({"type": plugin, "instance": number})
    finally:
        del _given[number]


def _instance_of(properties: Any, role: str) -> Instance:
    """Returns the instance that the properties of a plugin describe."""
    # Versions before 3.7 have no `keys`.
    names = list(properties.keys() if hasattr(properties, "keys") else properties.property_names())
    if "instance" in names:
        return _given[int(properties["instance"])]
    found = library.find(str(properties["class"]))
    if role not in found.roles:
        raise ValueError(f"`{found.name}` is no {role}")
    return found(**{key: _value(properties[key]) for key in names if key not in _OWN_PROPERTIES})


def _value(value: Any) -> Any:
    """Returns a property of Mitsuba as the value of a parameter."""
    if isinstance(value, (bool, int, float, str)):
        return value
    if hasattr(value, "instance") and isinstance(value.instance, Instance):
        return value.instance
    if hasattr(value, "mean") and hasattr(value, "eval"):
        raise ValueError("a texture of Mitsuba is no value of a parameter: use one of RTSL")
    return [float(it) for it in np.ravel(np.array(value))]


def _rows(values: Any) -> np.ndarray:
    """Returns vectors of Mitsuba with a row for each ray; what Dr.Jit keeps by component is not copied."""
    array = np.asarray(values, dtype=np.float32)
    return array.T if array.ndim == 2 else array


def _numbers_of(values: Any) -> np.ndarray:
    return np.asarray(values, dtype=np.float32)


def _plugins(mi: Any) -> Tuple[type, type]:
    """Returns the classes of the plugins for the variant in use."""
    is_scalar = mi.variant().startswith("scalar")

    def number(values: Any) -> Any:
        return float(values) if is_scalar else mi.Float(np.ascontiguousarray(np.atleast_1d(values), np.float32))

    def vector(kind: Any, values: np.ndarray) -> Any:
        return kind(*(number(values[..., axis]) for axis in range(3)))

    def surface(si: Any) -> Dict[str, Any]:
        """The state of a surface, in world space."""
        return {
            "rt_HitPoint": _rows(si.p),
            "rt_ShadingNormal": _rows(si.sh_frame.n),
            "rt_GeometricNormal": _rows(si.n),
            "rt_TextureUV": _rows(si.uv),
            "rt_TextureUVW": _rows(si.p),
            "rt_dPdu": _rows(si.dp_du),
            "rt_dPdv": _rows(si.dp_dv),
        }

    def state_of(si: Any) -> Dict[str, Any]:
        return {**surface(si), "rt_RayDirection": _rows(-si.to_world(si.wi))}

    class RtslBsdf(mi.BSDF):  # type: ignore[misc]
        def __init__(self, properties: Any) -> None:
            mi.BSDF.__init__(self, properties)
            self.instance = _instance_of(properties, "material")
            flags = mi.BSDFFlags
            parts = [flags.DiffuseReflection, flags.DiffuseTransmission, flags.GlossyReflection]
            parts += [flags.GlossyTransmission, flags.DeltaReflection, flags.DeltaTransmission]
            parts += [flags.FrontSide, flags.BackSide, flags.SpatiallyVarying, flags.Anisotropic]
            self.m_flags = sum(int(part) for part in parts)
            self.m_components = [self.m_flags]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Tuple[Any, Any]:
            state = state_of(si)
            pair = _rows(sample2)
            seed = np.concatenate(np.broadcast_arrays(pair, _numbers_of(sample1)[..., np.newaxis]), -1)[..., [0, 1, -1]]
            mask = _mask(active)
            sampled = self.instance.sample_bsdf(seed, **state, mask=mask)
            direction = vector(mi.Vector3f, np.asarray(sampled.light_direction))
            pdf = np.asarray(sampled.pdf)
            names = {name for name in sampled if name == "relative_index"}
            eta = np.asarray(sampled["relative_index"]) if names else np.ones_like(pdf)
            value = np.asarray(sampled.bsdf_value)
            cosine = np.abs(np.sum(np.asarray(sampled.light_direction) * state["rt_ShadingNormal"], -1))
            # Without a density the direction is the only one, and the value the whole weight.
            is_delta = (pdf == 0) & np.any(value != 0, -1)
            scale = np.where(pdf > 0, cosine / np.where(pdf > 0, pdf, 1), is_delta)
            weight = np.where(mask[..., np.newaxis], value * scale[..., np.newaxis], 0)
            bs = mi.BSDFSample3f()
            bs.wo = si.to_local(direction)
            bs.pdf = number(np.where(is_delta, 1, pdf))
            bs.eta = number(eta)
            kinds = np.where(is_delta, int(mi.BSDFFlags.DeltaReflection), int(mi.BSDFFlags.GlossyReflection))
            bs.sampled_type = int(kinds) if is_scalar else mi.UInt32(np.atleast_1d(kinds).astype(np.uint32))
            bs.sampled_component = 0 if is_scalar else mi.UInt32(0)
            return bs, vector(mi.Color3f, weight)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Tuple[Any, Any]:
            state, light, mask = state_of(si), _rows(si.to_world(wo)), _mask(active)
            value = np.asarray(self.instance.bsdf(light, **state, mask=mask).bsdf_value)
            density = np.asarray(self.instance.evaluate_pdf(light, **state, mask=mask).pdf)
            cosine = np.abs(np.sum(light * state["rt_ShadingNormal"], -1))
            value = np.where(mask[..., np.newaxis], value * cosine[..., np.newaxis], 0)
            return vector(mi.Color3f, value), number(np.where(mask, density, 0))

        def to_string(self) -> str:
            return f"RtslBsdf[{self.instance!r}]"

    class RtslTexture(mi.Texture):  # type: ignore[misc]
        def __init__(self, properties: Any) -> None:
            mi.Texture.__init__(self, properties)
            self.instance = _instance_of(properties, "texture")

        def eval(self, si: Any, active: Any = True) -> Any:
            found = self.instance.lookup(**surface(si), mask=_mask(active))
            return vector(mi.Color3f, np.asarray(found.texture_color))

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return self.eval(si, active)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            return number(np.asarray(self.instance.lookup(**surface(si), mask=_mask(active)).float_texture_value))

        def is_spatially_varying(self) -> bool:
            return True

        def to_string(self) -> str:
            return f"RtslTexture[{self.instance!r}]"

    return RtslBsdf, RtslTexture


def _mask(active: Any) -> np.ndarray:
    return np.asarray(active, dtype=np.bool_)
