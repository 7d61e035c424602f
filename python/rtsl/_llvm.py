"""LLVM: what a package of PyPI brings, and what was found."""

from __future__ import annotations

import importlib.metadata
import os
import re
import sys
import threading
import warnings
from typing import Any, Dict, List

from . import _rtsl
from ._errors import Error, InterpreterWarning

#: The package that ships LLVM as a shared library; the extra `llvm` installs it.
PACKAGE = "karellen-llvm-core"

_warned = threading.Event()


def suggest_installed() -> None:
    """Makes the search for LLVM begin with the library of the package, if it is installed."""
    paths = _libraries_of_package()
    if paths:
        _rtsl.suggest_llvm(paths)


def _libraries_of_package() -> List[str]:
    try:
        files = importlib.metadata.files(PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        return []
    name = re.compile(r"libLLVM[^/]*\.(so|dylib)[^/]*|LLVM-C\.dll")
    found = [str(file.locate()) for file in files if name.fullmatch(file.name)]
    return [os.path.realpath(path) for path in found if os.path.isfile(path)]


def warn_without_llvm() -> None:
    """Warns once if methods run on the interpreter."""
    if _warned.is_set():
        return
    _warned.set()
    if "error" not in _rtsl.llvm_info():
        return
    chosen = os.environ.get("RTSL_LLVM")
    if chosen:
        # Engines report it as an error: nobody asked for the interpreter.
        text = f"RTSL_LLVM names `{chosen}`, which is no LLVM that RTSL can use"
    else:
        text = f"no LLVM was found, so that RTSL runs on its interpreter, hundreds of times slower: {remedy()}"
    warnings.warn(text, InterpreterWarning, stacklevel=3)


def remedy() -> str:
    """Returns what gives this machine an LLVM."""
    if sys.platform.startswith("linux") and os.uname().machine == "x86_64":
        return "`pip install 'rtsl[llvm]'` brings it"
    return "install a shared libLLVM of version 17 or newer, or name one by the environment variable RTSL_LLVM"


def info() -> Dict[str, Any]:
    """Returns what this installation has: versions, the LLVM in use, and the processor that it compiles for.

    ``llvm`` is a version, or ``None`` if methods run on the interpreter; ``remedy`` then tells what to do.
    """
    from ._engine import default_engine

    found = _rtsl.llvm_info()
    try:
        width = default_engine().width
    except Error:
        width = None
    return {
        "rtsl": _rtsl.__version__,
        "llvm": found.get("version"),
        "path": found.get("path") and str(found["path"]),
        "processor": found.get("processor"),
        "width": width,
        "threads": os.cpu_count(),
        "remedy": None if "version" in found else f"{found['error']}\n{remedy()}",
    }
