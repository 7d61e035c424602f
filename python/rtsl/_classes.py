"""Compiled texts and their classes."""

from __future__ import annotations

import inspect
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _rtsl
from ._arguments import checked
from ._copies import Immutable
from ._engine import default_engine
from ._errors import Diagnostic
from ._names import POSITIONAL, meant, snake_case

if TYPE_CHECKING:
    from ._instance import Instance


@dataclass(frozen=True)
class Parameter:
    """A parameter of a class."""

    name: str
    #: The type in the language, such as `float`, `color`, `rt_Texture` or `texture color`.
    type: str
    #: The value of instances that set none, as a number or an array; ``None`` for references and structs.
    default: Any
    #: True if every instance must set it.
    required: bool
    #: The role of the instances that it takes, such as `texture`; ``None`` if it takes numbers alone.
    takes: Optional[str]
    #: The annotations in ``[[...]]``, by their keys.
    annotations: Dict[str, Any] = field(default_factory=dict)
    #: The names of choices with their numbers, if the type is an enumeration.
    choices: List[Tuple[str, int]] = field(default_factory=list)

    @property
    def doc(self) -> str:
        """The annotation `doc`."""
        return str(self.annotations.get("doc", ""))

    @property
    def label(self) -> str:
        """The annotation `label`, or else the name."""
        return str(self.annotations.get("label", self.name))

    @property
    def min(self) -> Optional[float]:
        """The annotation `min`."""
        return self.annotations.get("min")

    @property
    def max(self) -> Optional[float]:
        """The annotation `max`."""
        return self.annotations.get("max")

    @property
    def unit(self) -> Optional[str]:
        """The annotation `unit`."""
        return self.annotations.get("unit")

    def __str__(self) -> str:
        default = "" if self.required or self.default is None else f" = {shown(self.default)}"
        bounds = [f"{key} {shown(self.annotations[key])}" for key in ("min", "max") if key in self.annotations]
        note = f" [{', '.join(bounds)}]" if bounds else ""
        doc = f": {self.doc}" if self.doc else ""
        return f"{self.name} ({self.type}{default}){note}{doc}"


@dataclass(frozen=True)
class StateVariable:
    """A state variable that a method reads or sets."""

    #: The name in the language, such as `rt_RayOrigin`.
    name: str
    type: str
    #: Numbers of a ray.
    components: int
    doc: str
    #: The numbers where nobody sets it; ``None`` if they follow from other variables.
    default: Optional[List[float]]

    @property
    def alias(self) -> str:
        """The name in Python, such as `ray_origin`."""
        return snake_case(self.name)

    def __str__(self) -> str:
        return f"{self.alias} ({self.type}): {self.doc}"


@dataclass(frozen=True)
class MethodInfo:
    """A method of a class, with the state that it reads and sets."""

    #: The name in the language, such as `computeNormal`.
    name: str
    doc: str
    role: str
    reads: List[StateVariable]
    sets: List[StateVariable]
    #: True if it takes random numbers.
    draws_numbers: bool = False
    #: True if it asks the scene, so that only renders call it.
    asks_scene: bool = False

    @property
    def alias(self) -> str:
        """The name in Python, such as `compute_normal`."""
        return snake_case(self.name)

    @property
    def positional(self) -> Tuple[str, ...]:
        """The state variables that positional arguments set, in order."""
        return POSITIONAL.get((self.role, self.name), ())

    def help(self) -> str:
        """Returns the documentation of the method in Python."""
        arguments = ", ".join(snake_case(name) for name in self.positional)
        lines = [f"{self.alias}({arguments}, **state)", "", self.doc.strip()]
        for title, variables in (("Reads", self.reads), ("Sets", self.sets)):
            lines += ["", f"{title}:"] + [f"    {variable}" for variable in variables] if variables else []
        return "\n".join(lines)


def shown(value: Any) -> str:
    """Returns a value in few characters."""
    if isinstance(value, np.ndarray):
        return str(value.tolist()) if 0 < value.size <= 4 else f"{value.shape} numbers"
    return str(value)


