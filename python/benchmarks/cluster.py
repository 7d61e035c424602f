"""Renders on clusters: their overhead, one and two workers, and a simulation of many nodes.

    python benchmarks/cluster.py [SCENE] [--size WxH] [--spp N] [--record FILE]

Renders a scene in this process and on local clusters of Ray with one and two processes of one thread. Then simulates
larger clusters with the schedule of the package, the recorded seconds of a sample of each tile, and the measured costs
of the head. Prints tables, and the processor's name.
"""

from __future__ import annotations

import argparse
import dataclasses
import heapq
import itertools
import json
import os
import pathlib
import platform
import statistics
import time
from typing import Any, Dict, List, Tuple

import numpy as np
import ray

import rtsl
from rtsl.cluster._head import Head
from rtsl.cluster._schedule import Schedule, Work

SCENES = pathlib.Path(__file__).parents[2] / "scenes"
#: Of the network of each node, in bytes a second: 10 Gbit/s; and the seconds for a message there and back.
BANDWIDTH, LATENCY = 1.25e9, 1e-3
#: The numbers of nodes that are simulated.
NODES = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1000)


@dataclasses.dataclass
class Costs:
    """What was measured: seconds, and bytes of the sums of a tile."""

    preparing: float
    #: For a task at the head: a part that each has, and one for each byte of its sums.
    of_task: float
    of_byte: float
    tile_bytes: float


@dataclasses.dataclass
class Row:
    """Renders in the same way: medians of seconds."""

    name: str
    seconds: float
    #: Of the processors: of all processes, and of the worker with the most.
    processor: float
    busiest: float


def row(name: str, runs: List[Tuple[float, float, float]]) -> Row:
    """Returns the medians of several runs."""
    return Row(name, *(statistics.median(it) for it in zip(*runs)))


def measured(path: pathlib.Path, keywords: Dict[str, Any], rounds: int) -> Tuple[List[Row], np.ndarray, Costs]:
    """Returns times of renders, the seconds for a sample of each tile, and the costs of the head."""
    runs = []
    for _ in range(rounds):
        # A new scene, so that each render prepares it, as those of clusters do.
        start, processor = time.monotonic(), time.process_time()
        one = rtsl.Scene.load(path).render(**keywords, aovs=["time"], threads=1, progress=False)
        used = time.process_time() - processor
        runs.append((time.monotonic() - start, used, used))
    rows = [row("one process", runs)]
    pace = one["time"][::8, ::8].astype(float).ravel() * 64e-9
    preparing = []
    for workers in (1, 2):
        ray.init(address="local", num_cpus=workers, include_dashboard=False, log_to_driver=False, logging_level="error")
        # Starts the processes of the nodes, which import the package.
        rtsl.cluster.render(path, threads=1, **{**keywords, "spp": 1}, progress=False)
        runs = []
        for round_ in range(rounds):
            start, processor = time.monotonic(), time.process_time()
            # Another seed is another render, which the processes prepare anew.
            settings = {**keywords, "seed": 10 + round_, "aovs": ["time"]}
            head = Head(ray, rtsl.Scene.load(path), settings, {}, threads=1)
            head.run(progress=False)
            head.image()
            used = time.process_time() - processor + sum(head.processor.values())
            runs.append((time.monotonic() - start, used, max(head.processor.values())))
            preparing += [it[1] for it in head.times if it[1] > 0.05]
        rows.append(row(f"{workers} worker{'s' * (workers > 1)}", runs))
        ray.shutdown()
    return rows, pace, head_costs(path, keywords, statistics.median(preparing))


