"""The head of a render on a cluster: it gives out tasks, and takes their sums."""

from __future__ import annotations

import os
import time
from typing import Any, Callable, Dict, List, Mapping, Optional, Set, Tuple

from .._arguments import warn as _warn
from .._errors import InterpreterWarning, SceneError
from .._image import Image
from .._progress import Progress
from .._scene import PartialRender, Scene
from ._bundle import Bundle, begin, bundle_of
from ._engine import Cluster, Running
from ._schedule import Chain, Schedule

#: The seconds between two looks at the nodes of the cluster, and between two pictures for a callback.
_NODES_EVERY, _PICTURE_EVERY = 5.0, 2.0
#: The seconds of waiting for the end of a task, after which deadlines and interrupts are looked at.
_PATIENCE = 0.2


class Head:
    """A render on a cluster.

    The film of the head has the sums of all tasks that have ended. They take the place of those that the tiles of the
    task had, once for each task, so nothing is lost or counted twice, however often the engine tried the task.
    """

    def __init__(
        self,
        ray: Any,
        scene: Scene,
        settings: Mapping[str, Any],
        engine: Mapping[str, Any],
        *,
        threads: Optional[int] = None,
        task_seconds: float = 4.0,
        checkpoint: Optional[str] = None,
        checkpoint_every: Optional[float] = 30.0,
        resume: bool = True,
    ) -> None:
        self._start = time.monotonic()
        self.bundle: Bundle = bundle_of(scene, settings, engine)
        self.cluster = Cluster(ray, self.bundle, threads)
        self.checkpoint, self._every = checkpoint, checkpoint_every
        self._written = self._start
        text = scene._text
        assert text is not None, "`bundle_of` has looked"
        tiles, samples = text.extent(self.bundle.settings.get("size"), self.bundle.settings.get("spp"))
        self.schedule = Schedule(samples, self._slots(), task_seconds)
        self._looked = time.monotonic()
        self._running: List[Running] = []
        #: The references to the sums with which chains continue.
        self._sums: Dict[Chain, Any] = {}
        #: The processor time of each process of a node, in seconds.
        self.processor: Dict[Tuple[str, int], float] = {}
        self._slow: Set[str] = set()
        #: The seconds of each task, for benchmarks: for its samples, for preparing, and at the head.
        self.times: List[Tuple[float, float, float]] = []
        self._fetched = [0, 0]
        #: True if the checkpoint, or the picture that was shown last, is not that of the film.
        self._is_unwritten = self._is_unseen = False
        is_resumed = resume and checkpoint is not None and os.path.exists(checkpoint)
        if not is_resumed:
            for range_ in self.schedule.ranges(tiles):
                self.schedule.add(range_, 0)
            # Nodes prepare the scene while the head does.
            self._fill()
        try:
            self.render: PartialRender = begin(scene, self.bundle)[0]
            assert (self.render.tiles, self.render.samples) == (tiles, samples), "the extent is that of the render"
            if checkpoint is not None:
                if is_resumed:
                    self.render.resume(checkpoint)
                    self._plan(tiles)
                else:
                    self.render._render.check_checkpoint(checkpoint)
        except BaseException:
            self._cancel()
            raise

    def _slots(self) -> int:
        slots = self.cluster.slots()
        if slots == 0:
            raise SceneError(f"no node of the cluster has {self.cluster.threads} processors for a task: give `threads`")
        return slots

    def _plan(self, tiles: int) -> None:
        """Adds what a checkpoint leaves to do."""
        for range_ in self.schedule.ranges(tiles):
            taken = self.render.taken(range_)
            if taken is not None:
                self.schedule.add(range_, taken)

    def run(
        self,
        *,
        seconds: Optional[float] = None,
        progress: Optional[bool] = None,
        callback: Optional[Callable[[Image], Any]] = None,
    ) -> bool:
        """Renders to the end; returns false if the time was over, or the callback ended the render, before."""
        deadline = None if seconds is None else self._start + seconds
        shown = time.monotonic()
        try:
            with Progress(progress) as bar:
                while self.schedule.chains:
                    if deadline is not None and time.monotonic() >= deadline:
                        return False
                    self._look()
                    self._fill()
                    for ended in self.cluster.wait(self._running, self._patience(deadline)):
                        self._running.remove(ended)
                        self._take(ended)
                    bar.update(self.schedule.share)
                    now = time.monotonic()
                    if callback is not None and self._is_unseen and now - shown >= _PICTURE_EVERY:
                        shown, self._is_unseen = now, False
                        if callback(self.image()) is False:
                            return False
                    if self._every is not None and now - self._written >= self._every:
                        self.write_checkpoint()
            return True
        finally:
            self._cancel()
            self.write_checkpoint()

    def _patience(self, deadline: Optional[float]) -> float:
        return _PATIENCE if deadline is None else max(0.0, min(_PATIENCE, deadline - time.monotonic()))

    def _look(self) -> None:
        """Looks at the nodes from time to time: some may have come or gone."""
        now = time.monotonic()
        if now - self._looked >= _NODES_EVERY:
            self._looked = now
            # Without nodes, tasks wait for new ones.
            self.schedule.slots = max(1, self.cluster.slots())

    def _fill(self) -> None:
        """Gives out tasks: as many again as run, so that a node goes on at once when one ends."""
        while len(self._running) < 2 * self.schedule.slots:
            work = self.schedule.next()
            if work is None:
                return
            chain = work.chain
            if chain not in self._sums and chain.taken > 0:
                self._sums[chain] = self.render.sums(chain.tiles)
            self._running.append(self.cluster.start(work, self._sums.get(chain)))

    def _take(self, ended: Running) -> None:
        """Takes what a task has made."""
        result = self.cluster.result(ended)
        start = time.monotonic()
        work = ended.work
        chain = work.chain
        if result is None:
            # The sums that it continued with may be lost, too. The film has them.
            self._sums.pop(chain, None)
            self.schedule.again(work)
            return
        report, sums = result
        if report.missing:
            self.cluster.send(report.missing)
            self.schedule.again(work)
            return
        self.render.restore(sums, chain.tiles)
        self.render._render.add_counts(report.counts)
        self._is_unwritten = self._is_unseen = True
        parts = self.schedule.ended(work, report.taken, report.seconds)
        if parts or report.taken is None:
            self._sums.pop(chain, None)
        else:
            self._sums[chain] = ended.sums
        self._count(report)
        self.times.append((report.seconds, report.preparing, time.monotonic() - start))

    def _count(self, report: Any) -> None:
        self.processor[report.process] = self.processor.get(report.process, 0.0) + report.processor
        self._fetched = [sum(it) for it in zip(self._fetched, report.fetched)]
        node = report.process[0]
        if not report.is_compiled and self.bundle.engine.get("backend") != "interpreter" and node not in self._slow:
            self._slow.add(node)
            message = f"node {node} of the cluster has no LLVM, so it renders on the interpreter, slowly"
            _warn(message, InterpreterWarning)

    def _cancel(self) -> None:
        running, self._running = self._running, []
        self.cluster.cancel(running)
        for task in running:
            self.schedule.again(task.work)

    def write_checkpoint(self) -> None:
        """Writes the checkpoint, if there is one and it is not that of the film."""
        if self.checkpoint is not None and self._is_unwritten:
            self.render.write_checkpoint(self.checkpoint)
            self._written, self._is_unwritten = time.monotonic(), False

    def image(self) -> Image:
        """Returns the picture of what was taken so far."""
        picture = self.render._render.picture()
        figures = {
            "seconds": time.monotonic() - self._start,
            "threads": self.cluster.threads * len(self.processor),
            "task_seconds": self.render.seconds,
            "processor_seconds": sum(self.processor.values()),
            "tasks": len(self.times),
            "processes": len(self.processor),
            "sent_files": self.cluster.sent_files,
            "sent_bytes": self.cluster.sent_bytes,
            "fetched_files": self._fetched[0],
            "fetched_bytes": self._fetched[1],
        }
        return Image(picture, figures)


def warn(image: Image) -> None:
    """Warns about samples that were not finite."""
    _warn(image._picture.warnings)
