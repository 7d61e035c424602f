"""Looks inside shaders: what a call or a pixel does, and the costs of lines."""

from __future__ import annotations

import html
from dataclasses import dataclass, field
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

from . import _rtsl
from ._errors import Diagnostic
from ._lock import ProcessLock

#: The width of the texts of lines in tables, in characters.
_TEXT_WIDTH = 90

#: Held while a traced engine records: it records all that runs on it.
recording_lock = ProcessLock()
_traced: Dict[str, _rtsl.Engine] = {}
_counting: Dict[int, _rtsl.Engine] = {}


def traced_engine(detail: str) -> _rtsl.Engine:
    """Returns the engine that records `prints`, `calls` or `lines`. It runs methods on the interpreter, with equal bits."""
    if detail not in _traced:
        _traced[detail] = _rtsl.Engine(trace=detail)
    return _traced[detail]


def counting_engine(width: int) -> _rtsl.Engine:
    """Returns the engine that records the work of lines, for so many rays at a time."""
    if width not in _counting:
        _counting[width] = _rtsl.Engine(width=width, costs=True)
    return _counting[width]


class Recording:
    """What methods did: the lines of a trace, in the order of their execution.

    Shown as text, it is what the commands ``rtsl eval --trace`` and ``rtsl render --pixel`` print.
    """

    def __init__(self, parts: Tuple[List[str], List[str], int, Optional[Tuple[Diagnostic, str]]]) -> None:
        #: The lines, indented by their calls.
        self.lines: List[str] = parts[0]
        #: The lines that `print` wrote.
        self.prints: List[str] = parts[1]
        #: The number of entries that are not kept.
        self.dropped: int = parts[2]
        #: The diagnostic about the first value that is NaN or infinite and leaves a method; ``None`` if all are finite.
        self.not_finite: Optional[Diagnostic] = parts[3][0] if parts[3] else None
        self._report = parts[3][1] if parts[3] else ""
        #: The results of a call (`Result`); ``None`` for a pixel.
        self.result: Any = None

    def __str__(self) -> str:
        return "\n".join(self.lines + ([self._report.rstrip()] if self._report else []))

    def __repr__(self) -> str:
        problem = "" if self.not_finite is None else f", {self.not_finite.message}"
        return f"<Recording: {len(self.lines)} lines, {len(self.prints)} prints{problem}>"


@dataclass(frozen=True)
class Sample:
    """A sample of a pixel."""

    #: The index of the sample in the pixel.
    index: int
    #: The radiance, linear RGB.
    radiance: Tuple[float, float, float]
    #: The named outputs of the integrator: lists of their components.
    outputs: Dict[str, List[float]]
    #: What methods did for it.
    recording: Recording


class Pixel:
    """A pixel of a picture with its samples, of the bits that a render gives it.

    Shown as text, it is what the command ``rtsl render --pixel`` prints.
    """

    def __init__(self, position: Tuple[int, int], color: Sequence[float], samples: Sequence[Tuple[Any, ...]]) -> None:
        #: The column and the row, from the top left.
        self.position: Tuple[int, int] = position
        #: The mean of the samples, linear RGB. A sample that is not finite counts as black.
        self.color: Tuple[float, float, float] = (color[0], color[1], color[2])
        #: The samples.
        self.samples: List[Sample] = [
            Sample(index, tuple(radiance), dict(outputs), Recording(recording))
            for index, radiance, outputs, recording in samples
        ]

    @property
    def prints(self) -> List[str]:
        """The lines that `print` wrote, of all samples."""
        return [line for sample in self.samples for line in sample.recording.prints]

    @property
    def not_finite(self) -> Optional[Diagnostic]:
        """The diagnostic about the first value that is not finite; ``None`` if all are finite."""
        found = (sample.recording.not_finite for sample in self.samples)
        return next((it for it in found if it is not None), None)

    def __str__(self) -> str:
        lines = []
        for sample in self.samples:
            lines.append(f"sample {sample.index}: {sample.radiance}")
            lines += [f"  {line}" for line in str(sample.recording).splitlines()]
        x, y = self.position
        return "\n".join([*lines, f"pixel {x},{y}: {self.color}"])

    def __repr__(self) -> str:
        return f"<Pixel {self.position[0]},{self.position[1]}: {self.color}, {len(self.samples)} samples>"


@dataclass(frozen=True)
class LineCost:
    """The cost of a line of a shader."""

    #: The number of the line, from 1; 0 for work of the renderer.
    line: int
    #: The text of the line.
    text: str
    #: The estimated time for which the operations keep the execution units of a machine busy, in cycles of a path.
    cycles: float
    #: The share of the time of all lines.
    share: float
    #: The share of lanes that are on; ``None`` if all rays share the work.
    active: Optional[float]
    #: The share of conditions at which the rays of a packet diverge; ``None`` if the line has none.
    diverged: Optional[float]


