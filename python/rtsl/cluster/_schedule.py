"""The order of the tasks of a render.

The samples of a pixel are summed one after another in binary64, so sums of samples that were made apart would have
other bits. A *chain* is therefore a range of tiles whose tasks follow each other, each continuing with the sums of the
task before it. Chains do not depend on each other.

This module knows no engine: `benchmarks/cluster.py` simulates larger clusters with it.
"""

from __future__ import annotations

import dataclasses
import heapq
import math
from typing import List, Optional, Set, Tuple

from .._rtsl import WAVEFRONT_SAMPLES

#: Chains for each slot, so that slots stay busy while the head takes the sums of a task.
_CHAINS_OF_SLOT = 4
#: The fewest and most tiles of a chain at first: the first task, of one wavefront, is worth its way, and not long.
_FEWEST_TILES, _MOST_TILES = 8, 2048
#: The shortest task that is worth its way, in seconds, and the seconds for each slot that it has at least: the head,
#: which takes a task in less than a millisecond, must keep up with all.
_SHORTEST, _SHORTEST_OF_SLOT = 0.25, 2e-3


@dataclasses.dataclass(eq=False)
class Chain:
    """Tiles whose tasks follow each other."""

    tiles: Tuple[int, int]
    #: The least number of samples of its tiles.
    taken: int
    #: The samples of its last task, and the seconds that one of them took; none before the first.
    step: int = 0
    pace: float = 0.0

    @property
    def count(self) -> int:
        """The number of tiles."""
        return self.tiles[1] - self.tiles[0]


@dataclasses.dataclass
class Work:
    """A task: samples of the tiles of a chain."""

    chain: Chain
    samples: Tuple[int, int]


class Schedule:
    """The chains of a render, and what each does next.

    `slots` is the number of tasks that the cluster runs at once, and may change.
    """

    def __init__(self, samples: int, slots: int, task_seconds: float) -> None:
        self.samples = samples
        self.slots = slots
        self.task_seconds = task_seconds
        self._waiting: List[Tuple[int, float, int, Chain]] = []
        self._running: Set[Chain] = set()
        #: Samples of tiles, and those that are done.
        self._total = self._done = 0
        #: The seconds and samples of tiles that are left of chains whose pace is known.
        self._left_seconds, self._left_samples = 0.0, 0

    def ranges(self, tiles: int) -> List[Tuple[int, int]]:
        """Returns the ranges of a picture's tiles that become chains."""
        count = min(_CHAINS_OF_SLOT * self.slots, tiles // _FEWEST_TILES)
        count = max(1, count, math.ceil(tiles / _MOST_TILES))
        ends = [tiles * it // count for it in range(count + 1)]
        return list(zip(ends, ends[1:]))

    def add(self, tiles: Tuple[int, int], taken: int) -> None:
        """Adds a chain, whose tiles have so many samples."""
        chain = Chain(tiles, taken)
        self._wait(chain)
        self._total += chain.count * (self.samples - taken)

    def _wait(self, chain: Chain) -> None:
        # Those with the fewest samples first, so that the picture is even; among them, those that take longest.
        heapq.heappush(self._waiting, (chain.taken, -chain.pace, chain.tiles[0], chain))

    @property
    def chains(self) -> int:
        """The number of chains that are not done."""
        return len(self._waiting) + len(self._running)

    @property
    def running(self) -> int:
        """The number of tasks that were given out."""
        return len(self._running)

    @property
    def share(self) -> float:
        """The part of the work that is done."""
        return self._done / self._total if self._total else 1.0

    def next(self) -> Optional[Work]:
        """Returns the next task; ``None`` if all chains run or are done."""
        if not self._waiting:
            return None
        chain = heapq.heappop(self._waiting)[-1]
        self._running.add(chain)
        return Work(chain, (chain.taken, self._end(chain)))

    def _end(self, chain: Chain) -> int:
        """The end of the samples of a chain's next task."""
        left = self.samples - chain.taken
        if chain.pace == 0.0:
            count = WAVEFRONT_SAMPLES
        else:
            # A first measurement contains what is made once, so tasks grow by factors.
            count = min(int(self._seconds() / chain.pace), 4 * chain.step)
        # Wavefronts begin at multiples of their size, where noise is estimated.
        end = chain.taken + max(count, 1)
        end = max(end // WAVEFRONT_SAMPLES, chain.taken // WAVEFRONT_SAMPLES + 1) * WAVEFRONT_SAMPLES
        return self.samples if left <= 1.25 * (end - chain.taken) else end

    def _seconds(self) -> float:
        """The seconds that a task should take: fewer towards the end, so that all slots end together."""
        return max(self._shortest(), min(self.task_seconds, self._rest() / 2))

    def _shortest(self) -> float:
        return max(_SHORTEST, _SHORTEST_OF_SLOT * self.slots)

    def _rest(self) -> float:
        """The seconds that the rest of the render takes, by the paces that are known."""
        if self._left_samples == 0:
            return 0.0
        return self._left_seconds / self._left_samples * (self._total - self._done) / self.slots

    def _leave(self, chain: Chain, sign: int) -> None:
        """Counts what is left of a chain, or counts it no more."""
        if chain.pace > 0.0:
            left = self.samples - chain.taken
            self._left_seconds += sign * chain.pace * left
            self._left_samples += sign * chain.count * left

    def ended(self, work: Work, taken: Optional[int], seconds: float) -> List[Chain]:
        """Takes the end of a task, after which its tiles have `taken` samples, or need no more.

        Returns the chains that take its place, if it was split because slots would be free.
        """
        chain = work.chain
        self._running.remove(chain)
        before = chain.taken
        self._leave(chain, -1)
        self._done += chain.count * ((self.samples if taken is None else taken) - before)
        if taken is None:
            return []
        chain.step = max(1, taken - before)
        chain.pace = max(seconds, 1e-6) / chain.step
        chain.taken = taken
        self._leave(chain, 1)
        parts = self._parts(chain)
        for part in parts:
            self._wait(part)
        return parts if len(parts) > 1 else []

    def again(self, work: Work) -> None:
        """Takes back a task that was not done."""
        self._running.remove(work.chain)
        self._wait(work.chain)

    def _parts(self, chain: Chain) -> List[Chain]:
        """A chain, or its halves: if there are too few chains for the slots, or it takes most of the rest's time."""
        left = chain.pace * (self.samples - chain.taken)
        is_needed = self.chains < 2 * self.slots or left > self._rest() / 2
        if chain.count < 2 or left < 2 * self._shortest() or not is_needed:
            return [chain]
        first, end = chain.tiles
        middle = (first + end) // 2
        halves = []
        for tiles in ((first, middle), (middle, end)):
            pace = chain.pace * (tiles[1] - tiles[0]) / chain.count
            halves.append(Chain(tiles, chain.taken, chain.step, pace))
        return halves
