"""Files of results: CSV files as `docs/data` has them, and JSON."""

import csv
import json
import platform
import re
import subprocess
import sys
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path
from statistics import median

import perf
from convergence import RelativePoint
from perf import Profile
from rates import Rates


@dataclass(frozen=True)
class Origin:
    """The lines before each table."""

    machine: str
    software: str
    command: str

    def lines(self, unit: str) -> list[str]:
        day = date.today().isoformat()
        pairs = {"date": day, "machine": self.machine, "software": self.software}
        pairs |= {"command": self.command, "unit": unit}
        return [f"# {name}: {value}" for name, value in pairs.items()]


def machine(threads: int) -> str:
    """The processor and its vectors, as `lscpu` reports them."""
    try:
        text = subprocess.run(["lscpu"], capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        text = ""
    model = re.search(r"^Model name:\s*(.+)$", text, re.MULTILINE)
    family = re.search(r"^CPU family:\s*(\d+)$", text, re.MULTILINE)
    name = model.group(1).strip() if model else platform.processor() or platform.machine()
    vectors = "AVX-512" if "avx512f" in text else "AVX2" if "avx2" in text else platform.machine()
    kind = f"family {family.group(1)}, {vectors}" if family else vectors
    return f"{threads} thread{'s' if threads > 1 else ''} of an {name} ({kind})"


def command_line(folder: Path) -> str:
    """The command, without what names places of this machine."""
    words, is_place = ["bench/public/compare.py"], False
    for word in sys.argv[1:]:
        is_option = word in ("--rtsl", "--pbrt", "--out", "--environment")
        if not is_option and not is_place:
            words.append(folder.name if Path(word) == folder else word)
        is_place = is_option
    return " ".join(words)


def write_csv(path: Path, lines: list[str], columns: list[str], rows: list[list]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        file.write("".join(f"{line}\n" for line in lines))
        table = csv.writer(file, lineterminator="\n")
        table.writerow(columns)
        table.writerows(rows)


def figure(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def megabytes(rates: Rates, name: str) -> str:
    found = rates.peak_memory_bytes.get(name)
    return figure(found / 1e6 if found else None, 0)


def write_speed(all_rates: list[Rates], rivals: list[str], unit: str, origin: Origin, out: Path):
    columns = ["scene", "RTSL, million paths/s"]
    for rival in rivals:
        columns += [f"{rival}, million paths/s", f"ratio to {rival}", "range of the ratio"]
        columns += ["ratio of mean luminance"]
    columns += [f"{name}, peak memory (MB)" for name in ("RTSL", *rivals)]
    rows = []
    for rates in (it for it in all_rates if it.ratios()):
        cells = [rates.scene, figure(median(rates.speeds["RTSL"]), 3)]
        for rival in rivals:
            ratios = rates.ratios(rival)
            range_ = f"{min(ratios):.2f} to {max(ratios):.2f}"
            cells += [figure(median(rates.speeds[rival]), 3), figure(median(ratios), 2), range_]
            cells += [figure(rates.ratio_of_means(rival), 3)]
        rows.append(cells + [megabytes(rates, name) for name in ("RTSL", *rivals)])
    write_csv(out / "public-speed.csv", origin.lines(unit), columns, rows)


def write_first(all_rates: list[Rates], unit: str, origin: Origin, out: Path) -> None:
    columns = ["scene", "RTSL, first tile (s)", "reading (s)", "compiling (s)", "building (s)"]
    columns += ["RTSL, first tile with cached kernels (s)", "Mitsuba, first picture (s)"]
    rows = []
    for rates in (it for it in all_rates if it.first_tile and it.cached_tile):
        first, cached = rates.first_tile, rates.cached_tile
        seconds = first.seconds, first.load, first.compile, first.build, cached.seconds
        rows.append([rates.scene, *(figure(it, 2) for it in (*seconds, rates.first_picture))])
    write_csv(out / "public-first.csv", origin.lines(unit), columns, rows)


def write_profile(profiles: list[Profile], unit: str, origin: Origin, out: Path) -> None:
    columns = ["scene", *(perf.TITLES[name] for name in perf.CLASSES), "compiler of a whole run"]
    rows = [
        [it.scene, *(figure(100 * it.parts[name], 0) for name in perf.CLASSES),
         figure(100 * it.compiler_of_run, 0)]
        for it in profiles
    ]  # fmt: skip
    write_csv(out / "public-profile.csv", origin.lines(unit), columns, rows)


def write_error(points: list[RelativePoint], unit: str, origin: Origin, out: Path) -> None:
    columns = ["scene", "system", "samples", "seconds", "error", "relative error"]
    rows = [
        [
            it.scene,
            it.system,
            it.samples,
            f"{it.seconds:.4g}",
            f"{it.error:.4g}",
            f"{it.relative:.4g}",
        ]
        for it in points
    ]
    write_csv(out / "public-error.csv", origin.lines(unit), columns, rows)


def write_json(
    all_rates: list[Rates],
    profiles: list[Profile],
    points: list[RelativePoint],
    origin: Origin,
    out: Path,
) -> None:
    content = asdict(origin) | {"date": date.today().isoformat()}
    content["scenes"] = [it.as_dict() for it in all_rates]
    content["profiles"] = [asdict(it) for it in profiles]
    content["errors"] = [asdict(it) for it in points]
    text = json.dumps(content, indent=2) + "\n"
    (out / "public.json").write_text(text, encoding="utf-8")
