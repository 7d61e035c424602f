"""The task that nodes run."""

from __future__ import annotations

import collections
import dataclasses
import os
import time
import warnings
from typing import Any, List, Mapping, Optional, Tuple

from .. import _rtsl
from .._errors import Error
from .._scene import PartialRender
from ._bundle import Bundle, FileCache, SentFile, begin, unpack

#: The scenes that a process keeps prepared.
_KEPT = 2


@dataclasses.dataclass
class Report:
    """What a task tells besides its sums."""

    #: Files that neither the node has nor the task was given. The task did nothing then.
    missing: List[SentFile] = dataclasses.field(default_factory=list)
    #: The least number of samples of its tiles; ``None`` if none needs more.
    taken: Optional[int] = None
    #: The seconds for its samples, and for preparing the scene before.
    seconds: float = 0.0
    preparing: float = 0.0
    #: The processor time of the task, in seconds.
    processor: float = 0.0
    #: What was counted: rays, values that were not finite, seconds.
    counts: Any = None
    #: The files, and their bytes, that were fetched for the node.
    fetched: Tuple[int, int] = (0, 0)
    #: The process, and whether it has LLVM.
    process: Tuple[str, int] = ("", 0)
    is_compiled: bool = True


@dataclasses.dataclass
class _Prepared:
    render: PartialRender
    is_compiled: bool


_prepared: "collections.OrderedDict[str, _Prepared]" = collections.OrderedDict()


def task(
    key: str,
    version: str,
    bundle: List[Any],
    files: List[Any],
    tiles: Tuple[int, int],
    samples: Tuple[int, int],
    sums: Optional[bytes],
    threads: int,
) -> Tuple[Report, Optional[bytes]]:
    """Renders samples of tiles, continuing with the sums of those before them. Returns the sums.

    ``bundle`` and ``files`` have a reference each: to the bundle, and to the references to files by their digests. They
    are fetched only if the process, or its node, does not have them.
    """
    if version != _rtsl.__version__:
        raise Error(
            f"the node `{os.uname().nodename if hasattr(os, 'uname') else 'of Ray'}` has version {_rtsl.__version__} "
            f"of the package `rtsl`, and the head version {version}: install the same on both"
        )
    report = Report(process=(_node(), os.getpid()))
    start, processor = time.monotonic(), time.process_time()
    prepared = _prepared.get(key)
    if prepared is None:
        prepared = _prepare(bundle[0], files[0], report)
        if prepared is None:
            return report, None
        _prepared[key] = prepared
    _prepared.move_to_end(key)
    while len(_prepared) > _KEPT:
        _prepared.popitem(last=False)
    report.preparing = time.monotonic() - start
    render, report.is_compiled = prepared.render, prepared.is_compiled
    # A task that is tried again may find later samples of its tiles here.
    render.clear(tiles)
    if sums is not None:
        render.restore(sums, tiles)
    # Counts of a task that was cancelled are not those of this one.
    render._render.take_counts()
    start = time.monotonic()
    render.render(samples, tiles, threads=threads)
    report.seconds = time.monotonic() - start
    report.counts = render._render.take_counts()
    report.taken = render.taken(tiles)
    sums = render.sums(tiles)
    report.processor = time.process_time() - processor
    return report, sums


def _prepare(reference: Any, of_files: Any, report: Report) -> Optional[_Prepared]:
    """Prepares the scene; ``None`` if files are missing, which the report then lists."""
    import ray

    bundle: Bundle = ray.get(reference)
    cache = FileCache()
    with cache.locked():
        absent = cache.missing(bundle.files)
        files: Mapping[str, Any] = ray.get(of_files) if absent else {}
        report.missing = [it for it in absent if it.digest not in files]
        if report.missing:
            return None
        for file in absent:
            cache.add(file, ray.get(files[file.digest]))
        if absent:
            cache.trim()
    report.fetched = (len(absent), sum(it.size for it in absent))
    with warnings.catch_warnings():
        # The head loads the scene, too, and warns once.
        warnings.simplefilter("ignore")
        render, is_compiled = begin(unpack(bundle, cache), bundle)
    return _Prepared(render, is_compiled)


def _node() -> str:
    import ray

    return str(ray.get_runtime_context().get_node_id())
