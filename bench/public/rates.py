"""Paths per second, memory, and the times until a first tile or picture."""

import tempfile
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from statistics import geometric_mean, median

import pictures
from renderers import FIRST_THREADS, FirstTile, Mitsuba, Picture, Rtsl
from speed import spread
from systems import read_exr


@dataclass
class Rates:
    """What is measured of one scene; parts that were not asked for are empty."""

    scene: str
    # Million paths per second of each turn, by system.
    speeds: dict[str, list[float]] = field(default_factory=dict)
    peak_memory_bytes: dict[str, int] = field(default_factory=dict)
    # The mean luminance of each system's picture.
    means: dict[str, float] = field(default_factory=dict)
    first_tile: FirstTile | None = None
    cached_tile: FirstTile | None = None
    # Seconds until Mitsuba's picture with one sample.
    first_picture: float | None = None
    remarks: list[str] = field(default_factory=list)

    def ratios(self, rival: str = "Mitsuba") -> list[float]:
        """RTSL's speed over that of another system, turn by turn."""
        pairs = zip(self.speeds.get("RTSL", []), self.speeds.get(rival, []))
        return [one / other for one, other in pairs]

    def ratio_of_means(self, rival: str = "Mitsuba") -> float | None:
        if rival not in self.means or self.means[rival] == 0:
            return None
        return self.means["RTSL"] / self.means[rival]

    def as_dict(self) -> dict:
        return asdict(self) | {"ratios": self.ratios(), "ratio_of_means": self.ratio_of_means()}


def measure_speed(
    renderers: list, task: Picture, rounds: int, work: Path, sheet: Path, rates: Rates
):
    """Lets the systems take turns, since a machine's speed may waver. The pictures of the last turn
    are compared and shown."""
    for renderer in renderers:
        # Its first render compiles, and tells the memory.
        _, run = renderer.first_render(task)
        rates.peak_memory_bytes[renderer.name] = run.peak_memory_bytes
        rates.speeds[renderer.name] = []
    files = {it.name: work / f"{it.name}.exr" for it in renderers}
    for number in range(rounds):
        turn = replace(task, seed=task.seed + 1 + number)
        for renderer in renderers:
            out = files[renderer.name] if number == rounds - 1 else None
            seconds = renderer.render(turn, out).seconds
            rates.speeds[renderer.name].append(turn.paths / seconds / 1e6)
    renders = {name: read_exr(path) for name, path in files.items()}
    rates.means = {name: pictures.luminance(render) for name, render in renders.items()}
    pictures.write_sheet(list(renders.values()), sheet)


def measure_first(rtsl: Rtsl, mitsuba: Mitsuba, task: Picture, work: Path, rates: Rates) -> None:
    """The times until RTSL's first tile, with an empty cache of kernels and then with what that run
    left in it, and until Mitsuba's picture of one sample."""
    with tempfile.TemporaryDirectory(dir=work) as cache:
        rates.first_tile = rtsl.first_tile(task, Path(cache))
        rates.cached_tile = rtsl.first_tile(task, Path(cache))
    single = replace(task, samples=1, threads=FIRST_THREADS)
    rates.first_picture, _ = mitsuba.first_render(single)
    mitsuba.close()


COLUMNS = (
    f"{'RTSL Mpaths/s':>14}{'Mitsuba':>9}{'ratio':>22}{'means':>7}"
    f"{'first tile (load + compile + build)':>38}{'cached':>8}{'Mitsuba first':>15}"
    f"{'RTSL MB':>9}{'Mitsuba MB':>12}"
)
PBRT_COLUMNS = f"{'pbrt':>8}{'ratio':>22}{'means':>7}"
NOTHING = "-"


def header(width: int, has_pbrt: bool) -> str:
    return f"{'scene':{width}}{COLUMNS}{PBRT_COLUMNS if has_pbrt else ''}"


def cell(value: float | None, digits: int, width: int, unit: str = "") -> str:
    return f"{NOTHING if value is None else f'{value:.{digits}f}{unit}':>{width}}"


def speed_of(rates: Rates, name: str) -> float | None:
    speeds = rates.speeds.get(name)
    return median(speeds) if speeds else None


def memory_of(rates: Rates, name: str) -> float | None:
    found = rates.peak_memory_bytes.get(name)
    return found / 1e6 if found else None


def row(rates: Rates, width: int, has_pbrt: bool) -> str:
    """The row of a scene."""
    ratios, first, cached = rates.ratios(), rates.first_tile, rates.cached_tile
    parts = NOTHING
    if first:
        parts = (
            f"{first.seconds:.2f} s ({first.load:.2f} + {first.compile:.2f} + {first.build:.2f})"
        )
    cells = [
        f"{rates.scene:{width}}",
        cell(speed_of(rates, "RTSL"), 3, 14),
        cell(speed_of(rates, "Mitsuba"), 3, 9),
        f"{spread(ratios, 2) if ratios else NOTHING:>22}",
        cell(rates.ratio_of_means(), 3, 7),
        f"{parts:>38}",
        cell(cached.seconds if cached else None, 2, 8, " s"),
        cell(rates.first_picture, 2, 15, " s"),
        cell(memory_of(rates, "RTSL"), 0, 9),
        cell(memory_of(rates, "Mitsuba"), 0, 12),
    ]
    if has_pbrt:
        ratios = rates.ratios("pbrt")
        cells += [cell(speed_of(rates, "pbrt"), 3, 8)]
        cells += [f"{spread(ratios, 2) if ratios else NOTHING:>22}"]
        cells += [cell(rates.ratio_of_means("pbrt"), 3, 7)]
    return "".join(cells)


def summary(all_rates: list[Rates], rival: str = "Mitsuba") -> str | None:
    """The geometric mean of the ratios of all scenes, and the lowest."""
    ratios = {it.scene: median(it.ratios(rival)) for it in all_rates if it.ratios(rival)}
    if not ratios:
        return None
    lowest = min(ratios, key=ratios.get)
    mean = geometric_mean(ratios.values())
    return (
        f"RTSL to {rival}: geometric mean of {len(ratios)} ratios {mean:.2f}, "
        f"lowest {ratios[lowest]:.2f} ({lowest})"
    )
