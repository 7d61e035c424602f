"""Calls of methods for arrays, and their results."""

from __future__ import annotations

import copy
import functools
import inspect
import math
from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Mapping, Optional, Tuple

import numpy as np

from . import _rtsl
from ._arrays import Lanes, Shape, mask_rows, output_array, output_rows, rows_of, scalar_or_array
from ._copies import NotPickled
from ._engine import default_engine
from ._errors import Error
from ._host import Host
from ._looking import Recording, recording_lock, traced_engine
from ._names import POSITIONAL, meant, snake_case

if TYPE_CHECKING:
    from ._instance import Instance

#: What the point of a hit is computed from.
_RAY = ("rt_RayOrigin", "rt_RayDirection", "rt_HitDistance")
_KINDS = {"float": np.float32, "int": np.int32, "uint": np.uint32}


class Result(NotPickled, Mapping[str, Any]):
    """The results of a call: arrays by the names of state variables, as items and as attributes.

    ``result.hit_distance``, ``result["hit_distance"]`` and ``result["rt_HitDistance"]`` are the same array. Given to
    another call as an argument, a result passes on the state of its rays, with its scratch to methods of the same
    instance; a result of `intersect` also passes its ``hit`` as the mask.
    """

    _INSTEAD = "`dict(result)` has its arrays"

    def __init__(self, values: Dict[str, np.ndarray], state: Dict[str, Any], shape: Shape) -> None:
        self._values = values
        self._state = {**state, **values}
        self._shape = shape
        self._hit: Optional[np.ndarray] = None
        # The rays that further calls are for.
        self._mask: Optional[np.ndarray] = None
        self._scratch: Optional[np.ndarray] = None
        # The class whose methods take the scratch, and the plan of the call.
        self._class: Any = None
        self._plan: Dict[str, Any] = {}

    @property
    def shape(self) -> Shape:
        """The shape of the rays; empty for one ray."""
        return self._shape

    @property
    def hit(self) -> Any:
        """For each ray, true if `intersect` accepted a hit."""
        if self._hit is None:
            raise AttributeError("only `intersect` has `hit`")
        return scalar_or_array(self._hit)

    @property
    def hit_point(self) -> Any:
        """The points of the hits: origins and distances along directions."""
        return scalar_or_array(self._point())

    def _point(self) -> np.ndarray:
        if "rt_HitPoint" not in self._state:
            if any(name not in self._state for name in _RAY):
                raise AttributeError("the result has no rays with hits")
            origin, direction, distance = (np.asarray(self._state[name], np.float32) for name in _RAY)
            with np.errstate(invalid="ignore"):
                self._state["rt_HitPoint"] = origin + distance[..., np.newaxis] * direction
        return np.asarray(self._state["rt_HitPoint"])

    @property
    def state(self) -> Dict[str, Any]:
        """The state of the rays: what the call was given and what it set, by the names of the language."""
        return dict(self._state)

    @property
    def scratch(self) -> Dict[str, Any]:
        """The scratch that the call left, by the names of members; parts of structs are `member.part`."""
        if self._scratch is None:
            return {}
        found = {}
        for name, first, count, scalar in self._plan["scratch"]:
            words = self._scratch[first : first + count]
            typed = words != 0 if scalar == "bool" else words.view(_KINDS[scalar])
            inner = () if count == 1 else (count,)
            found[name] = scalar_or_array(np.ascontiguousarray(typed.T).reshape(self._shape + inner))
        return found

    def __getitem__(self, name: str) -> Any:
        if name == "hit" and self._hit is not None:
            return self.hit
        for known, value in self._values.items():
            if name in (known, snake_case(known)):
                return scalar_or_array(value)
        raise KeyError(f"no result `{name}`{meant(name, self)}")

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        for known, value in self._state.items():
            if name in (known, snake_case(known)):
                return scalar_or_array(np.asarray(value))
        raise AttributeError(f"no result `{name}`{meant(name, self)}")

    def __copy__(self) -> "Result":
        copied = Result.__new__(type(self))
        copied.__dict__.update(self.__dict__)
        return copied

    def __deepcopy__(self, memo: Dict[int, Any]) -> "Result":
        copied = self.__copy__()
        for name in ("_values", "_state", "_hit", "_mask", "_scratch"):
            setattr(copied, name, copy.deepcopy(getattr(self, name), memo))
        return copied

    def __iter__(self) -> Iterator[str]:
        if self._hit is not None:
            yield "hit"
        yield from map(snake_case, self._values)

    def __len__(self) -> int:
        return len(self._values) + (self._hit is not None)

    def __dir__(self) -> List[str]:
        return [*super().__dir__(), *map(snake_case, self._state)]

    def __repr__(self) -> str:
        return f"Result({', '.join(f'{name}: {np.shape(self[name])}' for name in self)})"


