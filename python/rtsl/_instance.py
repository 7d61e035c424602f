"""Instances: classes with values for their parameters, and their methods on arrays."""

from __future__ import annotations

import copy
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from . import _rtsl
from ._arguments import warn
from ._call import BoundMethod, Result
from ._classes import Class, MethodInfo, methods_of, shown
from ._copies import NotPickled
from ._engine import default_engine
from ._errors import ParameterWarning
from ._names import meant, snake_case

_OWN = ("_class", "_values", "_made", "_made_of", "_methods", "_plans")


class Instance(NotPickled):
    """A class with values for its parameters, which are attributes, as are its methods.

    An assigned value is checked at once, and compiles nothing: parameters are data. References take other instances;
    a change of these shows in the instance that refers to them.
    """

    _INSTEAD = "compile the text again where they are needed"
    _class: Class
    _values: Dict[str, Any]
    _made: Optional[_rtsl.Instance]
    _made_of: Tuple[Tuple[int, ...], List[_rtsl.Instance]]
    _methods: Optional[Dict[str, MethodInfo]]
    #: What calls of methods pass, with the engine and the instance of the extension module that it was told for.
    _plans: Dict[str, Tuple[_rtsl.Engine, _rtsl.Instance, Dict[str, Any]]]

    def __init__(self, class_: Class, values: Dict[str, Any]) -> None:
        object.__setattr__(self, "_class", class_)
        object.__setattr__(self, "_values", dict(values))
        object.__setattr__(self, "_made", None)
        object.__setattr__(self, "_made_of", ((), []))
        object.__setattr__(self, "_methods", None)
        object.__setattr__(self, "_plans", {})
        self._native()

    def _native(self) -> _rtsl.Instance:
        """Returns the instance of the extension module for the values as they are now."""
        referred: List[_rtsl.Instance] = []
        natives = {name: _native_value(value, referred) for name, value in self._values.items()}
        made, made_of = self._made, tuple(id(it) for it in referred)
        if made is None or self._made_of[0] != made_of:
            made = self._class._handle.instance(natives)
            for text in made.warnings:
                warn(text, ParameterWarning)
            object.__setattr__(self, "_made", made)
            # The referred instances are kept, so that nothing else has their identities.
            object.__setattr__(self, "_made_of", (made_of, referred))
        return made

    def _set(self, values: Dict[str, Any]) -> None:
        earlier = dict(self._values), self._made
        self._values.update(values)
        object.__setattr__(self, "_made", None)
        try:
            self._native()
        except Exception:
            object.__setattr__(self, "_values", earlier[0])
            object.__setattr__(self, "_made", earlier[1])
            raise
        object.__setattr__(self, "_methods", None)

    def set(self, **values: Any) -> "Instance":
        """Sets several parameters at once, and returns the instance. If one is not valid, none changes."""
        self._set(values)
        return self

    def copy(self, **values: Any) -> "Instance":
        """Returns an instance with the same values, except for these."""
        return Instance(self._class, {**self._values, **values})

    @property
    def parameters(self) -> Dict[str, Any]:
        """The values of all parameters by name."""
        return {name: self[name] for name in self._class.parameters}

    @property
    def methods(self) -> Dict[str, MethodInfo]:
        """The methods by name, with the state that they read and set."""
        methods = self._methods
        if methods is None:
            methods = methods_of(self._native().methods(default_engine()))
            object.__setattr__(self, "_methods", methods)
        return methods

    def rays(self, width: int, height: int, **options: Any) -> Result:
        """Returns the rays of a camera through the centres of the pixels of a picture, in rows from the top, in the
        camera's space.

        Keywords are those of calls, such as `engine`, and state, such as `lens_coord`.
        """
        columns, rows = (np.arange(width) + 0.5) / width, 1 - (np.arange(height) + 0.5) / height
        screen = np.stack(np.broadcast_arrays(columns, rows[:, np.newaxis]), axis=-1).astype(np.float32)
        sizes = {"du": 1 / width, "dv": 1 / height}
        return BoundMethod(self, "generateRay")(screen, **{**sizes, **options})

    def surface(self, hits: Result, **options: Any) -> Result:
        """Returns the surface at hits of a primitive, with all that materials read: normals of unit length, texture
        coordinates and derivatives.

        ``material.shade(sphere.surface(hits))``. Keywords are those of calls, such as `engine`.
        """
        names = self._class._handle.method_names()
        if "computeNormal" not in names:
            raise AttributeError(f"`{self._class.name}` is no primitive")
        result = BoundMethod(self, "computeNormal")(hits, **options)
        for name in ("rt_GeometricNormal", "rt_ShadingNormal"):
            normal = result._values[name]
            length = np.sqrt(np.sum(normal * normal, axis=-1, keepdims=True))
            result._values[name] = result._state[name] = normal / np.where(length > 0, length, 1)
        result._point()
        for name in ("computeTextureCoordinates", "computeDerivatives"):
            if name in names:
                further = BoundMethod(self, name)(result, **options)
                result._values.update(further._values)
                result._state.update(further._values)
        return result

    def __getitem__(self, name: str) -> Any:
        parameter = self._class.parameters.get(name)
        if parameter is None:
            raise KeyError(f"`{self._class.name}` has no parameter `{name}`{meant(name, self._class.parameters)}")
        given = self._values.get(name)
        if _refers(given):
            return given
        value = self._native().value(name)
        if value is None:
            value = parameter.default if given is None else given
        names = {number: choice for choice, number in parameter.choices}
        return names.get(value, value) if names and isinstance(value, int) else value

    def __setitem__(self, name: str, value: Any) -> None:
        if name not in self._class.parameters:
            raise KeyError(f"`{self._class.name}` has no parameter `{name}`{meant(name, self._class.parameters)}")
        self._set({name: value})

    def __getattr__(self, name: str) -> Any:
        if name in _OWN or name.startswith("__"):
            raise AttributeError(name)
        if name in self._class.parameters:
            return self[name]
        for method in self._class._handle.method_names():
            if name in (method, snake_case(method)):
                return BoundMethod(self, method)
        known = [*self._class.parameters, *map(snake_case, self._class._handle.method_names())]
        raise AttributeError(f"`{self._class.name}` has neither parameter nor method `{name}`{meant(name, known)}")

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._class.parameters:
            raise AttributeError(
                f"`{self._class.name}` has no parameter `{name}`{meant(name, self._class.parameters)}"
            )
        self._set({name: value})

    def __dir__(self) -> List[str]:
        methods = self._class._handle.method_names()
        return [*super().__dir__(), *self._class.parameters, *methods, *map(snake_case, methods)]

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={_shown(value)}" for name, value in self._values.items())
        return f"{self._class.name}({values})"

    def __copy__(self) -> "Instance":
        return self.copy()

    def __deepcopy__(self, memo: Dict[int, Any]) -> "Instance":
        return Instance(self._class, copy.deepcopy(self._values, memo))