@dataclass(frozen=True)
class TextCost:
    """The cost of the lines of a text."""

    #: The name of the text; empty for work of the renderer.
    name: str
    #: The share of the time of all texts.
    share: float
    #: The lines with work, in their order.
    lines: List[LineCost] = field(repr=False)
    #: The whole text.
    text: str = field(repr=False, default="")


class Costs:
    """The costs of a scene's shaders by the lines of their texts, for the rays of its picture.

    Iterating gives the texts, the dearest first. As text it is the table of ``rtsl bench SCENE --lines``; notebooks show
    the texts with the cost of each line as a colour.
    """

    def __init__(self, texts: Sequence[Tuple[Any, ...]], paths: int, width: int) -> None:
        total = sum(line[1] for _, _, lines in texts for line in lines) or 1.0
        #: The number of paths, which are samples of pixels.
        self.paths: int = paths
        #: Rays at a time.
        self.width: int = width
        #: The cycles of all lines for a path.
        self.cycles: float = total
        #: The texts, the dearest first.
        self.texts: List[TextCost] = [_text_cost(name, text or "", lines, total) for name, text, lines in texts]

    def __iter__(self) -> Iterator[TextCost]:
        return iter(self.texts)

    def __len__(self) -> int:
        return len(self.texts)

    def __getitem__(self, name: str) -> TextCost:
        """Returns the costs of the text whose name ends in this one."""
        for text in self.texts:
            if text.name.endswith(name):
                return text
        raise KeyError(f"no text `{name}`, only {', '.join(f'`{it.name}`' for it in self.texts if it.name)}")

    def dearest(self, count: int = 10) -> List[Tuple[str, LineCost]]:
        """Returns the dearest lines of shaders with the names of their texts."""
        lines = [(text.name, line) for text in self.texts if text.name for line in text.lines]
        return sorted(lines, key=lambda it: -it[1].share)[:count]

    def __str__(self) -> str:
        lines = [f"{self.paths} paths, {self.width} rays at a time; about {self.cycles:.0f} cycles a path"]
        for text in self.texts:
            lines.append(f"{100 * text.share:6.1f}%  {text.name or '(renderer)'}")
        for text in self.texts:
            if text.name:
                lines += ["", f"   cost active  diverge  {text.name}"]
                lines += [_row(line) for line in text.lines]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"<Costs: {len(self.texts)} texts, about {self.cycles:.0f} cycles a path>"

    def _repr_html_(self) -> str:
        parts = [
            f"<p>{self.paths} paths, {self.width} rays at a time; about {self.cycles:.0f} cycles a path, "
            f"{100 * sum(it.share for it in self.texts if not it.name):.1f} % of them of the renderer</p>"
        ]
        for index, text in enumerate(it for it in self.texts if it.name):
            is_open = " open" if index == 0 else ""
            parts.append(
                f"<details{is_open}><summary>{100 * text.share:.1f} % {html.escape(text.name)}</summary>"
                f"<table style='font-family:monospace;border-collapse:collapse'>{''.join(_html_rows(text))}</table></details>"
            )
        return "".join(parts)


def _text_cost(name: str, text: str, lines: Sequence[Tuple[Any, ...]], total: float) -> TextCost:
    written = text.splitlines()
    costs = [
        LineCost(
            line=line,
            text=written[line - 1] if 0 < line <= len(written) else "",
            cycles=cycles,
            share=cycles / total,
            active=active,
            diverged=diverged,
        )
        for line, cycles, active, diverged in lines
    ]
    return TextCost(name, sum(it.share for it in costs), costs, text)


def _percent(share: Optional[float]) -> str:
    return "" if share is None else f"{100 * share:.1f}%"


def _row(line: LineCost) -> str:
    shares = f"{100 * line.share:6.1f}% {_percent(line.active):>6} {_percent(line.diverged):>8}"
    return f"{shares} {line.line or '':>5}  {line.text[:_TEXT_WIDTH]}".rstrip()


def _html_rows(text: TextCost) -> Iterator[str]:
    costs = {line.line: line for line in text.lines}
    greatest = max((line.share for line in text.lines), default=1.0) or 1.0
    for number, written in enumerate(text.text.splitlines(), 1):
        line = costs.get(number)
        heat = 0.0 if line is None else (line.share / greatest) ** 0.5
        shown = "" if line is None else f"{100 * line.share:.1f}&nbsp;%"
        active = "" if line is None or line.active is None else f"{100 * line.active:.0f}&nbsp;% on"
        yield (
            f"<tr style='background:rgba(240,90,30,{0.5 * heat:.2f})'>"
            f"<td style='text-align:right'>{shown}</td><td style='text-align:right;opacity:0.6'>{active}</td>"
            f"<td style='text-align:right;opacity:0.4'>{number}</td>"
            f"<td style='text-align:left;white-space:pre'>{html.escape(written)}</td></tr>"
        )