_HELP = """\
A method of an instance, called for arrays of rays.

Positional arguments set the state variables that the documentation of the method lists first; keywords set any
state variable of its role, by either of its names. Each is one value for all rays, or an array with one for each
ray; results of earlier calls may be among the positional arguments. Arrays of 32-bit floats are read where they
are, whatever their strides.

Further keywords:
    mask: an array of bools; other rays are left out, and keep the defaults of what the method sets.
    out: arrays for results, by names; the others are made.
    host: the answers to what the method asks (`Host`).
    engine: the engine, instead of the default one.
    threads: the number of threads, all processors if ``None``; results do not depend on it.
"""


class BoundMethod:
    # A method of an instance; `__doc__` describes the method, and then what `_HELP` says of all.

    def __init__(self, instance: "Instance", name: str) -> None:
        self._instance = instance
        self._name = name

    @property
    def info(self) -> Any:
        """The description of the method (`MethodInfo`)."""
        return self._instance.methods[self._name]

    @property
    def __doc__(self) -> str:  # type: ignore[override]
        return f"{self.info.help()}\n\n{_HELP}"

    @property
    def __name__(self) -> str:
        return snake_case(self._name)

    @property
    def __signature__(self) -> inspect.Signature:
        kinds = inspect.Parameter
        positional = [kinds(snake_case(it), kinds.POSITIONAL_OR_KEYWORD, default=None) for it in self._positional()]
        names = ("mask", "out", "host", "engine", "threads")
        options = [kinds(name, kinds.KEYWORD_ONLY, default=None) for name in names]
        return inspect.Signature([*positional, *options, kinds("state", kinds.VAR_KEYWORD)])

    def __repr__(self) -> str:
        return f"<method {snake_case(self._name)} of {self._instance!r}>"

    def _role(self) -> str:
        roles = self._instance._class.roles
        return next((role for role in roles if (role, self._name) in POSITIONAL), "")

    def _positional(self) -> Tuple[str, ...]:
        return POSITIONAL.get((self._role(), self._name), ())

    def __call__(
        self,
        *arguments: Any,
        mask: Any = None,
        out: Optional[Mapping[str, Any]] = None,
        host: Optional[Host] = None,
        engine: Optional[_rtsl.Engine] = None,
        threads: Optional[int] = None,
        **state: Any,
    ) -> Result:
        engine = engine or default_engine()
        native = self._instance._native()
        plan = self._plan(engine, native)
        earlier, given = self._given(arguments, state)
        known = _variables(self._role())
        lanes = Lanes()
        wanted = self._wanted(plan, {**_state_of(earlier), **given})
        for name, value in given.items():
            lanes.add(name, value, known[name], f"`{snake_case(name)}`")
        for result in earlier:
            lanes.add_shape(result.shape)
        if mask is not None:
            lanes.add_shape(np.shape(mask))
        shape = lanes.shape()
        for name in wanted:
            if name not in given:
                lanes.add(name, _state_of(earlier)[name], known[name], f"`{snake_case(name)}`")
        if mask is None:
            mask = next((it._mask for it in reversed(earlier) if it._mask is not None), None)
        return self._call(
            engine, native, plan, lanes, shape, earlier, given,
            wanted=wanted, mask=mask, out=dict(out or {}), host=host, threads=threads,
        )

    def trace(self, *arguments: Any, detail: str = "calls", **keywords: Any) -> Recording:
        """Calls the method as `__call__` does, and records what it does: meant for one ray.

        The detail is `prints`, `calls` with the state that methods read and set, or `lines` with the values of variables.
        The recording has the `result` of the call, of the same bits as without a trace.

        >>> import rtsl
        >>> text = 'class Half : rt_Texture; void lookup() { print("u {}", rt_TextureUV.x); rt_FloatTextureValue = 0.5; }'
        >>> half = rtsl.compile(text, name="half.rtsl").Half()
        >>> half.lookup.trace(texture_uv=(0.25, 0)).prints
        ['half.rtsl:1: Half.lookup: u 0.25']
        """
        engine = traced_engine(detail)
        with recording_lock:
            engine.start()
            try:
                result = self(*arguments, engine=engine, threads=1, **keywords)
            finally:
                parts = engine.take()
        recording = Recording(parts)
        recording.result = result
        return recording

    def _plan(self, engine: _rtsl.Engine, native: _rtsl.Instance) -> Dict[str, Any]:
        """Returns what calls pass, which the extension module tells once for each instance and engine."""
        plans = self._instance._plans
        known = plans.get(self._name)
        if known is None or known[0] is not engine or known[1] is not native:
            known = plans[self._name] = (engine, native, native.call_plan(engine, self._name))
        return known[2]

    def _given(self, arguments: Tuple[Any, ...], state: Dict[str, Any]) -> Tuple[List[Result], Dict[str, Any]]:
        """Returns the earlier results among the arguments, and the state that they set by the names of the language."""
        earlier = [it for it in arguments if isinstance(it, Result)]
        values = [it for it in arguments if not isinstance(it, Result)]
        positional = self._positional()
        if len(values) > len(positional):
            names = ", ".join(map(snake_case, positional)) or "none"
            raise TypeError(
                f"{snake_case(self._name)}() takes {len(positional)} positional arguments ({names}), "
                f"{len(values)} were given"
            )
        given = {name: value for name, value in zip(positional, values) if value is not None}
        aliases = _aliases(self._role())
        if self._name == "generateRay":
            # The pixels of a square picture: cameras fit their angle of view to its sides.
            state = {"rt_du": 1.0, "rt_dv": 1.0, **{aliases.get(name, name): it for name, it in state.items()}}
        for name, value in state.items():
            variable = aliases.get(name)
            if variable is None:
                raise TypeError(f"{snake_case(self._name)}() has no argument `{name}`{meant(name, aliases)}")
            if variable in given:
                raise TypeError(f"{snake_case(self._name)}() has two values for `{name}`")
            given[variable] = value
        return earlier, given

    def _wanted(self, plan: Dict[str, Any], state: Dict[str, Any]) -> List[str]:
        """Returns the names of the state that the call passes to the method."""
        reads = {name for name, _ in plan["reads"]}
        # What a method sets and may leave: where it does, the host's value remains.
        reads.update(name for name, _ in plan["sets"] if name == "rt_HitDistance")
        if "rt_InverseRayDirection" in reads:
            reads.add("rt_RayDirection")
        if "rt_ShadingNormal" in reads and "rt_ShadingNormal" not in state:
            reads.add("rt_GeometricNormal")
        if "rt_TextureUVW" in reads and "rt_TextureUVW" not in state:
            reads.add("rt_HitPoint")
        if "rt_HitPoint" in reads and "rt_HitPoint" not in state:
            reads.update(_RAY)
        return [name for name in state if name in reads]

    def _call(
        self,
        engine: _rtsl.Engine,
        native: _rtsl.Instance,
        plan: Dict[str, Any],
        lanes: Lanes,
        shape: Shape,
        earlier: List[Result],
        given: Dict[str, Any],
        *,
        wanted: List[str],
        mask: Any,
        out: Dict[str, Any],
        host: Optional[Host],
        threads: Optional[int],
    ) -> Result:
        count = math.prod(shape)
        outputs = {}
        for name, components in plan["sets"]:
            given_out = out.pop(name, None)
            given_out = out.pop(snake_case(name), given_out)
            outputs[name] = (output_array(given_out, shape, components, snake_case(name)), components)
        hit = None
        if self._name == "intersect":
            hit = out.pop("hit", None)
            hit = np.empty(shape, np.bool_) if hit is None else hit
            if hit.shape != shape or hit.dtype != np.bool_:
                raise ValueError(f"out['hit']: expected an array of bools of shape {shape}")
        if out:
            known = [*map(snake_case, outputs), *(["hit"] if hit is not None else [])]
            raise TypeError(f"{snake_case(self._name)}() sets no {', '.join(f'`{it}`' for it in out)}, only {known}")
        arrays = plan["scratch_arrays"]
        scratch_in = self._scratch_of(earlier, plan, shape)
        scratch_out = np.empty((arrays, count), np.uint32) if arrays > 0 and plan["leaves_scratch"] else None
        _rtsl.call(
            engine,
            native,
            self._name,
            count,
            [it for it in lanes.rows(shape) if it[0] in wanted],
            [(name, output_rows(array, shape, components)) for name, (array, components) in outputs.items()],
            scratch=scratch_in,
            scratch_out=scratch_out,
            hit=None if hit is None else hit.reshape(count, 1).view(np.uint8),
            mask=mask_rows(mask, shape),
            host=None if host is None else host._answers(),
            threads=threads,
        )
        carried = {**_state_of(earlier), **given}
        result = Result({name: array for name, (array, _) in outputs.items()}, carried, shape)
        result._hit = hit
        result._mask = hit if hit is not None else mask
        result._class = self._instance._class
        result._plan = plan
        result._scratch = scratch_out if scratch_out is not None else scratch_in
        return result

    def _scratch_of(self, earlier: List[Result], plan: Dict[str, Any], shape: Shape) -> Optional[np.ndarray]:
        """Returns the scratch that an earlier call of the same class left for the rays."""
        for result in reversed(earlier):
            is_same = result._class is self._instance._class and result._plan["program"] == plan["program"]
            if is_same and result._scratch is not None and result.shape == shape:
                return result._scratch
        return None


def _state_of(results: List[Result]) -> Dict[str, Any]:
    state: Dict[str, Any] = {}
    for result in results:
        state.update(result._state)
    return state


@functools.lru_cache(maxsize=None)
def _variables(role: str) -> Dict[str, int]:
    """Returns the state variables of a role with the numbers of their components."""
    return dict(_rtsl.state_variables(role))


@functools.lru_cache(maxsize=None)
def _aliases(role: str) -> Dict[str, str]:
    """Returns the names of the language of a role's state variables, by these and the names in Python."""
    names = _variables(role)
    return {**{name: name for name in names}, **{snake_case(name): name for name in names}}