def head_costs(path: pathlib.Path, keywords: Dict[str, Any], preparing: float) -> Costs:
    """Measures what a task costs the head: Ray's calls, and taking the sums."""
    render = rtsl.Scene.load(path).begin(**keywords)
    tiles = render.tiles
    sums = render.sums()
    start = time.monotonic()
    for _ in range(5):
        render.restore(sums)
    of_byte = (time.monotonic() - start) / 5 / len(sums)
    ray.init(address="local", num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="error")
    # A task that does nothing, with the sums of eight tiles.
    few = bytes(len(sums) * 8 // tiles)
    nothing = ray.remote(num_cpus=1, num_returns=2, max_retries=16)(lambda *_: (None, few))
    ray.get([it for _ in range(64) for it in nothing.remote("key", [], (0, 8), few)])
    count = 1000
    start = time.process_time()
    references = [nothing.remote("key", [], (0, 8), few) for _ in range(count)]
    while references:
        ready, _ = ray.wait([it[0] for it in references], num_returns=min(64, len(references)), timeout=1)
        ready = set(ready)
        ray.get([it for pair in references if pair[0] in ready for it in pair])
        references = [it for it in references if it[0] not in ready]
    # The processor time of the head alone: the workers here share its processors.
    of_task = (time.process_time() - start) / count
    ray.shutdown()
    return Costs(preparing, of_task, of_byte, len(sums) / tiles)


@dataclasses.dataclass
class Simulated:
    """A simulated render."""

    seconds: float
    head_busy: float
    tasks: int
    #: The seconds in which nodes render, of all of theirs until the end.
    rendering: float


def simulated(nodes: int, pace: np.ndarray, samples: int, costs: Costs, task_seconds: float = 4.0) -> Simulated:
    """Simulates a render on so many nodes of one slot, by events in the order of their times.

    The head does one thing after another: it gives out a task, or takes the sums of one. Sums come to it through one
    network, and the next task of a chain continues on any node.
    """
    until = np.concatenate([[0.0], np.cumsum(pace)])
    schedule = Schedule(samples, nodes, task_seconds)
    for range_ in schedule.ranges(len(pace)):
        schedule.add(range_, 0)
    queue: List[Work] = []
    number = itertools.count()
    events: List[Tuple[float, int, Work]] = []
    idle = [(costs.preparing, it) for it in range(nodes)]
    heapq.heapify(idle)
    head = network = busy = rendering = last = 0.0
    tasks = 0

    def start_queued(now: float) -> None:
        nonlocal rendering
        while queue and idle:
            free, node = heapq.heappop(idle)
            work = queue.pop(0)
            first, end = work.chain.tiles
            seconds = float(until[end] - until[first]) * (work.samples[1] - work.samples[0])
            bytes_ = (end - first) * costs.tile_bytes
            begun = max(now, free) + LATENCY + (bytes_ / BANDWIDTH if work.samples[0] else 0.0)
            rendering += seconds
            heapq.heappush(events, (begun + seconds, next(number), work))
            running[work] = (node, seconds)

    running: Dict[Any, Tuple[int, float]] = {}
    while True:
        while len(running) + len(queue) < 2 * nodes:
            work = schedule.next()
            if work is None:
                break
            head += costs.of_task / 2
            busy += costs.of_task / 2
            queue.append(_Hashed(work))
        start_queued(head)
        if not events:
            break
        now, _, work = heapq.heappop(events)
        node, seconds = running.pop(work)
        heapq.heappush(idle, (now, node))
        start_queued(now)
        bytes_ = (work.chain.tiles[1] - work.chain.tiles[0]) * costs.tile_bytes
        network = max(network, now) + bytes_ / BANDWIDTH
        taking = costs.of_task / 2 + costs.of_byte * bytes_
        head = max(head, network + LATENCY) + taking
        busy += taking
        tasks += 1
        last = head
        schedule.ended(work.work, None if work.samples[1] == samples else work.samples[1], seconds)
    return Simulated(last, busy / last, tasks, rendering / (nodes * last))


class _Hashed:
    """A task as a key of dictionaries."""

    def __init__(self, work: Work) -> None:
        self.work, self.chain, self.samples = work, work.chain, work.samples


def limit_of(run: Simulated, costs: Costs) -> str:
    """Names what keeps a simulated render from being faster."""
    if run.rendering > 0.8:
        return "rendering"
    if run.head_busy > 0.8:
        return "the head"
    return "preparing the scene" if costs.preparing > 0.4 * run.seconds else "the first and last tasks"


def shown(pace: np.ndarray, samples: int, costs: Costs) -> None:
    """Prints a table of simulated renders."""
    print(f"{'nodes':>6} {'seconds':>10} {'speedup':>8} {'rendering':>9} {'head':>6} {'tasks':>7}  limit")
    first = 0.0
    for nodes in NODES:
        run = simulated(nodes, pace, samples, costs)
        first = first or run.seconds
        limit = limit_of(run, costs)
        print(
            f"{nodes:6} {run.seconds:10.2f} {first / run.seconds:8.1f} {run.rendering:9.0%} {run.head_busy:6.1%} "
            f"{run.tasks:7}  {limit}"
        )


def processor() -> str:
    """The processor's name."""
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def main() -> None:
    """Measures, simulates and prints."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", type=pathlib.Path, default=SCENES / "three-spheres.pbrt")
    parser.add_argument("--size", default="480x320")
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--record", type=pathlib.Path, help="keeps what was measured, or takes it from there")
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    keywords = {"size": (width, height), "spp": given.spp, "renderer": "batch"}
    if given.record is not None and given.record.exists():
        record = json.loads(given.record.read_text(encoding="utf-8"))
    else:
        rows, pace, costs = measured(given.scene, keywords, given.rounds)
        record = {"rows": [dataclasses.asdict(it) for it in rows], "pace": pace.tolist()}
        record["costs"] = dataclasses.asdict(costs)
        if given.record is not None:
            given.record.write_text(json.dumps(record), encoding="utf-8")
    pace, costs = np.asarray(record["pace"]), Costs(**record["costs"])
    print(f"{processor()}, {os.cpu_count()} processors, Ray {ray.__version__}")
    print(f"{given.scene.name}, {width} by {height}, {given.spp} samples a pixel, one thread each")
    print(f"{'':12} {'seconds':>8} {'of processors':>14} {'busiest worker':>15}")
    for measurement in map(lambda it: Row(**it), record["rows"]):
        print(
            f"{measurement.name:12} {measurement.seconds:8.2f} {measurement.processor:14.2f} "
            f"{measurement.busiest:15.2f}"
        )
    print(
        f"head: {1e3 * costs.of_task:.2f} ms a task, {costs.tile_bytes / 1024:.1f} KiB a tile at "
        f"{1e-6 / costs.of_byte:.0f} MB/s; preparing {costs.preparing:.2f} s"
    )
    # The tiles of this picture in one of 1920 by 1080, as they are, and with samples that take a hundred times as long.
    large = np.tile(pace, max(1, (1920 * 1080) // (width * height)))
    for factor, name in ((1, "samples as measured"), (100, "samples that take a hundred times as long")):
        hours = factor * large.sum() * 4096 / 3600
        print(f"\nsimulated, 1920 by 1080, 4096 samples a pixel, {name}: {hours:.1f} hours of one node")
        shown(factor * large, 4096, costs)


if __name__ == "__main__":
    main()
