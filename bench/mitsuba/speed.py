"""Paths per second and memory: both systems take turns, since a machine's speed may waver."""

from dataclasses import replace
from statistics import median

from systems import Task


def spread(values: list[float], digits: int) -> str:
    return f"{median(values):.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def compare_speed(systems: list, task: Task, rounds: int) -> dict:
    """Prints the table of a scene with one number of threads."""
    firsts = [system.first_render(task) for system in systems]
    paths_per_second = [[] for _ in systems]
    for number in range(rounds):
        turn = replace(task, seed=task.seed + 1 + number)
        for system, speeds in zip(systems, paths_per_second):
            speeds.append(turn.paths / system.render(turn).seconds / 1e6)
    for system in systems:
        system.close()
    ratios = [one / other for one, other in zip(*paths_per_second)]
    print(
        f"\n{task.scene} by {task.integrator}, {task.size} by {task.size} pixels, "
        f"samples: {task.samples}, threads: {task.threads}"
    )
    print(f"{'':10}{'million paths a second':>28}{'first picture':>16}{'peak memory':>14}")
    for system, speeds, (seconds, run) in zip(systems, paths_per_second, firsts):
        megabytes = run.peak_memory_bytes / 1e6
        print(f"{system.name:10}{spread(speeds, 2):>28}{seconds:>14.2f} s{megabytes:>11.0f} MB")
    memories = [run.peak_memory_bytes for _, run in firsts]
    print(
        f"{'ratio':10}{spread(ratios, 2):>28}{firsts[1][0] / firsts[0][0]:>16.2f}"
        f"{memories[0] / memories[1]:>14.2f}"
    )
    return {
        "scene": task.scene,
        "integrator": task.integrator,
        "size": task.size,
        "threads": task.threads,
        "samples": task.samples,
        "million_paths_per_second": dict(zip((it.name for it in systems), paths_per_second)),
        "ratios": ratios,
        "first_picture_seconds": [seconds for seconds, _ in firsts],
        "peak_memory_bytes": memories,
    }
