"""Checks of arguments, with messages that say what is expected."""

from __future__ import annotations

import functools
import inspect
import operator
import sys
import warnings
from typing import Any, Callable, List, Mapping, Optional, Sequence, Tuple, Type, TypeVar, Union, cast

from ._errors import SceneWarning
from ._names import meant

_Function = TypeVar("_Function", bound=Callable[..., Any])
_Class = TypeVar("_Class", bound=type)


def size_of(value: Any) -> Optional[Tuple[int, int]]:
    """Returns columns and rows: of a tuple, a list or an array.

    >>> size_of([320, 240])
    (320, 240)
    """
    if value is None:
        return None
    try:
        if isinstance(value, (str, bytes)):
            raise TypeError
        columns, rows = (operator.index(it) for it in value)
    except (TypeError, ValueError):
        example = (value, value) if isinstance(value, int) else (1024, 768)
        raise TypeError(f"`size` is two whole numbers, columns and rows, such as {example}, not {value!r}") from None
    if columns < 1 or rows < 1:
        raise ValueError(f"`size`: a picture has at least one column and one row, not {columns} and {rows}")
    return columns, rows


def aovs_of(value: Union[str, Sequence[str]]) -> List[str]:
    """Returns the names of AOVs: one, or several.

    >>> aovs_of("normal"), aovs_of(("normal", "distance"))
    (['normal'], ['normal', 'distance'])
    """
    return [value] if isinstance(value, str) else [str(it) for it in value]


def refuse(given: Mapping[str, Any], known: Sequence[str], of: str) -> None:
    """Raises an error for a keyword that nobody takes: "render() has no keyword `sp`"."""
    for name in given:
        raise TypeError(f"{of} no keyword `{name}`{meant(name, known)}")


def keywords_of(function: Callable[..., Any]) -> List[str]:
    """Returns the names of a function's keywords."""
    fixed = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    parameters = inspect.signature(function).parameters.values()
    return [it.name for it in parameters if it.kind not in fixed and it.name not in ("self", "cls")]


def checked(function: _Function) -> _Function:
    """Lets the error about an unknown keyword of a function name the one that was probably meant."""
    known = keywords_of(function)

    @functools.wraps(function)
    def call(*arguments: Any, **keywords: Any) -> Any:
        refuse({name: it for name, it in keywords.items() if name not in known}, known, f"{function.__name__}() has")
        return function(*arguments, **keywords)

    return cast(_Function, call)


def checked_class(class_: _Class) -> _Class:
    """Lets the error about an unknown keyword of a class name the one that was probably meant."""
    known, init = keywords_of(class_), class_.__init__  # type: ignore[misc]

    @functools.wraps(init)
    def checked_init(self: Any, *arguments: Any, **keywords: Any) -> None:
        refuse({name: it for name, it in keywords.items() if name not in known}, known, f"{class_.__name__}() has")
        init(self, *arguments, **keywords)

    setattr(class_, "__init__", checked_init)
    return class_


def warn(message: str, category: Type[Warning] = SceneWarning) -> None:
    """Warns, if there is a message, at the line that called this package."""
    if not message:
        return
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and str(frame.f_globals.get("__package__")).split(".")[0] == __package__:
        level, frame = level + 1, frame.f_back
    warnings.warn(message.rstrip(), category, stacklevel=level)
