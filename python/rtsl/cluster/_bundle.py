"""Scenes as they are sent to other machines, and the files that those keep."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import os
import pathlib
import tempfile
import time
from typing import Any, Dict, Iterable, Iterator, List, Mapping, Optional, Tuple

from .. import _rtsl
from .._engine import Engine
from .._errors import Error, SceneError
from .._scene import PartialRender, Scene, _Source

#: The folder of files that a node keeps, and the size in GiB beyond which the oldest are deleted.
FOLDER_VARIABLE, SIZE_VARIABLE = "RTSL_CLUSTER_CACHE", "RTSL_CLUSTER_CACHE_GIB"
_USUAL_SIZE = 32.0
#: Seconds for which a file that was used is not deleted.
_IN_USE = 3600.0


@dataclasses.dataclass(frozen=True)
class SentFile:
    """A file of a scene: the path by which the scene finds it, the digest of its contents, and its size."""

    path: str
    digest: str
    size: int


@dataclasses.dataclass(frozen=True)
class Bundle:
    """A scene and all that a node needs to know to render it, besides the contents of its files."""

    #: The version of the package, which is that of the nodes.
    version: str
    #: The path of the scene's file, definitions, folders, the camera, the integrator, and whether a studio is added.
    source: _Source
    #: Parameters that were set since: numbers of parts, names and numbers.
    changes: Tuple[Any, ...]
    files: Tuple[SentFile, ...]
    #: The keywords of `Scene.begin`.
    settings: Mapping[str, Any]
    #: The keywords of `Engine`.
    engine: Mapping[str, Any]

    @property
    def key(self) -> str:
        """A text that two bundles share only if they are the same."""
        return hashlib.sha256(repr(dataclasses.astuple(self)).encode()).hexdigest()


def bundle_of(scene: Scene, settings: Mapping[str, Any], engine: Mapping[str, Any]) -> Bundle:
    """Returns the bundle of a scene that was loaded from a file."""
    text, source = scene._text, scene._source
    if text is None or source is None:
        raise SceneError("a cluster renders scenes of files: `rtsl.Scene.load` makes them")
    if scene._placed or scene.camera is not None or scene.integrator is not None or _is_lit(scene.ambient):
        raise SceneError("a cluster renders scenes as their files have them: parts were added to this one in Python")
    files = tuple(SentFile(path, *_rtsl.file_digest(path)) for path in text.files())
    changes = tuple((thing, name, tuple(numbers)) for thing, name, numbers in text.changes())
    engine = {"loop_budget": text.loop_budget, **engine}
    return Bundle(_rtsl.__version__, source, changes, files, _given(scene, settings), engine)


def _given(scene: Scene, settings: Mapping[str, Any]) -> Dict[str, Any]:
    """The settings that are given, and the usual ones of the scene that concern a picture."""
    usual = {name: it for name, it in scene.settings.items() if name in settings}
    given = {name: it for name, it in settings.items() if it is not None and it != []}
    return {**usual, **given}


def _is_lit(ambient: Any) -> bool:
    """True if an ambient light is not black."""
    numbers = ambient if isinstance(ambient, Iterable) else [ambient]
    return any(float(it) != 0.0 for it in numbers)


def begin(scene: Scene, bundle: Bundle) -> Tuple[PartialRender, bool]:
    """Prepares the render of a bundle; returns it, and whether its kernels are machine code."""
    engine = Engine(**bundle.engine)
    return scene.begin(**bundle.settings, engine=engine), engine.is_compiled


def unpack(bundle: Bundle, cache: "FileCache") -> Scene:
    """Loads the scene of a bundle from files that a node keeps."""
    scene = Scene._of_source(bundle.source, {it.path: cache.place(it.digest) for it in bundle.files})
    for thing, name, numbers in bundle.changes:
        assert scene._text is not None, "it was loaded"
        scene._text.set(thing, name, list(numbers))
    return scene


class FileCache:
    """The files that a node keeps, by the digests of their contents.

    Processes of one node share them. A file is written beside its place and renamed, so it is whole or not there.
    """

    def __init__(self, folder: Optional[str] = None) -> None:
        user = str(os.getuid()) if hasattr(os, "getuid") else "user"
        usual = os.path.join(tempfile.gettempdir(), f"rtsl-files-{user}")
        self.folder = pathlib.Path(folder or os.environ.get(FOLDER_VARIABLE) or usual)
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        # Elsewhere in a folder for all users, another one may have made it.
        if hasattr(os, "getuid") and self.folder.stat().st_uid != os.getuid():
            raise Error(f"`{self.folder}` belongs to another user: name another folder with {FOLDER_VARIABLE}")

    def place(self, digest: str) -> str:
        """Returns the path of a file."""
        return str(self.folder / digest)

    def missing(self, files: Iterable[SentFile]) -> List[SentFile]:
        """Returns those of these files that are not there or damaged, each digest once. Others count as used now."""
        distinct = {it.digest: it for it in files}
        return [it for it in distinct.values() if not self._has(it)]

    def _has(self, file: SentFile) -> bool:
        place = self.place(file.digest)
        try:
            os.utime(place)
            return _rtsl.file_digest(place) == (file.digest, file.size)
        except FileNotFoundError:
            return False

    def add(self, file: SentFile, contents: Any) -> None:
        """Writes a file. Raises an exception if the contents do not have its digest."""
        handle, beside = tempfile.mkstemp(prefix=".", dir=self.folder)
        try:
            with os.fdopen(handle, "wb") as output:
                output.write(contents)
            if _rtsl.file_digest(beside) != (file.digest, file.size):
                raise SceneError(f"`{file.path}` has changed while the scene was sent: render it again")
            os.replace(beside, self.folder / file.digest)
        except BaseException:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(beside)
            raise

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Lets one process of the node after another through, so that each file is fetched once."""
        try:
            import fcntl
        except ImportError:
            yield
            return
        with open(self.folder / ".lock", "w") as lock:
            # The system releases it when the process ends, however it does.
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield

    def trim(self) -> None:
        """Deletes the files that were not used for longest, as far as all together are too large."""
        limit = float(os.environ.get(SIZE_VARIABLE, _USUAL_SIZE)) * 2**30
        now = time.time()
        kept = []
        for entry in os.scandir(self.folder):
            with contextlib.suppress(FileNotFoundError):
                if not entry.name.startswith("."):
                    kept.append((entry.stat().st_mtime, entry.stat().st_size, entry.path))
        total = sum(size for _, size, _ in kept)
        for used, size, path in sorted(kept):
            if total <= limit or now - used < _IN_USE:
                break
            with contextlib.suppress(FileNotFoundError):
                os.unlink(path)
            total -= size