def _shown(value: Any) -> str:
    if isinstance(value, (list, tuple)) and len(value) > 8:
        return f"[{len(value)} values]"
    return shown(value)


def _refers(value: Any) -> bool:
    return isinstance(value, Instance) or (
        isinstance(value, (list, tuple)) and len(value) > 0 and isinstance(value[0], Instance)
    )


def _native_value(value: Any, referred: List[_rtsl.Instance]) -> Any:
    """Returns a value as the extension module takes it; instances that it refers to are added to the list."""
    if isinstance(value, Instance):
        native = value._native()
        referred.append(native)
        return native
    if isinstance(value, (bool, int, float, str)) or value is None:
        return value
    if isinstance(value, (list, tuple)):
        return [_native_value(it, referred) for it in value]
    if isinstance(value, dict):
        return {name: _native_value(it, referred) for name, it in value.items()}
    if isinstance(value, np.generic):
        return value.item()
    if hasattr(value, "__dlpack__") and not isinstance(value, np.ndarray):
        value = np.from_dlpack(value)
    elif hasattr(value, "__array__") or isinstance(value, (bytearray, memoryview)):
        value = np.asarray(value)
    if not isinstance(value, np.ndarray):
        return value
    return value.item() if value.ndim == 0 else _native_array(value)


def _native_array(array: np.ndarray) -> np.ndarray:
    """Returns an array of the types of the language: floats, ints, uints and bools of 32 bits."""
    kinds = {"f": np.float32, "i": np.int32, "u": np.uint32, "b": np.bool_}
    wanted: Optional[type] = kinds.get(array.dtype.kind)
    if wanted is None:
        raise TypeError(f"an array of {array.dtype} is no value of a parameter")
    if array.dtype.kind in "iu" and array.size > 0:
        limits = np.iinfo(wanted)
        if array.min() < limits.min or array.max() > limits.max:
            raise ValueError("an array of integers has numbers of more than 32 bits")
    return np.ascontiguousarray(array, dtype=wanted).reshape(-1)
