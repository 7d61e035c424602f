"""Names of the language in Python: `rt_RayOrigin` is also `ray_origin`, `computeNormal` also `compute_normal`."""

from __future__ import annotations

import difflib
import functools
import re
from typing import Dict, Iterable, Tuple

#: The state variables that positional arguments set, by role and method.
POSITIONAL: Dict[Tuple[str, str], Tuple[str, ...]] = {
    ("camera", "generateRay"): ("rt_ScreenCoord", "rt_LensCoord"),
    ("primitive", "intersect"): ("rt_RayOrigin", "rt_RayDirection"),
    ("primitive", "computeBounds"): (),
    ("primitive", "computeNormal"): ("rt_HitPoint",),
    ("primitive", "computeTextureCoordinates"): ("rt_HitPoint", "rt_GeometricNormal"),
    ("primitive", "computeDerivatives"): ("rt_HitPoint", "rt_GeometricNormal", "rt_TextureUV"),
    ("primitive", "generateSample"): ("rt_RayOrigin",),
    ("primitive", "samplePDF"): ("rt_RayOrigin", "rt_HitPoint", "rt_GeometricNormal"),
    ("texture", "lookup"): ("rt_TextureUV", "rt_TextureUVW"),
    ("material", "shade"): ("rt_RayDirection", "rt_ShadingNormal", "rt_HitPoint"),
    ("material", "BSDF"): ("rt_LightDirection", "rt_RayDirection", "rt_ShadingNormal"),
    ("material", "sampleBSDF"): ("rt_BSDFSeed", "rt_RayDirection", "rt_ShadingNormal"),
    ("material", "evaluatePDF"): ("rt_LightDirection", "rt_RayDirection", "rt_ShadingNormal"),
    ("material", "emission"): ("rt_RayDirection", "rt_ShadingNormal"),
    ("material", "presence"): ("rt_TextureUV", "rt_HitPoint"),
    ("light", "illumination"): ("rt_HitPoint", "rt_ShadingNormal"),
    ("light", "evaluatePDF"): ("rt_LightDirection", "rt_HitPoint", "rt_ShadingNormal"),
    ("light", "emission"): ("rt_RayDirection", "rt_RayOrigin"),
    ("integrator", "radiance"): ("rt_RayOrigin", "rt_RayDirection"),
}


@functools.lru_cache(maxsize=None)
def snake_case(name: str) -> str:
    """Returns the name of a method or a state variable as Python writes names.

    >>> [snake_case(it) for it in ("rt_RayOrigin", "rt_TextureUV", "rt_BSDFSeed", "rt_dPdu", "sampleBSDF", "samplePDF")]
    ['ray_origin', 'texture_uv', 'bsdf_seed', 'dpdu', 'sample_bsdf', 'sample_pdf']
    """
    name = name[3:] if name.startswith("rt_") else name
    if re.fullmatch(r"d[A-Za-z]d[uv]|d[uv]", name):
        return name.lower()
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def with_article(name: str) -> str:
    """Returns a name behind its indefinite article.

    >>> with_article("texture"), with_article("integrator")
    ('a texture', 'an integrator')
    """
    return f"{'an' if name[:1].lower() in 'aeio' else 'a'} {name}"


def meant(name: str, known: Iterable[str]) -> str:
    """Returns the question whether a similar name was meant, or nothing."""
    near = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean `{near[0]}`?" if near else ""
