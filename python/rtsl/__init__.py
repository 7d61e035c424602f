"""RTSL, a ray tracing shading language, in Python.

>>> import numpy as np, rtsl
>>> sphere = rtsl.library.Sphere(radius=2)
>>> hits = sphere.intersect(np.array([[0, 0, -5], [0, 3, -5]], np.float32), (0, 0, 1))
>>> hits.hit
array([ True, False])
>>> hits.hit_distance
array([ 3., inf], dtype=float32)

`compile` turns a text into classes, `library` has those of the standard library, and calling a class makes an
instance. Methods of instances take whole arrays. `Scene` loads, makes and renders scenes.
"""

from __future__ import annotations

from . import _rtsl
from ._call import BoundMethod, Result
from ._classes import Class, MethodInfo, Parameter, StateVariable, Unit, compile, compile_file
from ._engine import Engine, default_engine, set_default_engine
from ._errors import (
    CompileError,
    Diagnostic,
    Error,
    InterpreterWarning,
    ParameterError,
    ParameterWarning,
    SceneError,
    SceneWarning,
)
from ._host import Host, LightSample
from ._instance import Instance
from ._looking import Costs, LineCost, Pixel, Recording, Sample, TextCost
from ._llvm import info, suggest_installed, warn_without_llvm
from ._image import Image
from ._mesh import mesh
from ._scene import PartialRender, Placed, Scene, Thing
from . import cluster, library, mitsuba, notebook, transforms

__version__: str = _rtsl.__version__

suggest_installed()
warn_without_llvm()

__all__ = [
    "BoundMethod",
    "Class",
    "CompileError",
    "Costs",
    "Diagnostic",
    "Engine",
    "Error",
    "Host",
    "Image",
    "Instance",
    "InterpreterWarning",
    "LightSample",
    "LineCost",
    "MethodInfo",
    "Parameter",
    "ParameterError",
    "ParameterWarning",
    "PartialRender",
    "Pixel",
    "Placed",
    "Recording",
    "Result",
    "Sample",
    "Scene",
    "SceneError",
    "SceneWarning",
    "StateVariable",
    "TextCost",
    "Thing",
    "Unit",
    "cluster",
    "compile",
    "compile_file",
    "default_engine",
    "info",
    "library",
    "mesh",
    "mitsuba",
    "notebook",
    "set_default_engine",
    "transforms",
]