class Class(Immutable):
    """A class of a text. Calling it makes an instance: ``Sphere(radius=2)``."""

    _INSTEAD = "compile the text again where it is needed"

    def __init__(self, handle: _rtsl.Class) -> None:
        self._handle = handle
        self._parameters = {it["name"]: Parameter(**it) for it in handle.parameters()}
        self._methods: Optional[Dict[str, MethodInfo]] = None
        self.__doc__ = self.help()

    @property
    def name(self) -> str:
        """Its name."""
        return self._handle.name

    @property
    def __name__(self) -> str:
        return self._handle.name

    @property
    def doc(self) -> str:
        """The comment before it."""
        return self._handle.doc or ""

    @property
    def roles(self) -> List[str]:
        """Its roles: `camera`, `primitive`, `texture`, `light`, `material`, `integrator`."""
        return self._handle.roles

    @property
    def role(self) -> str:
        """Its first role."""
        return self.roles[0] if self.roles else ""

    @property
    def parameters(self) -> Dict[str, Parameter]:
        """Its parameters by name, in their order."""
        return self._parameters

    @property
    def methods(self) -> Dict[str, MethodInfo]:
        """Its methods by name, with the state that they read and set while nothing is referred to."""
        if self._methods is None:
            self._methods = methods_of(self._handle.methods(default_engine()))
        return self._methods

    @property
    def scratch(self) -> List[Tuple[str, str]]:
        """The names of scratch members with their types."""
        return self._handle.scratch()

    def __call__(self, **values: Any) -> "Instance":
        """Makes an instance with these values of parameters."""
        from ._instance import Instance

        return Instance(self, values)

    def help(self) -> str:
        """Returns the documentation of the class: its comment and its parameters."""
        lines = [f"{self.name} ({', '.join(self.roles)})"] + ["", self.doc.strip()] * bool(self.doc)
        lines += ["", "Parameters:"] * bool(self._parameters)
        lines += [f"    {parameter}" for parameter in self._parameters.values()]
        return "\n".join(lines)

    @property
    def __signature__(self) -> inspect.Signature:
        empty = inspect.Parameter.empty
        kind = inspect.Parameter.KEYWORD_ONLY
        names = (it for it in self._parameters.values() if it.name.isidentifier())
        return inspect.Signature(
            [inspect.Parameter(it.name, kind, default=empty if it.required else it.default) for it in names]
        )

    def __repr__(self) -> str:
        return f"<class {self.name} of RTSL: {', '.join(self.roles)}>"


def methods_of(described: Sequence[Dict[str, Any]]) -> Dict[str, MethodInfo]:
    """Returns the methods that the extension module describes. Those that cannot be linked read and set nothing."""
    methods = {}
    for it in described:
        reads = [StateVariable(**variable) for variable in it.get("reads", [])]
        sets = [StateVariable(**variable) for variable in it.get("sets", [])]
        flags = {key: it[key] for key in ("draws_numbers", "asks_scene") if key in it}
        methods[it["name"]] = MethodInfo(it["name"], it["doc"], it["role"], reads, sets, **flags)
    return methods


class Unit(Immutable):
    """The classes of a text: ``unit.Sphere``, ``unit["Sphere"]``."""

    _INSTEAD = "compile the text again where they are needed"

    def __init__(self, handle: _rtsl.Unit) -> None:
        self._classes = {it.name: Class(it) for it in handle.classes()}
        #: The warnings of the compiler.
        self.warnings: List[Diagnostic] = handle.warnings

    @property
    def classes(self) -> List[Class]:
        """The classes, in the order of the text."""
        return list(self._classes.values())

    def __getitem__(self, name: str) -> Class:
        found = self._classes.get(name)
        if found is None:
            raise KeyError(f"no class `{name}`{meant(name, self._classes)}")
        return found

    def __getattr__(self, name: str) -> Class:
        if name.startswith("_"):
            raise AttributeError(name)
        found = self._classes.get(name)
        if found is None:
            raise AttributeError(f"no class `{name}`{meant(name, self._classes)}")
        return found

    def __iter__(self) -> Iterator[Class]:
        return iter(self.classes)

    def __len__(self) -> int:
        return len(self._classes)

    def __dir__(self) -> List[str]:
        return [*super().__dir__(), *self._classes]

    def __repr__(self) -> str:
        return f"<Unit: {', '.join(self._classes) or 'no classes'}>"


PathLike = Union[str, "os.PathLike[str]"]


@checked
def compile(text: str, *, name: str = "<text>", search_path: Sequence[PathLike] = ()) -> Unit:
    """Compiles a text.

    ``name`` is what diagnostics call it; ``search_path`` are folders for `#include` and `import`.

    Raises CompileError if the text has errors: its text is what the command line prints, and ``diagnostics`` are
    they as data.
    """
    return Unit(_rtsl.compile_text(text, name, [os.fspath(it) for it in search_path]))


@checked
def compile_file(path: PathLike, *, search_path: Sequence[PathLike] = ()) -> Unit:
    """Compiles a file; `#include` and `import` search its folder first. Raises CompileError as `compile` does."""
    return Unit(_rtsl.compile_file(os.fspath(path), [os.fspath(it) for it in search_path]))
